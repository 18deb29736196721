"""Drawings of a fit, as they are known from TPOINT; needs matplotlib, the extra `plots`.

Each takes the axes to draw on and returns them; without any it opens a figure of its own. Residuals are star minus
prediction in the frame of the tube: see `pointing.model.residual_table`. The maps are the sky over the horizon, the
zenith in the middle, north up and east to the right, as on a map of the ground.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pointing.errors import PointingError
from pointing.model.place import Place
from pointing.model.residual_table import DIRECTIONS
from pointing.model.run import COORDINATES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from pointing.model.choice import Step
    from pointing.model.error_map import ErrorMap
    from pointing.model.fitted import Fit
    from pointing.model.nights import Nights
    from pointing.model.prediction import Prediction

Array = NDArray[np.float64]

_USED, _BEYOND, _MASKED = "#0072B2", "#E69F00", "#000000"  # told apart by the colour-blind (Okabe and Ito 2008)
_MARKERS = {_USED: ".", _BEYOND: "^", _MASKED: "x"}
_LENGTH_DEG = 10.0  # of the median residual as an arrow on the map
_BINS = 12
_SIGNS = {"begun with": "", "taken": "+", "dropped": "−", "exchanged": "±", "left": "?"}
AGAINST = ("axis 1", "axis 2", "zenith distance", "order")
"""What a residual can be drawn against."""


def plot_panels(fit: "Fit", axes: Any = None) -> Any:  # noqa: ANN401 - matplotlib's array of axes
    """Draw nine panels: dX and dY against both coordinates, zenith distance and order, and the scatter.

    Parameters
    ----------
    fit : Fit
        The fit.
    axes : (3, 3) array of Axes, optional
        Where to draw.

    Raises
    ------
    PointingError
        matplotlib is not installed, or it is not nine axes.
    """
    grid = _pyplot().subplots(3, 3, figsize=(12.0, 10.0), layout="constrained")[1] if axes is None else axes
    grid = np.asarray(grid, object)
    if grid.shape != (3, 3):
        raise PointingError(f"the nine panels need 3 × 3 axes, these are {grid.shape}")
    for row, component in enumerate(("dX", "dY")):
        for column, against in enumerate(AGAINST[:3]):
            plot_against(fit, component, against, grid[row, column])
    plot_against(fit, "dX", "order", grid[2, 0])
    plot_against(fit, "dY", "order", grid[2, 1])
    plot_scatter(fit, grid[2, 2])
    return grid


def save_panels(fit: "Fit", path: str | Path) -> None:
    """Draw the nine panels into a file, whose name says in which form.

    Raises
    ------
    PointingError
        matplotlib is not installed, does not know the form, or the file cannot be written.
    """
    refuse_undrawable(path)
    from matplotlib.figure import Figure  # noqa: PLC0415 - an extra

    figure = Figure(figsize=(12.0, 10.0), layout="constrained")
    plot_panels(fit, figure.subplots(3, 3))
    try:
        figure.savefig(path)
    except (ValueError, OSError) as error:
        raise PointingError(f"{path} cannot be drawn: {error}") from None


def refuse_undrawable(path: str | Path) -> None:
    """Refuse a picture that could not be drawn, before there is anything to draw.

    Raises
    ------
    PointingError
        matplotlib is not installed, or does not know the form that the file's name says.
    """
    _pyplot()
    from matplotlib.backend_bases import FigureCanvasBase  # noqa: PLC0415 - an extra

    known = FigureCanvasBase.get_supported_filetypes()
    form = Path(path).suffix.removeprefix(".").lower()
    if form not in known:
        raise PointingError(
            f"{path} cannot be drawn: its name says the form {form or 'not at all'}; possible are {', '.join(known)}"
        )


def plot_against(fit: "Fit", component: str, against: str, ax: "Axes | None" = None) -> "Axes":
    """Draw one component of the residuals, dX or dY, against one of `AGAINST`.

    Raises
    ------
    PointingError
        There is no such component or coordinate, or matplotlib is not installed.
    """
    if component not in {"dX", "dY"} or against not in AGAINST:
        raise PointingError(f"{component} against {against}: possible are dX, dY against {', '.join(AGAINST)}")
    ax = _own(ax)
    label, values = _abscissa(fit, against)
    residual = np.degrees(fit.residuals[("dX", "dY").index(component)]) * 3600.0
    for which, colour, name in _groups(fit):
        _dots(ax, values[which], residual[which], colour, name)
    ax.axhline(0.0, color="grey", linewidth=0.5)
    ax.set(xlabel=label, ylabel=_component_label(fit, component))
    return ax


def plot_scatter(fit: "Fit", ax: "Axes | None" = None) -> "Axes":
    """Draw dY against dX with the circle of the sky RMS."""
    ax = _own(ax)
    dx, dy = np.degrees(fit.residuals) * 3600.0
    for which, colour, name in _groups(fit):
        _dots(ax, dx[which], dy[which], colour, name)
    angle = np.linspace(0.0, math.tau, 181)
    rms = fit.sky_rms_arcsec
    ax.plot(rms * np.cos(angle), rms * np.sin(angle), color="grey", label=f"sky RMS {rms:.2f}″")
    ax.set(xlabel=_component_label(fit, "dX"), ylabel=_component_label(fit, "dY"), aspect="equal")
    ax.legend(fontsize="small")
    return ax


def plot_histogram(fit: "Fit", ax: "Axes | None" = None) -> "Axes":
    """Draw how the distances of the used observations are spread, and how they should be for the fitted scatter.

    Two normal components of standard deviation s give distances r with the density r/s² exp(−r²/2s²).
    """
    ax = _own(ax)
    distance = np.degrees(np.hypot(*fit.residuals))[fit.weight > 0.0] * 3600.0
    _, edges, _ = ax.hist(distance, bins=_BINS, color=_USED, alpha=0.6, label=f"{distance.size} observations")
    s = fit.component_sd_arcsec
    if 0.0 < s < math.inf:
        r = np.linspace(0.0, edges[-1], 200)
        expected = distance.size * (edges[1] - edges[0]) * r / s**2 * np.exp(-(r**2) / (2.0 * s**2))
        ax.plot(r, expected, color="black", label=f"normal, {s:.2f}″ a component")
    ax.set(xlabel="distance, ″", ylabel="observations", ylim=(0.0, None))
    ax.legend(fontsize="small")
    return ax


def plot_map(fit: "Fit", ax: "Axes | None" = None, length_deg: float = _LENGTH_DEG) -> "Axes":
    """Draw an arrow for each observation, from where it was predicted towards where the star was.

    The median residual is `length_deg` long.
    """
    ax = _own(ax)
    run = fit.run
    median = float(np.median(np.hypot(*fit.residuals))) or 1.0
    magnified = math.radians(length_deg) / median
    predicted = np.array(fit.model.star(run.axis1, run.axis2))
    tails = _on_the_map(fit, *predicted)
    tips = _on_the_map(fit, *predicted, *(magnified * fit.residuals))
    for which, colour, name in _groups(fit):
        ax.quiver(
            *tails[:, which], *(tips - tails)[:, which], color=colour, label=name,
            angles="xy", scale_units="xy", scale=1.0, width=0.004,
        )  # fmt: skip
    size = np.degrees(median) * 3600.0
    _horizon(ax)
    ax.set_title(f"residuals; {length_deg:.0f}° on the map is {size:.1f}″", fontsize="medium")
    if np.count_nonzero([which.any() for which, _, _ in _groups(fit)]) > 1:
        ax.legend(fontsize="small", loc="lower right")
    return ax


def plot_error_map(error_map: "ErrorMap", ax: "Axes | None" = None) -> "Axes":
    """Draw the standard deviation of the model's places over the sky, with lines of equal σ."""
    ax = _own(ax)
    azimuth, elevation = np.meshgrid(error_map.azimuth.to_value("rad"), error_map.elevation.to_value("rad"))
    zenith_distance = np.degrees(math.pi / 2.0 - elevation)
    sigma = np.ma.masked_invalid(error_map.sigma.to_value("arcsec"))
    x, y = zenith_distance * np.sin(azimuth), zenith_distance * np.cos(azimuth)
    filled = ax.contourf(x, y, sigma, levels=10, cmap="viridis")
    bar = ax.figure.colorbar(filled, ax=ax)
    bar.set_label("σ of the place, ″")
    _horizon(ax, over=True)
    ax.set_title("predicted error", fontsize="medium")
    return ax


