"""The TC410's registers by name: contiguous ones in one request, so that no pair is ever torn.

Every answer carries the moment at which the unit had the whole request: a position is as of that moment and a
velocity acts from it. The quickest exchange seen gives the travel time; what an exchange took beyond that may have
gone by before the unit had the request, so the moment is known as an interval.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import fsum
from statistics import median

from mounts.tc410.registers import Kind, PositionFormat, Register, RegisterError, at, by_name
from transports.modbus_ascii import Answer, ModbusAscii

_READ_ANSWER = 11  # characters of a read's answer besides its values
_WRITE_ANSWER = 17
_REQUEST = 17  # characters of a request; one that writes a pair has more
_PAIR_REQUEST = 27
_BITS_PER_CHARACTER = 10
_PACE_OF = 25  # exchanges
_USUAL = 4.0  # times the median pause; longer ones lay between two calls


@dataclass(frozen=True)
class Values:
    """Register values by name, all as of a moment between `time` and `time` + `late_s`.

    That rests on the quickest exchange seen, and on a host that stamps at once. What nothing can shift is `asked` and
    `answered`: the moment lies between them, however long host and unit were kept from their work.
    """

    time: float
    late_s: float
    values: Mapping[str, float]
    words: Mapping[str, tuple[int, ...]]
    asked: float
    answered: float

    def __getitem__(self, name: str) -> float:
        return self.values[name]


class Unit:
    """One TC410 at the end of a link.

    Parameters
    ----------
    modbus : ModbusAscii
        The client; this object does not own its link's settings.
    baud : int, optional
        Of a serial line; its answers take that long to come.
    """

    def __init__(self, modbus: ModbusAscii, baud: int | None = None) -> None:
        self._modbus = modbus
        self._character_s = _BITS_PER_CHARACTER / baud if baud else 0.0
        self._one_way_s = float("inf")  # the shortest travel time seen between host and unit
        self._pauses: deque[float] = deque(maxlen=_PACE_OF)
        self._received: float | None = None
        self.position_format: PositionFormat = "right"
        self.exchanges = 0
        """Requests answered so far."""
        self.before_each: Callable[[], object] = lambda: None
        """Called before each request: a sign of life of the host."""

    def burst_s(self, exchanges: int, characters: int) -> float:
        """Seconds taken by exchanges that follow each other at once, by the pace of those seen so far."""
        return exchanges * self._pause_s + characters * self._character_s

    @property
    def _pause_s(self) -> float:
        """The mean of what exchanges took beyond their characters, those left out that the host let wait."""
        if not self._pauses:
            return 0.0
        middle = median(self._pauses)  # negative where the line is faster than its baud, as a pseudo-terminal is
        usual = middle + (_USUAL - 1.0) * abs(middle)
        counted = [pause for pause in self._pauses if pause <= usual]
        return fsum(counted) / len(counted)

    def read(self, first: str, last: str | None = None) -> Values:
        """Read the registers from `first` to `last`, neighbours in the table, in one request.

        Raises
        ------
        RegisterError
            An address between them must not be touched, or a value is impossible in this position format.
        TransportError
            No valid answer.
        """
        start, end = by_name(first), by_name(last or first)
        rows = list(_between(start, end))
        count = end.address + end.words - start.address
        answer = self._ask(start.kind, start.address, count)
        words = {row.name: tuple(answer.values[row.address - start.address :][: row.words]) for row in rows}
        values = {row.name: row.decode(words[row.name], self.position_format) for row in rows}
        time, late_s = self._arrival(answer, _read_answer(start.kind, count))
        return Values(time, late_s, values, words, answer.asked, answer.received)

    def write(self, name: str, value: float) -> float:
        """Write one register; return the moment the unit had it."""
        return self.write_words(name, self.encoded(name, value))

    def write_words(self, name: str, words: tuple[int, ...]) -> float:
        """Write raw words; return the moment the unit had them."""
        address = by_name(name).address
        self.before_each()
        if len(words) == 1:
            answer = self._modbus.write_register(address, words[0])
        else:
            answer = self._modbus.write_registers(address, words)
        return self._arrival(answer, _WRITE_ANSWER, _REQUEST if len(words) == 1 else _PAIR_REQUEST)[0]

    def encoded(self, name: str, value: float) -> tuple[int, ...]:
        """Words that `write` would send.

        Raises
        ------
        RegisterError
            The register does not hold such a value.
        """
        return by_name(name).encode(value, self.position_format)

    def words(self, name: str) -> tuple[int, ...]:
        """Read one register's raw words, whatever their position format."""
        row = by_name(name)
        answer = self._ask(row.kind, row.address, row.words)
        self._arrival(answer, _read_answer(row.kind, row.words))
        return answer.values

    def power(self, *, on: bool) -> None:
        """Switch the motors' power."""
        self.before_each()
        self._modbus.write_coil(by_name("power").address, on)

    def close(self) -> None:
        """Close the link."""
        self._modbus.close()

    def _ask(self, kind: Kind, address: int, count: int) -> Answer:
        self.before_each()
        match kind:
            case "input":
                return self._modbus.read_input_registers(address, count)
            case "holding":
                return self._modbus.read_holding_registers(address, count)
            case "coil":
                return self._modbus.read_coils(address, count)
            case "discrete":
                return self._modbus.read_discrete_inputs(address, count)

    def _arrival(self, answer: Answer, characters: int, asked: int = _REQUEST) -> tuple[float, float]:
        """When the unit had the request at the earliest, and how much later it may have been."""
        self.exchanges += 1
        if self._received is not None:
            self._pauses.append(answer.received - self._received - (asked + characters) * self._character_s)
        self._received = answer.received
        there_and_back = max(0.0, answer.received - answer.sent - characters * self._character_s)
        self._one_way_s = min(self._one_way_s, there_and_back / 2.0)
        return answer.sent + self._one_way_s, there_and_back - 2.0 * self._one_way_s


def _read_answer(kind: Kind, count: int) -> int:
    """Characters of a read's answer: four for a register, two for each eight coils or inputs."""
    return _READ_ANSWER + (4 * count if kind in {"input", "holding"} else 2 * ((count + 7) // 8))


def _between(start: Register, end: Register) -> Iterator[Register]:
    if start.kind != end.kind:
        raise RegisterError(f"{start.name} and {end.name} are of different kinds; read each in its own request")
    address = start.address
    while address < end.address + end.words:
        row = at(start.kind, address)
        yield row
        address += row.words
