import csv
import os
import random
import timeit
from typing import TYPE_CHECKING

import pytest

from mounts.tc410.registers import COUNTS_PER_SECOND, RegisterError
from mounts.tc410.slew import LandingLaw, Tc410SlewModel

if TYPE_CHECKING:
    from pointing.slew import SlewModel, Travel

COUNT = 1 << 24
FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"


def stops_within(velocity, deceleration):
    """Sum of the steps of a stop, one by one."""
    distance = 0
    while velocity > 0:
        distance += 40 * velocity
        velocity -= deceleration
    return distance


def tick_by_tick(acceleration, deceleration, top, start, velocity, target):
    """The landing law as it is stated, searching for the largest velocity that stops in time."""
    position, path = start, [start]
    while position != target or velocity:
        direction = 1 if target >= position else -1
        left, forward = abs(target - position), velocity * direction
        if forward < 0:
            forward = min(0, forward + deceleration)
        else:
            fastest = min(forward + acceleration, top)
            low = max(forward - deceleration, 0)
            while fastest > low and stops_within(fastest, deceleration) > left:
                fastest -= 1
            forward = max(fastest, low)
        velocity = forward * direction
        position += 40 * velocity
        if abs(target - position) < 40 and abs(velocity) <= deceleration:
            position, velocity = target, 0
        path.append(position)
    return path


def test_every_small_move_agrees_with_the_law_tick_by_tick():
    rng = random.Random(1)  # noqa: S311
    moves = ticks = 0
    for acceleration, deceleration, top in [(2, 3, 11), (5, 2, 17), (3, 3, 9), (7, 4, 5), (2, 7, 40), (4, 20, 10)]:
        law = LandingLaw(acceleration, deceleration, top)
        for velocity in range(-30, 31, 1):
            for distance in [*range(-90, 91), *(rng.randrange(-9000, 9000) for _ in range(40))]:
                path = tick_by_tick(acceleration, deceleration, top, 5, velocity, 5 + distance)
                move = law.move(5, velocity, 5 + distance)
                assert (move.ticks, [move.position(tick) for tick in range(len(path))]) == (len(path) - 1, path), (
                    acceleration,
                    deceleration,
                    top,
                    velocity,
                    distance,
                )
                moves, ticks = moves + 1, ticks + len(path)
    print(f"{moves} moves, {ticks} ticks identical")


def test_the_fastest_velocity_that_stops_is_exactly_the_largest():
    law = LandingLaw(5, 7, 100)
    for remainder in range(20_000):
        fastest = law.fastest(remainder)
        assert stops_within(fastest, 7) <= remainder < stops_within(fastest + 1, 7)
        assert law.stopping_distance(fastest) == stops_within(fastest, 7)


def test_worked_moves_take_exactly_their_ticks(shared):
    with (shared / "data" / "tc410_moves.csv").open() as file:
        rows = [{key: int(value) for key, value in row.items()} for row in csv.DictReader(file)]
    assert rows
    for row in rows:
        law = LandingLaw.from_registers(row["acceleration"], row["deceleration"], row["max_velocity"])
        move = law.move(0, row["start_velocity"], row["counts"] * COUNT)
        print(row["counts"], row["start_velocity"], move.ticks, row["ticks_of_2ms"])
        assert move.ticks == row["ticks_of_2ms"]


def test_a_move_is_continuous_and_never_brakes_harder_than_it_may():
    rng = random.Random(2)  # noqa: S311
    for _ in range(200 if FULL else 40):
        law = LandingLaw.from_registers(rng.randint(1, 255), rng.randint(1, 255), rng.randint(0x1000, 0xFFFFFF))
        velocity = rng.randint(-0xFFFFFF, 0xFFFFFF)
        move = law.move(0x800000 * COUNT, velocity, rng.randrange(0x700000, 0x900000) * COUNT)
        for tick in range(1, move.ticks, 7):
            before, now = (velocity if tick == 1 else move.velocity(tick - 1)), move.velocity(tick)
            assert abs(now) >= abs(before) - law.deceleration
            assert abs(now) <= max(abs(before) + law.acceleration, 0)
            assert move.position(tick) - move.position(tick - 1) == 40 * now
        assert abs(move.position(move.ticks) - move.position(move.ticks - 1)) <= 40 * law.deceleration + 40


