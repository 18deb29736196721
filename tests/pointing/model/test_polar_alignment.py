"""Turning the knobs as advised brings axis 1 where it should point: shown by rotations made here."""

import math

import erfa
import numpy as np
import pytest

from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.pointing_model import PointingModel
from pointing.model.polar_alignment import PolarAlignment, angle_text, polar_alignment, refracted_pole, registers
from pointing.model.run import PointingRun
from pointing.mount import Mount, MountType
from pointing.site import Weather

ARCSEC = math.degrees(1.0) * 3600.0
WEATHER = Weather(pressure_hpa=1010.0, temperature_c=10.0)


def about(axis, angle):
    """Rotation matrix about an axis, by Rodrigues' formula."""
    x, y, z = axis
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * k @ k


# The horizon frame: x north, y west, z up. Knobs of a mount on the ground: `raised` lifts the north horizon's side of
# what it turns, `eastward` turns it from north over east.
def raised(angle):
    return about((0.0, 1.0, 0.0), -angle)


def eastward(angle):
    return about((0.0, 0.0, 1.0), -angle)


def pole(latitude):
    """The north celestial pole in that frame."""
    return np.array([math.cos(latitude), 0.0, math.sin(latitude)])


def equator(latitude):
    """Columns: the meridian point of the equator, west, the north celestial pole."""
    meridian = np.array([-math.sin(latitude), 0.0, math.cos(latitude)])
    return np.column_stack([meridian, np.array([0.0, 1.0, 0.0]), pole(latitude)])


def places(rng, n, latitude):
    """Directions above 20° altitude and not within 5° of the pole."""
    v = rng.normal(size=(20 * n, 3))
    v /= np.linalg.norm(v, axis=1)[:, None]
    return v[(v[:, 2] > 0.34) & (np.abs(v @ pole(latitude)) < 0.996)][:n]


def equatorial_run(turn, latitude, seed=1, noise_arcsec=0.0):
    """A mount whose base was turned by the matrix `turn` from perfect alignment."""
    rng = np.random.default_rng(seed)
    v = places(rng, 60, latitude)
    seen = v @ equator(latitude)
    read = v @ turn @ equator(latitude)
    noise = rng.normal(scale=max(noise_arcsec, 1e-12) / ARCSEC, size=(2, len(v)))
    axis2 = np.arcsin(read[:, 2])
    return PointingRun(
        "equatorial", latitude, np.arctan2(seen[:, 1], seen[:, 0]), np.arcsin(seen[:, 2]),
        np.arctan2(read[:, 1], read[:, 0]) + noise[0] / np.cos(axis2), axis2 + noise[1],
    )  # fmt: skip


@pytest.mark.parametrize("latitude_deg", [52.0, 20.0, -30.0, -42.4])
@pytest.mark.parametrize("off_deg", [(0.03, -0.05), (-0.04, 0.02), (2.0, -1.5)])
def test_the_knobs_turned_as_advised_bring_axis_1_onto_the_true_pole(latitude_deg, off_deg):
    latitude = math.radians(latitude_deg)
    high, east = np.radians(off_deg)
    side = 1.0 if latitude > 0.0 else -1.0  # the visible pole is in the south: lifting it lowers the north
    turn = eastward(side * east) @ raised(side * high)
    advice = polar_alignment(fit(equatorial_run(turn, latitude), "IH ID CH NP MA ME"))
    knobs = eastward(side * advice.east_arcsec / ARCSEC), raised(side * advice.raise_arcsec / ARCSEC)
    axis = turn @ pole(latitude)
    before = np.linalg.norm(axis - pole(latitude)) * ARCSEC
    one = np.linalg.norm(knobs[0] @ axis - pole(latitude)) * ARCSEC
    both = np.linalg.norm(knobs[1] @ knobs[0] @ axis - pole(latitude)) * ARCSEC
    print(f"φ {latitude_deg:+.1f}°: {before:.1f}″ off, {one:.1f}″ after the azimuth, {both:.1e}″ after both")
    assert one < before
    assert both < 1e-5


