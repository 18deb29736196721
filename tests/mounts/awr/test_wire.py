"""The wire of the AWR Microstep: every form, any interleaving, any split, any bytes."""

import os
import random
from itertools import pairwise, product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mounts.awr import commands, registers, simulator_wire
from mounts.awr.errors import AwrError
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
    Strange,
    Word,
    Written,
    decoded,
)
from mounts.awr.packets import Packets

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
EXAMPLES = 5000 if FULL else 100
BITS = (False, True)
RESPONSES = (
    *(Done(ok) for ok in BITS),
    *(Word(address, value) for address in (0x00, 0x1A, 0x3F, 0xFF, 0xE1) for value in (0, 0xABCD, 0xFFFF)),
    *(Written(address, ok) for address in (0x00, 0xAA, 0xE1) for ok in BITS),
    *(Status(relays, override) for relays in range(8) for override in BITS),
)
EVENTS = (
    *(Error(code) for code in ERRORS),
    IndexPulse(),
    *(Override(stopped) for stopped in BITS),
    *(Moving(axes) for axes in product(BITS, BITS)),
    *(Backlash(axis, on) for axis in (0, 1) for on in BITS),
    *(Lines(levels) for levels in product(BITS, repeat=6)),
)


def test_every_form_is_itself_again_and_no_two_are_alike():
    texts = [message.text for message in (*RESPONSES, *EVENTS)]
    assert [decoded(text) for text in texts] == [*RESPONSES, *EVENTS]
    assert len(set(texts)) == len(texts)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1A?Y", Written(0x1A, ok=True)),
        ("1AY", Written(0x1A, ok=True)),
        ("1AN", Written(0x1A, ok=False)),
        ("N", Done(ok=False)),
        ("AA?DDDD", Word(0xAA, 0xDDDD)),
        ("X10", Moving((True, False))),
        ("L0035", Lines((True, False, True, True, True, False))),  # the manual: A, C, D, E high
        ("R51", Status(5, override=True)),
        ("e9", Error("9")),
    ],
)
def test_what_the_manual_writes_is_read_so(text, said):
    assert decoded(text) == said


@pytest.mark.parametrize("text", ["1a?00ff", "", "X2", "e0", "eD", "L0080", "V2", "1A?12", "GG?0000", "YN"])
def test_anything_else_is_strange(text):
    assert decoded(text) == Strange(text)


def test_lower_case_digits_are_named_as_that():
    assert "lower case" in decoded("1a?00ff").why
    assert "9600 baud" in decoded("zz").why


words = st.integers(0, 0xFFFF)
addresses = st.integers(0, 0xFF)
said_by_a_unit = st.one_of(  # what it says, as the simulator writes it by the manual, and what that is
    st.tuples(addresses, words).map(lambda two: (simulator_wire.told(*two), Word(*two))),
    st.tuples(addresses, st.booleans()).map(lambda two: (simulator_wire.written(two[0], ok=two[1]), Written(*two))),
    st.sampled_from([(message.text, message) for message in (*RESPONSES, *EVENTS)]),
)
harmless = st.text(st.characters(codec="latin-1", exclude_characters=":#"), max_size=30)
anything = st.binary(max_size=30).map(lambda data: data.decode("latin-1"))
cuts = st.lists(st.integers(0, 400), max_size=12)


def packet(text, *, stop, blank=""):
    return f":{blank}{text}{blank}\r\n{'#' if stop else ''}"


def heard(data, cuts):
    """What is heard of a stream that comes in pieces."""
    packets, found = Packets(), []
    for a, b in pairwise([0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]):
        found += [decoded(each.text) for each in packets.feed(data[a:b], 0.0)]
    return found


@settings(derandomize=not FULL, deadline=None, max_examples=EXAMPLES)
@given(st.lists(st.tuples(said_by_a_unit, st.sampled_from(("", " ")), harmless), max_size=12), st.booleans(), cuts)
def test_any_interleaving_of_answers_events_and_debug_text_decodes_however_it_is_split(says, stop, cuts):
    data = "".join(packet(text, stop=stop, blank=blank) + debug for (text, _), blank, debug in says)
    assert heard(data.encode("latin-1"), cuts) == [message for (_, message), _, _ in says]


def mutilated(data, place, how, byte):
    """A packet of which a byte is lost, doubled or another."""
    at = place % len(data)
    return data[:at] + {"lost": "", "doubled": 2 * data[at], "other": chr(byte)}[how] + data[at + 1 :]


damage = st.tuples(st.integers(0, 15), st.sampled_from(("lost", "doubled", "other")), st.integers(0, 255))


@settings(derandomize=not FULL, deadline=None, max_examples=EXAMPLES)
@given(
    st.lists(st.tuples(said_by_a_unit, st.lists(damage, max_size=3), anything), max_size=12),
    st.booleans(),
    cuts,
)
def test_every_packet_that_is_whole_is_heard_whatever_was_lost_doubled_or_said_around_it(says, stop, cuts):
    data, whole = "", []
    for (text, message), damages, debug in says:
        sent = packet(text, stop=stop)
        for each in damages:
            sent = mutilated(sent, *each) if sent else sent
        data += sent + debug
        whole += [] if damages else [message]
    found = iter(heard(data.encode("latin-1"), cuts))
    assert all(message in found for message in whole)  # each is found behind the one before


