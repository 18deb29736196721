"""A telescope with a pointing model: where it truly points, what sync leaves of the model, what it says of it.

The simulator's mount is crooked and worked out with matrices; the model file names the same errors in TPOINT's terms.
"""

import math
import os
from types import SimpleNamespace

import pytest
from sky_bench import ARCSEC, MOUNTS, Sky, crooked, standing
from telescope_bench import T0, star_at, telescope

from clockdrive import assembly
from clockdrive.cli.display import plan_text
from clockdrive.configuration import load
from clockdrive.errors import ConfigurationError, Refused
from mounts.true_mount import TrueMount, separation_arcsec
from pointing.instant import Instant
from pointing.rate_offset import RateOffsetTarget

X, Y, COLLIMATION, SKEW, FLEXURE = 150.0, -110.0, 90.0, -40.0, 20.0
CROOKED = {
    **crooked(X, Y, COLLIMATION, SKEW),
    "simulator__flexure_arcsec": FLEXURE,
}
ORIGIN = {"instruments.main.x_arcsec": 240.0, "instruments.main.y_arcsec": -150.0}
TERMS = {
    "equatorial": {"CH": COLLIMATION, "NP": SKEW, "MA": -X, "ME": -Y, "TF": FLEXURE},
    "altazimuth": {"CA": COLLIMATION, "NPAE": SKEW, "AW": X, "AN": -Y, "TF": FLEXURE},
}


def terms_of(kind):
    return TERMS["altazimuth" if kind == "altaz-fork" else "equatorial"]


def written(folder, terms, name="model.mod", sigma=0.5):
    lines = [f"  {term:<7} {arcsec:+10.4f} {sigma:10.5f}" for term, arcsec in terms.items()]
    path = folder / name
    path.write_text("\n".join(["a mount", "T   39   2.9130    0.000   0.0000", *lines, "END", ""]), encoding="utf-8")
    return path


def modelled(folder, terms):
    return {"mount__pointing_model": str(written(folder, terms))}


def row(scope, name):
    return next(each for each in scope.status()["corrections"] if each["name"] == name)


def known_amount(scope, angles):
    """By how much the crooked mount looks beside a straight one."""
    latitude, kind = math.radians(scope.configuration.site.latitude_deg), scope.configuration.mount.type
    names = [name for name in scope.configuration.simulator.__dataclass_fields__ if name.endswith("_arcsec")]
    straight = TrueMount(SimpleNamespace(**dict.fromkeys(names, 0.0)), kind, latitude)
    truly = TrueMount(scope.configuration.simulator, kind, latitude)
    return separation_arcsec(truly.observed(*angles), straight.observed(*angles))


@pytest.mark.parametrize(("kind", "latitude", "posture"), MOUNTS)
def test_a_goto_lands_on_the_true_place_with_the_model_and_beside_it_by_the_known_amount_without(
    kind, latitude, posture, tmp_path
):
    settings, place = standing(kind, latitude, posture)
    off = {}
    for name, model in (("without", {}), ("with", modelled(tmp_path, terms_of(kind)))):
        with telescope(tmp_path / name, **settings, **CROOKED, **model) as scope:
            sky, target = Sky(scope), star_at(scope, *place)
            scope.goto(target)
            scope.wait(20.0)
            off[name] = math.hypot(*sky.off(target))
            assert scope.status()["posture"] == posture
            if name == "without":
                known = known_amount(scope, sky.witness.angles(sky.witness.now()))
    print(f"{kind} at {latitude}°, {posture}: {off['without']:.1f}″ off without, {off['with']:.2f}″ with the model")
    assert off["with"] < 0.3
    assert off["without"] == pytest.approx(known, abs=1.0)
    assert off["without"] > 30.0


@pytest.mark.parametrize(("kind", "latitude", "posture"), MOUNTS[::3])
def test_a_pointing_origin_is_put_on_the_target_through_the_model(kind, latitude, posture, tmp_path):
    settings, place = standing(kind, latitude, posture)
    with telescope(tmp_path, **settings, **CROOKED, **ORIGIN, **modelled(tmp_path, terms_of(kind))) as scope:
        sky, target = Sky(scope), star_at(scope, *place)
        scope.goto(target)
        scope.wait(20.0)
        off = math.hypot(*sky.off(target))
    print(f"{kind} at {latitude}°, {posture}: {off:.2f}″ off at the origin")
    assert off < 0.3


def test_it_tracks_through_the_model(tmp_path):
    """Ten minutes at the model's rates; without them the star drifts off."""
    with telescope(tmp_path, **CROOKED, **modelled(tmp_path, TERMS["equatorial"])) as scope:
        sky, target, worst = Sky(scope), star_at(scope, 75.0, 52.0), 0.0
        scope.goto(target)
        scope.wait(20.0)
        for _ in range(10):
            scope.wait(60.0)
            worst = max(worst, math.hypot(*sky.off(target)))
    print(f"worst in ten minutes {worst:.2f}″")
    assert worst < 0.3


