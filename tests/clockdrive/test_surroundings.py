"""A telescope follows the air and notices its clock, between two cycles and without waiting."""

import json
import math
import os

import pytest
from planning_bench import MIDNIGHT, timing
from planning_bench import planner as planner_of

from clockdrive.clock import SystemClock, VirtualClock
from clockdrive.errors import WeatherError
from clockdrive.surroundings import Surroundings
from pointing.mount import MountType
from pointing.plan import Start
from pointing.targets import FixedAltAz


@pytest.fixture
def planner():
    return planner_of(MountType.ALTAZ_FORK)


def station(path, now, **values):
    path.write_text(json.dumps(values), encoding="utf-8")
    os.utime(path, (now, now))


def test_the_planner_looks_through_the_measured_air_from_the_next_cycle_on(planner, tmp_path):
    clock = VirtualClock(MIDNIGHT)
    configured = planner.sky
    hpa = configured.site.weather.pressure_hpa
    path = tmp_path / "station.json"
    station(path, MIDNIGHT - 5.0, pressure_hpa=hpa - 20.0, temperature_c=5.0)
    around = Surroundings(planner, clock, "file:station.json", tmp_path)
    assert around.open(clock.now()) == ()
    assert planner.sky.site.weather.pressure_hpa == hpa - 20.0
    assert planner.sky is not configured
    for _ in range(10):
        before = planner.sky
        clock.sleep(1.0)
        assert around.follow(clock.now(), "tracking") == ()
        assert planner.sky is before, "the same air keeps the same sky"
    station(path, clock.now(), pressure_hpa=hpa - 21.0, temperature_c=5.0)
    clock.sleep(30.0)
    around.follow(clock.now(), "tracking")
    assert planner.sky.site.weather.pressure_hpa == hpa - 21.0
    assert around.air.age_s == 30.0


def test_the_effect_is_always_against_the_configured_air_and_is_what_the_sky_does(planner, tmp_path):
    configured = planner.sky
    station(tmp_path / "s", MIDNIGHT, pressure_hpa=990.0, temperature_c=-5.0)
    around = Surroundings(planner, VirtualClock(MIDNIGHT), "file:s", tmp_path)
    around.open(MIDNIGHT)
    altitude = math.radians(45.0)
    expected = math.degrees(planner.sky.refraction(altitude) - configured.refraction(altitude)) * 3600.0
    assert around.effect_arcsec(altitude) == pytest.approx(expected, abs=1e-9)
    notes = around.notes(MIDNIGHT, altitude)
    print("\n".join(notes))
    assert notes[0].startswith("clock synchronised")
    assert f"{expected:+.1f}″" in notes[1]
    assert "0 s old" in notes[1]


def test_a_plan_to_the_measured_air_differs_by_nothing_for_an_observed_place(planner, tmp_path):
    """A place given as it is seen does not know of refraction; its plan must not change with the weather."""
    target = FixedAltAz(math.radians(120.0), math.radians(50.0))
    start = Start(MIDNIGHT, (float(0x800000), float(0x800000)))
    before = planner.plan(target, start, timing())
    station(tmp_path / "s", MIDNIGHT, pressure_hpa=990.0, temperature_c=-5.0)
    Surroundings(planner, VirtualClock(MIDNIGHT), "file:s", tmp_path).open(MIDNIGHT)
    after = planner.plan(target, start, timing())
    assert [axis.target_counts for axis in after.axes] == [axis.target_counts for axis in before.axes]


def test_a_station_that_fails_is_told_once_and_again_when_it_is_back(planner, tmp_path):
    clock, path = VirtualClock(MIDNIGHT), tmp_path / "s"
    station(path, MIDNIGHT, temperature_c=5.0)
    around = Surroundings(planner, clock, "file:s", tmp_path)
    around.open(clock.now())
    path.unlink()
    told = []
    for _ in range(600):
        clock.sleep(1.0)
        told += around.follow(clock.now(), "tracking")
    assert len(told) == 1
    assert "cannot be read" in told[0]
    assert "goes on being used" in around.notes(clock.now(), 0.8)[-1]
    assert planner.sky.site.weather.temperature_c == 5.0
    station(path, clock.now(), temperature_c=4.0)
    clock.sleep(31.0)
    told = around.follow(clock.now(), "tracking")
    assert len(told) == 1
    assert told[0].startswith("the weather is measured again")


def test_a_clock_that_is_stepped_during_a_slew_is_told_with_what_was_being_done(planner, monkeypatch):
    monkeypatch.setattr("clockdrive.clock_watch.running_time", lambda: 0.0)

    class Stepped:
        time = MIDNIGHT

        def now(self):
            return self.time

        def sleep(self, seconds):
            self.time += seconds

    clock = Stepped()
    around = Surroundings(planner, clock)
    assert around.follow(clock.now(), "the slew to M1") == ()
    clock.time += 2.4
    (told,) = around.follow(clock.now(), "the slew to M1")
    assert told.startswith("the clock was stepped by +2.4 s during the slew to M1")
    assert around.follow(clock.now(), "the slew to M1") == ()


def test_without_a_source_the_configured_air_and_sky_stay(planner):
    sky = planner.sky
    around = Surroundings(planner, SystemClock())
    assert around.open(SystemClock().now()) == ()
    assert planner.sky is sky
    assert around.effect_arcsec(0.5) == 0.0
    assert len(around.notes(SystemClock().now(), 0.5)) == 1


def test_a_source_that_is_none_is_refused_at_once(planner):
    with pytest.raises(WeatherError, match="write file:PATH"):
        Surroundings(planner, VirtualClock(MIDNIGHT), "smoke:signals")
