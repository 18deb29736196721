"""Passes against skyfield's, against every second of the day, and none missed of a whole catalogue."""

import math
import random
import time

import numpy as np
import pytest
from planning_bench import planner
from satellites import EPOCH_UTC, NO_DRAG, ORBITS, catalogue, lines
from skyfield.api import EarthSatellite, Loader, wgs84

import pointing
from pointing.catalogue import find
from pointing.earth_orientation import earth_orientation
from pointing.errors import PointingError, TargetError
from pointing.instant import DAY, Instant
from pointing.limits import Horizon
from pointing.mount import POSTURES, MountType
from pointing.satellite import Satellite
from pointing.site import Site, Weather
from pointing.sky import Sky
from pointing.targets import FixedAltAz, Star
from pointing.tle import Tle, read_tle
from pointing.vectors import from_azimuth_altitude
from pointing.visibility import never, passes

START = Instant.from_utc_iso(EPOCH_UTC).posix()
EVERYWHERE = ((-360.0, 360.0), (-90.0, 90.0))
RUGGED = Horizon(
    tuple((math.radians(a), math.radians(h)) for a, h in ((0, 5), (60, 30), (90, 8), (200, 22), (300, 5)))
)


def test_the_package_gives_the_search_itself():
    assert pointing.passes is passes
    assert pointing.Satellite is Satellite
    assert pointing.read_tle is read_tle


def satellite(name):
    return Satellite(Tle(*ORBITS[name], name))


def without_air(geometry):
    site = geometry.sky.site
    geometry.sky = Sky(Site(site.latitude, site.longitude, site.height_m, Weather(refraction=False)))
    return geometry


@pytest.fixture
def sets(tmp_path):
    path = tmp_path / "many.tle"
    path.write_text(catalogue(200), encoding="utf-8")
    return read_tle(path)


@pytest.mark.parametrize("name", ["400 km", "sun-synchronous", "Molniya", "GPS"])
def test_passes_are_those_of_skyfield(name):
    geometry = without_air(planner(MountType.ALTAZ_FORK, horizon=Horizon.level(10.0), limits_deg=EVERYWHERE))
    target, days = satellite(name), 3
    ts = Loader(".", verbose=False).timescale(builtin=True)
    ut1 = 69.184 - earth_orientation(Instant.from_posix(START)).dut1
    ts.delta_t_function = lambda _: ut1
    begin = Instant.from_posix(START)
    t0, t1 = (ts.tt_jd(2400000.5 + begin.day + days, begin.seconds / DAY) for days in (0, days))
    model = EarthSatellite(target.elements.line1, target.elements.line2, ts=ts)
    times, kinds = model.find_events(wgs84.latlon(-42.4, 173.7, 30.0), t0, t1, altitude_degrees=10.0)
    theirs = {
        kind: [float((t.whole - t0.whole + t.tt_fraction - t0.tt_fraction) * DAY) for t in times[kinds == kind]]
        for kind in (0, 1, 2)
    }
    found = list(passes(geometry, target, START, START + days * DAY))
    rises = [each.rise for each in found if not each.begun]
    sets = [each.set for each in found if not each.unfinished]
    assert len(rises) == len(theirs[0]) >= 3
    assert len(sets) == len(theirs[2])
    off = [
        abs(one.time - START - other)
        for one, other in (*zip(rises, theirs[0], strict=True), *zip(sets, theirs[2], strict=True))
    ]
    tops = [min(abs(each.culmination.time - START - t) for t in theirs[1]) for each in found[1:-1]]
    print(f"{name}: {len(found)} passes: rise and set within {max(off):.3f} s, culmination {max(tops):.3f} s")
    assert max(off) < 0.25  # skyfield looks for them to half a second, and for where the light began
    assert max(tops) < 0.25
    way = model - wgs84.latlon(-42.4, 173.7, 30.0)

    def altitude_and_light(seconds):
        altitude, _, distance = way.at(ts.tt_jd(t0.whole, t0.tt_fraction + seconds / DAY)).altaz()
        return altitude.degrees, distance.km / 299792.458

    for one, climbs in (*((each, 1) for each in rises), *((each, -1) for each in sets)):
        _, light = altitude_and_light(one.time - START)
        early, late = (altitude_and_light(one.time - START - light + by)[0] for by in (-0.1, 0.1))
        assert climbs * early < climbs * 10.0 < climbs * late


