"""What happens when a TC410 is connected: nothing moves before all is known, and no wrong position is used."""

from contextlib import suppress
from functools import partial

import pytest
from tc410_bench import T0, Bench, Straight

from mounts.drive import AxisSlew
from mounts.errors import DriveError, DriveRefused, Unsynchronised, WrongProtocol
from mounts.tc410.drive import TC410
from mounts.tc410.registers import CENTRE
from transports.errors import TransportError
from transports.memory import MemoryLink
from transports.modbus_ascii import ModbusAscii

SLEW = 0x01


def test_a_unit_never_seen_is_unsynchronised_and_says_why() -> None:
    bench = Bench(synchronised=False)
    reading = bench.drive.connect(bench.now, make_safe=False)
    assert "never synchronised" in reading.unsynchronised
    with pytest.raises(Unsynchronised, match="sync"):
        bench.slew(AxisSlew(CENTRE + 1000), AxisSlew(CENTRE))
    with pytest.raises(Unsynchronised, match="sync"):
        bench.drive.follow(Straight((CENTRE, CENTRE), (16.5, 0.0), T0), bench.now)
    assert not bench.control & SLEW


def test_a_synchronised_unit_is_still_so_for_the_next_process() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 5000), AxisSlew(CENTRE - 3000))
    bench.polled_until_landed()
    bench.drive.close(bench.now, keep_tracking=False)
    bench.keep(bench.drive.memory)
    bench.wait(86_400.0)
    reading = bench.restarted()
    assert reading.unsynchronised == ""
    assert [int(axis.counts) for axis in reading.axes] == [CENTRE + 5000, CENTRE - 3000]


def test_a_unit_that_was_power_cycled_meanwhile_is_unsynchronised() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 5000), AxisSlew(CENTRE - 3000))
    bench.polled_until_landed()
    bench.drive.close(bench.now, keep_tracking=False)
    bench.keep(bench.drive.memory)
    bench.wait(3600.0)
    bench.unit.power_cycle()
    assert "power-cycled" in bench.restarted().unsynchronised
    bench.drive.sync([CENTRE + 5000, CENTRE - 3000], bench.now)
    assert bench.drive.read(bench.now).unsynchronised == ""
    assert bench.restarted().unsynchronised == ""


@pytest.mark.parametrize("where", [(CENTRE, CENTRE), (CENTRE + 7, CENTRE)])
def test_a_power_cycle_is_noticed_where_power_up_puts_the_axes(where: tuple[int, int]) -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 5000), AxisSlew(CENTRE - 3000))
    bench.polled_until_landed()
    bench.slew(*(AxisSlew(counts) for counts in where))
    bench.polled_until_landed()
    bench.drive.read(bench.now)
    bench.keep(bench.drive.memory)
    bench.unit.power_cycle()
    assert "power-cycled" in bench.restarted().unsynchronised


def test_a_power_cycle_is_noticed_even_where_targets_outlive_it() -> None:
    bench = Bench(simulator__volatile_targets=False)
    bench.slew(AxisSlew(CENTRE + 50_000), AxisSlew(CENTRE))
    bench.polled_until_landed()
    bench.keep(bench.drive.memory)
    bench.unit.power_cycle()
    assert "axis 1 stands 50000 counts" in bench.drive.read(bench.now).unsynchronised
    assert "axis 1 stands 50000 counts" in bench.restarted().unsynchronised


def test_a_unit_left_tracking_is_taken_over() -> None:
    bench = Bench()
    path = Straight((CENTRE, CENTRE), (16.538, -0.75), bench.now)
    bench.tracked(path, 10.0)
    bench.drive.close(bench.now, keep_tracking=True)
    bench.keep(bench.drive.memory)
    bench.wait(600.0)
    reading = bench.restarted()
    print([axis.rate for axis in reading.axes])
    assert reading.tracking
    assert reading.unsynchronised == ""
    assert reading.axes[0].rate == pytest.approx(bench.velocity(0), abs=1e-9)
    assert reading.axes[1].rate == pytest.approx(bench.velocity(1), abs=1e-9)
    later = bench.tracked(path, 30.0)[-1]
    assert max(map(abs, later)) < 0.3


