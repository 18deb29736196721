"""Whether the position that a TC410 reports can be trusted.

The unit forgets its position when it is power-cycled, and says nothing of it. Its volatile target registers hold
what was last written to them: they are the boot cookie. When they changed, or the position is further from the last
one than the top speed explains, the position is unsynchronised until `synchronised`. A host that dies between two
writes leaves either cookie in the unit, so both are remembered before the first is written.
"""

from collections.abc import Mapping, Sequence

from mounts.remembered import NEVER, UNREADABLE, number, reinterpreted, text, whole
from mounts.tc410.unit import Values

POWER_CYCLED = (
    "the drive was power-cycled: its target registers no longer hold what was last written; `sync` on a known star"
)
RELOADED = "the configuration was loaded anew, so counts may mean other angles; `sync` on a known star"
REINTERPRETED = reinterpreted("gears")
BY_HAND = "the position register was written by hand; `sync` on a known star"
DECIDED = frozenset({RELOADED, BY_HAND, REINTERPRETED})  # by a person, so that no encoder undoes it
_CLOCKS_AGREE = 1.001  # true over measured time, at most
_JITTER_S = 0.005  # of the unit's own, two of its ticks and more
_ROUNDING_COUNTS = 2.0

Cookie = list[list[int]]  # for each axis every pair of words, joined, that may stand in its target register


class Trust:
    """What is known of one unit's position between readings and between processes.

    Parameters
    ----------
    memory : Mapping
        What `as_json` gave; empty for a unit never seen.
    """

    def __init__(self, memory: Mapping[str, object]) -> None:
        self.unsynchronised: str = NEVER
        self.uncertainty_counts = 0.0
        self._unseen = False  # whether the uncertainty allows for what nobody saw
        self._position: list[float] | None = None
        self._times: tuple[float, float] | None = None  # before which they cannot have been
        self._cookies: Cookie | None = None
        try:
            self._take(memory)
        except (TypeError, ValueError, OverflowError):
            self.unsynchronised = UNREADABLE
            self._position = self._times = self._cookies = None

    def _take(self, memory: Mapping[str, object]) -> None:
        """Take what was remembered, whatever is absent as unknown; what is of another form is an error."""
        self.unsynchronised = text(memory.get("unsynchronised", NEVER))
        self.uncertainty_counts = number(memory.get("uncertainty_counts", 0.0))
        self._unseen = memory.get("unseen") is True
        position, time, cookies = memory.get("position"), memory.get("time"), memory.get("cookies")
        if position is not None:
            self._position = [number(counts) for counts in _pair(position)]
        if time is not None:
            self._times = (number(time),) * 2
        if cookies is not None:
            self._cookies = [[whole(words) for words in _list(kept)] for kept in _pair(cookies)]

    def as_json(self) -> dict[str, object]:
        """Return what the next process must know."""
        return {
            "unsynchronised": self.unsynchronised,
            "uncertainty_counts": self.uncertainty_counts,
            "unseen": self._unseen,
            "position": self._position,
            "time": self._times and min(self._times),
            "cookies": self._cookies,
        }

    def judge(self, positions: Sequence[Values], top_rates: Sequence[float]) -> bool:
        """Compare positions and targets with what was last known; return whether the position was lost just now.

        Parameters
        ----------
        positions : sequence of Values
            Position and target of each axis as read.
        top_rates : sequence of float
            The fastest each axis can move, counts per second.
        """
        why = "" if self.unsynchronised else self._cookie_gone(positions) or self._jumped(positions, top_rates)
        self._position = [values[f"axis{axis}_position"] for axis, values in enumerate(positions, 1)]
        self._times = positions[0].asked, positions[1].asked
        self.unsynchronised = self.unsynchronised or why
        return bool(why)

    def _cookie_gone(self, positions: Sequence[Values]) -> str:
        if self._cookies is None:
            return ""
        found = [_joined(values.words[f"axis{axis}_target_position"]) for axis, values in enumerate(positions, 1)]
        kept = all(words in cookies for words, cookies in zip(found, self._cookies, strict=True))
        return "" if kept else POWER_CYCLED

    def _jumped(self, positions: Sequence[Values], top_rates: Sequence[float]) -> str:
        if self._position is None or self._times is None:
            return ""
        for i, (values, before, since, rate) in enumerate(
            zip(positions, self._position, self._times, top_rates, strict=True), 1
        ):
            elapsed = max(0.0, values.answered - since) * _CLOCKS_AGREE + _JITTER_S
            moved = abs(values[f"axis{i}_position"] - before)
            most = rate * elapsed + _ROUNDING_COUNTS
            if moved > most:
                return (
                    f"axis {i} stands {moved:.0f} counts from where it was {elapsed:.3f} s ago, more than the "
                    f"{most:.0f} that its top speed of {rate:.0f} counts/s explains; `sync` on a known star"
                )
        return ""

    def will_hold(self, targets: Sequence[tuple[int, ...]]) -> None:
        """Note the target words about to be written; until `holds` the old ones may stand there as well."""
        known = self._cookies or [[], []]
        self._cookies = [sorted({*before, _joined(words)}) for before, words in zip(known, targets, strict=True)]

    def holds(self, targets: Sequence[tuple[int, ...]]) -> None:
        """Note the target words that the unit has taken."""
        self._cookies = [[_joined(words)] for words in targets]

    def may_be_off(self, counts: float) -> None:
        """Note that the position may be off by so much."""
        self.uncertainty_counts = max(self.uncertainty_counts, counts)

    def may_have_moved_unseen(self, counts: float) -> None:
        """Note that the axes may have moved by so much while nobody looked; once, however often that was."""
        if not self._unseen:
            self._unseen = True
            self.moved_unseen(counts)

    def moved_unseen(self, counts: float) -> None:
        """Note that the axes may have moved by so much unseen, once more."""
        self.uncertainty_counts += counts

    def synchronised(self) -> None:
        """Trust the position from here on."""
        self.unsynchronised, self.uncertainty_counts, self._unseen = "", 0.0, False
        self._position = self._times = None

    def lose(self, why: str) -> None:
        """Trust the position no longer."""
        self.unsynchronised = why


def _joined(words: Sequence[int]) -> int:
    return words[0] << 16 | words[1]


def _list(stored: object) -> list[object]:
    if not isinstance(stored, list):
        raise TypeError(stored)
    return stored


def _pair(stored: object) -> list[object]:
    if len(pair := _list(stored)) != 2:
        raise ValueError(stored)
    return pair
