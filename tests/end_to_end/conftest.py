"""Real processes: a hosted simulator, the command line, and files between them. All waiting is on events."""

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time

import pytest
from waiting import seconds_until

DEADLINE_S = 30.0


class Process:
    """A command that runs, its lines as they come."""

    def __init__(self, *words):
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "clockdrive", *map(str, words)],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        self.lines = queue.Queue()
        self.text = ""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self.popen.stdout:
            self.lines.put(line)
        self.lines.put(None)

    def until(self, text):
        """Wait for a line that contains `text`; return it."""
        deadline = time.monotonic() + DEADLINE_S
        while (line := self.lines.get(timeout=max(0.01, deadline - time.monotonic()))) is not None:
            self.text += line
            if text in line:
                return line
        raise AssertionError(f"{text!r} never came:\n{self.text}")

    def ended(self):
        """Wait for the end; return the exit code."""
        code = self.popen.wait(DEADLINE_S)
        self._reader.join(DEADLINE_S)
        while not self.lines.empty():
            self.text += self.lines.get() or ""
        self.popen.stdout.close()
        return code

    def signal(self, number):
        self.popen.send_signal(number)

    def end(self):
        if self.popen.poll() is None:
            self.popen.kill()
        self.ended()


@pytest.fixture
def started():
    """Start commands, and end at the latest with the test."""
    processes = []

    def start(*words):
        processes.append(Process(*words))
        return processes[-1]

    yield start
    for process in reversed(processes):
        process.end()


@pytest.fixture
def written(tmp_path):
    """Write the configuration of a telescope at a link."""

    def write(link, name="telescope.toml", *, speed_deg_s=4.5, **more):
        path = tmp_path / name
        axis = f"acceleration_register = 255\ndeceleration_register = 255\nmax_speed_deg_s = {speed_deg_s}\n"
        path.write_text(
            f'[site]\nname = "Test"\nlatitude_deg = -42.4\nlongitude_deg = 173.7\n[drive]\nkind = "tc410"\n'
            f'link = "{link}"\n[limits]\nsun_avoidance_deg = 0.0\n[axis1]\n{axis}[axis2]\n{axis}'
            f'[state]\npath = "{more.get("state", tmp_path / "state")}"\n',
            encoding="utf-8",
        )
        return path

    return write


def run(*words, code=0):
    """Run a command to its end; return what it said."""
    done = subprocess.run(
        [sys.executable, "-m", "clockdrive", *map(str, words)],
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=DEADLINE_S,
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done


@pytest.fixture(name="run")
def run_fixture():
    return run


@pytest.fixture
def answer():
    """Run a command; return its one JSON document."""

    def answers(*words, code=0):
        return json.loads(run(*words, "--json", code=code).stdout)

    return answers


@pytest.fixture
def eventually():
    """Ask until it is so, or the deadline has passed; return what was answered."""

    def ask(question):
        found = []
        seconds_until(lambda: found.append(question()) or found[-1], DEADLINE_S)
        return found[-1]

    return ask


INTERRUPT = signal.SIGINT