@pytest.mark.parametrize("kind", MountType)
def test_passes_are_what_is_allowed_at_every_tenth_second(kind):
    """Against the planner's own answer, on a rugged horizon, with a zone of the Sun and limits of the axes."""
    rng = random.Random(kind.value)  # noqa: S311 - nothing secret
    geometry = planner(kind, horizon=RUGGED, sun_deg=40.0, limits_deg=((-100.0, 110.0), (-70.0, 75.0)), x_deg=1.0)
    targets = [satellite("400 km"), satellite("GPS"), Star.from_degrees(rng.uniform(0, 360), -40.0, "star")]
    checked = edges = 0
    for target in targets:
        step = 20.0 if isinstance(target, Satellite) and target.name == "400 km" else 200.0
        found = list(passes(geometry, target, START, START + DAY))
        for each in found:
            assert each.rise.time <= each.culmination.time <= each.set.time
            assert each.culmination.altitude >= max(each.rise.altitude, each.set.altitude)
            for moment, outside, known in (
                (each.rise.time, each.rise.time - 0.1, each.begun),
                (each.set.time, each.set.time + 0.1, each.unfinished),
            ):
                assert geometry.allowed(target, moment)
                assert known or not geometry.allowed(target, outside)
                edges += not known
        for moment in np.arange(START, START + DAY, step):
            expected = any(each.rise.time <= moment <= each.set.time for each in found)
            near = any(abs(moment - edge) < 0.1 for each in found for edge in (each.rise.time, each.set.time))
            assert near or geometry.allowed(target, moment) == expected
            checked += 1
    print(f"{kind.text}: {checked} moments and {edges} edges as the planner has them")
    assert edges >= 4


def moved(direction, angle, rng):
    """A direction, turned by an angle in a random way."""
    across = np.cross(direction, [rng.gauss(0, 1) for _ in range(3)])
    there = np.array(direction) * math.cos(angle) + across / np.linalg.norm(across) * math.sin(angle)
    return tuple(there.tolist())


@pytest.mark.parametrize("kind", MountType)
def test_an_edge_is_never_nearer_than_said(kind):
    rng = random.Random(12)  # noqa: S311 - nothing secret
    geometry = planner(kind, limits_deg=((-60.0, 130.0), (-50.0, 100.0)), x_deg=2.0, y_deg=-1.0, horizon=RUGGED)
    horizon = geometry.limits.horizon
    outside = 0
    for _ in range(3000):
        here = from_azimuth_altitude(rng.uniform(0, math.tau), math.asin(rng.uniform(-1, 1)))
        reach, margin = geometry.reach(here), horizon.margin(here)
        ways = [geometry.windings(geometry.mount.axes(here, posture), (0.0, 0.0)) for posture in POSTURES]
        assert (reach >= 0.0) == any(True for way in ways for _ in way)
        outside += reach < 0.0
        assert (geometry.reach(moved(here, 0.999 * abs(reach), rng)) >= 0.0) == (reach >= 0.0)
        assert (horizon.margin(moved(here, 0.999 * horizon.distance(here), rng)) >= 0.0) == (margin >= 0.0)
    print(f"{kind.text}: {outside} of 3000 directions outside")
    assert 100 < outside < 2900


def test_of_a_whole_catalogue_no_pass_is_missed(sets):
    """Against a look every ten seconds by SGP4's plain altitudes, above the limit by what refraction can hide."""
    geometry = planner(MountType.ALTAZ_FORK, horizon=Horizon.level(15.0), limits_deg=EVERYWHERE)
    seconds = np.arange(0.0, DAY, 10.0)
    begun = time.perf_counter()
    every = {each: list(passes(geometry, Satellite(each), START, START + DAY)) for each in sets}
    spent = time.perf_counter() - begun
    missed = invented = 0
    for each, found in every.items():
        altitudes, _ = Satellite(each).altitudes(geometry.sky, Instant.from_posix(START), seconds)
        inside = np.zeros(len(seconds), dtype=bool)
        for one in found:
            inside |= (seconds >= one.rise.time - START) & (seconds <= one.set.time - START)
        missed += int(np.sum((altitudes > math.radians(15.02)) & ~inside))
        invented += int(np.sum((altitudes < math.radians(14.9)) & inside))  # refraction lifts by 0.06°
    total = sum(len(found) for found in every.values())
    print(
        f"{len(sets)} satellites, 24 h: {total} passes in {spent:.1f} s, {missed} looks missed, {invented} invented"
    )
    assert total > 400
    assert (missed, invented) == (0, 0)


