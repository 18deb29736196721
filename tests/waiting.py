"""Waiting for what another process or thread does: for the event itself, with a deadline, never for a time."""

import time

POLL_S = 0.002
PATIENCE_S = 20.0
"""Far beyond what anything here takes, on a computer that is very busy."""


def seconds_until(condition, within_s=PATIENCE_S, what="it"):
    """Seconds until `condition` holds; fails when it does not within `within_s`."""
    begun = time.monotonic()
    while not condition():
        assert time.monotonic() - begun < within_s, f"{what} did not happen within {within_s:g} s"
        time.sleep(POLL_S)
    return time.monotonic() - begun