def test_a_flip_goes_on_with_the_same_target_on_the_other_side_of_the_pier(tmp_path):
    """What changes its sign beyond the pole does, and what does not does not."""
    with telescope(tmp_path, mount__type="german", **CROOKED, **modelled(tmp_path, TERMS["equatorial"])) as scope:
        sky, target, off = Sky(scope), star_at(scope, 0.0, 67.6), {}
        scope.goto(target)
        scope.wait(20.0)
        off[scope.status()["posture"]] = math.hypot(*sky.off(target))
        scope.flip()
        scope.wait(20.0)
        off[scope.status()["posture"]] = math.hypot(*sky.off(target))
    print(f"off the true place: {off}")
    assert set(off) == {"normal", "beyond"}
    assert max(off.values()) < 0.3


@pytest.mark.parametrize("kind", ["equatorial-fork", "altaz-fork"])
def test_a_fast_target_is_led_through_the_model(kind, tmp_path):
    """A tenth of a degree a second: met with its velocity and followed by direct speed control."""
    with telescope(tmp_path, mount__type=kind, **CROOKED, **modelled(tmp_path, terms_of(kind))) as scope:
        sky, worst = Sky(scope), 0.0
        star = star_at(scope, 75.0, 40.0)
        target = RateOffsetTarget(star, 300.0 * ARCSEC, 200.0 * ARCSEC, Instant.from_posix(scope.clock.now()))
        scope.goto(target)
        for _ in range(10):
            scope.wait(3.0)
            worst = max(worst, math.hypot(*sky.off(target)))
        assert scope.status()["led"]
    print(f"{kind}: worst in half a minute {worst:.2f}″")
    assert worst < 1.0


def misled(scope, sky, arcsec):
    """Put the position wrong: a sync on a place beside the one that the telescope sees."""
    target = star_at(scope, 80.0, 50.0)
    scope.goto(target)
    scope.wait(20.0)
    seen = sky.solution()
    scope.sync(type(seen)("beside", seen.ra, seen.dec + math.radians(arcsec / 3600.0), epoch=seen.epoch))
    scope.stop()


@pytest.mark.parametrize("kind", ["equatorial-fork", "altaz-fork"])
def test_a_sync_changes_the_index_only_and_the_model_stays_right_elsewhere(kind, tmp_path):
    """One count is 0.91″, and a sync is right to one on each axis."""
    with telescope(tmp_path, mount__type=kind, **CROOKED, **modelled(tmp_path, terms_of(kind))) as scope:
        sky = Sky(scope)
        misled(scope, sky, 300.0)
        scope.goto(star_at(scope, 75.0, 52.0))
        scope.wait(20.0)
        wrong = math.hypot(*sky.off(scope._session.wanted))
        moved = scope.sync(sky.solution())
        again = scope.sync(sky.solution())
        elsewhere = {}
        for place in ((110.0, 30.0), (40.0, 65.0)):
            target = star_at(scope, *place)
            scope.goto(target)
            scope.wait(20.0)
            elsewhere[place] = math.hypot(*sky.off(target))
    shown = ", ".join(f"{off:.2f}″" for off in elsewhere.values())
    print(f"{kind}: {wrong:.0f}″ wrong; sync by {moved * 3600.0:.1f}″, then {again * 3600.0:.2f}″; elsewhere {shown}")
    assert wrong == pytest.approx(300.0, rel=0.1)
    assert moved * 3600.0 > 250.0
    assert again * 3600.0 < 1.0
    assert max(elsewhere.values()) < 1.5


def test_after_a_sync_the_error_elsewhere_is_that_of_the_terms_that_the_model_lacks(tmp_path):
    """Collimation of 90″ that the model does not know: sync at δ₁ takes CH sec δ₁ into the index of axis 1."""
    terms = {name: arcsec for name, arcsec in TERMS["equatorial"].items() if name != "CH"}
    with telescope(tmp_path, **CROOKED, **modelled(tmp_path, terms)) as scope:
        sky = Sky(scope)
        declination = []
        for place in ((75.0, 52.0), (110.0, 30.0)):
            target = star_at(scope, *place)
            scope.goto(target)
            scope.wait(20.0)
            declination.append(target.dec)
            if len(declination) == 1:
                scope.sync(sky.solution())
        off = math.hypot(*sky.off(target))
        one, two = declination
        left = abs(COLLIMATION * (1.0 - math.cos(two) / math.cos(one)))
        scope.centre(sky.solution())
        scope.wait(20.0)
        centred = math.hypot(*sky.off(target))
    print(f"{off:.2f}″ off elsewhere, {left:.2f}″ of it expected of CH; centred to {centred:.2f}″")
    assert off == pytest.approx(left, abs=1.5)
    assert off > 5.0
    assert centred < 0.3


def test_the_model_stands_in_the_ledger_with_file_terms_and_age_and_cannot_be_cleared(tmp_path):
    path = written(tmp_path, TERMS["equatorial"])
    with telescope(tmp_path, mount__pointing_model=str(path)) as scope:
        found = row(scope, "pointing model")
        with pytest.raises(Refused, match="pointing model cannot be cleared: take pointing_model out"):
            scope.clear("pointing model")
        assert found["age_s"] == pytest.approx(T0 - path.stat().st_mtime, abs=60.0)
    assert found["origin"] == "model.mod: CH NP MA ME TF, fitted to 39 stars, 2.91″ left on the sky"
    assert found["file"] == str(path)
    assert found["terms_arcsec"] == pytest.approx(TERMS["equatorial"])
    assert 50.0 < found["value"] < 400.0


