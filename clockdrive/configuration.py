"""The configuration of one telescope: read from flags, environment and file, checked as a whole, then frozen.

A flag wins over the environment (`CLOCKDRIVE_DRIVE__LINK`), that over the file, that over the unit's own registers,
and those over the defaults of `configuration_keys`. Everything that is wrong is told at once. Values keep the units
of their names; relative paths in a file are taken from the file's folder.
"""

import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, Literal, TypeVar, cast

from clockdrive.configuration_check import BadValue, cautions, checked, contradictions, from_text
from clockdrive.configuration_keys import (
    DEFAULT_KIND,
    DRIVE_KINDS,
    KEYS,
    OPTIONAL,
    READABLE,
    Computed,
    Key,
    Value,
    keys_of,
)
from clockdrive.configuration_sections import (
    AxisSection,
    DriveSection,
    InstrumentSection,
    LimitsSection,
    MountSection,
    RotatorSection,
    SimulatorSection,
    SiteSection,
    TargetsSection,
    WeatherSection,
)
from clockdrive.errors import ConfigurationError

Origin = Literal["flag", "environment", "file", "unit", "default", "polar alignment"]
_Section = TypeVar("_Section")
_PREFIX = "CLOCKDRIVE_"
NO_FILE = (
    "no configuration file: this is the embedded simulator of a TC410 on an equatorial fork at Kaikoura "
    "(latitude −42.4°, longitude 173.7°); `clockdrive init tc410` writes a file for your own telescope"
)
NO_FILE_OF = (
    "no configuration file: this is the embedded simulator; `clockdrive init {kind}` writes a file for your own"
)


@dataclass(frozen=True)
class Configuration:
    """All of it, checked.

    Attributes
    ----------
    axes : (AxisSection, AxisSection)
        Axis 1 and axis 2.
    rotator : RotatorSection or None
        The instrument rotator, where there is one: where the table `[rotator]` is given, though it be empty.
    instruments : mapping
        Pointing origins by name; `main` when none is configured.
    state_path : Path or None
        Folder of the state store when one is configured; see `state_directory`.
    values, origins : mapping
        Every value that applies to this drive, and where it is from, by dotted name.
    source : str
        What it was read from, for displays.
    notice : str
        What the user must be told about it; empty when nothing.
    """

    site: SiteSection
    weather: WeatherSection
    mount: MountSection
    drive: DriveSection
    axes: tuple[AxisSection, AxisSection]
    rotator: RotatorSection | None
    limits: LimitsSection
    instruments: Mapping[str, InstrumentSection]
    targets: TargetsSection
    simulator: SimulatorSection
    state_path: Path | None
    values: Mapping[str, Value]
    origins: Mapping[str, Origin]
    source: str
    notice: str

    @property
    def simulated(self) -> bool:
        """Whether the drive is the embedded simulator."""
        return set(self.links) == {"sim:"}

    @property
    def links(self) -> tuple[str, ...]:
        """Where the drive is reached: by one link, or where an axis has its own, by those."""
        own = (self.values.get(f"{section}.link") for section in ("axis1", "axis2", "rotator"))
        return tuple(str(link) for link in own if link is not None) or (self.drive.link,)

    @property
    def identity(self) -> str:
        """Names the telescope in the state store: its drive and how it is reached."""
        return " ".join((self.drive.kind, *map(_one_name, self.links)))

    @property
    def state_directory(self) -> Path:
        """The folder of the state store."""
        if self.state_path is not None:
            return self.state_path
        import platformdirs  # noqa: PLC0415 - needed only where no path is configured

        return Path(platformdirs.user_state_path("clockdrive"))

    def section(self, make: type[_Section], name: str) -> _Section:
        """Make a section with the keys of this drive: a dataclass, each field a key of `name`."""
        return _section(self.values, make, name)

    def left_to_the_unit(self) -> tuple[str, ...]:
        """Dotted names of the keys that a TC410 keeps itself and nobody has configured: read them from the unit."""
        return tuple(
            key.dotted
            for key in keys_of(self.drive.kind)
            if key.in_unit and self.drive.kind == READABLE and self.origins[key.dotted] == "default"
        )

    def completed(self, unit: Mapping[str, object]) -> "Configuration":
        """Return this configuration with what a unit's own registers say in place of defaults, checked as a whole.

        Raises
        ------
        ConfigurationError
            The unit's values are impossible, or contradict what is configured.
        """
        draft = _Draft()
        draft.layer(unit, "unit", Path())
        for dotted, origin in self.origins.items():
            if origin != "default":
                draft.layer({dotted: self.values[dotted]}, origin, Path())
        if self.rotator is not None:
            draft.layer({f"{OPTIONAL}.": None}, "file", Path())
        draft.settle()
        if draft.problems:
            raise ConfigurationError(f"{self.source}, completed from the unit,", draft.problems)
        return _frozen(draft, self.source, self.notice)

    @property
    def cautions(self) -> tuple[str, ...]:
        """A sentence for each value that is possible, and unwise."""
        return tuple(cautions(self.values))


