"""How axis 1 leans, and what to turn to put it right.

The tilt terms of a model (ME and MA, AN and AW) are exact rotations, so where they put the end of axis 1 is exact,
for degrees of misalignment, too. Two knobs undo it: the altitude of the polar axis, and its azimuth, which turns
about the vertical and moves the pole on the sky by cos φ of its own angle.

Places of stars are those in which they are seen, so ME and MA refer to the *true* pole, and that is what is advised:
both axes follow the refracted sky, and no direction of axis 1 saves them that. An axis 1 that is driven alone and at
one rate does better on the *refracted* pole, about cot φ arcminutes above the true one, with the rate that King gives
for it (E. S. King 1931, A Manual of Celestial Photography).

The same tilt as the mount's registers: the rotation vector (X, Y, 0), to first order MA = −X, ME = −Y, AW = X and
AN = −Y. Exactly, the terms also turn the mount about its axis 1 by about XY/2, and the index error of axis 1 takes
that.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pointing.errors import PointingError
from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.possible import refuse_nonsense
from pointing.model.words import POLES, Pole
from pointing.refraction import refract
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.vectors import (
    Vector,
    azimuth_altitude,
    equatorial_to_horizon,
    from_azimuth_altitude,
    from_hour_angle_declination,
)

if TYPE_CHECKING:
    from pointing.model.fitted import Fit

TILTS: dict[MountKind, tuple[str, str]] = {"equatorial": ("ME", "MA"), "altazimuth": ("AN", "AW")}
_ARCSEC = math.degrees(1.0) * 3600.0
_METRE_MM = 1000.0
_UNITS = (("°", 3600.0, 3), ("′", 60.0, 2), ("″", 1.0, 1))  # each from its own size on, with its digits


@dataclass(frozen=True)
class Registers:
    """A tilt as the mount's own registers, to be added to what they hold when the terms leave the model.

    Parameters
    ----------
    x_mas, y_mas : float
        The rotation vector, milliarcseconds.
    index : str
        The index error of axis 1: IH or IA.
    index_arcsec : float
        What that has to take up: the terms' turn about axis 1.
    """

    x_mas: float
    y_mas: float
    index: str
    index_arcsec: float

    @property
    def text(self) -> str:
        """What to write where."""
        return (
            f"in the mount's registers instead of the model: mount_x_mas {self.x_mas:+.0f}, mount_y_mas "
            f"{self.y_mas:+.0f}, {self.index} {self.index_arcsec:+.3f}″; never both"
        )


@dataclass(frozen=True)
class PolarAlignment:
    """What to turn on an equatorial mount.

    Parameters
    ----------
    pole : {"true", "refracted"}
        To which the axis shall point.
    latitude_deg : float
        North positive.
    raise_arcsec, raise_sigma_arcsec : float
        By how much the end of the axis at the visible pole must rise; negative: sink; NaN without ME.
    east_arcsec, east_sigma_arcsec : float
        By how much that end must go east, as an angle of the azimuth knob; negative: west; NaN without MA.
    refracted_pole_arcsec : float
        How far the refracted pole is above the true one.
    registers : Registers
        The present misalignment, in the mount's own terms.
    """

    pole: Pole
    latitude_deg: float
    raise_arcsec: float
    raise_sigma_arcsec: float
    east_arcsec: float
    east_sigma_arcsec: float
    refracted_pole_arcsec: float
    registers: Registers

    @property
    def end(self) -> str:
        """The end of the axis at the visible pole."""
        return "south" if self.latitude_deg < 0.0 else "north"

    @property
    def text(self) -> str:
        """The advice, a sentence a line."""
        sky = abs(self.east_arcsec) * math.cos(math.radians(self.latitude_deg))
        height = _directed(
            self.raise_arcsec, self.raise_sigma_arcsec, "raise the polar axis", "lower the polar axis", "ME"
        )
        east, west = (f"move its {self.end} end {way}" for way in ("east", "west"))
        side = _directed(self.east_arcsec, self.east_sigma_arcsec, east, west, "MA")
        other = "the refracted" if self.pole == "true" else "the true"
        lift = angle_text(self.refracted_pole_arcsec)
        where = "above" if self.pole == "true" else "below"
        return "\n".join(
            (
                height + ("" if math.isnan(self.raise_arcsec) else f" (to the {self.pole} pole)"),
                side + ("" if math.isnan(self.east_arcsec) else f" in azimuth ({angle_text(sky)} on the sky)"),
                f"{other} pole is {lift} {where} it at latitude {self.latitude_deg:+.2f}°",
                self.registers.text,
            )
        )

    def _repr_html_(self) -> str:
        return "".join(f"<p>{line}</p>" for line in self.text.split("\n"))


@dataclass(frozen=True)
class AxisTilt:
    """What to raise under an altazimuth mount; the axis leans to the sides that are low.

    Parameters
    ----------
    north_arcsec, north_sigma_arcsec : float
        By how much the north side of the base must rise; negative: the south side; NaN without AN.
    west_arcsec, west_sigma_arcsec : float
        The same of the west side; negative: the east side; NaN without AW.
    registers : Registers
        The present tilt, in the mount's own terms.
    """

    north_arcsec: float
    north_sigma_arcsec: float
    west_arcsec: float
    west_sigma_arcsec: float
    registers: Registers

    @property
    def text(self) -> str:
        """The advice, a sentence a line."""
        rows = (
            (self.north_arcsec, self.north_sigma_arcsec, "north", "south", "AN"),
            (self.west_arcsec, self.west_sigma_arcsec, "west", "east", "AW"),
        )
        lines = [
            _directed(angle, sigma, f"raise the {one} side of the base", f"raise the {other} side of the base", name)
            + ("" if math.isnan(angle) else f" ({abs(math.tan(angle / _ARCSEC)) * _METRE_MM:.3f} mm a metre)")
            for angle, sigma, one, other, name in rows
        ]
        return "\n".join((*lines, self.registers.text))

    def _repr_html_(self) -> str:
        return "".join(f"<p>{line}</p>" for line in self.text.split("\n"))


def polar_alignment(fit: "Fit", pole: Pole = "true", weather: Weather | None = None) -> PolarAlignment | AxisTilt:
    """Return what to turn so that axis 1 points where it should.

    Parameters
    ----------
    fit : Fit
        With at least one of ME and MA, or AN and AW. σ are those of its covariance.
    pole : {"true", "refracted"}
        Where the polar axis shall point.
    weather : Weather, optional
        That refracts the pole; the run's own, else the standard atmosphere.

    Raises
    ------
    PointingError
        The model has no tilt, there is no such pole, or the fit is none of a telescope.
    """
    if pole not in POLES:
        raise PointingError(f"there is no pole {pole!r}: possible are {' and '.join(POLES)}")
    refuse_nonsense(fit)
    model = _tilt_of(fit.model)
    sigmas = _sigmas(fit)
    first, second = (1.0 if name in model.arcsec else math.nan for name in TILTS[model.kind])
    one, other = (sigmas[name] for name in TILTS[model.kind])
    if model.kind == "equatorial":
        other /= max(math.cos(model.latitude), 1e-9)
    air = weather or fit.run.weather or Weather.standard(0.0)
    return advice(
        model.kind, model.latitude, end_of_axis(model), (one * first, other * second), registers(fit.model), pole, air
    )


def advice(
    kind: MountKind,
    latitude: float,
    end: Vector,
    sigmas_arcsec: tuple[float, float],
    tilt: Registers,
    pole: Pole,
    weather: Weather,
) -> PolarAlignment | AxisTilt:
    """Return what to turn for an axis 1 whose end is seen at a place.

    Parameters
    ----------
    kind : MountKind
        What the axes measure.
    latitude : float
        Radians.
    end : Vector
        Of the axis at the visible pole, or at the zenith, horizon frame.
    sigmas_arcsec : tuple of float
        Of both angles to turn; NaN where nothing is known of one.
    tilt : Registers
        The same as the mount's registers.
    pole, weather
        As for `polar_alignment`.
    """
    unknown = tuple(0.0 * sigma for sigma in sigmas_arcsec)  # 0, or NaN
    first, second = (angle * _ARCSEC + each for angle, each in zip(to_turn(kind, end), unknown, strict=True))
    if kind == "altazimuth":
        return AxisTilt(first, sigmas_arcsec[0], second, sigmas_arcsec[1], tilt)
    lift = refracted_pole(latitude, weather)
    wanted = abs(latitude) + (lift if pole == "refracted" else 0.0)
    return PolarAlignment(
        pole, math.degrees(latitude), wanted * _ARCSEC + first, sigmas_arcsec[0], second, sigmas_arcsec[1],
        lift * _ARCSEC, tilt,
    )  # fmt: skip


def to_turn(kind: MountKind, end: Vector) -> tuple[float, float]:
    """Angles of both knobs, radians, that lead the end of an axis to where it belongs.

    Equatorial: minus its altitude, and how far it must go east. Altazimuth: by how much north and west must rise.
    """
    south, east, up = end
    if kind == "altazimuth":
        return math.atan2(-south, up), math.atan2(-east, up)
    azimuth, altitude = azimuth_altitude(end)
    away = math.pi - azimuth if south > 0.0 else math.remainder(azimuth, math.tau)
    return -altitude, -away


def end_of_axis(model: PointingModel) -> Vector:
    """Where the end of axis 1 at the visible pole, or at the zenith, is by a model's tilt; horizon frame."""
    tilt = _tilt_of(model)
    if model.kind == "altazimuth":
        return _turned(tilt, (0.0, 0.0, 1.0))
    end = _turned(tilt, (0.0, 0.0, -1.0 if model.latitude < 0.0 else 1.0))
    return equatorial_to_horizon(end, model.latitude)


