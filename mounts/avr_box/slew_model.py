"""How an axis of the box slews, as the planner asks: whole moves by the table, long ones in pieces.

A move is an even number of microsteps, up and down the table. No command ends one, so a long one goes in pieces that
each last at most `longest_s`; before the next the axis rests for `pause_s`, in which axis 1 tracks. A count whose
bytes would be commands, were the letter before them lost, is not sent: a short last piece makes up for that.

The arrival at a moving target is solved by asking again and again, which needs a duration without jumps: so every
slew has the time that the last piece may take, and just before one more piece is needed the time for that is given
bit by bit.

Where no encoder sees what a mutilated count makes of a move, letters end each piece: a move of 5′, the same wherever
it begins, that restarts an axis which runs. It is a part of the way.

Tracking makes whole microsteps from the end of one piece to the beginning of the next: one under way then is lost.
"""

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

from mounts.avr_box.commands import harmless_below
from mounts.avr_box.slew_table import HIGH_GEAR, SlewLaw
from mounts.avr_box.timers import CRYSTAL_HZ

PAUSE_S = 0.35
"""Between two pieces: a move may be commanded 0.1 s after the one before has ended, and hosts are not punctual."""
_CLEAR = 3  # half microsteps to either side that the last piece may yet become
_TAIL_COUNT = 132  # of the last piece on the wire, or a little more: no letter is near to it
_PARTED = 100  # the most that it has more, in moves of less than minutes
_PARTED_ALONE = 512  # likewise where it follows one that cannot leave what it may not be to others
_BEFORE = 8  # half microsteps that go before a short move
_TRACKED = 0.45  # microsteps of tracking, at most, that two steps more of the last piece may suspend
_SLOPE = 600.0  # half microsteps a second by which one more piece is prepared: slow beside what tracks
_ROUNDS, _ROUNDS_CLOSED = 4, 8
_SLOWEST_PIECE_S = 2.0  # of a slew slower than the table's


@dataclass(frozen=True)
class Piece:
    """One move: half of its microsteps, its sign, and seconds from the beginning of the slew until it begins."""

    half: int
    sign: int
    begin: float
    duration: float
    letters: bool = False  # of 5′, by letters

    @property
    def steps(self) -> int:
        """Microsteps, signed."""
        return 2 * self.half * self.sign


