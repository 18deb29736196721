"""Axis controllers in the application: what is wrong with a link, a semaphore or a clock is said as it is."""

import pytest
from apo_bench import apo_telescope
from telescope_bench import star_at

from clockdrive.cli.drive_command import _TEXTS
from clockdrive.configuration import load
from clockdrive.errors import ConfigurationError, InputError, Refused
from mounts.apo.status_word import mask_of
from mounts.errors import DriveError, DriveRefused
from pointing.errors import Unreachable
from transports.errors import NoAnswer


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"axis1.link": "tcp://a:1"}, r"axis2\.link is missing: each axis of apo has a line of its own"),
        ({"axis1.link": "tcp://a:1", "axis2.link": "tcp://a:1"}, r"axis2\.link = tcp://a:1 is axis1\.link too"),
        (
            {"drive.link": "tcp://a:1"},
            r"drive\.link = tcp://a:1: each axis .* a line of its own, axis1\.link",
        ),
        ({"axis1.link": "sim:", "axis2.link": "tcp://a:2"}, "the simulator is all axes or none"),
        (
            {"axis1.link": "tcp://a:1", "axis2.link": "tcp://a:2", "rotator.mode": "sky"},
            r"rotator\.link is missing",
        ),
    ],
)
def test_a_line_that_is_missing_or_shared_is_a_problem_of_the_configuration(given, said):
    with pytest.raises(ConfigurationError, match=said):
        load(None, {}, {"drive.kind": "apo", **given})


def test_lines_that_are_whole_and_none_at_all_are_taken():
    assert load(None, {}, {"drive.kind": "apo"}).simulated
    given = {"axis1.link": "tcp://a:1", "axis2.link": "tcp://a:2"}
    assert load(None, {}, {"drive.kind": "apo", **given}).links == ("tcp://a:1", "tcp://a:2")


def test_a_slow_link_is_waited_for_as_long_as_is_configured(tmp_path):
    with (
        pytest.raises(NoAnswer, match=r"no answer within 0\.5 s to 'ID'.*drive\.timeout_s of a slow link"),
        apo_telescope("apo", tmp_path / "impatient", simulator__latency_s=0.3),
    ):
        pass
    with apo_telescope("apo", tmp_path, simulator__latency_s=0.3, drive__timeout_s=1.0, rotator__mode="sky") as scope:
        scope.goto(star_at(scope, 40.0, 60.0), position_angle_deg=20.0)
        scope.offset(10.0, 10.0)  # all three axes anew, which takes this line twelve seconds
        scope.wait(25.0)
        found = scope.status()
        print(f"0.3 s each way: tracking, {found['error_arcsec']:.4f}″ off")
        assert (found["doing"], found["trouble"]) == ("tracking", "")
        assert found["error_arcsec"] < 0.05


def test_a_semaphore_in_other_hands_is_said_so_and_stop_and_close_work_where_nothing_moves(tmp_path):
    with apo_telescope("sdss", tmp_path) as scope:
        scope.goto(star_at(scope, 10.0, 50.0))
        scope.simulator.axes[1].fail("semaphore_taken")
        scope.wait(3.0)
        with pytest.raises(DriveRefused, match=r"altitude: somebody else has its semaphore.*stop button"):
            scope.stop()  # it moves on by what it was given
        with pytest.raises(Refused, match="could not be stopped yet: altitude: somebody else has its semaphore"):
            scope.park()
        scope.wait(15.0)
        scope.stop()
        with pytest.raises(DriveRefused, match="altitude semaphore taken: somebody else moves this telescope"):
            scope.park()
        later = scope.clock.now() + 60.0
    with apo_telescope("sdss", tmp_path, start=later) as scope:  # it opens, and says so
        assert scope.status()["alarms"] == ["altitude semaphore taken"]
        scope.simulator.axes[1].repair("semaphore_taken")
        scope.wait(3.0)
        scope.park()


def test_a_clock_that_is_refused_is_not_said_to_be_corrected_for(tmp_path):
    with apo_telescope("apo", tmp_path, simulator__clock_offset_s=0.2) as scope:
        assert sum("node times are corrected" in note for note in scope.status()["notes"]) == 2
    with apo_telescope("apo", tmp_path / "far", simulator__clock_offset_s=3.0) as scope:
        assert not any("corrected" in note for note in scope.status()["notes"])
        assert "3.0" in scope.status()["alarms"][0]


