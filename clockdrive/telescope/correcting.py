"""What is put right about where a telescope points, and what it points with."""

from typing import TYPE_CHECKING

from clockdrive import model_in_force, parse
from clockdrive.answers import (
    Answer,
    centred_answer,
    instrument_answer,
)
from clockdrive.errors import finite
from clockdrive.mount_registers import NAMES
from clockdrive.planning import (
    posix,
)
from clockdrive.slewing import Report
from clockdrive.telescope.moving import nobody
from clockdrive.telescope.parts import Parts
from pointing.mount import Posture

if TYPE_CHECKING:
    from clockdrive.planning import TargetLike, TimeLike


class Correcting(Parts):
    """Sync, offset, guide, centre; instruments and power."""

    def sync(self, target: "TargetLike", posture: Posture | None = None, *, force: bool = False) -> float:
        """Declare that the telescope points at a target now; returns the correction of the larger axis in degrees."""
        return max(map(abs, self.sync_axes(target, posture, force=force)))

    def sync_axes(
        self, target: "TargetLike", posture: Posture | None = None, *, force: bool = False
    ) -> tuple[float, float]:
        """Declare as `sync` does; returns the correction of each axis in degrees."""
        resolved = self._target(target, self.clock.now())
        return self._control.call(lambda: self._adjusting.sync(resolved, posture, force=force))

    def sync_rotator(
        self, angle_deg: float | None = None, *, position_angle_deg: float | None = None, force: bool = False
    ) -> float:
        """Declare where the instrument rotator stands now, the axes being right; returns the correction in degrees.

        Parameters
        ----------
        angle_deg : float, optional
            Its own angle, as on its scale.
        position_angle_deg : float, optional
            Instead: of the instrument's y axis from north through east, as a solved image taken now tells.
        force : bool
            Accept a correction beyond 5°.

        Raises
        ------
        ArgumentError, Refused
            Not exactly one angle is given; there is no rotator, it slews, or stands at no such angle.
        """
        from clockdrive.rotator_sync import sync_rotator  # noqa: PLC0415 - seldom needed

        given = [
            None if each is None else finite(f"a {what} of", each, "degrees")
            for what, each in (("rotator angle", angle_deg), ("position angle", position_angle_deg))
        ]
        return self._control.call(lambda: sync_rotator(self._session, given[0], given[1], force=force))

    def offset(self, east_arcsec: float, north_arcsec: float) -> None:
        """Displace this and all later targets on the sky, arcseconds; adds to the offset in force.

        Raises
        ------
        Refused
            A total is beyond a degree, or a limit forbids it.
        """
        east, north = (finite("an offset of", each, "arcseconds") for each in (east_arcsec, north_arcsec))
        self._control.call(lambda: self._adjusting.offset(east, north))

    def guide(self, direction: str, milliseconds: float) -> tuple[float, float]:
        """Displace what is tracked by `guide_rate` × sidereal × time, on the sky; a new goto or a sync ends it.

        Parameters
        ----------
        direction : str
            `north`, `south`, `east` (increasing right ascension) or `west`.
        milliseconds : float
            1 to 10000.

        Returns
        -------
        tuple of float
            The sum of all pulses on this target, arcseconds east and north.

        Raises
        ------
        Refused
            Nothing is tracked, it slews, or the pulse is none.
        """
        return self._control.call(lambda: self._guiding.pulse(direction, milliseconds))

    def centre(
        self,
        coord: "TargetLike",
        at: "TimeLike | None" = None,
        progress: Report = nobody,
        *,
        force: bool = False,
    ) -> Answer:
        """Bring the target onto the pointing origin, by where an image says that the telescope pointed.

        Subtracted is: where the counts said at the middle of the exposure, minus where the image says. It replaces
        the centring before, and clears guide pulses; a person's offset stays. A new goto or a sync ends it.

        Parameters
        ----------
        coord : SkyCoord, str or Target
            The place in the image that is on the pointing origin in force: text is ICRS, two numbers degrees.
        at : float, datetime, Time or str, optional
            Middle of the exposure, at most 20 minutes ago; now by default.
        progress : callable
            Told of the slew that more than 60″ takes.
        force : bool
            Accept a pointing error beyond 5°.

        Raises
        ------
        Refused, Unreachable, TargetError
            Nothing is tracked; the moment is not known; beyond 5°; nothing allowed leads there; or it is no place.
        """
        moment = None if at is None else posix(at)
        seen = parse.place(coord) if isinstance(coord, str) else self._target(coord, self._time(at))
        steps = self._centring.centre(seen, moment, progress, force=force)
        return centred_answer(self._perform(steps), self._instruments.name)

    def instrument(self, name: str | None = None, progress: Report = nobody) -> Answer:
        """Say which pointing origin is in force, or put targets on another: what is tracked is slewn onto it.

        Raises
        ------
        Refused, Unreachable
            There is no such instrument; not now; or the target cannot be put on it.
        """
        self._control.require_open()
        moved = False if name is None else self._perform(self._choosing.choose(name, progress))
        return instrument_answer(self._instruments, moved=moved)

    def clear(self, correction: str) -> None:
        """Remove a correction by its name in `status`, or both of a kind: `offset`, `guide`, `centre`."""

        def clear() -> None:
            if correction == model_in_force.NAME and self._model.by_hand:
                self._model.clear()
            elif correction in NAMES and self._registers.by_hand:
                self._registers.clear()
            else:
                self._adjusting.clear(correction)

        self._control.call(clear)

    def power(self, *, on: bool) -> None:
        """Power the motors, or send the drive to standby; standby stops the telescope first."""
        self._control.call(lambda: self._session.power(on=on))
