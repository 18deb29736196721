"""The proof that a path is clear, against looking at thousands of its moments."""

import math
import os

import numpy as np
import pytest
from planning_bench import COUNTS_PER_DEGREE, Trapezoid, gearing

from pointing.limits import Horizon, Limits
from pointing.mount import Mount, MountType
from pointing.path import Leg, SlewPath
from pointing.vectors import from_azimuth_altitude

HILLS = Horizon(
    tuple(
        (math.radians(azimuth), math.radians(altitude))
        for azimuth, altitude in ((0, 10), (80, 12), (90, 40), (100, 12), (200, -3), (300, 35))
    )
)
MODEL = Trapezoid(4.0 * COUNTS_PER_DEGREE, 1.0 * COUNTS_PER_DEGREE)
FASTEST = math.radians(4.0)
TOLERANCE_DEG = 0.02  # what a graze or a way out of a zone may lose
GEAR = gearing(0.0)
PATHS = 60 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 20  # accepted and refused, at least


def leg(start_deg, end_deg, rate_deg_s=0.0, resumed_deg_s=0.0):
    start, end = (GEAR.counts(math.radians(angle)) for angle in (start_deg, end_deg))
    travel = MODEL.travel(start, end, rate_deg_s * COUNTS_PER_DEGREE, 0.0)
    return Leg(GEAR, travel, FASTEST, math.radians(rate_deg_s), math.radians(resumed_deg_s))


def sun_at(azimuth_deg, altitude_deg):
    return from_azimuth_altitude(math.radians(azimuth_deg), math.radians(altitude_deg))


def rooms(path, limits, moments=20_000):
    """Degrees to the horizon and to the Sun's zone at moments all along a path of an altazimuth mount."""
    parts = np.linspace(0.0, 1.0, moments)
    azimuth, altitude = np.array([path.angles(part * path.duration) for part in parts]).T
    seen = np.stack((-np.cos(altitude) * np.cos(azimuth), np.cos(altitude) * np.sin(azimuth), np.sin(altitude)), -1)
    table = np.degrees(np.array(limits.horizon.altitudes))
    true_azimuth = np.degrees(np.arctan2(seen[:, 1], -seen[:, 0])) % 360.0
    horizon = np.degrees(np.arcsin(seen[:, 2])) - np.interp(true_azimuth, table[:, 0], table[:, 1], period=360.0)
    first, last = np.array(path.suns[0]), np.array(path.suns[1])
    sun = first + (last - first) * parts[:, None]
    cosine = (sun * seen).sum(1) / np.linalg.norm(sun, axis=1)
    return horizon, np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)) - limits.sun_avoidance)


def checks(path, limits, *, ends_clear=True):
    return path.checks(limits, ends_clear=ends_clear)


@pytest.mark.campaign
def test_no_accepted_path_touches_a_zone_and_every_refused_one_does():
    rng = np.random.default_rng(4)
    mount = Mount(MountType.ALTAZ_FORK, 0.6)
    limits = Limits(HILLS, math.radians(25.0))
    accepted = refused = 0
    least = math.inf
    while accepted < PATHS or refused < PATHS:
        ends = rng.uniform(-180.0, 540.0, 2), rng.uniform(-5.0, 91.0, 2)
        rates = rng.uniform(-4.0, 4.0, 2) * rng.integers(0, 2)
        sun = rng.uniform(0.0, 360.0), rng.uniform(0.0, 80.0)
        path = SlewPath(
            mount,
            (leg(*ends[0], rates[0]), leg(*ends[1], rates[1])),
            (sun_at(*sun), sun_at(sun[0] + rng.uniform(0.0, 2.0), sun[1])),
        )
        if min(rooms(path, limits, moments=1)) < 0.1:  # it begins in a zone
            continue
        horizon, bright = rooms(path, limits)
        for check, room in zip(checks(path, limits), (horizon.min(), bright.min()), strict=True):
            if check.ok:
                accepted, least = accepted + 1, min(least, room)
                assert room > -TOLERANCE_DEG, check.detail
            else:
                refused += 1
                assert room < 5 * TOLERANCE_DEG, check.detail  # a hilltop may pass between two moments
    print(f"{accepted} accepted, the lowest {least:.3f}° clear; {refused} refused")


def test_a_start_that_leads_astray_is_followed_to_where_it_turns():
    """Moving down at 4°/s, the axis dips by 8° before it turns; the ends alone are clear."""
    limits = Limits(Horizon.level(20.0))
    mount = Mount(MountType.ALTAZ_FORK, 0.6)
    suns = (sun_at(0.0, 90.0),) * 2
    dips, _ = checks(SlewPath(mount, (leg(10.0, 10.0), leg(25.0, 40.0, -4.0)), suns), limits)
    stays, _ = checks(SlewPath(mount, (leg(10.0, 10.0), leg(29.0, 40.0, -4.0)), suns), limits)
    assert not dips.ok
    assert stays.ok
    assert dips.detail.endswith("below the horizon limit of 20.00°")


