"""Terms against the two tables of formulas to first order, across the pole, under other names; and the names."""

import math

import numpy as np
import pytest

from pointing import own_term
from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.place import MountKind
from pointing.model.pointing_model import PointingModel
from pointing.model.run import PointingRun
from pointing.model.terms import NAMED, Term, term, terms

ADDITIVE = {"H", "D", "A", "E"}  # results whose amounts add up
SMALL = 1e-6  # rad
LATITUDES_DEG = (38.0, -31.0)
sin, cos, tan = np.sin, np.cos, np.tan
Rows = dict[str, tuple]


def cos_z(h, d, phi):
    return sin(phi) * sin(d) + cos(phi) * cos(d) * cos(h)


def equatorial(h, d, phi) -> Rows:
    flexure = (cos(phi) * sin(h) / cos(d), cos(phi) * cos(h) * sin(d) - sin(phi) * cos(d))
    return {
        "IH": (1, 0),
        "ID": (0, 1),
        "CH": (1 / cos(d), 0),
        "NP": (tan(d), 0),
        "MA": (-cos(h) * tan(d), sin(h)),
        "ME": (sin(h) * tan(d), cos(h)),
        "TF": flexure,
        "TX": tuple(part / cos_z(h, d, phi) for part in flexure),
        "FO": (0, cos(h)),
        "HF": (sin(h) / cos(d), 0),
        "DAF": (-(cos(phi) * cos(h) + sin(phi) * tan(d)), 0),
        "HCES": (sin(h), 0),
        "HCEC": (cos(h), 0),
        "DCES": (0, sin(d)),
        "DCEC": (0, cos(d)),
        "DNP": (sin(h) * tan(d), 0),
        "X2HC": (cos(2 * h) / cos(d), 0),
    }


def altazimuth(a, e, _phi) -> Rows:
    return {
        "IA": (-1, 0),
        "IE": (0, 1),
        "CA": (-1 / cos(e), 0),
        "NPAE": (-tan(e), 0),
        "AN": (-sin(a) * tan(e), -cos(a)),
        "AW": (-cos(a) * tan(e), sin(a)),
        "TF": (0, -cos(e)),
        "TX": (0, -1 / tan(e)),
        "ACES": (-sin(a), 0),
        "ACEC": (cos(a), 0),
        "ECES": (0, sin(e)),
        "ECEC": (0, cos(e)),
        "NRX": (-1, -sin(e)),
        "NRY": (-tan(e), cos(e)),
        "FLOP": (0, -1),
        "HESA2": (0, -sin(2 * a)),
        "HECA": (0, -cos(a)),
        "HACA3": (cos(3 * a), 0),
        "HASA2": (sin(2 * a), 0),
    }


TABLES = {"equatorial": equatorial, "altazimuth": altazimuth}
ROWS = [(kind, name) for kind, table in TABLES.items() for name in table(0.5, 0.5, 0.5)]

FLIP = {
    "equatorial": {"ID", "CH", "NP", "DAF", "HCES", "HCEC", "DCES", "X2HC"},
    "altazimuth": {"IE", "CA", "NPAE", "ACES", "ACEC", "ECES", "FLOP"},
}
STAY = {
    "equatorial": {"IH", "MA", "ME", "TF", "TX", "TX10", "FO", "HF", "DNP", "DCEC"},
    "altazimuth": {"IA", "AN", "AW", "TF", "TX", "TX10", "ECEC"},
}
ALIASES = {
    "equatorial": "HCES=HHSH HCEC=HHCH DCES=HDSD DCEC=HDCD FO=HDCH HF=HXSH DNP=HPSH X2HC=HXCH2 TF=HZSZ TX=TX10",
    "altazimuth": "TF=HZSZ ACES=HASA ACEC=HACA ECES=HESE ECEC=HECE TX=TX10",
}
PAIRS = [(kind, *pair.split("=")) for kind, pairs in ALIASES.items() for pair in pairs.split()]


