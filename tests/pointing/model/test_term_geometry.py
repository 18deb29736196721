"""Terms as what they are on a telescope: rotations and cones, made here of Rodrigues' formula, for degrees too."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from pointing.model.pointing_model import PointingModel
from pointing.model.terms import terms

Motions = dict[str, Callable[[], np.ndarray]]

ARCSEC = math.radians(1.0 / 3600.0)
X, Y, Z = np.eye(3)


def turned(v: np.ndarray, axis: np.ndarray, angle) -> np.ndarray:
    """Rodrigues: vectors (…, 3) turned about a unit axis."""
    c, s = np.cos(angle)[..., None], np.sin(angle)[..., None]
    axis = np.broadcast_to(axis, v.shape)
    return v * c + np.cross(axis, v) * s + axis * np.sum(axis * v, axis=-1, keepdims=True) * (1.0 - c)


def direction(kind: str, lon, lat) -> np.ndarray:
    """In the base frame: x to the meridian point of the equator or south, y east, z the north pole or the zenith."""
    west = lon if kind == "equatorial" else lon - math.pi
    return np.stack([np.cos(lat) * np.cos(west), -np.cos(lat) * np.sin(west), np.sin(lat)], axis=-1)


def across(kind: str, lon) -> np.ndarray:
    """Unit vector of increasing lon."""
    return direction(kind, lon + math.pi / 2, 0.0 * lon)


def up(kind: str, lon, lat) -> np.ndarray:
    """Unit vector of increasing lat."""
    return direction(kind, lon, lat + math.pi / 2)


def zenith(kind: str, phi: float) -> np.ndarray:
    return math.cos(phi) * X + math.sin(phi) * Z if kind == "equatorial" else Z


def cone(kind, lon, lat, angle):
    """Pointing off by an angle from square to the horizontal axis: on a small circle about it."""
    return direction(kind, lon, lat) * np.cos(angle)[..., None] + across(kind, lon) * np.sin(angle)[..., None]


def vertical(kind, phi, lon, lat, angle_of):
    v = direction(kind, lon, lat)
    axis = np.cross(np.broadcast_to(zenith(kind, phi), v.shape), v)
    sine = np.linalg.norm(axis, axis=-1)
    return turned(v, axis / sine[..., None], angle_of(np.arctan2(sine, v @ zenith(kind, phi))))


def off_the_horizontal_point(kind, lon, lat, angle):
    return turned(direction(kind, lon, lat), direction(kind, lon, 0.0 * lat), angle)


def nasmyth(kind, lon, lat, tangent, angle):
    return direction(kind, lon, lat) * np.cos(angle)[..., None] + tangent * np.sin(angle)[..., None]


def of_z(kind, phi, lon, lat, function):
    return function(np.arccos(direction(kind, lon, lat) @ zenith(kind, phi)))


def equatorial(c, h, d, phi) -> Motions:
    kind = "equatorial"
    return {
        "IH": lambda: direction(kind, h + c, d),
        "ID": lambda: direction(kind, h, d + c),
        "CH": lambda: cone(kind, h, d, c),
        "NP": lambda: off_the_horizontal_point(kind, h, d, c),
        "MA": lambda: turned(direction(kind, h, d), X, -c),
        "ME": lambda: turned(direction(kind, h, d), Y, -c),
        "TF": lambda: vertical(kind, phi, h, d, lambda z: c * np.sin(z)),
        "TX": lambda: vertical(kind, phi, h, d, lambda z: c * np.tan(z)),
        "FO": lambda: direction(kind, h, d + c * np.cos(h)),
        "HF": lambda: cone(kind, h, d, c * np.sin(h)),
        "DAF": lambda: cone(kind, h, d, -c * of_z(kind, phi, h, d, np.cos)),
        "HCES": lambda: direction(kind, h + c * np.sin(h), d),
        "HCEC": lambda: direction(kind, h + c * np.cos(h), d),
        "DCES": lambda: direction(kind, h, d + c * np.sin(d)),
        "DCEC": lambda: direction(kind, h, d + c * np.cos(d)),
        "DNP": lambda: off_the_horizontal_point(kind, h, d, c * np.sin(h)),
        "X2HC": lambda: cone(kind, h, d, c * np.cos(2 * h)),
        "HUSH": lambda: turned(direction(kind, h, d), Y, -c * np.sin(h)),
        "PZZ3": lambda: vertical(kind, phi, h, d, lambda z: c * z**3),
    }


def altazimuth(c, a, e, phi) -> Motions:
    kind = "altazimuth"
    side, rise = across(kind, a), up(kind, a, e)
    ce, se = np.cos(e)[:, None], np.sin(e)[:, None]
    return {
        "IA": lambda: direction(kind, a - c, e),
        "IE": lambda: direction(kind, a, e + c),
        "CA": lambda: cone(kind, a, e, -c),
        "NPAE": lambda: off_the_horizontal_point(kind, a, e, -c),
        "AN": lambda: turned(direction(kind, a, e), Y, -c),
        "AW": lambda: turned(direction(kind, a, e), X, c),
        "TF": lambda: vertical(kind, phi, a, e, lambda z: c * np.sin(z)),
        "TX": lambda: vertical(kind, phi, a, e, lambda z: c * np.tan(z)),
        "ACES": lambda: direction(kind, a - c * np.sin(a), e),
        "ACEC": lambda: direction(kind, a + c * np.cos(a), e),
        "ECES": lambda: direction(kind, a, e + c * np.sin(e)),
        "ECEC": lambda: direction(kind, a, e + c * np.cos(e)),
        "FLOP": lambda: direction(kind, a, e - c),
        "NRX": lambda: nasmyth(kind, a, e, -side * ce - rise * se, c),
        "NRY": lambda: nasmyth(kind, a, e, -side * se + rise * ce, c),
        "HSSA2": lambda: cone(kind, a, e, c * np.sin(2 * a)),
    }


GEOMETRY = {"equatorial": equatorial, "altazimuth": altazimuth}
ONE = np.ones(1)
TERMS = [(kind, name) for kind, motions in GEOMETRY.items() for name in motions(ONE, ONE, ONE, 1.0)]


def places(kind: str, phi: float) -> tuple[np.ndarray, np.ndarray]:
    """Places above 10°, in both postures, to 2′ from the pole of axis 1."""
    rng = np.random.default_rng(11)
    lon = rng.uniform(-math.pi, math.pi, 3000)
    lat = np.concatenate((np.arcsin(rng.uniform(-1.0, 1.0, 2900)), math.pi / 2 - np.geomspace(6e-4, 0.1, 100)))
    seen = direction(kind, lon, lat) @ zenith(kind, phi) > math.sin(math.radians(10.0))
    lon, lat = lon[seen], lat[seen]
    return np.concatenate((lon, lon + math.pi)), np.concatenate((lat, math.copysign(math.pi, phi) - lat))


@pytest.mark.parametrize("latitude_deg", [38.0, -31.0])
@pytest.mark.parametrize(("kind", "name"), TERMS)
def test_a_term_of_arcseconds_or_degrees_is_the_motion_it_stands_for(kind, name, latitude_deg):
    phi = math.radians(latitude_deg)
    lon, lat = places(kind, phi)
    worst = 0.0
    for coefficient in (30 * ARCSEC, math.radians(1.0), -math.radians(4.0)):
        model = PointingModel(kind, phi, terms(name, kind), (coefficient,))
        expected = GEOMETRY[kind](np.full_like(lon, coefficient), lon, lat, phi)[name]()
        worst = max(worst, np.max(np.linalg.norm(direction(kind, *model.star(lon, lat)) - expected, axis=-1)))
    print(f"{name}: {worst:.1e} rad")
    assert worst < 4e-15  # a dozen roundings


def rigid_mount(lon, lat, *, IA, IE, CA, NPAE, AW, AN) -> np.ndarray:
    """Wallace's rigid altazimuth mount, each part carried by the one before: direction in the base frame.

    The tube, off by CA, turns by elevation on an axis that is off by NPAE and turns by azimuth on the tilted base.
    """
    tube = np.broadcast_to(math.cos(CA) * X + math.sin(CA) * Y, (*np.shape(lon), 3))
    raised = turned(tube, Y, -(lat + IE))
    leaning = turned(raised, X, np.full_like(lon, -NPAE))
    round_ = turned(leaning, Z, math.pi - (lon - IA))
    return turned(turned(round_, X, np.full_like(lon, AW)), Y, np.full_like(lon, -AN))


def chain(lon, lat, **coefficients) -> np.ndarray:
    model = PointingModel(
        "altazimuth", 0.6, terms(" ".join(coefficients), "altazimuth"), tuple(coefficients.values())
    )
    return direction("altazimuth", *model.star(lon, lat))


def test_without_collimation_the_chain_is_a_rigid_mount_exactly_for_degrees_too():
    rng = np.random.default_rng(3)
    lon, lat = rng.uniform(-3.0, 3.0, 2000), rng.uniform(0.1, 3.0, 2000)
    parts = {"IA": 0.02, "IE": -0.03, "CA": 0.0, "NPAE": 0.05, "AW": -0.04, "AN": 0.03}
    apart = np.linalg.norm(chain(lon, lat, **parts) - rigid_mount(lon, lat, **parts), axis=-1)
    print(f"worst {np.max(apart):.1e} rad")
    assert np.max(apart) < 3e-15
    parts |= {"CA": 0.05, "NPAE": 0.0}
    assert np.max(np.linalg.norm(chain(lon, lat, **parts) - rigid_mount(lon, lat, **parts), axis=-1)) < 3e-15


def test_with_collimation_and_non_perpendicularity_the_chain_leaves_the_rigid_mount_by_their_product_times_sec_e():
    e = np.radians([0.0, 30.0, 60.0, 80.0, 100.0])
    parts = {"IA": 0.0, "IE": 0.0, "CA": 120 * ARCSEC, "NPAE": 60 * ARCSEC, "AW": 0.0, "AN": 0.0}
    apart = (chain(0.7 + 0 * e, e, **parts) - rigid_mount(0.7 + 0 * e, e, **parts)) / ARCSEC
    upwards = np.sum(apart * up("altazimuth", 0.7 + 0 * e, e), axis=-1)
    sideways = np.sum(apart * across("altazimuth", 0.7 + 0 * e), axis=-1)
    print(upwards, sideways, 120 * 60 * ARCSEC / np.cos(e), 120 * 60 * ARCSEC * np.tan(e))
    assert upwards == pytest.approx(120 * 60 * ARCSEC / np.cos(e), rel=2e-3)
    assert upwards[3] == pytest.approx(0.2, abs=0.002)
