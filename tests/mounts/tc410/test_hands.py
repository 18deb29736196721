"""A hand that was stopped moves nothing until it is let go or does something else, whoever is the host by then."""

import pytest
from tc410_bench import Bench

from mounts.tc410.registers import by_name

HELD = {
    "joystick": {"joystick": (30, 128)},
    "analogue_autoguider": {"autoguider": (128, 226)},
    "digital_autoguider": {"directions": ("east",)},
}
LET_GO = {"joystick": (128, 128), "autoguider": (128, 128), "directions": ()}
OTHERWISE = {
    "joystick": {"joystick": (226, 128)},
    "analogue_autoguider": {"autoguider": (30, 128)},
    "digital_autoguider": {"directions": ("west",)},
}


def held(source: str) -> Bench:
    """Make a unit that this hand has moved, and that was stopped."""
    bench = Bench()
    bench.drive._write_control(bench.drive._control | by_name("velocity_control").mask(source))
    bench.unit.disturb(**HELD[source])
    bench.wait(2.0)
    assert bench.drive.read(bench.now).motion == (source,)
    bench.drive.stop(bench.now)
    return bench


def moves(bench: Bench) -> bool:
    """Look at the unit for ten seconds; return whether it moves then."""
    for _ in range(20):
        bench.wait(0.5)
        bench.drive.read(bench.now)
    return any(bench.velocity(axis) for axis in (0, 1))


@pytest.mark.parametrize("restarted", [False, True])
@pytest.mark.parametrize("source", HELD)
def test_a_hand_is_barred_as_long_as_it_is_held_and_given_back_when_it_is_let_go(
    source: str, restarted: bool
) -> None:
    bench, mask = held(source), by_name("velocity_control").mask(source)
    assert not moves(bench)
    if restarted:
        bench.restarted()
        assert not moves(bench)
    bench.unit.disturb(**LET_GO)
    assert not moves(bench)
    assert bench.control & mask
    bench.unit.disturb(**HELD[source])
    assert moves(bench)


@pytest.mark.parametrize("source", HELD)
def test_a_hand_that_pushes_another_way_moves_the_axes_at_once(source: str) -> None:
    bench = held(source)
    assert not moves(bench)
    bench.unit.disturb(**OTHERWISE[source])
    assert moves(bench)


def test_a_hand_that_moves_nothing_is_not_barred() -> None:
    bench, mask = Bench(), by_name("velocity_control").mask("joystick")
    bench.drive._write_control(bench.drive._control | mask)
    bench.drive.read(bench.now)
    bench.drive.stop(bench.now)
    assert bench.control & mask
