"""A typed line goes to who asked last, though somebody before has given up while the line was waited for."""

import os
import threading

import pytest
from waiting import seconds_until

from clockdrive.cli.standard_input import StandardInput, refuse_typed_elsewhere
from clockdrive.errors import InputError


@pytest.fixture
def typing(monkeypatch):
    """A function that types into the standard input."""
    source, keys = os.pipe()
    with os.fdopen(source, encoding="utf-8") as stdin, os.fdopen(keys, "w", encoding="utf-8") as keyboard:
        monkeypatch.setattr("sys.stdin", stdin)

        def types(text):
            keyboard.write(text)
            keyboard.flush()

        yield types


class Owner:
    attached = False

    def __init__(self):
        self.replies, self.replied = [], threading.Event()

    def call(self, name, text):
        self.replies.append((name, text))
        self.replied.set()


def test_what_a_witness_asks_is_replied_with_the_next_line(typing):
    owner, typed = Owner(), StandardInput()
    assert typed.asked(owner, {"ask": "RA and Dec"})
    typing("10 20\n")
    assert owner.replied.wait(10.0)
    assert owner.replies == [("reply", "10 20\n")]
    assert not typed.asked(owner, {"told": "star 1 of 3 seen"})


def test_a_line_typed_after_a_witness_has_given_up_is_the_answer_to_the_next_question(typing):
    gone, owner, typed = Owner(), Owner(), StandardInput()
    typed.asked(gone, {"ask": "RA and Dec"})
    typed.asked(owner, {"ask": "RA and Dec, again"})
    typing("10 20\n")
    assert owner.replied.wait(10.0)
    typed.asked(gone, {"ask": "RA and Dec"})
    lines = []
    reader = threading.Thread(target=lambda: lines.append(typed.line()))
    reader.start()
    seconds_until(lambda: typed._taker.__name__ == "put", what="waiting for the line")
    typing("s\n")
    reader.join(10.0)
    assert lines == ["s\n"]
    assert (gone.replies, owner.replies) == ([], [("reply", "10 20\n")])


def test_who_types_here_cannot_answer_what_another_process_asks():
    elsewhere = Owner()
    elsewhere.attached = True
    with pytest.raises(InputError, match="end the running owner first"):
        refuse_typed_elsewhere("typed", elsewhere)
    refuse_typed_elsewhere("command:solve.sh", elsewhere)
