"""Earth orientation against astropy's reading of the same table, and beyond its ends."""

import math
import random
import time
import warnings
from itertools import pairwise

import pytest

from pointing import earth_orientation as module
from pointing.earth_orientation import earth_orientation
from pointing.instant import Instant

ARCSEC = math.pi / 648000


@pytest.fixture(scope="module")
def iers():
    from astropy.utils import iers as astropy_iers
    from astropy_iers_data import IERS_A_FILE

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return astropy_iers.IERS_A.open(IERS_A_FILE)


def test_agrees_with_astropy_over_the_whole_table(iers):
    rng = random.Random(5)  # noqa: S311 - nothing secret
    first, last = module._range()
    worst = [0.0, 0.0]
    stated = dict(zip(iers["MJD"].value.astype(int), iers["e_UT1_UTC_A"].to_value("s"), strict=True))
    for _ in range(400):
        # Not on a day that ends in a leap second, whose fraction of a day astropy counts otherwise.
        day, fraction = rng.randrange(first, last), rng.randrange(64) / 64
        if abs(module._value(day + 1)[0] - module._value(day)[0]) > 0.5:
            continue
        dut1, xp, yp, note, error = earth_orientation(Instant.from_utc(day, fraction * 86400))
        jd = (2400000.5 + day, fraction)
        x, y = (angle.to_value("rad") for angle in iers.pm_xy(*jd))
        assert note == ""
        assert error == pytest.approx(stated[day], abs=1e-9)
        worst[0] = max(worst[0], abs(dut1 - iers.ut1_utc(*jd).to_value("s")))
        worst[1] = max(worst[1], abs(xp - x) / ARCSEC, abs(yp - y) / ARCSEC)
    print(f"worst against astropy: dut1 {worst[0]:.1e} s, pole {worst[1]:.1e}″")
    assert worst[0] < 1e-9
    assert worst[1] < 1e-9


def test_ut1_is_continuous_through_a_leap_second():
    # UT1 − UTC jumps by a second at the end of 2016, UT1 does not.
    moments = [Instant.from_utc_iso("2016-12-31T23:59:58Z").plus(s) for s in (0.0, 1.0, 1.9, 2.0, 2.1, 3.0, 4.0)]
    ut1 = [day * 86400 + seconds + earth_orientation(i).dut1 for i in moments for day, seconds in [i.utc()]]
    lapses = [b - a for a, b in pairwise(ut1)]
    assert lapses == pytest.approx([1.0, 0.9, 0.1, 0.1, 0.9, 1.0], abs=1e-4)


def test_after_the_table_the_last_value_holds_and_the_note_says_how_wrong_it_may_be():
    _, last = module._range()
    at_end = earth_orientation(Instant.from_utc(last, 0.0))
    soon, late = (earth_orientation(Instant.from_utc(day, 100.0)) for day in (last + 100, 200000))
    assert soon[:3] == late[:3] == at_end[:3]
    assert at_end.note == ""
    assert 0.005 < at_end.dut1_error <= soon.dut1_error < late.dut1_error == 0.9
    assert "0.12″ (0.0079 s)" in soon.note
    assert "14″ (0.9 s)" in late.note
    assert "astropy-iers-data" in late.note


def test_before_the_table_the_first_value_holds():
    early = earth_orientation(Instant.from_utc_iso("1960-01-01"))
    assert early.dut1 == pytest.approx(0.8075)
    assert "outside its table" in early.note


def test_reading_a_day_takes_a_tenth_of_a_millisecond():
    module._range()
    best = math.inf
    for day in range(58000, 58030):
        begin = time.perf_counter()
        module._day.__wrapped__(day)
        best = min(best, time.perf_counter() - begin)
    print(f"one day's rows: {best * 1e6:.0f} µs")
    assert best < 1e-3
