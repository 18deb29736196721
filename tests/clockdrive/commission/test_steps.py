"""Each assumption set wrong on purpose is told; what cannot be tested says why; nothing moves where it must not."""

import subprocess
import sys
from dataclasses import replace

import pytest
from commission_bench import TrueAxis, Truth, mount

from clockdrive.errors import InputError, Refused
from clockdrive.witness import CommandWitness, WitnessError


def by_subject(findings):
    return {each.subject: each for each in findings}


@pytest.mark.parametrize("shift", [0, 4, 7])
def test_other_limit_registers_are_found_without_motion_and_forbid_it(shift, tmp_path, monkeypatch):
    with mount(tmp_path, Truth(simulator={"limit_shift": shift}), monkeypatch) as watched:
        before = watched.counts()
        found = by_subject(watched.commission())
        assert found["axis1 soft-limit registers"].verdict == "refuted"
        assert watched.counts() == before
        assert "nothing is moved" in found["gearing"].detail


@pytest.mark.parametrize("shift", [3, 6, 7])
def test_another_maximum_speed_register_is_found_and_forbids_long_moves(shift, tmp_path, monkeypatch):
    with mount(tmp_path, Truth(simulator={"speed_shift": shift}), monkeypatch) as watched:
        found = by_subject(watched.commission(["speed-register", "gearing"]))
        assert found["axis1 maximum-speed register"].verdict == "refuted", found["axis1 maximum-speed register"]
        assert f">> {shift}" in found["axis1 maximum-speed register"].detail
        assert found["gearing"].verdict == "untested"
        assert all(gone <= bound for gone, bound in watched.excursions.values())


@pytest.mark.parametrize("link", [{"latency_s": 0.08, "baud": 9600}, {"latency_s": 0.001}])
@pytest.mark.parametrize("error", [-0.1, 0.1])
def test_the_true_top_speed_is_seen_over_any_link(link, error, tmp_path, monkeypatch):
    """Over the slower one a reading takes 0.9 s, and the axis speeds up by 1° a second each second meanwhile."""
    with mount(tmp_path, Truth(simulator={**link, "acceleration_error": error}), monkeypatch) as watched:
        found = by_subject(watched.commission(["speed"]))
        gone, bound = watched.excursions["speed"]
    for axis in (1, 2):
        said = found[f"axis{axis} top speed"]
        assert said.verdict == "confirmed", said.detail
        speed = float(said.detail.partition("°")[0])
        print(f"{speed:.3f}°/s, {100.0 * (speed / 4.5 - 1.0):+.2f} % off")
        assert speed == pytest.approx(4.5, rel=0.005)
    assert gone <= bound


@pytest.mark.parametrize("idle", ["both", "per-axis"])
@pytest.mark.parametrize("believed", ["both", "per-axis"])
def test_when_tracking_resumes_is_found(idle, believed, tmp_path, monkeypatch):
    truth = Truth(simulator={"slew_idle": idle}, believed={"drive.slew_idle": believed})
    with mount(tmp_path, truth, monkeypatch) as watched:
        found = by_subject(watched.commission(["landing"]))["tracking after a slew"]
    assert found.verdict == ("confirmed" if idle == believed else "refuted")
    assert found.found == idle


@pytest.mark.parametrize("clears", [True, False])
def test_whether_the_slew_bit_clears_itself_is_told(clears, tmp_path, monkeypatch):
    with mount(tmp_path, Truth(simulator={"slew_bit_clears": clears}), monkeypatch) as watched:
        found = by_subject(watched.commission(["slew-bit"]))["slew bit"]
    assert found.verdict == ("confirmed" if clears else "refuted")


