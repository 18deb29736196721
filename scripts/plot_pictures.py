"""`python -m scripts.plot_pictures`: draw an example of each plot of a fit, of the notebooks' runs.

A picture's bytes depend on matplotlib's version, so it is drawn by hand and looked at; tests see that it is there.
"""

import sys
from collections.abc import Callable

import matplotlib.pyplot as plt
from matplotlib.figure import Figure

from pointing import choose_terms, fit, fit_nights, read_tpoint, read_tpoint_all
from pointing.model import plots
from scripts.sections import CHECKOUT

FOLDER = CHECKOUT / "docs" / "pictures"
NOTEBOOKS = CHECKOUT / "notebooks"
TERMS = "IH ID CH NP MA ME TF"
GERMAN = fit(read_tpoint(NOTEBOOKS / "german_run.dat", places="observed"), TERMS, outliers=True).run
GOOD = GERMAN.subset(GERMAN.kept)  # without what does not belong
NIGHTS = read_tpoint_all(NOTEBOOKS / "fork_nights.dat", places="observed")


def maps() -> Figure:
    """A map where terms are missing, and one where none is."""
    figure = Figure(figsize=(9.0, 4.4))
    for ax, names in zip(figure.subplots(1, 2), ("IH ID CH NP TF", TERMS), strict=True):
        plots.plot_map(fit(GOOD, names), ax)
        ax.set_title(f"{names}\n{ax.get_title()}", fontsize="medium")
    return figure


def against() -> Figure:
    """One component against the zenith distance, without the flexure that it shows and with it."""
    figure = Figure(figsize=(9.0, 3.4))
    for ax, names in zip(figure.subplots(1, 2), ("IH ID CH NP MA ME", TERMS), strict=True):
        plots.plot_against(fit(GOOD, names), "dY", "zenith distance", ax)
        ax.set_title(names, fontsize="medium")
        ax.legend(fontsize="small")
    return figure


def scatter() -> Figure:
    """Scatter and histogram."""
    figure = Figure(figsize=(9.0, 3.6))
    left, right = figure.subplots(1, 2)
    found = fit(GOOD, TERMS)
    plots.plot_scatter(found, left)
    plots.plot_histogram(found, right)
    return figure


def panels() -> Figure:
    """The nine panels."""
    figure = Figure(figsize=(12.0, 10.0))
    plots.plot_panels(fit(NIGHTS[0], TERMS), figure.subplots(3, 3))
    return figure


def error_map() -> Figure:
    """How sure the model is over the sky."""
    figure = Figure(figsize=(5.4, 4.2))
    plots.plot_error_map(fit(GOOD, TERMS).error_map(2.0), figure.add_subplot())
    return figure


def choice() -> Figure:
    """How terms were chosen."""
    figure = Figure(figsize=(6.4, 3.8))
    ax = figure.add_subplot()
    plots.plot_choice(choose_terms(GOOD).path, ax)
    ax.set(yscale="log", ylim=(1.0, 1000.0))
    return figure


def nights() -> Figure:
    """What walks and what stays."""
    figure = Figure(figsize=(9.0, 3.6))
    together, alone = fit_nights(NIGHTS, TERMS), [fit(run, TERMS) for run in NIGHTS]
    for ax, name in zip(figure.subplots(1, 2), ("ME", "CH"), strict=True):
        plots.plot_nights(together, name, alone, ax)
    return figure


PICTURES: tuple[Callable[[], Figure], ...] = (maps, against, scatter, panels, error_map, choice, nights)


def main() -> int:
    """Draw all pictures; return the exit code."""
    plt.style.use(NOTEBOOKS / "sky.mplstyle")
    FOLDER.mkdir(exist_ok=True)
    for draw in PICTURES:
        path = FOLDER / f"{draw.__name__}.png"
        draw().savefig(path, dpi=50 if draw is panels else 80, metadata={"Software": None})
        print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