def model_of(kind: MountKind, latitude_deg: float, each: Term | str, coefficient: float) -> PointingModel:
    each = term(each, kind) if isinstance(each, str) else each
    return PointingModel(kind, math.radians(latitude_deg), (each,), (coefficient,))


def places(kind: MountKind, latitude_deg: float) -> tuple[np.ndarray, np.ndarray]:
    """Places above 10° of elevation and 3° or more from the pole of axis 1, in the normal posture."""
    rng = np.random.default_rng(5)
    lon, lat = rng.uniform(-math.pi, math.pi, 4000), np.arcsin(rng.uniform(-1.0, 1.0, 4000))
    up = cos_z(lon, lat, math.radians(latitude_deg)) if kind == "equatorial" else sin(lat)
    good = (up > math.sin(math.radians(10.0))) & (abs(lat) < math.radians(87.0))
    return lon[good], lat[good]


def first_order(kind: MountKind, latitude_deg: float, each: Term | str, lon, lat) -> tuple[np.ndarray, np.ndarray]:
    """Δlon, Δlat for a coefficient of one: the odd part at ±1e-6 rad, off by its square, 1e-12, at most."""
    ahead = model_of(kind, latitude_deg, each, SMALL).star(lon, lat)
    behind = model_of(kind, latitude_deg, each, -SMALL).star(lon, lat)
    return tuple((a - b) / (2 * SMALL) + 0 * lon for a, b in zip(ahead, behind, strict=True))


@pytest.mark.parametrize("latitude_deg", LATITUDES_DEG)
@pytest.mark.parametrize(("kind", "name"), ROWS)
def test_a_term_is_its_row_of_the_table_to_first_order_in_both_postures(kind, name, latitude_deg):
    lon, lat = places(kind, latitude_deg)
    half_turn = math.copysign(math.pi, latitude_deg)
    worst = 0.0
    for one, other in ((lon, lat), (lon + math.pi, half_turn - lat)):
        found = first_order(kind, latitude_deg, name, one, other)
        expected = TABLES[kind](one, other, math.radians(latitude_deg))[name]
        on_sky = [abs(a - b) * scale for a, b, scale in zip(found, expected, (cos(other), 1.0), strict=True)]
        worst = max(worst, np.max(np.abs(on_sky)))
    print(f"{name}: {worst:.1e} of the coefficient")
    assert worst < 2e-9  # rounding of a radian, 2e-16, against 1e-6


@pytest.mark.parametrize("power", [1, 3])
@pytest.mark.parametrize("kind", ["equatorial", "altazimuth"])
def test_a_polynomial_of_the_zenith_distance_is_a_vertical_displacement_in_both_postures(kind, power):
    lon, lat = places(kind, 38.0)
    phi = math.radians(38.0)
    for one, other in ((lon, lat), (lon + math.pi, math.pi - lat)):
        z = np.arccos(cos_z(one, other, phi) if kind == "equatorial" else sin(other))
        star = model_of(kind, 38.0, f"PZZ{power}", 1e-3).star(one, other)
        after = np.arccos(cos_z(*star, phi) if kind == "equatorial" else sin(star[1]))
        assert np.max(np.abs(after - z - 1e-3 * z**power)) < 3e-14


def test_every_named_term_is_in_a_table():
    missing = {(kind, each.name) for each in NAMED for kind in each.mounts} - set(ROWS)
    assert missing == {("equatorial", "TX10"), ("altazimuth", "TX10")}  # TX under another name, as below


@pytest.mark.parametrize("latitude_deg", LATITUDES_DEG)
@pytest.mark.parametrize("kind", ["equatorial", "altazimuth"])
def test_terms_change_sign_on_the_sky_beyond_the_pole_or_keep_it_as_the_telescope_is_built(kind, latitude_deg):
    lon, lat = places(kind, latitude_deg)
    flip, stay = set(), set()
    for each in NAMED:
        if kind in each.mounts:
            normal = np.array(first_order(kind, latitude_deg, each, lon, lat))
            beyond = np.array(first_order(kind, latitude_deg, each, lon + math.pi, math.pi - lat))
            on_sky = np.array([beyond[0], -beyond[1]])  # |lat| grows towards the pole on one side, away on the other
            flip |= {each.name} if np.allclose(on_sky, -normal, atol=1e-7) else set()
            stay |= {each.name} if np.allclose(on_sky, normal, atol=1e-7) else set()
    assert flip == FLIP[kind]
    assert stay == STAY[kind]


