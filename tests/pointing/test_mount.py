"""Sky to axes and back, against rotation matrices written here with numpy."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rate_oracle import share_of_allowed_on_axes

from pointing.errors import PointingError
from pointing.instant import Instant
from pointing.mount import POSTURES, Mount, MountType
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.vectors import from_azimuth_altitude, from_hour_angle_declination

ARCSEC = math.pi / 648_000.0
LATITUDES = (-42.4, 51.5)
MISALIGNMENTS = ((0.0, 0.0), (0.02, -0.01), (-1.2, 1.6), (1.4, 1.4))  # degrees
MIDNIGHT = 1_800_000_000.0

kinds = pytest.mark.parametrize("kind", MountType)
postures = pytest.mark.parametrize("posture", POSTURES)
latitudes = pytest.mark.parametrize("latitude", LATITUDES)


def mount(kind, latitude_deg=51.5, x_deg=0.0, y_deg=0.0):
    return Mount(kind, math.radians(latitude_deg), math.radians(x_deg), math.radians(y_deg))


def base_from_horizon(kind, latitude):
    """Rows are the base frame's axes in the horizon frame (x south, y east, z zenith)."""
    if kind is MountType.ALTAZ_FORK:
        return np.eye(3)
    s, c = math.sin(latitude), math.cos(latitude)
    equator, pole = (s, 0.0, c), (-c, 0.0, s)
    return np.array([equator, (0.0, 1.0, 0.0), pole])


def rotation(x, y):
    """The active rotation by the vector (x, y, 0), as the exponential of its cross-product matrix."""
    generator = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]])
    values, vectors = np.linalg.eig(generator)
    return (vectors @ np.diag(np.exp(values)) @ np.linalg.inv(vectors)).real if (x or y) else np.eye(3)


def expected_axes(subject, observed):
    """Mechanical angles of the normal posture, from matrices."""
    turned = rotation(subject.x, subject.y).T @ base_from_horizon(subject.type, subject.latitude) @ np.array(observed)
    lateral = math.atan2(turned[1], turned[0])
    zero = math.pi if subject.type is MountType.ALTAZ_FORK else 0.0
    return zero - lateral, math.atan2(turned[2], math.hypot(turned[0], turned[1]))


def arcsec_between(a, b):
    a, b = np.array(a), np.array(b)
    return math.atan2(np.linalg.norm(np.cross(a, b)), a @ b) / ARCSEC


def turn_between(a, b):
    return abs((a - b + math.pi) % math.tau - math.pi)


directions = st.builds(from_azimuth_altitude, st.floats(0.0, 6.28), st.floats(-1.5, 1.5))


@settings(derandomize=True, deadline=None)
@given(
    st.sampled_from(MountType),
    st.floats(-89.0, 89.0),
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.sampled_from(POSTURES),
    directions,
)
def test_axes_are_those_of_the_rotation_matrices_and_lead_back(kind, latitude, x, y, posture, observed):
    subject = mount(kind, latitude, x, y)
    axis1, axis2 = subject.axes(observed, posture)
    wanted1, wanted2 = expected_axes(subject, observed)
    if posture == "beyond":
        flip = -math.pi if latitude < 0 and kind is not MountType.ALTAZ_FORK else math.pi
        wanted1, wanted2 = wanted1 + math.pi, flip - wanted2
    assert turn_between(axis1, wanted1) * math.cos(wanted2) == pytest.approx(0.0, abs=1e-13)
    assert axis2 == pytest.approx(wanted2, abs=1e-7)  # a pole is approached like the square root of rounding
    assert arcsec_between(subject.observed(axis1, axis2), observed) < 1e-9
    assert subject.posture(axis2) == posture


@kinds
def test_round_trip_from_the_stars_to_the_axes_and_back(kind):
    """Astrometric → observed → axes → observed → astrometric, near pole and zenith and low as well."""
    rng = np.random.default_rng(20)
    worst, trips = 0.0, 0
    for latitude in LATITUDES:
        sky = Sky(Site.from_degrees(latitude, 173.7, 30.0, Weather(pressure_hpa=1010.0, temperature_c=12.0)))
        for x, y in MISALIGNMENTS:
            subject = mount(kind, latitude, x, y)
            for observed in places(rng, subject):
                frame = sky.at(Instant.from_posix(MIDNIGHT + rng.uniform(-1e9, 1e9)))
                star = frame.astrometric(observed)
                seen = frame.observe(star)
                for posture in POSTURES:
                    again = frame.astrometric(subject.observed(*subject.axes(seen, posture)))
                    worst, trips = max(worst, arcsec_between(again, star)), trips + 1
    print(f"{kind.text}: {trips} round trips, worst {worst:.1e}″")
    assert trips > 1000
    assert worst <= 1e-6


