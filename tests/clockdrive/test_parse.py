"""Whatever is typed is what was meant, or a sentence that says why it is nothing."""

import contextlib
import math
from datetime import UTC, datetime

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from mpc_lines import CERES, COMETS
from satellites import ORBITS

from clockdrive import parse
from clockdrive.cli.parser import shielded
from clockdrive.errors import InputError
from pointing.errors import TargetError
from pointing.satellite import Satellite
from pointing.targets import FixedAltAz, FixedHaDec, Star

CRAB = (5 * 3600 + 34 * 60 + 31.9) / 240.0, 22 + 52 / 3600.0


def degrees(star):
    assert isinstance(star, Star)
    return math.degrees(star.ra), math.degrees(star.dec)


@pytest.mark.parametrize(
    "words",
    [
        "05:34:31.9 +22:00:52",
        ["05:34:31.9", "+22:00:52"],
        ["05:34:31.9", "22:00:52"],
        "05:34:31.9,+22:00:52",
        "05:34:31.9+22:00:52",
        "5h34m31.9s +22d00m52s",
        "5h34m31.9s+22d00m52s",
        "5H34M31.9S +22°00′52″",
        "5h 34m 31.9s +22° 00' 52\"",
        ["05", "34", "31.9", "+22", "00", "52"],
        "05 34 31.9 22 00 52",
        "  05:34:31.9   22:00:52  ",
    ],
)
def test_every_way_to_write_a_place_is_the_same_place(words):
    assert degrees(parse.target(words)) == pytest.approx(CRAB, abs=1e-12)


@pytest.mark.parametrize(
    ("words", "place"),
    [
        ("83.633,22.0145", (83.633, 22.0145)),
        ("83.633, -22.0145", (83.633, -22.0145)),
        (["0,", "-0.5"], (0.0, -0.5)),
        ("83d37m58.8s +22d00m52s", (83 + 37 / 60 + 58.8 / 3600, CRAB[1])),
        (["05:34:31.9", "-22:00:52"], (CRAB[0], -CRAB[1])),
        (["05:34:31.9", "−22:00:52"], (CRAB[0], -CRAB[1])),
        ("00:00:00 -00:30:00", (0.0, -0.5)),
        ("00:00:00 −0:00:01", (0.0, -1 / 3600)),
        ("0h0m0s -0d30m", (0.0, -0.5)),
        ("12:30 -45:15", (187.5, -45.25)),
        ("12:30.5 -45:15.5", (187.625, -45 - 15.5 / 60)),
        ("12 30 00 -45 15", (187.5, -45.25)),
        ("23:59:59.999 +90:00:00", (360 - 0.001 / 240, 90.0)),
    ],
)
def test_signs_and_units_are_taken_as_written(words, place):
    assert degrees(parse.target(words)) == pytest.approx(place, abs=1e-12)


@given(
    ra=st.tuples(st.integers(0, 23), st.integers(0, 59), st.integers(0, 59999)),
    dec=st.tuples(st.sampled_from("+-"), st.integers(0, 89), st.integers(0, 59), st.integers(0, 59999)),
    form=st.sampled_from(["{:02d}:{:02d}:{:06.3f} {}{:02d}:{:02d}:{:06.3f}", "{}h{}m{:.3f}s {}{}d{}m{:.3f}s"]),
)
def test_any_place_comes_back_within_rounding(ra, dec, form):
    text = form.format(ra[0], ra[1], ra[2] / 1e3, dec[0], dec[1], dec[2], dec[3] / 1e3)
    expected = (ra[0] * 3600 + ra[1] * 60 + ra[2] / 1e3) / 240, dec[1] + dec[2] / 60 + dec[3] / 3.6e6
    found = degrees(parse.target(text.split()))
    assert found == pytest.approx((expected[0], -expected[1] if dec[0] == "-" else expected[1]), abs=1e-11)