def refracted_pole(latitude: float, weather: Weather) -> float:
    """How far the visible pole is seen above where it is, radians."""
    constants = Sky(Site(latitude, 0.0, 0.0, weather)).refraction_constants
    x, _, z = refract((-math.cos(latitude), 0.0, abs(math.sin(latitude))), *constants)
    return math.atan2(z, -x) - abs(latitude)


def registers(model: PointingModel) -> Registers:
    """Return a model's tilt as the mount's registers, exactly.

    The terms turn by R = R(X, Y)·Rz(t): X and Y follow from the end of axis 1, t from what is left of R.
    """
    tilt = _tilt_of(model)
    px, py, pz = _turned(tilt, (0.0, 0.0, 1.0))
    across = math.hypot(px, py)
    angle = math.atan2(across, pz)
    k = (-py / across, px / across) if across else (0.0, 0.0)
    x, y, z = _turned(tilt, (1.0, 0.0, 0.0))
    # Rᵀ(X, Y) by Rodrigues' formula, of which the first two components are wanted
    s, c = math.sin(angle), math.cos(angle)
    along = (k[0] * x + k[1] * y) * (1.0 - c)
    turn = math.atan2(y * c + k[0] * z * s + k[1] * along, x * c - k[1] * z * s + k[0] * along)
    index, sign = ("IH", -1.0) if model.kind == "equatorial" else ("IA", 1.0)
    mas = angle * _ARCSEC * 1000.0
    return Registers(k[0] * mas, k[1] * mas, index, sign * turn * _ARCSEC)


