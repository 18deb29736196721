"""Terms that cannot be told apart, by any observation or by those of a run: each is named, and none is invented."""

import math
from itertools import combinations

import numpy as np
import pytest

from pointing import own_term
from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.place import Frame, MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.model.terms import NAMED, terms

SETS: dict[MountKind, list[str]] = {
    "equatorial": ["NP HCEC DAF", "ME FO DNP", "TX TX10"],
    "altazimuth": ["IE FLOP", "TF ECEC", "IA ECES NRX", "NPAE ECEC NRY", "NPAE TF NRY", "TX TX10"],
}
ALIASES = {
    "equatorial": "HCES=HHSH HCEC=HHCH DCES=HDSD DCEC=HDCD FO=HDCH HF=HXSH DNP=HPSH X2HC=HXCH2 TF=HZSZ",
    "altazimuth": "TF=HZSZ ACES=HASA ACEC=HACA ECES=HESE ECEC=HECE HZSZ2=HESE2 HZSZ3=HECE3",
}
REFUSED = [(kind, names) for kind, sets in SETS.items() for names in sets]
REFUSED += [(kind, pair.replace("=", " ")) for kind, pairs in ALIASES.items() for pair in pairs.split()]


def sky(kind: MountKind, n: int, *, sides: int = 2, seed: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Mechanical places above 20° at latitude 40°, on one or on both sides of the pier."""
    rng = np.random.default_rng(seed)
    azimuth, elevation = rng.uniform(-math.pi, math.pi, n), np.arcsin(rng.uniform(math.sin(0.35), 0.995, n))
    lon, lat = azimuth, elevation
    if kind == "equatorial":
        place = Frame("altazimuth", math.radians(40.0)).place(azimuth, elevation)
        lon, lat = place.angle("H")[0], place.angle("D")[0]
    other = (np.arange(n) % 2 == 0) & (sides == 2)
    return np.where(other, lon + math.pi, lon), np.where(other, math.pi - lat, lat)


def run_at(kind: MountKind, lon: np.ndarray, lat: np.ndarray, scatter: float = 1e-5, **arcsec: float) -> PointingRun:
    """What a telescope with these errors reads at mechanical places, with scatter in radians."""
    rng = np.random.default_rng(1)
    star1, star2 = PointingModel.of(kind, 40.0, **arcsec).star(lon, lat)
    star1, star2 = (
        star1 + scatter * rng.normal(size=lon.size) / np.cos(lat),
        star2 + scatter * rng.normal(size=lon.size),
    )
    return PointingRun(kind, math.radians(40.0), star1, star2, lon, lat)


@pytest.mark.parametrize("kind", ["equatorial", "altazimuth"])
def test_the_sets_are_all_that_there_are_among_the_named_terms_and_each_is_one(kind):
    listed = [each for each in NAMED if kind in each.mounts]
    lon, lat = sky(kind, 400, seed=77)
    model = PointingModel(kind, math.radians(40.0), tuple(listed), (0.0,) * len(listed))
    _, _, jacobian = model.star_and_jacobian(lon, lat)
    design = np.array([np.concatenate([part + 0 * lon for part in pair]) for pair in jacobian.by_coefficient]).T
    design /= np.linalg.norm(design, axis=0)

    def dependent(columns) -> bool:
        return np.linalg.svd(design[:, list(columns)], compute_uv=False)[-1] < 1e-12

    found: list[frozenset[int]] = []
    for size in (2, 3, 4):
        for columns in map(frozenset, combinations(range(len(listed)), size)):
            if not any(one <= columns for one in found) and dependent(columns):
                found.append(columns)
    assert {frozenset(listed[i].name for i in columns) for columns in found} == {
        frozenset(names.split()) for names in SETS[kind]
    }
    # and no larger set: those found leave as many directions unseen as all the terms together
    singular = np.linalg.svd(design, compute_uv=False)
    unseen = []
    for columns in found:
        vector = np.zeros(len(listed))
        vector[list(columns)] = np.linalg.svd(design[:, list(columns)])[2][-1]
        unseen.append(vector)
    print(kind, "singular values", singular[-8:])
    assert np.sum(singular < 1e-12) == np.linalg.matrix_rank(unseen, tol=1e-9)
    assert singular[singular > 1e-12].min() > 0.05


@pytest.mark.parametrize(("kind", "names"), REFUSED)
def test_a_degenerate_set_is_refused_by_name_whatever_stands_beside_it(kind, names):
    run = run_at(kind, *sky(kind, 60))
    others = {"equatorial": "IH ID CH MA", "altazimuth": "AN AW CA"}[kind]
    listed = [*names.split(), *(name for name in others.split() if name not in names.split())]
    with pytest.raises(
        PointingError, match=f"^{', '.join(names.split())} cannot be told apart: .* leave one of them"
    ):
        fit(run, " ".join(listed))


@pytest.mark.parametrize(("kind", "names"), REFUSED)
def test_a_set_is_fitted_when_one_of_it_is_left_out_or_held_fixed(kind, names):
    run = run_at(kind, *sky(kind, 60))
    for left_out in names.split():
        rest = [name for name in names.split() if name != left_out]
        assert fit(run, rest).k == len(rest)
        assert fit(run, names, fixed={left_out: 25.0}).k == len(rest)
    assert fit(run, names, fixed=names).k == 0


def test_the_combination_is_told_with_its_factors():
    run = run_at("altazimuth", *sky("altazimuth", 60))
    with pytest.raises(PointingError, match="NRX displaces like IA and −ECES everywhere"):
        fit(run, "IA ECES NRX")
    run = run_at("equatorial", *sky("equatorial", 60))
    with pytest.raises(PointingError, match=r"DAF displaces like −0\.643·NP and −0\.766·HCEC"):  # sin 40°, cos 40°
        fit(run, "NP HCEC DAF")


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        ("equatorial", "IH ID CH NP MA ME TF TX HF HCES HCEC DCES DCEC X2HC FO"),
        ("equatorial", "IH ID CH NP MA ME TF TX HF HCES DCES DCEC X2HC DAF DNP"),
        ("altazimuth", "IA IE CA NPAE AN AW TF TX ACES ACEC ECES"),
        ("altazimuth", "CA AN AW NRX NRY ECES ECEC TX ACES ACEC IE"),
        ("altazimuth", "HZCZ ECES"),  # the same in one posture only
    ],
)
def test_large_sets_of_terms_that_can_be_told_apart_are_fitted(kind, names):
    truth = dict.fromkeys(names.split(), 20.0)
    found = fit(run_at(kind, *sky(kind, 300), scatter=1e-7, **truth), names)
    print(kind, found.condition)
    assert found.model.arcsec == pytest.approx(truth, abs=0.1)


def test_what_tells_terms_apart_beyond_the_zenith_only_is_refused_by_a_run_on_one_side():
    run = run_at("altazimuth", *sky("altazimuth", 60, sides=1))
    with pytest.raises(
        PointingError, match=r"HZCZ, ECES cannot be told apart by these 60 observations: .*both sides"
    ):
        fit(run, "HZCZ ECES IE")


def test_stars_at_one_elevation_do_not_tell_index_collimation_and_non_perpendicularity_apart():
    lon, _ = sky("altazimuth", 40)
    run = run_at("altazimuth", lon, np.full(40, 0.8), IA=100.0)
    with pytest.raises(PointingError, match=r"^IA, CA, NPAE cannot be told apart by these 40 observations"):
        fit(run, "IA IE CA NPAE AN AW")
    assert fit(run, "IA IE AN AW").k == 4


def test_stars_at_one_declination_do_not_tell_index_collimation_and_non_perpendicularity_apart():
    lon, _ = sky("equatorial", 40)
    run = run_at("equatorial", lon, np.full(40, 0.4))
    with pytest.raises(PointingError, match=r"^IH, CH, NP cannot be told apart by these 40 observations"):
        fit(run, "IH ID CH NP")


def test_one_side_of_the_pier_hardly_tells_collimation_from_the_index_and_both_sides_do():
    names = "IH ID CH NP MA ME"
    one, both = (fit(run_at("equatorial", *sky("equatorial", 400, sides=sides)), names) for sides in (1, 2))
    sigma = [found["CH"].sigma_arcsec for found in (one, both)]
    correlation = [found.correlation[0, 2] for found in (one, both)]
    print(f"condition {one.condition:.1f} and {both.condition:.1f}, σ(CH) {sigma}, correlation {correlation}")
    assert one.condition > 10.0
    assert both.condition < 4.0
    assert abs(correlation[0]) > 0.95
    assert abs(correlation[1]) < 0.2


def test_a_term_without_effect_on_a_run_is_named():
    corner = own_term("corner", "D", lambda h, d: np.maximum(h - 2.0, 0.0) + 0.0 * d)
    lon, lat = sky("equatorial", 200)
    east = lon < 1.9
    run = run_at("equatorial", lon[east], lat[east])
    with pytest.raises(PointingError, match=rf"CORNER has no effect on any of the {east.sum()} observations"):
        fit(run, ["IH", "ID", corner])


@pytest.mark.parametrize(("latitude_deg", "names"), [(0.0, "HCEC DAF"), (-90.0, "NP DAF"), (90.0, "TF DCEC")])
def test_sets_that_a_latitude_makes_are_refused_there(latitude_deg, names):
    lon, lat = sky("equatorial", 40)
    run = PointingRun("equatorial", math.radians(latitude_deg), lon, lat, lon, lat)
    with pytest.raises(PointingError, match=names.replace(" ", ", ")):
        fit(run, f"IH ID {names}")
    assert len(terms(names, "equatorial")) == 2
