"""One-line elements: the right columns, the right body, and a sentence for everything else."""

import math
import re
import warnings

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mpc_lines import CERES, COMETS, HALE_BOPP, MPCORB, asteroid

from pointing.errors import TargetError
from pointing.instant import Instant
from pointing.mpc import Line, elements, keys, read_elements

GAUSS_KM = (0.01720209895**2) * 149597870.7**3 / 86400.0**2


@pytest.fixture
def file(tmp_path):
    def write(text, name="bodies.txt"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


class Row(dict):
    __getattr__ = dict.__getitem__


def heliocentric_by_skyfield(kind, text, jd_tt):
    """Skyfield reads the columns as a table, makes the state and moves it on by its own integrator."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of pandas, about skyfield
        from skyfield.api import load
        from skyfield.data import mpc

        columns = {"mpcorb": mpc._MPCORB_COLUMNS, "comet": mpc._COMET_COLUMNS}[kind]
        row = Row({name: text[a:b].strip() for name, (a, b) in columns})
        row |= {name: float(value) for name, value in row.items() if re.fullmatch(r"-?\d+\.\d+", value)}
        ts = load.timescale(builtin=True)
        if kind == "mpcorb":
            orbit = mpc.mpcorb_orbit(row, ts, GAUSS_KM)
        else:
            row |= {name: int(row[name]) for name in ("perihelion_year", "perihelion_month")}
            orbit = mpc.comet_orbit(row, ts, GAUSS_KM)
        return orbit._at(ts.tt_jd(jd_tt))[0]


@pytest.mark.parametrize(
    ("kind", "text"),
    [("mpcorb", CERES), ("comet", HALE_BOPP), ("comet", COMETS.splitlines()[0]), ("comet", COMETS.splitlines()[2])],
)
def test_the_columns_are_those_that_skyfield_reads(kind, text):
    found = elements(Line("f", 1, text))
    worst = 0.0
    for mjd in (60900, 61100, 61500):
        theirs = heliocentric_by_skyfield(kind, text, mjd + 2400000.5)
        worst = max(worst, math.dist(found.orbit.state(Instant(mjd, 0.0))[0], theirs))
    print(f"{found.name}: {worst:.1e} au from skyfield")
    assert worst < 1e-9


def test_an_asteroids_elements_are_those_on_its_line():
    found = elements(Line("f", 1, CERES))
    assert found.name == "(1) Ceres"
    assert found.epoch == Instant(61000, 0.0)  # K25BL, 2025 November 21
    angles = [math.degrees(a) for a in (found.orbit.inclination, found.orbit.node, found.orbit.argument)]
    assert angles == pytest.approx([10.58780, 80.25221, 73.27343])
    assert (found.orbit.e, found.orbit.q) == pytest.approx((0.0794013, 2.7660512 * (1 - 0.0794013)))
    # The mean anomaly is 188.70269° at the epoch: by the mean motion that the line prints too.
    days = found.epoch.since(found.orbit.perihelion) / 86400.0
    assert days == pytest.approx((188.70269 - 360.0) / 0.21424651, rel=1e-6)


def test_a_comets_elements_are_those_on_its_line():
    found = elements(Line("f", 1, HALE_BOPP))
    assert found.name == "C/1995 O1 (Hale-Bopp)"
    assert found.orbit.perihelion.day == 50536  # 1997 March 29
    assert found.orbit.perihelion.seconds == pytest.approx(0.6169 * 86400.0)
    assert (found.orbit.q, found.orbit.e) == (0.905195, 0.995047)
    assert found.epoch == Instant(60569, 0.0)  # 2024 September 16


def test_a_hyperbolic_line_of_mpcorb_is_a_hyperbola():
    found = elements(Line("f", 1, asteroid("K17U01I", e=1.2011337, a=-1.2723450, anomaly=51.15760)))
    assert found.orbit.q == pytest.approx(0.25590, abs=1e-4)
    assert found.epoch.since(found.orbit.perihelion) > 0.0


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Ceres", "(1) Ceres"),
        ("ceres", "(1) Ceres"),
        ("1", "(1) Ceres"),
        ("(1)", "(1) Ceres"),
        ("1 Ceres", "(1) Ceres"),
        ("(1) ceres", "(1) Ceres"),
        ("00001", "(1) Ceres"),
        ("2015 XX33", "2015 XX33"),
        ("2015xx33", "2015 XX33"),
        ("K15X33X", "2015 XX33"),
        ("k15x33x", "2015 XX33"),
        ("100345", "(100345)"),
        ("A0345", "(100345)"),
        ("2040 P-L", "2040 P-L"),
    ],
)
def test_an_asteroid_is_found_by_everything_it_is_called(file, name, found):
    assert read_elements(file(MPCORB), name).name == found


@pytest.mark.parametrize(
    ("name", "found"),
    [
        ("Hale-Bopp", "C/1995 O1 (Hale-Bopp)"),
        ("hale bopp", "C/1995 O1 (Hale-Bopp)"),
        ("C/1995 O1", "C/1995 O1 (Hale-Bopp)"),
        ("1995 o1", "C/1995 O1 (Hale-Bopp)"),
        ("J95O010", "C/1995 O1 (Hale-Bopp)"),
        ("CJ95O010", "C/1995 O1 (Hale-Bopp)"),
        ("C/1995 O1 (Hale-Bopp)", "C/1995 O1 (Hale-Bopp)"),
        ("1P", "1P/Halley"),
        ("0001P", "1P/Halley"),
        ("Halley", "1P/Halley"),
        ("1P/Halley", "1P/Halley"),
        ("73P-B", "73P-B/Schwassmann-Wachmann"),
    ],
)
def test_a_comet_is_found_by_everything_it_is_called(file, name, found):
    assert read_elements(file(COMETS), name).name == found


def test_a_file_with_one_body_needs_no_name(file):
    assert read_elements(file(HALE_BOPP + "\n")).name == "C/1995 O1 (Hale-Bopp)"


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("Schwassmann-Wachmann", "2 bodies called 'Schwassmann-Wachmann': 73P-B/Schwassmann-Wachmann, 73P-C/"),
        ("", "holds 5 bodies: 1P/Halley, C/1995 O1 (Hale-Bopp), C/2001 X5 (Parabola), 73P-B/"),
        ("Haley", "no body called 'Haley': did you mean 1P/Halley"),
        ("1995 O2", "did you mean C/1995 O1 (Hale-Bopp)?"),
        ("Zzyzx", "it holds 1P/Halley"),
        ("-", "no body called '-': it holds 1P/Halley"),
    ],
)
def test_no_one_body_is_a_sentence_with_those_there_are(file, name, said):
    with pytest.raises(TargetError) as refused:
        read_elements(file(COMETS), name)
    assert said in str(refused.value)


def test_what_is_odd_elsewhere_in_a_catalogue_does_no_harm(file):
    assert read_elements(file(f"# mine\n\n{CERES[:60]}\n{COMETS}"), "Halley").name == "1P/Halley"


def columns(text, first, last, new):
    return text[: first - 1] + f"{new:<{last - first + 1}}"[: last - first + 1] + text[last:]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (columns(CERES, 21, 25, ""), "line 1, columns 21–25: no epoch"),
        (columns(CERES, 21, 25, "K25DL"), "columns 21–25: epoch 'K25DL' is no packed date"),
        (columns(CERES, 27, 35, "  188.x"), "columns 27–35: mean anomaly '188.x': possible are numbers from −360"),
        (columns(CERES, 60, 68, "190.0"), "columns 60–68: inclination '190.0': possible are numbers from 0 to 180°"),
        (columns(CERES, 71, 79, "-0.1"), "columns 71–79: eccentricity '-0.1'"),
        (columns(CERES, 71, 79, "1.0000000"), "columns 93–103: semimajor axis 2.76605 au with eccentricity 1"),
        (columns(CERES, 93, 103, "-2.7"), "columns 93–103: semimajor axis -2.7 au"),
        (columns(CERES, 93, 103, "nan"), "columns 93–103: semimajor axis 'nan'"),
        (columns(CERES, 38, 46, "1_0"), "columns 38–46: argument of perihelion '1_0'"),
        (
            columns(HALE_BOPP, 15, 18, "1066"),
            "columns 15–18: year of perihelion '1066': possible are numbers from 1583",
        ),
        (columns(HALE_BOPP, 20, 21, "13"), "columns 20–21: month of perihelion '13'"),
        (columns(HALE_BOPP, 20, 29, "02 30.5000"), "columns 23–29: the calendar has no 1997-02-30"),
        (columns(HALE_BOPP, 31, 39, "0.0"), "columns 31–39: perihelion distance '0.0'"),
        (columns(HALE_BOPP, 42, 49, ""), "columns 42–49: no eccentricity"),
        (columns(HALE_BOPP, 88, 89, "99"), "columns 88–89: day of epoch '99'"),
    ],
)
def test_a_field_that_is_missing_or_impossible_is_refused_with_its_place(file, text, said):
    path = file(text + "\n")
    with pytest.raises(TargetError) as refused:
        read_elements(path)
    assert str(refused.value).startswith("bodies.txt, line 1, columns ")
    assert said in str(refused.value)


def test_a_file_that_is_none_is_a_sentence(tmp_path, file):
    with pytest.raises(TargetError, match=r"cannot be read \(No such file or directory\)"):
        read_elements(tmp_path / "none.txt")
    with pytest.raises(TargetError, match="cannot be read"):
        read_elements(tmp_path)
    with pytest.raises(TargetError, match="cannot be read"):
        read_elements("a\0b")
    with pytest.raises(TargetError, match="holds no body"):
        read_elements(file(""))


LINES = st.one_of(
    st.text(max_size=220),
    st.builds(
        lambda line, at, junk: line[:at] + junk + line[at + len(junk) :],
        st.sampled_from([CERES, HALE_BOPP]),
        st.integers(0, 200),
        st.text(max_size=12),
    ),
    st.builds(lambda line, at: line[:at], st.sampled_from([CERES, HALE_BOPP]), st.integers(0, 200)),
)


@settings(derandomize=True, deadline=None, max_examples=400)
@given(LINES)
def test_any_line_is_a_body_or_a_refusal(text):
    line = Line("f", 1, text)
    assert all(isinstance(key, str) for key in keys(line))
    try:
        place, velocity = elements(line).orbit.state(Instant(61000, 0.0))
    except TargetError as refused:
        assert str(refused)  # noqa: PT017 - a refusal is as good as a place
    else:
        assert all(map(math.isfinite, (*place, *velocity)))


@settings(derandomize=True, deadline=None, max_examples=100)
@given(st.binary(max_size=600), st.text(max_size=10))
def test_any_file_is_a_body_or_a_refusal(tmp_path_factory, content, name):
    path = tmp_path_factory.getbasetemp() / "garbage"
    path.write_bytes(content)
    with pytest.raises(TargetError):
        read_elements(path, name)


@pytest.mark.parametrize(
    ("text", "column", "said"),
    [
        ("hello", 6, "the line ends before its semimajor axis, columns 93"),
        (CERES[:92], 93, "the line ends before its semimajor axis"),
        ("The quick brown fox jumps over the lazy dog", 8, "'c' stands"),
        (columns(CERES, 36, 36, "1"), 36, "'1' stands where"),
        (columns(HALE_BOPP, 50, 50, "1"), 50, "'1' stands where"),
        (columns(CERES, 170, 170, "\x1b"), 170, "the character U+001B"),
        ("\x1b[31mred", 1, "the character U+001B cannot stand there"),
    ],
)
def test_what_is_no_line_of_elements_is_no_body_and_is_refused_with_its_column(file, text, column, said):
    with pytest.raises(TargetError) as refused:
        read_elements(file(text + "\n"))
    head = f"bodies.txt, line 1, column {column}: no line of MPCORB or CometEls: "
    assert str(refused.value).startswith(head + said)
    assert str(refused.value).isprintable()


def test_what_is_odd_beside_a_body_does_it_no_harm_and_is_not_sent_to_a_terminal(file):
    path = file("\x1b]0;title\x07\n" + columns(CERES, 176, 176, "\x1b") + "\n" + HALE_BOPP + "\n")
    assert read_elements(path).name == "C/1995 O1 (Hale-Bopp)"
    with pytest.raises(TargetError) as refused:
        read_elements(path, "Pallas")
    assert str(refused.value).isprintable()
