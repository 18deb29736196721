"""Every correction counts once, has a name and a value, and can be taken away."""

import math

import pytest
from telescope_bench import ARCSEC_PER_COUNT, Witness, star_at, telescope

from clockdrive.errors import Refused
from pointing.targets import FixedAltAz
from pointing.vectors import azimuth_altitude


@pytest.fixture
def scope(tmp_path):
    with telescope(tmp_path) as opened:
        yield opened


def in_force(scope, name):
    return next((row["value"] for row in scope.status()["corrections"] if row["name"] == name), None)


def off_arcsec(scope, witness, target):
    return witness.on_sky_arcsec(target, witness.now(), scope.clock.now())


def test_an_offset_moves_the_telescope_on_the_sky_by_as_much_and_is_cleared_by_its_name(scope):
    witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
    scope.goto(target)
    scope.offset(30.0, -40.0)
    scope.wait(20.0)
    assert off_arcsec(scope, witness, target) == pytest.approx(50.0, abs=0.5)
    scope.offset(-60.0, 0.0)
    scope.wait(20.0)
    assert off_arcsec(scope, witness, target) == pytest.approx(50.0, abs=0.5)
    assert (in_force(scope, "offset east"), in_force(scope, "offset north")) == (-30.0, -40.0)
    scope.clear("offset east")
    scope.wait(20.0)
    assert off_arcsec(scope, witness, target) == pytest.approx(40.0, abs=0.5)
    scope.clear("offset")
    scope.wait(20.0)
    assert off_arcsec(scope, witness, target) < 0.5
    with pytest.raises(Refused, match="no correction 'offset'"):
        scope.clear("offset")


def test_an_offset_holds_for_later_targets_and_for_the_next_command(tmp_path):
    with telescope(tmp_path) as scope:
        scope.offset(0.0, 100.0)
        later = scope.clock.now() + 60.0
    with telescope(tmp_path, start=later) as scope:
        witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
        scope.goto(target)
        assert off_arcsec(scope, witness, target) == pytest.approx(100.0, abs=1.0)


def test_a_sync_corrects_a_telescope_that_points_beside_its_target_and_says_by_how_much(tmp_path):
    with telescope(tmp_path) as scope:
        for axis in scope.simulator.axes:
            axis.offset += 500 << 24  # the clutches slipped by 500 counts
        witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
        scope.goto(target)
        assert off_arcsec(scope, witness, target) > 500 * ARCSEC_PER_COUNT
        azimuth, altitude = azimuth_altitude(scope._session.planner.observed(witness.now()))
        moved = scope.sync(star_at(scope, math.degrees(azimuth), math.degrees(altitude)))
        assert moved * 3600.0 == pytest.approx(500 * ARCSEC_PER_COUNT, abs=2.0)
        assert in_force(scope, "sync") == pytest.approx(moved * 3600.0)
        scope.goto(target)
        assert off_arcsec(scope, witness, target) < 1.5
        with pytest.raises(Refused, match="sync again"):
            scope.clear("sync")


def test_what_offsets_corrected_is_not_corrected_twice_after_a_sync(scope):
    witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
    scope.goto(target)
    scope.offset(60.0, 80.0)  # until the star is in the middle: the position was wrong by 100″
    scope.wait(20.0)
    place, then = witness.now(), scope.clock.now()
    moved = scope.sync(target)
    assert moved * 3600.0 > 60.0
    assert in_force(scope, "offset east") is None
    assert "offset east, offset north cleared" in next(e.text for e in scope.events() if e.kind == "sync")
    scope.wait(30.0)
    rate = scope._session.planner.axes[0].gearing.counts_per_radian * 7.2921e-5
    now = witness.now()
    assert now[0] - place[0] == pytest.approx(
        (scope.clock.now() - then) * rate, abs=2.0
    )  # it tracks on from where it was
    assert now[1] - place[1] == pytest.approx(0.0, abs=2.0)
    assert scope.status()["error_arcsec"] < 1.0


def test_every_correction_in_force_is_listed_with_value_unit_and_origin(tmp_path):
    with telescope(tmp_path, mount__mount_x_mas=3600000, site__weather__pressure_hpa=900.0) as scope:
        scope.offset(1.0, 2.0)
        scope.wait(100.0)
        rows = {row["name"]: row for row in scope.status()["corrections"]}
    assert rows["mount x"]["value"] == pytest.approx(3600.0)
    assert rows["mount x"]["origin"] == "flag"
    assert rows["offset north"]["value"] == 2.0
    assert rows["offset north"]["age_s"] == pytest.approx(100.0, abs=1.0)
    assert 0.0 <= rows["refraction"]["value"] < 60.0
    assert "900.0 hPa" in rows["refraction"]["origin"]
    assert {"mount y", "Earth orientation UT1−UTC", "host clock", "offset east"} <= set(rows)
    assert all(row["unit"] in {"arcsec", "s"} for row in rows.values())


@pytest.mark.parametrize("baud", [0, 9600])
def test_a_sync_while_tracking_costs_no_more_than_whole_counts_however_slow_the_line(baud, tmp_path):
    with telescope(tmp_path, simulator__baud=baud) as scope:
        witness, target = Witness(scope), star_at(scope, 75.0, 52.0)
        scope.goto(target)
        scope.wait(30.0)
        scope.sync(target)
        scope.wait(30.0)
        off = off_arcsec(scope, witness, target)
        print(f"{baud or 'no'} baud: {off:.2f}″ off after a sync on what was tracked")
        assert off < math.hypot(1.0, 1.0) * ARCSEC_PER_COUNT


def test_a_sync_after_a_power_cycle_keeps_the_turn_in_which_an_axis_stood(tmp_path):
    wide = {"axis1__min_deg": -270.0, "axis1__max_deg": 270.0}
    with telescope(tmp_path, mount__type="altaz-fork", **wide) as scope:
        angles = math.radians(-200.0), math.radians(40.0)  # 160° in the middle turn
        scope._perform(scope._slewing.to_angles("far", angles, lambda _: None))
        witness = Witness(scope)
        before = witness.now()
        scope.simulator.power_cycle()
        scope.wait(5.0)
        assert not scope.status()["synchronised"]
        x, y, z = scope._session.planner.observed(before)
        scope.sync(FixedAltAz(math.atan2(y, -x), math.asin(z)))
        found = [axis["counts"] for axis in scope.status()["axes"]]
        assert found == pytest.approx(before, abs=2.0)
