"""Faults of a run that show in what a small model leaves: another frame of the places, another zero from a star on.

A small model takes up much of a precession, a turn of the sky as the polar axis's tilt is a turn of the mount, so
the exact pattern of the date is fitted along with it: its amplitude is 0 where the frame is right and 1 where
places of J2000 were read as those of date. A short run leaves the amplitude uncertain; then nothing is said.
"""

import math
from collections.abc import Iterator

import numpy as np

from pointing.model.equatorial_places import Circumstances, dated, observed_places
from pointing.model.finding import Finding
from pointing.model.first_order import design, fit_first_order
from pointing.model.run import Array, PointingRun, nearest_turn
from pointing.site import Weather

_AMPLITUDE = 0.5
_SURE = 4.0  # standard deviations
_TOLD = 0.25  # largest standard deviation of an amplitude that is listened to
_LEAST_STARS = 12
_STRETCH = 4  # observations before and after a break, at least
_COLLAPSE = 2.0
_FRAMES = {  # frame read: sense of the pattern, what happened, remedy
    "apparent": (1.0, "J2000 places read as apparent", "read them with places='icrs'"),
    "observed": (1.0, "J2000 places read as observed", "read them with places='icrs'"),
    "": (1.0, "J2000 places taken for those of date", "turn them into observed places first"),
    "icrs": (-1.0, "apparent places read as J2000", "read them with places='apparent'"),
}


def wrong_frame(run: PointingRun) -> Iterator[Finding]:
    """Equatorial places of J2000 read as those of date, or the reverse; needs date and sidereal time."""
    if (
        run.mount != "equatorial" or run.date is None or not dated(run.date) or len(run) < _LEAST_STARS
        or not np.all(np.isfinite(run.sidereal_time))
    ):  # fmt: skip
        return
    sense, what, remedy = _FRAMES[run.places]
    pattern, size = precession_pattern(run)
    fit = fit_first_order(run, sense * pattern[:, None])
    amplitude, sigma = float(fit.coefficients[-1]), float(fit.sigmas[-1])
    if sigma > _TOLD or amplitude < max(_AMPLITUDE, _SURE * sigma):
        return
    before = fit_first_order(run).rms
    yield Finding(
        "wrong-frame", "warn",
        f"{what}: the precession, nutation and aberration of {run.date.isoformat()}, "
        f"{math.degrees(size) * 60.0:.1f}′ on "
        f"average, are in the residuals with amplitude {amplitude:.2f} ± {sigma:.2f} (0 is none, 1 is "
        "all), and a small "
        f"model leaves {_arcsec(fit.rms):.0f}″ with it, {_arcsec(before):.0f}″ without: {remedy}",
    )  # fmt: skip


def precession_pattern(run: PointingRun) -> tuple[Array, float]:
    """Precession, nutation and aberration of the date, as a star's offset lacks them when its ICRS place was used.

    Returns
    -------
    tuple
        The lack on the sky, (2n,), along axis 1, then along axis 2; and its mean size.
    """
    at = Circumstances(run.latitude, 0.0, Weather(refraction=False), run.date)
    ra, lst = run.sidereal_time - run.star1, run.sidereal_time
    right, wrong = (observed_places(places, ra, run.star2, lst, at) for places in ("icrs", "apparent"))
    shift1, shift2 = nearest_turn(wrong[0] - right[0]), wrong[1] - right[1]
    side = np.where(run.beyond, -1.0, 1.0)
    across = shift1 * np.cos(run.star2)
    return np.concatenate([side * across, side * shift2]), float(np.mean(np.hypot(across, shift2)))


def second_run(run: PointingRun) -> Iterator[Finding]:
    """Zero points that jump between two stars: two runs in one, or an axis that slipped or was set anew."""
    n = len(run)
    if n < _LEAST_STARS:
        return
    fit = fit_first_order(run)
    basis, _ = np.linalg.qr(design(run))
    left = np.concatenate([fit.across, fit.along])
    breaks = range(_STRETCH, n - _STRETCH + 1)
    gains = [_gain(_step(run, i), basis, left) for i in breaks]
    at = breaks[int(np.argmax(gains))]
    after = fit_first_order(run, _step(run, at))
    if after.rms * _COLLAPSE > fit.rms:
        return
    jump = [_arcsec(float(value)) for value in after.coefficients[-2:]]
    where = f"line {run.line[at]}" if run.line[at] else f"observation {at}, counted from 0"
    yield Finding(
        "second-run", "warn",
        f"from {where} on the zero points are {jump[0]:+.0f}″ and {jump[1]:+.0f}″ from those before, and a "
        "small model "
        f"leaves {_arcsec(after.rms):.0f}″ with that step, {_arcsec(fit.rms):.0f}″ without: fit both parts by "
        "themselves, if they are two runs or an axis slipped or was synchronised",
    )  # fmt: skip


def _step(run: PointingRun, at: int) -> Array:
    """Zero points of both axes from an observation on, on the sky: (2n, 2)."""
    later = (np.arange(len(run)) >= at).astype(float)
    nought = np.zeros(len(run))
    level = np.cos(run.mechanical_star()[1])
    return np.array([np.concatenate([later * level, nought]), np.concatenate([nought, later])]).T


def _gain(columns: Array, basis: Array, left: Array) -> float:
    """By how much columns on top of a model diminish the sum of squares of what it left."""
    own, _ = np.linalg.qr(columns - basis @ (basis.T @ columns))
    return float(np.sum((own.T @ left) ** 2))


def _arcsec(angle: float) -> float:
    return math.degrees(angle) * 3600.0
