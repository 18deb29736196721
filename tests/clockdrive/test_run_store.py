"""What is kept of pointing runs: everything, in one file, whatever ends the process."""

import sqlite3
import subprocess
import sys
import threading
from dataclasses import replace

import pytest

from clockdrive.errors import InputError, Refused, StateError
from clockdrive.run_store import FILE_NAME, Observation, PlacedStar, RunStore, StoredRun
from pointing.run_plan import RunPlace

PLACES = tuple(RunPlace(0.1 * i, 0.5 + 0.1 * i, ("normal", "beyond")[i % 2], ("", "Vega")[i % 2]) for i in range(4))


def seen(number=0, **others):
    return replace(
        Observation(
            1.8e9 + number, (8388608.25 + number, 8388000.5), (1.25, -95.5), "beyond", 123.456789012345, 45.0, 2.0,
            "Vega", {"pressure_hpa": 1009.6}, {"pointing_model_arcsec": {"IH": 1.5}}, weight=0.25,
        ),
        **others,
    )  # fmt: skip


def run(name="night", places=PLACES, observations=()):
    placed = tuple(PlacedStar(number, place) for number, place in enumerate(places, start=1))
    return StoredRun(name, 1.8e9, "equatorial", -42.4, {"stars": 4, "witness": "simulator"}, placed, observations)


@pytest.fixture
def store(tmp_path):
    with RunStore(tmp_path, "tc410 sim:") as opened:
        yield opened


def test_a_run_is_read_back_as_it_was_kept_by_another_process_too(store, tmp_path):
    store.begin(run())
    store.observed("night", 1, seen())
    store.skipped("night", 2, "cloud: ☁")
    with RunStore(tmp_path, "tc410 sim:") as other:
        found = other.read("night")
    assert found.observations == (seen(),)
    assert [each.state for each in found.places] == ["observed", "skipped", "planned", "planned"]
    assert [each.place.posture for each in found.places] == [place.posture for place in PLACES]
    assert [each.place.azimuth for each in found.places] == pytest.approx(
        [place.azimuth for place in PLACES], abs=1e-15
    )
    assert [(each.reason, each.tries) for each in found.skipped] == [("cloud: ☁", 1)]
    assert [each.number for each in found.pending] == [3, 4]
    assert found.settings == {"stars": 4, "witness": "simulator"}


def test_the_newest_run_is_meant_where_nobody_says_which(store):
    store.begin(run("first"))
    store.begin(replace(run("second"), began=1.9e9))
    assert store.read().name == "second"
    assert store.names() == ("first", "second")


def test_a_place_that_was_skipped_and_then_seen_is_seen(store):
    store.begin(run())
    store.skipped("night", 1, "cloud")
    store.observed("night", 1, seen())
    assert [(each.state, each.reason, each.tries) for each in store.read().places[:1]] == [("observed", "", 2)]
    assert store.read().skipped == ()


def test_places_are_added_behind_those_that_are_there(store):
    store.begin(run())
    store.append("night", PLACES[:2])
    assert [each.number for each in store.read().places] == [1, 2, 3, 4, 5, 6]


def test_masks_are_kept_with_their_reason_and_taken_off(store):
    store.begin(run(observations=tuple(seen(i) for i in range(5))))
    store.mask("night", [1, 3], "a gust")
    store.mask("night", [4])
    assert [each.masked for each in store.read().observations] == ["", "a gust", "", "a gust", "by hand"]
    store.mask("night", [1, 4], "")
    assert [each.masked for each in store.read().observations] == ["", "", "", "a gust", ""]
    with pytest.raises(InputError, match=r"observation 5; the run night has 5, counted from 0"):
        store.mask("night", [0, 5])
    assert store.read().observations[0].masked == ""


def test_telescopes_do_not_see_the_runs_of_each_other(store, tmp_path):
    store.begin(run())
    with RunStore(tmp_path, "another") as other:
        assert other.names() == ()
        other.begin(run())
        other.observed("night", 1, seen(7))
        other.forget("night")
    assert store.names() == ("night",)
    assert store.read().observations == ()


def test_what_is_not_there_or_there_already_is_said_with_what_there_is(store):
    with pytest.raises(InputError, match="this telescope has no pointing runs: `clockdrive pointing-run` makes one"):
        store.read()
    store.begin(run())
    with pytest.raises(InputError, match="there is a pointing run 'night' already: resume it, or give another name"):
        store.begin(run())
    for call in (store.read, store.forget, lambda name: store.mask(name, [0])):
        with pytest.raises(InputError, match="no pointing run 'day': there is night"):
            call("day")


