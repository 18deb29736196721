"""Owner, other terminals and the drive as processes of their own: none of them can lose the telescope.

The drive is a simulator hosted by another process, or served from this one where the test looks inside it.
"""

import os
import signal
import sys

import pytest

from clockdrive.cli import main
from clockdrive.clock import SystemClock
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from transports.serve import serve

NEAR, FAR = "hadec:1,-41", "hadec:40,-41"
SLOW_DEG_S = 2.0  # from park to FAR it slews for longer than a busy computer takes to start three commands


@pytest.fixture
def served(written):
    """A simulated unit served from this process on a TCP port; its true state can be looked at."""
    configuration = load(written("sim:", "unit.toml", speed_deg_s=SLOW_DEG_S), {}, {})
    unit = tc410.simulated(configuration, SystemClock().now(), None)
    with serve(unit, SystemClock(), "tcp://127.0.0.1:0") as server:
        unit.file = written(server.address, speed_deg_s=SLOW_DEG_S)
        yield unit


def moved(unit):
    return any(axis.moved for axis in unit.axes)


@pytest.fixture
def still(eventually, served):
    def wait():
        def stands():
            before = [axis.position for axis in served.axes]
            served.memory.raw("velocity_control")
            served.advance(SystemClock().now())
            return not moved(served) and before == [axis.position for axis in served.axes]

        return eventually(stands)

    return wait


@pytest.fixture
def slewing(started, served, run):
    """A goto by its own process, caught while the telescope slews."""
    run("-c", served.file, "sync", "hadec:0,-42.4", "--force")
    process = started("-c", served.file, "goto", FAR)

    def wait(eventually):
        eventually(lambda: moved(served))
        return process

    return wait


def test_a_pointing_run_of_another_process_is_stopped_from_a_third_and_goes_on_later(
    started, written, answer, eventually
):
    """The owner moves the telescope, a command takes the run, a third stops it: what was begun is there to go on."""
    file = written("sim:")
    owner = started("-c", file, "run")
    owner.until("owning the telescope")
    taking = started("-c", file, "pointing-run", "--name", "night", "--stars", "6", "--settle", "0")
    eventually(lambda: answer("-c", file, "status")["doing"] == "slewing")
    assert answer("-c", file, "stop")["ok"]
    assert taking.ended() == 1
    assert "stopped by command" in taking.text
    assert answer("-c", file, "status")["doing"] == "idle"
    kept = answer("-c", file, "pointing-run", "show", "night")["run"]
    assert kept["planned"] + kept["observed"] == 6
    assert kept["planned"] > 0
    again = started("-c", file, "pointing-run", "resume", "--settle", "0")
    eventually(lambda: answer("-c", file, "status")["doing"] == "slewing")
    again.signal(signal.SIGINT)
    assert again.ended() == 130
    assert "what was seen is kept; `pointing-run resume` goes on with it" in again.text
    eventually(lambda: answer("-c", file, "status")["doing"] == "idle")
    assert owner.popen.poll() is None


def test_status_and_stop_reach_a_goto_from_another_terminal(slewing, served, answer, eventually, still):
    process = slewing(eventually)
    assert answer("-c", served.file, "status")["doing"] == "slewing"
    refused = answer("-c", served.file, "goto", NEAR, code=1)
    assert "the telescope is slewing; wait for it" in refused["reason"]
    assert answer("-c", served.file, "stop")["ok"]
    assert process.ended() == 1
    assert "stopped by command" in process.text
    assert still()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["SIGINT", "SIGTERM"])
def test_one_interruption_stops_the_motion_first(number, slewing, served, eventually, still):
    process = slewing(eventually)
    process.signal(number)
    process.signal(number)  # a second one is not needed, and does no harm
    assert process.ended() == 130
    assert "Traceback" not in process.text
    assert still()
    assert abs(served.counted_position(1) - 0x800000) < 150_000  # it never got there


def test_a_running_owner_serves_all_and_a_second_one_is_refused(started, served, run, answer, still):
    owner = started("-c", served.file, "run")
    owner.until("owning the telescope")
    run("-c", served.file, "sync", "hadec:0,-42.4", "--force")
    second = run("-c", served.file, "run", code=1)
    assert f"owned by process {owner.popen.pid}" in second.stderr
    assert answer("-c", served.file, "goto", NEAR)["slews"] == 1
    assert answer("-c", served.file, "status")["doing"] == "tracking"
    run("-c", served.file, "goto", NEAR, "--for", "0.3s")
    assert answer("-c", served.file, "status")["doing"] == "idle"
    owner.signal(signal.SIGTERM)
    assert owner.ended() == 130
    assert still()


@pytest.mark.skipif(sys.platform == "win32", reason="no process is suspended there")
def test_a_frozen_owner_is_told_by_its_process_id_with_what_to_do(started, served, answer, monkeypatch, capsys):
    owner = started("-c", served.file, "run")
    owner.until("owning the telescope")
    owner.signal(signal.SIGSTOP)
    monkeypatch.setattr("clockdrive.control_socket._HANDSHAKE_S", 1.0)
    try:
        assert main(["-c", str(served.file), "status"]) == 1
    finally:
        owner.signal(signal.SIGCONT)
    said = capsys.readouterr().err
    assert f"is owned by process {owner.popen.pid} (`run`" in said
    assert "does not answer: it is frozen" in said
    assert f"`kill -CONT {owner.popen.pid}`" in said
    assert f"`kill -9 {owner.popen.pid}`, and the next command makes the drive safe" in said
    assert answer("-c", served.file, "status")["ok"]