def test_a_file_that_changes_while_the_telescope_is_open_is_told_and_not_applied(tmp_path):
    path = written(tmp_path, TERMS["equatorial"])
    with telescope(tmp_path, mount__pointing_model=str(path)) as scope:
        before = row(scope, "pointing model")
        written(tmp_path, {"CH": 500.0})
        os.utime(path, (T0, T0))
        changed = row(scope, "pointing model")
        path.unlink()
        gone = row(scope, "pointing model")
    told = "the file has changed since it was read: close the telescope and open it again"
    assert changed["origin"] == f"{before['origin']}; {told}"
    assert gone["origin"].endswith("the file is gone since it was read")
    assert before["terms_arcsec"] == changed["terms_arcsec"] == gone["terms_arcsec"]


def test_without_a_model_the_ledger_has_none(tmp_path):
    with telescope(tmp_path) as scope:
        assert "pointing model" not in {each["name"] for each in scope.status()["corrections"]}


def test_the_mount_registers_and_a_model_add_up_and_the_check_says_so(tmp_path):
    """Half of the misalignment in the registers, half in the model: on the star, with a caution."""
    half = {**TERMS["equatorial"], "MA": -X / 2.0, "ME": -Y / 2.0}
    registers = {"mount__mount_x_mas": round(500.0 * X), "mount__mount_y_mas": round(500.0 * Y)}
    with telescope(tmp_path, **CROOKED, **registers, **modelled(tmp_path, half)) as scope:
        (said,) = scope.configuration.cautions
        sky, target = Sky(scope), star_at(scope, 75.0, 52.0)
        scope.goto(target)
        scope.wait(20.0)
        assert math.hypot(*sky.off(target)) < 0.3
    assert "mount_x_mas = 75000, mount_y_mas = -55000: they add up; where MA and ME" in said


WRONG = {
    "terms of another mount": (
        "  IA  +12.0\n",
        r"model\.mod, line 3, column 1: '  IA  \+12\.0': the term IA .*altaz",
    ),
    "no term": (
        "  IH  +12.0\n  IQ  +1.0\n",
        r"model\.mod, line 4.*no pointing term 'IQ'; for this mount there are IH",
    ),
    "degrees": ("! comment\n &=CH  400000.0 1.0\n", r"line 4.*CH of 111\.111°.*coefficients are arcseconds"),
    "no terms": ("", r"model\.mod: the model has no term"),
    "no number": ("  IH  twelve\n", r"model\.mod, line 3, column 7"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_model_that_is_wrong_is_refused_with_file_line_and_remedy_before_anything_moves(case, tmp_path):
    rows, said = WRONG[case]
    (tmp_path / "model.mod").write_text(f"a mount\nT 39 2.9 0 0\n{rows}END\n", encoding="utf-8")
    (tmp_path / "telescope.toml").write_text('[mount]\npointing_model = "model.mod"\n', encoding="utf-8")
    with pytest.raises(ConfigurationError, match=rf"(?s)mount\.pointing_model: .*{said}"):
        assembly.planner(load(tmp_path / "telescope.toml", {}))


def test_a_plan_brings_its_error_budget(tmp_path):
    """A perfect clock, an air that is only configured, and a model whose fit left 2.913″."""
    with telescope(tmp_path, **modelled(tmp_path, TERMS["equatorial"])) as scope:
        found = scope.plan(star_at(scope, 75.0, 52.0))["budget"]
    arcsec = {each["name"]: each["arcsec"] for each in found["sources"]}
    assert list(arcsec) == [
        "pointing model",
        "what the model leaves",
        "refraction",
        "clock",
        "UT1",
        "counts",
        "drive",
    ]
    assert arcsec["what the model leaves"] == 2.913
    assert arcsec["clock"] == 0.0
    assert arcsec["refraction"] == pytest.approx(45.4 * math.hypot(10.0 / 1009.6, 10.0 / 287.9), rel=0.05)
    assert found["unknown"] == []
    assert found["total_arcsec"] == pytest.approx(math.hypot(*arcsec.values()), abs=0.002)
    (line,) = (line for line in plan_text(scope_plan(found)).splitlines() if "error budget" in line)
    assert line.strip().startswith(
        f"error budget {found['total_arcsec']:.2f}″: what the model leaves 2.91″, refraction"
    )


def scope_plan(budget):
    """As much of a plan as its display needs."""
    place = dict.fromkeys(("azimuth_deg", "altitude_deg", "hour_angle_deg", "declination_deg"), 0.0)
    words = {"target": "M1", "start_utc": "", "arrival_utc": "", "posture": "normal", "eta_s": 0.0}
    return {**words, "observed": place, "axes": [], "checks": [], "budget": budget}
