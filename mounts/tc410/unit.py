"""The TC410's registers by name: contiguous ones in one request, so that no pair is ever torn.

Every answer carries the moment at which the unit had the whole request: a position is as of that moment and a
velocity acts from it.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from mounts.tc410.registers import REGISTERS, PositionFormat, Register, at, by_name
from transports.modbus_ascii import Answer, ModbusAscii

_READ_OVERHEAD = 11  # characters of a read's answer besides four for each register
_BITS_PER_CHARACTER = 10


@dataclass(frozen=True)
class Values:
    """Register values by name, all as of `time`."""

    time: float
    values: Mapping[str, float]
    words: Mapping[str, tuple[int, ...]]

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
        self.position_format: PositionFormat = "right"
        self.one_way_s = 0.5
        """The shortest travel time seen between host and unit, one way."""
        self.exchanges = 0
        """Requests answered so far."""

    def read(self, first: str, last: str | None = None) -> Values:
        """Read the registers from `first` to `last`, neighbours in the table, in one request.

        Raises
        ------
        RegisterError
            An address between them must not be touched.
        TransportError
            No valid answer.
        """
        start, end = by_name(first), by_name(last or first)
        rows = _between(start, end)
        count = end.address + end.words - start.address
        ask = self._modbus.read_input_registers if start.kind == "input" else self._modbus.read_holding_registers
        answer = ask(start.address, count)
        words = {row.name: tuple(answer.values[row.address - start.address :][: row.words]) for row in rows}
        values = {row.name: row.decode(words[row.name], self.position_format) for row in rows}
        return Values(self._arrival(answer, _READ_OVERHEAD + 4 * count), values, words)

    def write(self, name: str, value: float) -> float:
        """Write one register; return the moment the unit had it."""
        return self._write(by_name(name), by_name(name).encode(value, self.position_format))

    def write_words(self, name: str, words: tuple[int, ...]) -> float:
        """Write raw words; return the moment the unit had them."""
        return self._write(by_name(name), words)

    def words(self, name: str) -> tuple[int, ...]:
        """Read one register's raw words."""
        row = by_name(name)
        return self._modbus.read_holding_registers(row.address, row.words).values

    def power(self, *, on: bool) -> None:
        """Switch the motors' power."""
        self._modbus.write_coil(by_name("power").address, on)

    def all_readable(self) -> dict[str, str]:
        """Read every readable register in the table, as a person reads it: value and unit, or the flags asserted."""
        shown = {}
        for row in REGISTERS:
            if row.access == "write":
                continue
            if row.kind == "coil":
                shown[row.name] = str(self._modbus.read_coils(row.address, 1).values[0])
            elif row.kind == "discrete":
                shown[row.name] = str(self._modbus.read_discrete_inputs(row.address, 1).values[0])
            else:
                value = self.read(row.name)[row.name]
                flags = f" ({', '.join(row.asserted(int(value))) or 'none'})" if row.flags else ""
                shown[row.name] = f"{value:.10g} {row.unit}".rstrip() + flags
        return shown

    def close(self) -> None:
        """Close the link."""
        self._modbus.close()

    def _write(self, row: Register, words: tuple[int, ...]) -> float:
        if len(words) == 1:
            return self._arrival(self._modbus.write_register(row.address, words[0]), 17)
        return self._arrival(self._modbus.write_registers(row.address, words), 17)

    def _arrival(self, answer: Answer, characters: int) -> float:
        self.exchanges += 1
        travel = (answer.received - answer.sent - characters * self._character_s) / 2.0
        self.one_way_s = min(self.one_way_s, max(0.0, travel))
        return answer.sent + self.one_way_s


def _between(start: Register, end: Register) -> list[Register]:
    rows: list[Register] = []
    address = start.address
    while address < end.address + end.words:
        rows.append(at(start.kind, address))
        address += rows[-1].words
    return rows
