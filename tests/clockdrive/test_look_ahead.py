"""A way that leads out of what is allowed is left in time to come to rest inside."""

import math

import pytest
from orbit import Overhead
from telescope_bench import Witness, telescope

from pointing.trajectory import Trajectory


@pytest.mark.parametrize("beyond_deg", [1.0, 30.0])
def test_a_bridge_that_would_cross_a_limit_is_never_followed_to_it(beyond_deg, tmp_path):
    """The keyhole of an altazimuth whose travel ends on the other side of it: full speed towards the limit."""
    with telescope(tmp_path, mount__type="altaz-fork", axis1__min_deg=-200.0, axis1__max_deg=200.0) as scope:
        target = Overhead(scope.clock.now() + 150.0, math.radians(60.0), math.radians(0.05))
        scope.goto(target)
        planner, pursuit = scope._session.planner, scope._session.pursuit
        ahead = Trajectory(
            planner, target, pursuit.posture, planner.angles(scope._session.reading.counts), pursuit._leading
        )
        ahead.extend(scope.clock.now())
        ahead.extend(scope.clock.now() + 200.0)
        begin, end = ahead.bridges[0].begin, ahead.bridges[0].end
        swept = [math.degrees(ahead.angles(time)[0][0]) for time in (begin, end)]
        edge = swept[1] + math.copysign(beyond_deg, swept[0] - swept[1])  # inside the sweep
        axis = planner.axes[0]
        low, high = sorted((math.radians(edge), math.radians(swept[0] + math.copysign(60.0, swept[0] - swept[1]))))
        narrow = type(axis)(axis.name, axis.gearing, low, high)
        planner.axes = (narrow, planner.axes[1])
        planner.free = (narrow, planner.free[1])
        witness, least = Witness(scope), math.inf
        while scope.clock.now() < end + 20.0:
            scope.wait(0.1)
            angle = witness.angles(witness.now())[0]
            least = min(least, math.degrees(min(angle - low, high - angle)))
        status = scope.status()
        print(
            f"sweep from {swept[0]:.1f}° to {swept[1]:.1f}°, limit at {edge:.1f}°: at least {least:.3f}° of room left"
        )
        assert least > 0.0
        assert status["doing"] == "idle"
        assert "before it would lead out" in status["trouble"]
