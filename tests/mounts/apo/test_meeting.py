import math

import pytest

from mounts.apo.meeting import meet
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import AxisSettings
from mounts.apo.slew_model import ApoSlewModel
from mounts.errors import DriveRefused

BEGIN = 1_800_000_000.25
LEAD = 1.5
AZIMUTH = AxisSettings("axis1", "AZ", -180.0, 360.0, 1.75, 0.1, 0.5)
MODEL = ApoSlewModel(AZIMUTH.max_speed_deg_s, AZIMUTH.acceleration_deg_s2, AZIMUTH.jerk_deg_s3)


def met(where, *, rate=0.0, place=10.0, arrival=None):
    line = PathNode(BEGIN, place, rate)
    return line, meet(AZIMUTH, line, BEGIN + LEAD, where, arrival, MODEL.meeting)


def state(node):
    return node.position, node.velocity


def displaced(by, rate):
    return lambda when: (10.0 + by + rate * (when - BEGIN), rate)


@pytest.mark.parametrize("rate", [0.0, 0.004, 0.1, 0.5, 1.0])
def test_a_path_that_is_displaced_is_met_as_soon_ahead_as_behind_at_any_speed(rate):
    """Four phases of jerk j over a distance d take (32 d/j)^(1/3), beside the path."""
    soon = (32.0 * 0.005 / (0.999 * 0.5)) ** (1.0 / 3.0)
    for by in (-0.005, 0.005):
        line, found = met(displaced(by, rate), rate=rate)
        first, last = found.nodes[0], found.nodes[-1]
        assert first.time == BEGIN + LEAD
        assert first.position == line.at(first.time)
        assert found.arrival - first.time == pytest.approx(soon, abs=1e-5)
        assert state(last) == pytest.approx(displaced(by, rate)(last.time), abs=1e-12)


def test_an_axis_that_could_be_there_sooner_than_planned_drifts_on_and_begins_later():
    arrival = BEGIN + 60.0
    line, found = met(displaced(20.0, 0.004), rate=0.003, arrival=arrival)
    first, last = found.nodes[0], found.nodes[-1]
    print(f"begins {first.time - BEGIN:.3f} s later, arrives {last.time - arrival:+.1e} s beside the plan")
    assert first.time > BEGIN + 20.0
    assert state(first) == (line.at(first.time), 0.003)
    assert last.time == pytest.approx(arrival, abs=3e-6)
    assert state(last) == pytest.approx(displaced(20.0, 0.004)(last.time), abs=1e-12)


def test_an_arrival_that_was_planned_too_early_is_as_early_as_can_be():
    where = displaced(20.0, 0.004)
    assert met(where, arrival=BEGIN + 3.0)[1] == met(where)[1]


def test_a_way_out_of_the_travel_is_refused_with_axis_value_and_bound():
    with pytest.raises(DriveRefused, match=r"axis1: the way leads to 36\d\.\d{4}°, outside -180° to 360°; `stop`"):
        met(displaced(340.0, 0.0), rate=1.7, place=350.0)


def test_a_path_that_is_too_fast_is_refused_with_axis_and_bound():
    with pytest.raises(DriveRefused, match=r"axis1: the target moves at 2°/s.*0\.999 of 1\.75°/s.*wait"):
        met(displaced(1.0, 2.0))


def test_a_satellite_that_is_fastest_right_now_is_met_as_it_slows_down():
    def where(when):  # 2.5°/s at first
        u = (when - BEGIN) / 40.0
        return 60.0 + 100.0 * math.atan(u), 2.5 / (1.0 + u * u)

    _, found = met(where)
    last = found.nodes[-1]
    print(f"met after {last.time - BEGIN:.1f} s at {last.velocity:.3f}°/s")
    assert state(last) == pytest.approx(where(last.time), abs=1e-7)
