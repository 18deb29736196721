"""The drawings show what they are of: as many marks as observations, labels with units, lengths to scale."""

import math
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver
from simulated_runs import TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model import plots
from pointing.model.error_map import error_map
from pointing.model.fit import fit
from pointing.model.nights import fit_nights
from pointing.model.run import PointingRun

mpl.use("Agg")


@pytest.fixture
def ax():
    return Figure().add_subplot()


def fitted(mount="fork", mask=(), latitude_deg=40.0):
    run = simulated_run(mount, latitude_deg, TRUTH[mount], 50, np.random.default_rng(8)).run.masked(mask)
    return fit(run, " ".join(TRUTH[mount]))


def marks(ax):
    return sum(len(line.get_xdata()) for line in ax.lines if line.get_linestyle() == "None")


def test_the_nine_panels_show_every_observation_in_each():
    axes = Figure().subplots(3, 3)
    assert fitted(mask=[3, 7]).plot_residuals(axes) is not None
    assert [marks(ax) for ax in axes.flat] == [50] * 9
    assert [ax.get_ylabel() for ax in axes[:, 0]] == ["dX, west, ″", "dY, north, ″", "dX, west, ″"]
    below = ["hour angle, °", "declination, °", "zenith distance, °"]
    assert [ax.get_xlabel() for ax in axes.flat] == [*below, *below, "observation", "observation", "dX, west, ″"]


def test_a_panel_of_an_altazimuth_mount_has_its_coordinates_and_true_zenith_distances(ax):
    found = fitted("altazimuth")
    assert plots.plot_against(found, "dY", "zenith distance", ax) is ax
    assert ax.get_ylabel() == "dY, up, ″"
    line = ax.lines[0]
    assert np.allclose(np.degrees(found.run.star2) + line.get_xdata(), 90.0)
    assert np.allclose(line.get_ydata() * math.radians(1 / 3600), found.residuals[1])
    other = Figure().add_subplot()
    plots.plot_against(found, "dX", "axis 1", other)
    assert other.get_xlabel() == "azimuth, °"
    assert 0.0 <= other.lines[0].get_xdata().min() <= other.lines[0].get_xdata().max() < 360.0


def test_the_sides_of_a_pier_and_what_is_masked_are_told_apart(ax):
    found = fitted("german", mask=[0, 1])
    plots.plot_scatter(found, ax)
    counts = {line.get_label(): len(line.get_xdata()) for line in ax.lines if line.get_linestyle() == "None"}
    beyond = int(np.count_nonzero(found.run.beyond[2:]))
    assert counts == {"normal": 48 - beyond, "beyond the pole": beyond, "masked": 2}
    assert ax.get_xlabel() == "dX, west in normal posture, ″"


def test_the_scatter_has_a_circle_of_the_sky_rms(ax):
    found = fitted()
    plots.plot_scatter(found, ax)
    circle = next(line for line in ax.lines if line.get_linestyle() != "None")
    assert np.allclose(np.hypot(*circle.get_data()), found.sky_rms_arcsec)
    assert circle.get_label() == f"sky RMS {found.sky_rms_arcsec:.2f}″"


def test_the_histogram_counts_every_used_observation_and_expects_as_many(ax):
    found = fitted(mask=[3, 7])
    plots.plot_histogram(found, ax)
    assert sum(bar.get_height() for bar in ax.patches) == 48
    x, y = ax.lines[0].get_data()
    expected = np.sum((y[1:] + y[:-1]) / 2 * np.diff(x)) / ax.patches[0].get_width()
    print(f"{expected:.1f} of 48 expected up to the farthest")
    assert expected == pytest.approx(48, abs=3)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("distance, ″", "observations")


@pytest.mark.parametrize(("mount", "latitude_deg"), [("fork", 40.0), ("german", -35.0), ("altazimuth", 20.0)])
def test_the_map_has_an_arrow_for_each_observation_at_its_azimuth_and_elevation(ax, mount, latitude_deg):
    found = fitted(mount, [5], latitude_deg)
    plots.plot_map(found, ax)
    arrows = [each for each in ax.collections if isinstance(each, Quiver)]
    assert sum(each.N for each in arrows) == 50
    tails = np.concatenate([each.get_offsets() for each in arrows])
    lengths = np.concatenate([np.hypot(each.U, each.V) for each in arrows])
    run = found.run
    order = np.concatenate([np.flatnonzero(each) for each, _, _ in plots._groups(found)])
    expected = horizon(run, latitude_deg)[order]
    assert np.max(np.hypot(*(tails - expected).T)) < 0.5  # degrees; the terms are minutes of arc
    assert np.median(lengths) == pytest.approx(10.0, rel=0.2)  # the map stretches along azimuth: 1.2 at 30°
    assert {text.get_text() for text in ax.texts} >= {"N", "E", "S", "W", "30°"}
    assert f"{np.median(np.degrees(np.hypot(*found.residuals))) * 3600:.1f}″" in ax.get_title()


