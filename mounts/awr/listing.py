"""Everything of a unit that a person may want to see, by name: its words, its lines, and what was measured of it."""

from collections.abc import Mapping, Sequence

from mounts.awr.cascade import Stage
from mounts.awr.commands import RELAYS
from mounts.awr.parts import Parts


def listed(parts: Parts, course: Sequence[Stage]) -> Mapping[str, str]:
    """Read all of it; `course` are the stages of the last goto.

    Raises
    ------
    TransportError
        The unit does not answer.
    """
    parts.words.read()
    return {**parts.words.shown(), **_lines(parts), **_rates(parts), **_measured(parts, course)}


def _lines(parts: Parts) -> dict[str, str]:
    """Relays, override, input lines, the index of the worm."""
    rows, status = dict[str, str](), parts.unit.status()
    if status is not None:
        for number in RELAYS:
            rows[f"relay_{number}"] = "on" if status.relays >> number - 1 & 1 else "off"
        rows["override"] = "stopped" if status.override else "clear"
    if parts.supervision.lines is not None:
        rows["input_lines"] = parts.supervision.lines.said.removeprefix("input lines: ")
    if parts.supervision.index is not None:
        when, where = parts.supervision.index
        rows["index"] = f"{parts.unit.now() - when:.1f} s ago at {where:.1f} steps"
    return rows


def _rates(parts: Parts) -> dict[str, str]:
    """What the drives do, and how finely it can be had."""
    rows, speeds = dict[str, str](), parts.words.speeds
    for number, rate in enumerate(speeds.drives, start=1):
        apart = speeds.apart(speeds.drive_words(number - 1))
        rows[f"drive_rate_{number}"] = f"{rate:.4f} steps/s, the next one {apart:.2g} away"
    return rows


def _measured(parts: Parts, course: Sequence[Stage]) -> dict[str, str]:
    """The last goto, the line, and how soon keys act."""
    unit, rows = parts.unit, dict[str, str]()
    if course:
        rows["last_goto"] = "; ".join(map(str, course))
    rows["line"] = f"{unit.damaged} packets lost or damaged" + "".join(f"; {why}" for why in unit.strange)
    if unit.debug:
        rows["debug_text"] = " | ".join(unit.debug)
    rows["key_delay_ms"] = f"{parts.keys.delay_s * 1e3:.1f}"
    rows["guide_step"] = " and ".join(f"{step:.2f} steps" for step in parts.pace.ladder.guide_steps)
    return rows
