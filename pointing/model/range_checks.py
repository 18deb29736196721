"""Faults of a run that its numbers tell by their range: units, exchanged columns, the horizon, half turns.

Each check gives what it found. Exchanging star and telescope only turns all signs and cannot be told by ranges,
unless the run has places beyond the pole, which no star has.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from pointing.model.finding import Finding, listed
from pointing.model.first_order import SMALL_MODEL, fit_first_order
from pointing.model.run import COORDINATES, Array, PointingRun

_QUARTER = math.pi / 2.0 + 1e-9
_FAR = math.radians(5.0)  # from star to telescope: more than index errors of real mounts
_COLLAPSE = 10.0
_FIT_COLLAPSE = 3.0
_LEAST_RMS = math.radians(1.0 / 60.0)
_HALF_TURN = math.radians(10.0)
_NEAR_POLE = 0.1  # cos δ below which axis 1 is told too badly
_LARGE_INDEX = math.radians(10.0)
_BELOW = math.radians(-1.0)  # altitude; seen through the air nothing is lower
_SAME = math.radians(0.01 / 3600.0)
_SHOWN_ENOUGH = 5


def impossible_places(run: PointingRun) -> Iterator[Finding]:
    """Stars more than 90° from the equator or horizon: degrees, or columns exchanged."""
    first, second = COORDINATES[run.mount]
    worst = float(np.max(np.abs(run.star2), initial=0.0))
    if worst <= _QUARTER:
        return
    said = f"{second} of a star reaches {worst:.4g} rad ({math.degrees(worst):.5g}°), possible is π/2 (90°)"
    fits = worst <= math.tau
    if fits and np.max(np.abs(run.star1)) <= _QUARTER:
        yield Finding("exchanged-coordinates", "refuse", f"{said}, and {first} stays within it: exchange the columns")
    elif worst <= 1.5 * math.pi and np.max(np.abs(run.axis2)) <= _QUARTER and _exchanged_is_closer(run):
        yield Finding(
            "exchanged-star-and-telescope", "refuse",
            f"{said}, and the telescope's does not: stars are never beyond the pole; exchange star and telescope",
        )  # fmt: skip
    else:
        yield Finding("degrees", "refuse", f"{said}: the angles look like degrees; use PointingRun.from_degrees")


def _exchanged_is_closer(run: PointingRun) -> bool:
    turned = replace(run, star1=run.axis1, star2=run.axis2, axis1=run.star1, axis2=run.star2)
    return float(np.median(_distance(turned))) < _FAR


def radians_as_degrees(run: PointingRun) -> Iterator[Finding]:
    """All angles of a run within 6.3° and 1.6°: radians that were taken for degrees."""
    spans = [(run.star1, math.tau), (run.axis1, 2.0 * math.tau), (run.star2, _QUARTER), (run.axis2, math.tau)]
    if len(run) < _SHOWN_ENOUGH or not all(np.max(np.abs(values)) <= math.radians(top) for values, top in spans):
        return
    widest = math.degrees(max(float(np.ptp(run.star1)), float(np.ptp(run.star2))))
    yield Finding(
        "radians", "refuse",
        f"all {len(run)} stars lie within {widest:.3g}° of each other, and no angle exceeds 2π degrees: "
        "the angles look "
        "like radians taken for degrees; use PointingRun with radians",
    )  # fmt: skip


def exchanged_coordinates(run: PointingRun) -> Iterator[Finding]:
    """The star's two columns exchanged, or those of star and telescope: what is left then collapses."""
    first, second = COORDINATES[run.mount]
    star = _exchanged(run, star1=run.star2, star2=run.star1)
    far = float(np.median(_distance(run)))
    if star is not None and far > _FAR and float(np.median(_distance(star))) < far / _COLLAPSE:
        yield Finding(
            "exchanged-coordinates", "refuse",
            f"star and telescope are {math.degrees(far):.1f}° apart in the middle, with the star's {first} "
            f"and {second} "
            f"exchanged {math.degrees(float(np.median(_distance(star)))):.2f}°: exchange these columns",
        )  # fmt: skip
        return
    both = _exchanged(run, star1=run.star2, star2=run.star1, axis1=run.axis2, axis2=run.axis1)
    if both is None or len(run) <= SMALL_MODEL or far > _FAR:
        return
    rms, other = fit_first_order(run).rms, fit_first_order(both).rms
    if rms > _LEAST_RMS and other < rms / _FIT_COLLAPSE:
        yield Finding(
            "exchanged-coordinates", "warn",
            f"a small model leaves {_arcsec(rms):.0f}″, and {_arcsec(other):.0f}″ with {first} and "
            f"{second} exchanged "
            "for star and telescope: check the order of the columns",
        )  # fmt: skip


