"""One process owns a telescope, says who it is, and lets go however it ends."""

import os
import stat
import subprocess
import sys
import time

import pytest

from clockdrive.errors import OwnedElsewhere, OwnerGone, StateError
from clockdrive.owner import Ownership, attach, owner
from clockdrive.process_lock import ProcessLock

TELESCOPE = "tc410 tcp://127.0.0.1:10001"
OWNER = """
import pathlib, sys, time
from clockdrive.owner import Ownership
own = Ownership(pathlib.Path(sys.argv[1]), sys.argv[2], name="Kaikoura", command="clockdrive run", time=1.8e9)
def handler(call, args, emit):
    emit({"started": call})
    time.sleep(60)
own.serve(handler)
print(own.previous_owner_died, flush=True)
sys.stdin.read()
own.release()
"""


def own(folder, telescope=TELESCOPE, **changes):
    return Ownership(folder, telescope, **{"name": "Kaikoura", "command": "clockdrive run", "time": 1.8e9, **changes})


@pytest.fixture
def elsewhere(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", OWNER, str(tmp_path), TELESCOPE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with process:
        assert process.stdout.readline() == "False\n"
        yield process
        process.kill()


def test_a_second_owner_is_told_who_owns_the_telescope_and_what_to_do(tmp_path, elsewhere):
    with pytest.raises(OwnedElsewhere) as caught:
        own(tmp_path)
    text = str(caught.value)
    for word in (
        "Kaikoura",
        TELESCOPE,
        str(elsewhere.pid),
        "clockdrive run",
        "2027-01-15T08:00:00Z",
        "clockdrive stop",
    ):
        assert word.removeprefix("clockdrive ") in text
    assert owner(tmp_path, TELESCOPE).pid == elsewhere.pid


def test_an_owner_that_ends_properly_leaves_nothing_to_take_over(tmp_path, elsewhere):
    elsewhere.stdin.close()
    assert elsewhere.wait(timeout=20) == 0
    assert owner(tmp_path, TELESCOPE) is None
    with own(tmp_path) as ownership:
        assert not ownership.previous_owner_died


def test_an_owner_killed_by_kill_minus_9_is_taken_over_and_reported(tmp_path, elsewhere):
    assert attach(tmp_path, TELESCOPE) is not None
    elsewhere.kill()
    elsewhere.wait(timeout=20)
    assert attach(tmp_path, TELESCOPE) is None
    with own(tmp_path) as ownership:
        assert ownership.previous_owner_died
        assert ownership.previous.pid == elsewhere.pid
        assert owner(tmp_path, TELESCOPE).pid == os.getpid()
    with own(tmp_path) as ownership:
        assert not ownership.previous_owner_died


def test_an_owner_that_dies_during_a_call_is_a_clear_error(tmp_path, elsewhere):
    client = attach(tmp_path, TELESCOPE)
    started = time.monotonic()
    with pytest.raises(OwnerGone, match=r"ended during `goto`.*clockdrive stop"):
        client.call("goto", {}, lambda _event: elsewhere.kill())
    with pytest.raises(OwnerGone, match="does not answer on 127"):
        client.call("status")
    assert time.monotonic() - started < 5.0


def test_a_number_of_a_process_used_again_is_no_owner(tmp_path):
    with own(tmp_path) as ownership:
        said = next(tmp_path.glob("owner-*.json")).read_bytes()
        pid = ownership.info.pid
    next(tmp_path.glob("owner-*.lock")).with_suffix(".json").write_bytes(said)
    assert pid == os.getpid()  # the process it names runs, and owns nothing
    assert attach(tmp_path, TELESCOPE) is None
    with own(tmp_path) as ownership:
        assert ownership.previous_owner_died


def test_only_this_user_can_read_the_key_and_each_owner_makes_its_own(tmp_path):
    keys = []
    for _ in range(2):
        with own(tmp_path) as ownership:
            ownership.serve(lambda *_: None)
            path = next(tmp_path.glob("owner-*.key"))
            assert os.name == "nt" or stat.S_IMODE(path.stat().st_mode) == 0o600
            keys.append(path.read_bytes())
        assert not path.exists()
    assert keys[0] != keys[1]
    assert len(keys[0]) == 32


def test_two_telescopes_of_one_state_directory_have_two_owners(tmp_path):
    with own(tmp_path, "tc410 COM3") as first, own(tmp_path, "tc410 COM4") as second:
        first.serve(lambda *_: "first")
        second.serve(lambda *_: "second")
        assert attach(tmp_path, "tc410 COM3").call("x") == "first"
        assert attach(tmp_path, "tc410 COM4").call("x") == "second"
    assert attach(tmp_path, "tc410 COM3") is None


def test_an_owner_that_has_not_opened_its_socket_yet_cannot_be_attached_to(tmp_path):
    assert attach(tmp_path / "none", TELESCOPE) is None
    with own(tmp_path):
        assert attach(tmp_path, TELESCOPE) is None
        with pytest.raises(OwnedElsewhere):
            own(tmp_path)


def test_a_spoilt_note_of_the_owner_counts_as_an_owner_that_died(tmp_path):
    with own(tmp_path):
        note = next(tmp_path.glob("owner-*.json"))
    for spoilt in (b"", b"{", b"[]", b'{"pid": "x"}', b"\xff"):
        note.write_bytes(spoilt)
        assert attach(tmp_path, TELESCOPE) is None
        with own(tmp_path) as ownership:
            assert ownership.previous_owner_died


def test_a_state_directory_that_cannot_be_made_is_a_sentence(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(StateError, match="cannot be made"):
        own(tmp_path / "file" / "state")


def test_the_lock_is_one_between_objects_and_free_after_release(tmp_path):
    first, second = ProcessLock(tmp_path / "lock"), ProcessLock(tmp_path / "lock")
    assert first.acquire()
    assert not second.acquire()
    first.release()
    first.release()
    assert second.acquire()
    second.release()
    with pytest.raises(StateError, match="cannot be opened"):
        ProcessLock(tmp_path / "none" / "lock").acquire()