def test_a_number_that_is_none_is_not_kept_and_neither_is_half_of_its_record(store):
    store.begin(run())
    with pytest.raises(StateError, match="every number in it must be finite"):
        store.observed("night", 1, seen(azimuth_deg=float("nan")))
    assert store.read().observations == ()
    assert store.read().places[0].state == "planned"


def test_a_file_of_another_program_or_of_a_later_version_is_left_alone(tmp_path):
    with sqlite3.connect(tmp_path / FILE_NAME) as foreign:
        foreign.execute("CREATE TABLE mine (x)")
    foreign.close()
    with pytest.raises(StateError, match="is not a store of pointing runs that can be used: it belongs to another"):
        RunStore(tmp_path, "x")
    later = tmp_path / "later"
    RunStore(later, "x").close()
    with sqlite3.connect(later / FILE_NAME) as newer:
        newer.execute("PRAGMA user_version = 9")
    newer.close()
    with pytest.raises(StateError, match="is of version 9, and this Clockdrive knows 2: update Clockdrive"):
        RunStore(later, "x")


def test_several_threads_lose_nothing(store):
    store.begin(run(places=PLACES[:1] * 40))
    threads = [threading.Thread(target=store.observed, args=("night", i + 1, seen(i))) for i in range(40)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    found = store.read()
    assert {each.time for each in found.observations} == {1.8e9 + i for i in range(40)}
    assert not found.pending


KILLED = """
import os, signal, sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from test_run_store import RunStore, run, seen
store = RunStore(Path(sys.argv[1]), "tc410 sim:")
store.begin(run())
store.observed("night", 1, seen(1))
with store._file.transaction(durable=True):
    store._add(store._key("night"), 2, seen(2))
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_a_process_killed_within_a_record_leaves_the_records_before_it(tmp_path):
    from pathlib import Path

    here = str(Path(__file__).parent)
    killed = subprocess.run([sys.executable, "-c", KILLED, str(tmp_path), here], check=False, timeout=60)
    assert killed.returncode < 0
    with RunStore(tmp_path, "tc410 sim:") as store:
        found = store.read()
    assert found.observations == (seen(1),)
    assert [each.number for each in found.pending] == [2, 3, 4]


def test_a_file_of_the_first_version_is_read_and_written_with_weights_of_one(tmp_path):
    with RunStore(tmp_path, "tc410 sim:") as store:
        store.begin(run(observations=(seen(weight=1.0),)))
    with sqlite3.connect(tmp_path / FILE_NAME) as old:
        old.execute("ALTER TABLE observations DROP COLUMN weight")
        old.execute("ALTER TABLE observations ADD COLUMN synchronised REAL")
        old.execute("PRAGMA user_version = 1")
    old.close()
    with RunStore(tmp_path, "tc410 sim:") as store:
        store.observed("night", 1, seen(weight=0.5))
        assert store.read("night").observations == (seen(weight=1.0), seen(weight=0.5))


def test_a_store_that_another_process_holds_is_waited_for_no_longer_than_was_said(tmp_path):
    with RunStore(tmp_path, "tc410 sim:", patience_s=0.1) as store:
        store.begin(run())
        other = sqlite3.connect(tmp_path / FILE_NAME, isolation_level=None)
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(StateError, match=r"another process has held it for 0.1 s: end that one"):
            store.observed("night", 1, seen())
        other.close()
        store.observed("night", 1, seen())


@pytest.mark.parametrize("name", ["", "  ", " night", "a\nb", "a\x1b[2J"])
def test_a_name_that_cannot_be_read_on_a_line_is_no_name_of_a_run(store, name):
    store.begin(run("night"))
    with pytest.raises(InputError, match="printable characters on one line"):
        store.begin(run(name))
    with pytest.raises(InputError, match="printable characters on one line"):
        store.rename("night", name)
    assert store.names() == ("night",)


def test_a_renamed_run_is_the_same_run(store):
    store.begin(run("night", observations=(seen(),)))
    store.begin(run("other"))
    before = store.read("night")
    store.rename("night", "cold night")
    assert replace(store.read("cold night"), name="night") == before
    with pytest.raises(InputError, match="there is a pointing run 'other' already"):
        store.rename("cold night", "other")


def test_a_run_that_is_being_taken_is_neither_deleted_nor_renamed_by_anybody(store, tmp_path):
    store.begin(run("night"))
    with RunStore(tmp_path, store.telescope) as taker, taker.taking("night"):
        for change in (lambda: store.forget("night"), lambda: store.rename("night", "day")):
            with pytest.raises(Refused, match="the run night is being taken: `clockdrive stop` first"):
                change()
    assert store.names() == ("night",)
    store.forget("night")
    assert store.names() == ()