def load(
    path: Path | str | None,
    environment: Mapping[str, str] | None = None,
    overrides: Mapping[str, object] | None = None,
    unit: Mapping[str, object] | None = None,
    *,
    with_files: bool = False,
) -> Configuration:
    """Read and check a configuration.

    Parameters
    ----------
    path : Path or str or None
        The TOML file; None for the embedded simulator.
    environment : mapping, optional
        Variables such as `CLOCKDRIVE_SITE__LATITUDE_DEG`; those of this process when None.
    overrides : mapping, optional
        Flags by dotted name, `{"drive.link": "COM3"}`, as text or of the key's own type.
    unit : mapping, optional
        What the unit's own registers say, by dotted name; stands in for defaults only.
    with_files : bool
        Whether the files that it names must be there.

    Raises
    ------
    ConfigurationError
        The file cannot be read, or anything in it is wrong; all problems at once.
    """
    source = "the configuration" if path is None else str(path)
    tables = {} if path is None else _read(Path(path))
    environment = os.environ if environment is None else environment
    folder = Path() if path is None else Path(path).parent
    draft = _Draft()
    draft.layer(unit or {}, "unit", Path())
    draft.layer(_flat(tables), "file", folder)
    draft.layer(_variables(environment), "environment", Path())
    draft.layer(overrides or {}, "flag", Path())
    draft.settle()
    problems = [*draft.problems, *(draft.missing_files() if with_files else ())]
    if problems:
        raise ConfigurationError(source, problems)
    return _frozen(draft, source, _notice(path, draft.values))


def _read(path: Path) -> dict[str, object]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        problem = f"there is no such file; `clockdrive init tc410` writes one to start from ({path})"
    except UnicodeDecodeError as error:
        problem = f"byte {error.start} is not UTF-8 text; save the file as UTF-8"
    except OSError as error:
        problem = f"it cannot be read: {error.strerror}; check the path and its permissions"
    except tomllib.TOMLDecodeError as error:
        problem = f"it is not TOML: {error}; correct that line"
    except RecursionError:
        problem = (
            "it is not TOML that anyone means: tables nest too deeply; `clockdrive config check` needs plain ones"
        )
    raise ConfigurationError(str(path), [problem])


def _flat(tables: Mapping[str, object], prefix: str = "", depth: int = 3) -> dict[str, object]:
    """Values by dotted name, as deep as keys go; an empty table stands for itself."""
    flat: dict[str, object] = {}
    for name, value in tables.items():
        dotted = f"{prefix}{name}"
        if isinstance(value, dict) and depth > 1:
            flat.update(_flat(value, f"{dotted}.", depth - 1) if value else {f"{dotted}.": None})
        else:
            flat[dotted] = value
    return flat


