"""The driver moves a unit: it starts, lands on the count when it said, and knows when something went wrong."""

import itertools
import math
import random
import re

import pytest
from tc410_bench import STEP_ARCSEC, T0, Bench, Beside, OnSky, Straight, bench_beside

from clockdrive.clock import VirtualClock
from clockdrive.configuration import load
from clockdrive.drives.tc410.settings import settings as settings_of
from mounts.deadman import DeadManError
from mounts.drive import AxisSlew, Drive
from mounts.errors import DriveError, DriveRefused, Unsynchronised
from mounts.tc410.drive import TC410
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND, by_name
from transports.errors import TransportError
from transports.memory import MemoryLink
from transports.modbus_ascii import ModbusAscii

TICK_S = 0.002


def test_a_target_is_reached_at_the_predicted_time_and_tracked() -> None:
    bench = Bench()
    star = bench.star(-20.0, -30.0)
    plan = bench.gone_to(star)
    path = OnSky(bench.planner, star, plan)
    bench.wait(plan.arrival - bench.now)
    one, two = bench.errors(path)
    print(f"at the stated arrival: axis 1 {one:+.3f}, axis 2 {two:+.3f} counts")
    assert max(abs(one), abs(two)) < 1.0
    bench.polled_until_landed()
    errors = bench.tracked(path, 20.0)[5:]
    assert max(abs(error) for pair in errors for error in pair) < 0.5


def test_the_driver_keeps_the_contract() -> None:
    drive: Drive = Bench().drive
    assert drive.capabilities.can_stop
    assert drive.capabilities.units == "counts"


@pytest.mark.parametrize("baud", [0, 9600])
@pytest.mark.parametrize("fork", ["equatorial-fork", "german", "altaz-fork"])
def test_targets_all_over_the_sky_are_met_at_the_stated_arrival_with_one_slew(fork: str, baud: int) -> None:
    """Within 1 count + rate × 2 ms; no learning is needed on a unit that is as assumed."""
    bench = Bench(mount__type=fork, simulator__baud=baud)
    somewhere = random.Random(4)  # noqa: S311 - the same places every time
    worst = 0.0
    for _ in range(8):
        star = bench.star(somewhere.uniform(-35.0, 35.0), somewhere.uniform(-65.0, -10.0))
        plan = bench.gone_to(star)
        path = OnSky(bench.planner, star, plan)
        bench.wait(plan.arrival - bench.now)
        for error, axis in zip(bench.errors(path), plan.axes, strict=True):
            worst = max(worst, abs(error))
            assert abs(error) <= 1.0 + abs(axis.rate_counts) * TICK_S
        bench.polled_until_landed()
        errors = bench.tracked(path, 12.0)
        assert max(map(abs, errors[-1])) < 0.5
    print(f"{fork}, {baud} baud: worst {worst:.3f} counts at the stated arrival")


def test_a_slew_lands_on_its_counts_in_the_predicted_tick() -> None:
    bench = Bench()
    somewhere = random.Random(7)  # noqa: S311 - the same places every time
    for _ in range(20):
        targets = [CENTRE + somewhere.randint(-100_000, 100_000) for _ in range(2)]
        began = bench.slew(*(AxisSlew(target) for target in targets))
        watches = bench.drive._slew.axes
        for i in sorted((0, 1), key=lambda i: watches[i].travel.duration):
            bench.wait(began + watches[i].travel.duration - TICK_S - bench.now)
            assert bench.true(i) != targets[i]
            bench.wait(2.0 * TICK_S)
            assert bench.true(i) == targets[i]
        reading = bench.polled_until_landed()
        assert [int(axis.counts) for axis in reading.axes] == targets


def test_positions_during_a_slew_are_carried_to_the_time_of_the_reading() -> None:
    bench = Bench(simulator__baud=9600)
    bench.slew(AxisSlew(CENTRE + 150_000, 16.5), AxisSlew(CENTRE - 100_000))
    worst = 0.0
    for _ in range(40):
        seen: dict[int, tuple[float, float]] = {}
        frames = []

        def at_the_flags(frame: bytes) -> None:
            if frame.startswith(b":FF040003"):
                frames.append(frame)  # noqa: B023 - used within this turn
                bench.clock.sleep(0.001)  # the travel time of the request
                seen[0] = bench.true(0), bench.true(1)  # noqa: B023 - likewise
                bench.clock.sleep(-0.001)

        bench.line.before = at_the_flags
        reading = bench.drive.read(bench.now)
        bench.line.before = None
        if not any(axis.slewing for axis in reading.axes):
            break
        for axis, true in zip(reading.axes, seen[0], strict=True):
            worst = max(worst, abs(axis.counts - true))
        bench.wait(0.1)
    print(f"largest error of a carried position {worst:.2f} counts")
    assert worst < 40.0  # 2 ms of a tick at top speed


