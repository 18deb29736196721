"""Whether it was ever seen that keys move the axes as far, and the way, that the configuration says.

The events of a motion tell how long it lasted, not how far it went: units that are wrong by one factor, and a sense
that is the other one, are seen on the sky alone. Until then no goto leads far. It is seen by a sync after a way by
keys, or by a commissioning.
"""

from collections.abc import Collection, Sequence

from mounts.awr.memory import Kept, Shown
from mounts.awr.settings import AwrSettings
from mounts.errors import DriveRefused

_LEAST = 0.4  # of the farthest unconfirmed way, that a sync must follow to tell anything
_AGREES = 0.05  # of the way by keys, by which a sync that confirms it may move the position
_UNITS, _REFERENCE, _POSTSCALER = "drive.frequency_unit", "drive.rate_reference", "drive.postscaler"
_KEYS = ({_UNITS, "axis1.reversed"}, {_UNITS, "axis2.reversed", "axis2.steps_per_degree"})


class Proof:
    """What was seen of both axes.

    Parameters
    ----------
    settings : AwrSettings
        What is assumed.
    kept : Kept
        What was seen before; nothing, where other things were assumed then.
    """

    def __init__(self, settings: AwrSettings, kept: Kept) -> None:
        self._settings = settings
        shown = kept.shown
        self._seen = list(shown.axes) if shown.assumed == settings.assumed else [False, False]
        self._led = list(shown.led) if shown.assumed == settings.assumed else [0.0, 0.0]

        self.referenced = shown.referenced and shown.assumed == settings.assumed
        """It was seen what the rates of GUIDE and CENTRE count from: by `commission`, as a sync is too coarse."""
        self.scaled = shown.scaled and shown.assumed == settings.assumed
        """The postscaler was seen to divide rates as configured."""

    @property
    def shown(self) -> Shown:
        """As it is remembered."""
        seen, led = (self._seen[0], self._seen[1]), (self._led[0], self._led[1])
        return Shown(self._settings.assumed, seen, led, self.referenced, self.scaled)

    def led(self, axis: int, steps: float) -> None:
        """A key moved an axis."""
        self._led[axis] += steps

    def synchronised(self, moved: Sequence[float] | None) -> str:
        """A sync moved the position by so many steps, None where it was unknown; return what a person should know."""
        doubts = []
        for axis, near in enumerate(self._settings.near):
            led, self._led[axis] = self._led[axis], 0.0
            if self._seen[axis] or moved is None or not abs(led) >= _LEAST * near:
                continue
            self._seen[axis] = abs(moved[axis]) <= _AGREES * abs(led)
            if not self._seen[axis]:
                doubts.append(f"axis {axis + 1} was {moved[axis] / led:+.0%} of its way from where its keys led it")
        return f"{'; '.join(doubts)}: {_WRONG}" if doubts else ""

    def confirmed(self, keys: Collection[str]) -> None:
        """A commissioning has confirmed these keys of the configuration."""
        for axis, needed in enumerate(_KEYS):
            self._seen[axis] = self._seen[axis] or needed <= set(keys)
        self.referenced = self.referenced or _REFERENCE in keys
        self.scaled = self.scaled or _POSTSCALER in keys

    def void(self) -> None:
        """The words or senses of the unit were changed."""
        self._seen, self._led, self.scaled = [False, False], [0.0, 0.0], False

    def require(self, ways: Sequence[float]) -> None:
        """Refuse keys that lead farther, by so many steps or with all since the last sync, than anybody has seen.

        Raises
        ------
        DriveRefused
            They do.
        """
        for axis, (way, near) in enumerate(zip(ways, self._settings.near, strict=True)):
            led = self._led[axis]
            farthest = max(abs(way), abs(led + way)) if way else 0.0
            if not self._seen[axis] and farthest > near:
                raise DriveRefused(
                    f"axis {axis + 1} would go {abs(way):.0f} steps, {abs(led + way):.0f} from where it was at the "
                    "last sync, and nobody has seen yet that its keys move it as far as frequency_unit says, the way "
                    f"that reversed says, so at most {near:.0f} steps (5°): `commission`, or `goto` a star 3° off in "
                    "both axes, centre it with `jog` and `sync` on it"
                )


_WRONG = (
    "frequency_unit and acceleration_unit, steps a degree or reversed are not as configured, or a star was another; "
    "`commission` finds out"
)
