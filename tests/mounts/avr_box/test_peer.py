"""A program by others at the other end of the wire: INDI's driver for setting circles reads the simulator's encoders.

Debian's package indi-bin brings `indi_dsc_telescope`, `indiserver` and the command-line clients. It sends `Q` alone.
"""

import os
import shutil
import socket
import subprocess
import sys
from collections.abc import Iterator

import pytest
from avr_bench import COUNT, STEPS_PER_TURN
from waiting import seconds_until

from clockdrive.clock import SystemClock
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.simulator_settings import SimulatorSettings
from transports.serve import serve

DEVICE = "Digital Setting Circle"
PROGRAMS = ("indiserver", "indi_dsc_telescope", "indi_getprop", "indi_setprop")


@pytest.fixture
def port(tmp_path) -> Iterator[int]:
    """A server of INDI with that driver."""
    if missing := [name for name in PROGRAMS if shutil.which(name) is None]:
        if os.environ.get("CI"):
            pytest.fail(f"{missing[0]} is missing: install indi-bin, the independent client comes from there")
        pytest.skip("indi-bin is missing")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        number = free.getsockname()[1]
    server = subprocess.Popen(
        ["indiserver", "-p", str(number), "indi_dsc_telescope"],
        env={**os.environ, "HOME": str(tmp_path)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    yield number
    server.terminate()
    server.wait(10.0)


def told(port: int, name: str) -> str:
    asked = subprocess.run(
        ["indi_getprop", "-p", str(port), "-t", "2", "-1", f"{DEVICE}.{name}"],
        capture_output=True,
        text=True,
        check=False,
    )
    return asked.stdout.strip()


def tell(port: int, setting: str) -> None:
    subprocess.run(["indi_setprop", "-p", str(port), f"{DEVICE}.{setting}"], capture_output=True, check=False)


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are a matter of POSIX")
def test_the_setting_circle_driver_of_indi_reads_the_encoder_counts(port, tmp_path):
    clock = SystemClock()
    box = SimulatedAvrBox(SimulatorSettings(), clock.now(), STEPS_PER_TURN)
    box.push(1, 1234.0 * COUNT[0])
    box.push(2, -567.0 * COUNT[1])
    with serve(box, clock, f"pty:{tmp_path / 'tty'}", baud=9600):
        seconds_until(lambda: told(port, "DEVICE_PORT.PORT") != "", 30.0, "INDI")
        tell(port, f"DEVICE_PORT.PORT={tmp_path / 'tty'}")
        tell(port, "CONNECTION.CONNECT=On")
        seconds_until(lambda: told(port, "DCS_ENCODER.AXIS2_RAW_ENCODER") == "-567", 30.0, "INDI")
        one = int(told(port, "DCS_ENCODER.AXIS1_RAW_ENCODER"))
    print(f"\nINDI reads {one} and -567 for 1234 and -567, axis 1 tracking on at a count every 4.3 s")
    assert 1234 <= one <= 1234 + 20
