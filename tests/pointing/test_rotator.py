"""The rotator's angle, against ERFA and rotation matrices: a second star stays where it is in the field."""

import math
from dataclasses import replace

import numpy as np
import pytest
from rate_oracle import extrapolated
from rotator_bench import (
    AIR,
    ARCSEC,
    EQUATORIAL,
    ERRORS,
    NO_AIR,
    TIME,
    TURN,
    erfas,
    focal_plane,
    in_the_field,
    ring,
    star_at,
    subject,
)

from pointing.errors import PointingError
from pointing.field_rotation import SkyAt, upright
from pointing.instant import Instant
from pointing.mount import POSTURES, MountType
from pointing.rotator import Held, Hold, Rotator, RotatorPath, field_rotation
from pointing.vectors import from_azimuth_altitude


def an_hour(geometry, star, hold, posture, terms, angles, air):
    """Places in the field of stars 1° off at position angles, through an hour: (moments, stars, 2) arcseconds."""
    ra, dec = ring(star, 1.0, angles)
    held, seen = Held(geometry, star, posture, hold), []
    for time in np.arange(TIME, TIME + 3601.0, 300.0):
        (one, _), (two, _) = geometry.track(star, time, posture, (0.0, 0.0))
        plane = focal_plane(geometry, one, two, held.angle(time), terms)
        centre = erfas(star.ra, star.dec, air, time)
        # The star itself is in the middle, but for what collimation and non-perpendicularity differ by from matrices.
        both = 95.0 * 40.0 * ARCSEC / abs(math.cos(two)) if terms else 0.0
        assert np.linalg.norm(in_the_field(centre, plane)) < 1.1 * both + 1e-3
        seen.append([in_the_field(each, plane) for each in erfas(ra, dec, air, time)])
    return np.array(seen)


PLACES = [(120.0, 50.0), (200.0, 70.0), (300.0, 40.0), (20.0, 60.0)]


@pytest.mark.parametrize("posture", POSTURES)
@pytest.mark.parametrize(("kind", "terms"), [(MountType.ALTAZ_FORK, ERRORS), (MountType.EQUATORIAL_FORK, EQUATORIAL)])
def test_a_second_star_1_degree_off_stays_in_its_direction_for_an_hour(kind, terms, posture):
    """Misalignment, collimation, non-perpendicularity, tilts, index errors and refraction all in force."""
    geometry, worst = subject(kind=kind, terms=terms), 0.0
    for azimuth, altitude in PLACES:
        star = star_at(geometry, azimuth, altitude)
        for position_angle in (0.0, 0.9, 2.5, -1.3):
            seen = an_hour(geometry, star, Hold("sky", position_angle), posture, terms, [position_angle], AIR)
            worst = max(worst, np.abs(seen[:, 0, 0]).max())  # across the instrument's y axis, on which it belongs
    print(f"{kind.text}, {posture}: at 1° it leaves its direction by {worst:.4f}″ at most")
    assert worst < 0.1


@pytest.mark.parametrize("posture", POSTURES)
def test_without_air_the_whole_field_stands_still_for_an_hour(posture):
    geometry, worst = subject(NO_AIR, terms=ERRORS), 0.0
    angles = np.arange(8) * math.pi / 4
    for azimuth, altitude in PLACES:
        star = star_at(geometry, azimuth, altitude)
        seen = an_hour(geometry, star, Hold("sky", 0.4), posture, ERRORS, angles, NO_AIR)
        worst = max(worst, np.linalg.norm(seen - seen.mean(axis=0), axis=-1).max())
    print(f"{posture}: eight stars at 1° move by {worst:.4f}″ at most")
    assert worst < 0.1


def test_the_position_angle_counts_from_north_through_east():
    geometry = subject(NO_AIR, misaligned=False)
    star = star_at(geometry, 120.0, 50.0)
    seen = an_hour(geometry, star, Hold("sky", 0.0), "normal", {}, [0.0, math.pi / 2], NO_AIR)
    north, east = seen.mean(axis=0) / 3600.0
    assert north == pytest.approx([0.0, 1.0], abs=2e-3)
    assert east == pytest.approx([1.0, 0.0], abs=2e-3)


def test_on_a_perfect_mount_the_angle_is_the_parallactic_one_of_the_textbook():
    """tan q = sin H / (tan φ cos δ − sin δ cos H), of the intermediate place that ERFA gives."""
    geometry = subject(NO_AIR, misaligned=False)
    for azimuth, altitude in PLACES:
        star = star_at(geometry, azimuth, altitude)
        frame = geometry.sky.at(Instant.from_posix(TIME))
        observed = star.observed(frame)
        x, y, z = observed
        s, c = math.sin(frame.sky.site.latitude), math.cos(frame.sky.site.latitude)
        hour_angle, dec = math.atan2(-y, s * x + c * z), math.asin(s * z - c * x)
        textbook = math.atan2(math.sin(hour_angle), s / c * math.cos(dec) - math.sin(dec) * math.cos(hour_angle))
        # North of the date is not that of J2000: precession of 26 years turns it by up to 0.15° / cos δ.
        assert SkyAt(frame, observed).parallactic_angle == pytest.approx(textbook, abs=math.radians(0.3))
        angle, _ = field_rotation(geometry, star, TIME, "normal")
        # Aberration leaves no right angle between north and east, by its square.
        assert angle == pytest.approx(-SkyAt(frame, observed).parallactic_angle, abs=1e-8)


