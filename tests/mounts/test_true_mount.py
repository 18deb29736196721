import random
from dataclasses import replace
from math import asin, atan2, cos, degrees, hypot, radians, sin, tan

import pytest

from mounts.tc410.simulator_settings import SimulatorSettings
from mounts.true_mount import Play, TrueMount, rotation, separation_arcsec
from pointing.mount import Mount, MountType

PERFECT = SimulatorSettings()
SMALL = 1.0  # arcsec: second-order terms are below 1e-4 of it
LATITUDES = [radians(-42.4), radians(30.0)]
PLACES = [(-60.0, 20.0), (-20.0, -35.0), (15.0, 50.0), (50.0, -10.0), (80.0, 5.0)]


def direction_equatorial(h, d, latitude):
    """Horizon direction of hour angle and declination by the spherical triangle."""
    south = sin(latitude) * cos(d) * cos(h) - cos(latitude) * sin(d)
    up = cos(latitude) * cos(d) * cos(h) + sin(latitude) * sin(d)
    return south, -cos(d) * sin(h), up


def hadec(v, latitude):
    x, y, z = v
    equator, pole = x * sin(latitude) + z * cos(latitude), -x * cos(latitude) + z * sin(latitude)
    return atan2(-y, equator), asin(pole)


def azel(v):
    return atan2(v[1], -v[0]), asin(v[2])


def shift_arcsec(settings, mount_type, latitude, one, two):
    """What is added to the telescope's place to obtain the star's, arcseconds of both coordinates."""
    seen = TrueMount(settings, mount_type, latitude).observed(one, two)
    a, b = azel(seen) if mount_type == "altaz-fork" else hadec(seen, latitude)
    turn = radians(360.0)
    return degrees((a - one + turn / 2) % turn - turn / 2) * 3600, degrees(b - two) * 3600


def test_a_perfect_equatorial_mount_points_where_its_axes_say():
    for latitude in LATITUDES:
        mount = TrueMount(PERFECT, "equatorial-fork", latitude)
        for h, d in PLACES:
            want = direction_equatorial(radians(h), radians(d), latitude)
            assert mount.observed(radians(h), radians(d)) == pytest.approx(want, abs=1e-14)
            beyond = mount.observed(radians(h + 180), radians(180 - d))
            assert beyond == pytest.approx(want, abs=1e-14)


def test_a_perfect_altazimuth_mount_points_where_its_axes_say():
    mount = TrueMount(PERFECT, "altaz-fork", radians(-42.4))
    assert mount.observed(radians(180), 0.0) == pytest.approx((1.0, 0.0, 0.0), abs=1e-15)
    assert mount.observed(radians(90), radians(30)) == pytest.approx((0.0, cos(radians(30)), 0.5), abs=1e-15)


@pytest.mark.parametrize(
    ("changes", "term"),
    [
        ({"misalignment_x_arcsec": -SMALL}, lambda h, d: (-cos(h) * tan(d), sin(h))),  # MA = −X
        ({"misalignment_y_arcsec": -SMALL}, lambda h, d: (sin(h) * tan(d), cos(h))),  # ME = −Y
        ({"collimation_arcsec": SMALL}, lambda _h, d: (1 / cos(d), 0.0)),  # CH
        ({"nonperpendicularity_arcsec": SMALL}, lambda _h, d: (tan(d), 0.0)),  # NP
    ],
)
def test_equatorial_errors_have_the_signs_of_their_terms(changes, term):
    for latitude in LATITUDES:
        for place in PLACES:
            h, d = (radians(angle) for angle in place)
            found = shift_arcsec(replace(PERFECT, **changes), "german", latitude, h, d)
            assert found == pytest.approx(term(h, d), abs=1e-3)


def test_equatorial_flexure_is_tf():
    for f in LATITUDES:
        for h, d in ((radians(a), radians(b)) for a, b in PLACES):
            want = (cos(f) * sin(h) / cos(d), cos(f) * cos(h) * sin(d) - sin(f) * cos(d))
            found = shift_arcsec(replace(PERFECT, flexure_arcsec=SMALL), "equatorial-fork", f, h, d)
            assert found == pytest.approx(want, abs=1e-3)


