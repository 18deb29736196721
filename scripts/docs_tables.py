"""`python -m scripts.docs_tables [--check]`: write into docs/ the tables that the code itself reads."""

import sys
from collections.abc import Callable
from pathlib import Path

from clockdrive.configuration_file import markdown_table as configuration_keys
from mounts.apo.commands import TABLE as COMMANDS
from mounts.apo.commands import Kind
from mounts.apo.status_word import TABLES as BITS
from mounts.apo.status_word import StatusWord
from mounts.tc410.registers import REGISTERS, Register
from pointing.model.terms import NAMED, Term
from scripts.sections import CHECKOUT, markdown_table, write_section

DOCS = CHECKOUT / "docs"
KINDS = {"coil": "Coils", "discrete": "Discrete inputs", "input": "Input registers", "holding": "Holding registers"}

# First order of each result: (coordinate, sign, function of the place), for a coefficient that moves positively.
FIRST_ORDER = {
    "H": (("Δh", 1, ""),),
    "D": (("Δδ", 1, ""),),
    "X": (("Δh", 1, "sec δ"),),
    "P": (("Δh", 1, "tan δ"),),
    "L": (("Δh", -1, "cos h tan δ"), ("Δδ", 1, "sin h")),
    "U": (("Δh", 1, "sin h tan δ"), ("Δδ", 1, "cos h")),
    "Z": (("ΔZ", 1, ""),),
    "A": (("ΔA", 1, ""),),
    "E": (("ΔE", 1, ""),),
    "S": (("ΔA", 1, "sec E"),),
    "V": (("ΔA", 1, "tan E"),),
    "N": (("ΔA", -1, "sin A tan E"), ("ΔE", -1, "cos A")),
    "W": (("ΔA", -1, "cos A tan E"), ("ΔE", 1, "sin A")),
    "NRX": (("ΔA", -1, ""), ("ΔE", -1, "sin E")),
    "NRY": (("ΔA", -1, "tan E"), ("ΔE", 1, "cos E")),
}
LETTERS = {"H": "h", "D": "δ", "A": "Aₛ"}


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


def commands() -> str:
    """Return the commands of the axis controllers."""
    rows = [
        (
            ", ".join(f"`{name}`" for name in (each.name, *each.aliases)),
            " / ".join(" ".join(form) or "–" for form in each.forms),
            each.effect,
            each.risky,
            ("SDSS only; " if each.sdss_only else "") + (f"assumed: {each.assumed}" if each.assumed else ""),
        )
        for each in COMMANDS
    ]
    return markdown_table(("command", "arguments", "effect", "risk", "remark"), rows)


def status_bits() -> str:
    """Return the status bits of both telescopes, a table each."""
    tables = []
    for kind, title in (("apo", "3.5 m"), ("sdss", "SDSS")):
        rows = [
            (str(each.bit), f"`{each.name}`", each.meaning, "yes" if each.sticky else "", _rank(kind, each.bit))
            for each in BITS[kind]
        ]
        tables.append(f"### {title}\n\n{markdown_table(('bit', 'name', 'meaning', 'sticky', 'counts as'), rows)}")
    return "\n\n".join(tables)


def _rank(kind: Kind, bit: int) -> str:
    word = StatusWord(1 << bit, kind)
    return "error" if word.errors else "warning" if word.warnings else ""


def pointing_terms() -> str:
    """Return the named terms of pointing models."""
    rows = [
        (f"`{each.name}`", formula(each), each.sentence, ", ".join(each.mounts), evidence(each)) for each in NAMED
    ]
    return markdown_table(("term", "to first order", "what it is", "mounts", "evidence"), rows)


def formula(each: Term) -> str:
    """What a term adds to the telescope's place, to first order."""
    sign = round(each.sign * each.moves.sign)
    amount = " ".join((each.name, *map(written, each.factors)))
    return ", ".join(
        f"{coordinate} = {'−' if sign * of < 0 else ''}{amount} {function}".rstrip()
        for coordinate, of, function in FIRST_ORDER[each.result]
    )


def written(factor: object) -> str:
    """A factor with the letters of the formulas: a function of H is one of h."""
    function, _, angle = str(getattr(factor, "text", factor)).rpartition(" ")
    number, letter = angle[:-1], angle[-1]
    return f"{function} {number}{LETTERS.get(letter, letter)}"


def evidence(each: Term) -> str:
    """Where a published fit confirms a term, and where none does."""
    found = {kind: each.evidence(kind) for kind in each.mounts}
    if len(set(found.values())) == 1:
        return found[each.mounts[0]]
    return ", ".join(f"{kind}: {text}" for kind, text in found.items())


TABLES: dict[tuple[Path, str], Callable[[], str]] = {
    (DOCS / "tc410.md", "registers"): registers,
    (DOCS / "apo.md", "commands"): commands,
    (DOCS / "apo.md", "bits"): status_bits,
    (DOCS / "configuration.md", "keys"): configuration_keys,
    (DOCS / "pointing-models.md", "terms"): pointing_terms,
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
