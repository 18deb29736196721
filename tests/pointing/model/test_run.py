"""What a pointing run is, and what it refuses to be."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import ARCSEC, TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun, nearest_turn
from pointing.model.terms import terms

STAR = ([10.0, -170.0, 350.0], [40.0, -20.0, 80.0])


def run(**others):
    return PointingRun.from_degrees(
        "equatorial", 39.0, *STAR, [10.01, -169.99, -10.02], [40.01, -20.01, 80.0], **others
    )


def test_what_is_not_given_has_its_neutral_value():
    made = run()
    assert len(made) == 3
    assert made.weight.tolist() == [1.0] * 3
    assert made.kept.all()
    assert np.isnan(made.time).all()
    assert made.auxiliary.shape == (3, 0)
    assert made.line.tolist() == [0] * 3


@pytest.mark.parametrize("mount", ["fork", "german", "altazimuth"])
def test_stars_are_apart_from_where_a_model_points_by_what_was_added_to_them(mount):
    rng = np.random.default_rng(31)
    made = simulated_run(mount, 40.0, TRUTH[mount], 60, rng, noise_arcsec=0.0).run
    coefficients = tuple(ARCSEC * value for value in TRUTH[mount].values())
    model = PointingModel(made.mount, made.latitude, terms(list(TRUTH[mount]), made.mount), coefficients)
    for arcsec in (0.0, 2.0, 7200.0):
        moved = replace(made, star2=made.star2 + arcsec * ARCSEC)  # along a great circle
        apart = moved.separations(model).to_value("arcsec")
        print(f"{mount}: moved by {arcsec:g}″, apart by {apart.min():.4f}″ to {apart.max():.4f}″")
        assert apart == pytest.approx(np.full(60, arcsec), abs=1e-5)


def test_no_array_can_be_changed_behind_its_back():
    given = np.zeros(2)
    made = PointingRun("altazimuth", 0.5, given, given, given, given)
    given[0] = 1.0
    assert made.star1[0] == 0.0
    for name in ("star1", "axis2", "weight", "kept", "auxiliary"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(made, name)[...] = 1


@pytest.mark.parametrize(("latitude", "axis2"), [(39.0, 109.0), (-39.0, -109.0), (39.0, -177.5), (-39.0, 177.5)])
def test_beyond_the_pole_the_star_is_half_a_turn_away_and_mirrored(latitude, axis2):
    """The same place of the sky through either posture: a rotation by axis 1 and axis 2 tells."""
    declination = math.degrees(math.asin(math.sin(math.radians(axis2))))
    made = PointingRun.from_degrees("equatorial", latitude, [30.0], [declination], [-150.0], [axis2])
    assert made.beyond.tolist() == [True]
    star1, star2 = made.mechanical_star()
    for h, d in ((made.star1, made.star2), (star1, star2)):
        place = np.array([np.cos(d) * np.cos(h), -np.cos(d) * np.sin(h), np.sin(d)])
        assert place == pytest.approx(
            np.array([np.cos(made.star2) * np.cos(made.star1), -np.cos(made.star2) * np.sin(made.star1), [0]])
            + np.array([[0], [0], np.sin(made.star2)]), abs=1e-15,
        )  # fmt: skip
    assert np.abs(made.offsets()).max() < 1e-14


def test_offsets_are_star_minus_telescope_whatever_the_turn():
    first, second = np.degrees(run().offsets())
    assert first == pytest.approx([-0.01, -0.01, 0.02], abs=1e-12)
    assert second == pytest.approx([-0.01, 0.01, 0.0], abs=1e-12)
    assert nearest_turn(np.array([math.pi, -math.pi, 3 * math.tau + 0.1])) == pytest.approx([-math.pi, -math.pi, 0.1])


def test_masks_add_up_and_a_subset_takes_every_column_along():
    made = run(weight=np.array([1.0, 2.0, 3.0]), auxiliary=np.array([[1.0], [2.0], [3.0]]), line=np.array([5, 6, 7]))
    masked = made.masked([0]).masked([2])
    assert masked.kept.tolist() == [False, True, False]
    assert made.kept.all()
    last = masked.subset([False, False, True])
    assert (last.weight.tolist(), last.auxiliary.tolist(), last.line.tolist()) == ([3.0], [[3.0]], [7])
    assert last.kept.tolist() == [False]
    assert made == run(weight=made.weight, auxiliary=made.auxiliary, line=made.line)
    assert made != masked


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: run(weight=np.array([1.0, -1.0, 1.0])), "weight -1; possible are numbers from 0"),
        (lambda: run(line=np.array([1, 2])), "line has shape (2,); star1 has 3 observations"),
        (lambda: run().masked([3]), "observation 3; the run has 3, counted from 0"),
        (lambda: run().masked([-1]), "observation -1"),
        (lambda: run().subset([True]), "a mask of shape (1,); the run has 3"),
        (
            lambda: PointingRun("fork", 0.0, *[np.zeros(1)] * 4),
            "mount 'fork'; possible are equatorial and altazimuth",
        ),
        (lambda: PointingRun("equatorial", 39.0, *[np.zeros(1)] * 4), "latitude 2234.535"),
        (lambda: PointingRun("equatorial", math.nan, *[np.zeros(1)] * 4), "latitude nan"),
        (lambda: PointingRun("equatorial", 0.0, np.array([math.inf]), *[np.zeros(1)] * 3), "star1[0] is inf"),
    ],
)
def test_what_cannot_be_is_refused_with_value_and_bound(make, said):
    with pytest.raises(PointingError) as refused:
        make()
    assert said in str(refused.value)


def test_shows_itself_as_a_sentence_and_as_a_table():
    made = run(caption="<first>").masked([1])
    assert repr(made) == (
        "PointingRun('<first>', equatorial, latitude 39.0000°, 3 observations, 0 beyond the pole, 1 masked)"
    )
    html = made._repr_html_()
    assert "&lt;first&gt;" in html
    assert html.count("<tr>") == 4
    assert html.count("masked") == 2
