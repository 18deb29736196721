"""A model that a person puts in force outlives the process, is named in `status`, and can be cleared."""

import math

import pytest
from sky_bench import Sky
from telescope_bench import QUICK, star_at, telescope

from clockdrive.errors import Refused, StateError
from pointing.errors import PointingError
from pointing.model.pointing_model import PointingModel
from pointing.model.terms import terms

CROOKED = {
    "mount__type": "german",
    "simulator__misalignment_x_arcsec": 900.0,
    "simulator__misalignment_y_arcsec": -600.0,
    "simulator__collimation_arcsec": 180.0,
    **QUICK,
}
PLACE = (75.0, 52.0)
ARCSEC = math.pi / 648_000.0


def model(scope, names="MA ME CH", arcsec=(-900.0, 600.0, 180.0)):
    latitude = math.radians(scope.configuration.site.latitude_deg)
    listed = terms(names, "equatorial")
    return PointingModel("equatorial", latitude, listed, tuple(each * ARCSEC for each in arcsec))


def row(scope):
    rows = [each for each in scope.status()["corrections"] if each["name"] == "pointing model"]
    return rows[0] if rows else None


def off(scope, place=PLACE):
    target = star_at(scope, *place)
    scope.goto(target)
    scope.wait(5.0)
    found = math.hypot(*Sky(scope).off(target))
    scope.stop()
    return found


def test_it_points_from_now_on_and_in_the_next_process_and_the_configured_one_is_back_when_cleared(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        before = off(scope)
        scope.use_model(model(scope))
        now = off(scope)
        assert row(scope)["terms_arcsec"] == pytest.approx({"MA": -900.0, "ME": 600.0, "CH": 180.0})
    with telescope(tmp_path, start=scope.clock.now() + 60.0, **CROOKED) as scope:
        later, told = off(scope), row(scope)
        assert told["file"].startswith(str(tmp_path))
        assert "MA ME CH" in told["origin"]
        scope.clear("pointing model")
        assert row(scope) is None
        cleared = off(scope)
        with pytest.raises(Refused, match="take pointing_model out of the configuration"):  # nothing by hand
            scope.clear("pointing model")
    with telescope(tmp_path, start=scope.clock.now() + 60.0, **CROOKED) as scope:
        assert row(scope) is None
    print(f"off {before:.1f}″ without, {now:.1f}″ with it, {later:.1f}″ in the next process, {cleared:.1f}″ cleared")
    assert before > 300.0
    assert max(now, later) < 5.0  # 2.6″ of it is what X and Y together turn about axis 1
    assert cleared == pytest.approx(before, abs=2.0)


def test_none_stands_in_place_of_the_configured_one_until_it_is_cleared(tmp_path):
    file = tmp_path / "model.mod"
    with telescope(tmp_path / "state", **CROOKED) as scope:
        from pointing.model.saved_model import save_model

        save_model(model(scope), file)
    configured = {**CROOKED, "mount__pointing_model": str(file)}
    with telescope(tmp_path / "state", start=scope.clock.now() + 60.0, **configured) as scope:
        assert row(scope)["file"] == str(file)
        scope.use_model(None)
        assert row(scope) is None
    with telescope(tmp_path / "state", start=scope.clock.now() + 60.0, **configured) as scope:
        assert row(scope) is None
        scope.clear("pointing model")
        assert row(scope)["file"] == str(file)


def test_a_report_a_fit_a_model_and_a_file_serve_alike(tmp_path):
    with telescope(tmp_path / "state", **CROOKED) as scope:
        report = scope.pointing_run(8)
        report.fit.save(tmp_path / "model.mod")
        arcsec = []
        for given in (report, report.fit, report.fit.model, tmp_path / "model.mod", str(tmp_path / "model.mod")):
            scope.use_model(given)
            arcsec.append(row(scope)["terms_arcsec"])
        assert all(each == pytest.approx(arcsec[0], abs=1e-9) for each in arcsec)


def test_a_sync_on_top_of_it_changes_the_index_and_leaves_it_right_elsewhere(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.use_model(model(scope, "IH MA ME CH", (600.0, -900.0, 600.0, 180.0)))  # an index that is wrong
        astray = off(scope)
        target = star_at(scope, *PLACE)
        scope.goto(target)
        scope.wait(5.0)
        scope.sync(Sky(scope).solution())
        scope.stop()
        elsewhere = off(scope, (60.0, 70.0))
    print(f"{astray:.0f}″ off with a wrong index, {elsewhere:.1f}″ elsewhere after a sync")
    assert astray > 300.0
    assert elsewhere < 5.0


def test_what_is_no_model_of_this_mount_is_refused_and_the_one_in_force_stays(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.use_model(model(scope))
        wrong = PointingModel("altazimuth", model(scope).latitude, terms("IA AN", "altazimuth"), (1e-4, 1e-4))
        elsewhere = PointingModel("equatorial", 0.9, terms("ID", "equatorial"), (1e-4,))
        (tmp_path / "empty.mod").write_text("nothing\nT 0 0 0 0\nEND\n", encoding="utf-8")
        nothing = PointingModel("equatorial", model(scope).latitude, (), ())
        for given in (wrong, elsewhere, nothing, tmp_path / "empty.mod", tmp_path / "none.mod"):
            with pytest.raises(PointingError):
                scope.use_model(given)
        assert set(row(scope)["terms_arcsec"]) == {"MA", "ME", "CH"}
        scope.goto(star_at(scope, *PLACE))
        with pytest.raises(Refused, match=r"the telescope tracks .*: `stop` it, then change the model"):
            scope.use_model(None)
    with telescope(tmp_path, start=scope.clock.now() + 60.0, **CROOKED) as scope:
        assert set(row(scope)["terms_arcsec"]) == {"MA", "ME", "CH"}


def test_a_file_that_was_spoilt_is_refused_with_the_remedy_and_one_that_is_gone_is_said(tmp_path):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.use_model(model(scope))
        (kept,) = tmp_path.glob("model-*.mod")
    kept.write_text("spoilt", encoding="utf-8")
    with (
        pytest.raises(StateError, match=r"cannot be read: .* delete it, and the configured one is in force again"),
        telescope(tmp_path, start=scope.clock.now() + 60.0, **CROOKED),
    ):
        pass
    kept.unlink()
    with telescope(tmp_path, start=scope.clock.now() + 60.0, **CROOKED) as scope:
        assert row(scope) is None
        assert any("is gone: the configured one is in force" in event.text for event in scope.events())


@pytest.mark.parametrize("given", ["model", None])
def test_a_model_that_cannot_be_remembered_is_not_put_in_force(given, tmp_path, monkeypatch):
    with telescope(tmp_path, **CROOKED) as scope:
        scope.use_model(model(scope))
        before = scope._session.planner.mount

        def full(*_):
            raise StateError("the disk is full")

        monkeypatch.setattr(scope._session.store, "record_model", full)
        with pytest.raises(StateError, match="full"):
            scope.use_model(scope.pointing_run(8) if given else None)
        assert scope._session.planner.mount == before
