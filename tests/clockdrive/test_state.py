"""What the store remembers survives every end of the process that wrote it."""

import math
import sqlite3
import subprocess
import sys
import threading

import pytest

from clockdrive.errors import StateError
from clockdrive.state import (
    FILE_NAME,
    Activity,
    Correction,
    Event,
    Position,
    StateStore,
    Synchronisation,
    Zero,
)

WRITER = """
import sys, pathlib
from clockdrive.state import *
store = StateStore(pathlib.Path(sys.argv[1]), "tc410 sim:")
last = store.last_position()
n = int(last.time) if last else 0
store.begin(Activity("slewing", 1.0, to_counts=(5.0, 6.0)))
while True:
    n += 1
    store.record_position(Position(float(n), (float(n), -float(n)), (1.0, 1.0), f"n{n}"))
    store.record_event(Event(float(n), "step", "x" * 500, {"n": n}))
    if n % 7 == 0:
        store.record_synchronisation(Synchronisation(float(n), (float(n), -float(n)), 20.0, "test"))
    print(n, flush=True)
"""


@pytest.fixture
def store(tmp_path):
    with StateStore(tmp_path / "deep" / "state", "tc410 sim:") as store:
        yield store


def reopened(store: StateStore, telescope: str = "tc410 sim:") -> StateStore:
    store.close()
    return StateStore(store.path.parent, telescope)


def test_a_new_store_knows_nothing(store):
    assert store.last_position() is None
    assert store.activity() is None
    assert store.simulator() is None
    assert store.learnt("landing") == {}
    assert not store.parked()
    assert (store.corrections(), store.events(), store.synchronisations()) == ((), (), ())


def test_all_records_come_back_after_reopening(store):
    position = Position(100.5, (8388608.25, 8388000.0), (1.0, 0.5), "power-cycle")
    activity = Activity("slewing", 1.0, 9.5, (1.0, 2.0), (3.0, 4.0), "M1")
    corrections = (
        Correction("guide", 1.5, "arcsec", "user", 3.0),
        Correction("sync axis1", -3.25, "arcsec", "sync on Vega", 2.0),
    )
    store.record_position(position)
    store.begin(activity)
    for correction in reversed(corrections):
        store.set_correction(correction)
    store.record_parked(parked=True, time=4.0)
    store.learn("axis1", {"acceleration_scale": 1.03, "landing_s": 1.5}, 6.0)
    store.record_simulator({"ticks": 2**60, "positions": [1, 2]}, 7.0)
    store.record_event(Event(8.0, "goto", "M1 reached", {"error_arcsec": 0.4}))
    with reopened(store) as again:
        assert again.last_position() == position
        assert again.activity() == activity
        assert again.corrections() == corrections
        assert again.parked()
        assert again.learnt("axis1") == {"acceleration_scale": 1.03, "landing_s": 1.5}
        assert again.simulator() == ({"ticks": 2**60, "positions": [1, 2]}, 7.0)
        assert again.events() == (Event(8.0, "goto", "M1 reached", {"error_arcsec": 0.4}),)


def test_synchronising_makes_the_last_position_trustworthy(store):
    store.record_position(Position(1.0, (1.0, 2.0), (9.0, 9.0), "lost"))
    store.record_synchronisation(Synchronisation(2.0, (10.0, 20.0), 30.0, "sync on Vega"))
    store.record_synchronisation(Synchronisation(3.0, (11.0, 21.0), 5.0, "sync on Deneb"))
    assert store.last_position() == Position(3.0, (11.0, 21.0))
    assert [s.origin for s in store.synchronisations()] == ["sync on Deneb", "sync on Vega"]
    assert len(store.synchronisations(limit=1)) == 1


def test_syncs_add_up_by_how_much_they_moved_the_axes_until_the_position_is_lost(store):
    assert store.zero() == Zero(0, (0.0, 0.0))
    store.record_synchronisation(Synchronisation(2.0, (10.0, 20.0), 1.0, "Vega"), (0.25, -0.5))
    store.record_synchronisation(Synchronisation(3.0, (11.0, 21.0), 1.0, "Deneb"), (0.5, 0.125))
    with reopened(store) as again:
        assert again.zero() == Zero(0, (0.75, -0.375))
        again.record_synchronisation(Synchronisation(4.0, (12.0, 22.0), 1.0, "Altair"))
        assert again.zero() == Zero(1, (0.0, 0.0))
        with StateStore(again.path.parent, "another") as other:
            assert other.zero() == Zero()


def test_a_pointing_model_put_in_force_is_remembered_until_it_is_cleared(store):
    assert store.model() is None
    store.record_model("kept", 5.0)
    with reopened(store) as again:
        assert again.model() == "kept"
        again.clear_model()
        assert again.model() is None


def test_an_activity_ends_or_is_superseded(store):
    store.begin(Activity("slewing", 1.0))
    store.begin(Activity("tracking", 2.0))
    assert store.activity() == Activity("tracking", 2.0)
    store.end_activity()
    assert store.activity() is None


