"""The rigid terms of a model in closed form are the motions of its terms one after the other."""

import math

import numpy as np
import pytest

from pointing.model.place import Frame, Place
from pointing.model.pointing_model import PointingModel
from pointing.model.terms import Term, terms

RIGID = {"equatorial": "IH ID CH NP MA ME", "altazimuth": "IA IE FLOP CA NPAE AN AW"}
SIZE = math.radians(0.5)


def one_after_the_other(model: PointingModel, lon, lat) -> tuple:
    """The terms' own motions, as `pointing.model.results` has them."""
    place = Place(Frame(model.kind, model.latitude), lon, lat)
    for each, coefficient in sorted(zip(model.terms, model.coefficients, strict=True), key=lambda pair: pair[0].rank):
        place = each.forward(place, coefficient)
    return place.lon, place.lat


def places(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Wound in both coordinates, in both postures, to within 1° of the pole."""
    rng = np.random.default_rng(seed)
    lat = np.radians(rng.uniform(-89.0, 89.0, 500))
    return rng.uniform(-9.0, 9.0, 500), np.where(rng.random(500) < 0.5, math.pi - lat, lat)


@pytest.mark.parametrize("kind", RIGID)
@pytest.mark.parametrize("more", ["", " TF"])
@pytest.mark.parametrize("seed", range(4))
def test_all_rigid_terms_at_once_are_their_motions_one_after_the_other(kind, more, seed):
    listed = terms(RIGID[kind] + more, kind)
    drawn = np.random.default_rng(seed).uniform(-SIZE, SIZE, len(listed))
    drawn[np.random.default_rng(seed + 50).random(len(listed)) < 0.3] = 0.0  # terms without a coefficient
    model = PointingModel(kind, 0.6, listed, tuple(drawn.tolist()))
    lon, lat = places(seed)
    found, expected = model.star(lon, lat), one_after_the_other(model, lon, lat)
    worst = max(
        np.max(np.abs(np.cos(lat) * np.sin((found[0] - expected[0]) / 2.0))), np.max(np.abs(found[1] - expected[1]))
    )
    single = np.array([model.star(float(a), float(b)) for a, b in zip(lon[:50], lat[:50], strict=True)]).T
    print(f"{kind}{more}: {worst:.1e} rad; floats and arrays {np.max(np.abs(single - np.array(found)[:, :50])):.1e}")
    assert worst < 5e-15
    assert np.max(np.abs(single - np.array(found)[:, :50])) < 5e-15


def test_two_collimations_are_applied_one_after_the_other_and_not_summed():
    listed = (Term("CH", "X"), Term("CH2", "X", own=True))
    model = PointingModel("equatorial", 0.6, listed, (SIZE, 2.0 * SIZE))
    lon, lat = places(9)
    found, expected = model.star(lon, lat), one_after_the_other(model, lon, lat)
    summed = PointingModel("equatorial", 0.6, listed[:1], (3.0 * SIZE,)).star(lon, lat)
    assert np.max(np.abs(np.array(found) - expected)) < 5e-14
    assert np.max(np.abs(np.array(found) - summed)) > 1e-6
