"""A pointing run in an ECSV file, which keeps all that a run holds; `pointing.model.run_table` names the columns."""

import warnings
from pathlib import Path

from astropy.table import QTable

from pointing.errors import PointingError
from pointing.model.run import PointingRun
from pointing.model.run_table import from_table, to_table


def read_ecsv(path: str | Path) -> PointingRun:
    """Read a run.

    Raises
    ------
    PointingError
        It cannot be read, or a column, unit, the latitude or a value is wrong.
    """
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise PointingError(f"{str(file)!r} cannot be read ({why}): give an ECSV table") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of units that are no units; the column is refused
            table = QTable.read(text.splitlines(), format="ascii.ecsv")
    except Exception as error:  # noqa: BLE001 - whatever astropy and YAML make of a damaged file
        why = " ".join(str(error).split())[:200] or type(error).__name__
        raise PointingError(f"{file.name} is no ECSV table ({why}): write it with write_ecsv") from None
    return from_table(table, file.name)


def write_ecsv(run: PointingRun, path: str | Path) -> None:
    """Write a run, whole.

    Raises
    ------
    PointingError
        The file cannot be written.
    """
    try:
        to_table(run).write(path, format="ascii.ecsv", overwrite=True)
    except OSError as error:
        raise PointingError(f"{str(path)!r} cannot be written ({error.strerror}): give another path") from None
