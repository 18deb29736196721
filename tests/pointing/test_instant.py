"""Time: against astropy's Time, through leap seconds, and its resolution."""

import math
import random
from datetime import UTC, datetime

import pytest

from pointing.errors import PointingError
from pointing.instant import DAY, Instant


def test_agrees_with_astropy_to_a_nanosecond():
    from astropy.time import Time

    rng = random.Random(1)  # noqa: S311 - nothing secret
    for _ in range(200):
        posix = float(rng.randint(631152000, 1_800_000_000)) + rng.randrange(1024) / 1024
        tt = Time(posix, format="unix").tt
        ours = Instant.from_posix(posix)
        days = (tt.jd1 - 2400000.5 - ours.day) + tt.jd2
        assert days * DAY == pytest.approx(ours.seconds, abs=1e-9)


def test_posix_closes_from_1990_to_2060():
    rng = random.Random(2)  # noqa: S311 - nothing secret
    for _ in range(2000):
        posix = rng.uniform(631152000, 2871763200)
        assert Instant.from_posix(posix).posix() == pytest.approx(posix, abs=5e-7)


def test_iso_agrees_with_the_standard_library():
    rng = random.Random(3)  # noqa: S311 - nothing secret
    for _ in range(300):
        posix = rng.randint(631152000, 2871763200) + rng.randrange(8) / 8
        text = datetime.fromtimestamp(posix, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
        assert Instant.from_utc_iso(text) == Instant.from_posix(posix)
        assert Instant.from_posix(posix).utc_iso() == text


@pytest.mark.parametrize(
    "text", ["2026-03-01", "2026-03-01T00:00", "2026-03-01 00:00:00+00:00", " 2026-03-01T00:00:00.Z"]
)
def test_reads_shorter_spellings(text):
    assert Instant.from_utc_iso(text) == Instant.from_posix(1772323200.0)


def test_a_leap_second_lasts_a_second():
    before = Instant.from_utc_iso("2016-12-31T23:59:59Z")
    inside = Instant.from_utc_iso("2016-12-31T23:59:60.5Z")
    after = Instant.from_utc_iso("2017-01-01T00:00:00Z")
    assert inside.since(before) == pytest.approx(1.5, abs=1e-9)
    assert after.since(before) == pytest.approx(2.0, abs=1e-9)
    assert inside.utc_iso(1) == "2016-12-31T23:59:60.5Z"
    assert after.utc_iso(0) == "2017-01-01T00:00:00Z"
    assert inside.utc() == (57753, pytest.approx(86400.5, abs=1e-9))
    assert inside.posix() == pytest.approx(after.posix() + 0.5, abs=1e-6)
    assert before.posix() + 1 == pytest.approx(after.posix(), abs=1e-6)


def test_resolves_a_nanosecond_over_decades():
    start = Instant.from_posix(1_790_000_000.0)
    assert start.plus(1e-9).since(start) == pytest.approx(1e-9, abs=3e-11)
    assert start.plus(1e9).since(start) == pytest.approx(1e9, abs=2e-7)


@pytest.mark.parametrize("step", [0.0, -1e-18, -1e-12, -1.0, -86400.0, 86400.0, 1e6, -1e9])
def test_seconds_stay_within_their_day(step):
    for start in (Instant(60000, 0.0), Instant(60000, 86399.99999999999)):
        assert 0.0 <= start.plus(step).seconds < DAY


def test_instants_sort_by_time():
    moments = [Instant.from_posix(t) for t in (3e8, 1e9, 1.5e9, 1.5e9 + 1e-3)]
    assert sorted((moments[2], moments[0], moments[3], moments[1])) == moments


@pytest.mark.parametrize("posix", [math.nan, math.inf, -math.inf])
def test_refuses_a_time_that_is_none(posix):
    with pytest.raises(PointingError, match="finite"):
        Instant.from_posix(posix)


@pytest.mark.parametrize(
    "text",
    ["", "now", "2026-13-01", "2026-02-30T00:00:00Z", "2026-01-01T24:00:00Z", "2026-01-01T00:60:00Z",
     "2026-01-01T23:59:60Z", "2026-01-01T00:00:61Z", "2026-01-01T00:00:00+13:00", "٢٠٢٦-01-01", "0000-01-01"],
)  # fmt: skip
def test_refuses_a_text_that_is_no_time(text):
    with pytest.raises(PointingError, match="write it like"):
        Instant.from_utc_iso(text)


@pytest.mark.parametrize("year", [1, 1900, 1971, 2500, 9999])
def test_other_centuries_are_no_exception(year):
    moment = Instant.from_utc_iso(f"{year:04d}-06-01T12:00:00Z")
    assert moment.utc_iso(0) == f"{year:04d}-06-01T12:00:00Z"