def test_a_nasmyth_focus_is_displaced_to_the_other_side_beyond_the_zenith_and_along_the_tube_on_the_same():
    a, e = places("altazimuth", 38.0)
    for name, signs in (("NRX", (1, -1)), ("NRY", (-1, 1))):
        normal = first_order("altazimuth", 38.0, name, a, e)
        beyond = first_order("altazimuth", 38.0, name, a + math.pi, math.pi - e)
        assert np.allclose(beyond[0], signs[0] * normal[0], atol=1e-7)
        assert np.allclose(-beyond[1], signs[1] * normal[1], atol=1e-7)


@pytest.mark.parametrize(("kind", "name", "alias"), PAIRS)
def test_an_alias_does_exactly_the_same(kind, name, alias):
    lon, lat = places(kind, -31.0)
    for one, other in ((lon, lat), (lon + math.pi, -math.pi - lat)):
        assert np.array_equal(
            model_of(kind, -31.0, name, 0.01).star(one, other), model_of(kind, -31.0, alias, 0.01).star(one, other)
        )


@pytest.mark.parametrize("kind", ["equatorial", "altazimuth"])
def test_tx_is_of_a_size_down_to_the_horizon_and_goes_on_smoothly_below(kind):
    phi = math.radians(38.0)
    z = np.radians(np.linspace(1.0, 179.0, 3561))
    lon, lat = (0.0 * z, phi - z) if kind == "equatorial" else (0.0 * z + math.pi, math.pi / 2 - z)  # due south
    star = model_of(kind, 38.0, "TX", 1e-4).star(lon, lat)
    after = np.arccos(cos_z(*star, phi) if kind == "equatorial" else sin(star[1]))
    moved = after - z
    expected = 1e-4 * np.where(np.degrees(z) <= 89.0, np.tan(z), np.sin(z) / math.cos(math.radians(89.0)))
    assert np.max(np.abs(moved - expected)) < 2e-14  # arccos 1° from its ends
    assert np.max(moved) < 1e-4 * 57.3
    assert np.max(np.abs(np.diff(moved))) < 1e-4 * math.radians(0.05) * 3300  # the slope at 89°, sec² Z


GOOD = {
    "equatorial": "HDSH2 HXCH HUSA HLCZ3 HPSH HZSZ HZSZ2CA HHSQ PHH1 PDD2 PZZ5 PXHD HDSH2CD3 hdsh2 PDH12",
    "altazimuth": "HESA2 HECA HACA3 HSSA2CE HNSA HWCA4 HVSA PEE2 PZZ1 PAA PSA3E2 HACQ HESH PED2",
}


@pytest.mark.parametrize("kind", ["equatorial", "altazimuth"])
def test_names_of_generic_terms_are_read(kind):
    for name in GOOD[kind].split():
        found = term(name, kind)
        assert found.name == name.upper()
        assert found.sentence
        assert len(found.factors) in {1, 2}
    assert [factor.text for factor in term("PSA3E2", "altazimuth").factors] == ["A^3", "E^2"]
    assert [factor.text for factor in term("HDSH2CD3", "equatorial").factors] == ["sin 2H", "cos 3D"]


@pytest.mark.parametrize(
    "name", ["", "XX", "HDTH", "HDSH0", "HDS", "PZ", "PZZ0", "HDSX", "HQSH", "HDSH123", "HDSHCDSA", "H DSH", "PZZ1S"]
)
def test_what_is_no_name_is_refused_with_the_names_there_are(name):
    with pytest.raises(PointingError, match=r"there is no pointing term .*IH ID CH NP MA ME.*HDSH2.*PZZ3"):
        term(name, "equatorial")


