import csv
import os
import random
import time

import pytest

from mounts.tc410.axis import FRACTION_BITS, SimulatedAxis
from mounts.tc410.slew import LandingLaw

CENTRE = 0x800000 << FRACTION_BITS
MOVES = 10_000 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 2000


def axis_of(law, start=CENTRE, velocity=0):
    return SimulatedAxis(
        start,
        velocity=velocity,
        acceleration=law.acceleration,
        deceleration=law.deceleration,
        top=law.max_velocity,
    )


def random_move(rng):
    """A law, a start, a velocity (any way, perhaps too fast to stop) and a target within reach."""
    law = LandingLaw.from_registers(rng.randint(1, 255), rng.randint(1, 255), rng.randint(0x10, 0xFFFF) << 8)
    start = CENTRE + rng.randrange(1 << FRACTION_BITS)
    velocity = rng.choice([0, 13873, rng.randint(-20000, 20000), rng.randint(-law.max_velocity, law.max_velocity)])
    distance = rng.choice([-1, 1]) * int(10 ** rng.uniform(0, 6))
    return law, start, velocity, ((start >> FRACTION_BITS) + distance) << FRACTION_BITS


def slew(axis, target):
    axis.target = target
    axis.begin_slew()
    return axis.slew(1 << 40)


@pytest.mark.campaign
def test_planner_and_simulator_agree_to_the_tick_and_land_on_the_count():
    rng = random.Random(410)  # noqa: S311
    ticks = overshot = against = 0
    began = time.perf_counter()
    for _ in range(MOVES):
        law, start, velocity, target = random_move(rng)
        axis = axis_of(law, start, velocity)
        move = law.move(start, velocity, target)
        stop_at = rng.randrange(move.ticks + 1)
        axis.target = target
        axis.begin_slew()
        axis.slew(stop_at)
        assert axis.position == move.position(stop_at), (law, start, velocity, target, stop_at)
        assert axis.slew(1 << 40) == move.ticks - stop_at, (law, start, velocity, target)
        assert axis.position == move.position(move.ticks) == target
        assert not axis.slewing
        ticks += move.ticks
        against += velocity * (target - start) < 0
        turns = {phase.velocity > 0 for phase in move.phases if phase.velocity}
        overshot += len(turns) == 2 and velocity * (target - start) > 0
    seconds = time.perf_counter() - began
    print(
        f"{MOVES} moves, {ticks} ticks, {against} begun against, {overshot} too fast to stop: equal, {seconds:.1f} s"
    )
    assert overshot
    assert against


def test_worked_moves_take_exactly_their_ticks(shared):
    with (shared / "data" / "tc410_moves.csv").open() as file:
        for row in csv.DictReader(file):
            counts, acceleration, deceleration, top, velocity, ticks = (int(value) for value in row.values())
            axis = axis_of(LandingLaw.from_registers(acceleration, deceleration, top), velocity=velocity)
            axis.upper = (1 << 60) - 1
            assert slew(axis, CENTRE + (counts << FRACTION_BITS)) == ticks


def test_jumping_through_constant_velocity_equals_stepping():
    rng = random.Random(7)  # noqa: S311
    for _ in range(20):
        law, start, velocity, target = random_move(rng)
        leaping, stepping = axis_of(law, start, velocity), axis_of(law, start, velocity)
        for axis in (leaping, stepping):
            axis.target = target
            axis.upper = CENTRE + (rng.choice([5000, 1 << 30]) << FRACTION_BITS) if axis is leaping else leaping.upper
            axis.begin_slew()
        taken = leaping.slew(3000)
        assert sum(stepping.slew(1) for _ in range(taken)) == taken
        stepping.slew(0 if leaping.slewing else 1)  # a limit reached is noticed when the next tick begins
        assert leaping == stepping
        for wanted in (13873, -90000, 0):
            leaping.follow(wanted, 700)
            for _ in range(700):
                stepping.follow(wanted, 1)
            assert leaping == stepping


def test_velocities_ramp_by_the_same_registers_as_the_closed_form():
    law = LandingLaw.from_registers(26, 80, 0xFFFFFF)
    for velocity, wanted in [(0, 13873), (13873, -13873), (-500000, 20), (300000, 100), (7, -7)]:
        axis = axis_of(law, velocity=velocity)
        ramp = law.ramp(velocity, wanted)
        axis.follow(wanted, ramp.ticks)
        assert (axis.velocity, axis.position - CENTRE) == (wanted, ramp.gained)


def test_a_limit_stops_motion_into_it_but_not_out_of_it():
    law = LandingLaw.from_registers(26, 26, 0xFFFFFF)
    axis = axis_of(law)
    axis.upper = CENTRE + (1000 << FRACTION_BITS)
    axis.follow(2_000_000, 5000)
    assert axis.velocity == 0
    assert axis.upper <= axis.position < axis.upper + (1000 << FRACTION_BITS)
    stopped = axis.position
    axis.follow(2_000_000, 100)
    assert axis.position == stopped
    axis.follow(-2_000_000, 100)
    assert axis.position < stopped


def test_a_slew_into_a_limit_ends_there_off_its_target():
    law = LandingLaw.from_registers(26, 26, 0xFFFFFF)
    axis = axis_of(law)
    axis.upper = CENTRE + (1000 << FRACTION_BITS)
    target = CENTRE + (50_000 << FRACTION_BITS)
    assert slew(axis, target) < 1000
    assert not axis.slewing
    axis.follow(0, 5000)
    assert axis.velocity == 0
    assert axis.position < target


def test_counting_on_past_the_end_does_not_move_the_axis():
    axis = axis_of(LandingLaw.from_registers(26, 26, 0xFFFFFF), start=100)
    axis.lower = -(1 << 60)
    axis.follow(-13873, 50)
    assert 0 <= axis.position < 1 << 48
    assert axis.position + axis.offset < 0


def test_a_slow_landing_creeps_evenly_over_the_last_counts():
    law = LandingLaw.from_registers(26, 26, 0xFFFFFF)
    axis = axis_of(law)
    axis.landing_ticks, axis.landing_distance = 750, 20 << FRACTION_BITS
    target = CENTRE + (5000 << FRACTION_BITS)
    short = law.move(CENTRE, 0, target - axis.landing_distance).ticks
    axis.target = target
    axis.begin_slew()
    assert axis.slew(short + 375) == short + 375
    assert target - axis.position == 10 << FRACTION_BITS
    assert axis.slew(10_000) == 375
    assert (axis.position, axis.slewing) == (target, False)


def test_synchronising_changes_the_count_and_not_the_place():
    axis = axis_of(LandingLaw.from_registers(26, 26, 0xFFFFFF))
    axis.follow(13873, 10)
    place = axis.position + axis.offset
    axis.synchronise(0x123456 << FRACTION_BITS, 13)
    assert axis.at_step(13) == 0x123456 << FRACTION_BITS
    assert axis.position + axis.offset == place