def _exchanged(run: PointingRun, **columns: Array) -> PointingRun | None:
    """The run with columns exchanged, or None where that makes impossible places."""
    if np.max(np.abs(columns["star2"]), initial=0.0) > _QUARTER:
        return None
    return replace(run, **columns)  # type: ignore[arg-type] # all of them are arrays


def below_the_horizon(run: PointingRun) -> Iterator[Finding]:
    """Stars under the horizon; of an equatorial run, whether the latitude's other sign brings them up.

    The azimuth and elevation of an altazimuth run hold for any latitude, so nothing tells its sign there.
    """
    low = altitudes(run, run.latitude) < _BELOW
    if not low.any():
        return
    count = int(np.count_nonzero(low))
    said = f"{count} of {len(run)} stars are below the horizon ({listed(run, low)})"
    if run.mount == "equatorial" and not np.any(altitudes(run, -run.latitude) < _BELOW):
        degrees = math.degrees(run.latitude)
        yield Finding(
            "latitude-sign", "refuse", f"{said} at latitude {degrees:+.4f}°, none at {-degrees:+.4f}°: turn its sign"
        )
    else:
        yield Finding(
            "below-horizon", "refuse" if 2 * count > len(run) else "warn",
            f"{said}: check latitude, sidereal time and the columns, or mask these stars",
        )  # fmt: skip


def altitudes(run: PointingRun, latitude: float) -> Array:
    """Altitude of the stars, (n,), radians."""
    if run.mount == "altazimuth":
        return run.star2
    up = math.sin(latitude) * np.sin(run.star2) + math.cos(latitude) * np.cos(run.star2) * np.cos(run.star1)
    return np.asarray(np.arcsin(np.clip(up, -1.0, 1.0)))


def half_turns(run: PointingRun) -> Iterator[Finding]:
    """Axis 1 half a turn, or by a large angle, from the star; whole turns are a wound axis and no fault."""
    first, _ = run.offsets()
    told = np.abs(np.cos(run.star2)) > _NEAR_POLE
    turned = told & (np.abs(np.abs(first) - math.pi) < _HALF_TURN)
    if turned.any():
        count = int(np.count_nonzero(turned))
        yield Finding(
            "half-turn", "refuse",
            f"axis 1 is 180° (12 h) from the star in {count} of {len(run)} observations "
            f"({listed(run, turned)}): beyond "
            "the pole axis 2 must read above 90°, else below; or sidereal time or hour angle are off by 12 h",
        )  # fmt: skip
    told &= ~turned
    index = float(np.median(first[told])) if told.any() else 0.0
    if abs(index) > _LARGE_INDEX:
        degrees = math.degrees(index)
        yield Finding(
            "constant-offset", "warn",
            f"axis 1 is {degrees:+.2f}° ({degrees / 15.0:+.3f} h) from the star in the middle: check sidereal time, "
            "longitude and time zone, or set the axis's zero; a model is meant for errors of a few degrees",
        )  # fmt: skip


def duplicates(run: PointingRun) -> Iterator[Finding]:
    """The same star with the same reading again, to 0.01″."""
    rows = np.round(np.array([run.star1, run.star2, run.axis1, run.axis2]).T / _SAME)
    _, index = np.unique(rows, axis=0, return_index=True)
    again = np.ones(len(run), bool)
    again[index] = False
    if again.any():
        yield Finding(
            "duplicates", "warn",
            f"{int(np.count_nonzero(again))} of {len(run)} observations repeat another, star and telescope "
            f"({listed(run, again)}): they count twice and tell nothing new; mask them",
        )  # fmt: skip


def _distance(run: PointingRun) -> Array:
    """Angle between star and telescope, (n,)."""
    star1, star2 = run.mechanical_star()
    cosine = np.sin(star2) * np.sin(run.axis2) + np.cos(star2) * np.cos(run.axis2) * np.cos(star1 - run.axis1)
    return np.asarray(np.arccos(np.clip(cosine, -1.0, 1.0)))


def _arcsec(angle: float) -> float:
    return math.degrees(angle) * 3600.0


def too_few_stars(run: PointingRun, terms: int) -> Iterator[Finding]:
    """Whether 2n numbers tell k terms: more than k are needed, twice as many are wise."""
    n, least = len(run), terms // 2 + 1
    stars = f"{n} star{'' if n == 1 else 's'}"
    if n < least:
        why = (
            f"{n} star{' gives' if n == 1 else 's give'} {2 * n} numbers for {terms} terms, of which more are needed"
        )
        remedy = f"observe at least {least} stars, better {terms} or more, or fit fewer terms"
        yield Finding("too-few-stars", "refuse", f"{why}: {remedy}")
    elif n < terms:
        why = f"{stars} for {terms} terms leave {2 * n - terms} numbers to show what the model cannot explain"
        yield Finding("too-few-stars", "warn", f"{why}: observe {terms} or more, or fit fewer terms")
