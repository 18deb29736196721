"""The configuration on paper: a commented file to start from, and the table of keys for the documentation."""

import textwrap
from collections.abc import Mapping

from clockdrive.configuration import load
from clockdrive.configuration_keys import DRIVE_KINDS, KEYS, OPTIONAL, READABLE, SITES, Computed, Key, Value, keys_of

_ALWAYS = ("site.name", "site.latitude_deg", "site.longitude_deg", "site.height_m", "drive.kind", "drive.link",
           "mount.type")  # fmt: skip
_SECTIONS = {
    "site": "Where the telescope stands. These are {site}'s values: put in your own.",
    "site.weather": "Air at the telescope, for refraction. Left out: the standard atmosphere at the height.",
    "drive": "The drive and how it is reached.",
    "mount": "How the axes lie.",
    "limits": "Where the telescope may point.",
    "axis1": "Equatorial: hour angle, west positive. Altazimuth: azimuth, north through east.",
    "axis2": "Equatorial: declination, beyond 90 past the pole. Altazimuth: elevation.",
    "rotator": "The instrument rotator, as both observatories have one. Without one, take the whole table away.",
    "instruments.main": "Pointing origins: where in the focal plane a target is put. One table each.",
    "targets": "Where targets come from that move among the stars.",
    "simulator": "What the embedded simulator's telescope really does; a perfect mount when left out.",
    "state": "Where positions, corrections and history are kept between commands.",
}
_HEAD = """\
# Clockdrive: configuration of a telescope with the drive {drive}.
# A line that begins with # is the default, or an example where it says so; take the # away to change it.
# `clockdrive config check` checks the file.
"""
_UNIT = "# [unit] marks what a TC410 keeps in its own registers: left out here, it is read from there.\n"


def commented_template(drive: str, mount_type: str | None = None, values: Mapping[str, object] | None = None) -> str:
    """A complete TOML file for a telescope with `drive`, each key with unit, allowed values and meaning.

    Parameters
    ----------
    drive : str
        One of `DRIVE_KINDS`.
    mount_type : str, optional
        One of `MOUNT_TYPES`; the drive's usual one when None.
    values : mapping, optional
        Values by dotted name to write as given, such as those read from a unit's own registers.

    Raises
    ------
    ConfigurationError
        The drive, the mount type or a value is not allowed.
    """
    given: dict[str, object] = {"drive.kind": drive, **SITES.get(drive, {}), **(values or {})}
    if mount_type is not None:
        given["mount.type"] = mount_type
    optional = {f"{OPTIONAL}.": None} if any(key.section == OPTIONAL for key in keys_of(drive)) else {}
    settled = load(None, environment={}, overrides={**optional, **given})
    lines = [_HEAD.format(drive=drive), _UNIT if drive == READABLE else ""]
    section = ""
    for key in keys_of(drive):
        name = key.section.replace("*", "main")
        if name != section:
            section = name
            said = _SECTIONS[name].format(site=settled.site.name)
            lines.append("\n" + "".join(f"# {line}\n" for line in textwrap.wrap(said, 100)))
            lines.append(f"[{name}]\n")
        dotted = f"{name}.{key.name}"
        lines.append(_line(key, settled.values[dotted], active=dotted in given or dotted in _ALWAYS))
    return "".join(lines)


def _line(key: Key, value: Value, *, active: bool) -> str:
    # An optional key without a value shows an example; it would mean something if it were taken as it stands.
    shown = value if value is not None else (key.example or _raw_default(key))
    setting = f"{'' if active and value is not None else '# '}{key.name} = {toml(shown)}"
    example = "" if value is not None else f"; an example, the default is {_default_words(key)}"
    mark = " [unit]" if key.in_unit and READABLE in key.drives else ""
    return f"{setting:<40}  # {key.meaning}: {key.allowed}{example}{mark}\n"


def _raw_default(key: Key) -> Value:
    return "" if isinstance(key.default, Computed) else key.default


def toml(value: object) -> str:
    """A value as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    escaped = str(value).replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}" for c in escaped) + '"'


def markdown_table() -> str:
    """All keys as Markdown, a table for each section."""
    parts: list[str] = []
    section = ""
    for key in KEYS:
        if key.section != section:
            section = key.section
            shown = section.replace("*", "NAME")
            parts += [
                f"\n### `[{shown}]`\n",
                "| key | default | allowed | meaning | drives |",
                "|---|---|---|---|---|",
            ]
        drives = "all" if key.drives == DRIVE_KINDS else ", ".join(key.drives)
        cells = (f"`{key.name}`", _default_words(key), key.allowed, key.meaning, drives)
        parts.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(parts).lstrip("\n") + "\n"


def _default_words(key: Key) -> str:
    if isinstance(key.default, Computed):
        return key.default.text
    if key.default is None:
        return "none"
    return f"`{toml(key.default)}`"
