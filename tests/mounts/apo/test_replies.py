import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mounts.apo.errors import ApoError, MalformedReply
from mounts.apo.replies import MAX_REPLY, Reply, ReplyDecoder

ENDS = ("\r", "\n", "\r\n", "\n\r", "\r\n\r\n")
BLANKS = ("", " ", "    ")
CONTENTS = [
    Reply("STOP"),
    Reply("STATUS", ("0.0000306 0.00000 1664.320 3147777 0.0000000",)),
    Reply("MS.DUMP", ("time position", "1.0 2.0", "3.0 4.0")),
    Reply("MOVE 1.0 2.0 3.0", (), "time has passed"),
    Reply("MOVE 1.0", ("looking",), "limits are 6.0 85.0"),
    Reply("LOG OKAY DONE", ("OKAY", "BOOK")),
]


def lines_of(reply: Reply) -> list[str]:
    return [reply.echo, *reply.lines, *([f"ERR: {reply.error}"] if reply.error else [])]


def all_ways(reply: Reply) -> list[bytes]:
    """Every placement of OK, blanks before it and line ends."""
    ways = []
    for end, blank, alone, before in itertools.product(ENDS, BLANKS, (True, False), ("", "\r\n")):
        *first, last = lines_of(reply)
        ends = (last, blank + "OK") if alone else (f"{last} {blank}OK",)
        text = end.join((*first, *ends))
        ways.append((before + text + end).encode("ascii"))
    return ways


@pytest.mark.parametrize("reply", CONTENTS, ids=lambda reply: reply.echo)
def test_a_reply_is_found_wherever_its_ok_stands_and_however_its_lines_end(reply):
    ways = all_ways(reply)
    for way in ways:
        assert ReplyDecoder().feed(way) == [reply]
    print(f"{len(ways)} ways")


@pytest.mark.parametrize("reply", CONTENTS, ids=lambda reply: reply.echo)
def test_a_reply_is_found_byte_by_byte_and_before_trailing_bytes(reply):
    for way in all_ways(reply):
        decoder = ReplyDecoder()
        found = [got for byte in way for got in decoder.feed(bytes((byte,)))]
        assert found == [reply]
        assert decoder.begun == ""
        trailed = ReplyDecoder()
        assert trailed.feed(way + b"STATUS\r\n0.0 O") == [reply]
        assert trailed.begun == "STATUS\n0.0 O"


def test_replies_on_each_others_heels_are_told_apart():
    stream = b"".join(all_ways(reply)[7] for reply in CONTENTS)
    assert ReplyDecoder().feed(stream) == CONTENTS


def test_nothing_is_a_reply_before_the_end_of_the_line_with_ok():
    decoder = ReplyDecoder()
    assert decoder.feed(b"STATUS\r\n1.0 2.0 OK") == []
    assert decoder.feed(b"AY\r\n") == []
    assert decoder.feed(b"OK\r") == [Reply("STATUS", ("1.0 2.0 OKAY",))]


def test_an_error_without_a_reason_is_an_error():
    (reply,) = ReplyDecoder().feed(b"MOVE 1.0\r\nERR: OK\r\n")
    assert not reply.ok
    assert reply.error == "no reason given"


def test_an_error_behind_the_echo_is_found():
    assert ReplyDecoder().feed(b"MOVE 1.0 ERR: too late OK\r") == [Reply("MOVE 1.0", (), "too late")]


def test_an_ok_without_an_echo_is_a_reply_to_nothing():
    assert ReplyDecoder().feed(b"OK\r\n") == [Reply("")]


@given(st.lists(st.one_of(st.binary(max_size=60), st.sampled_from([b"OK\r", b" OK\n", b"ERR:", b"STATUS\r\n"]))))
def test_any_bytes_give_replies_or_nothing_yet_whatever_the_cut(pieces):
    decoder, whole = ReplyDecoder(), ReplyDecoder()
    try:
        found = [reply for piece in pieces for reply in decoder.feed(piece)]
        assert found == whole.feed(b"".join(pieces))
    except ApoError:
        pass
    assert len(decoder.begun) <= MAX_REPLY + 1


def test_the_buffer_is_bounded_and_the_next_reply_is_whole():
    decoder = ReplyDecoder()
    for _ in range(MAX_REPLY // 3):
        decoder.feed(b"xy\r")
    with pytest.raises(MalformedReply, match="16384 bytes"):
        decoder.feed(b"xyz\r")
    assert decoder.begun == ""
    with pytest.raises(MalformedReply):
        decoder.feed(b"\x00" * (MAX_REPLY + 1))
    assert decoder.feed(b"\rSTOP OK\r") == [Reply("STOP")]
