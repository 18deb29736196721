"""Frames, against pymodbus's framer as the oracle of good ones, and against all bytes there are."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.framer import FramerAscii
from pymodbus.pdu import DecodePDU

from transports.ascii_frame import MAX_FRAME, MAX_PDU, Frame, FrameDecoder, encode_frame

GOOD = Frame(0xFF, bytes.fromhex("03 04 0080 0000"))
GOOD_BYTES = b":FF0304008000007A\r\n"

pdus = st.binary(min_size=1, max_size=MAX_PDU)
units = st.integers(0, 255)
stream_parts = st.one_of(
    st.binary(max_size=40),
    st.text("0123456789abcdefABCDEF:\r\n", max_size=60).map(str.encode),
    st.builds(encode_frame, units, pdus),
)
streams = st.lists(stream_parts, max_size=8).map(b"".join)


@given(units, pdus)
def test_encodes_as_an_independent_framer(unit, pdu):
    assert encode_frame(unit, pdu) == FramerAscii(DecodePDU(is_server=False)).encode(pdu, unit, 0)


@given(units, pdus)
def test_decodes_what_it_encodes(unit, pdu):
    assert FrameDecoder().feed(encode_frame(unit, pdu)) == [Frame(unit, pdu)]


@given(streams, st.data())
def test_finds_the_same_frames_however_the_stream_is_cut(stream, data):
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=10)))
    at_once, in_pieces, by_bytes = FrameDecoder(), FrameDecoder(), FrameDecoder()
    expected = at_once.feed(stream)
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert [frame for piece in pieces for frame in in_pieces.feed(piece)] == expected
    assert [frame for byte in stream for frame in by_bytes.feed(bytes((byte,)))] == expected
    assert at_once.begun == in_pieces.begun == by_bytes.begun


@given(streams, st.integers(0, 2**32))
def test_finds_every_good_frame_after_any_noise(noise, value):
    pdu = b"\x03\x04" + value.to_bytes(5, "big")
    decoder = FrameDecoder()
    decoder.feed(noise)
    assert decoder.feed(encode_frame(0xFF, pdu)) == [Frame(0xFF, pdu)]


@given(streams)
def test_holds_no_more_than_one_frame(stream):
    decoder = FrameDecoder()
    decoder.feed(stream)
    assert len(decoder.begun) <= MAX_FRAME


def test_the_longest_frame_is_513_characters():
    frame = encode_frame(0xFF, bytes(MAX_PDU))
    assert len(frame) == MAX_FRAME
    assert FrameDecoder().feed(frame) == [Frame(0xFF, bytes(MAX_PDU))]
    assert FrameDecoder().feed(encode_frame(0xFF, bytes(MAX_PDU + 1))) == []


def test_forgets_a_frame_that_never_ends():
    decoder = FrameDecoder()
    assert decoder.feed(b":" + b"0" * 100_000) == []
    assert decoder.begun == b""
    assert decoder.feed(GOOD_BYTES) == [GOOD]


@pytest.mark.parametrize(
    "stream",
    [
        GOOD_BYTES,
        GOOD_BYTES[:-1],  # CR alone
        GOOD_BYTES[:-2] + b"\n",  # LF alone
        GOOD_BYTES.lower(),
        b"\x00\xff?" + GOOD_BYTES,
        b":FF03" + GOOD_BYTES,  # a frame broken off
        b":FF0304zz\r\n" + GOOD_BYTES,
        b":FF0304008000007B\r\n" + GOOD_BYTES,  # a wrong LRC before
        b":\r\n:FF\r\n:FF01\r\n" + GOOD_BYTES,
        b":FF0\r\n" + GOOD_BYTES,
    ],
)
def test_finds_the_one_good_frame(stream):
    assert FrameDecoder().feed(stream) == [GOOD]


@given(st.integers(0, len(GOOD_BYTES) - 3), st.integers(1, 255))
def test_no_single_wrong_byte_passes_for_another_frame(place, change):
    garbled = bytearray(GOOD_BYTES)
    garbled[place] ^= change
    assert FrameDecoder().feed(bytes(garbled)) in ([], [GOOD])  # the latter when only its case changed
