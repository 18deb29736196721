"""One fault machine for all drives: a device, or a link, whose answers go wrong by plan or by seed.

A plan is any iterable of faults, one for each answer, `None` where it goes right; when it ends, all goes right.
`by_chance` is an endless plan. What happened is counted in `happened`.
"""

import random
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from enum import StrEnum, auto
from typing import NamedTuple

from transports.errors import LinkError
from transports.link import Clock, Link
from transports.memory import Device


class Fault(StrEnum):
    """What can happen to an answer."""

    DROP = auto()  # it never comes
    DELAY = auto()  # it comes later than anyone waits
    SPLIT = auto()  # it comes in two pieces
    MERGE = auto()  # it comes together with the next
    DUPLICATE = auto()  # it comes twice
    GARBLE = auto()  # one of its bytes is another
    NOISE = auto()  # bytes that mean nothing come before it
    ECHO = auto()  # the request comes back instead
    WRONG = auto()  # the answer to an earlier request comes instead, one of another length
    DISCONNECT = auto()  # the connection is lost


ALL_FAULTS = tuple(Fault)
NEXT = float("inf")  # with the next answer

Plan = Iterable[Fault | None]


def by_chance(seed: int, rate: float, faults: tuple[Fault, ...] = ALL_FAULTS) -> Iterator[Fault | None]:
    """Yield, for ever, one of `faults` at `rate` and otherwise `None`."""
    chance = random.Random(seed)  # noqa: S311 - nothing secret
    while True:
        yield chance.choice(faults) if chance.random() < rate else None


class Piece(NamedTuple):
    """What arrives, and how much later than it should."""

    late_s: float
    data: bytes


class FaultMachine:
    """Turns an answer into what arrives of it."""

    def __init__(self, plan: Plan, seed: int = 0, *, delay_s: float = 1.0, pause_s: float = 0.02) -> None:
        self.happened: Counter[Fault] = Counter()
        self._plan = iter(plan)
        self._chance = random.Random(seed)  # noqa: S311 - nothing secret
        self._past: list[bytes] = []
        self._effects: dict[Fault | None, Callable[[bytes, bytes], list[Piece]]] = {
            None: lambda _, answer: [Piece(0.0, answer)],
            Fault.DROP: lambda _, __: [],
            Fault.DELAY: lambda _, answer: [Piece(delay_s, answer)],
            Fault.SPLIT: lambda _, answer: self._split(answer, pause_s),
            Fault.MERGE: lambda _, answer: [Piece(NEXT, answer)],
            Fault.DUPLICATE: lambda _, answer: [Piece(0.0, answer + answer)],
            Fault.GARBLE: lambda _, answer: [Piece(0.0, self._garbled(answer))],
            Fault.NOISE: lambda _, answer: [Piece(0.0, self._noise() + answer)],
            Fault.ECHO: lambda request, _: [Piece(0.0, request)],
            Fault.WRONG: lambda request, answer: [Piece(0.0, self._wrong(request, answer))],
            Fault.DISCONNECT: self._disconnect,
        }

    def pieces(self, request: bytes, answer: bytes) -> list[Piece]:
        """Return what arrives of `answer`; raise LinkError when the connection is lost."""
        fault = next(self._plan, None)
        if fault:
            self.happened[fault] += 1
        pieces = self._effects[fault](request, answer)
        self._past.append(answer)
        return pieces

    def _split(self, answer: bytes, pause_s: float) -> list[Piece]:
        place = self._chance.randrange(1, max(2, len(answer)))
        return [Piece(0.0, answer[:place]), Piece(pause_s, answer[place:])]

    def _garbled(self, answer: bytes) -> bytes:
        place = self._chance.randrange(len(answer))
        other = answer[place] ^ self._chance.randrange(1, 256)
        return answer[:place] + bytes((other,)) + answer[place + 1 :]

    def _noise(self) -> bytes:
        return self._chance.randbytes(self._chance.randrange(1, 40))

    def _wrong(self, request: bytes, answer: bytes) -> bytes:
        others = [past for past in self._past if len(past) != len(answer)]
        return self._chance.choice(others) if others else request

    def _disconnect(self, _request: bytes, _answer: bytes) -> list[Piece]:
        raise LinkError("the connection is lost, as planned")


class FaultyDevice:
    """A device whose answers go wrong; what is late comes ahead of its next answer."""

    def __init__(self, device: Device, plan: Plan, seed: int = 0) -> None:
        self._device = device
        self._machine = FaultMachine(plan, seed)
        self._held = b""

    @property
    def happened(self) -> Counter[Fault]:
        """How often each fault happened."""
        return self._machine.happened

    def receive(self, data: bytes, t: float) -> bytes:
        """Answer, or not."""
        answer = self._device.receive(data, t)
        if not answer:
            return b""
        pieces = self._machine.pieces(data, answer)
        come = self._held + b"".join(piece.data for piece in pieces if piece.late_s == 0.0)
        self._held = b"".join(piece.data for piece in pieces if piece.late_s > 0.0)
        return come


class FaultyLink:
    """A link on which answers go wrong; what is late comes late by the clock, and what is behind it waits.

    Each `read` of the link beneath is taken for one answer. Links opened one after the other can share a
    `machine`, and so go on in one plan.
    """

    def __init__(self, link: Link, clock: Clock, machine: FaultMachine) -> None:
        self._link = link
        self._clock = clock
        self._machine = machine
        self._request = b""
        self._coming: list[tuple[float, bytes]] = []

    @property
    def name(self) -> str:
        """The name of the link beneath."""
        return self._link.name

    def write(self, data: bytes) -> float:
        """Send all of `data`; return the time at which its last byte left."""
        self._request = data
        return self._link.write(data)

    def read(self, max_bytes: int, timeout_s: float) -> bytes:
        """Return what has come of the answers, at least one byte; empty when nothing came in time."""
        until = self._clock.now() + timeout_s
        while not (come := self._come(max_bytes)) and (left := until - self._clock.now()) >= 0.0:
            next_due = min((due for due, _ in self._coming), default=NEXT)
            answer = self._link.read(max_bytes, max(min(left, next_due - self._clock.now()), 0.0))
            if answer:
                self._take(answer)
            elif left == 0.0:
                break
        return come

    def close(self) -> None:
        """Close the link beneath; what was on its way is lost."""
        self._coming.clear()
        self._link.close()

    def _take(self, answer: bytes) -> None:
        try:
            pieces = self._machine.pieces(self._request, answer)
        except LinkError:
            self.close()
            raise
        due = self._clock.now()
        self._coming = [
            (min(before, due), data) if before == NEXT else (before, data) for before, data in self._coming
        ]
        for late_s, data in pieces:
            due = max([due + late_s, *(before for before, _ in self._coming)])
            self._coming.append((due, data))

    def _come(self, max_bytes: int) -> bytes:
        now = self._clock.now()
        come = b"".join(data for due, data in self._coming if due <= now)
        self._coming = [(due, data) for due, data in self._coming if due > now]
        if len(come) > max_bytes:
            self._coming.insert(0, (now, come[max_bytes:]))
        return come[:max_bytes]


def mutilated(how, data, chance):
    """What comes of some bytes: one of them lost, doubled or with another bit, or silence."""
    at = chance.randrange(len(data))
    byte = bytes((data[at] ^ 1 << chance.randrange(8),))
    return {
        "lost": data[:at] + data[at + 1 :],
        "doubled": data[: at + 1] + data[at:],
        "garbled": data[:at] + byte + data[at + 1 :],
        "silence": b"",
    }[how]