@pytest.mark.parametrize(
    "slews",
    [
        (AxisSlew(-1.0), AxisSlew(CENTRE)),
        (AxisSlew(CENTRE), AxisSlew(float(0x1000000))),
        (AxisSlew(math.nan), AxisSlew(CENTRE)),
        (AxisSlew(CENTRE), AxisSlew(math.inf)),
        (AxisSlew(CENTRE, 20_001.0), AxisSlew(CENTRE)),
        (AxisSlew(CENTRE, math.nan), AxisSlew(CENTRE)),
        (AxisSlew(CENTRE, max_rate=0.1), AxisSlew(CENTRE)),
        (AxisSlew(CENTRE, max_rate=-5.0), AxisSlew(CENTRE)),
    ],
)
def test_what_the_drive_cannot_hold_is_refused_before_anything_is_sent(slews: tuple[AxisSlew, AxisSlew]) -> None:
    bench = Bench()
    bench.line.requests.clear()
    with pytest.raises(DriveError, match=r"outside|not a number"):
        bench.slew(*slews)
    assert bench.line.requests == []


@pytest.mark.parametrize("counts", [(-1.0, CENTRE), (CENTRE, float(0x1000000)), (math.nan, CENTRE)])
def test_a_sync_beyond_the_counter_is_refused_before_anything_is_sent(counts: tuple[float, float]) -> None:
    bench = Bench()
    bench.line.requests.clear()
    with pytest.raises(DriveError, match="outside"):
        bench.drive.sync(counts, bench.now)
    assert bench.line.requests == []


@pytest.mark.parametrize("edge", [0x000300, 0xFFFD00])
def test_slews_near_the_ends_of_the_counter_land(edge: int) -> None:
    bench = Bench()
    bench.drive.sync([edge, CENTRE], bench.now)
    bench.unit.write_registers(0x12, [0, 0xFFFF])
    toward = edge + (3000 if edge < CENTRE else -3000)
    bench.slew(AxisSlew(toward), AxisSlew(CENTRE + 10))
    assert int(bench.polled_until_landed().axes[0].counts) == toward
    bench.slew(AxisSlew(edge), AxisSlew(CENTRE))
    reading = bench.polled_until_landed()
    assert int(reading.axes[0].counts) == edge
    assert reading.unsynchronised == ""


def test_a_slower_slew_never_goes_faster_and_gives_the_speed_back() -> None:
    bench = Bench()
    full = bench.unit.memory.raw("axis1_max_speed")
    bench.slew(AxisSlew(CENTRE + 5000, max_rate=700.0), AxisSlew(CENTRE - 5000, max_rate=1e9))
    fastest = 0.0
    while any(axis.slewing for axis in bench.drive.read(bench.now).axes):
        fastest = max(fastest, abs(bench.velocity(0)))
        bench.wait(0.05)
    print(f"fastest {fastest:.2f} of 700 counts/s")
    assert 695.0 < fastest <= 700.0
    assert bench.unit.memory.raw("axis1_max_speed") == full, "given back on landing"
    bench.slew(AxisSlew(CENTRE, max_rate=700.0), AxisSlew(CENTRE))
    assert bench.unit.memory.raw("axis1_max_speed") < full
    assert bench.drive.lent["axis1_max_speed"] * COUNTS_PER_SECOND > 1000.0
    bench.slew(AxisSlew(CENTRE), AxisSlew(CENTRE))
    assert bench.unit.memory.raw("axis1_max_speed") == full
    bench.polled_until_landed()
    bench.slew(AxisSlew(CENTRE + 100, max_rate=700.0), AxisSlew(CENTRE))
    bench.drive.stop(bench.now)
    bench.drive.read(bench.now)
    assert bench.unit.memory.raw("axis1_max_speed") == full, "given back after a stop"
    assert not bench.drive.lent
    bench.slew(AxisSlew(CENTRE + 200, max_rate=700.0), AxisSlew(CENTRE))
    bench.drive.close(bench.now, keep_tracking=False)
    assert bench.unit.memory.raw("axis1_max_speed") == full