def test_encoders_alone_find_gears_but_not_the_sense_on_the_sky(tmp_path, monkeypatch):
    truth = Truth((TrueAxis(main_gear="1/288", encoder_bits=16), TrueAxis(encoder_bits=16)),
                  believed={"axis1.encoder_bits": 16, "axis2.encoder_bits": 16, "axis2.park_deg": -20.0})  # fmt: skip
    with mount(tmp_path, truth, monkeypatch) as watched:
        found = by_subject(watched.commission(["gearing"], "encoders"))
    assert (found["axis1 gears"].verdict, found["axis1 gears"].found) == ("refuted", "1/288")
    assert found["axis2 gears"].verdict == "confirmed"
    assert found["axis1 sense"].verdict == "untested"
    assert "--witness" in found["axis1 sense"].detail


WHOLE_TURNS = {"main_gear": "375/32768", "secondary_gear": "1/8"}  # 2²³ counts are six turns of the axis exactly


@pytest.mark.parametrize("believed", ["centre", "zero"])
def test_an_encoder_zero_whole_turns_away_is_told_to_be_the_same(believed, tmp_path, monkeypatch):
    keys = {f"axis1.{name}": value for name, value in WHOLE_TURNS.items()}
    keys |= {"axis1.encoder_bits": 16, "axis1.encoder_zero_at": believed, "axis2.park_deg": -20.0}
    truth = Truth((TrueAxis(encoder_bits=16, **WHOLE_TURNS), TrueAxis()), {"encoder_zero_at": "zero"}, keys)
    assert truth.axes[0].zeros_apart_deg == 0.0
    with mount(tmp_path, truth, monkeypatch) as watched:
        found = by_subject(watched.commission(["encoder-zero"]))["axis1 encoder zero"]
        preset = [
            replace(watched.scope._session.drive.encoders.configured[0], zero_counts=counts).counts(12345, 2.0**23)
            for counts in (0, 2**23)
        ]
    assert (found.verdict, found.changes) == ("confirmed", False)
    assert "either means the same" in found.detail
    assert preset[0] == pytest.approx(preset[1], abs=1e-3)


def zero_found_at(truth, folder, monkeypatch, witness="sky"):
    with mount(folder, truth, monkeypatch) as watched:
        return by_subject(watched.commission(["encoder-zero"], witness))["axis1 encoder zero"]


def test_an_encoder_zero_is_told_where_half_a_degree_decides_but_only_by_a_position_seen_on_the_sky(
    tmp_path, monkeypatch
):
    gears = {"main_gear": "1/285", "secondary_gear": "2039/5000"}
    truth = Truth((TrueAxis(encoder_bits=16, **gears), TrueAxis()), {"encoder_zero_at": "zero"},
                  {"axis1.encoder_bits": 16, "axis2.park_deg": -20.0})  # fmt: skip
    assert 0.5 < truth.axes[0].zeros_apart_deg < 0.6
    found = zero_found_at(truth, tmp_path / "seen", monkeypatch)
    assert (found.verdict, found.found) == ("refuted", "zero")
    blind = zero_found_at(truth, tmp_path / "blind", monkeypatch, "encoders")
    assert blind.verdict == "untested"
    assert "--witness" in blind.detail


