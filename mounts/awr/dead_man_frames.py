"""What the dead-man process sends to an AWR Microstep: both drives are switched off, both pairs of keys released.

Neither does harm when it is repeated. The answers may stand among events, so they are looked for anywhere. Those of
the drives say which word was written; those of all keys are alike, so what was asked before is first let come.
"""

from mounts.awr.commands import RELEASES, packet, soft_write
from mounts.awr.registers import BY_NAME, RAM, Flags
from mounts.awr.speeds import DRIVES
from mounts.awr.unit import PACKET_S
from mounts.deadman_process import ANSWER_S, SafeFrame

_SPARE_S = 0.02  # by which a serial server may hold an answer back for a moment
_OFF = Flags(enable=False, positive=False, postscaler=1)  # no unit divides by 0 so, on or off


def safe_frames(timeout_s: float = PACKET_S) -> tuple[SafeFrame, ...]:
    """The frames that switch both drives off, in RAM, and release all keys.

    Parameters
    ----------
    timeout_s : float
        In which an answer comes.
    """
    patience_s = timeout_s + _SPARE_S
    return (
        *(_switched_off(drive, patience_s) for drive in DRIVES),
        *(_released(body, patience_s) for body in RELEASES),
    )


def _switched_off(drive: str, patience_s: float) -> SafeFrame:
    register = BY_NAME[f"{drive}_flags"]
    answer = rb":\s*%02X\s*\??\s*Y\s*[\r\n#]" % (register.address | RAM)
    return SafeFrame(packet(soft_write(register, _OFF.word)), answer, answer_s=max(ANSWER_S, patience_s))


def _released(body: str, patience_s: float) -> SafeFrame:
    return SafeFrame(packet(body), rb":\s*Y\s*[\r\n#]", patience_s, max(ANSWER_S, patience_s))
