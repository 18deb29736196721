"""What this version cannot apply is refused with a sentence, never left out silently."""

import math

import pytest

from clockdrive import assembly
from clockdrive.configuration import load
from clockdrive.drives import kind_of
from clockdrive.errors import ConfigurationError
from pointing.mount import MountType

AWR = {"drive.kind": "awr", "drive.link": "COM3"}


@pytest.mark.parametrize(
    ("given", "missing"),
    [
        ({"axis2.steps_per_degree": 4000.0}, "sidereal_steps_per_s is missing.*printed on the calibration sheet"),
        ({"drive.sidereal_steps_per_s": 50.0}, "axis2.steps_per_degree is missing.*the calibration sheet"),
    ],
)
def test_what_only_the_factory_knows_is_asked_for_with_where_it_stands(given, missing):
    with pytest.raises(ConfigurationError, match=missing):
        load(None, {}, AWR | given)


@pytest.mark.parametrize("kind", ["equatorial-fork", "german", "altaz-fork"])
@pytest.mark.parametrize("latitude", [-42.4, 51.5])
def test_a_planner_has_what_the_configuration_says(kind, latitude):
    values = {"mount.type": kind, "site.latitude_deg": latitude, "mount.mount_x_mas": 3_600_000}
    configuration = load(None, {}, values)
    planner = assembly.planner(configuration)
    assert planner.mount.type is MountType.from_text(kind)
    assert math.degrees(planner.mount.latitude) == pytest.approx(latitude)
    assert math.degrees(planner.mount.x) == pytest.approx(1.0)
    for axis, section in zip(planner.axes, configuration.axes, strict=True):
        inward = math.degrees(axis.minimum) - section.min_deg, section.max_deg - math.degrees(axis.maximum)
        assert all(0.0 < short <= 258 * axis.gearing.step_deg_float for short in inward)  # the unit keeps 16 bits
        assert math.degrees(axis.gearing.angle(0x800000)) == pytest.approx(section.centre_deg)
    assert math.isinf(planner.past_meridian) == (kind != "german")


def test_the_law_of_motion_is_that_of_the_registers():
    configuration = load(None, {}, {"axis1.acceleration_register": 52, "drive.slew_idle": "per-axis"})
    timing = kind_of(configuration).timing(configuration)
    assert [model.acceleration for model in timing.slew] == [52, 26]
    assert not timing.together
