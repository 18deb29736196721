"""From the start of a process."""

import subprocess
import sys

from benchmarks.benchmark import benchmark, best_seconds


def process_seconds(*arguments: str) -> float:
    """Return the seconds from starting Python with these arguments until it has ended."""
    command = [sys.executable, *arguments]
    return best_seconds(lambda: subprocess.run(command, check=True, capture_output=True))  # noqa: S603 - our own code


@benchmark("`import clockdrive`, from process start", unit="s", at_most=0.25)
def import_clockdrive() -> tuple[float, str]:
    """Import the application."""
    alone = process_seconds("-c", "pass")
    return process_seconds("-c", "import clockdrive"), f"Python alone {alone:.3f} s"
