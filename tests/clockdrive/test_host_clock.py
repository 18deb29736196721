"""Whether the clock is right is asked on this computer only, and said with what it means on the sky."""

import os
import stat
import sys
import threading
import time

import pytest

from clockdrive import host_clock as module
from clockdrive.host_clock import (
    HostClock,
    HostClockCheck,
    error_bound,
    from_kernel,
    host_clock,
    parse_chrony,
    parse_w32tm,
)
from clockdrive.polled import at_once

CHRONY = (
    "C0A80001,192.168.0.1,3,1780000000.123456789,-0.000212000,0.000018300,0.000150000,-12.345,0.001,0.037,"
    "0.012000000,0.000800000,64.2,Normal\n"
)
W32TM = """Leap Indicator: 0(no warning)
Stratum: 4 (secondary reference - syncd by (S)NTP)
Precision: -23 (119.209ns per tick)
Root Delay: 0.0312500s
Root Dispersion: 7.7902343s
ReferenceId: 0xC0A80001 (source IP:  192.168.0.1)
Last Successful Sync Time: 6/19/2026 9:14:02 AM
Source: dc01.corp.example.com
Poll Interval: 10 (1024s)
"""
W32TM_GERMAN = """Sprungindikator: 3(nicht synchronisiert)
Stratum: 0 (nicht angegeben)
Präzision: -23 (119.209ns pro Tick)
Stammverzögerung: 0,0000000s
Stammabweichung: 0,0000000s
Referenz-ID: 0x00000000 (nicht angegeben)
"""


@pytest.fixture
def local_programs(tmp_path, monkeypatch):
    """Put programs of a test on the PATH, and nothing else."""
    monkeypatch.setenv("PATH", str(tmp_path))

    def program(name, body):
        path = tmp_path / name
        path.write_text(f"#!{sys.executable}\n{body}", encoding="utf-8")
        path.chmod(path.stat().st_mode | stat.S_IXUSR)

    return program


def test_this_computer_is_asked_and_answers():
    started = time.perf_counter()
    found = host_clock()
    print(f"{found} in {(time.perf_counter() - started) * 1e3:.1f} ms: {found.text}")
    assert found.synchronised in {True, False, None}
    assert found.error_s is None or 0.0 <= found.error_s <= 16.0
    assert "clock" in found.text


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the kernel of Linux")
def test_reading_the_kernel_changes_nothing():
    assert module._linux_kernel() == module._linux_kernel()


@pytest.mark.parametrize(
    ("status", "max_us", "estimated_us", "expected"),
    [
        (0x0040, 16_000_000, 16_000_000, (False, None)),
        (0x2001, 2_500, 40, (True, 0.0025)),
        (0x2001, 32_000, 0, (True, None)),  # systemd-timesyncd states no error
        (0x1000, 10, 10, (False, None)),  # hardware fault
        (0x2041, 10, 10, (False, None)),
    ],
)
def test_the_kernels_flags_decide(status, max_us, estimated_us, expected):
    found = from_kernel(status, max_us, estimated_us)
    assert (found.synchronised, found.error_s) == pytest.approx(expected)


def test_chronys_bound_is_offset_and_half_delay_and_dispersion():
    found = parse_chrony(CHRONY)
    assert found.synchronised is True
    assert found.error_s == pytest.approx(0.000212 + 0.006 + 0.0008, abs=1e-12)
    assert found.text == "clock synchronised to 7.01 ms (chrony): at most 0.11″"


@pytest.mark.parametrize(
    "answer",
    [
        CHRONY.replace("Normal", "Not synchronised"),
        CHRONY.replace("C0A80001,192.168.0.1", "7F7F0101,127.127.1.1"),
    ],
)
def test_a_chrony_without_a_source_is_not_synchronised(answer):
    found = parse_chrony(answer)
    assert found.synchronised is False
    assert "15″ a second" in found.text


@pytest.mark.parametrize(
    "answer", ["", "506 Cannot talk to daemon\n", "a,b,c", CHRONY.replace("0.0120", "nan,"), "," * 13]
)
def test_what_is_no_report_of_chrony_decides_nothing(answer):
    assert parse_chrony(answer) is None


def test_windows_time_is_read_in_english_and_says_how_bad_it_is():
    found = parse_w32tm(W32TM)
    assert found.synchronised is True
    assert found.error_s == pytest.approx(7.7902343 + 0.0312500 / 2, abs=1e-9)
    assert "117″" in found.text
    assert "nearer time source" in found.text


