"""Pointing origins beside the tube's axis, against matrices and against the simulator's rigid mount."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rate_oracle import share_of_allowed_on_axes

from mounts.true_mount import TrueMount, rotation
from pointing.errors import PointingError, Unreachable
from pointing.limits import separation
from pointing.model.pointing_model import PointingModel
from pointing.mount import POSTURES, Mount, MountType
from pointing.site import Site
from pointing.sky import Sky
from pointing.vectors import from_azimuth_altitude

ARCSEC = math.pi / 648_000.0
ORIGINS = ((60.0, -45.0), (-1800.0, 900.0), (36000.0, -36000.0))  # arcseconds
LATITUDES = (-42.4, 51.5)
TILT = math.radians(-1.2), math.radians(1.6)

kinds = pytest.mark.parametrize("kind", MountType)
postures = pytest.mark.parametrize("posture", POSTURES)
origins = pytest.mark.parametrize("origin", ORIGINS)


def mount(kind, latitude_deg, origin, tilt=TILT):
    return Mount(kind, math.radians(latitude_deg), *tilt, *(each * ARCSEC for each in origin))


def seen_by_matrices(subject, axis1, axis2):
    """Where the origin is seen: the tube's vector of it turned about axis 2, axis 1, the tilt and the horizon."""
    altaz = subject.type is MountType.ALTAZ_FORK
    across = np.array((math.cos(subject.origin_x), -math.sin(subject.origin_x), 0.0))
    tube = rotation(0.0, -subject.origin_y, 0.0) @ across
    about_pole = math.pi - axis1 if altaz else -axis1
    base = rotation(0.0, 0.0, about_pole) @ rotation(0.0, -axis2, 0.0) @ tube
    horizon = np.eye(3) if altaz else rotation(0.0, subject.latitude - math.pi / 2, 0.0)
    return tuple(float(each) for each in horizon @ rotation(subject.x, subject.y, 0.0) @ base)


def arcsec_between(a, b):
    return separation(a, b) / ARCSEC


def places(rng, subject):
    """Observed directions all over the sky, none nearer to the pole of axis 1 than the origin comes with ease."""
    bare = Mount(subject.type, subject.latitude, subject.x, subject.y)
    while True:
        observed = from_azimuth_altitude(rng.uniform(0.0, math.tau), math.asin(rng.uniform(-0.1, 1.0)))
        if math.cos(bare.axes(observed, "normal")[1]) > 1.5 * abs(math.sin(subject.origin_x)):
            yield observed


@kinds
@postures
@origins
def test_the_axes_bring_the_origin_onto_the_place_and_lead_back(kind, posture, origin):
    rng, worst, by_matrices = np.random.default_rng(3), 0.0, 0.0
    for latitude in LATITUDES:
        subject = mount(kind, latitude, origin)
        for observed, _ in zip(places(rng, subject), range(300), strict=False):
            axes = subject.axes(observed, posture)
            worst = max(worst, arcsec_between(subject.observed(*axes), observed))
            by_matrices = max(by_matrices, arcsec_between(seen_by_matrices(subject, *axes), observed))
            assert subject.posture(axes[1]) == posture
    print(f"{kind.text}, {posture}, origin {origin}″: closes to {worst:.1e}″, matrices agree to {by_matrices:.1e}″")
    assert worst <= 1e-9
    assert by_matrices <= 1e-9


@settings(derandomize=True, deadline=None)
@given(
    st.sampled_from(MountType), st.floats(-89.0, 89.0), st.floats(-36000.0, 36000.0), st.floats(-36000.0, 36000.0),
    st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi),
)  # fmt: skip
def test_any_axis_angles_see_what_the_matrices_see(kind, latitude, x, y, axis1, axis2):
    subject = mount(kind, latitude, (x, y))
    assert arcsec_between(subject.observed(axis1, axis2), seen_by_matrices(subject, axis1, axis2)) < 1e-9


@kinds
@pytest.mark.parametrize("latitude", LATITUDES)
@pytest.mark.parametrize("x", [240.0, -5400.0])
def test_an_origin_across_the_tube_is_a_collimation_of_the_simulators_true_mount(kind, latitude, x):
    sense = -1.0 if kind is MountType.ALTAZ_FORK else 1.0  # CA counts against x, CH with it
    errors = SimpleNamespace(
        misalignment_x_arcsec=TILT[0] / ARCSEC, misalignment_y_arcsec=TILT[1] / ARCSEC, collimation_arcsec=sense * x,
        nonperpendicularity_arcsec=0.0, flexure_arcsec=0.0, periodic_error_arcsec=0.0, backlash_arcsec=0.0,
    )  # fmt: skip
    true, subject = TrueMount(errors, kind.text, math.radians(latitude)), mount(kind, latitude, (x, 0.0))
    rng = np.random.default_rng(8)
    worst = max(
        arcsec_between(true.observed(*axes), subject.observed(*axes))
        for axes in rng.uniform(-math.pi, math.pi, (200, 2))
    )
    print(f"{kind.text} at {latitude}°, x = {x:g}″: true mount and origin agree to {worst:.1e}″")
    assert worst < 1e-9