@dataclass(frozen=True)
class AvrTravel:
    """A slew in pieces; keeps `pointing.slew.Travel`."""

    law: SlewLaw
    start: float
    rate: float  # with which the axis goes on where no piece moves it, microsteps per second
    pieces: tuple[Piece, ...]
    duration: float  # seconds until the last piece has ended
    crystal: float = 1.0  # true crystal frequency over the nominal one

    @property
    def in_one_s(self) -> float:
        """Seconds that one move of all its steps would last."""
        return seconds_of(self.law.cycles(abs(sum(piece.steps for piece in self.pieces)) // 2), self.crystal)

    @property
    def landed(self) -> float:
        """Where the last piece ends."""
        return self._places(self.duration)[-1]

    def position(self, elapsed: float) -> float:
        """Microsteps so many seconds after the beginning.

        Letters that lead back, and moves that make up for letters, are left out: it stands where it came to, no
        farther than where it lands. Truly it goes to and fro by 5′ then, as it does at rest.
        """
        places = self._places(elapsed)
        if not any(piece.letters for piece in self.pieces):
            return places[-1]
        end = self.landed
        sense = 1.0 if end >= self.start else -1.0
        return sense * min(max(sense * place for place in places), sense * end)

    def _places(self, elapsed: float) -> list[float]:
        """Where it begins, where each piece has begun and ended by a time, and where it is then."""
        elapsed = min(elapsed, self.duration)
        here, free_since, places = self.start, 0.0, [self.start]
        for piece in self.pieces:
            if elapsed <= piece.begin:
                break
            here += math.trunc(self.rate * (piece.begin - free_since))
            since = min(elapsed - piece.begin, piece.duration)
            places.append(here)
            here += piece.sign * self.law.made(piece.half, cycles_in(since, self.crystal))
            places.append(here)
            free_since = piece.begin + piece.duration
        return [*places, here + self.rate * max(0.0, elapsed - free_since)]


@dataclass(frozen=True)
class AvrSlewModel:
    """The law of one axis; keeps `pointing.slew.SlewModel`.

    Parameters
    ----------
    law : SlewLaw
        Its table and gears.
    rate : float
        Microsteps a second with which it tracks by itself, signed; 0 for axis 2.
    longest_s : float
        Of one piece.
    pause_s : float
        Between pieces.
    crystal : float
        True frequency of the box's crystal over the nominal one.
    slowest : float, optional
        Microsteps a second on the average, for a slew that is held slower.
    wire_per_half : int
        What a move of two microsteps counts in a command.
    most_half : int, optional
        Half of the microsteps of the longest piece, where something else than its time bounds it.
    closing_half : int
        Half of the microsteps of the letters that end each piece; 0 for none.
    closing_sign : int
        Their sense; 0 for that of the way.
    """

    law: SlewLaw
    rate: float = 0.0
    longest_s: float = 30.0
    pause_s: float = PAUSE_S
    crystal: float = 1.0
    slowest: float | None = None
    wire_per_half: int = 2
    most_half: int | None = None
    closing_half: int = 0
    closing_sign: int = 0

    @property
    def max_rate(self) -> float:
        """Microsteps a second at full speed, or as held."""
        return self.slowest or self.law.fastest * self.crystal

    @property
    def longest_half(self) -> int:
        """Half of the microsteps of the longest piece."""
        half = max(self.law.half_within(cycles_in(self.longest_s, self.crystal)), 2 * self.closing_half)
        return half if self.most_half is None else min(half, self.most_half)

    @property
    def closing_s(self) -> float:
        """Seconds of the letters that end a piece, and before them."""
        return self.pause_s + self._lasts(self.closing_half) if self.closing_half else 0.0

    @cached_property
    def tail(self) -> int:
        """Half of the microsteps of the last piece, or a little more: fast enough for axis 1 to land on any place."""
        least = _TAIL_COUNT // self.wire_per_half
        if not self.rate:
            return least
        slowest = cycles_in(_TRACKED / 2.0 / abs(self.rate), self.crystal)
        return bisect_left(range(HIGH_GEAR), -slowest, lo=least, key=lambda count: -self.law.step_cycles(count))

    def limited(self, max_rate: float) -> "AvrSlewModel":
        """The same axis, slower on the average: in short pieces with longer pauses, as the table has one speed."""
        if max_rate >= self.law.fastest * self.crystal:
            return self
        return replace(self, slowest=max_rate, longest_s=min(self.longest_s, _SLOWEST_PIECE_S))

    def travel(self, start: float, end: float, start_rate: float, end_rate: float) -> AvrTravel:  # noqa: ARG002
        """Travel from `start` to within a microstep of `end`; it lands at the rate of its own."""
        tracked, found, pieces = 0, None, list[Piece]()
        for _ in range(
            _ROUNDS_CLOSED if self.closing_half else _ROUNDS
        ):  # what tracking makes while no piece moves the axis changes the way
            way = end - start - tracked
            closed = sum(piece.letters for piece in pieces)  # in fewer pieces tracking would lead back to as many
            pieces = self._pieces(round(abs(way) / 2.0), 1 if way >= 0.0 else -1, closed)
            tracked = self._tracked(pieces)
            # Where one more piece takes so long that it is not needed then, the one without it is exact.
            found = self._exact(pieces, end - start - tracked) or found
        pieces = self._nearest(pieces, end - start) or found or pieces
        duration = pieces[-1].begin + pieces[-1].duration if pieces else self._duration(0, self._along(1))
        return AvrTravel(self.law, start, self.rate, tuple(pieces), duration, self.crystal)

    def _pieces(self, half: int, sign: int, closed: int) -> list[Piece]:
        """One after the other; the last one ends when the slew does."""
        along = self._along(sign)
        way, *main, tail = self._moves(half, sign, along, closed)
        begin, pieces = 0.0, list[Piece]()
        for i, each in enumerate(main):
            pieces.append(Piece(each, way, begin, self._lasts(each)))
            begin += self._lasts(each) + (self.pause_s if along else self._pause(each))
            if along and i < len(main) - 1 + self._more:
                pieces.append(self._closing(sign, begin))
                begin += self._lasts(self.closing_half) + self._pause(each)
        begin = max(begin, self._duration(half, along) - self.closing_s - self._lasts(tail))
        pieces.append(Piece(tail, way, begin, self._lasts(tail)))
        if along:
            pieces.append(self._closing(sign, begin + self._lasts(tail) + self.pause_s))
        return pieces if half else []

    def _along(self, sign: int) -> int:
        """Half of the microsteps that the letters that end a piece make of a way; below 0 where they lead back."""
        return self.closing_half * (self.closing_sign * sign or 1)

    @property
    def _more(self) -> int:
        """Moves that end by letters, more than those before the last one: axis 1 may have to wait for that."""
        return 1 if self.closing_half and self.rate else 0

    def _count(self, half: int, along: int) -> int:
        """Moves of a way before the last one."""
        return max(1, math.ceil((half - self._more * along) / (self.longest_half + along)))

    def _moves(self, half: int, sign: int, along: int, fewest: int) -> tuple[int, ...]:
        """The sense of the moves of a way, and half of the microsteps of each; letters make what is left."""
        count = max(fewest - self._more, self._count(half, along)) if along else 0
        while True:
            by_moves = half - (count + self._more) * along
            made = parts(abs(by_moves), self.longest_half, self.wire_per_half, self.tail, count) or [0]
            if not along or len(made) == count + 1:
                return (sign if by_moves >= 0 else -sign, *made)
            count += 1

    def _closing(self, sign: int, begin: float) -> Piece:
        half = self.closing_half
        return Piece(half, self.closing_sign or sign, begin, self._lasts(half), letters=True)

    def _exact(self, pieces: list[Piece], way: float) -> list[Piece] | None:
        """The same with a last move that ends within a microstep of where it should; None where none does."""
        if not pieces:
            return None
        at = len(pieces) - 2 if pieces[-1].letters else len(pieces) - 1
        tail = pieces[at]
        others = sum(piece.steps for piece in pieces) - tail.steps
        half = tail.sign * round((way - others) / 2.0)
        if half < 0 or harmless_below(half * self.wire_per_half, self.wire_per_half) != half * self.wire_per_half:
            return None
        return [*pieces[:at], replace(tail, half=half, duration=self._lasts(half)), *pieces[at + 1 :]]

    def _nearest(self, pieces: list[Piece], way: float) -> list[Piece] | None:
        """The same with the move that leads nearest, where moves make a short way of axis 1; None where they do not.

        Its first microsteps last longer than those of tracking. So it ends when longer ones do: how long it is does
        not change where a target is by then. Where its count is one that must not be, a few microsteps go before it.
        """
        moves = [piece for piece in pieces if not piece.letters]
        if not self.rate or sum(piece.half for piece in moves) > self.tail or (self.closing_half and not pieces):
            return None
        ends = moves[-1].begin + moves[-1].duration if moves else self._duration(0)
        others, found = [piece for piece in pieces if piece.letters], list[tuple[float, list[Piece]]]()
        for before in ([], *([Piece(_BEFORE, sign, 0.0, self._lasts(_BEFORE))] for sign in (1, -1) if not others)):
            for last in self._short(ends):
                made = sorted((*before, *others, last), key=lambda piece: piece.begin)
                off = self._tracked(made) + sum(piece.steps for piece in made) - way
                found.append((abs(off), made))
            if (nearest := min(found, key=lambda each: each[0]))[0] <= 1.0:
                break
        return nearest[1]

    def _short(self, ends: float) -> Iterator[Piece]:
        """All moves up to that of the last piece, to either side, that end then."""
        for half in range(self.tail + 1):
            if harmless_below(half * self.wire_per_half, self.wire_per_half) == half * self.wire_per_half:
                lasts = self._lasts(half)
                yield from (Piece(half, sign, ends - lasts, lasts) for sign in (1, -1))

    def _tracked(self, pieces: list[Piece]) -> int:
        """Microsteps that tracking makes before the pieces, and where there are none; a move interrupts the next."""
        made, free_since = 0, 0.0
        for piece in pieces:
            made += math.trunc(self.rate * (piece.begin - free_since))
            free_since = piece.begin + piece.duration
        return made if pieces else math.trunc(self.rate * self._duration(0, self._along(1)))

    def _duration(self, half: int, along: int = 0) -> float:
        """Seconds of a slew of twice `half` microsteps: without a jump, and enough for it to be parted."""
        count, most = self._count(half, along), self._count(half, along) * self.longest_half
        by_moves = half - (count + self._more) * along
        least = count * self.tail if self.rate else 0  # shorter ways would be the slower, the shorter they are
        here = self._in_equal_pieces(max(abs(by_moves), least), count)
        fully = self._in_equal_pieces(most, count)
        jump = self._in_equal_pieces(abs(most - along), count + 1) - fully
        near = max(0.0, 1.0 - (most - by_moves) / (_SLOPE * max(jump, 1e-9)))
        last = self._lasts(self.tail + (_PARTED_ALONE if along else _PARTED))
        return here + self.pause_s + last + (1 + self._more) * self.closing_s + near * jump

    def _in_equal_pieces(self, half: int, count: int) -> float:
        each, more = divmod(half, count)
        moving = more * self._lasts(each + 1) + (count - more) * self._lasts(each)
        return moving + (count - 1) * (self._pause(each) + self.closing_s)

    def _lasts(self, half: int) -> float:
        return seconds_of(self.law.cycles(half), self.crystal)

    def _pause(self, half: int) -> float:
        if self.slowest is None:
            return self.pause_s
        lasts = self._lasts(half) + self.closing_s
        return max(self.pause_s, 2.0 * (half + self.closing_half) / self.slowest - lasts)


def cycles_in(seconds: float, crystal: float = 1.0) -> int:
    """Whole crystal cycles in a time."""
    return round(seconds * CRYSTAL_HZ * crystal)


def seconds_of(cycles: int, crystal: float = 1.0) -> float:
    """How long so many crystal cycles last."""
    return cycles / (CRYSTAL_HZ * crystal)


def parts(half: int, largest: int, wire_per_half: int, least: int, fewest: int = 0) -> list[int]:
    """A way in few pieces, about alike, and a short last one, none with a count that it must not have.

    There are `fewest` before the last one, or more.
    """

    def harmless(part: int) -> int:
        return harmless_below(part * wire_per_half, wire_per_half) // wire_per_half

    def clear(last: int) -> bool:
        return all(harmless(each) == each for each in range(max(0, last - _CLEAR), last + _CLEAR + 1))

    for tail in range(min(least, half), half + 1):
        count, left, main = max(fewest, math.ceil((half - tail) / largest)), half - tail, []
        for i in range(count):
            main.append(harmless(min(-(-left // (count - i)), largest)))
            left -= main[-1]
        if left + tail <= largest and clear(left + tail):
            return [*main, left + tail]
    return [] if half == 0 else [harmless(half), *parts(half - harmless(half), largest, wire_per_half, least)]
