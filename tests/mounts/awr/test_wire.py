"""The wire of the AWR Microstep: every form, any interleaving, any split, any bytes."""

import random
from itertools import pairwise, product

import pytest

from mounts.awr import commands, registers
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


def stream(rng, *, hashed):
    """Any interleaving of packets and debug text; returns the bytes and the messages."""
    data, said = b"", []
    for _ in range(rng.randrange(1, 12)):
        message = rng.choice((*RESPONSES, *EVENTS))
        said.append(message)
        blanks = rng.choice(("", "", " "))
        data += f":{blanks}{message.text}{blanks}\r\n{'#' if hashed else ''}".encode()
        if rng.random() < 0.4:
            data += bytes(rng.choice(b"dbg=09 \t.xyzY") for _ in range(rng.randrange(1, 30))) + b"\r\n"
    return data, said


def test_any_interleaving_and_split_decodes_to_the_same_messages():
    rng = random.Random(9)  # noqa: S311
    for _ in range(1500):
        data, said = stream(rng, hashed=rng.random() < 0.7)
        cuts = sorted(rng.sample(range(len(data) + 1), rng.randrange(min(12, len(data)))))
        packets, heard = Packets(), []
        for a, b in pairwise([0, *cuts, len(data)]):
            heard += [decoded(packet.text) for packet in packets.feed(data[a:b], 0.0)]
        assert heard == said


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
        (lambda: registers.by_name("2C"), "there are directions.*00 to 1A"),
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
