"""A whole telescope with a stepper box, under a virtual clock: the box's own motors say what is true."""

import math
import os
import random
import re
import shutil
from functools import partial
from itertools import pairwise

import pytest
from astropy import units as u
from astropy.time import Time
from avr_bench import coarser_table
from telescope_bench import T0, Witness, axes_off_arcsec, simulated, star_at

from clockdrive import VirtualClock
from clockdrive.errors import InputError, Refused
from clockdrive.service import Service
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.unplaced_hold import HELD
from mounts.errors import DriveError, DriveRefused
from pointing.errors import Unreachable
from pointing.vectors import azimuth_altitude
from transports.errors import LinkError

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
GOTOS = 100 if FULL else 2
PARKED_H = 12.0 if FULL else 0.25
ARCSEC = (360.0 * 3600.0 / (200 * 64 * 57 / 11 * 360), 360.0 * 3600.0 / (200 * 64 * 57 / 11 * 180))


opened = partial(simulated, "avr-box")
off_arcsec = partial(axes_off_arcsec, scales=ARCSEC)


@pytest.mark.parametrize(("azimuth", "altitude"), [(60.0, 50.0), (300.0, 35.0), (170.0, 70.0)])
def test_a_goto_hits_its_star_at_the_time_that_was_planned_and_tracks_it(tmp_path, azimuth, altitude):
    with opened(tmp_path) as scope:
        star = star_at(scope, azimuth, altitude)
        planned = scope.plan(star).json["eta_s"]
        began = scope.clock.now()
        arrived = scope.goto(star).json
        late = arrived["eta_s"] - planned
        worst = 0.0
        for _ in range(60):
            scope.wait(10.0)
            worst = max(worst, math.hypot(*off_arcsec(scope)))
        print(
            f"\n{arrived['arrival_error_arcsec']:.2f}″ off on arrival, {late:+.4f} s late, then {worst:.2f}″ at worst"
        )
        assert arrived["slews"] == 1
        assert arrived["arrival_error_arcsec"] < math.hypot(*ARCSEC)  # a microstep of each axis
        assert abs(late) < 0.01
        assert scope.clock.now() - began > 600.0
        assert worst < 0.5


TRACKED_S = 1800 if FULL else 62
RATES = {"sidereal": None, "slower by 1.7 %": (0.17, 0.0), "faster by 1.4 %": (-0.14, 0.0), "both": (0.1, 0.2)}


@pytest.mark.campaign
@pytest.mark.parametrize("rate", RATES.values(), ids=RATES)
def test_half_an_hour_is_tracked_within_an_arcsecond_at_one_command_every_20_s(tmp_path, rate):
    with opened(tmp_path) as scope:
        star = star_at(scope, 120.0, 50.0)
        scope.goto(star, rate_arcsec_s=rate)
        scope.wait(15.0)
        guided, guide = [], scope.simulator._guide

        def noted(letter, number):
            if letter in "+-":
                guided.append(scope.clock.now())
            guide(letter, number)

        scope.simulator._guide = noted
        off = []
        for _ in range(TRACKED_S):
            scope.wait(1.0)
            off.append(off_arcsec(scope))
    one, two = (math.sqrt(sum(each[i] ** 2 for each in off) / len(off)) for i in (0, 1))
    apart = min((late - early for early, late in pairwise(guided)), default=math.inf)
    print(f"\n{TRACKED_S} s: {one:.3f}″ and {two:.3f}″ RMS, {len(guided)} commands, {apart:.2f} s apart at least")
    assert math.hypot(one, two) <= 1.0
    assert TRACKED_S / 22.5 - 1.0 <= len(guided) <= TRACKED_S / 20.0 + 1.0
    assert apart >= 20.0 - 0.5


def reachable_star(scope, rng):
    """Anywhere up, but in the strip about the meridian that neither posture reaches."""
    while True:
        star = star_at(scope, rng.uniform(0.0, 360.0), rng.uniform(5.0, 89.0))
        try:
            scope.plan(star)
        except Unreachable:
            continue
        return star


SKIES = {
    "north": {},
    "south": {"site__latitude_deg": -42.4},
    "south, halves, reversed": {
        "site__latitude_deg": -42.4,
        "drive__move_count": "half",
        "simulator__move_count": "half",
        "axis1__reversed": True,
        "axis2__reversed": True,
    },
    "another table": {"drive__slew_table": "table.csv"},
}