def plot_choice(path: "Sequence[Step]", ax: "Axes | None" = None) -> "Axes":
    """Draw how a choice of terms went: what each step leaves in the run, and in patches left out of it.

    Parameters
    ----------
    path : sequence of Step
        Of `pointing.model.choice`.
    ax : Axes, optional
        Where to draw.
    """
    ax = _own(ax)
    steps = np.arange(len(path))
    ax.plot(steps, [step.sky_rms_arcsec for step in path], "o-", color=_USED, label="of the run")
    ax.plot(steps, [step.cv_sky_rms_arcsec for step in path], "s-", color=_BEYOND, label="of patches left out")
    ax.set_xticks(steps, [f"{_SIGNS[step.action]}{step.term}" for step in path], rotation=90)
    ax.set(ylabel="sky RMS, ″", ylim=(0.0, None))
    ax.legend(fontsize="small")
    return ax


def plot_nights(
    nights: "Nights",
    name: str,
    alone: "Sequence[Fit]" = (),
    ax: "Axes | None" = None,
    at: Any = None,  # noqa: ANN401
) -> "Axes":
    """Draw one coefficient over the runs of `fit_nights` as all of them together tell it, and in the next run.

    Parameters
    ----------
    nights : Nights
        The runs together.
    name : str
        The term.
    alone : sequence of Fit
        Fits of the single runs, drawn beside it with their standard deviations.
    ax : Axes, optional
        Where to draw.
    at : sequence, optional
        Abscissae of the runs and of the next one, such as dates; by default they are counted.

    Raises
    ------
    KeyError
        It is no term of these nights.
    PointingError
        matplotlib is not installed.
    """
    following = nights[name]
    ax = _own(ax)
    each = [_told(nights.of_run(run), name) for run in range(nights.runs)]
    each.append((following.arcsec, following.sigma_arcsec))
    x = np.arange(nights.runs + 1) if at is None else np.asarray(at)
    value, sigma = np.array(each).T
    ax.fill_between(x[:-1], (value - sigma)[:-1], (value + sigma)[:-1], color=_USED, alpha=0.25, linewidth=0.0)
    ax.plot(x[:-1], value[:-1], color=_USED, label="all runs together, ±σ")
    ax.errorbar(x[-1:], value[-1:], sigma[-1:], color=_USED, fmt="D", capsize=3.0, label="next run")
    if alone:
        own = np.array([_told(fit.prediction, name) for fit in alone]).T
        ax.errorbar(x[: len(alone)], own[0], own[1], color=_BEYOND, fmt="o", capsize=2.0, label="each run alone, ±σ")
    ax.set(xlabel="run" if at is None else "", ylabel=f"{name.upper()}, ″")
    ax.legend(fontsize="small")
    return ax


