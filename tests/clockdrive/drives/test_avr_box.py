"""What a configuration means for a stepper box, worked out by hand from the manual's gears."""

import json
import math
import re

import pytest
from telescope_bench import T0

from clockdrive import Telescope, VirtualClock
from clockdrive.cli import display
from clockdrive.cli.main import main
from clockdrive.clock import SystemClock
from clockdrive.configuration import load
from clockdrive.drives import kind_of
from clockdrive.drives.avr_box.sections import axes_of
from clockdrive.drives.avr_box.settings import gearings, park_counts, settings, worm_steps
from clockdrive.drives.configured import baud
from clockdrive.errors import ConfigurationError
from transports.serve import serve


def configured(**given):
    return load(None, {}, {"drive.kind": "avr-box", **{name.replace("__", "."): v for name, v in given.items()}})


def test_the_gears_are_those_of_the_manual():
    one, two = gearings(configured())
    assert 1.0 / one.step_deg_float == pytest.approx(66327.2727, abs=1e-3)
    assert 1.0 / two.step_deg_float == pytest.approx(33163.6364, abs=1e-3)
    assert worm_steps(axes_of(configured())[0]) == pytest.approx(66327.2727, abs=1e-3)
    assert settings(configured()).own_rate == pytest.approx(276.548673, abs=1e-6)
    assert settings(configured(drive__pec=True)).own_rate == pytest.approx(277.120269, abs=1e-4)  # the manual's table


def test_counts_fall_where_an_axis_is_reversed():
    found = configured(axis1__reversed=True, axis1__park_deg=10.0)
    assert settings(found).signs == (-1, 1)
    assert park_counts(found)[0] == -663273
    assert kind_of(found).timing(found).slew[0].rate == pytest.approx(-276.548673, abs=1e-6)


def test_a_new_simulator_stands_at_park_and_its_driver_knows():
    found = configured(axis1__park_deg=10.0, axis2__reversed=True)
    unit = kind_of(found).simulated(found, T0, None)
    assert (unit.true_position(1), unit.true_position(2)) == park_counts(found)
    memory = kind_of(found).memory_at_park(found, T0)
    assert [axis["counts"] for axis in memory["axes"]] == list(park_counts(found))
    assert unit.snapshot()["motors"][1]["position"] == -park_counts(found)[1]


def test_a_simulator_goes_on_from_its_snapshot():
    found = configured()
    unit = kind_of(found).simulated(found, T0, None)
    unit.receive(b"C\x00M\x00\x00\x02\x00\x02", T0)
    unit.advance(T0 + 3.0)
    other = kind_of(found).simulated(found, T0 + 60.0, unit.snapshot())
    unit.advance(T0 + 60.0)
    assert [other.true_position(axis) for axis in (1, 2)] == [unit.true_position(axis) for axis in (1, 2)]


@pytest.mark.parametrize(
    ("link", "speed"),
    [("COM3", 9600), ("serial:///dev/ttyUSB0?baud=19200", 19200), ("tcp://127.0.0.1:1", None), ("sim:", None)],
)
def test_the_speed_of_the_line_is_that_of_its_address(link, speed):
    assert baud(configured(drive__link=link)) == speed


