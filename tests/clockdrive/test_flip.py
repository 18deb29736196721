"""Flips, by command and by themselves, and the way out of the Sun's zone: the true axes say where they went."""

import math

import pytest
from telescope_bench import T0, Witness, star_at, telescope

from clockdrive.errors import Refused
from pointing.errors import Unreachable
from pointing.instant import Instant
from pointing.limits import separation
from pointing.site import Site
from pointing.sky import Sky

GERMAN = {"mount__type": "german", "limits__hour_angle_past_meridian_deg": 1.0}


def before_the_meridian(scope, minutes, declination_deg=-20.0):
    """A star that many minutes east of the meridian, north of the zenith."""
    latitude = scope.configuration.site.latitude_deg
    altitude = 90.0 - abs(latitude - declination_deg)
    return star_at(scope, 0.0, altitude, scope.clock.now() + 60.0 * minutes)


def test_a_flip_goes_on_with_the_same_target_on_the_other_side(tmp_path):
    with telescope(tmp_path, **GERMAN) as scope:
        witness, star = Witness(scope), before_the_meridian(scope, 8.0)
        scope.goto(star)
        first = scope.status()["posture"]
        scope.wait(9.0 * 60.0)
        begun = witness.now()
        answer = scope.flip()
        status = scope.status()
        assert status["posture"] != first
        assert status["doing"] == "tracking"
        assert answer["slews"] == 1
        off = witness.on_sky_arcsec(star, witness.now(), scope.clock.now())
        moved = [abs(b - a) for a, b in zip(begun, witness.now(), strict=True)]
        print(f"flip of {[round(each / 3600 * 0.9095) for each in moved]}°, {off:.2f}″ off afterwards")
        assert off < 2.0
        scope.wait(60.0)
        assert witness.on_sky_arcsec(star, witness.now(), scope.clock.now()) < 1.0


def test_a_flip_needs_a_target_and_is_refused_where_the_other_side_is_forbidden(tmp_path):
    with telescope(tmp_path, **GERMAN) as scope:
        with pytest.raises(Refused, match="none is tracked"):
            scope.flip()
        scope.goto(before_the_meridian(scope, 120.0))
        with pytest.raises(Unreachable, match=r"hour angle|axis1|reached|horizon|outside"):
            scope.flip()
        assert scope.status()["doing"] == "tracking"


@pytest.mark.parametrize("mount", ["equatorial-fork", "altaz-fork"])
def test_a_flip_that_the_travel_of_an_axis_never_allows_names_no_time(mount, tmp_path):
    """Beyond the pole lies past the travel of axis 2, at any time."""
    with telescope(tmp_path, mount__type=mount) as scope:
        star = star_at(scope, 90.0, 45.0)
        scope.goto(star)
        with pytest.raises(Unreachable, match=r"axis2 at .* outside") as refused:
            scope.flip()
        assert refused.value.reachable is None
        session = scope._session
        with pytest.raises(Unreachable) as refused:
            session.planner.plan(star, session.start(), session.timing(), "beyond")
        assert refused.value.reachable is None
        assert scope.status()["doing"] == "tracking"


@pytest.mark.parametrize("how", ["auto", "command"])
def test_at_the_end_of_its_window_a_german_mount_flips_by_itself_or_stops(how, tmp_path):
    with telescope(tmp_path, **GERMAN, mount__flip=how) as scope:
        witness, star = Witness(scope), before_the_meridian(scope, 8.0)
        scope.goto(star)
        first = scope.status()["posture"]
        found = scope.status()["next_limit"]
        assert found["name"] in {"hour-angle window", "axis1 soft limit"}
        lowest, highest = scope._session.planner.free[0].minimum, scope._session.planner.free[0].maximum
        for _ in range(16):
            scope.wait(60.0)
            angle = witness.angles(witness.now())[0]
            assert lowest <= angle <= highest
        status = scope.status()
        if how == "command":
            assert status["doing"] == "idle"
            assert "before it would lead out" in status["trouble"]
            return
        assert status["doing"] == "tracking"
        assert status["posture"] != first
        assert witness.on_sky_arcsec(star, witness.now(), scope.clock.now()) < 1.0


def test_stop_ends_a_flip_that_began_by_itself(tmp_path):
    with telescope(tmp_path, **GERMAN, mount__flip="auto") as scope:
        scope.goto(before_the_meridian(scope, 8.0))
        scope.wait(9.0 * 60.0)
        for _ in range(600):
            scope.wait(1.0)
            if scope.status()["doing"] == "slewing":
                break
        assert scope.status()["doing"] == "slewing"
        with pytest.raises(Refused, match="slewing"):
            scope.goto("best")
        scope.stop()
        scope.wait(20.0)
        assert scope.status()["doing"] == "idle"
        assert not any(axis.moved for axis in scope.simulator.axes)


def sun_at(scope, time):
    return scope._session.planner.sky.at(Instant.from_posix(time)).sun()


def morning():
    """POSIX seconds at which the Sun is half-way up at Kaikoura."""
    sky = Sky(Site.from_degrees(-42.4, 173.7, 30.0))
    heights = [sky.at(Instant.from_posix(T0 + 600.0 * k)).sun()[2] for k in range(150)]
    return T0 + 600.0 * next(k for k in range(149) if heights[k] < 0.5 <= heights[k + 1])


@pytest.mark.parametrize("tracking", [True, False])
@pytest.mark.parametrize("escape", ["away", "stop"])
def test_the_sun_that_comes_to_the_telescope_moves_it_away_or_is_told(escape, tracking, tmp_path):
    with telescope(tmp_path, start=morning(), limits__sun_avoidance_deg=20.0, limits__sun_escape=escape) as scope:
        now = scope.clock.now()
        x, y, z = sun_at(scope, now + 6000.0)  # where the Sun will be
        azimuth, altitude = math.degrees(math.atan2(y, -x)) % 360.0, math.degrees(math.asin(z))
        place = f"altaz:{azimuth + 4.0:.3f},{min(altitude, 80.0):.3f}"
        scope.goto(place)
        if not tracking:
            scope.stop()
        witness, closest = Witness(scope), math.pi
        for _ in range(40):
            scope.wait(60.0)
            looks = scope._session.planner.mount.observed(*witness.angles(witness.now()))
            closest = min(closest, separation(looks, sun_at(scope, scope.clock.now())))
        events = [event.text for event in scope.events(400) if event.kind == "Sun"]
        print(f"{escape}, {'tracking' if tracking else 'idle'}: at least {math.degrees(closest):.2f}° from the Sun")
        if escape == "away":
            assert math.degrees(closest) > 20.0 - 0.01
            assert any("moves away by itself" in text for text in events)
        else:
            assert sum("move it away" in text for text in events) == 1
            assert scope.status()["doing"] == "idle"