@settings(derandomize=not FULL, deadline=None, max_examples=EXAMPLES)
@given(st.lists(st.tuples(st.sampled_from(("1", "6", "A", "FF?", "814650", "R?")), st.booleans()), max_size=12), cuts)
def test_the_simulator_hears_every_packet_that_is_whole_behind_what_was_cut_short(says, cuts):
    data = b"".join(commands.packet(body)[: None if whole else -1] for body, whole in says)
    ear, bodies = simulator_wire.Ear(), []
    for a, b in pairwise([0, *sorted(min(cut, len(data)) for cut in cuts), len(data)]):
        bodies += ear.hear(data[a:b])
    assert bodies == [body for body, whole in says if whole]


def test_any_bytes_are_taken_and_the_next_packet_is_heard():
    rng = random.Random(10)  # noqa: S311
    for _ in range(1500):
        packets = Packets()
        noise = bytes(rng.choice(b":#\r\n YNX10\x00\xff") for _ in range(rng.randrange(400)))
        packets.feed(noise, 0.0)
        assert packets.feed(b":X10\r\n#", 1.0)[-1].text == "X10"
        assert len(packets._line) <= 200


def test_a_packet_has_the_time_of_its_first_byte_however_it_comes():
    byte = 1.0 / 960.0
    whole, split = Packets(byte), Packets(byte)
    data = b":X10\r\n#"
    (one,) = whole.feed(data, 100.0)
    (two,) = [p for i in range(len(data)) for p in split.feed(data[i : i + 1], 100.0 - (len(data) - 1 - i) * byte)]
    assert one.time == pytest.approx(100.0 - 6 * byte, abs=1e-6)
    assert two.time == pytest.approx(one.time, abs=1e-6)
    assert one.behind_s == 0.0


def test_a_packet_that_came_on_the_heels_of_another_says_how_long_it_may_have_waited():
    byte = 1.0 / 960.0
    packets = Packets(byte)
    _, two = packets.feed(b":Y\r\n#:X10\r\n#", 100.0)
    assert two.behind_s == pytest.approx(5 * byte)
    (alone,) = packets.feed(b":X00\r\n#", 101.0)
    assert alone.behind_s == 0.0


def test_bytes_that_waited_for_a_listener_may_have_come_on_the_heels_of_those_before():
    byte = 1.0 / 960.0
    for unheard_s, behind in ((0.0, 0.0), (3.0 * byte, 14.8 * byte)):  # three bytes of a key were being sent
        packets = Packets(byte)
        packets.feed(b":W1\r\n#dbg 21\r\n", 100.0)
        packets.feed(b":X0", 100.0 + 3.8 * byte, unheard_s)
        (one,) = packets.feed(b"1\r\n#", 100.0 + 7.8 * byte)
        assert one.behind_s == pytest.approx(behind, abs=1e-6)
        assert one.unheard_s == unheard_s


def test_debug_text_is_kept_apart():
    packets = Packets()
    packets.feed(b"boot 12\r\n:Y\r\n#tick\r\n", 0.0)
    assert list(packets.debug) == ["boot 12", "tick"]


def test_every_command_is_on_the_wire_as_the_manual_has_it():
    assert commands.packet(commands.READ_ALL) == b":??#"
    assert commands.packet(commands.PRESSES[0, 1]) == b":3#"
    assert commands.relay(2, on=True) == "F21"
    assert commands.read(0x1A) == "1A?"
    assert commands.soft_write(registers.by_name("drive_ra_counts"), 0xABCD) == "81ABCD"
    assert {row.text for row in commands.COMMANDS} >= set("123456789ADE") | {"??", "R?", "Fn1", "Fn0", "AADDDD"}


def test_the_table_of_registers_is_whole():
    addresses = [register.address for register in registers.REGISTERS]
    assert addresses == [*range(0x1B), 0x3F, 0xFF]
    assert registers.by_name("guide_left_counts").address == 0x09
    assert registers.by_name("centre_left_flags").address == 0x10
    assert registers.by_name("1A").name == "dec_backlash"
    for word in (0x0000, 0x0103, 0xFF02):
        assert registers.Flags.of(word).word == word


@pytest.mark.parametrize(
    ("ask", "said"),
    [
        (lambda: registers.checked(registers.by_name("crc"), 1), "never written.*00 to 17"),
        (lambda: registers.checked(registers.by_name("version"), 1), "never written"),
        (lambda: registers.checked(registers.by_name("drive_ra_counts"), 0), "give 16 to 65535"),
        (lambda: registers.checked(registers.by_name("max_accel_ra"), 70000), "give 1 to 65535"),
        (lambda: registers.by_name("1a"), "upper case here, 1A"),
        (lambda: registers.by_name("2C"), "no register 2C.*00 to 1A.*drive show"),
        (lambda: registers.by_name("0x05"), "two digits as the manual has them"),
        (lambda: registers.by_name("85"), "05 with bit 7.*give 05"),
        (lambda: registers.by_name("BF"), "never written: it is check word.*00 to 17"),
        (lambda: registers.by_name("speed"), "there are directions.*00 to 1A"),
        (lambda: registers.value_of("0x00ff"), "upper case here, 0x00FF"),
        (lambda: registers.value_of("many"), "whole number"),
        (lambda: commands.relay(4, on=True), "there are 1, 2, 3"),
        (lambda: commands.read(0x2C), "no register at 2C"),
        (lambda: registers.version_of(0x0A77), "no firmware version.*9600 baud"),
        (lambda: registers.supported(registers.Version(0, 5)), "0.05 is older than the packets.*ask AWR"),
    ],
)
def test_what_is_not_there_is_refused_with_what_is(ask, said):
    with pytest.raises(AwrError, match=said):
        ask()


def test_a_newer_firmware_is_taken_for_the_last_that_is_known():
    assert registers.supported(registers.Version(0, 72)) == ""
    assert "newer than 0.77" in registers.supported(registers.Version(1, 0))
