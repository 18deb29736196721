"""Lines that lead to another axis than they should: refused with what was told, or told apart from a stale file."""

import itertools

import pytest

from mounts.apo.connecting import Setting
from mounts.apo.exchanged import exchanged
from mounts.apo.settings import AxisSettings
from mounts.apo.simulator_settings import HARDWARE

NAMES = ("azimuth", "altitude", "rotator")


def configured(kind):
    return [
        AxisSettings(name, "", h.lowest_deg, h.highest_deg, h.velocity, h.acceleration, h.jerk)
        for name, h in zip(NAMES, HARDWARE[kind], strict=True)
    ]


def told(axis, low=None, high=None, speed=None):
    """What a controller tells that is asked for one axis's settings; only what is given."""
    rows = (("lower soft limit", low, axis.lowest_deg), ("upper soft limit", high, axis.highest_deg))
    limits = [Setting(axis.name, name, value, own, "deg", "") for name, value, own in rows if value is not None]
    return [*limits, *([Setting(axis.name, "MAXV", speed, axis.max_speed_deg_s, "deg/s", "")] if speed else [])]


def said(axes, order, **only):
    """What is said when each line leads to the axis of this order."""
    there = [axes[i] for i in order]
    found = [
        told(
            own,
            *((at.lowest_deg, at.highest_deg) if only.get("limits", True) else (None, None)),
            at.max_speed_deg_s if only.get("speed", True) else None,
        )
        for own, at in zip(axes, there, strict=True)
    ]
    return exchanged(axes, [""] * len(axes), found)


@pytest.mark.parametrize("kind", ["apo", "sdss"])
@pytest.mark.parametrize("only", [{}, {"limits": False}, {"speed": False}])
def test_every_exchange_of_axes_that_differ_is_found_and_none_is_where_each_is_in_its_place(kind, only):
    axes = configured(kind)
    assert said(axes, (0, 1, 2), **only) == ""
    for order in list(itertools.permutations(range(3)))[1:]:
        speeds = [axis.max_speed_deg_s for axis in axes]
        if only.get("limits", True) or [speeds[i] for i in order] != speeds:
            assert "as if the two were exchanged; nothing was moved: check `link`" in said(axes, order, **only)


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_a_configuration_that_is_not_up_to_date_is_no_exchange(kind):
    axes = configured(kind)
    for i, low, high, speed in itertools.product(range(3), (0.0, 25.0), (0.0, -40.0), (1.0, 0.3, 1.5)):
        found = [told(axis, axis.lowest_deg, axis.highest_deg, axis.max_speed_deg_s) for axis in axes]
        own = axes[i]
        found[i] = told(own, own.lowest_deg + low, own.highest_deg + high, own.max_speed_deg_s * speed)
        assert exchanged(axes, [""] * 3, found) == ""


def test_a_controller_that_calls_itself_another_axis_is_refused_by_its_name():
    axes = configured("apo")
    found = [[], [], []]
    assert exchanged(axes, ["code 3.1 AZ axis.ini", "code 3.1 ALT", "ROT"], found) == ""
    text = exchanged(axes, ["code 3.1 axis.ini", "code 3.1 rot axis.ini", ""], found)
    assert text.startswith("the controller of altitude calls itself that of the rotator ('code 3.1 rot axis.ini')")