@pytest.mark.parametrize(("azimuth", "altitude"), [(120.0, 50.0), (180.0, 89.4), (359.0, 32.0)])
def test_rates_are_the_derivative_of_the_angles(azimuth, altitude):
    geometry = subject(terms=ERRORS)
    star = star_at(geometry, azimuth, altitude)
    instant = Instant.from_posix(TIME)

    for posture in POSTURES:
        for hold in (Hold("sky", 1.0), Hold("horizon", -0.5), Hold("mount", 0.3)):
            held = Held(geometry, star, posture, hold)
            angle, rate = held.state(TIME, 0.0)

            def unwound(at, held=held, angle=angle):
                return [math.remainder(held.angle(TIME + at.since(instant)) - angle, math.tau)]

            (measured,) = extrapolated(unwound, instant, 8.0)
            assert math.degrees(abs(rate - measured)) < 1e-9 + 1e-8 * abs(math.degrees(rate))


def test_what_holds_the_horizon_stands_still_on_a_level_mount_and_turns_on_a_tilted_one():
    level, tilted = subject(misaligned=False), subject()
    for posture, turned in zip(POSTURES, (0.0, math.pi), strict=True):
        star = star_at(level, 120.0, 50.0)
        angle, rate = Held(level, star, posture, Hold("horizon", 0.2)).state(TIME, turned + 0.2)
        assert (angle, rate) == pytest.approx((0.2 + turned, 0.0), abs=1e-10)
    angles = [Held(tilted, star, "normal", Hold("horizon", 0.2)).angle(TIME + t) for t in (0.0, 3600.0)]
    assert abs(angles[1] - angles[0]) > 1e-5
    assert Held(tilted, star, "beyond", Hold("mount", 0.2)).state(TIME, 6.0) == (0.2 + math.tau, 0.0)


def test_flexure_bends_the_tube_and_does_not_roll_it():
    """What droops towards the ground on an upright mount keeps its upper side upright."""
    geometry = subject(NO_AIR, terms={"TF": 300.0}, misaligned=False)
    for azimuth, altitude in PLACES:
        observed = from_azimuth_altitude(math.radians(azimuth), math.radians(altitude))
        for posture, side in zip(POSTURES, (1.0, -1.0), strict=True):
            up = geometry.mount.up(*geometry.mount.axes(observed, posture))
            assert up == pytest.approx([side * each for each in upright(observed)], abs=1e-12)


def test_upper_sides_are_tangents_of_unit_length_that_lead_back_to_position_angles():
    geometry = subject(terms=ERRORS)
    frame = geometry.sky.at(Instant.from_posix(TIME))
    for azimuth, altitude in PLACES:
        observed = from_azimuth_altitude(math.radians(azimuth), math.radians(altitude))
        up = np.array(geometry.mount.up(*geometry.mount.axes(observed, "normal")))
        assert (up @ up, up @ np.array(observed)) == pytest.approx((1.0, 0.0), abs=1e-14)
        around_it = SkyAt(frame, observed)
        for angle in (0.0, 1.0, -2.5):
            assert around_it.position_angle(around_it.direction(angle)) == pytest.approx(angle, abs=1e-11)


def test_the_limit_is_foretold_when_the_wound_angle_reaches_it():
    geometry = subject()
    star = star_at(geometry, 178.0, 80.0)
    held = Held(geometry, star, "normal", Hold("sky", 0.5))
    angle, rate = held.state(TIME, 0.0)
    room = math.radians(20.0)
    low, high = (angle - room, angle + 9.0) if rate < 0.0 else (angle - 9.0, angle + room)
    rotator = Rotator(replace(TURN, minimum=low, maximum=high), held.hold)
    found = RotatorPath(rotator, held, angle).next_limit(TIME, TIME + 86400.0)
    assert found is not None
    moment, check = found
    assert not check.ok
    assert "`goto` the target again to wind it back" in check.detail
    assert held.state(moment - 0.02, angle)[0] == pytest.approx(low if rate < 0.0 else high, abs=abs(rate) * 0.03)
    assert RotatorPath(rotator, held, angle).next_limit(TIME, moment - 1.0) is None


def test_what_cannot_be_held_is_refused_with_what_can():
    geometry = subject()
    frame = geometry.sky.at(Instant.from_posix(TIME))
    with pytest.raises(PointingError, match="no north: hold the horizon"):
        SkyAt(frame, frame.observe((0.0, 0.0, 1.0)))
    with pytest.raises(PointingError, match="hold the sky"):
        upright((0.0, 0.0, 1.0))
    with pytest.raises(PointingError, match="possible are sky, horizon, mount"):
        Hold("star")
    with pytest.raises(PointingError, match="possible are −720° to 720°"):
        Hold("sky", math.nan)