@pytest.mark.parametrize(("name", "kind"), [("CA", "equatorial"), ("HESA2", "equatorial"), ("HDSH", "altazimuth")])
def test_a_term_of_the_other_kind_of_mount_is_refused(name, kind):
    with pytest.raises(PointingError, match=rf"the term {name} .* mount, this is an {kind} one"):
        term(name, kind)


def test_a_list_of_terms_has_each_once_and_at_least_one():
    assert [each.name for each in terms("ih, ID  ch", "equatorial")] == ["IH", "ID", "CH"]
    with pytest.raises(PointingError, match="no pointing terms are named"):
        terms(" , ", "equatorial")
    with pytest.raises(PointingError, match="the pointing term CH is named twice"):
        terms("IH CH ID ch", "equatorial")
    once = term("CH", "equatorial")
    with pytest.raises(PointingError, match="the pointing term CH is named twice"):
        PointingModel("equatorial", 0.5, (once, once), (0.0, 0.0))


def test_terms_tell_what_confirms_them():
    unconfirmed = {"NP", "TX", "TX10", "FO", "HF", "DAF", "HCES", "HCEC", "DCES", "DCEC", "DNP", "X2HC"}
    named = [each for each in NAMED if "equatorial" in each.mounts]
    assert {each.name for each in named if each.evidence("equatorial") == "unconfirmed"} == unconfirmed
    assert term("TX", "altazimuth").evidence("altazimuth") == "published"
    assert term("HESA2", "altazimuth").evidence("altazimuth") == "published"
    assert term("HESA5", "altazimuth").evidence("altazimuth") == "unconfirmed"


def test_a_term_of_ones_own_is_fitted_and_undone_beside_the_others():
    own = own_term("sag", "D", lambda h, d: np.sin(h) ** 2 * np.cos(d), "the fork sags")
    assert own.evidence("equatorial") == "own"
    truth = PointingModel("equatorial", 0.6, (*terms("IH ID CH", "equatorial"), own), (1e-3, -5e-4, 2e-4, 7e-4))
    lon, lat = places("equatorial", 38.0)
    star = truth.star(lon, lat)
    assert np.max(np.abs(np.array(truth.telescope(*star)) - (lon, lat))) < 1e-14
    assert truth.telescope(float(star[0][0]), float(star[1][0])) == pytest.approx((lon[0], lat[0]), abs=1e-14)
    run = PointingRun("equatorial", 0.6, *star, lon, lat)
    found = fit(run, ["IH", "ID", "CH", own]).model
    assert found.coefficients == pytest.approx(truth.coefficients, abs=1e-12)


@pytest.mark.parametrize(
    ("name", "result", "function", "says"),
    [
        ("CH", "D", np.add, "CH is a pointing term already"),
        ("HDSH7", "D", np.add, "HDSH7 is a pointing term already"),
        ("2nd", "D", np.add, "no name for a pointing term: give letters"),
        ("sag", "Q", np.add, r"SAG is to move 'Q': possible are H \(hour angle\)"),
        ("sag", "D", lambda h, d: math.sin(h) + d, "does not take floats and arrays alike"),
        ("sag", "D", lambda _, d: np.mean(d), "it must treat both alike"),
        ("sag", "D", lambda _, d: d * np.nan, "and be finite"),
    ],
)
def test_a_term_of_ones_own_that_cannot_work_is_refused(name, result, function, says):
    with pytest.raises(PointingError, match=says):
        own_term(name, result, function)


@pytest.mark.parametrize("kind", ["equatorial", "altazimuth"])
def test_no_two_terms_of_constant_amount_move_the_same_unless_that_adds_up(kind):
    """What `pointing.model.rigid` rests on, which sums them."""
    constant = [each.result for each in NAMED if kind in each.mounts and not each.factors]
    assert not [each for each in constant if constant.count(each) > 1 and each not in ADDITIVE]
    assert own_term("WHIFF", "D", lambda h, d: 1.0 + 0.0 * h * d).factors  # and thus is none of constant amount
