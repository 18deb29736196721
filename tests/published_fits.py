"""The published fits of the shared runs, as their documents print them, and the same fits made here.

Coefficients and standard deviations are arcseconds. TPOINT's own model files are read as they are, the numbers of
the others stand here as they were published.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from pointing.model.fit import fit
from pointing.model.fitted import Fit
from pointing.model.run import PointingRun
from pointing.model.run_file import read_run

GERMAN_TERMS = "IH ID CH NP MA ME TF"


@dataclass(frozen=True)
class Published:
    """One published fit.

    Parameters
    ----------
    run : str
        Name of the file without its suffix.
    coefficients : mapping
        As published, in the order of the document.
    sigmas : mapping
        TPOINT's standard deviations, where published.
    sky_rms, popn_sd : float or None
        Where published.
    within : float
        What a coefficient may differ by.
    fixed : mapping
        Terms that were not fitted.
    """

    run: str
    coefficients: Mapping[str, float]
    sigmas: Mapping[str, float] = field(default_factory=dict)
    sky_rms: float | None = None
    popn_sd: float | None = None
    within: float = 0.01
    fixed: Mapping[str, float] = field(default_factory=dict)

    @property
    def terms(self) -> str:
        return " ".join([*self.coefficients, *self.fixed])


PUBLISHED = (
    Published(
        "auxtel_2022-04",
        {"IA": -292.0063, "IE": -213.0469, "AN": 39.1647, "AW": 70.8896, "TX10": -6.8641, "CA": 90.9256},
        {"IA": 2.16741, "IE": 0.90851, "AN": 0.50375, "AW": 0.49754, "TX10": 0.72265, "CA": 1.51859},
        sky_rms=3.1416,
        popn_sd=3.33,
    ),
    Published(
        "auxtel_2020-02",
        {"IA": -213.2994, "IE": -279.3958, "NPAE": -69.0157, "AN": 49.0853, "AW": 60.3376},
        {"IA": 13.35831, "IE": 5.67797, "NPAE": 9.04990, "AN": 6.26479, "AW": 6.15091},
        sky_rms=23.2020,
        fixed={"CA": 0.0},
    ),
    Published(
        "apo_2016-08-18",
        {"IE": -155.7826, "IA": 142.2072, "AN": 4.9274, "AW": -7.5754, "CA": -59.1471, "PZZ1": -37.6779},
        {"IE": 1.46512, "IA": 2.30554, "AN": 0.60292, "AW": 0.59867, "CA": 1.82497, "PZZ1": 1.47253},
        sky_rms=4.9498,
    ),
    Published(
        "apo_2017-12-10",
        {"IE": -177.3588, "IA": 173.8050, "AN": 2.3379, "AW": -23.3381, "CA": -73.9629, "PZZ1": -44.6137},
        sky_rms=16.8058,
    ),
    Published(
        "spk_equat",
        {"IH": -92.258, "ID": -126.738, "CH": 44.210, "ME": 64.848, "MA": -2.992, "TF": 10.993},
        popn_sd=5.780,
        within=0.1,
    ),
    Published(
        "spk_altaz",
        {"IA": -142.148, "IE": -117.293, "CA": 19.843, "AN": -23.758, "AW": 19.261, "TF": 279.752},
        popn_sd=8.349,
        within=0.3,
    ),
)
ZERO_POINTS = {"spk_equat": ("IH ID", 36.26), "spk_altaz": ("IA IE", 60.44)}
"""Population SD of the index errors alone, as published."""

GERMAN = {"gem_cgx-l": (233.0, 1865.0), "gem_warp": (100.0, 3832.0)}
"""Published sky RMS with the rule beyond the pole and without it, to the arcsecond; places taken as observed."""


@cache
def run_of(shared: Path, name: str) -> PointingRun:
    """Read a shared run."""
    return read_run(shared / "data" / "tpoint" / f"{name}.dat", places="observed")


def fitted(shared: Path, published: Published) -> Fit:
    """The same terms fitted here."""
    return fit(run_of(shared, published.run), published.terms, fixed=published.fixed)


def without_the_rule(run: PointingRun) -> PointingRun:
    """The run with its readings beyond the pole written as places of the sky, as if there were one side only."""
    return replace(
        run,
        axis1=np.where(run.beyond, run.axis1 + np.pi, run.axis1),
        axis2=np.where(run.beyond, np.pi - run.axis2, run.axis2),
    )