def places(rng, subject):
    """Observed directions to 85° zenith distance, and 1′ from zenith and from the pole of axis 1."""
    arcminute = math.radians(1.0 / 60.0)
    pole = np.array(subject.observed(0.0, math.copysign(math.pi / 2, subject.latitude)))
    if subject.type is MountType.ALTAZ_FORK:
        pole = np.array(subject.observed(0.0, math.pi / 2))
    for axis in (np.array((0.0, 0.0, 1.0)), pole):
        for _ in range(12):
            across = np.cross(axis, rng.normal(size=3))
            across /= np.linalg.norm(across)
            yield tuple(axis * math.cos(arcminute) + across * math.sin(arcminute))
    for _ in range(100):
        yield from_azimuth_altitude(rng.uniform(0.0, math.tau), math.radians(rng.uniform(5.0, 90.0)))
    for azimuth in np.linspace(0.1, 6.2, 20):
        yield from_azimuth_altitude(azimuth, math.radians(5.0))


def test_x_and_y_are_minus_ma_and_minus_me_to_first_order():
    """Star = telescope + Δ with Δh = −MA cos h tan δ + ME sin h tan δ and Δδ = MA sin h + ME cos h."""
    small, worst = 1e-6, 0.0
    for x, y in ((small, 0.0), (0.0, small)):
        ma, me = -x, -y
        subject = Mount(MountType.EQUATORIAL_FORK, math.radians(-42.4), x, y)
        aligned = Mount(MountType.EQUATORIAL_FORK, math.radians(-42.4))
        for h in np.radians((-150.0, -60.0, 0.0, 40.0, 120.0)):
            for dec in np.radians((-60.0, -10.0, 30.0, 70.0)):
                telescope = subject.axes(aligned.observed(h, dec), "normal")
                expected_h = (-ma * math.cos(h) + me * math.sin(h)) * math.tan(dec)
                expected_dec = ma * math.sin(h) + me * math.cos(h)
                worst = max(
                    worst,
                    abs(h - telescope[0] - expected_h) / small,
                    abs(dec - telescope[1] - expected_dec) / small,
                )
    print(f"MA = −X, ME = −Y: worst departure {worst:.1e} of the misalignment")
    assert worst < 1e-4


def test_x_and_y_are_aw_and_minus_an_to_first_order():
    """ΔA = −AN sin A tan E − AW cos A tan E, ΔE = −AN cos A + AW sin A."""
    small, worst = 1e-6, 0.0
    for x, y in ((small, 0.0), (0.0, small)):
        aw, an = x, -y
        subject = Mount(MountType.ALTAZ_FORK, 0.7, x, y)
        for azimuth in np.radians((10.0, 80.0, 130.0, 215.0, 330.0)):
            for altitude in np.radians((10.0, 45.0, 75.0)):
                telescope = subject.axes(from_azimuth_altitude(azimuth, altitude), "normal")
                expected_a = (-an * math.sin(azimuth) - aw * math.cos(azimuth)) * math.tan(altitude)
                expected_e = -an * math.cos(azimuth) + aw * math.sin(azimuth)
                worst = max(
                    worst,
                    abs((azimuth - telescope[0] + math.pi) % math.tau - math.pi - expected_a) / small,
                    abs(altitude - telescope[1] - expected_e) / small,
                )
    print(f"AW = X, AN = −Y: worst departure {worst:.1e} of the misalignment")
    assert worst < 1e-4


@latitudes
def test_positive_y_tilts_the_first_axis_to_the_meridian_point_and_positive_x_to_the_west(latitude):
    meridian_point = np.array((math.sin(math.radians(latitude)), 0.0, math.cos(math.radians(latitude))))
    pole = np.array((-math.cos(math.radians(latitude)), 0.0, math.sin(math.radians(latitude))))
    west = np.array((0.0, -1.0, 0.0))
    angle = math.radians(1.0)
    for x, y, towards in ((0.0, 1.0, meridian_point), (1.0, 0.0, west)):
        axis = np.array(mount(MountType.EQUATORIAL_FORK, latitude, x, y).observed(0.0, math.pi / 2))
        assert axis @ pole == pytest.approx(math.cos(angle), abs=1e-12)
        assert axis @ towards == pytest.approx(math.sin(angle), abs=1e-12)


