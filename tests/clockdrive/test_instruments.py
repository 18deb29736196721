"""Targets are put on the instrument in force, by everything that points; the tube keeps the limits all the same."""

import math
import random

import pytest
from sky_bench import MOUNTS, Sky, standing
from telescope_bench import CENTRE, T0, star_at, telescope

from clockdrive import assembly
from clockdrive.configuration import load
from clockdrive.drives import kind_of
from clockdrive.errors import Refused
from clockdrive.planning import plan_from, rates_at
from pointing.errors import Unreachable
from pointing.instant import Instant
from pointing.limits import separation
from pointing.mount import Mount
from pointing.plan import Start
from pointing.targets import FixedAltAz

TWO = {
    "instruments.main.x_arcsec": 0.0,
    "instruments.camera.x_arcsec": 900.0,
    "instruments.camera.y_arcsec": -600.0,
}
CROOKED = {"mount__mount_x_mas": 900_000, "simulator__misalignment_x_arcsec": 900.0}  # known to be so


def rows(scope):
    return {row["name"]: row for row in scope.status()["corrections"]}


def along_the_tube(mount):
    return Mount(mount.type, mount.latitude, mount.x, mount.y)


@pytest.mark.parametrize(("kind", "latitude", "posture"), MOUNTS)
def test_choosing_an_instrument_moves_the_same_target_onto_it(kind, latitude, posture, tmp_path):
    """By the true mount, which has the origin as a collimation."""
    settings, place = standing(kind, latitude, posture)
    with telescope(tmp_path, **settings, **CROOKED, **TWO) as scope:
        sky, target = Sky(scope), star_at(scope, *place)
        scope.goto(target)
        scope.wait(20.0)
        on_main = math.hypot(*sky.off(target))
        answer = scope.instrument("camera")
        assert (answer["instrument"], answer["moved"]) == ("camera", True)
        scope.wait(20.0)
        assert (scope.status()["instrument"], scope.status()["posture"]) == ("camera", posture)
        on_camera = math.hypot(*sky.off(target))
        mount = scope._session.planner.mount
        angles = sky.witness.angles(sky.witness.now())
        apart = separation(along_the_tube(mount).observed(*angles), target.observed(sky.frame()))
    print(f"{kind} at {latitude}°, {posture}: {on_main:.2f}″ off on main, {on_camera:.2f}″ on the camera")
    assert max(on_main, on_camera) < 1.0
    assert math.degrees(apart) * 3600.0 == pytest.approx(math.hypot(900.0, 600.0), abs=1.5)


def test_guide_centre_and_offset_stay_with_the_target_when_the_instrument_is_changed(tmp_path):
    with telescope(tmp_path, **TWO) as scope:
        sky, target = Sky(scope), star_at(scope, 75.0, 52.0)
        scope.goto(target)
        scope.offset(10.0, 0.0)
        scope.guide("north", 4000)
        scope.wait(15.0)
        before = sky.off(target)
        scope.instrument("camera")
        scope.wait(15.0)
        assert sky.off(target) == pytest.approx(before, abs=0.7)
        assert rows(scope)["guide north"]["value"] == pytest.approx(30.1, abs=0.1)


def test_the_choice_is_kept_between_commands_and_stands_in_the_ledger(tmp_path):
    with telescope(tmp_path, **TWO) as scope:
        assert scope.instrument()["instrument"] == "main"
        assert not scope.instrument("camera")["moved"]
        assert scope.events(1)[0].text == "camera in place of main"
    with telescope(tmp_path, start=T0 + 60.0, **TWO) as scope:
        ledger = rows(scope)
        assert ledger["pointing origin x"]["value"] == pytest.approx(900.0)
        assert ledger["pointing origin y"]["value"] == pytest.approx(-600.0)
        assert ledger["pointing origin x"]["origin"] == "camera"
        sky, target = Sky(scope), star_at(scope, 75.0, 52.0)
        arrival = scope.goto(target)
        assert any("put on camera, x 900″, y -600″" in note for note in arrival["notes"])
        scope.wait(20.0)
        assert math.hypot(*sky.off(target)) < 1.0
        assert math.dist(sky.off(scope._session.wanted), sky.off(target)) == 0.0
        moved = scope.sync(target)
        assert moved * 3600.0 < 2.0  # a sync counts to the origin as well
    with telescope(tmp_path, start=T0 + 600.0) as scope:  # the camera is no longer configured
        assert scope.status()["instrument"] == "main"


def test_the_default_is_main_or_the_first():
    assert assembly.instruments(load(None, {}, TWO)).name == "main"
    other = {"instruments.guider.x_arcsec": 5.0, "instruments.camera.x_arcsec": 1.0}
    assert assembly.instruments(load(None, {}, other)).name == "guider"


