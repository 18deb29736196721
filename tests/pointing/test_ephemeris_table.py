"""Ephemeris tables: what lies between the rows, the parallax, and rows that are refused."""

import math

import erfa
import numpy as np
import pytest
from astropy import units as u
from astropy.table import MaskedColumn, Table
from astropy.time import Time
from hypothesis import given, settings
from hypothesis import strategies as st
from rate_oracle import share_of_allowed

from pointing.ephemeris_table import EphemerisTable
from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.minor_body import MinorBody
from pointing.site import Site
from pointing.sky import Sky
from pointing.two_body import Orbit
from pointing.vectors import longitude_latitude

ARCSEC = math.pi / 648_000.0
AU_S, AU_KM = 499.004783836, 149597870.7
SKY = Sky(Site.from_degrees(-42.4, 173.7, 30.0))
BEGIN = Instant.from_utc_iso("2026-11-22T00:00:00Z")
FAR = MinorBody("far", Orbit(BEGIN.plus(-60.0 * DAY), 1.9, 0.2, 0.2, 1.0, 2.0))
NEAR = MinorBody("near", Orbit(BEGIN.plus(-5.0 * DAY), 0.98, 0.1, 0.05, 1.2, 6.1))
MIDDLE = BEGIN.plus(0.52 * DAY)


class Passing:
    """A body that passes the Earth at the Moon's distance on a straight line: light time by repetition."""

    def __init__(self, when, km=384_400.0, across_km_s=1.0):
        _, barycentric = erfa.epv00(2400000.5, when.day + when.seconds / DAY)
        aside = np.cross(barycentric["v"], [0.3, 0.2, 1.0])
        aside /= np.linalg.norm(aside)
        self.when, self.start = when, barycentric["p"] + aside * km / AU_KM
        onward = np.cross(aside, barycentric["v"]) / np.linalg.norm(barycentric["v"])
        self.velocity = barycentric["v"] / DAY + onward * across_km_s / AU_KM  # au/s

    def astrometric(self, instant, observer):
        delay = 0.0
        for _ in range(6):
            place = self.start + self.velocity * (instant.since(self.when) - delay) - observer
            delay = np.linalg.norm(place) * AU_S
        return place / np.linalg.norm(place), delay / AU_S


def geocentre(instant):
    return erfa.epv00(2400000.5, instant.day + instant.seconds / DAY)[1]["p"]


def from_the_site(body, hours=24, step_s=3600.0, begin=BEGIN):
    """Rows as an observer at the site sees them."""
    times = tuple(begin.plus(step_s * k) for k in range(int(hours * 3600.0 / step_s) + 1))
    return times, tuple(body.astrometric(SKY.at(time)) for time in times)


def written(tmp_path, columns, meta=None, name="table.ecsv"):
    path = tmp_path / name
    Table(columns, meta=meta or {}).write(path, format="ascii.ecsv", overwrite=True)
    return path


def rows(count=6, **changed):
    """Columns of a good table, one of them exchanged."""
    made = {
        "time": [f"2026-11-22T{hour:02d}:00:00" for hour in range(count)],
        "ra": np.linspace(10.0, 11.0, count) * u.deg,
        "dec": np.linspace(-20.0, -21.0, count) * u.deg,
    }
    return {name: column for name, column in (made | changed).items() if column is not None}


@pytest.mark.parametrize(("body", "hours", "step_s"), [(FAR, 24, 3600.0), (FAR, 48, 14400.0), (NEAR, 24, 3600.0)])
def test_between_the_rows_it_is_where_the_body_is(body, hours, step_s):
    """A cubic spline errs by 5/384 h⁴ of the fourth derivative, here of the daily parallax; four times at ends."""
    table = EphemerisTable("t", *from_the_site(body, hours, step_s))
    inside = worst = 0.0
    for k in range(1, 240):
        seconds = k * hours * 3600.0 / 240.0
        frame = SKY.at(BEGIN.plus(seconds))
        off = math.dist(table.astrometric(frame), body.astrometric(frame)) / ARCSEC
        worst = max(worst, off)
        if 3.0 * step_s < seconds < hours * 3600.0 - 3.0 * step_s:
            inside = max(inside, off)
    parallax = 8.794 / body.distance_au(SKY.at(BEGIN)) * math.cos(math.radians(42.4))
    allowed = 5.0 / 384.0 * (step_s * math.tau / 86164.1) ** 4 * parallax
    said = table.roughness_arcsec
    print(f"{body.name}, rows of {step_s:g} s: {inside:.1e}″, at the ends {worst:.1e}″, said {said:.1e}″")
    assert inside < 1.1 * allowed
    assert worst < 4.4 * allowed
    assert 0.5 * worst < said < 4.0 * worst


