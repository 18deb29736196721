"""Every readable register of a TC410, as a person reads it."""

from collections.abc import Iterator

from mounts.tc410.registers import REGISTERS, Register
from mounts.tc410.unit import Unit

_MOST_WORDS = 12  # of one request: a telescope that tracks must not wait long for its next velocity


def report(unit: Unit) -> dict[str, str]:
    """Read all registers; by name, value and unit, flags by their names.

    Raises
    ------
    TransportError
        No valid answer.
    """
    shown = {}
    for rows in _blocks():
        found = unit.read(rows[0].name, rows[-1].name)
        for row in rows:
            flags = row.asserted(found.words[row.name][0])
            text = (", ".join(flags) or "none") if row.flags else f"{found[row.name]:.10g} {row.unit}".strip()
            shown[row.name] = text
    return shown


def _blocks() -> Iterator[list[Register]]:
    """Rows that follow each other without a gap, few enough for one request."""
    block: list[Register] = []
    for row in (row for row in REGISTERS if row.access != "write"):
        words = sum(other.words for other in block) + row.words
        last = block[-1] if block else None
        follows = last is not None and last.kind == row.kind and last.address + last.words == row.address
        if block and (not follows or words > _MOST_WORDS):
            yield block
            block = []
        block.append(row)
    yield block
