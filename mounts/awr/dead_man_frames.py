"""What the dead-man process sends to an AWR Microstep: both pairs of keys are released.

A release does no harm when it is repeated. Its answer may stand among events, so it is looked for anywhere.
"""

from mounts.awr.commands import RELEASES, packet
from mounts.deadman_process import SafeFrame


def safe_frames() -> tuple[SafeFrame, ...]:
    """The frames that release all keys."""
    return tuple(SafeFrame(packet(body), rb":\s*Y\s*[\r\n#]") for body in RELEASES)