def _variables(environment: Mapping[str, str]) -> dict[str, object]:
    return {
        name.removeprefix(_PREFIX).lower().replace("__", "."): value
        for name, value in environment.items()
        if name.startswith(_PREFIX) and "__" in name.removeprefix(_PREFIX)
    }


class _Draft:
    """Values being gathered, layer over layer, with what is wrong with them."""

    def __init__(self) -> None:
        self.given: dict[str, tuple[object, Origin, Path]] = {}
        self.values: dict[str, Value] = {}
        self.origins: dict[str, Origin] = {}
        self.problems: list[str] = []
        self.wrong: set[str] = set()
        self.instruments: list[str] = []

    def layer(self, values: Mapping[str, object], origin: Origin, folder: Path) -> None:
        """Lay `values` over what is there."""
        for dotted, raw in values.items():
            self.given[dotted] = (raw, origin, folder)

    def settle(self) -> None:
        """Check all, fill in the defaults, look for contradictions."""
        kind = self.given.get("drive.kind", (DEFAULT_KIND,))[0]
        drive = kind if isinstance(kind, str) and kind in DRIVE_KINDS else DEFAULT_KIND
        names = [d.split(".")[1] for d in self.given if d.startswith("instruments.") and d.count(".") == 2]
        self.instruments = list(dict.fromkeys(n for n in names if n)) or ["main"]
        keys = {key.dotted: key for key in self._expanded(keys_of(drive))}
        self._refuse_unknown(keys, drive)
        for key in keys.values():
            self._settle(key)
        facts = {k: v for k, v in self.values.items() if k != "limits.horizon_deg" or self.origins[k] != "default"}
        self.problems += [text for names, text in contradictions(facts) if not self.wrong & set(names)]

    def missing_files(self) -> Iterator[str]:
        """A sentence for each file named that does not exist."""
        for dotted, value in self.values.items():
            if isinstance(value, Path) and dotted != "state.path" and not value.exists():
                yield f"{dotted} = {value}: there is no such file; correct the path or leave the key out"

    def _expanded(self, keys: tuple[Key, ...]) -> Iterator[Key]:
        has_rotator = any(dotted.startswith(f"{OPTIONAL}.") for dotted in self.given)
        for key in keys:
            if key.section == OPTIONAL and not has_rotator:
                continue
            if key.section == "instruments.*":
                yield from (replace(key, section=f"instruments.{name}") for name in self.instruments)
            else:
                yield key

    def _refuse_unknown(self, keys: Mapping[str, Key], drive: str) -> None:
        sections = {key.section for key in keys.values()} | {"instruments", "site"}
        others = {key.dotted: key.drives for key in KEYS}
        for dotted, (_, origin, _folder) in self.given.items():
            if dotted in keys or (dotted.endswith(".") and dotted[:-1] in sections):
                continue
            name = dotted.rstrip(".")
            table = name if dotted.endswith(".") else name.rpartition(".")[0]
            if dotted in others:
                meant = f"it is a key of {' and '.join(others[dotted])}, and drive.kind is {drive}"
            elif table in keys:
                meant = f"{table} is a key, and takes {keys[table].allowed}"
            elif table and table not in sections and table.partition(".")[0] != "instruments":
                name, meant = table, _nearest_table(table, sections)
            else:
                meant = _nearest_key(name, table, keys)
            text = f"{_short(name)} is no key{_from(name, origin)}: {meant}"
            if text not in self.problems:  # one for all keys of a table that is none
                self.problems.append(text)

    def _settle(self, key: Key) -> None:
        raw, origin, folder = self.given.get(key.dotted, (None, "default", Path()))
        if raw is not None:
            typed = from_text(key, raw) if origin in {"flag", "environment"} and isinstance(raw, str) else raw
            try:
                self.values[key.dotted] = checked(key, typed, folder)
                self.origins[key.dotted] = origin
            except BadValue:
                allowed = f"allowed {key.allowed}"
                self.problems.append(f"{key.dotted} = {_shown(raw)}{_from(key.dotted, origin)}: {allowed}")
                self.wrong.add(key.dotted)
            else:
                return
        self.values[key.dotted] = self._default(key)
        self.origins[key.dotted] = "default"

    def _default(self, key: Key) -> Value:
        raw = key.default.rule(self.values, key.section) if isinstance(key.default, Computed) else key.default
        return None if raw is None else checked(key, raw, Path())


