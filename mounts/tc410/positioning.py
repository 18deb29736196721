"""How a TC410 is told where its axes are, and that it took it."""

from collections.abc import Sequence

from mounts.errors import DriveRefused
from mounts.tc410.parts import AXES, Parts
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND, by_name

WRITE_CHARACTERS = 27  # of the request that writes a pair
_ANSWER_CHARACTERS = 19  # of the answer that brings a pair


class Positioning(Parts):
    """Writes positions, and the cookie that tells a power-cycle."""

    def _leave_cookie(self, counts: Sequence[float]) -> None:
        """Write target registers that power-up would not leave behind."""
        whole = [int(here) for here in counts]
        self._write_targets(self._encoded("target_position", [here ^ (here == CENTRE) for here in whole]))

    def _set_position(self, counts: Sequence[float], since: float) -> None:
        """Write both positions, those of the time `since`, read them back, and trust them."""
        lost = 0.0  # of a count, for the unit takes whole ones
        for axis, value in zip(AXES, counts, strict=True):
            here = self._carried(axis, value, since)
            lost = max(lost, abs(here - round(here)))
            pair = self._unit.encoded(f"axis{axis}_position", here)
            written = self._unit.write_words(f"axis{axis}_position", pair)
            self._check_synchronised(axis, pair, written)
        self._leave_cookie(counts)
        self._trust.synchronised()
        self._trust.may_be_off(lost)
        self._powered = True  # motors without power may still settle after it: their loss counts anew
        self._landing = self._tracked = None
        self._compare_encoders = True

    def _carried(self, axis: int, counts: float, since: float) -> float:
        """Where an axis that was at `counts` at the time `since` will be when a write reaches the unit."""
        name = f"axis{axis}_velocity"
        seen = self._unit.read(name)
        reached = seen.time + self._unit.burst_s(1, _ANSWER_CHARACTERS + WRITE_CHARACTERS)
        return counts + seen[name] * COUNTS_PER_SECOND * (reached - since)

    def _check_synchronised(self, axis: int, words: tuple[int, ...], written: float) -> None:
        wanted = by_name(f"axis{axis}_position").decode(words, self._unit.position_format)
        found = self._unit.read(f"axis{axis}_position", f"axis{axis}_target_position")
        position, rate = found[f"axis{axis}_position"], self._axis_register(axis, "velocity") * COUNTS_PER_SECOND
        expected = wanted + rate * (found.time - written)
        if abs(position - expected) > abs(rate) * (found.late_s + 0.1) + 2.0:
            raise DriveRefused(f"axis {axis} reads back {position:.0f} counts instead of {expected:.0f}; try again")
