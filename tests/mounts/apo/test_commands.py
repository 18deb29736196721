import itertools
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mounts.apo.commands import MAX_LINE, MEANINGS, TABLE, Command, command, decode, encode, normal
from mounts.apo.errors import ApoError, ImpossibleCommand

SAMPLES = {
    "position": (12.5, "12.500000000000"),
    "velocity": (-0.0041780746, "-0.004178074600"),
    "time": (6935.4, "6935.400000000000"),
    "size": (0.5, "0.500000000000"),
    "count": (3, "3"),
    "percent": (55, "55"),
    "state": ("on", "on"),
    "command": ("MOVE", "MOVE"),
    "text": ("slewing to M 1, off we go", "slewing to M 1, off we go"),
}
MANUAL = set(
    "+ - DEBUG DRIFT HELP ID INIT LOG MAXV MOVE +MOVE MS.DUMP MS.OFF MS.ON CORRECT OUTPUT.LIMIT P RESET "  # noqa: SIM905
    "SET.LIMITS SET.POSITION SET.TIME STATUS STEP STOP ZERO".split()
)
FORMS = [(row, form) for row in TABLE for form in row.forms]


def test_the_table_has_every_command_of_the_manual():
    assert {row.name for row in TABLE} == MANUAL


def test_every_meaning_has_a_sample():
    assert set(SAMPLES) == set(MEANINGS)


@pytest.mark.parametrize(("row", "form"), FORMS, ids=lambda value: str(getattr(value, "name", value)))
def test_every_form_of_every_command_is_sent_as_the_manual_has_it(row, form):
    values = [SAMPLES[meaning] for meaning in form]
    expected = " ".join((row.name, *(text for _, text in values)))
    for word in (row.name, row.name.lower(), *row.aliases):
        sent = encode(command(word, *(value for value, _ in values)))
        assert sent == expected.encode("ascii") + b"\r"


@pytest.mark.parametrize(("row", "form"), FORMS, ids=lambda value: str(getattr(value, "name", value)))
def test_every_line_is_read_back_by_name_and_alias_with_any_blanks(row, form):
    texts = [SAMPLES[meaning][1] for meaning in form]
    wanted = command(row.name, *(SAMPLES[meaning][0] for meaning in form))
    for word, blank in itertools.product((row.name, row.name.lower(), *row.aliases), (" ", "   ")):
        assert decode(blank + blank.join((word, *texts)) + blank) == wanted


@pytest.mark.parametrize(("row", "form"), FORMS, ids=lambda value: str(getattr(value, "name", value)))
def test_every_command_finds_its_axis_on_a_shared_line(row, form):
    what = command(row.name, *(SAMPLES[meaning][0] for meaning in form))
    assert encode(what, "ALT") == b"ALT " + encode(what)


def test_aliases_are_those_of_the_manual():
    aliases = {alias: row.name for row in TABLE for alias in row.aliases}
    assert aliases == {"H": "HELP", "?": "HELP", "I": "INIT", "M": "MOVE", "X": "STOP"}


def test_what_flushes_the_buffer_is_what_the_manual_says():
    all_forms = {(row.name, len(form)): command(row.name, *(SAMPLES[m][0] for m in form)) for row, form in FORMS}
    flushing = {key for key, what in all_forms.items() if what.flushes}
    assert flushing == {
        ("MOVE", 0), ("MOVE", 1), ("MOVE", 2), ("DRIFT", 0), ("INIT", 0), ("STOP", 0), ("RESET", 0), ("P", 0)
    }  # fmt: skip
    ending = {key for key, what in all_forms.items() if what.ends_corrections}
    assert (
        {("MOVE", 0), ("DRIFT", 0), ("INIT", 0)} <= ending <= {("MOVE", 0), ("DRIFT", 0), ("INIT", 0), ("RESET", 0)}
    )


@pytest.mark.parametrize(
    ("what", "repeatable"),
    [
        (command("STATUS"), True),
        (command("DRIFT"), True),
        (command("INIT"), True),
        (command("MOVE"), True),
        (command("MOVE", 10.0), True),
        (command("MOVE", 10.0, 0.1), False),
        (command("MOVE", 10.0, 0.1, 100.0), False),
        (command("+MOVE"), True),
        (command("+MOVE", 0.1), False),
        (command("+"), False),
        (command("CORRECT"), False),
        (command("RESET"), False),
    ],
    ids=lambda value: getattr(value, "text", ""),
)
def test_only_what_twice_means_the_same_is_sent_again(what, repeatable):
    assert what.repeatable is repeatable


def test_risky_are_the_commands_that_a_person_confirms():
    risky = {row.name for row in TABLE if row.risky}
    assert {"RESET", "CORRECT", "SET.POSITION", "ZERO", "SET.LIMITS", "OUTPUT.LIMIT", "P"} <= risky
    assert not risky & {"STATUS", "DRIFT", "INIT", "MOVE", "STOP", "ID", "HELP", "MS.DUMP"}


def test_only_set_time_is_the_sdss_alone():
    assert [row.name for row in TABLE if row.sdss_only] == ["SET.TIME"]


@given(st.floats(-1e4, 1e4), st.floats(-10, 10), st.floats(0, 86400))
def test_numbers_keep_twelve_decimals_and_a_point(position, velocity, time):
    line = encode(command("MOVE", position, velocity, time)).decode()
    assert len(line) <= MAX_LINE
    assert line.endswith("\r")
    words = line.split()[1:]
    for value, word in zip((position, velocity, time), words, strict=True):
        assert re.fullmatch(r"-?\d+\.\d{12}", word)
        assert abs(float(word) - value) <= 0.5e-12 + abs(value) * 2**-52


def test_what_rounds_to_nothing_has_no_sign():
    assert encode(command("MOVE", -0.0, -1e-13)) == b"MOVE 0.000000000000 0.000000000000\r"


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("GOTO", ()),
        ("", ()),
        ("MOVE", (1.0, 2.0, 3.0, 4.0)),
        ("MOVE", (float("nan"),)),
        ("MOVE", (1.0, float("inf"))),
        ("MOVE", ("north",)),
        ("STATUS", (1.0,)),
        ("SET.POSITION", ()),
        ("SET.LIMITS", (1.0,)),
        ("+", (1.5,)),
        ("+", (-1,)),
        ("OUTPUT.LIMIT", (101,)),
        ("DEBUG", ("maybe",)),
        ("HELP", ("GOTO",)),
        ("LOG", ("two\rlines",)),
        ("LOG", ("all is OK",)),
        ("LOG", ("ERR: none",)),
        ("LOG", ("café",)),
        ("LOG", ("",)),
        ("LOG", ("x" * 252,)),
        ("MOVE", (1e300,)),
    ],
)
def test_what_the_manual_does_not_have_is_refused(name, arguments):
    with pytest.raises(ImpossibleCommand) as refusal:
        command(name, *arguments)
    assert len(str(refusal.value)) < 500


def test_a_line_of_256_characters_is_the_longest():
    text = "x" * (MAX_LINE - 1 - len("LOG "))
    assert len(encode(command("LOG", text))) == MAX_LINE
    with pytest.raises(ImpossibleCommand, match="at most 256"):
        encode(command("LOG", text), "AZ")


@given(st.text(max_size=300))
def test_any_line_is_a_command_or_an_error_of_ours(line):
    try:
        what = decode(line)
    except ApoError:
        return
    assert isinstance(what, Command)
    assert normal(decode(what.text).text) == normal(what.text)