@pytest.mark.parametrize(
    ("changes", "term"),
    [
        ({"misalignment_x_arcsec": SMALL}, lambda a, e: (-cos(a) * tan(e), sin(a))),  # AW = X
        ({"misalignment_y_arcsec": -SMALL}, lambda a, e: (-sin(a) * tan(e), -cos(a))),  # AN = −Y
        ({"collimation_arcsec": SMALL}, lambda _a, e: (-1 / cos(e), 0.0)),  # CA
        ({"nonperpendicularity_arcsec": SMALL}, lambda _a, e: (-tan(e), 0.0)),  # NPAE
        ({"flexure_arcsec": SMALL}, lambda _a, e: (0.0, -cos(e))),  # TF
    ],
)
def test_altazimuth_errors_have_the_signs_of_their_terms(changes, term):
    for azimuth in (10.0, 100.0, 200.0, 340.0):
        for elevation in (5.0, 40.0, 70.0):
            a, e = radians(azimuth), radians(elevation)
            found = shift_arcsec(replace(PERFECT, **changes), "altaz-fork", 0.5, a, e)
            assert found == pytest.approx(term(a, e), abs=1e-3)


def test_collimation_and_skew_change_sides_across_the_pier_and_misalignment_does_not():
    latitude, h, d = LATITUDES[1], 0.4, 0.6
    for name, sign in [("collimation", -1), ("nonperpendicularity", -1), ("misalignment_x", 1), ("flexure", 1)]:
        settings = replace(PERFECT, **{f"{name}_arcsec": 10.0})
        mount, perfect = (TrueMount(s, "german", latitude) for s in (settings, PERFECT))
        here = hadec(mount.observed(h, d), latitude)
        there = hadec(mount.observed(h + radians(180), radians(180) - d), latitude)
        true = hadec(perfect.observed(h, d), latitude)
        shift = [degrees(a - b) * 3600 for a, b in zip(here, true, strict=True)]
        beyond = [degrees(a - b) * 3600 for a, b in zip(there, true, strict=True)]
        assert beyond == pytest.approx([sign * value for value in shift], abs=0.01)
        assert hypot(*shift) > 1.0


def test_large_errors_stay_a_rotation():
    turned = rotation(0.02, -0.035, 0.0)
    assert (turned @ turned.T).ravel() == pytest.approx([1, 0, 0, 0, 1, 0, 0, 0, 1], abs=1e-15)
    settings = replace(PERFECT, misalignment_x_arcsec=7200.0, misalignment_y_arcsec=-5000.0, collimation_arcsec=900.0)
    mount = TrueMount(settings, "altaz-fork", 0.3)
    assert hypot(*mount.observed(1.0, 1.5)) == pytest.approx(1.0, abs=1e-15)


def test_it_agrees_with_the_pointing_mathematics_at_large_misalignments():
    rng = random.Random(3)  # noqa: S311
    worst = 0.0
    for kind in MountType:
        for latitude in LATITUDES:
            x, y = rng.uniform(-7200, 7200), rng.uniform(-7200, 7200)
            settings = replace(PERFECT, misalignment_x_arcsec=x, misalignment_y_arcsec=y)
            true = TrueMount(settings, kind.text, latitude)
            computed = Mount(kind, latitude, radians(x / 3600), radians(y / 3600))
            for _ in range(200):
                axes = rng.uniform(-3, 3), rng.uniform(-3, 3)
                worst = max(worst, separation_arcsec(true.observed(*axes), computed.observed(*axes)))
    print(f"worst difference {worst:.1e} arcsec")
    assert worst < 1e-8


def test_the_axis_follows_only_after_the_play_is_crossed():
    play = Play(0.2)
    assert play.follow(1.0) == 1.0
    assert play.follow(1.05) == 1.0
    assert play.follow(1.5) == pytest.approx(1.4)
    assert play.follow(1.35) == pytest.approx(1.4)
    assert play.follow(1.0) == pytest.approx(1.1)


def test_worm_error_repeats_every_turn_of_the_worm():
    latitude = 0.5
    mount = TrueMount(replace(PERFECT, periodic_error_arcsec=15.0), "equatorial-fork", latitude, worm_turns=285)
    perfect = TrueMount(PERFECT, "equatorial-fork", latitude)
    quarter = radians(360 / 285 / 4)
    for step, amplitude in [(0, 0.0), (1, 15.0), (2, 0.0), (3, 15.0), (4, 0.0)]:
        angle = step * quarter
        assert separation_arcsec(mount.turn(angle, 0.0), perfect.observed(angle, 0.0)) == pytest.approx(
            amplitude, abs=1e-6
        )


def test_separation_is_exact_for_small_and_large_angles():
    assert separation_arcsec((1, 0, 0), (cos(1e-9), sin(1e-9), 0)) == pytest.approx(degrees(1e-9) * 3600, rel=1e-6)
    assert separation_arcsec((1, 0, 0), (-1, 0, 0)) == pytest.approx(648000)
