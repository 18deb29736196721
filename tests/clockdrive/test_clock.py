"""Time passes on the virtual clock only when somebody sleeps."""

import threading
import time

import numpy as np
import pytest
from astropy.time import Time

from clockdrive.clock import SystemClock, VirtualClock


def test_a_night_passes_at_once_on_the_virtual_clock():
    clock = VirtualClock(1_800_000_000.0)
    for _ in range(36_000):
        clock.sleep(1.0)
    assert clock.now() == 1_800_036_000.0


def test_the_virtual_clock_never_goes_back():
    clock = VirtualClock(5.0)
    clock.sleep(-3.0)
    assert clock.now() == 5.0


def test_no_sleep_is_lost_between_threads():
    clock = VirtualClock(0.0)
    threads = [threading.Thread(target=lambda: [clock.sleep(0.5) for _ in range(2000)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert clock.now() == 4000.0


def test_the_system_clock_gives_posix_seconds_and_does_not_wait_for_the_past():
    clock = SystemClock()
    before = time.time()
    clock.sleep(-1.0)
    clock.sleep(0.001)
    assert before + 0.001 <= clock.now() <= before + 5.0


def test_a_virtual_clock_stands_at_the_moment_given_in_whatever_scale():
    utc = Time("2026-11-24T22:00:00", scale="utc")
    for start in (utc, utc.tdb, np.float64(1_795_557_600.0), 1_795_557_600):
        now = VirtualClock(start).now()
        assert type(now) is float
        assert now == pytest.approx(1_795_557_600.0, abs=1e-6)
