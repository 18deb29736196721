"""Whether it was ever seen that keys move the axes as far, and the way, that the configuration says.

The events of a motion tell how long it lasted, not how far it went: units that are wrong by one factor, and a sense
that is the other one, are seen on the sky alone. Until then no keys lead far from where a person said that the axes
are, and what is stated covers the other sense. It is seen by a sync after a way by keys, or by a commissioning; as
closely as that agreed, every later way is known.
"""

from collections.abc import Collection, Sequence

from mounts.awr.memory import Kept, Shown
from mounts.awr.settings import AwrSettings
from mounts.errors import DriveRefused

_LEAST = 0.4  # of the farthest unconfirmed way, that a sync must follow to tell anything
_AGREES = 0.05  # of the way by keys, by which a sync that confirms it may move the position
_SKY = 0.01  # of it that misalignment and model may make; a sync that shows more than was seen before refutes that
_SLOWER = 1.05  # times what a short way shows: GUIDE and CENTRE, a few percent of it, have another scale
_COMMISSIONED = 0.02  # of a way: four standard deviations of the half percent to which units are measured
_OTHER_WAY = 2.0  # times a way, between its end and where it leads in the other sense; covers a scale up to 3 times
_UNITS, _REFERENCE, _POSTSCALER = "drive.frequency_unit", "drive.rate_reference", "drive.postscaler"
_KEYS = ({_UNITS, "axis1.reversed"}, {_UNITS, "axis2.reversed", "axis2.steps_per_degree"})
_WRONG = (
    "frequency_unit and acceleration_unit, steps a degree or reversed are not as configured, or a star was another; "
    "`commission` finds out"
)
_CLOSELY = "so much is stated of every later way; a `sync` after a longer one may tell better"
_UNSEEN = (
    "nobody has seen yet that {} the way that reversed says, so what is stated covers the other way as well, twice "
    "as far as it went since the last sync: 30″ a second while axis 1 tracks; `commission`, or `goto` a star 3° off "
    "in both axes, centre it with `jog` and `sync` on it"
)


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
        if shown.assumed != settings.assumed:
            shown = Shown(led=shown.led, synced=shown.synced)  # by which the position is in doubt
        self._seen, self._led, self._closely = list(shown.axes), list(shown.led), list(shown.closely)
        self._synced = [axis.counts for axis in kept.axes] if shown.synced is None else list(shown.synced)

        self.referenced = shown.referenced
        """It was seen what the rates of GUIDE and CENTRE count from: by `commission`, as a sync is too coarse."""
        self.scaled = shown.scaled
        """The postscaler was seen to divide rates as configured."""

    @property
    def shown(self) -> Shown:
        """As it is remembered."""
        return Shown(
            self._settings.assumed,
            (self._seen[0], self._seen[1]),
            (self._led[0], self._led[1]),
            self.referenced,
            self.scaled,
            (self._closely[0], self._closely[1]),
            (self._synced[0], self._synced[1]),
        )

    @property
    def note(self) -> str:
        """What a person should know of axes that were not seen to move as configured; empty where both were."""
        unseen = [f"axis {axis + 1}" for axis in (0, 1) if not self._seen[axis]]
        return _UNSEEN.format(f"{' and '.join(unseen)} {'turn' if unseen[1:] else 'turns'}") if unseen else ""

    def led(self, axis: int, steps: float) -> None:
        """A key moved an axis."""
        self._led[axis] += steps

    def doubt(self, axis: int, here: float, leads: float) -> float:
        """Steps within which it is of `here`, as far as keys and drives are not surely as assumed.

        `leads` are those of a key that moves it yet. What is off grows with the way since the last sync, the same way
        all the time, and is gone when that leads back.
        """
        keys = abs(self._led[axis] + leads)
        if self._seen[axis]:
            return self._closely[axis] * keys
        return _OTHER_WAY * max(keys, abs(here - self._synced[axis]))

    def synchronised(self, counts: Sequence[float], moved: Sequence[float] | None, stated: Sequence[float]) -> str:
        """A person says where the axes are; return what a person should know.

        The position moved by so many steps, None where it was unknown, and was stated to so many.
        """
        said = []
        for axis, near in enumerate(self._settings.near):
            led, self._led[axis], self._synced[axis] = self._led[axis], 0.0, counts[axis]
            if moved is not None and abs(led) >= _LEAST * near:
                said.append(self._judged(axis, moved[axis] / led, stated[axis] / abs(led)))
        return "; ".join(filter(None, said))

    def _judged(self, axis: int, share: float, unsure: float) -> str:
        """A sync moved the position by a share of the way by keys, which is as unsure; return what to know of it."""
        off, before, seen = abs(share), self._closely[axis], self._seen[axis]
        shown = _SLOWER * (off + unsure)
        if off > unsure + (min(_AGREES, before + _SKY) if seen else _AGREES):
            self._seen[axis], said = False, _WRONG
        elif seen:
            self._closely[axis], said = (min(before, shown) if off <= before + unsure else shown), _CLOSELY
        else:
            self._seen[axis], self._closely[axis], said = shown <= _AGREES, shown, _CLOSELY
        told = off > _SKY + unsure and (said == _WRONG or self._seen[axis])
        return f"axis {axis + 1} was {share:+.1%} of its way from where its keys led it: {said}" if told else ""

    def confirmed(self, keys: Collection[str]) -> None:
        """A commissioning has confirmed these keys of the configuration."""
        for axis, needed in enumerate(_KEYS):
            if needed <= set(keys):
                closely = min(self._closely[axis], _COMMISSIONED) if self._seen[axis] else _COMMISSIONED
                self._seen[axis], self._closely[axis] = True, closely
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
