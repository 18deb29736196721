"""The holding registers of the simulated TC410: its words, its non-volatile memory and its half-written pairs.

The first word of a pair waits until the second is written. Positions stand in their pair as the settings say.
"""

from collections.abc import Mapping
from typing import Any

from mounts.tc410.registers import CENTRE, REGISTERS, PositionFormat, Register, by_name, of_axis
from transports.modbus_slave import IllegalValue

FACTORY: Mapping[str, float] = {
    "joystick_mode": 8,
    "autoguider_mode": 14,
    "fan_start_temperature": 45.0,
    "fan_stop_temperature": 40.0,
    **{
        f"axis{axis}_{name}": value
        for axis in (1, 2)
        for name, value in (
            ("positive_limit", 0xFFFF00),
            ("acceleration", 26),
            ("deceleration", 26),
            ("max_speed", 0xFFFF00),
            ("motor_current", 1.0),
            ("motor_steps", 200),
            ("main_gear_multiplier", 1),
            ("main_gear_divisor", 1),
            ("secondary_gear_multiplier", 1),
            ("secondary_gear_divisor", 1),
            ("park", CENTRE),
        )
    },
}
_SAVED = tuple(register for register in REGISTERS if register.saved)


class Memory:
    """Words by address.

    Parameters
    ----------
    position_format : str
        Where the 24 bits of a position stand in their pair of registers.
    configuration : mapping
        Register values by name that are saved, beyond the factory's.
    """

    def __init__(self, position_format: PositionFormat, configuration: Mapping[str, float]) -> None:
        self._format: PositionFormat = position_format
        self._words = {
            register.address + word: 0
            for register in REGISTERS
            if register.kind == "holding"
            for word in range(register.words)
        }
        self._latch: dict[int, int] = {}
        self._saved: dict[int, int] = {}
        self.forget_targets()
        self.load({**FACTORY, **configuration})
        self.save()

    def word(self, address: int) -> int:
        """The word at a defined address."""
        return self._words[address]

    def words(self, register: Register) -> tuple[int, ...]:
        """All words of a register."""
        first = register.address
        return tuple([self._words[address] for address in range(first, first + register.words)])

    def value(self, name: str) -> float:
        """The value of a register that is not a position."""
        register = by_name(name)
        return register.decode(self.words(register))

    def raw(self, name: str) -> int:
        """The first word of a register."""
        return self._words[by_name(name).address]

    def velocities(self, name: str) -> tuple[int, int]:
        """A velocity register of both axes."""
        return int(self.value(f"axis1_{name}")), int(self.value(f"axis2_{name}"))

    def counts(self, name: str) -> int:
        """A position, in counts."""
        return self.counts_of(self.words(by_name(name)))

    def counts_of(self, words: tuple[int, ...]) -> int:
        """Counts that a pair of words stands for; bits outside the 24 are lost."""
        raw = words[0] << 16 | words[1]
        return raw >> 8 if self._format == "left" else raw & 0xFFFFFF

    def put(self, register: Register, words: tuple[int, ...]) -> None:
        """Store words as they are."""
        self._words.update(enumerate(words, start=register.address))

    def put_counts(self, name: str, counts: int) -> None:
        """Store a position."""
        register = by_name(name)
        self.put(register, register.encode(counts, self._format))

    def complete(self, register: Register, address: int, word: int) -> tuple[int, ...] | None:
        """Take one written word; return the register's words once they are all there.

        Raises
        ------
        IllegalValue
            The register does not take this value.
        """
        if address < register.address + register.words - 1:
            self._latch[address] = word
            return None
        first = register.address
        words = (word,) if register.words == 1 else (self._latch.pop(first, self._words[first]), word)
        if not register.accepts(words):
            raise IllegalValue(f"{register.name} does not take {' '.join(f'0x{word:04X}' for word in words)}")
        return words

    def load(self, values: Mapping[str, float]) -> None:
        """Make `values` the configuration, everything else of it zero."""
        for register in _SAVED:
            self.put(register, register.encode(values.get(register.name, register.conversion.value(0))))

    def save(self) -> None:
        """Keep the configuration for the next start."""
        self._saved = {
            register.address + word: self._words[register.address + word]
            for register in _SAVED
            for word in range(register.words)
        }

    def recall(self) -> None:
        """Go back to the configuration last saved."""
        self._words.update(self._saved)

    def forget_latches(self) -> None:
        """Lose half-written pairs."""
        self._latch.clear()

    def forget_targets(self) -> None:
        """Put target positions and velocities to what they are after power-up."""
        for axis in (1, 2):
            self.put_counts(f"axis{axis}_target_position", CENTRE)
            self.put(of_axis(axis, "target_velocity"), (0, 0))

    def state(self) -> dict[str, dict[str, int]]:
        """Everything, as JSON-able values."""
        kept = {"words": self._words, "saved": self._saved, "latch": self._latch}
        return {name: {str(address): word for address, word in words.items()} for name, words in kept.items()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Take back what `state` returned."""
        self._words, self._saved, self._latch = (
            {int(address): word for address, word in state[name].items()} for name in ("words", "saved", "latch")
        )
