"""What a TC410 shows at one moment, its flags by name."""

from dataclasses import dataclass

from mounts.tc410.registers import by_name
from mounts.tc410.unit import Values

_ALARMS = {"supply_shut_down", "supply_over_current", "supply_over_voltage", "supply_under_voltage"}
_HANDS = {"remote_control", "paddle", "joystick", "analogue_autoguider", "digital_autoguider"}


@dataclass(frozen=True)
class Look:
    """One look at the unit: both positions with their targets, then its flags."""

    positions: tuple[Values, Values]
    state: Values

    @property
    def counts(self) -> tuple[float, float]:
        """Position of each axis as reported."""
        one, two = (values[f"axis{axis}_position"] for axis, values in zip((1, 2), self.positions, strict=True))
        return one, two

    @property
    def slewing(self) -> tuple[bool, bool]:
        """Which axes are slewing to their targets."""
        running = self._asserted("slew_flags")
        return "axis1_slewing" in running, "axis2_slewing" in running

    @property
    def motion(self) -> tuple[str, ...]:
        """Names of the sources that move the telescope."""
        return self._asserted("movement_flags")

    @property
    def limits(self) -> tuple[str, ...]:
        """Names of the limits reached."""
        return self._asserted("limit_flags")

    @property
    def alarms(self) -> tuple[str, ...]:
        """Names of the supply alarms standing."""
        return tuple(sorted(_ALARMS.intersection(self._asserted("supply_flags"))))

    @property
    def powered(self) -> bool:
        """Whether the motors have power."""
        return "motor_power_enabled" in self._asserted("supply_flags")

    @property
    def stands(self) -> bool:
        """Whether nothing moves the telescope but its own tracking."""
        return not any(self.slewing) and not set(self.motion).difference({"tracking"})

    def disturbed(self, source: str) -> bool:
        """Whether something but a slew and `source`, the host's own, moves the telescope or hinders it."""
        hands = _HANDS.difference((source,)).intersection(self.motion)
        return bool(hands or self.limits or self.alarms or not self.powered)

    def _asserted(self, register: str) -> tuple[str, ...]:
        return by_name(register).asserted(int(self.state[register]))