def horizon(run, latitude_deg):
    """Map places of the stars from spherical trigonometry."""
    if run.mount == "altazimuth":
        azimuth, altitude = run.star1, run.star2
    else:
        s, c = math.sin(math.radians(latitude_deg)), math.cos(math.radians(latitude_deg))
        h, d = run.star1, run.star2
        altitude = np.arcsin(s * np.sin(d) + c * np.cos(d) * np.cos(h))
        azimuth = np.arctan2(-np.cos(d) * np.sin(h), c * np.sin(d) - s * np.cos(d) * np.cos(h))
    z = 90.0 - np.degrees(altitude)
    return np.column_stack([z * np.sin(azimuth), z * np.cos(azimuth)])


def test_an_arrow_points_to_where_the_star_was(ax):
    """A star displaced to the north of an altazimuth mount's southern sky, upwards: its arrow goes to the zenith."""
    azimuth, elevation = np.radians([180.0, 0.0, 90.0]), np.radians([40.0, 40.0, 40.0])
    up = math.radians(5.0 / 3600.0)
    run = PointingRun("altazimuth", 0.5, azimuth, elevation + up, azimuth, elevation)
    plots.plot_map(fit(run, "IA IE", fixed={"IA": 0.0, "IE": 0.0}), ax)
    arrows = next(each for each in ax.collections if isinstance(each, Quiver))
    assert np.allclose(arrows.get_offsets(), [(0.0, -50.0), (0.0, 50.0), (50.0, 0.0)], atol=1e-6)
    assert np.allclose(np.column_stack([arrows.U, arrows.V]), [(0.0, 10.0), (0.0, -10.0), (-10.0, 0.0)], atol=0.1)


def test_the_error_map_is_labelled_in_arcseconds_and_spans_its_values():
    figure = Figure()
    ax = figure.add_subplot()
    shown = error_map(fitted(), step_deg=15.0)
    assert plots.plot_error_map(shown, ax) is ax
    bar = next(each for each in figure.axes if each is not ax)
    assert bar.get_ylabel() == "σ of the place, ″"
    low, high = ax.collections[0].get_clim()
    assert low <= shown.sigma.value.min() * 1.2
    assert high >= shown.sigma.value.max() * 0.9


@dataclass
class Taken:
    action: str
    term: str
    sky_rms_arcsec: float
    cv_sky_rms_arcsec: float


def test_the_path_of_a_choice_shows_both_residuals_of_each_step(ax):
    steps = ("begun with", "IH ID", 90.0, 95.0), ("taken", "CH", 40.0, 45.0), ("dropped", "ME", 41.0, 44.0)
    path = [Taken(*step) for step in steps]
    plots.plot_choice(path, ax)
    assert [list(line.get_ydata()) for line in ax.lines] == [[90.0, 40.0, 41.0], [95.0, 45.0, 44.0]]
    assert [label.get_text() for label in ax.get_xticklabels()] == ["IH ID", "+CH", "−ME"]
    assert ax.get_ylabel() == "sky RMS, ″"


def test_a_coefficient_over_the_nights_is_drawn_with_what_each_run_says_alone_and_with_the_next(ax):
    rng = np.random.default_rng(8)
    runs = [simulated_run("fork", 40.0, TRUTH["fork"] | {"ME": 200.0 + i}, 20, rng).run for i in range(5)]
    names = " ".join(TRUTH["fork"])
    nights, alone = fit_nights(runs, names), [fit(run, names) for run in runs]
    plots.plot_nights(nights, "me", alone, ax)
    together, following, own = (line.get_ydata() for line in ax.lines if line.get_marker() != "_")
    assert together == pytest.approx([nights.of_run(i).model.arcsec["ME"] for i in range(5)], abs=1e-9)
    assert following == pytest.approx([nights["ME"].arcsec])
    assert own == pytest.approx([each["ME"].arcsec for each in alone])
    bars = ax.containers[-1].lines[2][0].get_segments()
    sigma = [math.sqrt(each.covariance[5, 5]) / math.radians(1 / 3600) for each in alone]
    assert [np.ptp(bar[:, 1]) / 2.0 for bar in bars] == pytest.approx(sigma)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("run", "ME, ″")
    with pytest.raises(KeyError, match="TX is no term of these nights"):
        plots.plot_nights(nights, "TX")


def test_given_axes_leave_the_figures_of_pyplot_alone():
    import matplotlib.pyplot as plt

    before = plt.get_fignums()
    figure = Figure()
    found = fitted()
    found.plot_residuals(figure.subplots(3, 3))
    plots.plot_map(found, Figure().add_subplot())
    plots.plot_histogram(found, Figure().add_subplot())
    plots.plot_error_map(error_map(found, 30.0), Figure().add_subplot())
    assert plt.get_fignums() == before
    ax = plots.plot_scatter(found)
    assert len(plt.get_fignums()) == len(before) + 1
    plt.close(ax.figure)


def test_what_cannot_be_drawn_is_refused():
    with pytest.raises(PointingError, match=r"3 × 3 axes, these are \(2,\)"):
        fitted().plot_residuals(Figure().subplots(1, 2))
    with pytest.raises(PointingError, match="possible are dX, dY against axis 1"):
        plots.plot_against(fitted(), "dZ", "axis 1", Figure().add_subplot())


def test_without_matplotlib_a_sentence_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "matplotlib.pyplot", None)
    with pytest.raises(PointingError, match=r"pip install 'clockdrive\[plots\]'"):
        fitted().plot_residuals()