def test_a_broken_slew_table_is_refused_with_its_file_and_what_is_wrong(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("1, 2, 3")
    with pytest.raises(ConfigurationError, match=r"drive.slew_table: .*table.csv has 3 entries"):
        settings(configured(drive__slew_table=str(path)))


def test_the_travel_is_as_configured():
    one, two = kind_of(configured()).axes(configured(axis1__min_deg=-90.0))
    assert (math.degrees(one.minimum), one.units) == (pytest.approx(-90.0), "microsteps")
    assert two.name == "axis2"


def test_the_command_makes_a_pec_table_of_a_file_and_draws_it(tmp_path, capsys):
    worm, toml, drawn = tmp_path / "worm.txt", tmp_path / "t.toml", tmp_path / "worm.png"
    worm.write_text(
        "".join(f"{k} {6.0 * math.sin(math.tau * k / 518.19) + 0.01 * k:.4f}\n" for k in range(0, 1100, 3))
    )
    toml.write_text('[drive]\nkind = "avr-box"\n')
    assert main(["-c", str(toml), "drive", "pec", str(worm), "--picture", str(drawn)]) == 0
    out, err = capsys.readouterr()
    assert out.startswith("const uint8_t PEC_table[519] PROGMEM")
    assert "harmonics 6.00″, 0.0" in err
    assert drawn.stat().st_size > 1000
    assert main(["-c", str(toml), "drive", "pec", str(tmp_path / "none"), "--json"]) == 1
    toml.write_text('[drive]\nkind = "tc410"\n')
    assert main(["-c", str(toml), "drive", "pec", str(worm)]) == 2


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    ("of_sidereal", "duty", "moves"),
    [
        (1.0, 0.1147, 0.0),  # 0.207 % of its own rate, of the 1.80 % by which it is faster
        (276.548673 / 277.120269, 0.0, 0.0),
        (0.99, -0.4577, 0.0),
        (0.965, -1.0, -4.3),  # the Moon
        (0.0, 0.0, -276.5),
    ],
)
def test_a_plan_shows_for_how_long_it_is_guided_and_what_short_moves_add(turned, of_sidereal, duty, moves):
    axis = kind_of(configured(axis1__reversed=turned)).axes(configured(axis1__reversed=turned))[0]
    shown = axis.words.of_rate(axis, of_sidereal * math.tau / 86164.0905)
    assert shown["guide_duty"] == pytest.approx(duty, abs=1e-3)
    assert shown["short_moves_counts_s"] == pytest.approx(-moves if turned else moves, abs=0.06)


def test_a_plan_shows_its_moves_its_commands_and_what_they_cost(tmp_path, capsys):
    toml = tmp_path / "t.toml"
    toml.write_text('[drive]\nkind = "avr-box"\nlink = "sim:"\n[limits]\nsun_avoidance_deg = 0\n')
    asked = ["plan", "altaz:60,50", "--at", "2027-01-15T08:00:00Z", "--from", "-1000000,-1000000"]
    assert main(["-c", str(toml), *asked, "--json"]) == 0
    one, two = json.loads(capsys.readouterr().out)["axes"]
    assert one["moves"] == math.ceil(abs(one["target_counts"] - one["from_counts"]) / 389_747) + 1  # of 27 s each
    assert one["longest_move_s"] <= 27.0
    assert 0.0 < one["moves_cost_s"] < 20.0
    assert two["moves"] >= 2
    assert main(["-c", str(toml), *asked]) == 0
    assert re.search(
        r"in \d+ moves of up to \d+\.\d s, which takes \d+\.\d s longer than one", capsys.readouterr().out
    )


def test_the_commands_of_a_rate_are_shown():
    one, two = kind_of(configured()).axes(configured())
    shown = one.words.of_rate(one, math.tau / 86164.0905)
    assert (shown["guide_command"], shown["guide_ticks"], shown["guide_every_s"]) == (
        "+",
        5,
        20.0,
    )  # 0.115 · 20 / 0.462
    assert one.words.of_rate(one, 0.99 * math.tau / 86164.0905)["guide_command"] == "-"
    assert two.words.of_rate(two, math.tau / 86164.0905 / 100.0) == {
        "single_step_every_s": pytest.approx(0.7217, abs=1e-3),
        "lag_arcsec": pytest.approx(0.165, abs=0.01),
    }
    assert two.words.of_rate(two, math.radians(31.0 / 3600.0))["lag_arcsec"] is None


@pytest.fixture
def box(tmp_path, capsys):
    """The command line of a box: words in; exit code, stdout and stderr."""
    toml = tmp_path / "t.toml"
    toml.write_text('[drive]\nkind = "avr-box"\nlink = "sim:"\n[state]\npath = "state"\n')

    def run(*words):
        code = main(["-c", str(toml), *words])
        return code, *capsys.readouterr()

    run.toml = toml
    return run