def test_observed_places_are_fixed_targets():
    assert parse.target("altaz:180,45") == FixedAltAz(math.pi, math.pi / 4, "altaz:180,45")
    assert parse.target(["altaz:", "-90.5,", "0"]) == FixedAltAz(math.radians(-90.5), 0.0, "altaz: -90.5, 0")
    assert parse.target("HADEC:-30,-60.25") == FixedHaDec(math.radians(-30), math.radians(-60.25), "HADEC:-30,-60.25")


def test_names_are_looked_up_and_best_stays_symbolic():
    assert parse.target("Vega").name == "Vega"
    assert parse.target(["NGC", "7000"]).name == "NGC 7000"
    assert parse.target("m1").name == "M1"
    assert parse.target("MOON").name == "Moon"
    assert parse.target("Best") == parse.Best()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("", "no target: give a name"),
        ("05:34:31.9 -91:00:00", "declination -91°: allowed are −90 to 90°"),
        ("05:34:31.9 -90:00:01", "declination -90.00027"),
        ("83.6,-91", "declination -91°"),
        ("361,0", "right ascension 361°: allowed are 0 to 360°"),
        ("-1,0", "right ascension -1°"),
        ("24:30:00 +10:00:00", "right ascension 24.5h: allowed are 0 to 24h"),
        ("-05:34:31.9 +22:00:52", "right ascension -5.57"),
        ("05:60:00 +22:00:00", "60 minutes; they are below 60"),
        ("05:00:00 +22:00:75", "75 seconds; they are below 60"),
        ("05:34:31.9", "no right ascension with a declination"),
        ("05:34:31.9 +22", "declination '+22' is no hours or degrees with minutes"),
        ("5.5:34 +22:00", "right ascension '5.5:34'"),
        ("5h34m +22h00m", "in degrees, not in hours"),
        ("1 2 3", "no right ascension with a declination"),
        ("1 +2 -3", "no right ascension with a declination"),
        ("altaz:10", "write altaz:AZIMUTH,ALTITUDE in degrees"),
        ("altaz:10,95", "altitude 95°: allowed are −90 to 90°"),
        ("hadec:400,10", "hour angle 400°: allowed are −360 to 360°"),
        ("tle:none.txt#ISS", "TLE file none.txt: there is no such file"),
        ("tle:", "write tle:FILE#NAME"),
        ("tle:#ISS", "write tle:FILE#NAME"),
        ("tle:" + "x" * 5000, "cannot be read"),
        ("Ganymede", "Sun, Moon and planets by name"),
        ("mpc:none#Ceres", "'none' cannot be read (No such file or directory)"),
        ("mpc:#Ceres", "write mpc:FILE#NAME"),
        ("ephem:none.ecsv", "'none.ecsv' cannot be read (No such file or directory)"),
        ("ephem:", "write ephem:FILE"),
        ("Vegga", "Vega"),
        ("x" * 5000, ""),
    ],
)
def test_what_is_no_target_is_told_with_value_and_bound(words, said):
    with pytest.raises(TargetError) as caught:
        parse.target(words)
    assert said in str(caught.value)


def test_bodies_of_files_are_targets(tmp_path):
    path = tmp_path / "my comets.txt"
    path.write_text(COMETS, encoding="utf-8")
    assert parse.target(["mpc:" + str(tmp_path / "my"), "comets.txt#hale", "bopp"]).name == "C/1995 O1 (Hale-Bopp)"
    path.write_text(CERES, encoding="utf-8")
    assert parse.target(f"MPC: {path}").name == "(1) Ceres"


def test_a_relative_path_is_made_whole_for_whoever_reads_it_elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    here = tmp_path.absolute()
    assert parse.anchored("mpc:a.txt#1P", here) == f"mpc:{here / 'a.txt'}#1P"
    assert parse.anchored("ephem: t.ecsv", here) == f"ephem:{here / 't.ecsv'}"
    assert parse.anchored(f"tle:{here}#ISS", here) == f"tle:{here}#ISS"
    for other in ("M1", "altaz:1,2", "05:34:31.9 +22:00:52", "mpc:", "mpc:#1P", "x:y"):
        assert parse.anchored(other, here) == other


