"""What a telescope can point at: each target says where it is seen in a `SkyFrame`, and how fast it moves there.

A target is anything with a name, `observed` and `observed_with_rate`; directions are unit vectors of the horizon
frame. Catalogue places go through the whole chain; `altaz:` and `hadec:` are observed places and stand still.
"""

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol, Self, runtime_checkable

from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.sky import AU_M, LIGHT_M_S, YEAR_DAYS, SkyFrame
from pointing.vectors import (
    Vector,
    equatorial_to_horizon,
    from_azimuth_altitude,
    from_hour_angle_declination,
    from_longitude_latitude,
)

if TYPE_CHECKING:
    from astropy.coordinates import SkyCoord

ARCSEC = math.pi / 648000.0
_YEAR_S = YEAR_DAYS * DAY
_KM_S_AU_YEAR = 1e3 * _YEAR_S / AU_M
_AU_LIGHT_YEARS = AU_M / LIGHT_M_S / _YEAR_S
_LIGHT_AU_YEAR = 1.0 / _AU_LIGHT_YEARS
_STILL: Vector = (0.0, 0.0, 0.0)


class Target(Protocol):
    """Anything the telescope can be pointed at.

    One whose place may be wrong at times has a method `note_at` as well, see `Noted`.
    """

    @property
    def name(self) -> str:
        """What people call it."""
        ...

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        ...

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second."""
        ...


@runtime_checkable
class Noted(Protocol):
    """A target whose place may be wrong at times."""

    def note_at(self, instant: Instant) -> str:
        """Say why the place at a moment may be wrong, by how much, and what to do; empty when it is right.

        The sentence begins with the target's name and a colon.
        """
        ...


def notes_of(target: Target, instant: Instant) -> tuple[str, ...]:
    """What a person must be told of a target's place at a moment; nothing where it is right."""
    note = target.note_at(instant) if isinstance(target, Noted) else ""
    return (note,) if note else ()


