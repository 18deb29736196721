"""What plans and rates say of an AWR Microstep: its drive registers, how finely they go, and what is too fast."""

from fractions import Fraction

import pytest

from clockdrive import parse
from clockdrive.configuration import load
from clockdrive.drives.awr.kind import axes
from clockdrive.errors import InputError
from clockdrive.planning import counted, drift_of, plan_from, rates_at
from pointing.errors import Unreachable

T0 = 1_800_000_000.0
AWR = {"drive.kind": "awr"}
REAL = AWR | {
    "drive.link": "serial:///dev/null",
    "drive.sidereal_steps_per_s": 50.0,
    "axis2.steps_per_degree": 12000.0,
}
REAL |= {"axis2.steps_per_degree": 12000.0, "site.latitude_deg": -42.4, "site.longitude_deg": 173.7}
SIDEREAL_ARCSEC_S = 1296000.0 / 86164.0905


@pytest.mark.parametrize(("index", "arcsec_s"), [(0, 15.041), (0, 14.4), (1, -0.4), (1, 1.7), (0, 45.0)])
def test_a_rate_has_the_register_that_comes_nearest_and_says_how_far_the_next_is(index, arcsec_s):
    axis = axes(load(None, {}, AWR))[index]
    told = axis.words.of_rate(axis, arcsec_s / 206264.80624709636)
    flags = int(told["drive_flags"], 16)
    per_step = Fraction(SIDEREAL_ARCSEC_S) / 50 if index == 0 else Fraction(3600, 12000)

    def made(counts):
        steps = Fraction(50 * 18000 * 4, counts * (flags >> 8))
        return float(steps * per_step) * (1 if flags & 2 else -1)

    counts = told["drive_counts"]
    assert told["drive_register"] == ("drive_ra", "drive_dec")[index]
    assert flags & 1
    assert made(counts) - arcsec_s == pytest.approx(told["drive_off_arcsec_s"], abs=2e-7)
    assert abs(made(counts) - arcsec_s) <= min(abs(made(counts + each) - arcsec_s) for each in (-1, 1))
    assert told["drive_next_arcsec_s"] == pytest.approx(abs(made(counts - 1) - made(counts)), abs=2e-7)


def test_rates_without_the_words_of_the_unit_are_ratios_to_its_sidereal_one():
    moon = rates_at(load(None, {}, REAL), "Moon", T0).json["axes"][0]
    assert moon["drive_counts_ratio"] == pytest.approx(50.0 / abs(moon["rate_counts_s"]), abs=1e-6)
    assert "drive_counts" not in moon


def test_what_would_be_followed_faster_than_four_times_sidereal_is_refused_by_the_plan():
    configuration = load(None, {}, AWR | {"limits.sun_avoidance_deg": 0.0})
    start = (0, -508800)
    plan_from(configuration, "hadec:-10,-40", T0, start, drift=drift_of((30.0, 0.0), None))
    with pytest.raises(Unreachable, match=r"axis1 tracks at 0\.029\d*°/s, the drive reaches 0\.017°/s"):
        plan_from(configuration, "hadec:-10,-40", T0, start, drift=drift_of((80.0, 0.0), None))


def test_steps_of_a_start_are_counted_from_where_the_axes_stand_at_their_centre():
    limits = counted(load(None, {}, AWR))
    assert parse.counts("0,-508800", *limits) == (0, -508800)
    with pytest.raises(InputError, match="from -2147483648 to 2147483647"):
        parse.counts("0,9999999999", *limits)