def test_make_safe_ends_all_motion() -> None:
    bench = Bench()
    bench.tracked(Straight((CENTRE, CENTRE), (16.5, 3.0), bench.now), 3.0)
    bench.slew(AxisSlew(CENTRE + 200_000, 16.5), AxisSlew(CENTRE))
    bench.wait(2.0)
    bench.keep(bench.drive.memory)
    bench.restarted(make_safe=True)
    bench.wait(10.0)
    assert bench.velocity(0) == bench.velocity(1) == 0.0
    assert bench.drive.read(bench.now).unsynchronised == ""


def test_a_running_slew_is_ended_before_the_position_format_is_probed() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 200_000), AxisSlew(CENTRE))
    bench.wait(2.0)
    written: list[int] = []

    def watch(frame: bytes) -> None:
        if frame[3:5] == b"10":
            written.append(bench.control & SLEW)

    bench.line.before = watch
    bench.restarted()
    assert written
    assert not any(written)


@pytest.mark.parametrize("killed_after", range(1, 10))
def test_an_owner_killed_while_it_starts_a_slew_loses_nothing(killed_after: int) -> None:
    """Wherever in the start the process dies, the next one knows its unit again."""
    bench = Bench()

    class Killed(BaseException):
        pass

    def kill(_: bytes) -> None:
        nonlocal killed_after
        killed_after -= 1
        if killed_after < 0:
            raise Killed

    bench.line.before = kill
    with suppress(Killed):
        bench.slew(AxisSlew(CENTRE + 9000, 16.5), AxisSlew(CENTRE - 9000, 0.1))
    bench.line.before = None
    bench.wait(30.0)
    assert bench.restarted(make_safe=True).unsynchronised == ""
    assert bench.restarted().unsynchronised == ""


def test_a_lowered_speed_is_given_back_even_by_the_next_process() -> None:
    bench = Bench()
    full = bench.unit.memory.raw("axis1_max_speed")
    bench.slew(AxisSlew(CENTRE + 20_000, max_rate=500.0), AxisSlew(CENTRE))
    assert bench.unit.memory.raw("axis1_max_speed") < full
    bench.wait(2.0)
    bench.restarted(make_safe=True)
    assert bench.unit.memory.raw("axis1_max_speed") == full
    assert bench.drive.slew_models[0].max_velocity == full << 8
    assert bench.kept["restore"] == {}


def test_soft_limits_are_written_rounded_inward() -> None:
    bench = Bench(axis1__min_deg=-100.0, axis1__max_deg=100.0)
    settings = bench.drive._settings.axes[0]
    low, high = bench.unit.soft_limits(1)
    assert settings.lowest_counts <= low < settings.lowest_counts + 256
    assert settings.highest_counts - 256 < high <= settings.highest_counts


def test_a_unit_that_does_not_keep_its_soft_limits_is_refused() -> None:
    bench = Bench(synchronised=False)
    put = bench.unit.memory.put
    bench.unit.memory.put = lambda register, words: None if "_limit" in register.name else put(register, words)
    with pytest.raises(DriveRefused, match="limit reads back"):
        bench.drive.connect(bench.now, make_safe=False)


