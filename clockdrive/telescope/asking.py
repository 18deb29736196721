"""What a telescope can be asked."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from clockdrive.answers import (
    Answer,
    AxesAnswer,
)
from clockdrive.left_alone import NOWHERE
from clockdrive.pass_search import searched, wanted_of
from clockdrive.planning import (
    drift_of,
    rates_of,
)
from clockdrive.rotating import hold_of
from clockdrive.state import Event
from clockdrive.status import status_of
from clockdrive.telescope.parts import Parts

if TYPE_CHECKING:
    from astropy.coordinates import SkyCoord
    from astropy.io.fits import Header

    from clockdrive.drives.kind import Simulated
    from clockdrive.planning import TargetLike, TimeLike
    from clockdrive.true_sky import SimulatedSky


class Asking(Parts):
    """Status, rates, passes, events; the truth of a simulator."""

    def rates(
        self,
        target: "TargetLike",
        at: "TimeLike | None" = None,
        *,
        rate_arcsec_s: Sequence[float] | None = None,
        rate_from: "TimeLike | None" = None,
        rotator: str | None = None,
        position_angle_deg: float | None = None,
    ) -> AxesAnswer:
        """Tracking rates of both axes at a time; rates of one's own and the rotator as for `plan`."""
        self._control.require_open()
        time = self._time(at)
        wanted, planner = self._target(target, time, drift_of(rate_arcsec_s, rate_from)), self._session.planner
        return rates_of(planner, wanted, time, hold_of(planner.rotator, rotator, position_angle_deg))

    def passes(
        self,
        target: "TargetLike",
        hours: float = 24.0,
        at: "TimeLike | None" = None,
        *,
        above_deg: float | None = None,
        progress: Callable[[float, str], object] | None = None,
    ) -> Answer:
        """Search when a target, or each satellite of a TLE file, can be observed, as `clockdrive passes` does.

        Parameters
        ----------
        target : str, SkyCoord or Target
            Whatever `plan` takes, or the path of a TLE file.
        hours : float
            For how long to search.
        at : float, datetime, Time or str, optional
            From when on; now by default.
        above_deg : float, optional
            An altitude that must be exceeded besides the limits.
        progress : callable, optional
            Called with the fraction that is done and the name of what is looked at.

        Raises
        ------
        InputError, TargetError
            The time or the altitude is none; it is no target.
        """
        self._control.require_open()
        planner, time = self._session.planner, self._time(at)
        wanted = wanted_of(target, planner, time, self.configuration)
        return searched(planner, wanted, time, hours, above_deg, progress)

    def header(self) -> "Header":
        """FITS cards of where the telescope points now, as `clockdrive header`.

        Raises
        ------
        Refused
            The position may be wrong.
        """
        from clockdrive.fits_header import cards  # noqa: PLC0415 - astropy takes a second to load

        return cards(self.status().json, self.configuration)

    def status(self) -> Answer:
        """Everything that is known now: position, activity, limits, corrections in force, notes."""
        return self._control.call(
            lambda: Answer(status_of(self._session, self._store, self.configuration, self._instruments.name))
        )

    def events(self, limit: int = 100) -> tuple[Event, ...]:
        """What happened, newest first."""
        self._control.require_open()
        return self._store.events(limit=limit)

    def registers(self) -> dict[str, str]:
        """The drive's own registers by name, as a person reads them."""
        return self._control.call(lambda: dict(self._session.drive.registers()))

    @property
    def simulator(self) -> "Simulated | None":
        """The embedded simulator, to be asked what it really does."""
        return None if self._embedded is None else self._embedded.device

    @property
    def true_sky(self) -> "SimulatedSky | None":
        """The sky over the embedded simulator, which knows where it really points and has its knobs."""
        return None if self._embedded is None else self._embedded.sky(self._control.call)

    def true_place(self) -> "SkyCoord | None":
        """Where the tube of the embedded simulator really points now, in `AltAz`; None without one."""
        from clockdrive.quantities import observed_place  # noqa: PLC0415 - astropy takes a second to load

        sky = self.true_sky
        site = self._session.planner.sky.site
        return None if sky is None else observed_place(sky.observed(), self.clock.now(), site)

    def left_alone(self) -> str:
        """What comes of a drive that tracks whatever it is told, without this program; empty for one that stops."""
        left = self._control.call(lambda: self._session.left_alone)
        if left is not None:
            return left.said(self.clock.now())
        return "" if self._session.drive.capabilities.can_stop else NOWHERE

    @property
    def tracks_alone(self) -> bool:
        """Whether its drive goes on tracking without this program."""
        capabilities = self._session.drive.capabilities
        return (capabilities.holds_rate_alone and capabilities.bounds_itself) or not capabilities.can_stop

    @property
    def is_tracking(self) -> bool:
        """Whether it follows a target, as far as was last seen."""
        return self._session.doing == "tracking"
