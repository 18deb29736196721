"""Runs as tables with units, in memory and in ECSV files; and the one reader that knows every format."""

import datetime as dt
import math
from dataclasses import replace

import numpy as np
import pytest
from astropy import units as u
from astropy.table import Column, MaskedColumn, QTable, Table
from astropy.time import Time
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError
from pointing.model.ecsv_run import read_ecsv, write_ecsv
from pointing.model.run import PointingRun
from pointing.model.run_file import read_run
from pointing.model.spk_file import write_spk
from pointing.model.tpoint_file import read_tpoint, write_tpoint
from pointing.site import Weather

FILES = ("apo_2016-08-18", "apo_2017-12-10", "auxtel_2020-02", "auxtel_2022-04", "gem_cgx-l", "gem_warp",
         "spk_altaz", "spk_equat")  # fmt: skip
ANGLES = ("star1", "star2", "axis1", "axis2")


def columns(**changed):
    made = {
        "azimuth": [10.0, 20.0] * u.deg,
        "elevation": [30.0, 40.0] * u.deg,
        "telescope_azimuth": [10.0, 20.0] * u.deg,
        "telescope_elevation": [30.0, 40.0] * u.deg,
    }
    return {name: column for name, column in (made | changed).items() if column is not None}


def table(meta=None, **changed):
    return Table(columns(**changed), meta={"latitude_deg": 30.0} if meta is None else meta)


@pytest.mark.parametrize("name", FILES)
def test_every_real_run_is_recognised_and_comes_back_from_ecsv(shared, tmp_path, name):
    run = read_run(shared / "data" / "tpoint" / f"{name}.dat", places="apparent")
    write_ecsv(run, tmp_path / "run.ecsv")
    again = read_run(tmp_path / "run.ecsv")
    for column in (*ANGLES, "rotator", "sidereal_time"):
        assert getattr(again, column) == pytest.approx(getattr(run, column), abs=4e-15, nan_ok=True)
    rounded = {column: getattr(run, column) for column in (*ANGLES, "rotator", "sidereal_time", "latitude")}
    assert replace(again, **rounded) == run


@settings(derandomize=True, deadline=None, max_examples=30)
@given(st.lists(st.tuples(*[st.floats(-7.0, 7.0), st.floats(-1.5, 1.5)] * 2, st.floats(0.0, 9.0), st.booleans()),
                min_size=1, max_size=4))  # fmt: skip
def test_any_run_keeps_everything_through_a_file(tmp_path_factory, rows):
    *angles, weight, kept = map(np.array, zip(*rows, strict=True))
    run = PointingRun(
        "equatorial", 0.5, *angles, weight=weight, kept=kept, time=1.7e9 + weight, auxiliary=np.array(angles[:2]).T,
        line=np.arange(len(rows)), caption="a 'run': é", source="x.dat", date=dt.date(2026, 3, 1),
        weather=Weather(pressure_hpa=700.0), height_m=2000.0, lapse_k_m=0.0065, refraction_applied=False,
        options=("EQUAT", "NODA"),
    )  # fmt: skip
    path = tmp_path_factory.getbasetemp() / "any.ecsv"
    write_ecsv(run, path)
    again = read_ecsv(path)
    for name in ANGLES:
        assert getattr(again, name) == pytest.approx(getattr(run, name), rel=1e-15, abs=1e-300)
    assert replace(again, latitude=run.latitude, **{name: getattr(run, name) for name in ANGLES}) == run