def test_a_slower_slew_whose_start_and_stops_go_unanswered_never_goes_faster(monkeypatch) -> None:
    """The unit slews, and the driver has no word of it: what it lowered stays so until the axes stand."""
    bench, write = Bench(), TC410._write_control
    full = bench.unit.memory.raw("axis1_max_speed")

    def unanswered(drive: TC410, bits: int) -> float:
        bench.line.deaf_to_answers = bool(bits & by_name("velocity_control").mask("slew_to_target"))
        return write(drive, bits)

    monkeypatch.setattr(TC410, "_write_control", unanswered)
    with pytest.raises(TransportError):
        bench.slew(AxisSlew(CENTRE + 20_000, max_rate=700.0), AxisSlew(CENTRE))
    bench.line.deaf_to_answers, bench.line.dead = False, True
    with pytest.raises(TransportError):
        bench.drive.stop(bench.now)
    bench.line.dead = False
    fastest = 0.0
    for _ in range(100):
        assert bench.drive.read(bench.now).axes[0].slewing
        bench.wait(0.1)
        fastest = max(fastest, abs(bench.velocity(0)))
    print(f"fastest {fastest:.2f} of 700 counts/s")
    assert 695.0 < fastest <= 700.0
    bench.drive.stop(bench.now)
    bench.wait(2.0)
    bench.drive.read(bench.now)
    assert bench.unit.memory.raw("axis1_max_speed") == full, "given back when the axes stand"


def test_what_was_lowered_is_given_back_when_the_dead_man_process_cannot_be_let_go() -> None:
    guardian = Beside()
    bench = bench_beside(guardian)
    full = bench.unit.memory.raw("axis1_max_speed")

    def broken() -> None:
        raise DeadManError("the dead-man process does not answer")

    for keep_tracking in (False, True):
        bench.slew(AxisSlew(CENTRE + 5000, max_rate=700.0), AxisSlew(CENTRE))
        bench.drive.stand_by(bench.now)
        guardian.close = broken
        assert bench.unit.memory.raw("axis1_max_speed") < full
        with pytest.raises(DeadManError):
            bench.drive.close(bench.now, keep_tracking=keep_tracking)
        assert bench.unit.memory.raw("axis1_max_speed") == full
        assert not bench.kept["restore"]
        bench.drive.connect(bench.now, make_safe=True)


def test_a_host_kept_from_its_work_between_a_request_and_its_stamp_loses_no_position(monkeypatch) -> None:
    """As on a loaded machine: the unit has the request long before the host notes when it sent it."""
    bench, write = Bench(), MemoryLink.write
    late_s = itertools.cycle((0.0, 0.0, 0.0, 0.03, 0.0, 0.03, 0.0))  # seven, against three requests a reading

    def late(link: MemoryLink, data: bytes) -> float:
        write(link, data)
        bench.wait(next(late_s))
        return bench.now

    monkeypatch.setattr(MemoryLink, "write", late)
    for target in (CENTRE + 60_000, CENTRE - 60_000):
        bench.slew(AxisSlew(target), AxisSlew(target))
        assert bench.polled_until_landed().unsynchronised == ""


def test_a_jump_that_no_delay_explains_is_told_with_its_bound() -> None:
    bench = Bench()
    bench.drive.read(bench.now)
    bench.wait(0.25)
    bench.unit.axes[0].position += 20_000 << 24
    why = bench.drive.read(bench.now).unsynchronised
    print(why)
    moved, elapsed, most = (float(found) for found in re.findall(r"([\d.]+) (?:counts from|s ago|that its)", why))
    assert moved == 20_000
    assert 0.25 <= elapsed < 0.28
    assert most == pytest.approx(4.5 * 3600.0 / STEP_ARCSEC * elapsed, rel=0.03)


def test_stop_really_stops_a_slew_and_the_tracking_behind_it() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 200_000, 16.5), AxisSlew(CENTRE - 200_000, 3.0))
    bench.wait(5.0)
    bench.drive.stop(bench.now)
    reading = bench.drive.read(bench.now)
    assert reading.motion == ()
    ahead = reading.axes[0].rate * (bench.now - reading.time)
    assert abs(reading.axes[0].counts + ahead - bench.true(0)) < 5.0
    bench.wait(6.0)
    assert bench.velocity(0) == bench.velocity(1) == 0.0
    before = bench.true(0)
    bench.wait(60.0)
    assert bench.true(0) == before
    assert bench.drive.read(bench.now).unsynchronised == ""