def test_an_unknown_instrument_is_refused_with_those_there_are(tmp_path):
    with telescope(tmp_path, **TWO) as scope:
        with pytest.raises(
            Refused, match=r"no instrument 'cam': there is main, camera; a table \[instruments.NAME\]"
        ):
            scope.instrument("cam")
        assert scope.status()["instrument"] == "main"
    with pytest.raises(Refused, match="no instrument 'cam'"):
        plan_from(load(None, {}, TWO), "Canopus", T0, (CENTRE, CENTRE), instrument="cam")


def test_plans_and_rates_without_a_drive_take_the_instrument_named():
    configuration = load(None, {}, {**TWO, "limits.sun_avoidance_deg": 0.0})
    plans = {
        name: plan_from(configuration, "Canopus", T0, (CENTRE, CENTRE), instrument=name)
        for name in ("main", "camera")
    }
    assert plan_from(configuration, "Canopus", T0, (CENTRE, CENTRE)).plan.axes == plans["main"].plan.axes
    planner = assembly.planner(configuration, "camera")
    for name, plan in plans.items():
        angles = [axis.angle for axis in plan.plan.axes]
        here = planner.sky.at(Instant.from_posix(plan.plan.arrival))
        assert separation(plan.plan.observed, assembly_target().observed(here)) < 1e-5
        assert (separation(planner.mount.observed(*angles), plan.plan.observed) < 1e-9) == (name == "camera")
    one, two = (rates_at(configuration, "Canopus", T0, instrument=name)["axes"] for name in ("main", "camera"))
    assert one[0]["angle_deg"] != two[0]["angle_deg"]


def assembly_target():
    from pointing.catalogue import find

    return find("Canopus")


WIDE = {"instruments.main.x_arcsec": 0.0, "instruments.finder.x_arcsec": 18000.0, "limits.horizon_deg": 20.0}


def test_with_an_origin_far_off_the_axis_the_limits_are_wider_by_as_much(tmp_path):
    with telescope(tmp_path, **WIDE) as scope:
        low = star_at(scope, 75.0, 23.0)
        assert scope.plan(low)["ok"]
        assert scope.instrument("finder")["limits_widened_deg"] == pytest.approx(5.0)
        with pytest.raises(Unreachable, match=r"below the horizon limit of 25\.00°"):
            scope.plan(low)
        high = scope.plan(star_at(scope, 75.0, 27.0))
        assert "5.00° wider" in high["notes"][-1]


