"""The records of a TPOINT file: its lines without comments, continued lines joined, parted into runs."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from pointing.errors import PointingError
from pointing.model.records import Record, read_lines


def read_runs(path: str | Path) -> list[list[Record]]:
    """Part a file's records into runs: after END, or where a caption and an option come after observations.

    Raises
    ------
    PointingError
        It cannot be read, or holds none.
    """
    records = list(_records(read_lines(path)))
    if not records:
        raise PointingError(f"{Path(path).name} holds no run: give caption, :EQUAT or :ALTAZ, latitude and stars")
    starts, optioned, in_body, ended = [0], False, False, False
    for i, record in enumerate(records):
        heads = any(map(is_option, records[i : i + 2]))
        if ended or (in_body and heads):
            starts.append(i)
            optioned = in_body = False
        optioned |= is_option(record)
        in_body |= optioned and not is_option(record)
        ended = is_end(record) and i > starts[-1]  # a caption may be END
    return [records[a:b] for a, b in zip(starts, [*starts[1:], len(records)], strict=True)]


def is_option(record: Record) -> bool:
    """Whether it says what kind of run this is."""
    return record.text.lstrip().startswith(":")


def is_end(record: Record) -> bool:
    """Whether the run ends here."""
    return record.text.strip().upper() == "END"


def _records(lines: list[Record]) -> Iterator[Record]:
    """Lines without blanks, comments and continuation."""
    pending: Record | None = None
    for line in lines:
        text = without_comment(line.text).rstrip()
        if pending is None and not text.strip():
            continue
        joined = line if pending is None else pending
        joined = replace(joined, text=text if pending is None else f"{pending.text} {text}")
        pending = replace(joined, text=joined.text[:-1]) if text.endswith("\\") else None
        if pending is None:
            yield joined
    if pending is not None:
        yield pending


def without_comment(text: str) -> str:
    """Cut a text where a comment begins."""
    cut = min((at for at in (text.find("!"), text.find(";")) if at >= 0), default=len(text))
    return text[:cut]
