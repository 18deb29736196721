"""What the dead-man process sends to an AWR Microstep: both pairs of keys are released.

A release does no harm when it is repeated. Its answer may stand among events, so it is looked for anywhere. All
answers are alike, so what was asked before is first let come.
"""

from mounts.awr.commands import RELEASES, packet
from mounts.awr.unit import PACKET_S
from mounts.deadman_process import SafeFrame

_QUIET_S = PACKET_S + 0.02  # an answer comes within that, and a serial server may hold it back for a moment


def safe_frames() -> tuple[SafeFrame, ...]:
    """The frames that release all keys."""
    return tuple(SafeFrame(packet(body), rb":\s*Y\s*[\r\n#]", _QUIET_S) for body in RELEASES)