def _told(prediction: "Prediction", name: str) -> tuple[float, float]:
    """A coefficient of a prediction with its standard deviation, arcseconds."""
    i = [each.name for each in prediction.model.terms].index(name.upper())
    free = sum(prediction.free[:i])
    sigma = math.sqrt(prediction.covariance[free, free]) if prediction.free[i] else 0.0
    return math.degrees(prediction.model.coefficients[i]) * 3600.0, math.degrees(sigma) * 3600.0


def _pyplot() -> Any:  # noqa: ANN401 - a module
    try:
        import matplotlib.pyplot as plt  # noqa: PLC0415 - an extra, and only for a figure of one's own
    except ImportError:
        raise PointingError("drawing needs matplotlib: pip install 'clockdrive[plots]'") from None
    return plt


def _own(ax: "Axes | None") -> "Axes":
    """The given axes, or those of a new figure."""
    if ax is not None:
        return ax
    new: Axes = _pyplot().subplots(layout="constrained")[1]
    return new


def _groups(fit: "Fit") -> list[tuple[NDArray[np.bool_], str, str]]:
    """Observations to be told apart: (which, colour, name)."""
    used, beyond = fit.weight > 0.0, fit.run.beyond
    both = (
        (used & ~beyond, _USED, "used" if not beyond.any() else "normal"),
        (used & beyond, _BEYOND, "beyond the pole"),
        (~used, _MASKED, "masked"),
    )
    return [group for group in both if group[0].any()]