@pytest.mark.campaign
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("ways", SKIES.values(), ids=SKIES)
def test_a_goto_anywhere_lands_within_a_microstep_at_its_planned_moment(tmp_path, ways):
    (tmp_path / "table.csv").write_text(", ".join(map(str, coarser_table())), encoding="ascii")
    ways = {name: str(tmp_path / value) if value == "table.csv" else value for name, value in ways.items()}
    rng, worst = random.Random(str(sorted(ways))), [0.0, 0.0]  # noqa: S311 - nothing secret
    for number in range(GOTOS):
        with opened(tmp_path / str(number), limits__horizon_deg=0.0, **ways) as scope:
            witness = Witness(scope)
            scope.goto(reachable_star(scope, rng))
            path = scope._session.pursuit.at(witness.arrivals[-1])
            off = [abs(true - counts) for true, (counts, _) in zip(witness.counts_at_arrival, path, strict=True)]
            worst = [max(pair) for pair in zip(worst, off, strict=True)]
    print(f"\n{GOTOS} gotos: {worst[0]:.2f} and {worst[1]:.2f} microsteps off at the planned arrival, at worst")
    assert max(worst) <= 1.0 + 0.01


def test_reversed_counts_point_at_the_same_place(tmp_path):
    with opened(tmp_path, axis1__reversed=True, axis2__reversed=True) as scope:
        scope.goto(star_at(scope, 60.0, 50.0))
        scope.wait(300.0)
        assert math.hypot(*off_arcsec(scope)) < 0.5


PARKS = {
    "at its last degree": {"axis1__park_deg": 169.95},
    "at its first degree": {"axis1__park_deg": -169.95},
    "in the south": {"axis1__park_deg": 169.95, "site__latitude_deg": -42.4, "axis2__park_deg": -42.4},
    "in moves of a second": {"axis1__park_deg": 169.95, "drive__max_uninterruptible_s": 1.0},
    "without encoders": {"axis1__park_deg": 169.95, "drive__encoder_counts_per_turn": 0},
    "reversed": {"axis1__park_deg": 169.95, "axis1__reversed": True},
}


@pytest.mark.campaign
@pytest.mark.timeout(900)
@pytest.mark.parametrize("where", PARKS.values(), ids=PARKS)
def test_a_parked_telescope_is_held_and_crosses_no_limit(tmp_path, where):
    with opened(tmp_path, **where) as scope:
        scope.park()
        sign, angles = -1.0 if where.get("axis1__reversed") else 1.0, []
        for _ in range(round(PARKED_H * 360)):
            scope.wait(10.0)
            scope.simulator.advance(scope.clock.now())
            angles.append(sign * scope.simulator.true_position(1) * ARCSEC[0] / 3600.0)
        status = scope.status().json
    parked = where["axis1__park_deg"]
    print(f"\n{PARKED_H:g} h parked at {parked}°: axis 1 between {min(angles):.4f}° and {max(angles):.4f}°")
    assert max(angles) < 170.0
    doubt = 0.0 if where.get("drive__encoder_counts_per_turn", 1) else 0.125  # a hold's width more of room, unproved
    assert min(angles) > max(parked - 0.15 - doubt, -170.0)
    assert max(angles) < parked + 0.13
    assert status["doing"] == "parked"
    assert status["trouble"] == ""


def test_tracking_into_a_limit_ends_there_and_the_axis_is_held(tmp_path):
    with opened(tmp_path, axis1__max_deg=10.0, limits__horizon_deg=-5.0, site__latitude_deg=-42.4) as scope:
        scope.goto(star_near_limit(scope))
        angles = []
        for _ in range(120):
            scope.wait(10.0)
            scope.simulator.advance(scope.clock.now())
            angles.append(scope.simulator.true_position(1) * ARCSEC[0] / 3600.0)
        status = scope.status().json
    print(f"\nlimit 10°: axis 1 came to {max(angles):.4f}° and was held above {min(angles[60:]):.4f}°")
    assert max(angles) < 10.0
    assert min(angles[60:]) > 9.8
    assert status["doing"] == "idle"
    assert "axis1" in status["trouble"]


