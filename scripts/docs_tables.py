"""`python -m scripts.docs_tables [--check]`: write into docs/ the tables that the code itself reads."""

import sys
from collections.abc import Callable
from pathlib import Path

from clockdrive.configuration_file import markdown_table as configuration_keys
from mounts.tc410.registers import REGISTERS, Register
from scripts.sections import CHECKOUT, markdown_table, write_section

DOCS = CHECKOUT / "docs"
KINDS = {"coil": "Coils", "discrete": "Discrete inputs", "input": "Input registers", "holding": "Holding registers"}


def registers() -> str:
    """Return the TC410's registers, a table for each kind."""
    head = ("address", "name", "access", "unit", "saved", "meaning")
    return "\n\n".join(
        f"### {title}\n\n{markdown_table(head, [row(each) for each in REGISTERS if each.kind == kind])}"
        for kind, title in KINDS.items()
    )


def row(register: Register) -> tuple[str, ...]:
    """Return the cells of one register."""
    last = register.address + register.words - 1
    address = f"{register.address:02X}" if register.words == 1 else f"{register.address:02X}–{last:02X}"
    bits = ", ".join(f"{flag.bit} {flag.name}{' (0 asserts)' if flag.active_low else ''}" for flag in register.flags)
    meaning = register.meaning + (f". Bits: {bits}" if bits else "")
    saved = "yes" if register.saved else ""
    return address, f"`{register.name}`", register.access, register.unit, saved, meaning


TABLES: dict[tuple[Path, str], Callable[[], str]] = {
    (DOCS / "tc410.md", "registers"): registers,
    (DOCS / "configuration.md", "keys"): configuration_keys,
}


def main(arguments: list[str]) -> int:
    """Write all tables, or check that they are current; return the exit code."""
    check = arguments == ["--check"]
    if arguments and not check:
        print(__doc__, file=sys.stderr)
        return 2
    stale = [
        f"{path.name}: {name}"
        for (path, name), make in TABLES.items()
        if not write_section(path, name, make(), check=check)
    ]
    if stale:
        print("stale, run python -m scripts.docs_tables:" if check else "written:", ", ".join(stale))
    return 1 if check and stale else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
