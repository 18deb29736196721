"""A pointing run from a file of any format: which, its content says."""

from collections.abc import Callable
from pathlib import Path

from pointing.model.records import Record, read_lines
from pointing.model.run import PointingRun
from pointing.model.spk_file import LETTERS, read_spk
from pointing.model.tpoint_file import read_tpoint
from pointing.model.words import Places
from pointing.site import Weather


def read_run(path: str | Path, *, places: Places | None = None, weather: Weather | None = None) -> PointingRun:
    """Read an ECSV, SPK or TPOINT file.

    Parameters
    ----------
    path : path
        The file.
    places : str, optional
        Frame of the right ascensions of an equatorial TPOINT file: `apparent`, `icrs` or `observed`. The other
        formats hold observed places.
    weather : Weather, optional
        Instead of that in the file, for these right ascensions.

    Raises
    ------
    PointingError
        It cannot be read.
    """
    lines = read_lines(path)
    reader = next((read for belongs, read in _READERS if belongs(lines)), None)
    return reader(path) if reader else read_tpoint(path, places=places, weather=weather)


def _is_ecsv(lines: list[Record]) -> bool:
    return lines[0].text.startswith("# %ECSV")


def _is_spk(lines: list[Record]) -> bool:
    written = [line.text.strip() for line in lines if line.text.strip()]
    return len(written) > 1 and written[1].upper() in LETTERS


def _read_ecsv(path: str | Path) -> PointingRun:
    from pointing.model.ecsv_run import read_ecsv  # noqa: PLC0415 - takes astropy along

    return read_ecsv(path)


_READERS: tuple[tuple[Callable[[list[Record]], bool], Callable[[str | Path], PointingRun]], ...] = (
    (_is_ecsv, _read_ecsv),
    (_is_spk, read_spk),
)