@pytest.mark.parametrize("lost", [0, 1])
def test_a_stop_of_which_one_request_is_lost_stops_all_the_same(lost: int) -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 200_000), AxisSlew(CENTRE - 200_000))
    bench.wait(3.0)
    sent = []

    def lose_one(frame: bytes) -> None:
        sent.append(frame)
        bench.line.dead = len(sent) - 1 == lost

    bench.line.before = lose_one
    with pytest.raises(Exception, match="did not answer"):
        bench.drive.stop(bench.now)
    bench.line.before, bench.line.dead = None, False
    bench.wait(10.0)
    assert bench.velocity(0) == bench.velocity(1) == 0.0


def test_a_slew_that_never_ends_is_stopped_and_refused() -> None:
    bench = Bench(simulator__landing_s=60.0)
    began = bench.slew(AxisSlew(CENTRE + 20_000, 16.5), AxisSlew(CENTRE))
    due = bench.drive._slew.due
    with pytest.raises(DriveRefused, match="after it should have ended; it was stopped"):
        bench.polled_until_landed()
    assert began < due < bench.now < due + 5.2
    bench.wait(1.0)
    assert bench.velocity(0) == 0.0
    assert not bench.drive.read(bench.now).axes[0].slewing


def test_a_limit_switch_in_the_way_ends_the_slew_where_it_is() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 100_000, 16.5), AxisSlew(CENTRE))
    bench.wait(3.0)
    bench.unit.press_limit(1, +1)
    reading = bench.polled_until_landed()
    assert "axis1_hard_positive_limit" in reading.limits
    assert reading.axes[0].counts < CENTRE + 50_000
    bench.wait(8.0)
    reading = bench.drive.read(bench.now)
    assert abs(reading.axes[0].counts - bench.true(0)) < 1.0
    assert reading.unsynchronised == ""


def test_an_alarm_is_named_and_keeps_the_telescope_still() -> None:
    bench = Bench()
    bench.unit.disturb(alarms=("supply_over_current",))
    assert bench.drive.read(bench.now).alarms == ("supply_over_current",)
    with pytest.raises(DriveRefused, match="supply_over_current"):
        bench.slew(AxisSlew(CENTRE + 1000), AxisSlew(CENTRE))
    bench.wait(2.0)
    assert bench.true(0) == CENTRE


def test_a_supply_that_shuts_down_in_a_slew_leaves_the_position_uncertain() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 100_000), AxisSlew(CENTRE))
    bench.wait(3.0)
    bench.unit.disturb(alarms=("supply_shut_down",))
    reading = bench.polled_until_landed()
    assert not reading.powered
    assert reading.alarms == ("supply_shut_down",)
    assert reading.axes[0].uncertainty_counts >= 20.0


def test_standby_in_a_slew_leaves_two_full_steps_of_doubt_until_a_sync() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 100_000, 16.5), AxisSlew(CENTRE))
    bench.wait(3.0)
    bench.unit.write_coils(0, [False])
    reading = bench.polled_until_landed()
    assert not reading.powered
    with pytest.raises(DriveRefused, match="standby"):
        bench.slew(AxisSlew(CENTRE), AxisSlew(CENTRE))
    bench.drive.power(on=True)
    reading = bench.drive.read(bench.now)
    off = abs(bench.unit.true_position(1) - bench.true(0))
    print(f"the axis moved {off:.0f} counts unseen, stated ±{reading.axes[0].uncertainty_counts:.1f}")
    assert off <= 20.0 <= reading.axes[0].uncertainty_counts < 22.0
    bench.keep(bench.drive.memory)
    assert bench.restarted().axes[0].uncertainty_counts >= 20.0
    bench.drive.sync([CENTRE, CENTRE], bench.now)
    assert bench.drive.read(bench.now).axes[0].uncertainty_counts < 1.0


