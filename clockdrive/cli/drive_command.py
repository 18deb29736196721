"""`clockdrive drive`: the drive's own registers, its power, and its axes at a speed."""

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from clockdrive.axis_names import WORDS as AXIS_WORDS
from clockdrive.cli import display
from clockdrive.cli.backend import Backend, backend, configuration_of

_NAME = "a register's name as `drive show` has it; without its axis it means both"


def words(command: argparse.ArgumentParser) -> None:
    """Add the grammar of `drive`."""
    actions = command.add_subparsers(dest="action", metavar="ACTION", required=True)

    def action(name: str, text: str) -> argparse.ArgumentParser:
        made = actions.add_parser(name, help=text, description=text, allow_abbrev=False)
        made.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="print one JSON document")
        return made

    show = action("show", "registers with values, units and flags; all without a NAME")
    show.add_argument("names", nargs="*", metavar="NAME", help=_NAME)
    change = action("set", "write one register and read it back")
    change.add_argument("name", metavar="NAME", help="a register's name as `drive show` has it")
    change.add_argument("value", metavar="VALUE", help="in the register's unit, 0x…, or names of flags")
    change.add_argument("--force", action="store_true", help="what another command should rather do")
    action("diff", "what the unit has otherwise than the configuration")
    action("pull", "write what the unit has otherwise into the file of -c, or print it")
    push = action("push", "write the configuration into the unit: the keys named, or all that differ; not saved")
    push.add_argument("keys", nargs="*", metavar="KEY", help="as in `drive diff`, axis1.park_deg")
    raw = action("raw", "give an axis controller a command of its manual, or hold a key of an awr")
    raw.add_argument("axis", metavar="AXIS", help=AXIS_WORDS)
    raw.add_argument("words", nargs="+", metavar="COMMAND", help="STATUS, MS.DUMP, STEP 0.01, + 3; LEFT guide 0.5")
    raw.add_argument("--yes", action="store_true", help="confirm what is risky")
    seen = action(
        "fiducials", "when an axis passed its fiducials, and by how much its position was off; apo and sdss"
    )
    seen.add_argument("axis", nargs="?", metavar="AXIS", help=f"{AXIS_WORDS}; all without one")
    action(
        "set-time", "have the axis controllers set their clocks, and see how far off they are then; sdss"
    ).add_argument("--yes", action="store_true", help="confirm it")
    pec = action("pec", "make the PEC table of a stepper box from a file of bins and arcseconds; no drive is asked")
    pec.add_argument("file", metavar="FILE", help="a bin and by how much the telescope was ahead there, a line")
    pec.add_argument("--harmonics", type=int, default=4, metavar="N", help="of the worm, to be fitted, 1 to 50")
    pec.add_argument("--assembler", action="store_true", help="write it for the assembler instead of C")
    pec.add_argument("--picture", metavar="FILE", help="draw what was measured and fitted")
    action("save", "have the unit keep its registers over a power-cycle")
    for name, text in (("factory", "load the factory's registers, unsaved"), ("reload", "load the saved registers")):
        action(name, f"{text}; the position is unsynchronised afterwards").add_argument(
            "--yes", action="store_true", help="confirm it"
        )
    power = action("power", "power the motors, or send the drive to standby")
    power.add_argument("state", choices=("on", "standby"))
    action("encoders", "what the encoders read, and where they say the axes are; tc410 and avr-box")
    speed = action("speed", "move both axes at speeds for a time, beside a dead-man process")
    for axis in (1, 2):
        speed.add_argument(f"deg_s_{axis}", type=float, metavar=f"D{axis}", help=f"axis {axis}, degrees a second")
    speed.add_argument("--for", dest="duration", metavar="TIME", required=True, help="for how long")


def drive(args: argparse.Namespace) -> None:
    """Do one action on the drive."""
    if args.action == "pec":
        _pec(args)
        return
    keep_tracking = args.action in {"show", "diff", "pull", "encoders", "fiducials"}
    with backend(args.config, f"drive {args.action}", keep_tracking=keep_tracking) as telescope:
        answer = _ACTIONS[args.action](telescope, args)
    if args.json:
        display.as_json(answer)
    else:
        print(_TEXTS.get(args.action, _note)(answer), flush=True)