def star_near_limit(scope):
    """A star that comes to an hour angle of 10° within minutes."""
    planner = scope._session.planner
    azimuth, altitude = map(
        math.degrees, azimuth_altitude(planner.mount.observed(math.radians(9.2), math.radians(-30)))
    )
    return star_at(scope, azimuth, altitude)


def test_stop_says_when_the_move_ends_and_the_telescope_rests_after_it(tmp_path):
    with opened(tmp_path) as scope:
        star = star_at(scope, 60.0, 50.0)
        slews = scope._slewing.goto(star, lambda _: None)
        for _ in range(12):
            next(slews)
            scope.clock.sleep(0.25)
        with pytest.raises(DriveRefused, match=r"ends its move.*in \d+\.\d s"):
            scope.stop()
        slews.close()
        scope.wait(60.0)
        status = scope.status().json
        assert status["doing"] == "idle"
        assert not any(axis["slewing"] for axis in status["axes"])
        assert scope.clock.now() - T0 < 120.0


def test_a_stop_that_did_all_it_can_is_an_answer_and_is_not_tried_again(tmp_path):
    with opened(tmp_path) as scope:
        slews = scope._slewing.goto(star_at(scope, 60.0, 50.0), lambda _: None)
        for _ in range(12):
            next(slews)
            scope.clock.sleep(0.25)
        answer = Service(scope)("stop", {}, lambda _: None)
        slews.close()
        scope.wait(5.0)
        said = " ".join(event.text for event in scope.events())
        assert answer["ok"]
        assert re.search(r"ends its move.*in \d+\.\d s, and no further move is sent", answer["note"])
        assert answer["note"] in said
        assert "again" not in said


def test_a_stop_at_rest_does_not_mind_the_move_that_holds_it(tmp_path):
    with opened(tmp_path) as scope:
        axis = scope._session.drive.axes[0]
        while scope.clock.now() > axis.reckoning.ends:
            scope.wait(0.5)
        assert axis.at(scope.clock.now()).moving
        scope.stop()
        assert scope.status().json["trouble"] == ""


def test_the_next_program_says_how_far_it_tracked_and_points_right(tmp_path):
    clock = VirtualClock(T0)
    with opened(tmp_path, clock) as scope:
        star = star_at(scope, 300.0, 45.0)
        scope.goto(star)
        scope.close()
    clock.sleep(1200.0)
    with opened(tmp_path, clock) as scope:
        notes = " ".join(scope.status().json["notes"])
        assert re.search(r"tracked on for 12\d\d s while no program looked, 5\.0\d°", notes)
        scope.goto(star)
        assert math.hypot(*off_arcsec(scope)) < 2.0


@pytest.mark.parametrize(
    "opposite",
    [
        {"simulator.move_count": "half"},
        {"simulator.axis_bit": 0},
        {"simulator.reversed1": True},
        {"simulator.reversed2": True},
        {"simulator.reversed2": True, "simulator.north_reversed": True},
        {"simulator.encoder_reversed1": True},
        {"simulator.encoder_reversed2": True},
        {"simulator.encoder_still1": True},
        {"simulator.encoder_still2": True},
        {"simulator.encoder_counts_per_turn": 10000},
        {"simulator.encoder_counts_per_turn": 40000},
        {"simulator.slew_table": "table.csv"},
        {"drive.slew_table": "table.csv", "simulator.slew_table": "standard"},
        {"simulator.table_clocks": "byte"},
    ],
    ids=" ".join,
)
def test_a_reading_of_the_manual_that_is_wrong_is_noticed_and_never_mispoints(tmp_path, opposite):
    (tmp_path / "table.csv").write_text(", ".join(map(str, coarser_table())), encoding="ascii")
    opposite = {name: str(tmp_path / value) if value == "table.csv" else value for name, value in opposite.items()}
    with opened(tmp_path / "state", **opposite) as scope:
        why = "arrived"
        try:
            scope.goto(star_at(scope, 60.0, 50.0))
        except (DriveError, Refused) as found:
            why = str(found)
        scope.wait(30.0)
        reading = scope._control.call(scope._session.poll)
        scope.simulator.advance(reading.time)
        error = [abs(axis.counts - scope.simulator.true_position(i + 1)) for i, axis in enumerate(reading.axes)]
        print(f"\n{why}; {scope._session.drive.notes[-1]}; {error} microsteps off")
        assert why != "arrived"
        within = all(off <= axis.uncertainty_counts for off, axis in zip(error, reading.axes, strict=True))
        assert within or reading.unsynchronised


