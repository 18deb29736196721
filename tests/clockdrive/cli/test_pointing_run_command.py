"""`clockdrive pointing-run`: a run is taken, resumed, looked at, fitted, masked, put in force and handed on."""

import io
import json

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from clockdrive.cli import main
from clockdrive.clock import VirtualClock
from pointing.model.tpoint_file import write_tpoint

CONFIGURATION = """
[site]
latitude_deg = -42.4
longitude_deg = 173.7
[mount]
type = "german"
[limits]
sun_avoidance_deg = 0.0
[simulator]
misalignment_x_arcsec = 900
collimation_arcsec = 180
[axis1]
acceleration_register = 255
deceleration_register = 255
[axis2]
acceleration_register = 255
deceleration_register = 255
"""


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """The command on the embedded simulator, whose nights pass at once; each command begins where the last ended."""
    clock = VirtualClock(1.8e9)
    (tmp_path / "telescope.toml").write_text(CONFIGURATION, encoding="utf-8")
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("clockdrive.telescope.parts.SystemClock", lambda: clock)

    def runs(*words, command="pointing-run"):
        code = main(["-c", "telescope.toml", command, *words])
        done = capsys.readouterr()
        assert "Traceback" not in done.err, done.err
        return code, done.out, done.err

    return runs


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.dat"
    write_tpoint(simulated_run("german", -42.4, TRUTH["german"], 30, np.random.default_rng(5)).run, path)
    return path.name


def told(out):
    return json.loads(out)


def test_a_run_is_taken_appended_to_applied_and_shown_by_the_status(run, tmp_path):
    code, out, err = run("--name", "night", "--stars", "6", "-o", "model.mod", "--apply")
    assert code == 0, err
    assert err.count(": observed, ") == 6
    assert "CH" in out
    assert "written: model.mod" in out
    assert "the telescope points with this model now; `clockdrive offset clear pointing model` ends that" in out
    assert (tmp_path / "model.mod").read_text(encoding="utf-8").startswith("night")
    code, out, _ = run("--json", command="status")
    (row,) = [each for each in told(out)["corrections"] if each["name"] == "pointing model"]
    assert row["terms_arcsec"]["CH"] == pytest.approx(180.0, abs=1.0)
    assert row["terms_arcsec"]["MA"] == pytest.approx(-900.0, abs=1.0)
    code, out, _ = run("append", "night", "--stars", "6", "--json")
    answer = told(out)
    assert (code, answer["ok"], answer["n"], answer["run"]["observed"]) == (0, True, 12, 12)
    assert answer["cross_validation_arcsec"] < 5.0
    assert answer["recommendation"]
    assert run("clear", "pointing", "model", command="offset")[0] == 0
    assert not [each for each in told(run("--json", command="status")[1])["corrections"] if "terms_arcsec" in each]


def test_an_interrupted_run_says_how_it_goes_on_and_does(run, monkeypatch):
    from clockdrive import run_calls

    tell, seen = run_calls._told, []

    def interrupted(progress):
        seen.append(progress.number)
        if progress.number == 4 and progress.state == "looking" and seen.count(4) == 2:
            raise KeyboardInterrupt
        return tell(progress)

    monkeypatch.setattr(run_calls, "_told", interrupted)
    code, _, err = run("--name", "night", "--stars", "6")
    assert code == 130
    assert "what was seen is kept; `pointing-run resume` goes on with it" in err
    assert "night: equatorial, 3 observed, 3 to go: resume it" in run("list")[1]
    seen[:] = [number for number in seen if number != 4]  # interrupted there again
    code, out, _ = run("resume", "night", "--json")
    assert code == 130
    assert told(out) == {"ok": False, "reason": "interrupted", "run": "night"}
    code, out, err = run("resume", "--json")
    assert code == 0, err
    assert told(out)["run"]["observed"] == 6
    assert seen[-1] == 6