@pytest.mark.parametrize("code", [0, 3])
def test_a_unit_without_motor_drives_is_refused(code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(synchronised=False)
    answer = bench.unit.read_input_registers
    monkeypatch.setattr(
        bench.unit,
        "read_input_registers",
        lambda address, count: [code] if address == 0x20 else answer(address, count),
    )
    with pytest.raises(DriveRefused, match=f"drive types 1 and {code}"):
        bench.drive.connect(bench.now, make_safe=False)


class Talker:
    """Answers everything with the same bytes."""

    def __init__(self, words: bytes) -> None:
        self.words = words

    def receive(self, data: bytes, t: float) -> bytes:  # noqa: ARG002 - it does not listen
        return self.words


@pytest.mark.parametrize(
    "words",
    [b"", b"HTTP/1.1 400 Bad Request\r\nConnection: close\r\n\r\n", bytes(range(256)), b":FF8302" + b"7C\r\n"],
    ids=["silence", "http", "garbage", "exceptions"],
)
def test_something_else_at_the_link_is_told_apart(words: bytes) -> None:
    bench = Bench(synchronised=False)
    modbus = ModbusAscii(partial(MemoryLink, Talker(words), bench.clock), bench.clock)
    drive = TC410(modbus, bench.drive._settings, {})
    with pytest.raises(WrongProtocol, match="no TC410 answers"):
        drive.connect(bench.now, make_safe=True)
    assert bench.now - T0 < 10.0


@pytest.mark.parametrize("unit", ["right", "left"])
@pytest.mark.parametrize("chosen", ["auto", "right", "left"])
@pytest.mark.parametrize("axis1", [CENTRE, CENTRE + 0x1234, 0x000100, 0x000080, 0x00FFFF, 0xFFFFFF])
def test_the_position_format_is_found_or_refused_without_motion(unit: str, chosen: str, axis1: int) -> None:
    bench = Bench(synchronised=False, simulator__position_format=unit)
    bench.unit.axes[0].synchronise(axis1 << 24, 0)
    drive = bench.drive = bench.made({"unsynchronised": ""}, position_format=chosen)
    targets = [bench.unit.memory.counts(f"axis{axis}_target_position") for axis in (1, 2)]
    if chosen in {"auto", unit}:
        reading = drive.connect(bench.now, make_safe=False)
        assert int(reading.axes[0].counts) == axis1
        assert int(reading.axes[1].counts) == CENTRE
    else:
        with pytest.raises(DriveRefused, match=f"positions {unit}-justified"):
            drive.connect(bench.now, make_safe=False)
        assert [bench.unit.memory.counts(f"axis{axis}_target_position") for axis in (1, 2)] == targets
    assert bench.true(0) == axis1
    assert bench.true(1) == CENTRE
    assert not bench.control & SLEW


def test_differences_from_the_configuration_are_listed_not_written() -> None:
    bench = Bench(synchronised=False, axis1__acceleration_register=40, drive__joystick_mode=8)
    bench.unit.write_registers(0x14, [26])
    bench.drive.connect(bench.now, make_safe=False)
    assert any("axis1_acceleration: the unit has 26" in note for note in bench.drive.notes)
    assert bench.drive.slew_models[0].acceleration == 26
    assert bench.unit.memory.raw("axis1_acceleration") == 26


def test_a_dead_link_is_the_transports_error_not_a_wrong_answer() -> None:
    bench = Bench()
    bench.line.dead = True
    with pytest.raises(TransportError):
        bench.drive.read(bench.now)
    with pytest.raises((TransportError, DriveError)):
        bench.drive.stop(bench.now)
    bench.line.dead = False
    assert bench.drive.read(bench.now).unsynchronised == ""


@pytest.mark.parametrize(
    "broken",
    [
        {"cookies": [[[128, 0], [128, 1]], [[128, 0]]]},
        {"cookies": [[128.5], [1]]},
        {"cookies": 7},
        {"cookies": [[1]]},
        {"position": ["here", "there"]},
        {"position": [1.0]},
        {"time": "yesterday"},
        {"time": float("nan")},
        {"uncertainty_counts": None},
        {"unsynchronised": None},
    ],
)
def test_a_memory_that_cannot_be_read_is_no_position(broken: dict[str, object]) -> None:
    bench = Bench()
    bench.kept |= broken
    reading = bench.restarted()
    assert "cannot be read" in reading.unsynchronised
    assert "sync" in reading.unsynchronised
    bench.drive.sync([CENTRE, CENTRE], bench.now)
    assert bench.restarted().unsynchronised == ""