@pytest.mark.parametrize("hours", [0.3, 7.4, 12.6, 23.7])
def test_a_geocentric_place_gets_its_parallax_even_at_the_moons_distance(hours):
    body = Passing(MIDDLE)
    times = tuple(BEGIN.plus(600.0 * k) for k in range(145))
    places = [body.astrometric(time, geocentre(time)) for time in times]
    table = EphemerisTable(
        "t", times, tuple(tuple(n) for n, _ in places), tuple(far for _, far in places), observer="geocentric"
    )
    frame = SKY.at(BEGIN.plus(hours * 3600.0))
    truth, _ = body.astrometric(frame.instant, np.array(frame.position_au))
    parallax = math.dist(truth, body.astrometric(frame.instant, geocentre(frame.instant))[0]) / ARCSEC
    off = math.dist(table.astrometric(frame), truth) / ARCSEC
    print(f"{hours} h: parallax {parallax:.0f}″, place within {off:.1e}″")
    assert off < 1e-3


@pytest.mark.parametrize("hours", [0.32, 7.4, 12.6, 23.7])
def test_the_rate_is_the_derivative_of_the_whole_chain(hours):
    body = Passing(MIDDLE)
    times = tuple(BEGIN.plus(3600.0 * k) for k in range(25))
    places = [body.astrometric(time, geocentre(time)) for time in times]
    near = EphemerisTable(
        "t", times, tuple(tuple(n) for n, _ in places), tuple(far for _, far in places), observer="geocentric"
    )
    for table in (near, EphemerisTable("t", *from_the_site(NEAR)), EphemerisTable("t", *from_the_site(FAR))):
        share = share_of_allowed(table, SKY, BEGIN.plus(hours * 3600.0))
        print(f"{hours} h: {share:.2f} of what is allowed")
        assert share <= 1.0


def test_no_step_is_felt_at_a_row():
    table = EphemerisTable("t", *from_the_site(NEAR))
    row = table.times[9]
    before, after = (table.astrometric_with_rate(SKY.at(row.plus(step))) for step in (-1e-3, 1e-3))
    assert math.dist(before[1], after[1]) / ARCSEC < 1e-6


def test_the_first_and_last_moment_are_inside_and_beyond_them_is_refused():
    table = EphemerisTable("Body", *from_the_site(FAR))
    assert (table.first, table.last) == (BEGIN, BEGIN.plus(DAY))
    for inside in (table.first, table.last):
        row = table.times.index(inside)
        assert table.astrometric(SKY.at(inside)) == pytest.approx(table.directions[row], abs=1e-14)
    said = "Body: its table holds 2026-11-22T00:00:00.000Z to 2026-11-23T00:00:00.000Z, not 2026-11-2"
    for outside in (table.first.plus(-0.01), table.last.plus(0.01)):
        with pytest.raises(TargetError) as refused:
            table.observed(SKY.at(outside))
        assert said in str(refused.value)


def test_every_way_to_write_a_moment_and_an_angle_is_the_same_table(tmp_path):
    times, directions = from_the_site(FAR, hours=6)
    ra, dec = (np.array(column) for column in zip(*map(longitude_latitude, directions), strict=True))
    utc = [time.utc_iso(6) for time in times]
    ways = [
        {"time": utc, "ra": np.degrees(ra) * u.deg, "dec": np.degrees(dec) * u.deg},
        {"time": Time(utc, precision=9).tt, "ra": np.degrees(ra) / 15.0 * u.hourangle, "dec": dec * u.rad},
        {"time": Time(utc, precision=9).tdb, "ra": np.degrees(ra) * u.deg, "dec": np.degrees(dec) * 60.0 * u.arcmin},
        {"time": Time(utc, precision=9), "ra": ra * u.rad, "dec": dec * u.rad},
        {"jd": Time(utc, precision=9).jd, "ra": ra * u.rad, "dec": dec * u.rad},
    ]
    frame = SKY.at(BEGIN.plus(9000.0))
    truth = EphemerisTable("t", times, directions).astrometric(frame)
    for way in ways:
        table = EphemerisTable.from_file(written(tmp_path, way))
        late = max(abs(a.since(b)) for a, b in zip(table.times, times, strict=True))
        print(f"{list(way)}: moments within {late:.1e} s")
        assert late < 5e-5
        assert math.dist(table.astrometric(frame), truth) < 1e-5 * ARCSEC


def test_distances_make_a_table_geocentric_unless_it_says_otherwise(tmp_path):
    frame = SKY.at(BEGIN.plus(9000.0))
    plain = EphemerisTable.from_file(written(tmp_path, rows()))
    in_au = EphemerisTable.from_file(written(tmp_path, rows(distance=np.full(6, 1.0) * u.au)))
    in_km = EphemerisTable.from_file(written(tmp_path, rows(distance=np.full(6, AU_KM) * u.km)))
    own = EphemerisTable.from_file(
        written(tmp_path, rows(distance=np.full(6, 1.0) * u.au), {"observer": "topocentric", "name": "Mine"})
    )
    assert own.astrometric(frame) == plain.astrometric(frame)
    assert math.dist(in_au.astrometric(frame), in_km.astrometric(frame)) < 1e-14
    assert 1.0 < math.dist(in_au.astrometric(frame), plain.astrometric(frame)) / ARCSEC < 8.8
    assert (own.name, plain.name, own.note_at(BEGIN)) == ("Mine", "table", "")
    assert plain.note_at(BEGIN).startswith("table: no distances and no observer in its table")
    assert in_au.note_at(BEGIN) == ""


