"""Changes to a configuration file, line by line, so that its comments and its order stay.

A key is changed where it stands, written below its commented line or its section's head where it does not, and in a
new section at the end where there is none. The result must say exactly what was meant and be a valid configuration;
otherwise the file is left as it is.
"""

import os
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

from clockdrive.configuration import load
from clockdrive.configuration_file import toml
from clockdrive.errors import ConfigurationError

_HEAD = re.compile(r"\s*\[(?P<name>[^\[\]]+)\]\s*(?:#.*)?")
_VALUE = r"\"(?:[^\"\\]|\\.)*\"|'[^']*'|[^#\"'\s][^#\"'\n]*?"


def lines(changes: Mapping[str, object]) -> str:
    """Changes by dotted name as lines of a new file."""
    sections: dict[str, list[str]] = {}
    for dotted, value in changes.items():
        section, _, name = dotted.rpartition(".")
        sections.setdefault(section, []).append(f"{name} = {toml(value)}")
    return "\n\n".join("\n".join((f"[{section}]", *rows)) for section, rows in sections.items())


def edited(text: str, changes: Mapping[str, object]) -> str:
    """`text` with values by dotted name in place of those it has."""
    rows = text.split("\n")
    for dotted, value in changes.items():
        section, _, name = dotted.rpartition(".")
        rows = _with(rows, section, name, toml(value))
    return "\n".join(rows)


def change(path: Path, changes: Mapping[str, object]) -> None:
    """Write changes into a configuration file, whole or not at all.

    Raises
    ------
    ConfigurationError
        It cannot be changed so: written otherwise than line by line, or not valid afterwards. It is as it was.
    """
    try:
        before = path.read_text(encoding="utf-8")
        after = edited(before, changes)
        _require_only(path, tomllib.loads(before), after, changes)
        draft = path.with_name(f".{path.name}.new")
        draft.write_text(after, encoding="utf-8")
        try:
            load(draft)
            draft.chmod(path.stat().st_mode & 0o777)
            os.replace(draft, path)  # noqa: PTH105 - the one call that is atomic everywhere
        finally:
            draft.unlink(missing_ok=True)
    except OSError as error:
        raise ConfigurationError(
            str(path), [f"it cannot be written: {error.strerror}; check its permissions"]
        ) from error


def _with(rows: list[str], section: str, name: str, value: str) -> list[str]:
    heads = [i for i, row in enumerate(rows) if _HEAD.fullmatch(row)]
    begin = next((i for i in heads if _HEAD.fullmatch(rows[i])["name"].strip() == section), None)  # type: ignore[index]
    if begin is None:
        return [*(rows[:-1] if rows[-1:] == [""] else rows), "", f"[{section}]", f"{name} = {value}", ""]
    end = next((i for i in heads if i > begin), len(rows))
    setting = re.compile(rf"(?P<before>\s*{re.escape(name)}\s*=\s*)(?:{_VALUE})(?P<after>\s*(?:#.*)?)")
    for i in range(begin + 1, end):
        if found := setting.fullmatch(rows[i]):
            return [*rows[:i], f"{found['before']}{value}{found['after']}", *rows[i + 1 :]]
    offered = re.compile(rf"#\s*{re.escape(name)}\s*=.*")
    after = next((i for i in range(begin + 1, end) if offered.fullmatch(rows[i])), begin)
    return [*rows[: after + 1], f"{name} = {value}", *rows[after + 1 :]]


def _require_only(path: Path, before: dict[str, object], after: str, changes: Mapping[str, object]) -> None:
    """Make sure that the new text says what the old one did, with the changes."""
    wanted = before
    for dotted, value in changes.items():
        *folders, name = dotted.split(".")
        table: dict[str, object] = wanted
        for folder in folders:
            inner = table.setdefault(folder, {})
            if not isinstance(inner, dict):
                break
            table = inner
        table[name] = tomllib.loads(f"x = {toml(value)}")["x"]
    try:
        same = tomllib.loads(after) == wanted
    except tomllib.TOMLDecodeError:
        same = False
    if not same:
        text = "it is not written line by line as `clockdrive init` writes it; put in by hand:"
        raise ConfigurationError(str(path), [f"{text}\n{lines(changes)}"])
