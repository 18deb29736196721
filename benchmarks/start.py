"""From the start of a process."""

import os
import subprocess
import sys

from benchmarks.benchmark import benchmark, best_seconds

_STARTS = 15  # a process takes much of the machine, so it is disturbed oftener than a call


def process_seconds(*arguments: str) -> float:
    """Return the seconds from starting Python with these arguments until it has ended.

    Python keeps what it has compiled, as every installation has it; told not to, each start would compile it anew.
    """
    command = [sys.executable, *arguments]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}

    def once() -> None:
        subprocess.run(command, check=True, capture_output=True, env=environment)  # noqa: S603 - our own code

    return best_seconds(once, repeats=_STARTS)


@benchmark("`import clockdrive`, from process start", unit="s", at_most=0.25)
def import_clockdrive() -> tuple[float, str]:
    """Import the application."""
    alone = process_seconds("-c", "pass")
    return process_seconds("-c", "import clockdrive"), f"Python alone {alone:.3f} s"