def test_a_power_cycle_in_a_slew_is_noticed_and_a_sync_repairs() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 100_000, 16.5), AxisSlew(CENTRE))
    bench.wait(3.0)
    bench.unit.power_cycle()
    reading = bench.drive.read(bench.now)
    assert "power-cycled" in reading.unsynchronised
    assert not any(axis.slewing for axis in reading.axes)
    with pytest.raises(Unsynchronised):
        bench.slew(AxisSlew(CENTRE + 1000), AxisSlew(CENTRE))
    bench.wait(2.0)
    assert bench.velocity(0) == 0.0
    bench.drive.sync([CENTRE + 777, CENTRE], bench.now)
    assert bench.drive.read(bench.now).unsynchronised == ""
    bench.slew(AxisSlew(CENTRE + 1000), AxisSlew(CENTRE))
    assert int(bench.polled_until_landed().axes[0].counts) == CENTRE + 1000


def test_a_power_cycle_just_before_a_start_is_noticed_before_motion() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 5000), AxisSlew(CENTRE))
    bench.polled_until_landed()
    bench.unit.power_cycle()
    with pytest.raises(Unsynchronised, match="power-cycled"):
        bench.slew(AxisSlew(CENTRE + 1000), AxisSlew(CENTRE))
    bench.wait(2.0)
    assert bench.velocity(0) == 0.0


def test_a_sync_during_a_slew_is_refused() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 100_000), AxisSlew(CENTRE))
    with pytest.raises(DriveRefused, match="stop"):
        bench.drive.sync([CENTRE, CENTRE], bench.now)


def test_standby_stops_first_so_that_power_brings_no_motion() -> None:
    bench = Bench()
    bench.tracked(Straight((CENTRE, CENTRE), (16.5, 1.0), bench.now), 5.0)
    bench.drive.power(on=False)
    assert not bench.drive.read(bench.now).powered
    bench.drive.power(on=True)
    assert bench.drive.read(bench.now).powered
    bench.wait(2.0)
    assert bench.velocity(0) == 0.0


def test_a_slew_can_follow_a_slew_that_has_not_ended() -> None:
    bench = Bench()
    bench.slew(AxisSlew(CENTRE + 200_000, 16.5), AxisSlew(CENTRE + 50_000))
    bench.wait(4.0)
    bench.drive.read(bench.now)
    began = bench.slew(AxisSlew(CENTRE - 30_000), AxisSlew(CENTRE))
    bench.polled_until_landed()
    print(f"turned back and landed {bench.now - began:.1f} s later")
    assert bench.true(0) == CENTRE - 30_000
    assert bench.true(1) == CENTRE


def test_a_unit_whose_slew_bit_stays_set_is_slewn_again() -> None:
    bench = Bench(simulator__slew_bit_clears=False)
    for offset in (4000, -3000, 0):
        bench.slew(AxisSlew(CENTRE + offset), AxisSlew(CENTRE - offset))
        bench.polled_until_landed()
        assert bench.true(0) == CENTRE + offset


def test_every_readable_register_is_shown_as_a_person_reads_it() -> None:
    bench = Bench()
    shown = bench.drive.registers()
    print(
        len(shown), "registers;", shown["axis1_position"], "|", shown["supply_flags"], "|", shown["axis1_drive_type"]
    )
    assert shown["axis1_position"] == f"{CENTRE} counts"
    assert "motor_power_enabled" in shown["supply_flags"]
    assert shown["power"] == "1"
    assert "save_configuration" not in shown
    assert float(shown["axis1_max_speed"].split()[0]) * COUNTS_PER_SECOND > 1000.0


@pytest.mark.parametrize(
    "changed",
    [
        {"axis1.centre_deg": 1.0},
        {"axis2.reversed": True},
        {"axis1.main_gear": "1/288"},
        {"mount.type": "german"},
        {"site.latitude_deg": -43.0},
    ],
)
def test_counts_synchronised_under_another_configuration_are_not_trusted(changed):
    real = {"drive.link": "tcp://127.0.0.1:10001"}
    before = settings_of(load(None, {}, real))
    after = settings_of(load(None, {}, {**real, **changed}))
    nowhere = ModbusAscii(lambda: pytest.fail("nothing is contacted"), VirtualClock(T0))
    memory = {"unsynchronised": "", "position": [8388608.0, 8388608.0], "time": T0}
    kept = TC410(nowhere, before, memory).memory
    assert TC410(nowhere, before, kept).memory["unsynchronised"] == ""
    assert "configured anew since the last sync" in TC410(nowhere, after, kept).memory["unsynchronised"]
