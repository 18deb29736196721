"""What goes over the line, against the manual's table (section 9) written out here by hand."""

import pytest

from mounts.avr_box import commands
from mounts.avr_box.answers import AnswerDecoder, Pair
from mounts.avr_box.commands import COMMANDS, AvrBoxError

ARGUMENTS = {"B": 2, "C": 1, "D": 0, "E": 0, "N": 0, "n": 0, "M": 5, "P": 0, "Q": 0, "S": 0, "s": 0, "W": 0, "Z": 2,
             "+": 1, "-": 1, "<": 1, ">": 1}  # fmt: skip


def test_every_command_of_the_manual_has_its_argument_bytes():
    assert {letter: command.arguments for letter, command in COMMANDS.items()} == ARGUMENTS
    assert [letter for letter, command in COMMANDS.items() if command.answered] == ["P", "Q"]


@pytest.mark.parametrize(
    ("made", "sent"),
    [
        (commands.move(0, 0x010203, decreasing=False), b"M\x03\x02\x01\x00\x00"),
        (commands.move(0, 5, decreasing=True), b"M\x05\x00\x00\x00\x80"),
        (commands.move(1, 5, decreasing=False), b"M\x05\x00\x00\x00\x02"),
        (commands.move(1, 5, decreasing=True), b"M\x05\x00\x00\x00\x82"),
        (commands.move(1, 5, decreasing=False, axis_bit=0), b"M\x05\x00\x00\x00\x00"),
        (commands.move(0, 5, decreasing=True, axis_bit=0), b"M\x05\x00\x00\x00\x82"),
        (commands.faster(9), b"+\x09"),
        (commands.slower(255), b"-\xff"),
        (commands.north(1), b">\x01"),
        (commands.south(2), b"<\x02"),
        (commands.set_bin(518), b"B\x06\x02"),
        (commands.set_zero(256), b"Z\x00\x01"),
        (commands.flags("ra_guiding", "pec", "dec_guiding"), b"C\x16"),
        (commands.flags(), b"C\x00"),
    ],
)
def test_a_command_is_these_bytes(made, sent):
    assert made == sent
    assert len(made) == 1 + ARGUMENTS[chr(made[0])]


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: commands.move(0, 2**32, decreasing=False),
        lambda: commands.move(0, -1, decreasing=False),
        lambda: commands.faster(256),
        lambda: commands.north(-1),
        lambda: commands.set_bin(519),
    ],
)
def test_what_does_not_go_into_a_command_is_refused_with_its_range(wrong):
    with pytest.raises(AvrBoxError, match="0 to"):
        wrong()


@pytest.mark.parametrize("step", [1, 2])
def test_no_byte_of_a_harmless_count_is_a_letter_and_none_above_it_is_harmless(step):
    letters = {ord(letter) for letter in ARGUMENTS}

    def harmless(count):
        return not letters & set(count.to_bytes(4, "little"))

    for count in (*range(3000), *range(0x4D00, 0x4F10), 0x2B1234, 0x53_FF_FF, 5_000_001):
        found = commands.harmless_below(count, step)
        assert harmless(found)
        assert found % step == 0
        assert found <= count
        if count < 0x10000:
            assert not any(harmless(each) for each in range(found + step, count + 1, step) if each % step == 0)


def test_an_answer_is_read_whole_byte_by_byte_and_with_rubbish_around_it():
    text = Pair(-42, 518).text
    assert text == b"-00042\t+00518\r"
    assert AnswerDecoder().feed(text) == [(-42, 518)]
    decoder = AnswerDecoder()
    assert [pair for byte in text for pair in decoder.feed(bytes((byte,)))] == [(-42, 518)]
    decoder = AnswerDecoder()
    assert decoder.feed(b"\x00\xff\r" + text + b"+0004") == [(-42, 518)]


@pytest.mark.parametrize(
    "wrong", [b"+00123\t+0045\r", b"+00123 +00456\r", b"0123\t+00456\r", b"+0x123\t+00456\r", b"\r"]
)
def test_what_is_no_answer_is_passed_over(wrong):
    decoder = AnswerDecoder()
    assert decoder.feed(wrong) == []
    assert decoder.feed(Pair(7, -8).text) == [(7, -8)]


def test_endless_noise_is_not_kept():
    decoder = AnswerDecoder()
    for _ in range(1000):
        assert decoder.feed(b"x" * 100) == []
    assert len(decoder._held) <= 256
