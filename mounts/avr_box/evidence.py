"""What moves that went otherwise than they should, again and again, say of the configuration.

Once is an accident: an answer that came late, a motor that missed steps, a command that was mutilated.
"""

from collections.abc import Sequence

from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.encoders import ROUNDED_COUNTS, Encoder
from mounts.avr_box.reasons import AGAINST, COUNTS, CREEPS, SHORT
from mounts.avr_box.sight import Astray

_CLEAR_COUNTS = 8.0  # of a move, to tell how far it went
_CREPT_COUNTS = 0.4  # beyond what rounding and the crystal make
_OFTEN = 2  # times that the opposite is no chance
_SHORT_TURNS = 10.0 / 360.0  # that an axis may fall short of what it was told, in all
DAMAGES = 3
"""Of the line since the last sync, from which on it mutilates moves as well."""


class Evidence:
    """Of one box; each question answers with why the position cannot be believed, or with nothing."""

    def __init__(self) -> None:
        self._against = [0, 0]  # how often an encoder said the opposite, one time after the other
        self._short = [0.0, 0.0]  # microsteps by which each axis fell short of what it was told, in all
        self._halved = self._doubled = 0  # moves, one after the other, that went half as far, or farther

    def forget(self) -> None:
        """A person says where the axes are."""
        self._halved = self._doubled = 0
        self._short = [0.0, 0.0]

    def agrees(self, axis: BoxAxis) -> None:
        """Its encoder says what is reckoned."""
        self._against[axis.index] = 0

    def opposes(self, axis: BoxAxis, encoder: Encoder, said: float, reckoned: float) -> str:
        """Its encoder says that it is there: whether it again and again goes as far the other way."""
        since = reckoned if encoder.proved is None else encoder.proved
        against = encoder.against(reckoned - since, said - since)
        self._against[axis.index] = self._against[axis.index] + 1 if against else 0
        return AGAINST.format(axis.index + 1) if self._against[axis.index] >= _OFTEN else ""

    def falls_short(self, axis: BoxAxis, encoder: Encoder, said: float, reckoned: float, damages: int) -> str:
        """Its encoder says that it is there: whether it fell short of what it was told by too much since a `sync`."""
        since = reckoned if encoder.proved is None else encoder.proved
        if (said - reckoned) * (reckoned - since) < 0.0:
            self._short[axis.index] += min(abs(said - reckoned), abs(reckoned - since))
        much = self._short[axis.index] > _SHORT_TURNS * axis.steps_per_turn
        return SHORT.format(axis.index + 1, 360.0 * _SHORT_TURNS) if much and damages < DAMAGES else ""

    def rests(self, axis: BoxAxis, encoder: Encoder, damages: int) -> str:
        """It stands where it is reckoned to be: whether moves go half as far as they should, again and again."""
        if abs(axis.asked) > _CLEAR_COUNTS * encoder.step:
            halved = abs(axis.asked / 2.0 + axis.corrected) < ROUNDED_COUNTS * encoder.step + 0.05 * abs(axis.asked)
            self._halved = self._halved + 1 if halved else 0
            self._doubled = 0
        axis.agreed()
        return COUNTS.format("half", "total") if self._halved >= _OFTEN and damages < DAMAGES else ""

    def creeps(self, axis: BoxAxis) -> str:
        """Whether an axis is led elsewhere bit by bit, by what it is told between its moves."""
        crept = 0.0 if axis.encoder is None else abs(axis.encoder.crept) / axis.encoder.step
        return CREEPS[axis.index] if crept > _CREPT_COUNTS else ""

    def ran(self, running: Sequence[Astray], damages: int) -> str:
        """Whether moves go farther than they should, again and again."""
        self._doubled += sum(each.past for each in running)
        return COUNTS.format("twice", "half") if self._doubled >= _OFTEN and damages < DAMAGES else ""
