"""The tables of the driver and those of the simulator, each against the text of the manual."""

import re

import pytest

from mounts.awr import commands, registers, simulator_wire
from mounts.awr.messages import (
    ERRORS,
    Backlash,
    Done,
    Error,
    IndexPulse,
    Lines,
    Moving,
    Override,
    Status,
    Word,
    Written,
    decoded,
)


@pytest.fixture(scope="module")
def manual(shared):
    return (shared / "manuals" / "004_awr_microstep.txt").read_text(encoding="utf-8")


def section(manual, first, last):
    """What stands between two headings, the ones behind the table of contents."""
    return manual[manual.rindex(f"# {first}") : manual.rindex(f"# {last}")]


def rows(text):
    """Cells of the rows of a table whose first cell is bold."""
    return [
        [re.sub("</?b>", "", cell).strip() for cell in line.split("\t")]
        for line in text.splitlines()
        if re.match(r"<b>[^<]+</b>\t", line)
    ]


def test_every_command_of_the_manual_is_in_both_tables_and_no_other(manual):
    described = section(manual, "4.1 Button", "5. Access")
    named = {cells[0]: cells[1] for cells in rows(described) if len(cells) == 3}
    assert len(named) == 12
    assert named == simulator_wire.COMMANDS
    assert {each.text: each.event for each in commands.COMMANDS if each.event} == named
    assert {cells[0] for cells in rows(described) if len(cells) == 2} == {"Fn1", "Fn0"}
    assert set(simulator_wire.RELAYS) == {
        commands.relay(number, on=on) for number in commands.RELAYS for on in (False, True)
    }
    assert "THREE relays" in described


def test_keys_and_speeds_mean_what_the_manual_says_of_them(manual):
    details = {cells[0]: cells[2] for cells in rows(section(manual, "4.1 Button", "4.3 User"))}
    by_key = {"UP": (1, 1), "DOWN": (1, -1), "LEFT": (0, 1), "RIGHT": (0, -1)}
    for text, what in details.items():
        name = simulator_wire.COMMANDS[text]
        if what.startswith("Presses"):
            key = by_key[re.search("the (.*) key", what)[1]]
            assert simulator_wire.KEYS[name] == key
            assert commands.PRESSES[key] == text
        elif what.startswith("Releases"):
            axis = 0 if "RIGHT and LEFT" in what else 1
            assert simulator_wire.KEYS[name] == (axis, 0)
            assert commands.RELEASES[axis] == text
        else:
            speed = re.search("rate to (.*) \\(", what)[1].lower()
            assert simulator_wire.SPEEDS[name] == speed
            assert commands.SPEEDS[speed] == text


def test_every_word_of_the_manual_is_at_its_address_in_both_tables(manual):
    kinds = {"Frequency": "frequency", "Acceleration": "acceleration", "Reserved": "reserved"}
    seen = set()
    for place, name, note in rows(section(manual, "5.1 Addresses", "5.2 Read")):
        if place.startswith(("BIT", "00.")):
            continue
        if name:
            assert simulator_wire.WORDS[name] == int(place[:2], 16)
        for address, part in zip(place.split("-"), note.split(", "), strict=True):
            register = registers.BY_ADDRESS[int(address, 16)]
            seen.add(register.address)
            if note == "Counts, Flags":
                assert (register.name, register.kind) == (f"{name}_{part.lower()}", part.lower())
            elif note in kinds:
                assert (register.name, register.kind) == (name or "reserved", kinds[note])
            else:
                assert register.name in {name, name.lower(), "version"}
    assert seen | {0x00} == set(registers.BY_ADDRESS) == set(simulator_wire.TOLD)
    assert len(simulator_wire.WORDS) == len(seen) - 1 - len(set(range(0x02, 0x11, 2)))  # but 18 and the flags