def test_units_and_names_are_read_whatever_they_are():
    mixed = table(
        azimuth=None, elevation=None, time=Time(["2026-03-01", "2026-03-02"]),
        altitude=[0.5, 0.6] * u.rad, telescope_azimuth=[600.0, 1200.0] * u.arcmin,
    )  # fmt: skip
    mixed["azimuth"] = [1.0, 2.0] * u.hourangle
    run = PointingRun.from_table(mixed)
    assert np.degrees([run.star1, run.axis1]) == pytest.approx(np.array([[15.0, 30.0], [10.0, 20.0]]))
    assert run.star2.tolist() == [0.5, 0.6]
    assert run.time.tolist() == pytest.approx([1772323200.0, 1772409600.0], abs=1e-5)
    assert run.to_table()["azimuth"].unit == u.deg
    assert isinstance(run.to_table(), QTable)


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (lambda: table(azimuth=None), "t has columns elevation, telescope_azimuth, telescope_elevation: wanted are"),
        (lambda: table(azimuth=[1.0, 2.0]), "t: column azimuth has no unit; give it deg, hourangle or rad"),
        (lambda: table(azimuth=[1.0, 2.0] * u.m), "t: column azimuth: 'm' (length) and 'rad' (angle)"),
        (
            lambda: table(azimuth=Column([1.0, 2.0], unit=u.Unit(";deg", parse_strict="silent"))),
            "t: column azimuth: The unit ';deg' is unrecognized",
        ),
        (lambda: table(azimuth=MaskedColumn([1.0, 2.0], mask=[0, 1], unit="deg")), "t, row 2: azimuth is no number"),
        (lambda: table(azimuth=[1.0, math.nan] * u.deg), "t, row 2: azimuth is no number"),
        (lambda: table(meta={}), "t has no latitude_deg in its meta data"),
        (lambda: table(meta={"latitude_deg": "north"}), "t: latitude_deg is 'north'"),
        (lambda: table(meta={"latitude_deg": 95.0}), "t: latitude 95°; possible are −90° to 90°"),
        (lambda: table(meta={"latitude_deg": 5.0, "date": "soon"}), "t: its meta data: Invalid isoformat"),
        (lambda: table(meta={"latitude_deg": 5.0, "weather": {"rain": 1}}), "t: its meta data: "),
        (lambda: table(kept=["a", "b"]), "t: column kept"),
        (lambda: table(weight=["a", "b"]), "t: column weight"),
        (lambda: table(weight=[1.0, -1.0]), "t: weight -1"),
    ],
)
def test_a_table_that_is_no_run_is_refused_with_column_and_row(made, said):
    from pointing.model.run_table import from_table

    with pytest.raises(PointingError) as refused:
        from_table(made(), "t")
    assert said in str(refused.value)


def test_a_file_that_is_no_table_is_a_sentence(tmp_path):
    (tmp_path / "broken.ecsv").write_text("# %ECSV 1.0\n# ---\n# datatype: [\n", encoding="utf-8")
    for path, said in ((tmp_path / "none", "No such file"), (tmp_path, "cannot be read"),
                       (tmp_path / "broken.ecsv", "broken.ecsv is no ECSV table")):  # fmt: skip
        for reader in (read_ecsv, read_run):
            with pytest.raises(PointingError, match=said):
                reader(path)


def test_weather_is_handed_to_the_reader_of_right_ascensions(shared):
    path = shared / "data" / "tpoint" / "gem_warp.dat"
    airless = read_run(path, places="apparent", weather=Weather(refraction=False))
    assert airless == read_tpoint(path, places="apparent", weather=Weather(refraction=False))
    assert not airless.refraction_applied
    assert read_run(path, places="apparent").refraction_applied


def test_a_run_without_stars_is_a_table_without_rows():
    empty = PointingRun("altazimuth", 0.5, *[np.zeros(0)] * 4)
    assert len(PointingRun.from_table(empty.to_table())) == 0


@pytest.mark.parametrize("write", [write_ecsv, write_spk, write_tpoint])
def test_what_cannot_be_written_is_a_sentence(tmp_path, write):
    run = PointingRun.from_degrees("altazimuth", 30.0, [1], [3], [1], [3])
    with pytest.raises(PointingError, match="cannot be written"):
        write(run, tmp_path / "no folder" / "run.dat")


def test_bytes_that_are_no_text_are_refused_by_every_reader(tmp_path):
    path = tmp_path / "run.dat"
    path.write_bytes(b"\x89PNG\r\n\x1a\n\0\0")
    with pytest.raises(PointingError, match=r"run\.dat is no text: byte 9 is zero"):
        read_run(path)