def test_what_a_box_tells_is_shown_once_and_its_encoders_say_where_the_axes_are(box):
    _, shown, _ = box("drive", "show")
    assert [shown.count(name) for name in ("pec_bin", "pec_zero", "encoder_1", "crystal")] == [1, 1, 1, 1]
    code, told, _ = box("drive", "encoders", "--json")
    one, two = json.loads(told)["encoders"]
    assert code == 0
    assert two["reading"] == 0
    assert two["step_arcsec"] == pytest.approx(1_296_000 / 20000)
    assert two["counts"] == pytest.approx(park_counts(configured())[1], abs=1.0)  # where a new simulator stands
    assert abs(one["off_arcsec"]) <= 1.5 * one["step_arcsec"]
    assert "axis 2: 0 since the box was switched on, 64.8″ each; position " in box("drive", "encoders")[1]
    box.toml.write_text(box.toml.read_text().replace('"sim:"', '"sim:"\nencoder_counts_per_turn = 0'))
    code, _, said = box("drive", "encoders")
    assert code == 1
    assert "encoder_counts_per_turn is 0" in said


@pytest.mark.parametrize("action", ["factory", "reload"])
def test_nothing_is_to_be_confirmed_that_a_box_does_not_have(box, action):
    code, _, said = box("drive", action)
    assert code == 1
    assert "has no registers of that kind" in said
    assert "--yes" not in said


def test_what_comes_of_it_left_alone_is_said_once(box):
    _, out, err = box("status")
    assert (out + err).count("nothing switches its tracking off") == 1
    _, out, err = box("drive", "show")
    assert (out + err).count("nothing switches its tracking off") == 1


def test_a_box_of_which_nobody_knows_where_it_is_is_not_said_to_have_limits_of_its_own(box):
    clock = SystemClock()
    with serve(
        kind_of(configured()).simulated(configured(), clock.now(), None), clock, "tcp://127.0.0.1:0"
    ) as server:
        box.toml.write_text(box.toml.read_text().replace("sim:", server.address))
        _, _, said = box("drive", "show")
    assert "soft limits" not in said
    assert "nothing switches its tracking off, and nobody knows how far a limit is" in said


def test_unpark_of_a_telescope_that_is_not_parked_says_so(box):
    assert box("unpark")[1] == "unpark: it was not parked; nothing is changed\n"


def test_a_jog_is_called_a_jog_and_an_axis_that_stays_makes_no_moves(tmp_path, capsys):
    with (
        Telescope.simulated("avr-box", clock=VirtualClock(T0), overrides={"state.path": str(tmp_path)}) as scope,
        display.progress_bar(quiet=False) as show,
    ):
        text = display.plan_text(scope.jog(1, 0.1, 3.0, lambda progress: show(vars(progress))).json)
    assert capsys.readouterr().err.startswith("jog of axis1: ")
    assert "held against its own tracking by short moves" in text
    assert "without a move" in text


def test_encoders_that_count_beyond_what_an_answer_can_say_are_refused_with_the_most():
    with pytest.raises(ConfigurationError, match=r"turn = 400000.*five digits.*340.*at most 105881"):
        settings(configured(drive__encoder_counts_per_turn=400_000))
    assert settings(configured(drive__encoder_counts_per_turn=105_881)).encoder_counts_per_turn == 105_881
    wide = {"drive__encoder_counts_per_turn": 105_881, "axis1__min_deg": -180.0, "axis1__max_deg": 180.0}
    with pytest.raises(ConfigurationError, match="at most 99999"):
        settings(configured(**wide))


def test_moves_too_short_to_be_ended_in_time_are_refused_without_encoders():
    blind = {"drive__encoder_counts_per_turn": 0}
    with pytest.raises(ConfigurationError, match=r"uninterruptible_s = 9: without encoders .* 10 s or more"):
        configured(drive__max_uninterruptible_s=9.0, **blind)
    assert settings(configured(drive__max_uninterruptible_s=10.0, **blind)).blind
    assert not settings(configured(drive__max_uninterruptible_s=9.0)).blind