def test_without_witness_and_encoders_everything_on_the_sky_is_left_open(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        found = by_subject(watched.commission((), "encoders"))
    assert {found[f"axis{axis} {what}"].verdict for axis in (1, 2) for what in ("sense", "gears")} == {"untested"}
    assert found["tracking after a slew"].verdict == "confirmed"


class Liar:
    """A witness that is wrong by 40°, or fails."""

    def __init__(self, sky, *, off_deg=0.0, fails=""):
        self.sky, self.off_deg, self.fails = sky, off_deg, fails

    def look(self):
        import math
        from dataclasses import replace

        if self.fails:
            raise WitnessError(self.fails)
        seen = yield from self.sky.look()
        c, s = math.cos(math.radians(self.off_deg)), math.sin(math.radians(self.off_deg))
        x, y, z = seen.observed
        return replace(seen, observed=(c * x - s * z, y, s * x + c * z))


def test_a_witness_that_lies_by_forty_degrees_is_not_believed(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        found = watched.commission(["gearing"], Liar(watched.sky, off_deg=40.0))
    said = by_subject(found)
    assert said["sense"].verdict == said["gearing"].verdict == "untested"
    assert "40.0° from its position" in said["sense"].detail
    assert not any(each.changes for each in found)


def test_a_witness_that_fails_leaves_its_steps_open_and_the_others_go_on(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        found = by_subject(watched.commission((), Liar(watched.sky, fails="too few stars; expose longer")))
    assert "expose longer" in found["gearing"].detail
    assert found["slew bit"].verdict == "confirmed"


def test_an_unsynchronised_telescope_is_asked_standing_still(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        watched.device.power_cycle()
        watched.scope.wait(5.0)
        before = watched.counts()
        found = by_subject(watched.commission())
        assert watched.counts() == before
    assert found["axis1 soft-limit registers"].verdict == "confirmed"
    assert "not synchronised" in found["gearing"].detail
    assert "sync" in found["gearing"].detail


def test_a_bound_that_does_not_fit_the_limits_skips_the_step_with_the_reason(tmp_path, monkeypatch):
    truth = Truth(believed={"axis1.park_deg": 168.0, "axis2.park_deg": -80.0})
    with mount(tmp_path, truth, monkeypatch) as watched:
        found = by_subject(watched.commission(["gearing"]))
    assert "needs 5.375° to all sides" in found["gearing"].detail
    assert "soft limit" in found["gearing"].detail or "outside" in found["gearing"].detail


def test_a_tracking_telescope_and_a_parked_one_are_not_commissioned(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        watched.scope.goto("hadec:2,-40")
        with pytest.raises(Refused, match="stop"):
            watched.commission(["link"])
        watched.scope.stop()
        watched.scope.park()
        with pytest.raises(Refused, match="unpark"):
            watched.commission(["link"])


def test_an_unknown_step_or_witness_is_told_with_those_there_are(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        with pytest.raises(InputError, match="position-format"):
            watched.commission(["gears"])
        with pytest.raises(WitnessError, match="command:PROGRAM"):
            watched.commission(["link"], "guess")


def solved(watched, command, patience_s=180.0, *, ends=True):
    """One look of a plate solver; each wait of the witness is one for the program's end, if it ends."""
    steps = CommandWitness(command, watched.scope._session.planner, watched.scope.clock, patience_s=patience_s).look()
    started = []
    popen = subprocess.Popen

    def start(*args, **keys):
        started.append(popen(*args, **keys))
        return started[-1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clockdrive.witness.subprocess.Popen", start)
        while True:
            try:
                next(steps)
            except StopIteration as done:
                return done.value
            if ends:
                started[-1].wait(60.0)


@pytest.mark.parametrize("text", ["83.633 22.0145", "83.633, 22.0145", "05:34:31.92 +22:00:52.2",
                                  "field solved\n83.633 +22.0145 2027-01-15T08:00:00Z"])  # fmt: skip
def test_a_plate_solver_is_read_in_degrees_and_sexagesimal(text, tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched:
        planner = watched.scope._session.planner
        from clockdrive import parse
        from pointing.instant import Instant
        from pointing.limits import separation

        program = tmp_path / "solver.py"
        program.write_text(f"print({text!r})", encoding="utf-8")
        seen = solved(watched, f"{sys.executable} {program}")
        expected = parse.target("83.633,22.0145").observed(planner.sky.at(Instant.from_posix(seen.time)))
        assert separation(seen.observed, expected) < 5e-6


@pytest.mark.parametrize(
    ("command", "said"),
    [("/no/such/solver", "cannot be run"), ("false", "exit code 1"), ("echo no stars", "print RA and Dec"),
     ("echo M31", "print RA and Dec"), ("true", "print RA and Dec"), ("echo 400 22", "right ascension")],
)  # fmt: skip
def test_a_plate_solver_that_fails_says_why(command, said, tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched, pytest.raises(WitnessError, match=said):
        solved(watched, command)


def test_a_plate_solver_that_hangs_is_ended(tmp_path, monkeypatch):
    with mount(tmp_path, Truth(), monkeypatch) as watched, pytest.raises(WitnessError, match="said nothing"):
        solved(watched, "sleep 60", patience_s=1.0, ends=False)
