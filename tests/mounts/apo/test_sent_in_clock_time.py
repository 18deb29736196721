"""Random slews as they go to a controller whose clock is off and gains: its own cubics keep the limits."""

from itertools import pairwise
from types import SimpleNamespace

import pytest
from apo_slews import as_printed, largest, random_slews

from mounts.apo.axis import ControlledAxis
from mounts.apo.clock_offset import ClockLine
from mounts.apo.node_queue import PathNode
from mounts.apo.settings import AxisSettings

BEGIN = 1_800_000_000.25


class Noted:
    """A controller that takes all it is given."""

    def __init__(self):
        self.nodes = []

    def ask(self, what):
        position, velocity, time = what.arguments
        self.nodes.append(tuple(map(as_printed, (time, position, velocity))))
        return SimpleNamespace(asked=0.0, received=0.0)

    def line_time(self, _what):
        return 0.0


@pytest.mark.parametrize("gain", [0.0, 20e-6, -3e-6, 300e-6])
def test_limits_hold_in_a_clock_that_is_off_and_gains(gain):
    over = [0.0] * 3
    for _, slew in random_slews(3, 200):
        controller = Noted()
        axis = ControlledAxis(controller, AxisSettings("azimuth", "AZ", -180.0, 360.0, 1.75, 0.1, 0.5), "apo")
        axis.offset = SimpleNamespace(line=ClockLine(BEGIN - 3.2, 0.0123, gain))
        way = slew.model.profile(slew.start, slew.start_rate, slew.end, slew.end_rate)
        axis.send_path([PathNode(BEGIN + node.time, *node[1:]) for node in way.nodes], 1000)
        assert len(controller.nodes) == len(way.nodes)
        for pair in pairwise(controller.nodes):
            beyond = (found / limit - 1.0 for found, limit in zip(largest(*pair), slew.planned, strict=True))
            over = [max(each) for each in zip(over, beyond, strict=True)]
    print(f"gain {gain:g}: over the planning limits of velocity, acceleration and jerk by {over}")
    assert max(over) < 1e-4