@pytest.mark.parametrize("latitude_deg", [52.0, -30.0])
def test_a_pole_end_that_is_too_low_is_raised_and_one_too_far_east_goes_west(latitude_deg):
    latitude = math.radians(latitude_deg)
    side = 1.0 if latitude > 0.0 else -1.0
    low_and_east = eastward(side * 300.0 / ARCSEC) @ raised(side * -200.0 / ARCSEC)
    visible = side * low_and_east @ pole(latitude)
    assert math.asin(visible[2]) < abs(latitude)
    assert visible[1] < 0.0  # y is west
    text = polar_alignment(fit(equatorial_run(low_and_east, latitude), "IH ID CH NP MA ME")).text
    print(text)
    assert "raise the polar axis by 3.33′" in text
    assert f"move its {'north' if side > 0 else 'south'} end west by 5.00′" in text


def test_the_first_order_terms_say_what_they_say_of_a_mount():
    """ME 60″ in the north: the pole end is 60″ low; MA 60″: it is 60″ east on the sky, more in azimuth."""
    low = fit_of(PointingModel.of("equatorial", 60.0, IH=0.0, ID=0.0, ME=60.0, MA=0.0))
    advice = polar_alignment(low)
    assert advice.raise_arcsec == pytest.approx(60.0, abs=1e-3)
    east = polar_alignment(fit_of(PointingModel.of("equatorial", 60.0, IH=0.0, ID=0.0, ME=0.0, MA=60.0)))
    assert east.east_arcsec == pytest.approx(-120.0, abs=0.1)
    assert "west by 2.00′ ± " in east.text
    assert "(60.0″ on the sky)" in east.text


def fit_of(model):
    """A fit of a run that the model made, without noise."""
    rng = np.random.default_rng(7)
    axis1, axis2 = rng.uniform(-1.2, 1.2, 40), rng.uniform(-0.3, 1.3, 40)
    star1, star2 = model.star(axis1, axis2)
    run = PointingRun(model.kind, model.latitude, star1, star2, axis1, axis2)
    return fit(run, " ".join(term.name for term in model.terms))


def test_the_stated_sigma_is_that_of_the_advice():
    latitude = math.radians(-35.0)
    turn = eastward(0.002) @ raised(-0.001)
    found = [
        polar_alignment(fit(equatorial_run(turn, latitude, seed, noise_arcsec=5.0), "IH ID CH NP MA ME"))
        for seed in range(100, 160)
    ]
    truth = polar_alignment(fit(equatorial_run(turn, latitude), "IH ID CH NP MA ME"))
    for name in ("raise", "east"):
        z = np.array(
            [
                (getattr(a, f"{name}_arcsec") - getattr(truth, f"{name}_arcsec")) / getattr(a, f"{name}_sigma_arcsec")
                for a in found
            ]
        )
        print(f"{name}: mean z² {np.mean(z**2):.2f} of 60 runs")
        assert 0.6 < np.mean(z**2) < 1.5  # χ² of 60, 99.7 %


@pytest.mark.parametrize("latitude_deg", [60.0, 33.4, -42.4, 15.0])
def test_the_refracted_pole_stands_where_erfa_sees_it(latitude_deg):
    a, b = erfa.refco(WEATHER.pressure_hpa, WEATHER.temperature_c, WEATHER.relative_humidity, WEATHER.wavelength_um)
    z = math.pi / 2 - math.radians(abs(latitude_deg))
    lift = 0.0
    for _ in range(20):
        t = math.tan(z - lift)
        lift = a * t + b * t**3
    found = refracted_pole(math.radians(latitude_deg), WEATHER)
    print(f"φ {latitude_deg}°: {found * ARCSEC:.2f}″, {lift * ARCSEC:.2f}″")
    assert found * ARCSEC == pytest.approx(lift * ARCSEC, abs=0.2)  # atioq's one Newton step at Z 75°


