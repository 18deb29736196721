"""`clockdrive polar-align` from its words to its exit codes: advice, keys, and the registers it writes."""

import io
import json
import tomllib
from dataclasses import replace

import pytest

from clockdrive import VirtualClock
from clockdrive.cli import main

CONFIGURATION = """
[site]
name = "here"
latitude_deg = -42.4
longitude_deg = 173.7
[mount]
type = "equatorial-fork"   # stays
[drive]
kind = "tc410"
link = "sim:"
[axis1]
acceleration_register = 255
deceleration_register = 255
[axis2]
acceleration_register = 255
deceleration_register = 255
[limits]
sun_avoidance_deg = 0.0
[simulator]
misalignment_x_arcsec = 2000.0
misalignment_y_arcsec = -1000.0
[state]
path = "{folder}"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text(CONFIGURATION.replace("{folder}", tmp_path.as_posix()), encoding="utf-8")
    return path


@pytest.fixture
def run(capsys, monkeypatch):
    def runs(*words, typed=""):
        monkeypatch.setattr("sys.stdin", io.StringIO(typed))
        monkeypatch.setattr("clockdrive.telescope.parts.SystemClock", lambda: VirtualClock(1_800_000_000.0))
        code = main([str(word) for word in words])
        done = capsys.readouterr()
        assert "Traceback" not in done.err, done.err
        return code, done.out, done.err

    return runs


def test_the_advice_is_told_and_the_end_of_the_input_ends_it(run, file):
    code, out, err = run("-c", file, "polar-align", "--settle", "0")
    assert code == 0
    assert "polar axis by" in out
    assert "south end" in out
    assert "star 3 of 3 seen" in err


def test_registers_are_written_into_the_file_instead(run, file):
    code, out, err = run("-c", file, "polar-align", "--settle", "0", "--write-mount", "--json")
    answer, kept = json.loads(out), file.read_text(encoding="utf-8")
    mount = tomllib.loads(kept)["mount"]
    print(f"\nwritten: {mount}, true 2000000, -1000000")
    assert code == 0
    assert mount["mount_x_mas"] == answer["mount_x_mas"] == pytest.approx(2000000, abs=2000)
    assert mount["mount_y_mas"] == answer["mount_y_mas"] == pytest.approx(-1000000, abs=2000)
    assert "# stays" in kept
    assert "`sync` on a star" in err
    assert "drive push" in err


def test_nothing_is_turned_and_looking_again_says_the_same(run, file):
    code, out, err = run("-c", file, "polar-align", "--settle", "0", "--json", typed="x\nr\nq\n")
    states = json.loads(out)["states"]
    assert code == 0
    assert "'x'?" in err
    assert len(states) == 2
    assert states[1]["off_arcsec"] == pytest.approx(states[0]["off_arcsec"], abs=3.0)


def test_encoders_and_a_goal_of_nothing_are_refused(run, file):
    code, _, err = run("-c", file, "polar-align", "--witness", "encoders")
    assert code != 0
    assert "encoders see no sky" in err
    code, _, err = run("-c", file, "polar-align", "--goal", "0", "--settle", "0")
    assert code != 0
    assert "a goal of 0″" in err


def test_begun_anew_after_a_look_that_was_not_taken_before_which_nothing_is_written(run, file, monkeypatch):
    from clockdrive.aligning import Aligning

    learned, kept = Aligning._learned, file.read_text(encoding="utf-8")

    def astray(self, estimate, seen):
        return learned(self, estimate, replace(seen, altitude_deg=seen.altitude_deg + 0.6))

    monkeypatch.setattr(Aligning, "_learned", astray)
    code, out, err = run("-c", file, "polar-align", "--settle", "0", "--json", typed="r\nw\nr\nn\nq\n")
    assert code == 0
    assert "not written: the last look was not taken: this advice is from before it; look again" in err
    assert "or begin anew (`n`" in err
    assert [each["looks"] for each in json.loads(out)["states"]] == [3, 3]
    assert file.read_text(encoding="utf-8") == kept


def test_an_interruption_leaves_one_document_with_what_was_known(run, file, monkeypatch):
    from clockdrive.aligning import Aligning

    def interrupted(*_given, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr(Aligning, "look", interrupted)
    code, out, _ = run("-c", file, "polar-align", "--settle", "0", "--json", typed="r\n")
    answer = json.loads(out)
    assert code == 130
    assert (answer["ok"], answer["reason"], [each["looks"] for each in answer["states"]]) == (
        False,
        "interrupted",
        [3],
    )
