import random
from datetime import UTC, datetime

import pytest
from astropy.time import Time

from mounts.apo import tai

NEW_YEAR_2017 = 1_483_228_800.0  # POSIX; a leap second went before it, and made TAI − UTC 37 s
QUANTUM = 2.4e-7  # of a POSIX time in a float


def by_astropy(posix):
    """TAI seconds of the day from another reading of the calendar and its leap seconds."""
    told = Time(datetime.fromtimestamp(posix, UTC).isoformat()[:26], scale="utc").tai
    return ((told.jd1 - 0.5) % 1.0 + told.jd2) % 1.0 * 86400.0


def test_seconds_of_the_day_are_those_of_another_library_from_1972_on():
    rng = random.Random(1)  # noqa: S311 - nothing secret
    times = [rng.uniform(63_072_000.0, 1_830_000_000.0) for _ in range(300)]
    worst = max(abs((tai.seconds_of_day(t) - by_astropy(t) + 43200.0) % 86400.0 - 43200.0) for t in times)
    print(f"TAI seconds of the day within {worst:.1e} s of astropy")
    assert worst < 2e-6  # the calendar is written to a microsecond
    assert tai.leap_seconds(2_840_000_000.0) == 37  # as many as are known


def test_times_of_nodes_keep_all_their_digits():
    for k in range(64):
        posix = 1_800_057_580.0 + k + k * 2.0**-20
        assert tai.seconds_of_day(posix) == (posix - 1_800_057_600.0 + 37.0) % 86400.0


def test_midnight_in_tai_is_37_seconds_before_midnight_in_utc():
    midnight = 1_800_057_600.0 - 37.0
    assert tai.seconds_of_day(midnight) == 0.0
    assert tai.seconds_of_day(midnight - 0.25) == 86399.75
    assert tai.posix(86399.75, midnight + 3.0) == midnight - 0.25
    assert tai.posix(0.25, midnight - 3.0) == midnight + 0.25


def test_a_leap_second_passes_in_tai_while_posix_time_repeats():
    before, after = tai.seconds_of_day(NEW_YEAR_2017 - 0.5), tai.seconds_of_day(NEW_YEAR_2017)
    assert (before, after) == (35.5, 37.0)  # 23:59:59.5 and, 1.5 s later, 00:00:00
    for near in (-3.0, -0.5, 0.0, 0.5, 3.0):
        for of_day, told in ((34.5, -1.5), (35.5, -0.5), (36.5, -0.5), (37.0, 0.0), (37.5, 0.5), (40.0, 3.0)):
            assert tai.posix(of_day, NEW_YEAR_2017 + near) == pytest.approx(NEW_YEAR_2017 + told, abs=QUANTUM)


def test_there_and_back_is_the_same_time_for_a_clock_up_to_half_a_day_off():
    rng = random.Random(2)  # noqa: S311 - nothing secret
    for _ in range(300):
        posix = rng.uniform(1.0e9, 2.2e9)
        assert tai.posix(tai.seconds_of_day(posix), posix + rng.uniform(-43_000.0, 43_000.0)) == pytest.approx(
            posix, abs=2.0 * QUANTUM
        )


@pytest.mark.parametrize(
    ("offset", "kept"),
    [
        (-37.0, "UTC"),
        (-36.8, "UTC"),
        (-19.1, "GPS time"),
        (-1.0, "TAI of a leap second ago"),
        (-37.0 - 7 * 3600.0, "local time"),
        (-37.0 + 2 * 3600.0, "local time"),
        (86400.0 - 37.0, "UTC"),
        (-5.0, ""),
        (0.5, ""),
        (3600.0, ""),
    ],
)
def test_a_clock_in_another_scale_is_named(offset, kept):
    assert tai.wrong_scale(offset, 1_800_000_000.0) == kept


def test_a_clock_in_utc_is_named_before_the_last_leap_second_too():
    assert tai.wrong_scale(-36.0, NEW_YEAR_2017 - 10.0) == "UTC"
