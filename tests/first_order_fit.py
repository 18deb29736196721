"""A least-squares fit of pointing terms to first order, from the table of partials alone: an oracle for signs.

It knows the terms in mechanical angles and nothing of the product's model. Products of coefficients are left out: for
coefficients of 300″ that is up to 0.4″, amplified towards pole and zenith.
"""

from typing import NamedTuple

import numpy as np

ARCSEC = np.pi / 648000.0


class Fit(NamedTuple):
    arcsec: dict[str, float]
    sky_rms_arcsec: float


def fit(run, names):
    """Fit named terms to a run's kept observations, residuals on the sky."""
    run = run.subset(run.kept)
    star1, star2 = run.mechanical_star()
    design, residual = [], []
    partials = (_equatorial if run.mount == "equatorial" else _altazimuth)(star1, star2, run.latitude)
    across = np.cos(star2)
    for name in names.split():
        first, second = np.broadcast_arrays(*partials[name], star1)[:2]
        design.append(np.concatenate([first * across, second]))
    delta1, delta2 = (_turned(star - axis) for star, axis in ((star1, run.axis1), (star2, run.axis2)))
    residual = np.concatenate([delta1 * across, delta2])
    solution, *_ = np.linalg.lstsq(np.array(design).T, residual, rcond=None)
    left = residual - np.array(design).T @ solution
    rms = np.sqrt(np.sum(left**2) / len(run)) / ARCSEC
    return Fit(dict(zip(names.split(), (solution / ARCSEC).tolist(), strict=True)), float(rms))


def _turned(angle):
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _equatorial(h, d, phi):
    sec, tan, sin_h, cos_h = 1.0 / np.cos(d), np.tan(d), np.sin(h), np.cos(h)
    return {
        "IH": (1.0, 0.0),
        "ID": (0.0, 1.0),
        "CH": (sec, 0.0),
        "NP": (tan, 0.0),
        "MA": (-cos_h * tan, sin_h),
        "ME": (sin_h * tan, cos_h),
        "TF": (np.cos(phi) * sin_h * sec, np.cos(phi) * cos_h * np.sin(d) - np.sin(phi) * np.cos(d)),
    }


def _altazimuth(a, e, _):
    sec, tan = 1.0 / np.cos(e), np.tan(e)
    return {
        "IA": (-1.0, 0.0),
        "IE": (0.0, 1.0),
        "CA": (-sec, 0.0),
        "NPAE": (-tan, 0.0),
        "AN": (-np.sin(a) * tan, -np.cos(a)),
        "AW": (-np.cos(a) * tan, np.sin(a)),
        "TF": (0.0, -np.cos(e)),
        "TX": (0.0, -1.0 / tan),
        "PZZ1": (0.0, -(np.pi / 2.0 - e)),
    }