def test_rates_are_two_numbers_of_either_sign():
    assert parse.rate("0.5,-0.25") == (0.5, -0.25)
    assert parse.rate("−1, +2") == (-1.0, 2.0)


@pytest.mark.parametrize("text", ["", "1", "1,2,3", "a,b", "nan,1", "1;2"])
def test_no_rates_are_a_sentence(text):
    with pytest.raises(InputError, match="is not EAST,NORTH, two numbers in arcseconds a second"):
        parse.rate(text)


@settings(max_examples=500, deadline=None)
@given(
    st.text(max_size=40)
    | st.text("0123456789+-−:., hdms°'\"′″", max_size=30)
    | st.lists(st.text(max_size=8), max_size=6)
)
@example("²:3 4:5")
@example("٣:٣ ٤:٤")
@example("altaz:٣,٤")
@example("9" * 400 + ":00 1:00")
@example("9" * 400 + ",1")
@example("\0")
@example("\ud800")
@example("tle:\0")
@example("tle:\ud800#x")
def test_any_text_is_a_target_or_a_target_error(words):
    with contextlib.suppress(TargetError):
        assert parse.target(words).name


class TestSatellites:
    """`tle:FILE#NAME`."""

    @pytest.fixture
    def file(self, tmp_path):
        path = tmp_path / "some sats.tle"
        path.write_text("".join(f"{name}\n{one}\n{two}\n" for name, (one, two) in ORBITS.items()), encoding="utf-8")
        return path

    @pytest.mark.parametrize("words", ["#GPS", " # gps ", "#36585"])
    def test_one_of_a_file_by_name_or_number(self, file, words):
        found = parse.target(f"tle:{file}{words}")
        assert isinstance(found, Satellite)
        assert found.name == "GPS"

    def test_a_path_is_relative_to_where_it_is_typed(self, file, monkeypatch):
        monkeypatch.chdir(file.parent)
        assert parse.target(["TLE:some", "sats.tle#400", "km"]).name == "400 km"
        anchored = parse.anchored("tle:some sats.tle#GPS", file.parent)
        monkeypatch.chdir(file.parent.parent)
        assert parse.target(anchored).name == "GPS"
        with pytest.raises(TargetError, match="no such file"):
            parse.target("tle:some sats.tle#GPS")

    def test_only_files_are_anchored(self, file):
        for text in ("M1", "altaz:1,2", "05:34:31.9 +22:00:52", "tle:", f"tle:{file}#x"):
            assert parse.anchored(text, file.parent) == text

    def test_the_longest_file_that_there_is_is_meant_where_its_name_holds_a_hash(self, file):
        odd = file.with_name("a#b.tle")
        odd.write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
        assert parse.anchored("tle:a#b.tle#GPS", file.parent) == f"tle:{odd}#GPS"
        assert parse.target(f"tle:{odd}#GPS").name == "GPS"
        file.with_name("a").write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
        assert parse.target(f"tle:{odd}#GPS").name == "GPS"
        with pytest.raises(TargetError, match=r"/a: |a has no satellite 'c\.tle#GPS'"):
            parse.target(f"tle:{file.with_name('a')}#c.tle#GPS")

    def test_a_tilde_is_the_home_of_whoever_types_it(self, file, monkeypatch):
        monkeypatch.setenv("HOME", str(file.parent))
        monkeypatch.setenv("USERPROFILE", str(file.parent))
        assert parse.anchored(f"tle:~/{file.name}#GPS", file.parent.parent) == f"tle:{file}#GPS"
        assert parse.target(f"tle:~/{file.name}#GPS").name == "GPS"
        assert parse.anchored("ephem:~/t#1.ecsv", file) == f"ephem:{file.parent / 't#1.ecsv'}"

    def test_a_folder_is_told_to_be_one(self, file):
        with pytest.raises(TargetError, match="it is a folder; give a file in it"):
            parse.target(f"tle:{file.parent}")

    def test_a_file_with_several_needs_a_name_and_one_with_one_does_not(self, file):
        with pytest.raises(TargetError, match="has 5 satellites: add #NAME"):
            parse.target(f"tle:{file}")
        file.write_text("\n".join(ORBITS["GPS"]), encoding="utf-8")
        assert parse.target(f"tle:{file}").name == "36585"