def test_park_and_status_say_when_it_is_at_a_limit_left_alone(tmp_path):
    with opened(tmp_path, axis1__park_deg=155.0, limits__horizon_deg=-5.0) as scope:
        parked = scope.park().json
        status = scope.status().json
    said = next(note for note in parked["notes"] if "left alone" in note)
    assert "in 0 h 59 min" in said  # 15° at 15.01° an hour, the last minute begun
    assert "power switch" in said
    assert any("left alone" in note for note in status["notes"])
    assert status["left_alone"]["in_s"] == pytest.approx(15.0 / 360.0 * 86164.09 / 0.99794, abs=60.0)
    assert status["left_alone"]["name"].startswith("axis1")


def moves_of(scope):
    """Every move that the box begins from now on."""
    begun, begin = [], scope.simulator._begin

    def noted(*move):
        begun.append(move)
        begin(*move)

    scope.simulator._begin = noted
    return begun


def test_to_look_at_a_telescope_that_rests_moves_nothing_and_to_stay_holds_it(tmp_path):
    with opened(tmp_path) as scope:
        moves = moves_of(scope)
        scope.status()
        scope.wait(8.0)
        scope.status()
        assert not moves
        scope.wait(60.0)
        assert 2 <= len(moves) <= 5


def test_near_a_limit_it_is_held_at_once(tmp_path):
    with opened(tmp_path, axis1__park_deg=169.9) as scope:
        moves = moves_of(scope)
        scope.wait(2.0)
        assert moves


SLOWER = r"{}: \d+\.\d\d″/s of its rate .* hold up to 30″/s; take smaller rates, or a target .* axis$"


@pytest.mark.parametrize(("rates", "axis"), [((0.0, 300.0), "axis2"), ((60.0, 0.0), "axis1"), ((0.0, 31.0), "axis2")])
def test_rates_that_short_moves_do_not_hold_are_refused_with_what_they_do(tmp_path, rates, axis):
    with opened(tmp_path) as scope:
        star = star_at(scope, 170.0, 70.0)
        with pytest.raises(
            Unreachable,
            match=SLOWER.format(axis),
        ):
            scope.goto(star, rate_arcsec_s=rates)
        assert scope.status()["doing"] == "idle"


def test_a_plan_says_how_far_off_the_rates_are_that_short_moves_hold(tmp_path):
    with opened(tmp_path) as scope:
        star = star_at(scope, 170.0, 70.0)
        two = scope.plan(star, rate_arcsec_s=(0.0, 10.0)).json["axes"][1]
        assert two["lag_arcsec"] == pytest.approx(11.0, abs=0.5)
        assert scope.rates(star, rate_arcsec_s=(0.0, 100.0)).json["axes"][1]["lag_arcsec"] is None
        assert scope.plan(star).json["axes"][0]["lag_arcsec"] == 0.0


def test_the_next_limit_is_when_a_rate_grows_beyond_what_short_moves_hold(tmp_path):
    with opened(tmp_path, site__latitude_deg=50.0) as scope:
        star, since = star_at(scope, 5.0, 65.0), "2027-01-15T08:00:00Z"
        own = {"rate_arcsec_s": (6.0, 25.0), "rate_from": since}  # its hour angle runs faster and faster to the pole
        limit = scope.plan(star, **own)["next_limit"]
        met = Time(limit["utc"].rstrip("Z"))
        early, late = (
            scope.rates(star, met + seconds * u.s, **own)["axes"][0]["rate_deg_s"] * 3600.0 for seconds in (-1.0, 1.0)
        )
    slowest = 125000 / 230 / 2 * ARCSEC[0] - 30.0
    print(f"\n{limit['utc']}: axis 1 at {early:.3f}″/s, then {late:.3f}″/s, held from {slowest:.3f}″/s")
    assert limit["name"] == "axis1 short moves"
    assert late < slowest < early
    assert early - late < 0.1


