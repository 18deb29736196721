"""Modbus-ASCII frames as pure functions: bytes in, frames out, no link and no clock.

A frame is `:`, then unit, PDU and LRC in hexadecimal, then CR LF. It ends at the CR, or at an LF alone; so a
unit that ends its frames with CR alone is understood. A `:` always begins a frame anew, anything but a
hexadecimal digit spoils the one begun, and what does not add up is dropped without a word: its request then
goes unanswered. (Modbus over Serial Line V1.02, 2.5.2.)
"""

import re
from typing import NamedTuple

from pymodbus.framer import FramerAscii

MAX_PDU = 253
MAX_FRAME = 513  # `:`, two digits for each of unit, 253 bytes of PDU and LRC, CR LF
_MAX_DIGITS = 2 * (1 + MAX_PDU + 1)
_WHOLE = re.compile(rb"((?:[0-9A-Fa-f]{2}){3,%d})[\r\n]" % (_MAX_DIGITS // 2))
_BEGUN = re.compile(rb"[0-9A-Fa-f]{0,%d}" % _MAX_DIGITS)


class Frame(NamedTuple):
    """One frame whose LRC is right."""

    unit: int
    pdu: bytes


def encode_frame(unit: int, pdu: bytes) -> bytes:
    """Return the frame that carries `pdu` to or from `unit`."""
    body = bytes((unit,)) + pdu
    return b":%s%02X\r\n" % (body.hex().upper().encode("ascii"), FramerAscii.compute_LRC(body))


class FrameDecoder:
    """Finds the frames in a stream of bytes, however it is cut into pieces.

    Never raises, and holds at most one unfinished frame.
    """

    def __init__(self) -> None:
        self._begun = b""

    @property
    def begun(self) -> bytes:
        """The frame that has begun and not ended, `:` included; empty between frames."""
        return self._begun

    def feed(self, data: bytes) -> list[Frame]:
        """Take the next bytes; return the frames they complete, in order."""
        _, *texts = (self._begun + data).split(b":")
        self._begun = b":" + texts[-1] if texts and _BEGUN.fullmatch(texts[-1]) else b""
        return [frame for text in texts if (frame := _decode(text))]


def _decode(text: bytes) -> Frame | None:
    """Return the frame that `text`, which stood behind a `:`, begins with."""
    if not (match := _WHOLE.match(text)):
        return None
    body = bytes.fromhex(match[1].decode("ascii"))
    if FramerAscii.compute_LRC(body[:-1]) != body[-1]:
        return None
    return Frame(body[0], body[1:-1])
