"""Every event is a line of text, whatever is in it; the files stay small, and a full disk stops no telescope."""

import re

import pytest

from clockdrive import event_log
from clockdrive.event_log import EventLog
from clockdrive.state import Event, StateStore

NOON = 1_700_000_000.25


@pytest.fixture
def log(tmp_path):
    log = EventLog(tmp_path, "tc410 tcp://192.168.1.20:10001")
    yield log
    log.close()


def test_an_event_is_one_line_with_its_time_in_utc(log):
    log.add(NOON, "stopped", "limit reached:\naxis 1\r\nwest")
    assert log.text() == "2023-11-14T22:13:20.250Z stopped: limit reached: | axis 1 | west\n"


def test_every_event_of_the_store_is_in_the_log(tmp_path):
    with StateStore(tmp_path, "tc410 sim:") as store:
        for n in range(20):
            store.record_event(Event(NOON + n, "step", f"M{n} 15″"))
        lines = store.log.text().splitlines()
        events = [event.text for event in reversed(store.events())]
    assert [line.partition(" step: ")[2] for line in lines] == events


def test_telescopes_have_logs_of_their_own_and_names_that_every_system_takes(tmp_path):
    paths = {EventLog(tmp_path, name).path for name in ("tc410 sim:", "tc410 COM3", "tc410 /dev/ttyUSB0")}
    assert len(paths) == 3
    assert all(re.fullmatch(r"[A-Za-z0-9.-]+", path.name) for path in paths)


def test_the_files_are_bounded_and_keep_the_newest(log, monkeypatch):
    monkeypatch.setattr(event_log, "FILE_BYTES", 2_000)
    for n in range(1_000):
        log.add(NOON + n, "step", f"{n}")
    assert len(log.paths) == 1 + event_log.OLDER_FILES
    assert all(path.stat().st_size <= 2_000 for path in log.paths)
    kept = [int(line.rpartition(" ")[2]) for line in log.text().splitlines()]
    assert kept == list(range(kept[0], 1_000))
    print(f"{len(kept)} of 1000 lines kept in {len(log.paths)} files of 2 kB")


def test_a_log_goes_on_where_the_last_process_ended(log, tmp_path):
    log.add(NOON, "one", "1")
    log.close()
    log.close()
    log.add(NOON, "two", "2")
    other = EventLog(tmp_path, "tc410 tcp://192.168.1.20:10001")
    other.add(NOON, "three", "3")
    other.close()
    assert [line.split()[1] for line in log.text().splitlines()] == ["one:", "two:", "three:"]


def test_a_log_that_cannot_be_written_is_told_once_and_stops_nothing(log, caplog):
    log.path.mkdir()
    for n in range(5):
        log.add(NOON, "step", f"{n}")
    assert [record.message for record in caplog.records] == [f"the event log {log.path} cannot be written"]
    assert log.text() == ""


def test_asking_an_empty_log_makes_no_file(log, tmp_path):
    assert log.text() == ""
    assert list(tmp_path.iterdir()) == []
