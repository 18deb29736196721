"""Where a drive is held that tracks on whatever it is told, by arithmetic of its own."""

from types import SimpleNamespace

import pytest

from clockdrive.configuration import load
from clockdrive.drives import kind_of
from clockdrive.resting import Holding, Rest, inside, place
from mounts.drive import AxisReading, Capabilities, Reading
from pointing.limits import Check

WIDTH = 8000.0  # microsteps, 7.2′
DEGREE = 66327.2727  # microsteps of axis 1


def axis(**given):
    found = load(None, {}, {"drive.kind": "avr-box", **{name.replace("__", "."): v for name, v in given.items()}})
    return kind_of(found).axes(found)[0]


def drive(onwards=1.0):
    return Capabilities(
        has_position=True,
        can_stop=False,
        rate_control=False,
        path_nodes=False,
        holds_rate_alone=True,
        units="microsteps",
        goes_on_at=277.0 * onwards,
        rests_within=WIDTH,
    )


@pytest.mark.parametrize(
    ("degrees", "onwards", "moved"),
    [
        (0.0, 1.0, 0.0),
        (169.8, 1.0, 0.0),
        (170.0, 1.0, -WIDTH / 8),  # some seconds of tracking are left before the limit ahead
        (-170.0, 1.0, WIDTH),  # and the width of the holding before the one behind
        (170.0, -1.0, -WIDTH),
        (-170.0, -1.0, WIDTH / 8),
        (172.0, 1.0, 0.0),  # it is led back over no such way
        (-172.0, 1.0, 0.0),
    ],
)
def test_a_place_is_moved_by_as_little_as_keeps_the_holding_within_the_travel(degrees, onwards, moved):
    one, two = inside(axis(), (degrees * DEGREE, 5.0), drive(onwards))
    assert one - degrees * DEGREE == pytest.approx(moved, abs=1.0)
    assert two == 5.0


def test_an_axis_that_counts_downwards_is_held_within_the_same_travel():
    turned = axis(axis1__reversed=True)
    one, _ = inside(turned, (-170.0 * DEGREE, 0.0), drive(-1.0))
    assert one == pytest.approx(-170.0 * DEGREE + WIDTH / 8, abs=1.0)


def planner(allowed=lambda _: True):
    """A planner of a sky that allows some counts of axis 1, and of no other limit than the travel."""
    return SimpleNamespace(
        axes=(axis(), axis()),
        angles=lambda counts: counts,
        standing=lambda angles, _: (Check("horizon", ok=allowed(angles[0]), detail=""),),
    )


@pytest.mark.parametrize(
    ("onwards", "allowed", "moved"),
    [
        (1.0, lambda one: one >= -1.0, WIDTH),  # the horizon is just behind: it is held where tracking takes it
        (-1.0, lambda one: one <= 1.0, -WIDTH),
        (1.0, lambda one: one <= 1.0, 0.0),  # it is just ahead
        (1.0, lambda one: abs(one) <= WIDTH / 2, 0.0),  # on both sides
        (1.0, lambda one: one >= WIDTH / 2, 0.0),  # where it stands is below it
    ],
)
def test_a_place_is_held_clear_of_horizon_and_sun_where_that_can_be(onwards, allowed, moved):
    assert place(planner(allowed), (0.0, 5.0), drive(onwards), 0.0) == (moved, 5.0)


def reading(one, two=0.0, *, slewing=False, motion=("tracking",)):
    return Reading(
        0.0, (AxisReading(one, 10.0, 277.0, slewing), AxisReading(two, 10.0, 0.0, slewing=False)), motion=motion
    )


@pytest.fixture
def holding():
    return Holding(planner())


def test_nothing_is_held_while_anything_moves_and_then_where_it_stands(holding):
    assert holding.at(reading(100.0, slewing=True), drive()) is None
    assert holding.at(reading(200.0, motion=("tracking", "hand controller")), drive()) is None
    assert holding.at(reading(300.0, 7.0), drive()) == Rest((300.0, 7.0))
    assert holding.at(reading(500.0, 7.0), drive()) == Rest((300.0, 7.0))
    assert holding.at(reading(600.0, slewing=True), drive()) is None
    assert holding.at(reading(700.0, 9.0), drive()) == Rest((700.0, 9.0))


@pytest.mark.parametrize(("one", "two", "name"), [(DEGREE, 0.0, "axis1"), (0.0, -DEGREE, "axis1")])
def test_what_is_found_far_from_where_it_rested_is_said_and_rests_there(holding, one, two, name):
    holding.at(reading(0.0), drive())
    assert holding.moved(reading(1.9 * WIDTH), drive()) == ""
    assert f"{name} was found 1.00° from where it rested" in holding.moved(reading(one, two), drive())
    assert holding.at(reading(one, two), drive()) == Rest((one, two))


def test_only_axis_1_has_a_way_of_its_own():
    rest = Rest((3.0, 4.0))
    assert (rest.axes, rest.led, rest.at(5.0)) == (1, False, ((3.0, 0.0), (4.0, 0.0)))
    assert rest.axis_at(1, 5.0) == (4.0, 0.0)