def _pec(args: argparse.Namespace) -> None:
    """Make the table; the drive is not needed for it."""
    from clockdrive.drives import part_of  # noqa: PLC0415 - only here

    configuration = configuration_of(args.config)
    found = (
        part_of(configuration.drive.kind, "pec_table")
        .pec_table(
            configuration,
            args.file,
            harmonics=args.harmonics,
            assembler=args.assembler,
            picture=args.picture,
        )
        .json
    )
    if args.json:
        display.as_json(found)
        return
    amplitudes = ", ".join(f"{each:.2f}″" for each in found["amplitudes_arcsec"])
    print(f"harmonics {amplitudes}; {found['rms_arcsec']:.2f}″ RMS are left", file=sys.stderr)
    print(found["text"], end="")


def _pull(telescope: Backend, args: argparse.Namespace) -> dict[str, Any]:
    """Take the unit's values into the file, or answer with its lines where there is no file."""
    from clockdrive import configuration_edit  # noqa: PLC0415 - only here

    found = telescope.call("drive_diff")["differences"]
    changes = {row["key"]: row["unit_value"] for row in found if row["unit_value"] is not None}
    left = sorted({row["register"] for row in found if row["unit_value"] is None})
    if changes and args.config is not None:
        configuration_edit.change(Path(args.config), changes)
    lines = configuration_edit.lines(changes)
    return {"ok": True, "file": args.config, "changed": changes, "toml": lines, "not_expressible": left}


def _power(telescope: Backend, args: argparse.Namespace) -> dict[str, Any]:
    return telescope.call("power", on=args.state == "on") | {"note": f"power: {args.state}"}


def _speed(telescope: Backend, args: argparse.Namespace) -> dict[str, Any]:
    from clockdrive import parse  # noqa: PLC0415 - the mathematics takes 0.2 s to load

    seconds = parse.duration(args.duration)
    with display.progress_bar(quiet=args.json) as show:
        return telescope.call("drive_at", show, deg_s=[args.deg_s_1, args.deg_s_2], seconds=seconds)


_ACTIONS: dict[str, Callable[[Backend, argparse.Namespace], dict[str, Any]]] = {
    "diff": lambda telescope, _: telescope.call("drive_diff"),
    "encoders": lambda telescope, _: telescope.call("drive_encoders"),
    "factory": lambda telescope, args: telescope.call("drive_factory", confirmed=args.yes),
    "fiducials": lambda telescope, args: telescope.call("drive_fiducials", axis=args.axis),
    "power": _power,
    "pull": _pull,
    "push": lambda telescope, args: telescope.call("drive_push", keys=list(args.keys)),
    "raw": lambda telescope, args: telescope.call(
        "drive_raw", axis=args.axis, command=" ".join(args.words), confirmed=args.yes
    ),
    "reload": lambda telescope, args: telescope.call("drive_reload", confirmed=args.yes),
    "save": lambda telescope, _: telescope.call("drive_save"),
    "set": lambda telescope, args: telescope.call(
        "drive_set", register=args.name, value=args.value, force=args.force
    ),
    "set-time": lambda telescope, args: telescope.call("drive_set_time", confirmed=args.yes),
    "show": lambda telescope, args: telescope.call("drive_show", registers=list(args.names)),
    "speed": _speed,
}


def _registers_text(found: Mapping[str, Any]) -> str:
    groups: dict[str, list[str]] = {}
    for name, row in found["registers"].items():
        raw = " ".join(f"0x{word:04X}" for word in row["raw"])
        groups.setdefault(row["group"], []).append(f"  {name:32} {row['text']:44} {raw}")
    return "\n".join("\n".join((*filter(None, [group]), *rows)) for group, rows in groups.items())


def _set_text(found: Mapping[str, Any]) -> str:
    lines = [f"{name}: {row['text']} (was {found['before']})" for name, row in found["registers"].items()]
    return "\n".join((*lines, *filter(None, [found["note"]])))