def test_clocks_are_set_when_confirmed_and_measured_afterwards(tmp_path):
    with apo_telescope("sdss", tmp_path, simulator__clock_offset_s=3.0) as scope:
        with pytest.raises(DriveRefused, match=r"clock is \+3\.\d+ s off"):
            scope.park()
        with pytest.raises(InputError, match="confirm it with --yes"):
            scope.drive.set_clocks(confirmed=False)
        found = scope.drive.set_clocks(confirmed=True)
        print(found["note"])
        for row in found["clocks"]:
            assert row["before_s"] == pytest.approx(3.0, abs=0.002)
            assert abs(row["after_s"]) <= row["uncertainty_s"] + 1e-6 < 0.004
        scope.park()
        scope.simulator.axes[0].restart(scope.clock.now(), loses_clock=True)
        scope.wait(15.0)
        assert "azimuth" in scope.status()["alarms"][0]
        assert scope.drive.set_clocks(confirmed=True)["clocks"][0]["before_s"] is None
        assert not scope.status()["alarms"]
    with apo_telescope("apo", tmp_path / "apo") as scope:
        for confirmed in (True, False):
            with pytest.raises(DriveRefused, match="kind apo have no command that sets their clocks"):
                scope.drive.set_clocks(confirmed=confirmed)
        with pytest.raises(Unreachable, match=r"axis2 at 0\.000° is .* outside .*`park` goes to park_deg instead"):
            scope.home()


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_fiducials_tell_by_how_much_the_position_of_each_axis_is_off(kind, tmp_path):
    with apo_telescope(kind, tmp_path) as scope:
        azimuth = scope.simulator.axes[0]
        azimuth.slip = 0.01
        azimuth._watch()
        assert scope.drive.fiducials()["note"] == (
            "azimuth and altitude: no fiducial was passed since the controller started"
        )
        scope.jog("azimuth", 1.0, 20.0)
        found = scope.drive.fiducials()
        rows = found["fiducials"]
        print(table := _TEXTS["fiducials"](found.json))
        assert [line.split()[0] for line in table.splitlines()] == ["axis", *(len(rows) * ["azimuth"]), "altitude:"]
        assert {row["axis"] for row in rows} == {"azimuth"}
        assert found["note"].startswith("altitude: no fiducial")
        assert [row["error_deg"] for row in rows] == [pytest.approx(0.01, abs=1e-5)] * len(rows)
        assert rows == scope.drive.fiducials("az")["fiducials"]
        assert not scope.drive.fiducials("axis2")["fiducials"]
    with apo_telescope("tc410", tmp_path / "other") as scope, pytest.raises(Refused, match="tc410 has no fiducials"):
        scope.drive.fiducials()


def test_what_controllers_do_not_have_is_said_with_what_they_have(tmp_path):
    with apo_telescope("apo", tmp_path) as scope:
        with pytest.raises(Refused, match=r"park cannot be set: a drive of kind apo.*`drive raw AXIS COMMAND`"):
            scope.drive.set("park", 3.0)
        with pytest.raises(Refused, match="no absolute encoders"):
            scope.drive.encoders()
        with pytest.raises(DriveError, match="'HALT' is no command of an axis controller"):
            scope.drive.raw("azimuth", "HALT")
        with pytest.raises(InputError, match="axis 'focus': use 1, axis1 or azimuth"):
            scope.drive.raw("focus", "STATUS")
        assert scope.drive.raw("alt", "STATUS")["note"] == ""
        set_to = scope.drive.raw("alt", "SET.POSITION 45.5", confirmed=True)["note"]
        assert set_to.startswith(
            "altitude: its position is +0.5000° from what it was; the telescope is unsynchronised"
        )
        for name in ("1", "axis1", "azimuth", "AZ"):
            assert scope.drive.raw(name, "ID")["axis"] == "azimuth"
            assert next(iter(scope.drive.show(name)["registers"])).startswith("azimuth ")
        with pytest.raises(KeyError, match="a controller of kind apo has no status bit 'semaphore_taken'"):
            mask_of("semaphore_taken", "apo")


def test_a_simulator_remembered_from_later_starts_anew_where_it_stood(tmp_path):
    with apo_telescope("apo", tmp_path) as scope:
        scope.jog(1, 0.5, 10.0)
        began = scope.clock.now()
    with apo_telescope("apo", tmp_path, start=began - 3600.0) as scope:
        assert scope.status()["axes"][0]["angle_deg"] == pytest.approx(5.0, abs=1e-6)
        scope.park()
        assert not scope.status()["alarms"]