def test_the_sun_is_where_it_is_when_the_telescope_passes():
    """A slow slew towards where the Sun was: by then it has gone on."""
    limits = Limits(Horizon.level(0.0), math.radians(10.0))
    mount = Mount(MountType.ALTAZ_FORK, 0.6)
    legs = leg(100.0, 189.0), leg(30.0, 30.0)
    still = SlewPath(mount, legs, (sun_at(197.0, 30.0), sun_at(197.0, 30.0)))
    gone = SlewPath(mount, legs, (sun_at(197.0, 30.0), sun_at(203.0, 30.0)))
    assert not checks(still, limits)[1].ok
    assert checks(gone, limits)[1].ok


def test_an_axis_that_tracks_while_the_other_slews_is_followed():
    """One axis has landed and tracks down into the hills while the other takes another minute."""
    limits = Limits(Horizon.level(20.0))
    mount = Mount(MountType.ALTAZ_FORK, 0.6)
    suns = (sun_at(0.0, 90.0),) * 2
    waits = SlewPath(mount, (leg(0.0, 240.0), leg(20.1, 20.1)), suns)
    sinks = SlewPath(mount, (leg(0.0, 240.0), leg(20.1, 20.1, 0.0, -0.01)), suns)
    assert checks(waits, limits)[0].ok
    assert not checks(sinks, limits)[0].ok


@pytest.mark.parametrize(
    ("ends_deg", "ends_clear", "ok"),
    [
        ((5.0, 45.0), True, True),  # out
        ((5.0, 15.0), True, False),  # towards the edge, but not out
        ((5.0, 15.0), False, True),  # a jog on the way out
        ((15.0, 5.0), False, False),  # deeper
        ((5.0, 5.0), False, True),  # stays, as a parked telescope does
        ((45.0, 15.0), False, False),  # in
    ],
)
def test_a_path_that_begins_inside_a_zone_may_only_lead_out(ends_deg, ends_clear, ok):
    limits = Limits(Horizon.level(20.0))
    path = SlewPath(Mount(MountType.ALTAZ_FORK, 0.6), (leg(0.0, 0.0), leg(*ends_deg)), (sun_at(0.0, 90.0),) * 2)
    assert checks(path, limits, ends_clear=ends_clear)[0].ok is ok


def test_what_was_gained_on_the_way_out_is_not_given_back():
    """Out of one hill and into the next: the second is no deeper than the start was, and refused all the same."""
    limits = Limits(HILLS)
    mount = Mount(MountType.ALTAZ_FORK, 0.6)
    path = SlewPath(mount, (leg(90.0, 280.0), leg(14.0, 50.0)), (sun_at(0.0, 90.0),) * 2)
    horizon, _ = rooms(path, limits)
    assert horizon[0] < -20.0
    inside = np.minimum(horizon, 0.0)
    assert (np.maximum.accumulate(inside) - inside).max() < TOLERANCE_DEG
    assert checks(path, limits)[0].ok
    out_and_in = SlewPath(mount, (leg(90.0, 300.0), leg(14.0, 33.0)), (sun_at(0.0, 90.0),) * 2)
    check = checks(out_and_in, limits)[0]
    assert not check.ok
    assert "at arrival is 2.00° below the horizon limit of 35.00°" in check.detail


def test_out_of_the_suns_zone_the_shorter_way_only():
    limits = Limits(Horizon.level(0.0), math.radians(30.0))
    mount = Mount(MountType.ALTAZ_FORK, 0.6)
    suns = (sun_at(180.0, 30.0),) * 2
    away = SlewPath(mount, (leg(190.0, 260.0), leg(30.0, 30.0)), suns)
    across = SlewPath(mount, (leg(190.0, 100.0), leg(30.0, 30.0)), suns)
    assert checks(away, limits)[1].ok
    refused = checks(across, limits)[1]
    assert not refused.ok
    assert "inside its zone of 30.0°" in refused.detail


def test_no_zone_is_said_to_be_none():
    path = SlewPath(Mount(MountType.ALTAZ_FORK, 0.6), (leg(0.0, 0.0), leg(30.0, 30.0)), (sun_at(0.0, 30.0),) * 2)
    check = checks(path, Limits(Horizon.level(0.0)))[1]
    assert check.ok
    assert check.detail == "no zone of avoidance is configured"