def test_an_altitude_can_be_asked_for_besides_the_limits():
    geometry = planner(MountType.ALTAZ_FORK, limits_deg=EVERYWHERE)
    lower = list(passes(geometry, satellite("400 km"), START, START + DAY))
    higher = list(passes(geometry, satellite("400 km"), START, START + DAY, above=math.radians(30.0)))
    assert 0 < len(higher) < len(lower)
    for each in higher:
        assert math.degrees(each.rise.altitude) == pytest.approx(30.0, abs=0.05)
        assert math.degrees(each.set.altitude) == pytest.approx(30.0, abs=0.05)
        assert each.duration == each.set.time - each.rise.time > 0.0


def test_a_search_begins_and_ends_in_the_middle_of_passes():
    geometry = planner(MountType.ALTAZ_FORK, limits_deg=EVERYWHERE)
    whole = next(each for each in passes(geometry, satellite("GPS"), START, START + DAY) if not each.begun)
    (cut,) = passes(geometry, satellite("GPS"), whole.rise.time + 600.0, whole.rise.time + 900.0)
    assert (cut.begun, cut.unfinished, cut.duration) == (True, True, 300.0)
    (still,) = passes(geometry, FixedAltAz(1.0, 0.8), START, START + 1000.0)
    assert (still.begun, still.unfinished) == (True, True)


def test_progress_reaches_the_end_and_never_goes_back():
    done = []
    list(passes(planner(MountType.ALTAZ_FORK), find("Canopus"), START, START + DAY, progress=done.append))
    assert done == sorted(done)
    assert (done[0] > 0.0, done[-1]) == (True, 1.0)


def test_what_never_rises_is_told_with_its_highest_altitude():
    geometry = planner(MountType.ALTAZ_FORK)
    assert list(passes(geometry, find("Polaris"), START, START + DAY)) == []
    said = never(geometry, find("Polaris"), START, START + DAY)
    assert (
        "Polaris does not rise above 5.00°: the highest is -41." in said
    )  # less than a degree from the pole, 42.4° down
    distant = Satellite(Tle(*lines(7, 0.05, 80.0, 0.0002, 90.0, 70.0, 1.00273, NO_DRAG), "elsewhere"))
    assert list(passes(geometry, distant, START, START + DAY)) == []
    assert "elsewhere does not rise above 5.00°" in never(geometry, distant, START, START + DAY)


def test_what_rises_but_is_forbidden_is_told_with_what_forbids_it():
    geometry = planner(MountType.EQUATORIAL_FORK, limits_deg=((-5.0, 5.0), (-1.0, 1.0)))
    assert list(passes(geometry, find("Canopus"), START, START + DAY)) == []
    said = never(geometry, find("Canopus"), START, START + DAY)
    assert "Canopus rises to 79." in said
    assert "outside" in said


def test_a_satellite_that_falls_gives_its_passes_and_then_its_reason():
    geometry = planner(MountType.ALTAZ_FORK, limits_deg=EVERYWHERE)
    falling = Satellite(Tle(*lines(8, 51.6, 10, 0.0005, 20, 30, 16.35, " 90000-3"), "FALLING"))
    found = []
    with pytest.raises(TargetError, match="decayed"):
        found.extend(passes(geometry, falling, START, START + 10.0 * DAY))
    # What comes one by one is kept by who takes it one by one.
    given = passes(geometry, falling, START, START + 10.0 * DAY)
    assert next(given).rise.time < START + 3.0 * DAY


@pytest.mark.parametrize("seconds", [0.0, -1.0, math.nan, math.inf])
def test_a_search_of_no_time_is_refused(seconds):
    with pytest.raises(PointingError, match="give a positive time"):
        next(passes(planner(MountType.ALTAZ_FORK), find("Vega"), START, START + seconds))