def test_a_declination_below_zero_is_never_an_option():
    words = ["goto", "05:34:31.9", "-22:00:52", "--for", "30s", "-c", "x", "-1.5", "-.5", "-1,2", "-0d30m"]
    assert shielded(words) == [
        "goto", "05:34:31.9", "−22:00:52", "--for", "30s", "-c", "x", "-1.5", "-.5", "−1,2", "−0d30m",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "text", ["2026-11-22T03:04:05Z", "2026-11-22T03:04:05", "2026-11-22 03:04:05", "2026-11-22T04:04:05+01:00"]
)
def test_a_moment_is_utc_unless_it_says_otherwise(text):
    assert parse.utc(text, 0.0) == datetime(2026, 11, 22, 3, 4, 5, tzinfo=UTC).timestamp()


def test_now_is_now_and_fractions_count():
    assert parse.utc("now", 123.5) == 123.5
    assert parse.utc("2026-11-22T03:04:05.25Z", 0.0) % 1 == 0.25
    assert parse.utc("2026-11-22", 0.0) % 86400 == 0.0


@pytest.mark.parametrize(
    "text", ["", "tomorrow", "2026-13-01", "2026-02-30T00:00:00Z", "2026-11-22T25:00:00Z", "1.8e9"]
)
def test_no_moment_is_a_sentence(text):
    with pytest.raises(InputError, match="write 2026"):
        parse.utc(text, 0.0)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("90", 90), ("30s", 30), ("2m", 120), ("2min", 120), ("1h", 3600), ("1h30m", 5400), ("1.5h", 5400), (".5s", 0.5),
     ("1h 2m 3s", 3723), ("0", 0)],
)  # fmt: skip
def test_a_duration_is_in_seconds_unless_it_says_otherwise(text, seconds):
    assert parse.duration(text) == pytest.approx(seconds)


@pytest.mark.parametrize("text", ["", "s", "-5s", "5x", "1e9", "99999h", "9" * 400, "5 5", "nan"])
def test_no_duration_is_a_sentence(text):
    with pytest.raises(InputError, match="is no duration"):
        parse.duration(text)


def test_counts_are_decimal_or_hexadecimal():
    assert parse.counts("8388608,0x800000") == (8388608, 8388608)
    assert parse.counts(" 0 , 0xFFFFFF ") == (0, 0xFFFFFF)
    assert parse.counts("-5,−0x10", -(2**31), 2**31 - 1) == (-5, -16)


@pytest.mark.parametrize("text", ["", "1", "1,2,3", "-1,2", "1,0x1000000", "1.5,2", "a,b", "9" * 5000 + ",1"])
def test_no_counts_are_a_sentence(text):
    with pytest.raises(InputError, match="is not C1,C2"):
        parse.counts(text)


@settings(max_examples=300, deadline=None)
@given(st.text(max_size=30) | st.text("0123456789.,:-+TZhms x", max_size=25))
def test_any_text_is_a_value_or_an_input_error(text):
    for reads in (
        lambda: parse.utc(text, 0.0),
        lambda: parse.duration(text),
        lambda: parse.counts(text),
        lambda: parse.rate(text),
    ):
        with contextlib.suppress(InputError):
            reads()


@pytest.mark.parametrize(
    "text",
    ["83.633 -22.0145", "83.633,-22.0145", "83.633 −22.0145", "05:34:31.92 -22:00:52.2", "5h34m31.92s -22d00m52.2s"],
)
def test_the_place_of_an_image_is_degrees_or_what_a_target_is(text):
    found = parse.place(text)
    assert (math.degrees(found.ra), math.degrees(found.dec)) == pytest.approx((83.633, -22.0145), abs=1e-6)


@pytest.mark.parametrize("text", ["best", "altaz:10,20", "hadec:1,2"])
def test_a_place_that_no_image_gives_is_refused(text):
    with pytest.raises(TargetError, match="no place of an image: give right ascension and declination"):
        parse.place(text)
