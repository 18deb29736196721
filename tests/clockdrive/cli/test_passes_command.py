"""`clockdrive passes`: a whole catalogue or one target, sorted by rise, and a line for what has none."""

import json
import time

import pytest
from satellites import EPOCH_UTC, ORBITS, catalogue, lines

from clockdrive.cli import main

AT = ("--at", EPOCH_UTC)
FALLEN = "\n".join(("FALLEN", *lines(8, 51.6, 10, 0.0005, 20, 30, 16.35, " 90000-2"))) + "\n"


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)

    def runs(*words):
        code = main(["passes", *words])
        done = capsys.readouterr()
        assert "Traceback" not in done.err, done.err
        return code, done.out, done.err

    return runs


@pytest.fixture
def file(tmp_path):
    def write(text):
        (tmp_path / "many.tle").write_text(text, encoding="utf-8")
        return "many.tle"

    return write


def test_a_catalogue_is_searched_and_sorted_by_rise(run, file):
    begun = time.perf_counter()
    code, out, _ = run(file(catalogue(200)), *AT, "--hours", "12", "--json")
    answer = json.loads(out)
    rises = [each["rise"]["utc"] for each in answer["passes"]]
    print(f"200 satellites, 12 h: {len(rises)} passes in {time.perf_counter() - begun:.1f} s")
    assert (code, answer["ok"]) == (0, True)
    assert rises == sorted(rises)
    assert len({each["target"] for each in answer["passes"]}) + len(answer["without"]) == 200
    first = answer["passes"][0]
    assert first["rise"]["utc"] <= first["culmination"]["utc"] <= first["set"]["utc"]
    assert first["culmination"]["altitude_deg"] >= 15.0
    assert "days old: expect it up to" in first["note"]


def test_what_cannot_be_followed_is_a_line_and_not_an_end(run, file):
    text = catalogue(12) + FALLEN
    code, out, err = run(file(text), "--at", "2026-12-09T12:00:00Z", "--hours", "24")
    assert code == 0
    assert "target" in out.splitlines()[1]
    assert "FALLEN (8, of 2026-11-24T12:00:00Z): by 2026-12-09T12:00:00Z" in out
    assert "decayed; get newer elements" in out
    assert "does not rise above 15.00°: the highest is" in out
    assert "--json has such a note for all" in out
    assert "searching FALLEN" in err
    assert "100%" in err


def test_one_satellite_and_one_star(run, file):
    name = file("\n".join(("ISS", *ORBITS["400 km"])))
    _, bare, _ = run(name, *AT)
    _, prefixed, _ = run(f"tle:{name}#iss", *AT)
    assert bare == prefixed
    assert bare.count("ISS  ") >= 3
    code, out, _ = run("Canopus", *AT)
    assert code == 0
    assert "up already" in out
    code, out, _ = run("Polaris", *AT)
    assert (code, "Polaris does not rise above 15.00°" in out) == (0, True)


def test_a_single_satellite_that_cannot_be_followed_is_refused(run, file):
    code, out, err = run(file(FALLEN), "--at", "2026-12-09T12:00:00Z")
    assert (code, out) == (1, "")
    assert "decayed; get newer elements" in err
    code, _, err = run(file(catalogue(1)), "--at", "2027-06-01T00:00:00Z")
    assert code == 1
    assert "188 days from" in err
    assert "more than 90" in err


def test_an_altitude_can_be_asked_for(run, file):
    name = file(catalogue(30))
    every = json.loads(run(name, *AT, "--json")[1])["passes"]
    high = json.loads(run(name, *AT, "--above", "50", "--json")[1])["passes"]
    assert 0 < len(high) < len(every)
    assert min(each["rise"]["altitude_deg"] for each in high) > 49.9


ROCK = (
    "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: time, datatype: string}\n"
    "# - {name: ra, unit: deg, datatype: float64}\n# - {name: dec, unit: deg, datatype: float64}\n"
    "# meta: {observer: topocentric}\ntime ra dec\n"
    + "".join(f"2026-11-24T{hour:02d}:00:00 {0.1 * hour} -40.0\n" for hour in range(9, 19))
)


def test_a_table_is_searched_where_it_holds_something_and_the_note_says_so(run, tmp_path):
    """At Kaikoura the place of 0 h, −40° stands above 15° from before 9 h UT to about 13 h."""
    (tmp_path / "rock.ecsv").write_text(ROCK, encoding="utf-8")
    code, out, _ = run("ephem:rock.ecsv", "--at", "2026-11-24T00:00:00Z", "--hours", "48", "--json")
    answer = json.loads(out)
    assert code == 0
    assert answer["notes"][0].startswith("rock: its table holds 2026-11-24T09:00:00")
    assert "searched from 2026-11-24T09:00:00.001Z to 2026-11-24T17:59:59.999Z" in answer["notes"][0]
    (found,) = answer["passes"]
    assert found["rise"]["utc"].startswith("2026-11-24T09:00:00")
    assert found["begun"]
    inside = run("ephem:rock.ecsv", "--at", "2026-11-24T09:30:00Z", "--hours", "1", "--json")
    assert not any("its table" in note for note in json.loads(inside[1])["notes"])
    assert "1 pass (UTC" in run("ephem:rock.ecsv", "--at", "2026-11-24T09:30:00Z", "--hours", "1")[1]
    code, _, err = run("ephem:rock.ecsv", "--at", "2026-12-01T00:00:00Z")
    assert code == 1
    assert (
        "nothing of 2026-12-01T00:00:00.000Z to 2026-12-02T00:00:00.000Z; search in that time (--at, --hours)" in err
    )