def test_a_jog_so_slow_that_tracking_would_outrun_it_is_refused_with_its_least_speed(tmp_path):
    with opened(tmp_path) as scope:
        with pytest.raises(Refused, match=r"at half of 0\.00834°/s, so it goes at no less"):
            scope.jog(1, -0.008, 3.0)
        assert scope.jog(1, -0.0085, 3.0)["eta_s"] < 6.0


def test_a_fixed_place_is_reached_when_it_was_planned_and_not_said_not_to_settle(tmp_path):
    with opened(tmp_path) as scope:
        began = scope.clock.now()
        arrived = scope.goto("altaz:150,70").json
        assert scope.clock.now() - began < arrived["eta_s"] + 1.0
        assert "settle" not in " ".join(event.text for event in scope.events())


def test_the_pec_bin_and_zero_are_shown_set_and_read_back(tmp_path):
    with opened(tmp_path) as scope:
        assert scope.drive.set("pec_zero", "76").json["registers"]["pec_zero"]["text"] == "76"
        shown = scope.drive.show().json["registers"]
        assert {"pec_bin", "pec_zero", "encoder_1", "encoder_2", "crystal"} <= set(shown)
        with pytest.raises(DriveError, match="0 to 518"):
            scope.drive.set("pec_bin", 519)
        with pytest.raises(InputError, match="pec_bin and pec_zero"):
            scope.drive.set("motor_current", 2)


def stands(scope):
    """Where both axes stand, degrees, by the motors themselves."""
    scope.simulator.advance(scope.clock.now())
    return [scope.simulator.true_position(i + 1) * ARCSEC[i] / 3600.0 for i in (0, 1)]


def in_mid_slew(scope, seconds=3.0):
    """Begin a slew of many degrees, and leave it after so many seconds."""
    slews = scope._slewing.goto(star_at(scope, 60.0, 50.0), lambda _: None)
    for _ in range(round(4 * seconds)):
        next(slews)
        scope.clock.sleep(0.25)
    return slews


def run_out(slews, clock):
    """Go on with a slew until it ends."""
    for _ in slews:
        clock.sleep(0.25)


def ends_and_rests(scope):
    """Where both axes are when all motion has ended, and by how much each is off that at worst within minutes."""
    while any(scope.simulator.moving):
        scope.wait(0.5)
    ended, worst = stands(scope), [0.0, 0.0]
    for _ in range(40):
        scope.wait(5.0)
        worst = [max(most, abs(here - end)) for most, here, end in zip(worst, stands(scope), ended, strict=True)]
    return ended, worst


def test_what_is_stopped_in_a_slew_rests_where_its_last_piece_ends_and_never_goes_back(tmp_path):
    with opened(tmp_path) as scope:
        slews = in_mid_slew(scope)
        with pytest.raises(DriveRefused, match="ends its move"):
            scope.stop()
        stopped = stands(scope)
        slews.close()
        ended, worst = ends_and_rests(scope)
    print(f"\nstopped at {stopped}, ended at {ended}, then {worst[0] * 60:.2f}′ and {worst[1] * 3600:.2f}″ off that")
    assert max(abs(a - b) for a, b in zip(stopped, ended, strict=True)) > 3.0
    assert worst[0] * 60.0 < 7.6
    assert worst[1] == 0.0


def test_after_a_crash_in_a_slew_it_rests_where_its_last_piece_ends_and_is_not_said_to_be_stopped(tmp_path):
    clock = VirtualClock(T0)
    with opened(tmp_path / "first", clock) as scope:
        slews = in_mid_slew(scope)
        scope._session.remember()
        scope._session._after_reading()
        shutil.copytree(tmp_path / "first", tmp_path / "crashed")
        slews.close()
    clock.sleep(3.0)
    with opened(tmp_path / "crashed", clock) as scope:
        began, trouble = stands(scope), scope.status().json["trouble"]
        assert any(scope.simulator.moving)
        ended, worst = ends_and_rests(scope)
    print(f"\nopened at {began}, ended at {ended}, then {worst[0] * 60:.2f}′ and {worst[1] * 3600:.2f}″ off that")
    assert "no command ends its last move" in trouble
    assert "was stopped" not in trouble
    assert max(abs(a - b) for a, b in zip(began, ended, strict=True)) > 1.0
    assert worst[0] * 60.0 < 7.6
    assert worst[1] == 0.0