@kinds
@pytest.mark.parametrize("latitude", LATITUDES)
def test_x_lies_along_increasing_axis_1_and_y_along_increasing_axis_2_and_both_turn_over_beyond(kind, latitude):
    small, axes = 30.0, (0.4, 0.5)
    bare = mount(kind, latitude, (0.0, 0.0))
    beyond = bare.axes(bare.observed(*axes), "beyond")
    directions = [
        np.subtract(bare.observed(axes[0] + 1e-6, axes[1]), bare.observed(*axes)),
        np.subtract(bare.observed(axes[0], axes[1] + 1e-6), bare.observed(*axes)),
    ]
    for origin, along in zip(((small, 0.0), (0.0, small)), directions, strict=True):
        subject, unit = mount(kind, latitude, origin), along / np.linalg.norm(along)
        for at, sign in ((axes, 1.0), (beyond, -1.0)):
            moved = np.subtract(subject.observed(*at), bare.observed(*at)) / ARCSEC
            assert moved @ unit == pytest.approx(sign * small, abs=0.01)
            assert np.linalg.norm(moved) == pytest.approx(small, abs=0.01)


@kinds
@postures
@origins
def test_axis_rates_with_an_origin_are_the_derivatives_of_the_whole_chain(kind, posture, origin):
    rng, worst = np.random.default_rng(5), 0.0
    for latitude in LATITUDES:
        sky, subject = Sky(Site.from_degrees(latitude, 10.0, 500.0)), mount(kind, latitude, origin)
        distance = math.acos(0.1 + 1.5 * abs(math.sin(subject.origin_x)))
        worst = max(worst, share_of_allowed_on_axes(subject, sky, posture, rng, distance))
    print(f"{kind.text}, {posture}, origin {origin}″: rates within {worst:.3f} of 1e-9°/s + 1e-8·|rate|")
    assert worst <= 1.0


@kinds
@postures
def test_near_the_pole_of_axis_1_an_origin_across_is_refused_with_its_distance_and_one_along_is_not(kind, posture):
    across, along = mount(kind, 51.5, (1800.0, 0.0)), mount(kind, 51.5, (0.0, 1800.0))
    bare = mount(kind, 51.5, (0.0, 0.0))
    for off_deg in (0.0, 0.2, 0.499):
        observed = bare.observed(0.3, math.radians(90.0 - off_deg))
        for call in (across.axes, lambda v, p: across.axes_and_rates(v, (0.0, 0.0, 0.0), p)):
            with pytest.raises(Unreachable, match=rf"{off_deg:.4f}° from the pole of axis 1.*0\.5000°.*another"):
                call(observed, posture)
        for value in (value for axis in along.axes_and_rates(observed, (0.0, 7e-5, 0.0), posture) for value in axis):
            assert math.isfinite(value)
        assert arcsec_between(along.observed(*along.axes(observed, posture)), observed) < 1e-9
    edge = bare.observed(0.3, math.radians(90.0 - 0.501))
    assert arcsec_between(across.observed(*across.axes(edge, posture)), edge) < 1e-6


@kinds
@pytest.mark.parametrize(
    ("x_deg", "collimation_arcsec", "blamed"),
    [
        (2.0, 50.0, r"own 2\.0000°.*model's 0\.0139°.*(2\.0139|1\.9861)°.*take another instrument, or wait"),
        (0.0, 3600.0, r"the pointing model's 1\.0000° of collimation.*no nearer than 1\.0000°: wait"),
        (2.0, 0.0, r"a pointing origin 2\.0000° beside the tube's axis.*another instrument"),
    ],
)
def test_a_refusal_near_the_pole_names_origin_and_model_each_with_its_size(kind, x_deg, collimation_arcsec, blamed):
    names = ("CA", "IA") if kind is MountType.ALTAZ_FORK else ("CH", "IH")
    model = PointingModel.of(kind.kind, 51.5, **dict(zip(names, (collimation_arcsec, 100.0), strict=True)))
    subject = Mount(kind, math.radians(51.5), origin_x=math.radians(x_deg), model=model)
    pole = Mount(kind, math.radians(51.5)).observed(0.3, math.radians(89.9))
    with pytest.raises(Unreachable, match=blamed) as refusal:
        subject.axes(pole, "normal")
    assert ("origin" in str(refusal.value)) == (x_deg > 0.0)
    assert ("model" in str(refusal.value)) == (collimation_arcsec > 0.0)


@origins
def test_the_distance_of_an_origin_is_that_of_the_two_places_it_sees(origin):
    subject, bare = mount(MountType.GERMAN, 51.5, origin), mount(MountType.GERMAN, 51.5, (0.0, 0.0))
    assert subject.origin_distance == pytest.approx(separation(subject.observed(1.0, 0.2), bare.observed(1.0, 0.2)))


@pytest.mark.parametrize("origin", [(math.nan, 0.0), (0.0, math.inf), (0.8, 0.0), (0.0, -0.8)])
def test_an_impossible_origin_is_refused_with_its_value(origin):
    with pytest.raises(PointingError, match=r"pointing origin at x .*possible are −45° to 45°"):
        Mount(MountType.GERMAN, 0.5, 0.0, 0.0, *origin)
