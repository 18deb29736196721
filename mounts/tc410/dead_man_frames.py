"""What the dead-man process sends to a TC410: no source but hands may move the axes, and nothing is left to go on.

"All stop" zeroes the target velocities but leaves tracking running, so the bits that let the host move the axes are
cleared first: that alone stops them. A write is answered by its echo.
"""

import re

from mounts.deadman_process import SafeFrame
from mounts.tc410.registers import by_name
from transports.ascii_frame import encode_frame
from transports.modbus_request import write_register_request

UNIT = 0xFF
_CONTROL = by_name("velocity_control")
_OF_THE_HOST = _CONTROL.mask("slew_to_target", "remote_control", "tracking")


def safe_frames(velocity_control: int = 0, unit: int = UNIT) -> tuple[SafeFrame, ...]:
    """Return the frames that stop the axes.

    Parameters
    ----------
    velocity_control : int
        The flags as last written; joystick and autoguider stay as they are in it.
    unit : int
        The unit's address.
    """
    orders = ((_CONTROL.address, velocity_control & ~_OF_THE_HOST), (by_name("all_stop").address, 1))
    return tuple(_echoed(encode_frame(unit, write_register_request(*order).pdu)) for order in orders)


def _echoed(frame: bytes) -> SafeFrame:
    return SafeFrame(frame, b"(?i)" + re.escape(frame.rstrip()) + rb"[\r\n]")
