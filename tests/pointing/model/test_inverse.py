"""Star to telescope undoes telescope to star: each term and all together, to 1′ from pole and zenith, for degrees."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError, Unreachable
from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.terms import NAMED, Term, term, terms

ARCSEC = math.radians(1.0 / 3600.0)
KINDS: tuple[MountKind, MountKind] = ("equatorial", "altazimuth")
BY_KIND = {kind: [each for each in NAMED if kind in each.mounts] for kind in KINDS}
GENERIC = {
    "equatorial": "HXCH3 HHSA HDSQ HUSH HLCD2 HPCA PZZ3 PHH2 PXD HZCZ",
    "altazimuth": "HESA2 HACA3 HSSE HVCH PZZ1 HNSA HZCZ",
}
ALL = [(kind, each.name) for kind in KINDS for each in BY_KIND[kind] if each.name != "TX10"]
ALL += [(kind, name) for kind in KINDS for name in GENERIC[kind].split()]


def distance(one, other) -> np.ndarray:
    """Between two lists of places, arcseconds."""
    a, b = (np.array([np.cos(y) * np.cos(x), np.cos(y) * np.sin(x), np.sin(y)]) for x, y in (one, other))
    return np.linalg.norm(a - b, axis=0) / ARCSEC


def to_the_pole(nearest_deg: float = 1.0 / 60.0) -> tuple[np.ndarray, np.ndarray]:
    """All round, in both postures, ever denser towards the poles of axis 1."""
    off = np.geomspace(nearest_deg, 90.0, 13)
    lat = np.radians(np.concatenate((90.0 - off, off[::3] - 90.0, 90.0 + off, -90.0 - off[::3])))
    lon = np.radians(np.arange(-180.0, 180.0, 38.7))
    return tuple(part.ravel() for part in np.meshgrid(lon, lat))


def above(kind: MountKind, phi: float, places: tuple[np.ndarray, np.ndarray], least_deg: float):
    lon, lat = places
    sine = (
        np.sin(phi) * np.sin(lat) + np.cos(phi) * np.cos(lat) * np.cos(lon) if kind == "equatorial" else np.sin(lat)
    )
    up = sine > math.sin(math.radians(least_deg))
    return lon[up], lat[up]


@pytest.mark.parametrize("latitude_deg", [38.0, -31.0])
@pytest.mark.parametrize(("kind", "name"), ALL)
def test_a_telescope_set_by_a_term_points_on_the_star_to_1_arcmin_from_the_pole_for_degrees_too(
    kind, name, latitude_deg
):
    phi = math.radians(latitude_deg)
    lon, lat = to_the_pole()
    worst = 0.0
    for coefficient in (30 * ARCSEC, -300 * ARCSEC, math.radians(2.0)):
        model = PointingModel(kind, phi, (term(name, kind),), (coefficient,))
        star = model.star(lon, lat)
        back = model.telescope(*star)
        worst = max(worst, float(np.max(distance(model.star(*back), star))))  # nan where none is found
    print(f"{kind} {name}: {worst:.1e}″")
    assert worst < 1e-6


@pytest.mark.parametrize("latitude_deg", [38.0, -31.0])
@pytest.mark.parametrize(("kind", "name"), ALL)
def test_the_telescope_comes_back_to_where_it_was_where_one_place_alone_leads_to_the_star(kind, name, latitude_deg):
    phi = math.radians(latitude_deg)
    worst = 0.0
    for coefficient in (10 * ARCSEC, -10 * ARCSEC, 3600 * ARCSEC):
        nearest_deg = max(1.0 / 60.0, 12.0 * math.degrees(coefficient))  # four folds of a term in 3h, and a margin
        lon, lat = to_the_pole(nearest_deg)
        z = np.arccos(np.sin(phi) * np.sin(lat) + np.cos(phi) * np.cos(lat) * np.cos(lon))
        apart = (z > math.radians(nearest_deg)) & (z < math.pi - math.radians(nearest_deg))
        if kind == "equatorial":  # about the zenith, where A and Q turn
            lon, lat = lon[apart], lat[apart]
        if name[:2] in {"TX", "PZ"}:
            lon, lat = above(kind, phi, (lon, lat), 1.0 if abs(coefficient) < 1e-3 else 10.0)
        model = PointingModel(kind, phi, (term(name, kind),), (coefficient,))
        if name == "PHH2":  # about where H leaps by a turn, and H² by (2π)² at most
            at, middle = model.frame.place(lon, lat), (model.frame.middle[0], model.frame.middle_beyond[0])
            near = np.abs(at.own[0] - np.where(at.beyond, middle[1], middle[0]))
            lon, lat = (each[near < math.pi - math.tau**2 * abs(coefficient)] for each in (lon, lat))
        back = model.telescope(*model.star(lon, lat))
        assert np.max(np.abs(back[1] - lat)) < 0.3  # in the same posture
        worst = max(worst, float(np.max(distance(back, (lon, lat)))))
    print(f"{kind} {name}: {worst:.1e}″")
    assert worst < 1e-6


def test_a_displacement_across_the_zenith_has_no_way_back():
    model = PointingModel("altazimuth", 0.6, terms("HZCZ", "altazimuth"), (300 * ARCSEC,))  # away from the zenith
    with pytest.raises(Unreachable, match="blind spot about the zenith that HZCZ of 300″"):
        model.telescope(0.4, math.pi / 2 - 100 * ARCSEC)
    lon, lat = model.telescope(0.4, math.pi / 2 - 400 * ARCSEC)
    assert distance(model.star(lon, lat), (0.4, math.pi / 2 - 400 * ARCSEC)) < 1e-6


@pytest.mark.parametrize("names", ["CH TF", "CH"])
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_star_at_no_finite_place_is_refused_as_that_and_is_nan_in_an_array(names, bad):
    model = PointingModel.of("equatorial", 38.0, **dict.fromkeys(names.split(), 30.0))
    for lon, lat in ((bad, 0.5), (0.5, bad)):
        for call in (model.telescope, lambda *star: model.telescope_and_rates(*star, 1e-5, 1e-5)):
            with pytest.raises(PointingError, match=r"(nan|inf).*finite angles in radians") as refusal:
                call(lon, lat)
            assert not isinstance(refusal.value, Unreachable)  # waiting does not help
        found = model.telescope(np.array([lon, 0.4]), np.array([lat, 0.5]))
        assert np.isnan(found)[:, 0].all()
        assert tuple(each[1] for each in found) == pytest.approx(model.telescope(0.4, 0.5), abs=1e-12)


def test_the_blind_spot_of_collimation_is_told_and_is_nan_in_an_array():
    model = PointingModel.of("equatorial", 38.0, CH=300.0, NP=40.0, TF=10.0)
    off = np.array([60.0, 200.0, 320.0, 600.0, 3600.0]) * ARCSEC
    lon, lat = model.telescope(np.full(5, 0.3), math.pi / 2 - off)
    assert np.isnan(lon).tolist() == np.isnan(lat).tolist() == [True, True, False, False, False]
    with pytest.raises(Unreachable, match=r"blind spot about the pole of axis 1 that CH of 300″ .*: wait until"):
        model.telescope(0.3, math.pi / 2 - 60 * ARCSEC)
    assert model.telescope(0.3, float(math.pi / 2 - off[3])) == pytest.approx((lon[3], lat[3]), abs=1e-12)


def model_of_all(kind: MountKind, phi: float, size: float, seed: int) -> PointingModel:
    rng = np.random.default_rng(seed)
    listed = tuple(each for each in BY_KIND[kind] if each.name not in {"TX10", "FLOP"})
    return PointingModel(kind, phi, listed, tuple(rng.uniform(-size, size, len(listed))))


@pytest.mark.parametrize("posture", ["normal", "beyond"])
@pytest.mark.parametrize("kind", KINDS)
def test_all_terms_together_close_both_ways_down_to_ten_times_their_size_from_the_pole(kind, posture):
    phi = math.radians(-31.0)
    for size, nearest_deg in ((3 * ARCSEC, 1.0 / 60.0), (60 * ARCSEC, 0.3), (math.radians(0.2), 4.0)):
        lon, lat = above(kind, phi, to_the_pole(nearest_deg), 15.0)
        half = (np.cos(lat) > 0) == (posture == "normal")
        lon, lat = lon[half], lat[half]
        worst = there = 0.0
        for seed in range(3):
            model = model_of_all(kind, phi, size, seed)
            star = model.star(lon, lat)
            back = model.telescope(*star)
            worst = max(worst, float(np.max(distance(back, (lon, lat)))))
            there = max(there, float(np.max(distance(model.star(*back), star))))
        print(f"{kind} {size / ARCSEC:g}″, {nearest_deg * 60:g}′ from the pole: {worst:.1e}″, star {there:.1e}″")
        assert worst < 1e-6
        assert there < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_arrays_give_what_places_one_by_one_give(kind):
    model = model_of_all(kind, 0.6, 60 * ARCSEC, 1)
    lon, lat = (part[::3] for part in above(kind, 0.6, to_the_pole(0.3), 15.0))
    star = model.star(lon, lat)
    for way, places in ((model.star, (lon, lat)), (model.telescope, star)):
        many = np.array(way(*places))
        for i, place in enumerate(zip(*(part.tolist() for part in places), strict=True)):
            assert way(*place) == pytest.approx(many[:, i], abs=1e-12)


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from(KINDS),
    phi=st.floats(-1.5, 1.5),
    seed=st.integers(0, 10_000),
    size=st.floats(1e-6, 2e-3),
    lon=st.floats(-6.0, 6.0),
    lat=st.floats(-1.2, 1.2),
    beyond=st.booleans(),
    chosen=st.integers(1, 2**14 - 1),
)
def test_any_terms_anywhere_close_both_ways(kind, phi, seed, size, lon, lat, beyond, chosen):
    drawn = model_of_all(kind, phi, size, seed)
    pairs = zip(drawn.terms, drawn.coefficients, strict=True)
    pairs = [pair for i, pair in enumerate(pairs) if chosen >> i & 1 and pair[0].name != "TX"]
    model = PointingModel(kind, phi, *(tuple(part) for part in zip(*pairs, strict=True))) if pairs else drawn
    lon, lat = (lon + math.pi, math.pi - lat) if beyond else (lon, lat)
    star = model.star(lon, lat)
    back = model.telescope(*star)
    assert distance(model.star(*back), star) < 1e-6
    if "TX" not in {each.name for each in model.terms}:
        assert distance(back, (lon, lat)) < 1e-6


def richardson(function, x: float, step: float = 2e-3) -> np.ndarray:
    """Derivative by central differences at two steps, their error of second order removed, then of fourth."""
    d = [(np.array(function(x + h)) - np.array(function(x - h))) / (2 * h) for h in (step, step / 2, step / 4)]
    first = [(4 * b - a) / 3 for a, b in pairwise(d)]
    return (16 * first[1] - first[0]) / 15


@pytest.mark.parametrize("posture", ["normal", "beyond"])
@pytest.mark.parametrize(("kind", "name"), ALL)
def test_the_jacobian_is_the_derivative_by_coefficient_and_by_place(kind, name, posture):
    rng = np.random.default_rng(2)
    lon, lat = above(kind, 0.6, (rng.uniform(-3, 3, 300), rng.uniform(-1.3, 1.3, 300)), 15.0)
    if posture == "beyond":
        lon, lat = lon + math.pi, math.pi - lat
    listed = (term("IH" if kind == "equatorial" else "IA", kind), term(name, kind))
    listed = listed[1:] if listed[0] == listed[1] else listed
    values = (0.011, 0.02)[-len(listed) :]
    model = PointingModel(kind, 0.6, listed, values)
    star1, star2, jacobian = model.star_and_jacobian(lon, lat)
    assert np.array_equal((star1, star2), model.star(lon, lat))
    c, cos_star = np.cos(lat), np.cos(star2)
    by_lon = richardson(lambda x: model.star(lon + x, lat), 0.0) * [cos_star, 1 + 0 * lat] / c
    by_lat = richardson(lambda x: model.star(lon, lat + x), 0.0) * [cos_star, 1 + 0 * lat]
    along = np.array([part + 0 * lon for part in jacobian.along])
    worst = np.max(np.abs(along - np.array([by_lon[0], by_lat[0], by_lon[1], by_lat[1]])))
    for i, pair in enumerate(jacobian.by_coefficient):

        def star(x: float, i: int = i) -> tuple:
            changed = list(values)
            changed[i] += x
            return model.with_coefficients(changed).star(lon, lat)

        expected = richardson(star, 0.0) * [cos_star, 1 + 0 * lat]
        worst = max(worst, np.max(np.abs(np.array([part + 0 * lon for part in pair]) - expected)))
    print(f"{kind} {name}: {worst:.1e}")
    assert worst < 1e-8


@pytest.mark.parametrize("kind", KINDS)
def test_the_telescope_follows_a_moving_star_with_the_rates_of_its_own_path(kind):
    model = model_of_all(kind, 0.6, 300 * ARCSEC, 4)
    worst = 0.0
    for lon, lat in ((0.4, 0.9), (-1.1, 0.7), (2.9, 0.8), (0.4 + math.pi, math.pi - 0.9)):
        lon_rate, lat_rate = 0.7, -0.4  # on the sky

        def telescope(t: float, lon=lon, lat=lat, lon_rate=lon_rate, lat_rate=lat_rate) -> tuple[float, float]:
            return model.telescope(lon + lon_rate * t / math.cos(lat), lat + lat_rate * t)

        place, rates = model.telescope_and_rates(lon, lat, lon_rate, lat_rate)
        assert place == pytest.approx(telescope(0.0), abs=1e-15)
        worst = max(worst, np.max(np.abs(richardson(telescope, 0.0) - rates)))
    print(f"{kind}: {worst:.1e} rad/s at 0.7 rad/s")
    assert worst < 1e-8 * 0.7  # what is promised of every rate


@pytest.mark.parametrize("name", ["HF", "DNP", "DAF", "TF"])
def test_the_way_back_asks_a_term_a_few_times_and_not_hundreds(name, monkeypatch):
    model = PointingModel.of("equatorial", 38.0, **{name: 60.0})
    asked = []
    amount = Term.amount
    monkeypatch.setattr(Term, "amount", lambda each, place: asked.append(place) or amount(each, place))
    model.telescope(0.5, math.radians(89.0))
    print(name, len(asked))
    assert len(asked) <= 6