def test_the_bits_of_words_are_the_manuals_in_both_tables(manual):
    described = section(manual, "5.1 Addresses", "5.2 Read")
    bits = {cells[1]: int(cells[0].removeprefix("BIT")) for cells in rows(described) if cells[1].startswith("USM_")}
    flags = registers.Flags(enable=False, positive=False, postscaler=0)
    assert simulator_wire.ENABLE == flags._replace(enable=True).word == 1 << bits["USM_ENABLE"]
    assert simulator_wire.POSITIVE == flags._replace(positive=True).word == 1 << bits["USM_POSDIR"]
    assert "BIT15 . . BIT8</b>\t\tcounts postscaler" in described
    assert 1 << simulator_wire.POSTSCALER_SHIFT == flags._replace(postscaler=1).word == 1 << 8
    senses = {cells[1]: 1 << int(cells[0][3:]) for cells in rows(described) if cells[0].startswith("00.")}
    assert senses == simulator_wire.SENSES
    assert list(registers.DIRECTION_BITS.values()) == list(senses.values())
    assert "BIT7 set" in section(manual, "5.5 Soft", "6. Messages")
    assert simulator_wire.SOFT == registers.RAM == 1 << 7


def test_every_error_of_the_manual_is_in_both_tables(manual):
    described = {cells[0]: cells[1] for cells in rows(section(manual, "6.1 Errors", "6.2 Index")) if len(cells) == 2}
    del described["Error Text"]
    assert {text: cause for cause, text in simulator_wire.ERRORS.items()} == described
    assert {f"e{code}" for code in ERRORS} == set(described)
    for text, cause in described.items():
        error = decoded(text)
        assert error == Error(text[1:])
        assert error.is_reset == ("reset" in cause)
        assert error.is_division == ("divide" in cause)
        assert error.meaning.split()[0].lower() == cause.split()[0].lower() or error.is_reset


def test_every_event_of_the_manual_is_said_by_the_simulator_and_heard_by_the_driver(manual):
    described = section(manual, "6.2 Index", "6.6 Poll")
    heard = {
        "P": (simulator_wire.INDEX_PULSE, IndexPulse(), "index pulse received"),
        "S1": (simulator_wire.FULL_STOP, Override(stopped=True), "Override stop received"),
        "S0": (simulator_wire.GO_FROM_ES, Override(stopped=False), "Override stop removed"),
        "V1": (simulator_wire.RA_REVERSED, Backlash(0, on=True), "RA motor reversed"),
        "V0": (simulator_wire.RA_NORMAL, Backlash(0, on=False), "RA normal"),
        "W1": (simulator_wire.DEC_TO_POLE, Backlash(1, on=True), "towards Pole"),
        "W0": (simulator_wire.DEC_FROM_POLE, Backlash(1, on=False), "away from Pole"),
        "Xab": (simulator_wire.moving(ra=True, dec=False), Moving((True, False)), "a = ra axis, b = dec axis"),
    }
    for text, _, details in rows(described):
        if text == "Event Text":
            continue
        said, message, meaning = heard.pop(text)
        assert meaning in details
        assert said == (text if "ab" not in text else "X10")
        assert decoded(said) == message
    assert not heard


def test_answers_have_the_forms_of_the_manual_and_lines_those_of_its_example(manual):
    for form, said, message in (
        ("**AA?DDDD**", simulator_wire.told(0xAA, 0xDDDD), Word(0xAA, 0xDDDD)),
        ("**AA?Y**", simulator_wire.written(0xAA, ok=True), Written(0xAA, ok=True)),
        ("**AAN**", simulator_wire.written(0xAA, ok=False), Written(0xAA, ok=False)),
        ("**Y** for success", simulator_wire.YES, Done(ok=True)),
        ("**N** for failure", simulator_wire.NO, Done(ok=False)),
        ("'L0035' has lines A,C,D,E at logic HIGH", simulator_wire.lines("ACDE"),
         Lines((True, False, True, True, True, False))),
        ("A is relay status B is Override status", simulator_wire.polled(5, stopped=True), Status(5, override=True)),
    ):  # fmt: skip
        assert form in manual
        assert form.strip("*").startswith((said, "'", "Y", "N", "A is"))
        assert decoded(said) == message
    for letter, bits in simulator_wire.LINES.items():
        assert re.search(rf"{bits:04X}(</b>)? - {letter}\b", manual)


def test_packets_stand_between_the_manuals_brackets(manual):
    assert "START (:) and STOP (#)" in manual
    assert "<CR> <LF> <#> appended" in manual
    assert simulator_wire.said("Y", with_stop=True) == ":Y\r\n#"
    for sent in (b":R?#", b": R?#", b":R?\r\n#"):
        assert simulator_wire.Ear().hear(sent) == ["R?"]
    assert commands.packet(commands.ASK_STATUS) == b":R?#"
