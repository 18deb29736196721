"""Where a simulated controller means its axis to be: nodes joined by cubics, and a line behind the last of them.

Times are counts of the controller's clock. With v̄ = Δx/dt the cubic between two nodes has a = (2/dt)(3v̄ − 2v₀ − v₁)
at its begin and the jerk j = (6/dt²)(v₀ + v₁ − 2v̄).
"""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from math import inf, sqrt
from typing import Any, Literal


@dataclass(frozen=True)
class Piece:
    """A cubic from `start` to `end`; degrees and seconds."""

    start: float
    end: float
    position: float
    velocity: float
    acceleration: float = 0.0
    jerk: float = 0.0

    def at(self, time: float) -> tuple[float, float]:
        """Position and velocity at a time."""
        u = time - self.start
        position = self.position + u * (self.velocity + u * (self.acceleration / 2.0 + u * self.jerk / 6.0))
        return position, self.velocity + u * (self.acceleration + u * self.jerk / 2.0)

    def shifted(self, offset: float, rate: float, since: float) -> "Piece":
        """The same, offset by a line that is `offset` at `since`."""
        moved = offset + rate * (self.start - since)
        return replace(self, position=self.position + moved, velocity=self.velocity + rate)

    def extent(self, begin: float, end: float) -> tuple[float, float]:
        """Lowest and highest position between two times."""
        turns = [begin, end]
        a, b, c = self.jerk / 2.0, self.acceleration, self.velocity
        if a == 0.0:
            turns += [self.start - c / b] if b else []
        elif (square := b * b - 4.0 * a * c) >= 0.0:
            far = -(b + (sqrt(square) if b >= 0.0 else -sqrt(square))) / 2.0
            turns += [self.start + far / a, *([self.start + c / far] if far else [])]
        places = [self.at(turn)[0] for turn in turns if begin <= turn <= end]
        return min(places), max(places)

    def top_velocity(self, begin: float, end: float) -> float:
        """The largest speed between two times."""
        turn = self.start - self.acceleration / self.jerk if self.jerk else begin
        return max(abs(self.at(time)[1]) for time in (begin, end, turn) if begin <= time <= end)

    def top_acceleration(self, begin: float, end: float) -> float:
        """The largest acceleration between two times."""
        return max(abs(self.acceleration + self.jerk * (time - self.start)) for time in (begin, end))


def joined(start: float, position: float, velocity: float, end: float, to: float, at: float) -> Piece:
    """Return the cubic from position and velocity at `start` to those at `end`."""
    dt = end - start
    mean = (to - position) / dt
    acceleration = (2.0 / dt) * (3.0 * mean - 2.0 * velocity - at)
    return Piece(start, end, position, velocity, acceleration, (6.0 / dt**2) * (velocity + at - 2.0 * mean))


def line(start: float, position: float, velocity: float = 0.0) -> Piece:
    """Return the line that never ends."""
    return Piece(start, inf, position, velocity)


@dataclass
class Path:
    """What is ahead.

    Attributes
    ----------
    tail : Piece
        The line behind all nodes.
    pieces : deque
        What comes before it; each ends in a node.
    """

    tail: Piece
    pieces: deque[Piece] = field(default_factory=deque)

    @property
    def interpolated(self) -> bool:
        """Whether there are nodes ahead."""
        return bool(self.pieces)

    @property
    def known_until(self) -> float:
        """The time of the last node, or for ever."""
        return self.pieces[-1].end if self.pieces else inf

    def piece(self, time: float) -> Piece:
        """The piece in force at a time, which is not before the first one."""
        return next((piece for piece in self.pieces if time < piece.end), self.tail)

    def append(
        self, now: float, position: float, velocity: float, time: float, first: Literal["wait", "join"]
    ) -> Piece:
        """Take a node; return the piece that ends in it."""
        begin = self.tail if self.pieces else line(now, *self.tail.at(now))
        if self.pieces or first == "join":
            piece = joined(begin.start, begin.position, begin.velocity, time, position, velocity)
        else:
            piece = replace(begin, end=time)
        self.pieces.append(piece)
        self.tail = line(time, position, velocity)
        return piece

    def passed(self, time: float) -> bool:
        """Forget what is past; return whether the last node just went by."""
        had = bool(self.pieces)
        while self.pieces and self.pieces[0].end <= time:
            self.pieces.popleft()
        return had and not self.pieces

    def shift(self, offset: float, rate: float, since: float) -> None:
        """Offset all that is ahead by a line that is `offset` at `since`."""
        self.pieces = deque(piece.shifted(offset, rate, since) for piece in self.pieces)
        self.tail = self.tail.shifted(offset, rate, since)

    def state(self) -> list[Any]:
        """JSON-able."""
        return [_bounded(piece) for piece in (*self.pieces, self.tail)]

    @classmethod
    def of_state(cls, state: Iterable[Any]) -> "Path":
        """Return the path that `state` was of."""
        *pieces, tail = (piece_of_state(values) for values in state)
        return cls(tail, deque(pieces))


def piece_state(piece: Piece) -> list[Any]:
    """Return a piece as JSON-able values, without an end where it never ends."""
    return _bounded(piece)


def piece_of_state(values: Iterable[Any]) -> Piece:
    """Return the piece that `piece_state` made this of."""
    start, end, *rest = values
    return Piece(start, inf if end is None else end, *rest)


def _bounded(piece: Piece) -> list[Any]:
    start, end, *rest = vars(piece).values()
    return [start, None if end == inf else end, *rest]
