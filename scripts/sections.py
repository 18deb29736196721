"""A section of a page that a command writes, from `<!-- made by COMMAND: NAME -->` to `<!-- end -->`."""

import re
from collections.abc import Sequence
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parents[1]


def with_section(page: str, name: str, text: str) -> str:
    """Return `page` with `text` as its section `name`.

    Raises
    ------
    ValueError
        The page has no such section, or more than one.
    """
    pattern = re.compile(rf"(<!-- made by [^\n]*: {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    written, count = pattern.subn(lambda found: f"{found[1]}\n{text.strip()}\n\n{found[2]}", page)
    if count != 1:
        raise ValueError(f"section {name!r} stands {count} times in the page; mark it once, `made by … : {name}`")
    return written


def write_section(path: Path, name: str, text: str, *, check: bool = False) -> bool:
    """Write a section of the page at `path`, unless `check`; return whether it was current."""
    before = path.read_text(encoding="utf-8")
    after = with_section(before, name, text)
    if before != after and not check:
        path.write_text(after, encoding="utf-8")
    return before == after


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; a bar within a cell is escaped."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