def test_a_jog_at_a_lower_speed_leaves_no_difference_in_the_drives_registers(started, served, run, answer):
    owner = started("-c", served.file, "run")
    owner.until("owning the telescope")
    run("-c", served.file, "sync", "hadec:0,-42.4", "--force")
    before = answer("-c", served.file, "drive", "diff")["differences"]
    full = served.memory.raw("axis1_max_speed")
    answer("-c", served.file, "jog", "1", "0.3", "--for", "1s")
    assert served.memory.raw("axis1_max_speed") == full
    assert answer("-c", served.file, "drive", "diff")["differences"] == before
    assert "axis1.max_speed_deg_s" not in answer("-c", served.file, "drive", "pull")["changed"]


def test_interrupting_a_goto_that_the_owner_does_stops_it_there(started, served, run, answer, eventually, still):
    owner = started("-c", served.file, "run")
    owner.until("owning the telescope")
    run("-c", served.file, "sync", "hadec:0,-42.4", "--force")
    attached = started("-c", served.file, "goto", FAR)
    eventually(lambda: moved(served))
    attached.signal(signal.SIGINT)
    assert attached.ended() == 130
    assert answer("-c", served.file, "status")["doing"] == "idle"
    assert still()
    tracking = started("-c", served.file, "track", NEAR)
    tracking.until(f"on {NEAR}")
    tracking.signal(signal.SIGINT)
    assert tracking.ended() == 130
    stops = [line for log in served.file.parent.glob("state/*.log") for line in log.read_text("utf-8").splitlines()]
    assert [line.split("Z ")[1] for line in stops][-2:].count("stopped: by command") == 1, "once, not twice"
    assert answer("-c", served.file, "status")["doing"] == "idle"


def test_an_owner_killed_during_a_slew_leaves_a_telescope_that_the_next_start_makes_safe(
    slewing, served, answer, eventually, still
):
    process = slewing(eventually)
    process.popen.kill()
    process.ended()
    status = answer("-c", served.file, "status")
    assert status["doing"] == "idle"
    assert still()
    status = answer("-c", served.file, "status")
    assert status["synchronised"] or status["unsynchronised_because"]
    if status["synchronised"]:
        for number, axis in enumerate(status["axes"], start=1):
            assert abs(axis["counts"] - served.true_position(number)) <= 2.0
        assert answer("-c", served.file, "goto", NEAR)["slews"] == 1


def test_a_power_cycle_during_a_slew_is_noticed_refused_and_repaired_by_a_sync(
    slewing, served, run, answer, eventually
):
    process = slewing(eventually)
    served.power_cycle()
    assert process.ended() == 1
    assert "power" in process.text
    refused = answer("-c", served.file, "goto", NEAR, code=1)
    assert "not synchronised" in refused["reason"]
    assert not answer("-c", served.file, "status")["synchronised"]
    run("-c", served.file, "sync", "hadec:20,-42", "--force")
    assert answer("-c", served.file, "goto", "hadec:21,-41")["slews"] == 1


@pytest.mark.skipif(sys.platform == "win32", reason="no pseudo-terminals")
def test_a_hosted_simulator_is_driven_over_a_serial_line(started, written, run, answer, tmp_path):
    port = tmp_path / "ttySIM"
    host = started("-c", written("sim:", "unit.toml"), "simulate", "tc410", "--listen", f"pty:{port}")
    assert f"serial://{port}" in host.until("Ctrl-C ends")
    file = written(f"serial://{port}?baud=9600")
    run("-c", file, "sync", "hadec:0,-42.4", "--force")
    arrived = answer("-c", file, "goto", NEAR)
    assert arrived["slews"] == 1
    run("-c", file, "stop")
    host.signal(signal.SIGINT)
    assert host.ended() == 130


def test_a_hosted_simulator_says_where_it_listens_and_takes_one_client(started, written, run, answer):
    host = started("-c", written("sim:", "unit.toml"), "simulate", "tc410", "--listen", "tcp://127.0.0.1:0")
    line = host.until("Ctrl-C ends")
    link = next(word for word in line.replace(";", " ").split() if word.startswith("tcp://"))
    owner = started("-c", written(link), "run")
    owner.until("owning the telescope")
    elsewhere = written(link, "elsewhere.toml", state=os.devnull + "x")
    elsewhere.write_text(elsewhere.read_text().replace(os.devnull + "x", str(elsewhere.parent / "other state")))
    second = run("-c", elsewhere, "status", code=1)
    assert link.removeprefix("tcp://") in second.stderr
    assert answer("-c", written(link), "status")["ok"]
    owner.signal(signal.SIGINT)
    assert owner.ended() == 130
