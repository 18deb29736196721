"""The TC410 behind the Drive contract.

The unit's own registers govern how it moves, so acceleration, deceleration and top speed are read from it and planned
with; a configuration that differs is listed in `notes`. What only the host uses, gearing and soft limits, is the
configuration's; the soft limits are written to the unit and read back before anything moves.

Everything that a command would write is checked before the first of it is sent. What a write left in the unit is
noted only when the unit has acknowledged it, so that a command cut short can be given again.
"""

from collections.abc import Mapping, Sequence

from mounts.drive import Reading
from mounts.errors import DriveRefused
from mounts.tc410.following import Following
from mounts.tc410.parts import REMOTE, SLEW
from mounts.tc410.startup import find_position_format, identify, write_soft_limits


class TC410(Following):
    """One TC410.

    Parameters
    ----------
    modbus : ModbusAscii
        The master on the unit's link.
    settings : TC410Settings
        What the configuration says.
    memory : Mapping
        What `memory` gave when this unit was last driven; empty for a unit never seen.
    remember : callable
        Keeps `memory`; called before a register that the next start must know of is written.
    guardian : Guardian, optional
        Makes the unit safe when this process is gone; without one there is no direct speed control.
    """

    def connect(self, time: float, *, make_safe: bool) -> Reading:
        """Identify the unit, find its position format, judge its position, write its soft limits.

        Raises
        ------
        WrongProtocol, DriveRefused
            No TC410 answers; it contradicts the configuration, has no motor drives or does not keep its limits.
        """
        self._control = identify(self._unit)
        if make_safe:
            self.stop(time)
        elif self._control & (SLEW | REMOTE):
            self._write_control(self._control & ~(SLEW | REMOTE))
        self._unit.position_format = find_position_format(self._unit, self._settings.position_format)
        self._restore_speed()
        self._read_models()
        seen = self._look()
        self._leave_cookie(seen.counts)
        write_soft_limits(self._unit, self._settings)
        self._tracked = self._left_tracking(seen)
        return self.read(time)

    def sync(self, counts: Sequence[float], time: float) -> None:
        """Write both positions and read them back; tracking goes on from there.

        An axis that moves is where `counts` say at `time`; what it moves until the unit is told is added.

        Raises
        ------
        DriveRefused
            A slew is under way, or a position reads back otherwise.
        RegisterError
            A position is outside what the drive can count; nothing was sent.
        """
        self._encoded("position", counts)
        if self._slew is not None:
            raise DriveRefused("a slew is under way; `stop`, then sync")
        self._read_control()
        self._read_models()
        self._set_position(counts, time)
        seen = self._look()
        write_soft_limits(self._unit, self._settings)
        self._tracked = self._left_tracking(seen)
        self.read(time)
        self._remember(self.memory)

    def power(self, *, on: bool) -> None:
        """Power the motors, or send the drive to standby, in which nothing is left that would go on afterwards."""
        if not on:
            self.stop(0.0)
        self._unit.power(on=on)

    def registers(self) -> Mapping[str, str]:
        """Every readable register by name, as a person reads it."""
        return {shown.register.name: shown.text for shown in self.upkeep.show()}

    def close(self, time: float, *, keep_tracking: bool) -> None:  # noqa: ARG002 - the contract gives the time to all
        """End direct control, and tracking unless it is kept; give back the top speed."""
        try:
            self._learn()
            if keep_tracking and not self._control & REMOTE:
                self._write_control(self._control & ~SLEW)
            else:
                self._halt()
            try:
                self._direct.end()
            finally:  # the unit has ended its slew, whatever becomes of the process beside it
                self._restore_speed()
        finally:
            self._unit.close()