@pytest.mark.parametrize("latitude_deg", [45.0, -45.0])
def test_advice_to_the_refracted_pole_is_higher_by_refraction_in_both_hemispheres(latitude_deg):
    latitude = math.radians(latitude_deg)
    found = fit(equatorial_run(raised(0.001), latitude), "IH ID MA ME")
    true = polar_alignment(found, "true", WEATHER)
    refracted = polar_alignment(found, "refracted", WEATHER)
    assert refracted.raise_arcsec - true.raise_arcsec == pytest.approx(refracted_pole(latitude, WEATHER) * ARCSEC)
    assert "the refracted pole is" in true.text
    assert "above it" in true.text
    assert "the true pole is" in refracted.text


@pytest.mark.parametrize("latitude_deg", [51.0, -42.4])
def test_the_registers_point_the_mount_as_the_terms_do(latitude_deg):
    model = PointingModel.of("equatorial", latitude_deg, IH=0.0, MA=4000.0, ME=-3000.0)
    found = registers(model)
    mount = Mount(
        MountType.EQUATORIAL_FORK, model.latitude, found.x_mas / 1000.0 / ARCSEC, found.y_mas / 1000.0 / ARCSEC
    )
    assert found.x_mas == pytest.approx(-4e6, rel=0.001)
    assert found.y_mas == pytest.approx(3e6, rel=0.001)
    assert found.index_arcsec == pytest.approx(-4000.0 * 3000.0 / 2.0 / ARCSEC, rel=0.01)  # XY/2
    worst = worst_of(model, mount, found.index_arcsec / ARCSEC)
    print(f"{found.text}: worst {worst:.1e}″")
    assert worst < 1e-6


def test_the_registers_of_an_altazimuth_mount_point_it_as_the_terms_do():
    model = PointingModel.of("altazimuth", 20.0, IA=0.0, AN=2500.0, AW=3500.0)
    found = registers(model)
    mount = Mount(MountType.ALTAZ_FORK, model.latitude, found.x_mas / 1000.0 / ARCSEC, found.y_mas / 1000.0 / ARCSEC)
    assert found.x_mas == pytest.approx(3.5e6, rel=0.001)
    assert found.y_mas == pytest.approx(-2.5e6, rel=0.001)
    worst = worst_of(model, mount, -found.index_arcsec / ARCSEC)
    print(f"{found.text}: worst {worst:.1e}″")
    assert worst < 1e-6


def worst_of(model, mount, more):
    """Greatest distance of the mount's axes, `more` taken from axis 1, from where the model points the telescope."""
    rng = np.random.default_rng(3)
    worst = 0.0
    for v in places(rng, 50, model.latitude):
        horizon = (-v[0], -v[1], v[2])  # south, east, up
        axis1, axis2 = mount.axes(horizon, "normal")
        if model.kind == "equatorial":
            m, w, p = v @ equator(model.latitude)
            star = math.atan2(w, m), math.asin(p)
        else:
            star = math.atan2(-v[1], v[0]), math.asin(v[2])
        lon, lat = model.telescope(*star)
        along = math.remainder(axis1 - more - lon, math.tau) * math.cos(lat)
        worst = max(worst, math.hypot(along, axis2 - lat) * ARCSEC)
    return worst


def test_a_base_shimmed_as_advised_is_level():
    turn = raised(-150.0 / ARCSEC) @ about((1.0, 0.0, 0.0), 240.0 / ARCSEC)
    rng = np.random.default_rng(5)
    v = places(rng, 60, math.radians(89.0))
    read = v @ turn
    run = PointingRun(
        "altazimuth", 0.6, np.arctan2(-v[:, 1], v[:, 0]), np.arcsin(v[:, 2]),
        np.arctan2(-read[:, 1], read[:, 0]), np.arcsin(read[:, 2]),
    )  # fmt: skip
    advice = polar_alignment(fit(run, "IA IE AN AW"))
    print(advice.text)
    knobs = raised(advice.north_arcsec / ARCSEC) @ about((1.0, 0.0, 0.0), advice.west_arcsec / ARCSEC)
    axis = turn @ np.array([0.0, 0.0, 1.0])
    left = np.linalg.norm((knobs @ axis)[:2]) * ARCSEC
    print(f"{np.linalg.norm(axis[:2]) * ARCSEC:.1f}″ off the zenith, {left:.3f}″ after")
    assert left < 0.3  # the order of two tilts of minutes of arc: 150·240″²