@pytest.mark.parametrize("axis", [1, 2])
def test_a_parked_telescope_that_is_turned_by_hand_is_not_driven_back_and_says_so(tmp_path, axis):
    with opened(tmp_path) as scope:
        scope.park()
        scope.wait(30.0)
        scope.simulator.push(axis, -20.0 * 3600.0 / ARCSEC[axis - 1])
        pushed = stands(scope)
        scope.wait(30.0)
        worst = 0.0
        for _ in range(30):
            scope.wait(10.0)
            worst = max(worst, *(abs(here - there) for here, there in zip(stands(scope), pushed, strict=True)))
        status = scope.status().json
    print(f"\naxis {axis} pushed by 20°: {worst * 60:.2f}′ from there at worst")
    assert worst * 60.0 < 12.6  # held up to 7.5′ short of where it stands, which it was up to 5′ short of
    assert status["doing"] == "parked"
    assert re.match(rf"axis{axis} was found (19|20)\.\d\d° from where it rested", status["trouble"])


@pytest.mark.parametrize("reversed_", [False, True])
@pytest.mark.parametrize("limit", [-170.0, 170.0])
def test_parked_at_a_limit_it_is_held_inside_of_it(tmp_path, limit, reversed_):
    with opened(tmp_path, axis1__park_deg=limit, axis1__reversed=reversed_, limits__horizon_deg=-5.0) as scope:
        scope.park()
        angles = []
        for _ in range(90):
            scope.wait(10.0)
            angles.append(stands(scope)[0] * (-1 if reversed_ else 1))
    print(f"\nparked at {limit:g}°: {min(angles):.4f}° to {max(angles):.4f}°")
    assert min(angles) >= -170.0
    assert max(angles) <= 170.0
    assert all(abs(angle - limit) < 0.3 for angle in angles[3:])


def test_parked_just_above_the_eastern_horizon_no_hold_leads_below_it(tmp_path):
    hours = -math.degrees(math.acos(math.sin(math.radians(15.02)) / math.cos(math.radians(42.4))))
    with opened(tmp_path, axis1__park_deg=hours, axis2__park_deg=0.0, site__latitude_deg=-42.4) as scope:
        scope.park()
        lowest = math.inf
        for _ in range(40):
            scope.wait(5.0)
            one = math.radians(stands(scope)[0])
            altitude = math.degrees(math.asin(math.cos(math.radians(42.4)) * math.cos(one)))
            lowest = min(lowest, altitude)
        status = scope.status().json
    print(f"\nparked at an altitude of 15.02°: lowest {lowest:.4f}°")
    assert lowest > 15.0
    assert status["trouble"] == ""


@pytest.mark.campaign
@pytest.mark.parametrize("turned", [False, True], ids=["", "reversed"])
def test_parked_and_unsynchronised_it_is_held_by_its_encoder_short_of_where_it_stood(tmp_path, turned):
    with opened(tmp_path, axis1__park_deg=160.0, limits__horizon_deg=-5.0, axis1__reversed=turned) as scope:
        scope.park()
        scope.wait(30.0)
        scope._session.drive.supervision.standing.lose("the moves go twice as far as they should")
        scope.wait(5.0)  # the move that held it until then ends
        began, moves, angles = stands(scope), moves_of(scope), []
        for _ in range(360 if FULL else 60):
            scope.wait(5.0)
            angles.append(stands(scope)[0] * (-1 if turned else 1))
        warnings = scope.status().json["warnings"]
    stood = began[0] * (-1 if turned else 1)
    early, late = (60.0 * (each - stood) for each in (min(angles), max(angles)))
    print(f"\nheld between {early:+.2f}′ and {late:+.2f}′ of where it stood")
    assert len(moves) == pytest.approx(len(angles) / 4.0, abs=len(angles) / 40.0)  # one every 20 s
    assert all(move[1] == 2763 for move in moves)
    assert late < 2.5
    assert early > -6.0
    assert warnings == [HELD]