@dataclass(frozen=True)
class Star:
    """A catalogue place: ICRS with space motion.

    Parameters
    ----------
    name : str
        What people call it.
    ra, dec : float
        ICRS at the epoch, radians.
    pm_ra, pm_dec : float
        Proper motion dRA/dt (not times cos Dec) and dDec/dt, radians a Julian year.
    parallax_arcsec : float
        Annual parallax.
    rv_km_s : float
        Radial velocity, receding positive.
    epoch : float
        Julian year of the place.
    """

    name: str
    ra: float
    dec: float
    pm_ra: float = 0.0
    pm_dec: float = 0.0
    parallax_arcsec: float = 0.0
    rv_km_s: float = 0.0
    epoch: float = 2000.0
    _place: Vector = field(init=False, repr=False, compare=False)
    _motion: Vector = field(init=False, repr=False, compare=False)
    _parallax: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values = (self.ra, self.dec, self.pm_ra, self.pm_dec, self.parallax_arcsec, self.rv_km_s, self.epoch)
        if not all(math.isfinite(value) for value in values):
            raise TargetError(f"{self.name}: {values} has a value that is no number; give finite numbers")
        if abs(self.dec) > math.pi / 2:
            raise TargetError(
                f"{self.name}: declination {math.degrees(self.dec):.10g}°; possible are −90° to 90°: check the target"
            )
        x, y, z = from_longitude_latitude(self.ra, self.dec)
        parallax = self.parallax_arcsec * ARCSEC
        # Space motion (pmpx), radians a year.
        recede = _KM_S_AU_YEAR * self.rv_km_s * parallax
        north = self.pm_dec * z
        object.__setattr__(self, "_place", (x, y, z))
        object.__setattr__(self, "_parallax", parallax)
        object.__setattr__(
            self,
            "_motion",
            (
                -self.pm_ra * y - north * math.cos(self.ra) + recede * x,
                self.pm_ra * x - north * math.sin(self.ra) + recede * y,
                self.pm_dec * math.cos(self.dec) + recede * z,
            ),
        )

    @classmethod
    def from_degrees(
        cls,
        ra_deg: float,
        dec_deg: float,
        name: str = "",
        *,
        pm_ra_cosdec_mas: float = 0.0,
        pm_dec_mas: float = 0.0,
        parallax_mas: float = 0.0,
        rv_km_s: float = 0.0,
        epoch: float = 2000.0,
    ) -> Self:
        """Make a star from a catalogue's units; proper motions in mas a year, that in right ascension with cos Dec.

        Raises
        ------
        TargetError
            A value is impossible.
        """
        dec = math.radians(dec_deg)
        mas = ARCSEC / 1e3
        return cls(
            name or f"{ra_deg:.6f},{dec_deg:+.6f}",
            math.radians(ra_deg),
            dec,
            pm_ra_cosdec_mas * mas / math.cos(dec),
            pm_dec_mas * mas,
            parallax_mas / 1e3,
            rv_km_s,
            epoch,
        )

    @classmethod
    def from_skycoord(cls, coord: "SkyCoord", name: str = "") -> Self:
        """Make a star from astropy's `SkyCoord` in any frame; its `obstime` is the epoch of its proper motion.

        Raises
        ------
        TargetError
            The coordinate is an array, or cannot be brought to ICRS.
        """
        from astropy import units  # noqa: PLC0415 - astropy takes 0.8 s to import; only its users pay
        from astropy.coordinates import ConvertError  # noqa: PLC0415 - as above
        from astropy.utils.iers import conf  # noqa: PLC0415 - as above

        if not coord.isscalar:
            raise TargetError(f"{coord.size} coordinates are not one target: give a scalar SkyCoord")
        try:
            # Horizontal frames need Earth orientation, for which astropy must not reach for the network.
            with conf.set_temp("auto_download", value=False), conf.set_temp("auto_max_age", None):
                icrs = coord.icrs
        except (ConvertError, AttributeError) as error:  # the latter from a frame without location or obstime
            raise TargetError(f"{coord} cannot be brought to ICRS: give it obstime and location ({error})") from None
        pm_ra = pm_dec = rv = parallax = 0.0
        place, motion = icrs.spherical, icrs.data.differentials.get("s")
        if place.distance.unit.is_equivalent(units.pc):
            parallax = float((1.0 * units.AU / place.distance).to_value(units.mas, units.dimensionless_angles()))
        if motion is not None:
            if hasattr(motion, "d_lon") or hasattr(motion, "d_lon_coslat") or parallax:
                rate = units.mas / units.yr
                pm_ra, pm_dec = float(icrs.pm_ra_cosdec.to_value(rate)), float(icrs.pm_dec.to_value(rate))
            if parallax:
                rv = float(icrs.radial_velocity.to_value(units.km / units.s))
        return cls.from_degrees(
            float(icrs.ra.deg),
            float(icrs.dec.deg),
            name,
            pm_ra_cosdec_mas=pm_ra,
            pm_dec_mas=pm_dec,
            parallax_mas=parallax,
            rv_km_s=rv,
            epoch=2000.0 if coord.obstime is None else float(coord.obstime.tt.jyear),
        )

    def astrometric(self, frame: SkyFrame) -> Vector:
        """Astrometric direction at a moment, ICRS axes: with proper motion, parallax and light time (pmpx)."""
        x, y, z = self._place
        mx, my, mz = self._motion
        ox, oy, oz = frame.position_au
        parallax = self._parallax
        years = frame.years - (self.epoch - 2000.0) + (x * ox + y * oy + z * oz) * _AU_LIGHT_YEARS
        x += years * mx - parallax * ox
        y += years * my - parallax * oy
        z += years * mz - parallax * oz
        n = 1.0 / math.sqrt(x * x + y * y + z * z)
        return x * n, y * n, z * n

    def astrometric_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """`astrometric` and its derivative per second."""
        direction = x, y, z = self.astrometric(frame)
        mx, my, mz = self._motion
        vx, vy, vz = frame.velocity_c
        px, py, pz = self._place
        years = (1.0 + (px * vx + py * vy + pz * vz)) / _YEAR_S
        parallax = self._parallax * _LIGHT_AU_YEAR / _YEAR_S
        dx, dy, dz = years * mx - parallax * vx, years * my - parallax * vy, years * mz - parallax * vz
        along = dx * x + dy * y + dz * z
        return direction, (dx - along * x, dy - along * y, dz - along * z)

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        return frame.observe(self.astrometric(frame))

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and its derivative per second."""
        return frame.observe_with_rate(*self.astrometric_with_rate(frame))


@dataclass(frozen=True)
class FixedAltAz:
    """An observed place that stands still over the horizon.

    Parameters
    ----------
    azimuth, altitude : float
        Observed, radians.
    name : str
        What people call it.
    """

    azimuth: float
    altitude: float
    name: str = "fixed altaz"

    def __post_init__(self) -> None:
        _refuse("azimuth", self.azimuth, math.tau)
        _refuse("altitude", self.altitude, math.pi / 2)

    def observed(self, frame: SkyFrame) -> Vector:  # noqa: ARG002 - it stands still
        """Return the observed direction in the horizon frame."""
        return from_azimuth_altitude(self.azimuth, self.altitude)

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and no motion."""
        return self.observed(frame), _STILL


@dataclass(frozen=True)
class FixedHaDec:
    """An observed place that stands still at an hour angle and declination.

    Parameters
    ----------
    hour_angle, declination : float
        Observed, radians; the hour angle positive to the west.
    name : str
        What people call it.
    """

    hour_angle: float
    declination: float
    name: str = "fixed hadec"

    def __post_init__(self) -> None:
        _refuse("hour angle", self.hour_angle, math.tau)
        _refuse("declination", self.declination, math.pi / 2)

    def observed(self, frame: SkyFrame) -> Vector:
        """Return the observed direction in the horizon frame."""
        equatorial = from_hour_angle_declination(self.hour_angle, self.declination)
        return equatorial_to_horizon(equatorial, frame.sky.site.latitude)

    def observed_with_rate(self, frame: SkyFrame) -> tuple[Vector, Vector]:
        """Return the observed direction and no motion."""
        return self.observed(frame), _STILL


def _refuse(what: str, angle: float, bound: float) -> None:
    if not abs(angle) <= bound * (1.0 + 1e-12):
        degrees = math.degrees(bound)
        raise TargetError(
            f"{what} {math.degrees(angle):.10g}°; possible are −{degrees:g}° to {degrees:g}°: check the target"
        )