def angle_text(arcsec: float, sigma_arcsec: float | None = None) -> str:
    """An angle, perhaps with its standard deviation, in the unit in which it is easily read."""
    unit, size, digits = next(row for row in _UNITS if abs(arcsec) >= row[1] or row[1] == 1.0)
    value = f"{round(arcsec / size, digits) + 0.0:.{digits}f}{unit}"  # + 0.0: no −0.0
    return value if sigma_arcsec is None else f"{value} ± {_sigma_text(sigma_arcsec, unit, size, digits)}"


def _sigma_text(arcsec: float, unit: str, size: float, digits: int) -> str:
    """In the unit of its angle, or in arcseconds where it would be rounded to nothing there."""
    if 0.0 < arcsec < 0.5 * size / 10.0**digits:
        return f"{arcsec:.2g}″"
    return f"{arcsec / size:.{digits}f}{unit}"


def _directed(arcsec: float, sigma_arcsec: float, positive: str, negative: str, term: str) -> str:
    if math.isnan(arcsec):
        return f"{positive}, or not: nothing is known of it, because {term} is no term of the model"
    way = positive if arcsec >= 0.0 else negative
    enough = ", no more than its uncertainty" if abs(arcsec) < 2.0 * sigma_arcsec else ""
    return f"{way} by {angle_text(abs(arcsec), sigma_arcsec)}{enough}"


def _tilt_of(model: PointingModel) -> PointingModel:
    """The model's tilt terms alone."""
    names = TILTS[model.kind]
    pairs = [(t, c) for t, c in zip(model.terms, model.coefficients, strict=True) if t.name in names]
    if not pairs:
        raise PointingError(
            f"the model has neither {names[0]} nor {names[1]}, so it says nothing of axis 1: fit both of them"
        )
    listed, coefficients = zip(*pairs, strict=True)
    return PointingModel(model.kind, model.latitude, listed, coefficients)


def _sigmas(fit: "Fit") -> dict[str, float]:
    """Standard deviations from the covariance, arcseconds; 0 of what was not fitted."""
    found = dict.fromkeys(TILTS[fit.model.kind], 0.0)
    free = [each.name for each in fit.coefficients if not each.fixed]
    found |= {name: math.sqrt(fit.covariance[i, i]) * _ARCSEC for i, name in enumerate(free) if name in found}
    return found


def _turned(tilt: PointingModel, v: Vector) -> Vector:
    """Where the mount's own direction v is in the base frame."""
    x, y, z = v
    level = math.hypot(x, y)
    if tilt.kind == "altazimuth":
        return from_azimuth_altitude(*tilt.star(math.atan2(y, -x), math.atan2(z, level)))
    return from_hour_angle_declination(*tilt.star(math.atan2(-y, x), math.atan2(z, level)))