@latitudes
def test_a_german_mount_looks_west_in_normal_posture_and_east_beyond(latitude):
    subject = mount(MountType.GERMAN, latitude)
    for mechanical in range(5, 180, 25):
        for declination in (-50.0, 0.0, 50.0):
            hour_angle = math.radians(mechanical)
            west = from_hour_angle_declination(hour_angle, math.radians(declination))
            east = from_hour_angle_declination(hour_angle - math.pi, math.radians(declination))
            to_horizon = base_from_horizon(MountType.GERMAN, subject.latitude).T
            assert (to_horizon @ west)[1] < 0 < (to_horizon @ east)[1]
            assert subject.axes(tuple(to_horizon @ west), "normal")[0] == pytest.approx(hour_angle)
            assert subject.axes(tuple(to_horizon @ east), "beyond")[0] == pytest.approx(hour_angle)


@latitudes
def test_a_german_mounts_counterweight_is_down_at_90_degrees(latitude):
    """Tube east of the pier at hour angle 0: the counterweight then lies west and turns with axis 1."""
    subject = mount(MountType.GERMAN, latitude)
    heights = {angle: subject.observed(math.radians(angle + 90.0), 0.0)[2] for angle in range(-10, 191, 5)}
    assert subject.observed(math.radians(0.0 + 90.0), 0.0)[1] == pytest.approx(-1.0)
    assert min(heights, key=heights.get) == 90
    assert heights[90] == pytest.approx(-math.cos(math.radians(latitude)))


@pytest.mark.parametrize(("latitude", "beyond_deg"), [(51.5, 140.0), (-42.4, -220.0)])
def test_beyond_the_pole_the_declination_axis_goes_on_over_the_visible_pole(latitude, beyond_deg):
    subject = mount(MountType.EQUATORIAL_FORK, latitude)
    observed = subject.observed(0.3, math.radians(40.0))
    axis1, axis2 = subject.axes(observed, "beyond")
    assert math.degrees(axis2) == pytest.approx(beyond_deg)
    assert axis1 == pytest.approx(0.3 + math.pi)


@kinds
@postures
def test_axis_rates_are_the_derivatives_of_the_whole_chain(kind, posture):
    rng = np.random.default_rng(5)
    worst = 0.0
    for latitude in LATITUDES:
        sky = Sky(Site.from_degrees(latitude, 10.0, 500.0))
        for x, y in MISALIGNMENTS:
            subject = mount(kind, latitude, x, y)
            worst = max(worst, share_of_allowed_on_axes(subject, sky, posture, rng, math.acos(0.02)))
    print(f"{kind.text}, {posture}: rates within {worst:.3f} of 1e-9°/s + 1e-8·|rate|")
    assert worst <= 1.0


@kinds
@postures
def test_the_pole_of_axis_1_has_finite_angles_and_rates(kind, posture):
    subject = mount(kind)
    pole = subject.observed(0.0, math.pi / 2)
    for observed in (pole, tuple(-c for c in pole)):
        still = subject.axes_and_rates(observed, (0.0, 0.0, 0.0), posture)
        moving = subject.axes_and_rates(observed, (0.0, 7e-5, 0.0), posture)
        assert all(math.isfinite(value) for axis in (*still, *moving) for value in axis)
        assert arcsec_between(subject.observed(still[0][0], still[1][0]), observed) < 1e-9
        assert still[0][1] == still[1][1] == 0.0


@pytest.mark.parametrize(
    "values", [(math.nan, 0.0, 0.0), (1.6, 0.0, 0.0), (0.5, math.nan, 0.0), (0.5, 0.0, math.inf), (0.5, 4.0, 0.0)]
)
def test_an_impossible_mount_is_refused_with_its_value(values):
    with pytest.raises(PointingError, match="possible are"):
        Mount(MountType.GERMAN, *values)


def test_an_unknown_mount_type_is_refused_with_the_known_ones():
    with pytest.raises(PointingError, match=r"'dobson'.*equatorial-fork, altaz-fork, german"):
        MountType.from_text("dobson")
    assert MountType.from_text("german") is MountType.GERMAN