def _diff_text(found: Mapping[str, Any]) -> str:
    rows = [
        f"{row['key']:30} {row['register']:32} unit {row['unit']:.10g}, configured {row['configured']:.10g} "
        f"{row['units']}".rstrip()
        for row in found["differences"]
    ]
    return "\n".join(rows) or "the unit agrees with the configuration"


def _pull_text(found: Mapping[str, Any]) -> str:
    if not found["changed"] and not found["not_expressible"]:
        return "the unit agrees with the configuration; nothing was changed"
    lines = [found["toml"] if found["file"] is None else f"{found['file']}: changed\n{found['toml']}"]
    lines += [f"# {name}: the unit's value has no key of its own" for name in found["not_expressible"]]
    return "\n".join(lines)


def _push_text(found: Mapping[str, Any]) -> str:
    rows = [f"{name}: {row['text']}" for name, row in found["registers"].items()]
    return (
        "\n".join((*rows, found["note"])) if rows else "the unit agrees with the configuration; nothing was written"
    )


def _encoders_text(found: Mapping[str, Any]) -> str:
    return "\n".join(_encoder_text(row) for row in found["encoders"])


def _encoder_text(row: Mapping[str, Any]) -> str:
    return _absolute_text(row) if "gray" in row else _incremental_text(row)


def _incremental_text(row: Mapping[str, Any]) -> str:
    text = f"axis {row['axis']}: {row['reading']} since the box was switched on, {row['step_arcsec']:.1f}″ each"
    if row["counts"] is None:
        return f"{text}; not tied to the axis: `sync` does it"
    return (
        f"{text}; position {row['counts']:.0f} ±{row['uncertainty_arcsec']:.0f}″, "
        f"{row['off_arcsec']:+.0f}″ from where it is reckoned to be"
    )


def _absolute_text(row: Mapping[str, Any]) -> str:
    seen = "detected" if row["detected"] else "not detected"
    text = f"axis {row['axis']}: {seen}, 0x{row['gray']:04X} Gray, {row['binary']} binary, {row['angle_deg']:.4f}°"
    if not row["bits"]:
        return f"{text}; not configured (encoder_bits = 0)"
    if row["fault"]:
        return f"{text}\n  {row['fault']}"
    return (
        f"{text}; {row['bits']} bits, position {row['counts']:.0f} ±{row['uncertainty_arcsec']:.0f}″, "
        f"{row['off_arcsec']:+.0f}″ from the drive's ({row['belief']})"
    )


def _speed_text(found: Mapping[str, Any]) -> str:
    ways = zip(found["from_deg"], found["to_deg"], strict=True)
    rows = [f"axis{axis}: {start:.5f}° → {end:.5f}°" for axis, (start, end) in enumerate(ways, start=1)]
    return "\n".join((f"moved for {found['seconds']:.1f} s", *rows))


def _raw_text(found: Mapping[str, Any]) -> str:
    rows = found["fiducials"]
    if not rows:
        return "\n".join((*(found["lines"] or [f"{found['command']}: OK"]), *filter(None, [found["note"]])))
    return "\n".join((_PASSAGES, *(_passage_text(row) for row in rows)))


_PASSAGES = f"{'time':24} {'position':>12} {'velocity':>11} {'error':>10} {'edge':8} {'correction':>11}"


def _fiducials_text(found: Mapping[str, Any]) -> str:
    table = [f"{row['axis']:9} {_passage_text(row)}" for row in found["fiducials"]]
    return "\n".join((*([f"{'axis':9} {_PASSAGES}"] if table else []), *table, *filter(None, [found["note"]])))


def _passage_text(row: Mapping[str, Any]) -> str:
    return (
        f"{row['utc']:24} {row['position_deg']:12.6f} {row['velocity_deg_s']:+11.6f} {row['error_deg']:+10.6f} "
        f"{row['edge']:8} {row['correction_deg']:+11.6f}"
    )


def _note(found: Mapping[str, Any]) -> str:
    return str(found["note"])


_TEXTS: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "diff": _diff_text,
    "encoders": _encoders_text,
    "fiducials": _fiducials_text,
    "pull": _pull_text,
    "push": _push_text,
    "raw": _raw_text,
    "set": _set_text,
    "show": _registers_text,
    "speed": _speed_text,
}
