"""Element sets are read in every usual dress, and no damaged line becomes an orbit."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from satellites import EPOCH_UTC, ORBITS, catalogue, lines, signed
from sgp4.api import Satrec

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.tle import Tle, choose, read_tle

ONE, TWO = ORBITS["400 km"]
ZARYA = f"ISS (ZARYA)\n{ONE}\n{TWO}\n"


@pytest.fixture
def written(tmp_path):
    def write(content):
        path = tmp_path / "some.tle"
        path.write_bytes(content if isinstance(content, bytes) else content.encode("utf-8"))
        return path

    return write


@pytest.mark.parametrize(
    "text",
    [
        ZARYA,
        f"0 {ZARYA}",
        ZARYA.replace("\n", "\r\n"),
        f"\ufeff# from somewhere\n\n  \n{ZARYA}\n\n",
        ZARYA.replace(ONE, f"{ONE}   \n# between"),
        ZARYA.rstrip("\n"),
        ZARYA + ZARYA,
    ],
)
def test_every_usual_dress_is_the_same_set(written, text):
    assert read_tle(written(text)) == (Tle(ONE, TWO, "ISS (ZARYA)"),)


def test_without_a_name_the_number_is_the_name(written):
    (found,) = read_tle(written(f"{ONE}\n{TWO}\n"))
    assert (found.name, found.number) == ("25544", "25544")


def test_the_epoch_is_sgp4s_own_in_either_century():
    for day in ("26328.50000000", "57001.25000000", "00366.99999999", "99365.12345678"):
        tle = Tle(*lines(7, 51.6, 10, 0.001, 20, 30, 15.5, epoch=day))
        record = Satrec.twoline2rv(tle.line1, tle.line2)
        mjd, seconds = tle.epoch.utc()
        assert mjd + seconds / 86400.0 == pytest.approx(record.jdsatepoch - 2400000.5 + record.jdsatepochF, abs=1e-11)
    assert Tle(ONE, TWO).epoch == Instant.from_utc_iso(EPOCH_UTC)


def test_numbers_beyond_99999_are_read():
    one, two = (signed(line[:2] + "B1234" + line[7:68]) for line in (ONE, TWO))
    assert Tle(one, two).number == "B1234"


def changed(line, column, text, *, sign=True):
    line = line[: column - 1] + text + line[column - 1 + len(text) :]
    return signed(line[:68]) if sign else line


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (ZARYA.replace(TWO, changed(TWO, 13, "2", sign=False)), "line 3, column 69: checksum"),
        (ZARYA.replace(TWO, changed(TWO, 10, "5O.6")), "line 3, columns 9 to 16: ' 5O.6000' is not the inclination"),
        (ZARYA.replace(TWO, changed(TWO, 9, "191.6")), "line 3, columns 9 to 16: the inclination is 191.6, possible"),
        (ZARYA.replace(TWO, changed(TWO, 27, "00 0700")), "line 3, columns 27 to 33"),
        (ZARYA.replace(TWO, changed(TWO, 53, " 0.00000000")), "line 3, columns 53 to 63: the mean motion is 0"),
        (ZARYA.replace(TWO, changed(TWO, 3, "25545")), "line 3, columns 3 to 7: satellite 25545 after one of 25544"),
        (ZARYA.replace(ONE, changed(ONE, 21, "388")), "line 2, columns 21 to 32: the day of the epoch is 388.5"),
        (ZARYA.replace(ONE, changed(ONE, 54, " 3879x-4")), "line 2, columns 54 to 61: ' 3879x-4' is not B*"),
        (ZARYA.replace(ONE, changed(ONE, 18, "2")), "line 2, column 18: '2' is not the gap"),
        (ZARYA.replace(ONE, ONE[:50]), "line 2 ends in column 50; elements have 69 columns"),
        (ZARYA.replace(TWO, TWO + "7"), "line 3 goes on behind column 69: '7'"),
        (ZARYA.replace(TWO, ""), "line 2: the file ends here, and line 2 of satellite 25544 was due"),
        (ZARYA.replace(ONE, ""), "line 1 of 'ISS (ZARYA)' was due"),
        (ZARYA + "TIANGONG\n", "line 4: the file ends here, and line 1 of 'TIANGONG' was due"),
        (f"{ONE}\n{ONE}\n", "line 2 of satellite 25544 was due"),
        (f"NAME\n{ZARYA}", "line 2, 'ISS (ZARYA)': line 1 of 'NAME' was due"),
        ("[site]\nlatitude_deg = 5\n", "line 2, 'latitude_deg = 5': line 1 of '[site]' was due; give a file with"),
        ("x" * 500, "is neither a name nor elements"),
        ("", "holds no element set: give a file"),
        ("\n# nothing\n", "holds no element set"),
        (bytes(range(256)), "is no text"),
        (b"SIMPLE  =\0\0\0", "neither a name nor elements"),
    ],
)
def test_what_is_damaged_is_told_with_its_place(written, text, told):
    path = written(text)
    with pytest.raises(TargetError) as caught:
        read_tle(path)
    assert told in str(caught.value)
    assert str(path) in str(caught.value)


def test_what_is_no_file_is_a_sentence(tmp_path):
    for path, said in ((tmp_path, "it is a folder"), (tmp_path / "none.tle", "there is no such file")):
        with pytest.raises(TargetError, match=said):
            read_tle(path)


def test_one_wrong_digit_anywhere_is_found():
    rng = random.Random(4)  # noqa: S311 - nothing secret
    for line in (ONE, TWO):
        for column in range(1, 69):
            if line[column - 1].isdigit():
                other = str((int(line[column - 1]) + rng.randrange(1, 10)) % 10)
                damaged = changed(line, column, other, sign=False)
                with pytest.raises(TargetError):
                    Tle(*(damaged if each == line else each for each in (ONE, TWO)))


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.binary(max_size=300) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "replace")))
def test_any_bytes_are_sets_or_a_target_error(tmp_path_factory, content):
    path = tmp_path_factory.getbasetemp() / "any.tle"
    path.write_bytes(content)
    with pytest.raises(TargetError):
        read_tle(path)


class TestChoosing:
    """One satellite of many."""

    @pytest.fixture
    def sets(self, written):
        return read_tle(written(catalogue(30) + ZARYA))

    @pytest.mark.parametrize("wanted", ["ISS (ZARYA)", "iss (zarya)", "25544", " 25544 ", "0025544"])
    def test_by_name_in_any_capitals_or_by_number(self, sets, wanted):
        assert choose(sets, wanted, "it").number == "25544"

    def test_the_only_one_needs_no_name(self, sets):
        assert choose(sets[-1:], "", "it").number == "25544"

    @pytest.mark.parametrize(
        ("wanted", "told"),
        [
            ("", "it has 31 satellites: add #NAME or #NUMBER, such as TEST 0 (10000, of 2026-11-24T12:00:00Z)"),
            ("zarya", "no satellite 'zarya': did you mean ISS (ZARYA) (25544"),
            ("TSET 17", "did you mean TEST 17"),
            ("99", "no satellite '99': it has TEST 0"),
        ],
    )
    def test_none_is_told_with_those_that_are_near(self, sets, wanted, told):
        with pytest.raises(TargetError) as caught:
            choose(sets, wanted, "it")
        assert told in str(caught.value)

    def test_several_are_listed_and_none_is_guessed(self, sets):
        older = Tle(*lines(25544, 51.6, 10, 0.001, 20, 30, 15.5, epoch="26300.00000000"), "ISS (ZARYA)")
        with pytest.raises(TargetError, match=r"2 sets for 'iss \(zarya\)': .*2026-11-24.*2026-10-27"):
            choose((*sets, older), "iss (zarya)", "it")