def test_tube_and_origin_both_keep_sun_and_horizon_wherever_a_plan_ends():
    """Over the whole sky, by day: what a plan allows the origin, the tube's axis is allowed."""
    values = {**WIDE, "limits.sun_avoidance_deg": 20.0, "axis2.max_deg": 120.0}
    wide, bare = (assembly.planner(load(None, {}, values), name) for name in ("finder", "main"))
    nearest, lowest, allowed = math.inf, math.inf, 0
    for step in range(400):
        axis1, axis2 = -1.5 + 3.0 * (step % 20) / 19.0, -1.5 + 2.6 * (step // 20) / 19.0
        if not all(check.ok for check in wide.standing((axis1, axis2), T0)):
            continue
        allowed += 1
        sun = wide.sky.at(Instant.from_posix(T0)).sun()
        for mount in (wide.mount, bare.mount):
            seen = mount.observed(axis1, axis2)
            nearest = min(nearest, math.degrees(separation(seen, sun)))
            lowest = min(lowest, math.degrees(math.asin(seen[2])))
        assert all(check.ok for check in bare.standing((axis1, axis2), T0))
    print(f"{allowed} places allowed: tube and origin at least {nearest:.1f}° from the Sun, {lowest:.1f}° high")
    assert allowed > 50
    assert nearest >= 20.0
    assert lowest >= 20.0


def test_on_the_whole_way_of_a_slew_tube_and_origin_keep_sun_and_horizon():
    """The travel of both axes, looked at every 0.2 s through both mounts."""
    values = {**WIDE, "limits.sun_avoidance_deg": 20.0, "limits.horizon_deg": 15.0}
    configuration = load(None, {}, values)
    wide, bare = (assembly.planner(configuration, name) for name in ("finder", "main"))
    sun = wide.sky.at(Instant.from_posix(T0)).sun()
    chance = random.Random(4)  # noqa: S311
    nearest, lowest, ways, refused, counts = math.inf, math.inf, 0, 0, (CENTRE, CENTRE)
    for _ in range(150):
        altitude = math.asin(chance.uniform(math.sin(math.radians(16.0)), 1.0))
        try:
            target = FixedAltAz(chance.uniform(0.0, math.tau), altitude)
            plan = wide.plan(target, Start(T0, counts), kind_of(configuration).timing(configuration))
        except Unreachable:
            refused += 1
            continue
        ways += 1
        for step in range(int(plan.eta / 0.2) + 2):
            at = [axis.travel.position(min(0.2 * step, axis.travel.duration)) for axis in plan.axes]
            for mount in (wide.mount, bare.mount):
                seen = mount.observed(*wide.angles((at[0], at[1])))
                nearest = min(nearest, math.degrees(separation(seen, sun)))
                lowest = min(lowest, math.degrees(math.asin(seen[2])))
        counts = plan.axes[0].target_counts, plan.axes[1].target_counts
    print(f"{ways} ways, {refused} refused: at least {nearest:.2f}° from the Sun, {lowest:.2f}° high")
    assert ways > 40
    assert nearest >= 20.0 - 0.02  # what the proof of a path may miss
    assert lowest >= 15.0 - 0.02


@pytest.mark.parametrize("x_arcsec", [18000.0, -18000.0])
def test_an_instrument_on_which_the_target_must_not_be_put_is_not_taken(x_arcsec, tmp_path):
    """Whether it is where it looks now that is forbidden, or where the target is."""
    with telescope(tmp_path, **WIDE | {"instruments.finder.x_arcsec": x_arcsec}) as scope:
        target = star_at(scope, 75.0, 22.0)
        scope.goto(target)
        with pytest.raises((Refused, Unreachable), match=r"below the horizon limit of 25"):
            scope.instrument("finder")
        assert scope.status()["instrument"] == "main"
        scope.wait(20.0)
        assert scope.status()["doing"] == "tracking"
        assert scope.status()["error_arcsec"] < 1.0


def test_a_target_that_comes_where_the_origin_does_not_ends_the_tracking_with_a_sentence(tmp_path):
    """An altazimuth mount whose origin, 2° across, passes the zenith by."""
    settings = {"mount__type": "altaz-fork", "site__latitude_deg": -42.4, "instruments.main.x_arcsec": 7200.0}
    with telescope(tmp_path, **settings) as scope:
        overhead = star_at(scope, 90.0, 89.0)
        with pytest.raises(Unreachable, match=r"the place is 0\.99\d\d° from the pole of axis 1.*2\.0000° beside"):
            scope.goto(overhead)
        assert not scope._session.planner.allowed(overhead, scope.clock.now())
        scope.goto(star_at(scope, 90.0, 87.7))
        scope.wait(300.0)
        assert scope.status()["doing"] == "idle"
        assert "from the pole of axis 1" in scope.status()["trouble"]


def test_a_parked_telescope_may_change_its_instrument_and_a_slewing_one_not(tmp_path):
    with telescope(tmp_path, **TWO) as scope:
        told = []

        def report(_progress):
            with pytest.raises(Refused) as caught:
                scope.instrument("camera")
            told.append(str(caught.value))

        scope.goto(star_at(scope, 75.0, 52.0), report)
        assert told
        scope.park()
        assert not scope.instrument("camera")["moved"]
        assert scope.status()["doing"] == "parked"


# The rule is one of small angles: it leaves the square of the distance, with the tangent of altitude or declination.
SQUARE_ARCSEC = math.hypot(900.0, 600.0) ** 2 * math.radians(1.0 / 3600.0) * math.tan(math.radians(52.0))


@pytest.mark.parametrize(("kind", "latitude", "posture"), [case for case in MOUNTS if case[0] != "altaz-fork"])
def test_an_origin_is_measured_by_the_offset_that_brings_a_star_onto_it(kind, latitude, posture, tmp_path):
    """The rule of the configuration page for equatorial mounts."""
    settings, place = standing(kind, latitude, posture)
    turned = 1.0 if posture == "normal" else -1.0
    assert _off_camera_arcsec(tmp_path, settings, place, 900.0 * turned, 600.0 * turned) < SQUARE_ARCSEC


@pytest.mark.parametrize("latitude", [-42.4, 51.5])
def test_on_an_altazimuth_mount_the_offset_is_turned_by_the_parallactic_angle(latitude, tmp_path):
    from clockdrive.fits_header import cards

    settings, place = standing("altaz-fork", latitude, "normal")
    with telescope(tmp_path / "first", **settings, **TWO) as scope:
        scope.goto(star_at(scope, *place))
        q = math.radians(cards(scope.status().json, scope.configuration)["PARANGLE"])
    x, y = 900.0, -600.0  # the inverse of x = E cos q − N sin q, y = −E sin q − N cos q
    east, north = x * math.cos(q) - y * math.sin(q), -x * math.sin(q) - y * math.cos(q)
    assert _off_camera_arcsec(tmp_path, settings, place, east, north) < SQUARE_ARCSEC


def _off_camera_arcsec(folder, settings, place, east, north):
    """How far the target is from the camera, with `main` in force and the offset given."""
    with telescope(folder, **settings, **TWO) as scope:
        sky, target = Sky(scope), star_at(scope, *place)
        scope.offset(east, north)
        scope.goto(target)
        scope.wait(10.0)
        camera = assembly.planner(scope.configuration, "camera").mount
        seen = camera.observed(*sky.witness.angles(sky.witness.now()))
        off = math.degrees(separation(seen, target.observed(sky.frame()))) * 3600.0
    print(f"offset {east:.0f}″, {north:.0f}″ leaves the star {off:.2f}″ beside the camera")
    return off