def test_rows_too_far_apart_are_said_to_be():
    body = Passing(MIDDLE, km=60_000.0, across_km_s=3.0)
    times = tuple(BEGIN.plus(3600.0 * k) for k in range(9, 17))
    directions = tuple(tuple(body.astrometric(t, np.array(SKY.at(t).position_au))[0]) for t in times)
    table = EphemerisTable("Rock", times, directions)
    worst = 0.0
    for k in range(1, 70):
        frame = SKY.at(times[0].plus(360.0 * k))
        truth = body.astrometric(frame.instant, np.array(frame.position_au))[0]
        worst = max(worst, math.dist(table.astrometric(frame), truth) / ARCSEC)
    print(f"off by up to {worst:.1f}″, said {table.roughness_arcsec:.1f}″")
    assert "Rock: joined to about" in table.note_at(BEGIN)
    assert 0.2 * worst < table.roughness_arcsec < 5.0 * worst


@pytest.mark.parametrize(
    ("columns", "meta", "said"),
    [
        (rows(time=None), {}, "has columns ra, dec: give time (ISO, UTC) or jd"),
        (rows(ra=None), {}, "has columns time, dec: ra is missing"),
        (rows(dec=None), {}, "dec is missing"),
        (rows(ra=np.linspace(1, 2, 6)), {}, "column ra has no unit; give it deg or hourangle"),
        (rows(ra=np.linspace(1, 2, 6) * u.m), {}, "column ra: 'm' (length) and 'rad' (angle) are not convertible"),
        (rows(dec=[1, 2, np.nan, 4, 5, 6] * u.deg), {}, "row 3: dec is no number"),
        (rows(dec=[1, 2, 3, 4, 5, 91] * u.deg), {}, "row 6: dec 91°; possible are −90° to 90°"),
        (rows(ra=MaskedColumn([1.0] * 6, mask=[0, 1, 0, 0, 0, 0], unit="deg")), {}, "row 2: ra is no number"),
        (rows(ra=["x"] * 6), {}, "column ra has no unit"),
        (rows(time=["2026-11-22"] * 6), {}, "row 2: 2026-11-22T00:00:00.000Z is the time of the row before again"),
        (rows(time=[f"2026-11-2{d}" for d in (1, 2, 4, 3, 5, 6)]), {}, "row 4: 2026-11-23T00:00:00.000Z is before"),
        (rows(time=["2026-11-22", "soon", *["2026-11-22"] * 4]), {}, "row 2: time 'soon' is no time in UTC"),
        (rows(time=None, jd=[1.0, np.nan, 3, 4, 5, 6]), {}, "row 2: jd 'nan' is no time in UTC"),
        (rows(3), {}, "has 3 rows: a spline needs at least 4"),
        (rows(ra=[1, 2, 60, 61, 62, 63] * u.deg), {}, "row 3: more than 30° from the row before"),
        (rows(distance=[1, 1, 0, 1, 1, 1] * u.au), {}, "row 3: distance 0 au"),
        (rows(distance=np.ones(6)), {}, "column distance has no unit; give it au or km"),
        (rows(), {"frame": "apparent"}, "frame 'apparent' in its meta data; only astrometric ICRS"),
        (rows(), {"observer": "geocentric"}, "geocentric places need a column distance"),
        (rows(), {"observer": "500@399"}, "observer '500@399' in its meta data; possible are geocentric and"),
    ],
)  # fmt: skip
def test_a_table_that_is_not_as_it_must_be_is_refused_with_its_row(tmp_path, columns, meta, said):
    with pytest.raises(TargetError) as refused:
        EphemerisTable.from_file(written(tmp_path, columns, meta))
    assert said in str(refused.value)
    assert str(refused.value).startswith("table")


def test_a_file_that_is_no_table_is_a_sentence(tmp_path):
    (tmp_path / "text.ecsv").write_text("time,ra,dec\n1,2,3\n", encoding="utf-8")
    for path, said in ((tmp_path / "none", "No such file"), (tmp_path, "cannot be read"),
                       (tmp_path / "text.ecsv", "text.ecsv is no ECSV table")):  # fmt: skip
        with pytest.raises(TargetError, match=said):
            EphemerisTable.from_file(path)


@settings(derandomize=True, deadline=None, max_examples=60)
@given(st.data())
def test_any_damage_to_a_table_is_a_refusal_or_still_a_table(tmp_path_factory, data):
    folder = tmp_path_factory.getbasetemp()
    text = written(folder, rows(), name="whole.ecsv").read_text(encoding="utf-8")
    at = data.draw(st.integers(0, len(text)))
    damaged = text[:at] + data.draw(st.text(max_size=6)) + text[at + data.draw(st.integers(0, 40)) :]
    path = folder / "damaged.ecsv"
    path.write_text(damaged, encoding="utf-8")
    try:
        table = EphemerisTable.from_file(path)
    except TargetError as refused:
        assert "\n" not in str(refused)  # noqa: PT017 - a refusal is as good as a table
    else:
        assert all(map(math.isfinite, table.astrometric(SKY.at(table.first))))
