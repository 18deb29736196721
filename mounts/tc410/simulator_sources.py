"""What moves the simulated TC410 when it does not slew: the sources of Table 15 of the manual, by priority."""

from dataclasses import dataclass

from mounts.tc410.registers import by_name
from mounts.tc410.simulator_memory import Memory
from mounts.tc410.simulator_settings import SimulatorSettings

PRIORITY = ("remote_control", "joystick", "analogue_autoguider", "digital_autoguider", "tracking")
DEFLECTION = 127  # the most an analogue input can ask for
_LOGARITHMIC = 0x80
_DECADES = 4.2  # 42 dB of speed in logarithmic mode; the drive's own curve is not published


@dataclass(frozen=True)
class Surroundings:
    """What people and weather do to the unit.

    Attributes
    ----------
    joystick, autoguider : tuple of int, optional
        ADC values of both axes, 0 to 255; None when not plugged in.
    directions : tuple of str
        Digital autoguider inputs asserted: "north", "south", "east", "west".
    manual_power : bool
        The switch on the unit that powers the motors whatever the coil says.
    alarms : tuple of str
        Supply alarms standing: "supply_shut_down" (which cuts the motors), "supply_over_current", ….
    temperatures_c : tuple of float
        Inside the drive, motor controllers of axis 1 and 2.
    """

    joystick: tuple[int, int] | None = None
    autoguider: tuple[int, int] | None = None
    directions: tuple[str, ...] = ()
    manual_power: bool = False
    alarms: tuple[str, ...] = ()
    temperatures_c: tuple[float, float, float] = (25.0, 25.0, 25.0)


@dataclass(frozen=True)
class Sources:
    """The sources at one moment."""

    settings: SimulatorSettings
    memory: Memory
    around: Surroundings

    @property
    def active(self) -> str:
        """The source of highest priority that is allowed and not idle, by its movement flag; empty for none."""
        control = by_name("velocity_control")
        allowed = control.asserted(self.memory.raw("velocity_control"))
        return next((source for source in PRIORITY if source in allowed and not self._idle(source)), "")

    def _idle(self, source: str) -> bool:
        match source:
            case "joystick":
                return not any(self._joystick())
            case "analogue_autoguider":
                return not any(self._autoguider())
            case "digital_autoguider":
                return not self.around.directions
            case _:
                return False

    def velocities(self) -> tuple[int, int]:
        """Velocities that the active source asks of both axes."""
        match self.active:
            case "remote_control":
                return self.memory.velocities("target_velocity")
            case "joystick":
                return self._joystick()
            case "analogue_autoguider":
                return self._autoguider()
            case "digital_autoguider":
                return self._pushed("west", "east"), self._pushed("north", "south")
            case "tracking":
                return self.memory.velocities("tracking_velocity")
            case _:
                return 0, 0

    def _pushed(self, positive: str, negative: str) -> int:
        directions = self.around.directions
        return self.settings.guide_velocity * ((positive in directions) - (negative in directions))

    def _joystick(self) -> tuple[int, int]:
        adc = self.around.joystick
        return (
            (0, 0) if adc is None else self._analogue(adc, "joystick_mode", self.memory.velocities("joystick_centre"))
        )

    def _autoguider(self) -> tuple[int, int]:
        adc = self.around.autoguider
        return (0, 0) if adc is None else self._analogue(adc, "autoguider_mode", (0, 0))

    def _analogue(self, adc: tuple[int, int], mode: str, centres: tuple[int, int]) -> tuple[int, int]:
        """Velocities of an analogue input; a centre of 0 was found by the drive, at 128."""
        law = self.memory.raw(mode)
        return self._speed(adc[0] - (centres[0] or 128), law), self._speed(adc[1] - (centres[1] or 128), law)

    def _speed(self, deflection: int, mode: int) -> int:
        """Velocity at a deflection: the top 7 of 24 bits shifted right, or logarithmic."""
        size = min(abs(deflection), DEFLECTION)
        if size <= self.settings.dead_zone:
            return 0
        if mode & _LOGARITHMIC:
            velocity = int(0xFFFFFF * 10 ** (-_DECADES * (1 - size / DEFLECTION)))
        else:
            velocity = size << 17 >> (mode & 0x3F)
        return velocity if deflection > 0 else -velocity
