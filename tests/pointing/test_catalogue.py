"""Names: stars, deep sky, spellings, and what is said to a name nobody knows."""

import math
import subprocess
import sys

import pytest

from pointing.bodies import BODIES
from pointing.catalogue import bright_stars, find, named_stars
from pointing.errors import TargetError
from pointing.solar_system import SolarSystemBody

# SIMBAD's places, ICRS J2000, degrees.
KNOWN = {
    "Vega": (279.234735, 38.783689),
    "Sirius": (101.287155, -16.716116),
    "Polaris": (37.954561, 89.264109),
    "Arcturus": (213.915300, 19.182409),
    "Betelgeuse": (88.792939, 7.407064),
    "Antares": (247.351915, -26.432003),
    "Acrux": (186.649563, -63.099093),
}
DEEP = {"M1": (83.633, 22.0145), "M31": (10.685, 41.269), "NGC 7000": (314.82, 44.53), "IC 434": (85.25, -2.45)}


@pytest.mark.parametrize("name", KNOWN)
def test_a_star_is_where_simbad_has_it(name):
    star = find(name)
    ra_deg, dec_deg = KNOWN[name]
    assert star.name == name
    off_deg = math.hypot((math.degrees(star.ra) - ra_deg) * math.cos(star.dec), math.degrees(star.dec) - dec_deg)
    assert off_deg * 3600 < 0.05


def test_alpha_centauri_moves_and_comes_nearer():
    star = find("rigil kentaurus")
    assert math.degrees(star.pm_ra) * math.cos(star.dec) * 3600 == pytest.approx(-3.68, abs=0.05)
    assert star.parallax_arcsec == pytest.approx(0.75, abs=0.02)
    assert star.rv_km_s == pytest.approx(-22, abs=1)


def test_the_table_holds_hundreds_of_named_stars_brightest_first():
    rows = named_stars()
    magnitudes = [row.v_mag for row in rows]
    assert len(rows) >= 300
    assert magnitudes == sorted(magnitudes)
    assert len({row.star.name for row in rows}) == len(rows)
    assert len({row.hip for row in rows}) == len(rows)
    assert sum(row.star.rv_km_s != 0 for row in rows) > 0.95 * len(rows)


def test_bright_stars_are_everywhere_in_the_sky():
    stars = bright_stars()
    assert stars[0].name == "Sirius"
    for south, north in ((-90, -30), (-30, 30), (30, 90)):
        assert sum(south <= math.degrees(star.dec) < north for star in stars) >= 20


@pytest.mark.parametrize("name", DEEP)
def test_a_deep_sky_object_is_where_it_is(name):
    target = find(name)
    assert target.name == name
    assert (math.degrees(target.ra), math.degrees(target.dec)) == pytest.approx(DEEP[name], abs=0.15)


@pytest.mark.parametrize("number", range(1, 111))
def test_every_messier_object_is_found(number):
    assert find(f"M{number}").name == f"M{number}"


@pytest.mark.parametrize(
    ("spelling", "name"),
    [("ngc7000", "NGC 7000"), ("NGC 7000", "NGC 7000"), ("Ngc-0224", "NGC 224"), ("ic434", "IC 434"),
     ("messier 31", "M31"), ("m 031", "M31"), ("VEGA", "Vega"), ("rigil-kentaurus", "Rigil Kentaurus"),
     ("yunu", "Yunü"), ("andromeda galaxy", "Andromeda Galaxy"), ("hip 91262", "Vega"),
     ("c14", "Caldwell 14"), ("b33", "Barnard 33")],
)  # fmt: skip
def test_common_spellings_are_understood(spelling, name):
    assert find(spelling).name == name


def test_m102_is_what_openngc_says_it_is():
    assert (find("M102").ra, find("M102").dec) == (find("M101").ra, find("M101").dec)


@pytest.mark.parametrize(
    ("name", "near"), [("Vegga", "Vega"), ("Betelgeuze", "Betelgeuse"), ("Andromda Galaxy", "Andromeda")]
)
def test_an_unknown_name_is_answered_with_the_nearest(name, near):
    with pytest.raises(TargetError, match=near):
        find(name)


@pytest.mark.parametrize(("spelling", "name"), [("Jupiter", "Jupiter"), ("moon", "Moon"), (" SUN", "Sun")])
def test_sun_moon_and_planets_are_found(spelling, name):
    assert find(spelling) == SolarSystemBody(name)


def test_no_star_takes_the_name_of_a_planet_away():
    stars = {row.star.name.casefold() for row in named_stars()}
    print(f"stars called like a body of the solar system: {stars & set(BODIES)}")
    assert all(isinstance(find(name), SolarSystemBody) for name in BODIES)


def test_a_planet_comes_from_the_kernel_that_is_given(tmp_path):
    absent = tmp_path / "absent.bsp"
    assert find("Vega", absent).name == "Vega"
    with pytest.raises(TargetError, match=r"absent\.bsp"):
        find("Mars", absent)


@pytest.mark.parametrize("name", ["Titan", "ISS", "Ceres"])
def test_small_bodies_are_declined(name):
    with pytest.raises(TargetError, match="Sun, Moon and planets"):
        find(name)


def test_a_misspelt_planet_is_answered_with_its_name():
    with pytest.raises(TargetError, match="Jupiter"):
        find("Jupitre")


@pytest.mark.parametrize(
    "name", ["M111", "M0", "NGC 7841", "NGC 99999", "IC 0", "NGC 224Z", "", "?", "M", "'; --", "x" * 9999]
)
def test_nonsense_is_refused_in_a_sentence(name):
    with pytest.raises(TargetError):
        find(name)


@pytest.mark.parametrize("module", ["pyongc.ongc", "pointing.solar_system"])
def test_a_star_costs_no_import_of_the_deep_sky_or_the_planets(module):
    code = f"import sys; from pointing.catalogue import find; find('Vega'); sys.exit({module!r} in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