def _nearest_table(name: str, tables: Iterable[str]) -> str:
    import difflib  # noqa: PLC0415 - needed only where something is wrong

    alike = [table for table in tables if table[0] == name[0]]
    near = difflib.get_close_matches(name, alike, 1, 0.6)
    return f"did you mean {near[0]}?" if near else f"the tables are {', '.join(sorted(tables))}"


def _nearest_key(name: str, table: str, keys: Iterable[str]) -> str:
    import difflib  # noqa: PLC0415 - likewise

    key = name.rpartition(".")[2]
    elsewhere = [known for known in keys if known.rpartition(".")[2] == key]
    siblings = [known for known in keys if known.rpartition(".")[0] == table]
    near = elsewhere[:1] or difflib.get_close_matches(name, siblings, 1, 0.6)
    if near:
        return f"did you mean {near[0]}?"
    there = ", ".join(known.rpartition(".")[2] for known in siblings)
    return f"[{table}] has {there}" if siblings else "a key stands in a table, such as [site]"


def _from(dotted: str, origin: Origin) -> str:
    variable = _PREFIX + dotted.upper().replace(".", "__")
    return {"environment": f" (environment {variable})", "flag": " (flag)", "unit": " (read from the unit)"}.get(
        origin, ""
    )


def _shown(raw: object) -> str:
    if isinstance(raw, dict | list):
        return "a table" if isinstance(raw, dict) else "a list"
    return _short(repr(raw) if isinstance(raw, str) else str(raw))


def _notice(path: Path | str | None, values: Mapping[str, Value]) -> str:
    if path is not None or values["drive.link"] != "sim:":
        return ""
    kind = str(values["drive.kind"])
    return NO_FILE if kind == DEFAULT_KIND else NO_FILE_OF.format(kind=kind)


def _one_name(link: str) -> str:
    """One telescope has one name: the default speed, a bare port and this computer's own name are all left out."""
    link = link.removesuffix("?baud=9600")
    if re.fullmatch(r"COM\d+|/dev/\S+", link, re.IGNORECASE):
        link = f"serial://{link}"
    return link.replace("tcp://localhost:", "tcp://127.0.0.1:")


def _short(text: str) -> str:
    return text if len(text) <= 60 else f"{text[:59]}…"


def _section(values: Mapping[str, Value], make: type[_Section], name: str) -> _Section:
    return make(**{f.name: cast("Any", values[f"{name}.{f.name}"]) for f in fields(cast("Any", make))})


def _frozen(draft: _Draft, source: str, notice: str) -> Configuration:
    values = draft.values

    def section(make: type[_Section], name: str) -> _Section:
        return _section(values, make, name)

    return Configuration(
        site=section(SiteSection, "site"),
        weather=section(WeatherSection, "site.weather"),
        mount=section(MountSection, "mount"),
        drive=section(DriveSection, "drive"),
        axes=(section(AxisSection, "axis1"), section(AxisSection, "axis2")),
        rotator=section(RotatorSection, "rotator") if "rotator.mode" in values else None,
        limits=section(LimitsSection, "limits"),
        instruments={name: section(InstrumentSection, f"instruments.{name}") for name in draft.instruments},
        targets=section(TargetsSection, "targets"),
        simulator=section(SimulatorSection, "simulator"),
        state_path=cast("Path | None", values["state.path"]),
        values=values,
        origins=draft.origins,
        source=source,
        notice=notice,
    )
