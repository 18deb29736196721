"""Guide pulses: the target that is tracked is displaced by rate × time, north, south, east or west on the sky.

East is increasing right ascension, north increasing declination, whichever way the mount stands: nothing has to be
calibrated anew after a flip. Both are arcseconds on the sky, not seconds of right ascension: software that guides
must not divide by cos Dec as well.
"""

from typing import Literal

from clockdrive.corrections import GUIDE
from clockdrive.displacing import displace, require_pursuit, values_of
from clockdrive.errors import ArgumentError, Refused, finite
from clockdrive.session import Session
from clockdrive.state import Correction

Direction = Literal["north", "south", "east", "west"]

SIDEREAL_ARCSEC_S = 15.041067
_TOWARDS = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}
_LETTERS = {name[0]: name for name in _TOWARDS}
_LONGEST_MS = 10_000.0
_LARGEST_ARCSEC = 3600.0


class Guiding:
    """Guides the telescope of a session.

    Parameters
    ----------
    session : Session
        Whose target is displaced.
    rate : float
        Speed of a pulse in units of the sidereal rate.
    """

    def __init__(self, session: Session, rate: float) -> None:
        self._session = session
        self._rate_arcsec_s = rate * SIDEREAL_ARCSEC_S

    def pulse(self, direction: str, milliseconds: float) -> tuple[float, float]:
        """Displace what is tracked; return the sum of all pulses on it, arcseconds east and north.

        Parameters
        ----------
        direction : str
            `north`, `south`, `east`, `west`, or the first letter.
        milliseconds : float
            How long the pulse is. The way is gone at once, at the drive's own pace, and not over that time.

        Raises
        ------
        ArgumentError
            No such direction, or not so long.
        Refused
            Nothing is tracked; the sum is beyond a degree; or a limit forbids it.
        """
        milliseconds = finite("a guide pulse of", milliseconds, "milliseconds")
        word = direction.strip().lower()
        name = _LETTERS.get(word, word)
        if name not in _TOWARDS:
            raise ArgumentError(f"guide {direction!r}: give one of north, south, east, west, or N, S, E, W")
        if not 1.0 <= milliseconds <= _LONGEST_MS:
            raise ArgumentError(
                f"a guide pulse of {milliseconds:g} ms: 1 to {_LONGEST_MS:g} ms; use `offset` for more"
            )
        session = self._session
        target = require_pursuit(session, "a guide pulse")
        way = self._rate_arcsec_s * milliseconds / 1000.0
        east, north = (
            total + way * part for total, part in zip(values_of(session, GUIDE), _TOWARDS[name], strict=True)
        )
        if max(abs(east), abs(north)) > _LARGEST_ARCSEC:
            raise Refused(
                f"guide pulses of {east:.0f}″ east, {north:.0f}″ north in all: at most ±{_LARGEST_ARCSEC:g}″; "
                "`centre` or `sync`"
            )
        origin, now = f"pulses on {target.name}", session.clock.now()
        totals = zip(GUIDE, (east, north), strict=True)
        displace(session, {name: Correction(name, total, "arcsec", origin, now) for name, total in totals})
        return east, north
