"""A pulse moves the telescope on the true sky by rate × time in its direction, however the mount stands."""

import math

import pytest
from sky_bench import MOUNTS, Sky, crooked, standing
from telescope_bench import star_at, telescope

from clockdrive.errors import Refused
from clockdrive.guiding import SIDEREAL_ARCSEC_S
from pointing.errors import Unreachable

WAYS = {"north": (0, 1), "south": (0, -1), "east": (1, 0), "west": (-1, 0)}


def in_force(scope, name):
    return next((row for row in scope.status()["corrections"] if row["name"] == name), None)


@pytest.fixture
def tracking(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto(star_at(scope, 75.0, 52.0))
        yield scope


@pytest.mark.parametrize(("kind", "latitude", "posture"), MOUNTS)
def test_a_pulse_moves_the_true_place_by_its_rate_and_time_in_right_ascension_and_declination(
    kind, latitude, posture, tmp_path
):
    settings, place = standing(kind, latitude, posture)
    worst, milliseconds = 0.0, 4000.0
    with telescope(tmp_path, **settings, **crooked()) as scope:
        sky, target = Sky(scope), star_at(scope, *place)
        scope.goto(target)
        assert scope.status()["posture"] == posture
        scope.wait(20.0)
        for direction, (east, north) in WAYS.items():
            before = sky.off(target)
            scope.guide(direction, milliseconds)
            scope.wait(10.0)
            moved = [now - then for now, then in zip(sky.off(target), before, strict=True)]
            way = 0.5 * SIDEREAL_ARCSEC_S * milliseconds / 1000.0
            worst = max(worst, math.dist(moved, (east * way, north * way)))
    print(f"{kind} at {latitude}°, {posture}: pulses of {way:.1f}″ land within {worst:.2f}″")
    assert worst < 0.5


def test_a_flip_needs_nothing_new(tmp_path):
    """A German mount on both sides of the pier: east stays east."""
    with telescope(tmp_path, mount__type="german", **crooked()) as scope:
        sky = Sky(scope)
        for azimuth, posture in ((75.0, "beyond"), (285.0, "normal")):
            target = star_at(scope, azimuth, 52.0)
            scope.goto(target)
            assert scope.status()["posture"] == posture
            before = sky.off(target)
            scope.guide("E", 2000)
            scope.wait(10.0)
            assert sky.off(target)[0] - before[0] == pytest.approx(SIDEREAL_ARCSEC_S, abs=0.5)


def test_a_pulse_takes_effect_at_once_and_the_sum_stands_in_the_ledger_with_origin_and_age(tracking):
    sky, target = Sky(tracking), tracking._session.wanted
    tracking.wait(10.0)
    assert tracking.guide("north", 1000) == pytest.approx((0.0, 7.52), abs=0.01)
    assert tracking.guide("w", 500) == pytest.approx((-3.76, 7.52), abs=0.01)
    tracking.wait(0.9)  # no cycle of ours was due before
    assert sky.off(target)[1] > 7.52 / 4.0
    tracking.wait(51.3)
    row = in_force(tracking, "guide north")
    assert (row["value"], row["unit"]) == (pytest.approx(7.5205, abs=1e-3), "arcsec")
    assert target.name in row["origin"]
    assert row["age_s"] == pytest.approx(52.2, abs=0.5)
    tracking.clear("guide")
    tracking.wait(10.0)
    assert in_force(tracking, "guide north") is in_force(tracking, "guide east") is None
    assert math.hypot(*sky.off(target)) < 0.5


def test_the_rate_is_configured(tmp_path):
    with telescope(tmp_path, mount__guide_rate=1.0) as scope:
        scope.goto(star_at(scope, 75.0, 52.0))
        assert scope.guide("south", 2000)[1] == pytest.approx(-2.0 * SIDEREAL_ARCSEC_S)


def test_pulses_belong_to_their_target_and_end_with_a_goto_or_a_sync_which_say_so(tracking):
    first = tracking._session.wanted
    tracking.guide("north", 8000)
    tracking.goto(star_at(tracking, 285.0, 60.0))
    assert in_force(tracking, "guide north") is None
    told = next(event.text for event in tracking.events() if event.kind == "corrections")
    assert "guide" in told
    assert first.name in told
    assert tracking.status()["error_arcsec"] < 2.0
    tracking.guide("north", 8000)
    tracking.goto(tracking._session.wanted)  # the same target again is a new goto as well
    assert in_force(tracking, "guide north") is None
    tracking.guide("north", 8000)
    tracking.sync(tracking._session.wanted)
    assert in_force(tracking, "guide north") is None
    assert "guide" in next(event.text for event in tracking.events() if event.kind == "sync")


def test_pulses_and_offsets_add_up_and_are_cleared_apart(tracking):
    sky, target = Sky(tracking), tracking._session.wanted
    tracking.offset(20.0, 0.0)
    tracking.guide("east", 2000)
    tracking.wait(15.0)
    assert sky.off(target)[0] == pytest.approx(20.0 + SIDEREAL_ARCSEC_S, abs=0.6)
    tracking.clear("guide east")
    tracking.wait(15.0)
    assert sky.off(target)[0] == pytest.approx(20.0, abs=0.6)
    assert in_force(tracking, "offset east")["value"] == 20.0


def test_pulses_that_stand_in_the_ledger_of_a_process_that_ended_move_nothing(tmp_path):
    with telescope(tmp_path) as scope:
        scope.goto(star_at(scope, 75.0, 52.0))
        scope.guide("north", 10000)
        later = scope.clock.now() + 60.0
    with telescope(tmp_path, start=later) as scope:
        assert in_force(scope, "guide north") is None
        sky, target = Sky(scope), star_at(scope, 75.0, 52.0)
        scope.goto(target)
        assert math.hypot(*sky.off(target)) < 2.0
        scope.offset(5.0, 0.0)
        scope.wait(10.0)
        assert sky.off(target) == pytest.approx((5.0, 0.0), abs=0.6)


@pytest.mark.parametrize(
    ("direction", "milliseconds", "said"),
    [
        ("up", 100, "'up': give one of north"), ("n", 0, "0 ms: 1 to 10000 ms"), ("n", -5, "-5 ms: 1 to"),
        ("n", 10001, "10001 ms: 1 to 10000 ms; use `offset`"), ("n", math.nan, "nan: give a finite"), ("", 5, "''"),
    ],
)  # fmt: skip
def test_a_pulse_that_is_none_is_refused_with_value_bound_and_remedy(direction, milliseconds, said, tracking):
    with pytest.raises(Refused, match=said):
        tracking.guide(direction, milliseconds)
    assert in_force(tracking, "guide north") is None


def test_without_a_target_parked_or_slewing_there_is_nothing_to_guide(tmp_path):
    with telescope(tmp_path) as scope:
        with pytest.raises(Refused, match="nothing is: `goto` one first"):
            scope.guide("north", 100)
        told = []

        def report(_progress):
            with pytest.raises(Refused, match="slewing") as caught:
                scope.guide("north", 100)
            told.append(str(caught.value))

        scope.goto(star_at(scope, 75.0, 52.0), report)
        assert told
        scope.park()
        with pytest.raises(Refused, match="parked"):
            scope.guide("north", 100)


def test_pulses_are_bounded_in_all_and_by_the_limits(tmp_path):
    with telescope(tmp_path, mount__guide_rate=2.0, limits__horizon_deg=40.0) as scope:
        scope.goto(star_at(scope, 75.0, 52.0))
        for _ in range(11):
            scope.guide("east", 10000)
        with pytest.raises(Refused, match=r"3610″ east.*±3600″; `centre`"):
            scope.guide("east", 10000)
        scope.goto(star_at(scope, 0.0, 40.05))
        with pytest.raises(Refused, match="below the horizon limit of 40"):  # the north is down there
            scope.guide("north", 10000)
        assert scope.status()["doing"] == "tracking"


def test_a_goto_that_is_refused_leaves_the_pulses_as_they_were(tracking):
    sky, target = Sky(tracking), tracking._session.wanted
    tracking.guide("north", 8000)
    with pytest.raises(Unreachable):
        tracking.goto("hadec:0,89")
    tracking.wait(15.0)
    assert in_force(tracking, "guide north")["value"] == pytest.approx(60.16, abs=0.01)
    assert sky.off(target)[1] == pytest.approx(60.16, abs=0.5)
    tracking.guide("south", 8000)
    tracking.wait(15.0)
    assert math.hypot(*sky.off(target)) < 0.5