def test_a_file_is_imported_listed_shown_fitted_masked_and_exported(run, file):
    assert run("import", "old", file, "--places", "observed")[0] == 0
    assert run("list")[1].strip() == "old: equatorial, 30 observed"
    code, out, _ = run("fit", "old", "--terms", "IH ID CH NP MA ME TF", "--json")
    found = {row["name"]: row["arcsec"] for row in told(out)["terms"]}
    assert code == 0
    assert all(found[name] == pytest.approx(arcsec, abs=8.0) for name, arcsec in TRUTH["german"].items())
    assert run("mask", "old", "3,7", "--reason", "a gust")[0] == 0
    assert told(run("show", "old", "--json")[1])["run"]["masked"] == [3, 7]
    assert run("unmask", "old", "3")[0] == 0
    _, out, err = run("worst", "old", "--count", "2", "--json")
    assert "clockdrive: masked " in err
    assert len(told(out)["run"]["masked"]) == 3
    assert run("export", "old", "out.ecsv")[1].strip() == "written: out.ecsv"
    assert run("import", "copy", "out.ecsv")[0] == 0
    assert (
        told(run("list", "--json")[1])["runs"][1]["masked"] == told(run("show", "old", "--json")[1])["run"]["masked"]
    )
    assert run("rename", "old", "older")[1].startswith("older: equatorial, 30 observed")
    assert run("forget", "older")[1].strip() == "older is deleted"
    assert run("list")[1].startswith("copy:")


def test_stars_left_out_and_the_pole_are_heeded_where_no_terms_are_named(run, file):
    run("import", "old", file, "--places", "observed")
    fits = [told(run("fit", "old", "--json", *words)[1])
            for words in ((), ("--mask", "0,1,2,3,4"), ("--pole", "refracted"))]  # fmt: skip
    assert [len(each["masked"]) for each in fits] == [0, 5, 0]
    assert "choice" in fits[1]  # the terms are still those that the run asks for
    assert "refracted pole" in " ".join(fits[2]["advice"])


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("fit", "--weather", "none"), 2, "tell how a file is read: give them to `pointing-run import`"),
        (("show", "nobody"), 2, "this telescope has no pointing runs: `clockdrive pointing-run` makes one"),
        (("mask", "night"), 2, "give the run, and observations counted from 0"),
        (("import", "night"), 2, "give a name for the run, and the file"),
        (("export", "night"), 2, "give the run, and a file that ends in .ecsv or .dat"),
        (("forget",), 2, "say which run to delete"),
        (("--witness", "nobody"), 1, "no witness 'nobody'; there is"),
        (("--witness", "encoders"), 2, "encoders see no sky"),
        (("--stars", "0"), 2, "a run of 0 stars: give a whole number from 1 to 1000"),
        (("--stars", "-3"), 2, "a run of -3 stars"),
        (("--witness", "command:no-such-program"), 1, "no program 'no-such-program' is found"),
        (("--stars", "6", "-o", "nowhere/model.mod"), 1, "there is no folder 'nowhere'"),
    ],
)
def test_what_cannot_be_is_refused_with_a_sentence_before_anything_moves(run, words, code, says):
    found, out, err = run(*words)
    assert (found, says in err, out) == (code, True, ""), err


@pytest.mark.parametrize("command", ["pointing-run", "polar-align"])
def test_the_end_of_the_input_ends_what_a_person_types(run, monkeypatch, command):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    code, out, err = run("--witness", "typed", "--settle", "0", command=command)
    assert (code, out) == (1, "")
    assert "nobody types any more" in err
    assert err.count("RA and Dec of the centre") == 1  # nobody is asked at a second place
    if command == "pointing-run":
        assert "goes on" in err
        assert "0 observed, 50 to go: resume it" in run("list")[1]


def test_the_minutes_that_are_left_are_told_after_the_first_place(run):
    _, _, err = run("--stars", "6")
    left = [float(line.split("; ")[1].split(" min left")[0]) for line in err.splitlines() if " min left" in line]
    print(f"minutes left: {left}")
    assert len(left) == 6
    assert left == sorted(left, reverse=True)
    assert left[0] >= 1.0
    assert left[-1] == 0.0


def test_a_witness_is_tried_before_a_run(run):
    code, out, _ = run("--try")
    assert (code, out.startswith("seen at azimuth "), "nothing has moved" in out) == (0, True, True)
    assert told(run("--try", "--json")[1])["off_arcsec"] > 100.0
    assert run("list")[1].strip() == "no pointing runs yet"