@pytest.mark.parametrize(
    ("velocity", "wanted"),
    [(0, 13873), (13873, 0), (13873, -13873), (-13873, 13874), (13873, 13873), (90000, 20000), (5, 6656), (-7, 0)],
)
def test_a_ramp_gains_what_its_ticks_add_up_to(velocity, wanted):
    law = LandingLaw.from_registers(26, 80, 0xFFFFFF)
    position, now, ticks = 0, velocity, 0
    while now != wanted:
        slower = abs(now) > abs(wanted) or now * wanted < 0
        goal = wanted if now * wanted >= 0 else 0
        step = law.deceleration if slower else law.acceleration
        now = min(now + step, goal) if goal > now else max(now - step, goal)
        position += 40 * now
        ticks += 1
    assert law.ramp(velocity, wanted) == (ticks, position)


def test_an_axis_that_would_never_arrive_is_refused():
    for registers in ((0, 26, 0xFFFF00), (26, 0, 0xFFFF00), (26, 26, 0)):
        with pytest.raises(RegisterError, match="never arrives; set the unit's registers"):
            LandingLaw.from_registers(*registers)


def test_the_model_speaks_counts_and_seconds():
    model: SlewModel = Tc410SlewModel(26, 26, 0xFFFFFF)
    travel: Travel = model.travel(0.25, 60000.4, 16.5, 3.0)
    assert model.max_rate == pytest.approx(20000, rel=1e-6)
    assert travel.landed == 60000.0
    assert travel.position(-1.0) == 0.25
    assert travel.position(0.0) == 0.25
    assert travel.position(travel.duration) == travel.position(1e9) == 60000.0
    move = travel.move
    for tick in range(0, move.ticks, 13):
        assert travel.position(tick * 0.002) == pytest.approx(move.position(tick) / COUNT, abs=1e-6)
        between = (move.position(tick) + move.position(tick + 1)) / 2 / COUNT
        assert travel.position((tick + 0.5) * 0.002) == pytest.approx(between, abs=0.02)
    assert model.travel(5.0, 5.0, 0.0, 0.0).duration == 0.0


def test_what_was_learnt_changes_the_travel_time():
    nominal = Tc410SlewModel(26, 26, 0xFFFFFF)
    brisk = Tc410SlewModel(26, 26, 0xFFFFFF, acceleration_scale=1.03)
    slow = Tc410SlewModel(26, 26, 0xFFFFFF, landing_s=1.5)
    time = nominal.travel(0, 20000, 0, 0).duration
    assert brisk.travel(0, 20000, 0, 0).duration == pytest.approx(time / 1.03**0.5, abs=0.003)
    assert slow.travel(0, 20000, 0, 0).duration == pytest.approx(time + 1.5, abs=1e-9)


def test_travel_is_cheap_enough_to_be_asked_many_times_a_plan():
    model = Tc410SlewModel(26, 26, 14940415)
    for distance in (300.0, 90_000.0, 4_000_000.0):
        travel = model.travel(0.0, distance, 13873 * COUNTS_PER_SECOND, 0.0)
        plan = min(timeit.repeat(lambda d=distance: model.travel(0.0, d, 16.5, 0.0), number=2000, repeat=5)) / 2000
        place = min(timeit.repeat(lambda t=travel: t.position(t.duration * 0.9), number=5000, repeat=5)) / 5000
        print(f"{distance:.0f} counts: travel {plan * 1e6:.1f} µs, position {place * 1e6:.2f} µs")
        assert plan < 60e-6
        assert place < 12e-6