def test_parked_and_unsynchronised_one_whose_encoder_is_not_believed_is_not_held_and_said_so(tmp_path):
    with opened(tmp_path, simulator__encoder_reversed1=True) as scope:
        scope.park()
        scope._session.drive.supervision.standing.lose("encoder 1 says the opposite")
        began, moves = stands(scope)[0], moves_of(scope)
        scope.wait(300.0)
        warnings = scope.status().json["warnings"]
        assert not moves
        assert stands(scope)[0] > began + 1.2
    assert "axis 1 tracks on and is not held" in warnings[-1]


def test_parked_with_its_encoder_off_it_is_led_nowhere_but_by_its_tracking_and_raises_an_alarm(tmp_path):
    with opened(tmp_path, simulator__encoder_still1=True) as scope:
        scope.park()
        began = stands(scope)[0]
        scope.wait(120.0)
        status, far = scope.status().json, stands(scope)[0] - began
    print(f"\nparked, after two minutes {far:+.3f}° on, {status['unsynchronised_because']}")
    assert status["alarms"] == ["the encoder of axis 1 stands still"]
    assert not status["synchronised"]
    assert -0.2 < far < 0.51  # some moves of 5′ before it was told; two minutes of tracking
    assert "axis 1 tracks on and is not held" in status["warnings"][-1]


def test_parked_and_unsynchronised_it_is_said_when_it_is_at_a_limit(tmp_path):
    blind = {"drive__encoder_counts_per_turn": 0}
    with opened(tmp_path, axis1__park_deg=160.0, limits__horizon_deg=-5.0, **blind) as scope:
        scope.park()
        scope.wait(30.0)
        scope._session.drive.supervision.standing.lose("the box was switched off and on; `sync` on a known star")
        scope.wait(600.0)
        status = scope.status().json
        assert "not held" in status["warnings"][-1]
        assert "in 0 h 29 min" in status["warnings"][-1]  # 10° at 15.01° an hour, less 10 min
        scope.wait(1900.0)
        assert "beyond a limit by now" in scope.status().json["warnings"][-1]
        assert stands(scope)[0] > 170.0


def test_half_a_command_is_left_by_the_power_switch_and_a_sync(tmp_path):
    with opened(tmp_path) as scope:
        star, link = star_at(scope, 60.0, 50.0), scope._session.drive._box._kept._link
        write = link.write

        def cut(data):
            if data[:1] == b"M":
                link.write = write
                write(data[:3])
                raise LinkError("unplugged")
            return write(data)

        link.write = cut
        with pytest.raises((LinkError, Refused, DriveError)):
            scope.goto(star)
        scope.wait(10.0)
        assert "Switch the box off and on" in scope.status().json["unsynchronised_because"]
        assert scope.simulator._held == b"M" + scope.simulator._held[1:3]
        with pytest.raises(Refused, match="Switch the box off and on"):
            scope.goto(star)
        scope.simulator._held.clear()  # it is switched off and on
        scope.sync(star)
        assert scope.status().json["synchronised"]
        scope.goto(star)
        assert scope.status().json["doing"] == "tracking"


def test_a_power_cut_in_a_slew_is_not_said_to_end_its_move(tmp_path):
    with opened(tmp_path) as scope:
        slews, box = in_mid_slew(scope), scope.simulator
        here = tuple(round(box.true_position(axis)) for axis in (1, 2))
        fresh = SimulatedAvrBox(box.settings, scope.clock.now(), box.steps_per_turn, positions=here)
        box.__dict__.update(fresh.__dict__)
        with pytest.raises(Refused, match="switched off and on"):
            run_out(slews, scope.clock)
        said = " ".join(event.text for event in scope.events())
        status = scope.status().json
    assert "switched off and on" in status["unsynchronised_because"]
    assert not any(axis["slewing"] for axis in status["axes"])
    assert "ends its move" not in said + status["trouble"]


def test_what_it_cannot_do_is_refused_with_the_bound(tmp_path):
    with opened(tmp_path, axis1__max_deg=30.0, limits__horizon_deg=-5.0) as scope:
        moves = moves_of(scope)
        with pytest.raises(Refused, match=r"axis ?1 goes at up to ±0\.236°/s"):
            scope.jog(1, 0.5, 2.0)
        with pytest.raises(Unreachable, match="axis1"):
            scope.goto("hadec:35,0")
        with pytest.raises(Unreachable, match="horizon"):
            scope.goto("altaz:180,-20")
        assert not moves
