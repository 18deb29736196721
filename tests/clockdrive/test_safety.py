"""Where axes come to rest, against constant acceleration integrated step by step."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from clockdrive.safety import rests_at
from mounts.drive import AxisReading, Reading

A, TOP, STEP_S = 3800.0, 16_000.0, 1e-4  # counts/s², counts/s
PERIOD_S = 0.1


@dataclass(frozen=True)
class Integrated:
    """A drive that brakes as late as it can."""

    max_rate: float = TOP

    def limited(self, max_rate):
        return Integrated(min(max_rate, self.max_rate))

    def travel(self, start, end, start_rate, _end_rate):
        x, v, places = start, start_rate, [start]
        while len(places) < 40_000 and (abs(end - x) > 1.0 or abs(v) > A * STEP_S):
            wanted = math.copysign(min(self.max_rate, math.sqrt(2.0 * A * abs(end - x))), end - x)
            v += max(-A * STEP_S, min(A * STEP_S, wanted - v))
            x += v * STEP_S
            places.append(x)
        return Way(np.array(places))


@dataclass(frozen=True)
class Way:
    places: np.ndarray

    @property
    def duration(self):
        return (self.places.size - 1) * STEP_S

    @property
    def landed(self):
        return float(self.places[-1])

    def position(self, elapsed):
        return float(np.interp(elapsed, np.arange(self.places.size) * STEP_S, self.places))


def rest_by_hand(rate, speed):
    """Under way to a speed for two periods, then braked."""
    seconds = 2.0 * PERIOD_S
    ramp = min(abs(speed - rate) / A, seconds)
    sense = math.copysign(A, speed - rate)
    reached = rate + sense * ramp
    gone = rate * ramp + sense * ramp * ramp / 2.0 + reached * (seconds - ramp)
    return gone + reached * abs(reached) / (2.0 * A)


@pytest.mark.parametrize(
    ("rate", "speed"), [(0.0, -6000.0), (-700.0, -1200.0), (-700.0, -6000.0), (300.0, 9000.0), (0.0, 500.0)]
)
def test_an_axis_under_way_to_a_speed_is_taken_where_it_rests_then_and_not_from_its_speed_now(rate, speed):
    reading = Reading(0.0, (AxisReading(1e6, 0.0, rate, slewing=True), AxisReading(2e6, 0.0, 0.0, slewing=False)))
    models = (Integrated(), Integrated())
    hastened, still = rests_at(reading, models, PERIOD_S, (speed, 0.0))
    kept, _ = rests_at(reading, models, PERIOD_S)
    print(f"{rate:g} to {speed:g} counts/s: rests {hastened - 1e6:.1f} counts on, at its speed now {kept - 1e6:.1f}")
    assert hastened - 1e6 == pytest.approx(rest_by_hand(rate, speed), rel=0.02, abs=3.0)
    assert abs(hastened - 1e6) > abs(kept - 1e6)
    assert still == pytest.approx(2e6, abs=2.0)


@pytest.mark.parametrize(("rate", "speed"), [(-700.0, -300.0), (-700.0, 0.0), (-2000.0, 500.0)])
def test_an_axis_that_slows_down_is_taken_as_if_it_kept_its_rate(rate, speed):
    reading = Reading(0.0, (AxisReading(0.0, 0.0, rate, slewing=True), AxisReading(0.0, 0.0, 0.0, slewing=False)))
    models = (Integrated(), Integrated())
    assert rests_at(reading, models, PERIOD_S, (speed, 0.0)) == rests_at(reading, models, PERIOD_S)
