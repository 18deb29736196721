"""Mount registers and models add up, so a run is fitted for the registers in force, wherever they are from."""

import math

import pytest
from sky_bench import Sky
from telescope_bench import QUICK, star_at, telescope

from clockdrive import PointingRuns, Telescope
from clockdrive.clock import SystemClock
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.errors import Refused
from clockdrive.service import Service
from transports.serve import serve

MAS = math.radians(1.0 / 3_600_000.0)
LEANING = {
    "mount__type": "german",
    "simulator__misalignment_x_arcsec": 900.0,
    "simulator__misalignment_y_arcsec": -600.0,
    **QUICK,
}


@pytest.fixture
def scope(tmp_path):
    with telescope(tmp_path, **LEANING) as opened:
        yield opened


def synchronised(scope):
    scope.goto(star_at(scope, 75.0, 52.0))
    scope.wait(5.0)
    scope.sync(Sky(scope).solution())
    scope.stop()


def missed_arcsec(scope, *place):
    star = star_at(scope, *place)
    scope.goto(star)
    scope.wait(5.0)
    off = math.hypot(*Sky(scope).off(star))
    scope.stop()
    return off


def in_status(scope):
    return {each["name"]: each for each in scope.status()["corrections"] if each["name"].startswith("mount")}


def test_a_model_fitted_after_a_polar_alignment_has_written_the_registers_does_not_count_them_twice(scope):
    scope.polar_alignment().write_mount()
    synchronised(scope)
    report = scope.pointing_run(8)
    scope.use_model(report)
    tilt = {each.name: each.arcsec for each in report.fit.coefficients if each.name in {"MA", "ME"}}
    off = [missed_arcsec(scope, 75.0, 52.0), missed_arcsec(scope, 300.0, 40.0)]
    print(f"tilt left to the model {tilt}; blind gotos {off[0]:.2f}″ and {off[1]:.2f}″ off")
    assert all(abs(arcsec) < 5.0 for arcsec in tilt.values())
    assert max(off) < 3.0


def test_a_report_fitted_on_other_registers_than_are_in_force_is_not_put_in_force(scope):
    report = scope.pointing_run(8)
    scope.polar_alignment().write_mount()
    with pytest.raises(Refused, match=r"fitted on top of mount registers of 0.0″ and 0.0″, and 9.*fit the run again"):
        scope.use_model(report)
    scope.use_model(scope.runs.report(report.name))
    assert scope.status()["corrections"][2]["name"] == "pointing model"


def test_registers_that_an_alignment_wrote_are_named_pushed_into_the_unit_and_cleared(scope):
    alignment = scope.polar_alignment()
    x_mas, y_mas = alignment.write_mount()
    assert {each["origin"] for each in in_status(scope).values()} == {"polar alignment"}
    differing = {each["key"]: each["configured"] for each in scope.drive.diff()["differences"]}
    assert differing["mount.mount_x_mas"] == x_mas
    scope.drive.push("mount.mount_x_mas", "mount.mount_y_mas")
    rows = scope.drive.show("mount_x", "mount_y")["registers"]
    assert [round(row["value"]) for row in rows.values()] == [x_mas, y_mas]
    scope.clear("mount x")
    assert [each["value"] for each in in_status(scope).values()] == [0.0, 0.0]
    assert {each["origin"] for each in in_status(scope).values()} == {"default"}
    with pytest.raises(Refused, match="take mount_x_mas out of the configuration"):
        scope.clear("mount x")


def test_an_exposure_from_before_the_registers_were_written_is_of_no_use(scope):
    alignment = scope.polar_alignment()
    scope.wait(5.0)
    before = scope.clock.now()
    alignment.write_mount()
    with pytest.raises(Refused, match="other mount registers were put in force after it"):
        scope._session.history.counts(before)


def test_registers_that_only_the_unit_holds_are_those_of_a_fit_with_no_drive_at_hand(tmp_path):
    made = load(None, {}, {"mount.mount_x_mas": 900_000, "mount.mount_y_mas": -600_000})
    clock = SystemClock()
    with serve(tc410.simulated(made, clock.now(), None), clock, "tcp://127.0.0.1:0") as server:
        given = {"drive.link": server.address, "state.path": str(tmp_path), "limits.sun_avoidance_deg": 0.0,
                 "site.latitude_deg": -42.4, "site.longitude_deg": 173.7}  # fmt: skip
        configuration = load(None, {}, given)
        with Telescope(configuration) as scope:
            assert scope.runs.frame["registers"] == pytest.approx([900_000 * MAS, -600_000 * MAS])
        with PointingRuns.open(configuration) as runs:
            assert runs.frame["registers"] == pytest.approx([900_000 * MAS, -600_000 * MAS])
        with PointingRuns.open(load(None, {}, {**given, "mount.mount_x_mas": 5, "mount.mount_y_mas": 0})) as runs:
            assert runs.frame["registers"] == pytest.approx([5 * MAS, 0.0])


def test_an_owner_tells_for_what_a_run_must_be_fitted(scope):
    x_mas, y_mas = scope.polar_alignment().write_mount()
    frame = Service(scope)("run_frame", {}, print)
    assert frame["registers"] == pytest.approx([x_mas * MAS, y_mas * MAS])
    with PointingRuns.beside(scope.configuration, frame) as runs:
        assert runs.frame == {name: frame[name] for name in ("registers", "zero")}
