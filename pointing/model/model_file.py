"""TPOINT's file of a model: caption, `T n sky-RMS A B`, a term a line, END.

A term is `[&][=]NAME value [sigma]`, arcseconds; `=` keeps it fixed in a fit, `&` chains it to the one before.
Numbers are written with the digits of the usual layout, and with more where a value has more, so nothing is lost.
"""

import re
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np

from pointing.errors import PointingError
from pointing.model.records import Record, read_lines, write_lines

_HEAD = re.compile(r"\s*([A-Z])\s*(.*)", re.IGNORECASE)
_ROW = re.compile(r"\s*(?P<flags>[&=\s]*)(?P<name>[A-Z][A-Z0-9_]*)(?P<numbers>\s.*)?", re.IGNORECASE)
_DECIMAL_COMMA = re.compile(r"\d,\d")
_HEAD_WANTED = "n, sky RMS, and perhaps refraction A and B"


@dataclass(frozen=True)
class ModelRow:
    """A term: its coefficient and standard deviation in arcseconds; None where the file has none."""

    name: str
    arcsec: float
    sigma_arcsec: float | None = None
    fixed: bool = False
    chained: bool = False


@dataclass(frozen=True)
class ModelFile:
    """What a model file says, neither judged nor understood.

    Parameters
    ----------
    caption : str
        Title.
    method : str
        The letter before the numbers, T.
    n : int
        Observations it was fitted to.
    sky_rms_arcsec : float
        Residual on the sky.
    refraction_a, refraction_b : float
        Constants, arcseconds.
    rows : tuple of ModelRow
        In the file's order.
    """

    caption: str
    method: str = "T"
    n: int = 0
    sky_rms_arcsec: float = 0.0
    refraction_a: float = 0.0
    refraction_b: float = 0.0
    rows: tuple[ModelRow, ...] = ()

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{escape(row.name)}</td><td>{row.arcsec:+.4f}</td>"
            f"<td>{'' if row.sigma_arcsec is None else f'{row.sigma_arcsec:.5f}'}</td>"
            f"<td>{'fixed' if row.fixed else ''}</td></tr>"
            for row in self.rows
        )
        head = f"{escape(self.caption)}: n = {self.n}, sky RMS {self.sky_rms_arcsec:g}″"
        return f"<table><caption>{head}</caption><tr><th>term</th><th>″</th><th>σ</th><th></th></tr>{rows}</table>"


def read_model_file(path: str | Path) -> ModelFile:
    """Read a model file; behind END only blanks and comments may stand.

    Raises
    ------
    PointingError
        It is none; with file, line, column and text.
    """
    lines = read_lines(path)
    while lines and not lines[-1].text.strip():
        lines.pop()
    if len(lines) < 2:
        raise PointingError(f"{Path(path).name} is no model: give caption, T n RMS A B, terms and END")
    caption, head, *rest = lines  # a caption may be END
    numbers = _head(head)
    end = next((i for i, line in enumerate(rest) if line.text.strip().upper() == "END"), None)
    if end is None:
        lines[-1].refuse("the model ends without END: the file is cut off; write END behind the last term")
    for record in rest[end + 1 :]:
        if _speaks(record):
            record.refuse("text behind END, which is no term: write END behind the last one, or take it out")
    return ModelFile(caption.text.strip(), *numbers, _rows(rest[:end]))


def _speaks(record: Record) -> bool:
    """Whether a line is neither blank nor a comment."""
    return bool(record.text.strip()) and not record.text.lstrip().startswith(("!", ";"))


def _refuse_decimal_comma(record: Record, start: int) -> None:
    """Refuse `10,5`: commas part numbers, and the value would be 10 with a standard deviation of 5."""
    found = _DECIMAL_COMMA.search(record.text, start)
    if found is not None:
        record.refuse("a comma inside a number: write a decimal point, and blanks between numbers", found.start() + 2)


def _rows(records: list[Record]) -> tuple[ModelRow, ...]:
    rows: dict[str, ModelRow] = {}
    for record in records:
        if _speaks(record):
            row = _row(record)
            if row.name in rows:
                record.refuse(f"the term {row.name} a second time: keep one")
            rows[row.name] = row
    return tuple(rows.values())


def _head(record: Record) -> tuple[str, int, float, float, float]:
    match = _HEAD.fullmatch(record.text)
    if match is None:
        record.refuse(f"wanted is T, then {_HEAD_WANTED}")
    _refuse_decimal_comma(record, match.start(2))
    numbers = record.numbers(_HEAD_WANTED, match.start(2))
    if not 2 <= len(numbers) <= 4:
        record.refuse(f"{len(numbers)} numbers; wanted are {_HEAD_WANTED}")
    n, rms, a, b = [number.value for number in numbers] + [0.0] * (4 - len(numbers))
    if n < 0.0 or n % 1.0:
        record.refuse("a number of observations; give a whole one from 0", numbers[0].column, numbers[0].text)
    return match[1].upper(), int(n), rms, a, b


def _row(record: Record) -> ModelRow:
    match = _ROW.fullmatch(record.text)
    if match is None:
        record.refuse("no term; write NAME, coefficient and perhaps sigma in arcseconds")
    _refuse_decimal_comma(record, match.end("name"))
    numbers = record.numbers("coefficient and sigma in arcseconds", match.end("name"))
    if len(numbers) not in {1, 2}:
        record.refuse(f"{len(numbers)} numbers; wanted are coefficient and perhaps sigma", match.end("name") + 1)
    sigma = numbers[1].value if len(numbers) == 2 else None
    if sigma is not None and sigma < 0.0:
        record.refuse("a standard deviation; possible are numbers from 0", numbers[1].column, numbers[1].text)
    flags = match["flags"]
    return ModelRow(match["name"].upper(), numbers[0].value, sigma, "=" in flags, "&" in flags)


def write_model_file(model: ModelFile, path: str | Path) -> None:
    """Write a model file, which `read_model_file` reads back to the last digit.

    Raises
    ------
    PointingError
        It cannot be written.
    """
    head = (
        f"{model.method}{model.n:5d} {_number(model.sky_rms_arcsec, 4):>8} {_number(model.refraction_a, 3):>8} "
        f"{_number(model.refraction_b, 4):>8}"
    )
    caption = " ".join(model.caption.split())
    write_lines(path, [caption, head, *map(_written, model.rows), "END"])


def _written(row: ModelRow) -> str:
    flags = f"{'&' if row.chained else ' '}{'=' if row.fixed else ' '}"
    sigma = "" if row.sigma_arcsec is None else f" {_number(row.sigma_arcsec, 5):>11}"
    return f"{flags}{row.name:<7} {_number(row.arcsec, 4, sign=True):>10}{sigma}"


def _number(value: float, digits: int, *, sign: bool = False) -> str:
    """At least so many decimals, and all that tell the value from its neighbours."""
    return str(np.format_float_positional(value, unique=True, min_digits=digits, trim="k", sign=sign))
