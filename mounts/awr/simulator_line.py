"""One direction of a worn line: bytes are lost, come twice, or come late with all that is behind them."""

import math
import random

from mounts.awr.simulator_settings import SimulatorSettings


class WornLine:
    """One direction.

    Parameters
    ----------
    settings : SimulatorSettings
        How likely what happens to a byte.
    rng : random.Random
        Decides.
    """

    def __init__(self, settings: SimulatorSettings, rng: random.Random) -> None:
        self._settings = settings
        self._rng = rng
        self._free = -math.inf  # before which nothing more arrives, as a late byte is ahead of it

    def carried(self, data: bytes, t: float) -> list[tuple[float, bytes]]:
        """The pieces as which bytes sent at `t` arrive, and when."""
        wear = self._settings
        at = max(t, self._free)
        if not (wear.byte_loss or wear.byte_doubling or wear.byte_delay):
            return [(at, data)]
        pieces, piece = [], bytearray()
        for byte in data:
            chance = self._rng.random() - wear.byte_loss
            if chance < 0.0:
                continue
            if 0.0 <= chance - wear.byte_doubling < wear.byte_delay:
                pieces.append((at, bytes(piece)))
                piece.clear()
                at += wear.byte_delay_s
            piece += bytes((byte, byte)) if chance < wear.byte_doubling else bytes((byte,))
        self._free = at if at > t else self._free
        return [each for each in (*pieces, (at, bytes(piece))) if each[1]]