def test_a_correction_is_replaced_and_cleared_by_its_name(store):
    store.set_correction(Correction("offset", 1.0, "arcsec", "user", 1.0))
    store.set_correction(Correction("offset", 2.0, "arcsec", "user", 2.0))
    assert [c.value for c in store.corrections()] == [2.0]
    assert store.clear_correction("offset")
    assert not store.clear_correction("offset")


def test_each_telescope_has_its_own_memory(store):
    store.record_position(Position(1.0, (1.0, 2.0)))
    store.set_correction(Correction("offset", 1.0, "arcsec", "user", 1.0))
    with reopened(store, "tc410 COM3") as other:
        assert other.last_position() is None
        assert other.corrections() == ()


def test_old_events_are_forgotten_at_the_next_start_and_kinds_are_told_apart(store, monkeypatch):
    monkeypatch.setattr("clockdrive.state._KEPT_EVENTS", 10)
    for n in range(25):
        store.record_event(Event(float(n), "even" if n % 2 == 0 else "odd", str(n)))
    with reopened(store) as again:
        assert [event.text for event in again.events()] == [str(n) for n in range(24, 14, -1)]
        assert [event.text for event in again.events("odd", limit=2)] == ["23", "21"]


def test_what_was_acknowledged_survives_kill_minus_9_at_any_moment(tmp_path):
    acknowledged: list[int] = []
    for round_ in range(6):
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        with process:
            acknowledged.extend(int(process.stdout.readline()) for _ in range(3 + 11 * round_))
            process.kill()  # SIGKILL: no handler, no clean-up
            acknowledged += [int(line) for line in process.stdout.read().split()]
            assert process.stderr.read() == ""
        with StateStore(tmp_path, "tc410 sim:") as store:
            position = store.last_position()
            assert position.time >= acknowledged[-1]
            assert position.counts == (position.time, -position.time)
            assert position.unsynchronised in {"", f"n{int(position.time)}"}
            numbers = [event.data["n"] for event in store.events(limit=100_000)]
            assert numbers[0] in {position.time, position.time - 1}
            assert set(acknowledged) <= set(numbers)
            assert store.activity() == Activity("slewing", 1.0, to_counts=(5.0, 6.0))
    print(f"records acknowledged over 6 kills: {len(acknowledged)}, none lost")


def test_a_damaged_or_foreign_file_is_a_sentence_with_the_remedy(tmp_path):
    path = tmp_path / FILE_NAME
    foreign = sqlite3.connect(path)
    foreign.execute("CREATE TABLE bookmarks (url TEXT)")
    foreign.close()
    with pytest.raises(StateError, match=r"another program.*Move it away"):
        StateStore(tmp_path, "x")
    path.write_bytes(b"not a database at all, but long enough" * 100)
    with pytest.raises(StateError, match=r"not a database.*Move it away"):
        StateStore(tmp_path, "x")


def test_a_store_damaged_anywhere_never_ends_in_another_error(tmp_path):
    with StateStore(tmp_path / "good", "x") as store:
        for n in range(200):
            store.record_event(Event(float(n), "k", "t" * 50))
            store.learn(str(n), {"a": n}, 1.0)
    good = (tmp_path / "good" / FILE_NAME).read_bytes()
    refused = 0
    for n in range(40):
        folder = tmp_path / str(n)
        folder.mkdir()
        at = len(good) * n // 40
        (folder / FILE_NAME).write_bytes(good[:at] + b"\xa5" * 300 + good[at + 300 :])
        try:
            with StateStore(folder, "x") as store:
                store.events()
                store.learnt("1")
                store.record_position(Position(1.0, (1.0, 2.0)))
        except StateError as error:
            assert "Move it away" in str(error) or "cannot be used" in str(error)  # noqa: PT017
            refused += 1
    print(f"{refused} of 40 damaged files refused, the others unharmed where they were read")
    assert refused > 10


def test_a_newer_file_and_a_file_in_the_way_are_refused(tmp_path):
    with StateStore(tmp_path, "x") as store:
        path = store.path
    newer = sqlite3.connect(path)
    newer.execute("PRAGMA user_version = 99")
    newer.close()
    with pytest.raises(StateError, match=r"version 99.*update Clockdrive"):
        StateStore(tmp_path, "x")
    with pytest.raises(StateError, match=r"set \[state\] path"):
        StateStore(path, "x")


def test_a_number_that_is_none_is_refused_and_nothing_is_lost(store):
    store.record_position(Position(1.0, (1.0, 2.0)))
    with pytest.raises(StateError, match="finite"):
        store.record_position(Position(2.0, (math.nan, 2.0)))
    assert store.last_position().time == 1.0


def test_a_closed_store_says_so(store):
    store.close()
    store.close()
    with pytest.raises(StateError, match="closed"):
        store.last_position()


def test_threads_and_a_second_process_share_it(store):
    def work(name):
        for n in range(40):
            store.record_event(Event(float(n), name, ""))

    threads = [threading.Thread(target=work, args=(str(n),)) for n in range(4)]
    with StateStore(store.path.parent, "other") as other:
        for thread in threads:
            thread.start()
        for n in range(20):
            other.record_position(Position(float(n), (0.0, 0.0)))
        for thread in threads:
            thread.join()
    assert len(store.events(limit=1000)) == 160