def test_a_model_without_tilt_is_refused_with_what_to_fit():
    with pytest.raises(PointingError, match=r"neither ME nor MA.*fit both"):
        polar_alignment(fit_of(PointingModel.of("equatorial", 40.0, IH=1.0, ID=1.0)))


@pytest.mark.parametrize(
    ("kind", "arcsec", "text"),
    [
        ("equatorial", {"IH": 1.0, "ID": 1.0, "ME": 60.0}, "because MA is no term"),
        ("equatorial", {"IH": 1.0, "ID": 1.0, "MA": 60.0}, "because ME is no term"),
        ("altazimuth", {"IA": 1.0, "IE": 1.0, "AN": 60.0}, "because AW is no term"),
    ],
)
def test_of_a_direction_that_was_not_fitted_nothing_is_claimed(kind, arcsec, text):
    advice = polar_alignment(fit_of(PointingModel.of(kind, 40.0, **arcsec))).text
    print(advice)
    assert text in advice
    assert advice.count(" by ") == 1


def test_another_pole_is_refused():
    model = PointingModel.of("equatorial", 40.0, IH=1.0, ID=1.0, ME=1.0)
    with pytest.raises(PointingError, match="no pole 'magnetic': possible are true and refracted"):
        polar_alignment(fit_of(model), "magnetic")


def test_a_notebook_shows_the_advice():
    found = fit_of(PointingModel.of("equatorial", 40.0, IH=1.0, ID=1.0, ME=100.0, MA=9.0)).polar_alignment()
    assert isinstance(found, PolarAlignment)
    assert found._repr_html_().count("<p>") == 4


@pytest.mark.parametrize(("arcsec", "text"), [(3.25, "3.2″"), (-90.0, "-1.50′"), (5400.0, "1.500°")])
def test_angles_are_shown_in_the_unit_that_fits(arcsec, text):
    assert angle_text(arcsec) == text


def drift_arcsec(pole_lift, declination_deg, latitude_deg=45.0, begin_deg=45.0):
    """Greatest change of declination in the hour after hour angle 3 h, of an axis 1 that is driven alone."""
    latitude = math.radians(latitude_deg)
    a, b = erfa.refco(1013.25, 15.0, 0.5, 0.55)
    axis = pole(latitude + pole_lift)
    seen = []
    for hour_angle in np.radians(np.linspace(begin_deg, begin_deg + 15.0, 25)):
        d = math.radians(declination_deg)
        v = equator(latitude) @ (math.cos(d) * math.cos(hour_angle), math.cos(d) * math.sin(hour_angle), math.sin(d))
        z = math.acos(v[2])
        z -= a * math.tan(z) + b * math.tan(z) ** 3
        v = np.array((*(v[:2] / np.hypot(*v[:2]) * math.sin(z)), math.cos(z)))
        seen.append(math.asin(v @ axis))
    return np.ptp(seen) * ARCSEC


def test_an_axis_driven_alone_drifts_less_on_the_refracted_pole():
    lift = refracted_pole(math.radians(45.0), Weather.standard(0.0))
    drifts = {d: (drift_arcsec(0.0, d), drift_arcsec(lift, d)) for d in (0.0, 30.0, 60.0, 80.0)}
    print({d: f"{true:.0f}″ true, {refracted:.0f}″ refracted" for d, (true, refracted) in drifts.items()})
    assert all(refracted < true for true, refracted in drifts.values())


@pytest.mark.parametrize(
    ("arcsec", "sigma", "said"),
    [
        (120.0, 0.06, "2.00′ ± 0.06″"),
        (120.0, 30.0, "2.00′ ± 0.50′"),
        (5.0, 0.0012, "5.0″ ± 0.0012″"),
        (7200.0, 1.0, "2.000° ± 1″"),
        (-1e-9, None, "0.0″"),
        (-1e-9, 0.0, "0.0″ ± 0.0″"),
    ],
)
def test_an_angle_is_told_without_a_negative_nought_and_a_small_sigma_in_arcseconds(arcsec, sigma, said):
    assert angle_text(arcsec, sigma) == said