def test_windows_time_is_read_in_german_by_the_order_of_its_lines():
    assert parse_w32tm(W32TM_GERMAN).synchronised is False
    synchronised = (
        W32TM_GERMAN.replace(": 3(", ": 0(").replace("Stratum: 0", "Stratum: 3").replace("0,0000000", "0,25")
    )
    assert parse_w32tm(synchronised).error_s == pytest.approx(0.375)


def test_windows_on_its_own_clock_is_not_synchronised():
    assert parse_w32tm(W32TM.replace("0xC0A80001", "0x4C4F434C")).synchronised is False


@pytest.mark.parametrize("answer", ["", "The service has not been started.", W32TM[:80], "a:b\n" * 9])
def test_what_is_no_report_of_windows_time_decides_nothing(answer):
    assert parse_w32tm(answer) is None


def test_the_bound_is_the_root_distance():
    assert error_bound(-0.001, 0.010, 0.002) == pytest.approx(0.008)


@pytest.mark.parametrize(
    ("state", "words"),
    [
        (HostClock(synchronised=False, error_s=None, source="x"), ["clock not synchronised: 15″ a second", "sync"]),
        (HostClock(synchronised=None, error_s=None, source="x"), ["not checked", "15″", "sync"]),
        (HostClock(synchronised=True, error_s=None, source="x"), ["not stated"]),
        (HostClock(synchronised=True, error_s=3e-7, source="x"), ["0.3 µs"]),
        (HostClock(synchronised=True, error_s=2.0, source="x"), ["2 s", "30″", "nearer"]),
    ],
)
def test_every_state_is_one_sentence_with_its_meaning(state, words):
    print(state.text)
    assert all(word in state.text for word in words)


@pytest.mark.skipif(os.name == "nt", reason="programs made here are POSIX scripts")
def test_chrony_is_asked_before_the_kernel_and_never_by_name_over_the_network(local_programs):
    local_programs(
        "chronyc", f"import sys; assert sys.argv[1:] == ['-n', '-c', 'tracking']; print({CHRONY!r}, end='')"
    )
    assert host_clock() == parse_chrony(CHRONY)


@pytest.mark.skipif(os.name == "nt", reason="programs made here are POSIX scripts")
@pytest.mark.parametrize(
    "body", ["print('506 Cannot talk to daemon'); raise SystemExit(1)", "print('garbage')", "import os; os.abort()"]
)
def test_a_chrony_that_does_not_run_leaves_the_word_to_the_kernel(local_programs, body):
    local_programs("chronyc", body)
    assert host_clock().source != "chrony"


@pytest.mark.skipif(os.name == "nt", reason="programs made here are POSIX scripts")
def test_a_chrony_that_hangs_is_given_up(local_programs, monkeypatch):
    monkeypatch.setattr(module, "_PATIENCE_S", 0.3)
    local_programs("chronyc", "import time; time.sleep(60)")
    started = time.perf_counter()
    assert host_clock().source != "chrony"
    assert time.perf_counter() - started < 5.0


def test_a_computer_that_tells_nothing_is_unknown_not_wrong(monkeypatch):
    for name in ("_chrony", "_linux_kernel", "_windows_time"):
        monkeypatch.setattr(module, name, lambda: None)
    assert host_clock().synchronised is None


def test_the_answer_is_kept_for_a_minute_of_the_callers_time():
    asked = []

    def ask():
        asked.append(1)
        return HostClock(synchronised=True, error_s=len(asked) * 1e-3, source="test")

    check = HostClockCheck(ask, at_once)
    assert [check.at(t).error_s for t in (0.0, 1.0, 59.0, 60.0, 61.0)] == [1e-3, 1e-3, 1e-3, 2e-3, 2e-3]
    assert check.at(-1000.0).error_s == 3e-3, "a clock set back must not keep an answer for ever"


def test_only_the_first_call_waits():
    release, answers = threading.Event(), iter(range(1, 9))

    def ask():
        count = next(answers)
        if count > 1:
            release.wait(20.0)
        return HostClock(synchronised=True, error_s=count * 1e-3, source="test")

    check = HostClockCheck(ask)
    assert check.at(0.0).error_s == 1e-3
    started = time.perf_counter()
    answers_meanwhile = {check.at(100.0 + t).error_s for t in range(500)}
    slowest = time.perf_counter() - started
    release.set()
    print(f"500 looks while the computer does not answer: {slowest * 1e3:.1f} ms")
    assert answers_meanwhile == {1e-3}
    assert slowest < 1.0
