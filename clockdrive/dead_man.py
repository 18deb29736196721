"""The program of the dead-man process: `python -m clockdrive.dead_man ORDERS`, started by `mounts.deadman`."""

import sys

from clockdrive.clock import SystemClock
from mounts.deadman_process import run

if __name__ == "__main__":
    sys.exit(run(sys.argv[1], SystemClock()))