def _dots(ax: "Axes", x: Array, y: Array, colour: str, label: str) -> None:
    size = 6.0 if _MARKERS[colour] == "." else 4.0
    ax.plot(x, y, linestyle="none", marker=_MARKERS[colour], markersize=size, color=colour, label=label)


def _component_label(fit: "Fit", component: str) -> str:
    first, second = DIRECTIONS[fit.run.mount]
    direction = first if component == "dX" else second
    turned = " in normal posture" if fit.run.beyond.any() else ""
    return f"{component}, {direction}{turned}, ″"


def _abscissa(fit: "Fit", against: str) -> tuple[str, Array]:
    """Label and values of what the residuals are drawn against: places of the star on the sky, degrees."""
    run = fit.run
    names = COORDINATES[run.mount]
    if against == "order":
        return "observation", np.arange(len(run), dtype=float)
    if against == "zenith distance":
        return "zenith distance, °", np.degrees(fit.model.frame.place(run.star1, run.star2).angle("Z")[0])
    if against == "axis 1":
        wrap = 360.0 if run.mount == "altazimuth" else 0.0
        turned = np.degrees(np.arctan2(np.sin(run.star1), np.cos(run.star1)))
        return f"{names[0]}, °", np.where(turned < 0.0, turned + wrap, turned)
    return f"{names[1]}, °", np.degrees(run.star2)


def _on_the_map(fit: "Fit", lon: Array, lat: Array, dx: Any = 0.0, dy: Any = 0.0) -> Array:  # noqa: ANN401
    """Map coordinates (2, n), degrees from the zenith, of mechanical places displaced by dx, dy on the sky."""
    s1, c1, s2, c2 = np.sin(lon), np.cos(lon), np.sin(lat), np.cos(lat)
    v = np.array([c2 * c1 - dx * s1 - dy * s2 * c1, c2 * s1 + dx * c1 - dy * s2 * s1, s2 + dy * c2])
    v /= np.linalg.norm(v, axis=0)
    place = fit.model.frame.place(np.arctan2(v[1], v[0]), np.arcsin(np.clip(v[2], -1.0, 1.0)))
    azimuth, zenith_distance = math.pi - _south_azimuth(place), np.degrees(place.angle("Z")[0])
    return np.array([zenith_distance * np.sin(azimuth), zenith_distance * np.cos(azimuth)])


def _south_azimuth(place: Place) -> Array:
    return np.asarray(place.angle("A")[0])


def _horizon(ax: "Axes", *, over: bool = False) -> None:
    """Circles of elevation and the points of the compass, under what is drawn or over it; no frame."""
    angle = np.linspace(0.0, math.tau, 181)
    for elevation in (0.0, 30.0, 60.0):
        radius, colour = 90.0 - elevation, "white" if over and elevation else "grey"
        ax.plot(radius * np.sin(angle), radius * np.cos(angle), color=colour, linewidth=0.5, zorder=3 * over)
        ax.annotate(f"{elevation:.0f}°", (0.0, -radius), fontsize="small", color=colour)
    for name, x, y in (("N", 0, 97), ("E", 97, 0), ("S", 0, -97), ("W", -97, 0)):
        ax.annotate(name, (x, y), ha="center", va="center")
    ax.set(xlim=(-103.0, 103.0), ylim=(-103.0, 103.0), aspect="equal")
    ax.set_axis_off()
