"""What a person sees: a progress bar, a live line, tables."""

import json
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from clockdrive.cli.backend import OnEvent


def as_json(answer: Mapping[str, Any]) -> None:
    """Print one JSON document."""
    print(json.dumps(answer))


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[OnEvent]:
    """A bar with the remaining time on stderr, for the events of a slew; in a file a line for each slew."""
    if quiet:
        yield lambda event: None  # noqa: ARG005 - nobody looks
    elif not sys.stderr.isatty():
        yield _lines(_going, _slew_line)
    else:
        with _bar() as show:
            yield show


def _going(event: Mapping[str, Any]) -> str:
    if event.get("waiting"):
        return f"waiting {event['waiting']}"
    return str(event["target"]) if str(event["target"]).startswith("jog of ") else f"slewing to {event['target']}"


def _slew_line(event: Mapping[str, Any]) -> str:
    return f"{_going(event)}: {float(event['remaining_s']):.1f} s left"


@contextmanager
def _bar() -> Iterator[OnEvent]:
    from rich.console import Console  # noqa: PLC0415 - only what moves needs it
    from rich.progress import BarColumn, Progress, TextColumn  # noqa: PLC0415 - likewise

    columns = TextColumn("{task.description}"), BarColumn(40), TextColumn("{task.fields[left]}")
    bar = Progress(*columns, console=Console(file=sys.stderr))
    task = bar.add_task("slewing", total=None, left="")

    def show(event: Mapping[str, Any]) -> None:
        bar.start()  # with the first event: what is refused shows no bar
        left, eta = float(event["remaining_s"]), float(event["eta_s"] or 0.0)
        bar.update(
            task,
            description=_going(event),
            total=max(eta, 1e-3),
            completed=max(0.0, eta - left),
            left=f"{left:6.1f} s left",
        )

    try:
        yield show
    finally:
        if bar.live.is_started:
            bar.stop()


@contextmanager
def search_bar(*, quiet: bool) -> Iterator[Callable[[float, str], object]]:
    """A bar on stderr for a search: called with the fraction that is done and what is looked at."""
    if quiet:
        yield lambda fraction, name: None  # noqa: ARG005 - nobody looks
        return
    from rich.console import Console  # noqa: PLC0415 - only what takes its time needs it
    from rich.progress import Progress  # noqa: PLC0415 - likewise

    bar = Progress(console=Console(file=sys.stderr))
    task = bar.add_task("searching", total=1.0)

    def show(fraction: float, name: str) -> None:
        bar.start()  # with the first search: what is refused shows no bar
        bar.update(task, completed=fraction, description=f"searching {name}")

    try:
        yield show
    finally:
        if bar.live.is_started:
            bar.stop()


def passes_text(answer: Mapping[str, Any]) -> str:
    """Passes as a table, and below it what has none and what must be known."""
    rows = [
        (
            each["target"],
            *(
                f"{_clock(each[moment])} {each[moment]['azimuth_deg']:4.0f}° {each[moment]['altitude_deg']:3.0f}°"
                for moment in ("rise", "culmination", "set")
            ),
            ", ".join(_CUT[key] for key in _CUT if each[key]),
        )
        for each in answer["passes"]
    ]
    count = "1 pass" if len(rows) == 1 else f"{len(rows)} passes"
    lines = [f"from {answer['after_utc']} to {answer['until_utc']}: {count} (UTC, azimuth, altitude)"]
    if rows:
        head = ("target", "rise", "culmination", "set", "")
        widths = [max(len(row[i]) for row in (head, *rows)) for i in range(len(head))]
        lines += ["  ".join(f"{cell:<{widths[i]}}" for i, cell in enumerate(row)).rstrip() for row in (head, *rows)]
    lines += [f"  {text}" for text in answer["without"]]
    first = {each["target"]: each["note"] for each in reversed(answer["passes"])}
    notes = [note for note in reversed(first.values()) if note]
    more = [f"--json has such a note for all {len(notes)}"] if len(notes) > _NOTES else []
    lines += [f"  note: {note}" for note in (*notes[:_NOTES], *more, *answer["notes"])]
    return "\n".join(lines)


_NOTES = 3
_CUT = {"begun": "up already", "unfinished": "still up"}


def _clock(moment: Mapping[str, Any]) -> str:
    return str(moment["utc"])[5:21].replace("T", " ")


@contextmanager
def live(*, quiet: bool) -> Iterator[OnEvent]:
    """A line on stderr that follows the status; in a file a line whenever the telescope does something else."""
    if quiet:
        yield lambda status: None  # noqa: ARG005 - nobody looks
    elif not sys.stderr.isatty():
        yield _warning(
            _lines(lambda status: (status["doing"], status.get("coming_to_rest"), status.get("target")), live_line)
        )
    else:
        try:
            yield _warning(_overwriting(live_line), before="\n")
        finally:
            print(file=sys.stderr)


def _warning(show: OnEvent, before: str = "") -> OnEvent:
    """Print each warning that comes up, on a line of its own."""
    told: Sequence[str] = ()

    def shown(status: Mapping[str, Any]) -> None:
        nonlocal told
        warnings = status.get("warnings", ())
        for text in warnings:
            if text not in told:
                print(f"{before}clockdrive: {text}", file=sys.stderr, flush=True)
        told = warnings
        show(status)

    return shown


def _lines(state: Callable[[Mapping[str, Any]], object], text: Callable[[Mapping[str, Any]], str]) -> OnEvent:
    """Print a line whenever the state is another one."""
    last: object = None

    def show(event: Mapping[str, Any]) -> None:
        nonlocal last
        if (now := state(event)) != last:
            print(text(event), file=sys.stderr, flush=True)
            last = now

    return show


def _overwriting(text: Callable[[Mapping[str, Any]], str]) -> OnEvent:
    """Print each line over the one before."""
    width = 0

    def show(event: Mapping[str, Any]) -> None:
        nonlocal width
        line = text(event)
        print(f"\r{line:<{width}}", end="", file=sys.stderr, flush=True)
        width = len(line)

    return show


def plan_text(answer: Mapping[str, Any]) -> str:
    """A plan as a few lines."""
    place, axes = answer["observed"], answer.get("axes_arrival_utc", answer["arrival_utc"])
    before = "" if axes == answer["arrival_utc"] else f"; the rotator is the last, both axes arrive at {axes}"
    lines = [
        f"{answer['target']}: start {answer['start_utc']}, arrival {answer['arrival_utc']}, {answer['eta_s']:.3f} s"
        + before,
        (
            f"  azimuth {place['azimuth_deg']:.4f}°  altitude {place['altitude_deg']:.4f}°  "
            f"hour angle {place['hour_angle_deg']:.4f}°  declination {place['declination_deg']:.4f}°  "
            f"posture {answer['posture']}"
        ),
    ]
    lines += [f"  {_axis(axis)}" for axis in answer["axes"]]
    lines += [f"  {line}" for line in _rotator_lines(answer)]
    lines += [f"  {'ok ' if check['ok'] else 'NOT'} {check['name']}: {check['detail']}" for check in answer["checks"]]
    lines += [f"  {line}" for line in (*_pass_lines(answer.get("pass")), *_limit_lines(answer.get("next_limit")))]
    lines += [f"  {line}" for line in _budget_lines(answer.get("budget"))]
    lines += _notes(answer)
    return "\n".join(lines)


def _axis(axis: Mapping[str, Any]) -> str:
    parts = [f"{axis['name']}: {axis['angle_deg']:.5f}°"]
    if "target_counts" in axis:
        begun = f"{axis['from_counts']} → " if "from_counts" in axis else ""
        parts.append(f"counts {begun}{axis['target_counts']}")
    elif "from_deg" in axis:
        parts.append(f"drive {axis['from_deg']:.6f}° → {axis['target_deg']:.6f}°")
    if "travel_s" in axis:
        parts.append(f"travel {axis['travel_s']:.3f} s{_moves(axis)}")
    return "  ".join((*parts, f"then {axis['rate_deg_s']:+.8f}°/s{_register(axis)}"))


def _rotator_lines(answer: Mapping[str, Any]) -> list[str]:
    """How the field lies and turns, and what a rotator does about it."""
    lines = []
    if answer.get("parallactic_angle_deg") is not None:
        lines.append(
            f"field: parallactic angle {answer['parallactic_angle_deg']:.4f}°, "
            f"turns {answer['field_rotation_deg_s']:+.7f}°/s in the focal plane"
        )
    turns = answer.get("rotator")
    if turns is not None:
        lines.append(_rotator(turns))
        lines += [f"rotator, {line}" for line in _limit_lines(turns.get("next_limit"))]
    return lines


def _rotator(turns: Mapping[str, Any]) -> str:
    """The rotator as a line: where it is or goes, and what it holds."""
    held = "holds nothing" if turns["mode"] is None else f"holds {_HELD[turns['mode']].format(turns['held_deg'])}"
    if turns.get("position_angle_deg") is not None:
        held += f", instrument at position angle {turns['position_angle_deg']:.4f}°"
    if "travel_s" in turns:
        return f"{_axis(turns)}; {held} from {turns['arrival_utc']}"
    where = f"{_position(turns)}  " if "uncertainty_counts" in turns else ""
    turning = "  slewing" if turns.get("slewing") else ""
    return f"{turns['name']}: {turns['angle_deg']:.5f}°  {where}{turns['rate_deg_s']:+.7f}°/s{turning}; {held}"


_HELD = {
    "sky": "position angle {:g}° on the sky",
    "horizon": "{:g}° from the zenith",
    "mount": "{:g}° on the mount",
}


def _position(axis: Mapping[str, Any]) -> str:
    """What the drive says of an axis, in its own units, and how far that may be off."""
    if axis["units"] == "degrees":
        return f"drive {axis['counts']:.6f}° ± {axis['uncertainty_counts']:.6f}°"
    return f"{axis['counts']:.2f} ± {axis['uncertainty_counts']:.1f} counts"


def _moves(axis: Mapping[str, Any]) -> str:
    """Of a drive that cannot stop a move: how many there are, and what that costs."""
    if "moves" not in axis:
        return ""
    longest, cost = axis["longest_move_s"], axis["moves_cost_s"]
    if not axis["moves"]:
        return " without a move"
    if axis["moves"] == 1:
        return " in one move"
    return f" in {axis['moves']} moves of up to {longest:.1f} s, which takes {cost:.1f} s longer than one"


def _register(axis: Mapping[str, Any]) -> str:
    if "guide_duty" in axis and not axis["rate_deg_s"]:
        return ", held against its own tracking by short moves"
    if "guide_duty" in axis:
        moves = axis["short_moves_counts_s"]
        beside = f" and short moves of {moves:+.1f} counts/s" if moves else ""
        command, ticks, every = axis["guide_command"], axis["guide_ticks"], axis["guide_every_s"]
        by = f" (`{command}` of {ticks} ticks every {every:g} s)" if command else ""
        return f", guided {axis['guide_duty']:+.1%} of the time{by}{beside}{_lag(axis)}"
    if "single_step_every_s" in axis:
        return f", a microstep every {axis['single_step_every_s']:.2f} s{_lag(axis)}"
    if "drive_counts" in axis:
        words = f"{axis['drive_register']} {axis['drive_counts']} counts, flags {axis['drive_flags']}"
        off, step = axis["drive_off_arcsec_s"], axis["drive_next_arcsec_s"]
        return f", {words}: {off:+.5f}″/s off, the next {step:.5f}″/s away"
    return f", register {axis['velocity_register']}" if "velocity_register" in axis else ""


def _lag(axis: Mapping[str, Any]) -> str:
    """How far it is off by short moves, where that is seen."""
    lag = axis.get("lag_arcsec", 0.0)
    if lag is None:
        return ", which is more than it can be held to"
    return f", up to {lag:.1f}″ off" if lag >= _SEEN_ARCSEC else ""


_SEEN_ARCSEC = 0.5


def _pass_lines(found: Mapping[str, Any] | None) -> list[str]:
    if not found:
        return []
    wait = "  ".join(f"{name} {place['angle_deg']:.4f}°" for name, place in found["wait"].items())
    lost = "".join(
        f"\n    the drive is too slow from {gap['begin_utc']} to {gap['end_utc']}, {gap['seconds']:.1f} s"
        for gap in found["lost"]
    )
    return [
        f"pass: on it from {found['joined_utc']} to {found['ends_utc']}, {found['followed_s']:.1f} s",
        f"  in posture {found['posture']}, {found['lost_s']:.1f} s lost{lost}",
        f"  from {wait}; ends at: {found['limit'] or 'nothing within two hours'}",
    ]


def _limit_lines(found: Mapping[str, Any] | None) -> list[str]:
    if not found:
        return []
    lost = found.get("lost_s")
    again = f"; lost for {lost:.0f} s, until {found['regained_utc']}" if lost else ""
    return [f"next limit at {found['utc']}: {found['detail']}{again}"]


def _budget_lines(found: Mapping[str, Any] | None) -> list[str]:
    """The total, and what makes up more than a tenth of it."""
    if not found:
        return []
    total = found["total_arcsec"]
    known = [each for each in found["sources"] if each["arcsec"] is not None and each["arcsec"] > total / 10.0]
    parts = [f"{each['name']} {each['arcsec']:.2f}″" for each in sorted(known, key=lambda each: -each["arcsec"])]
    parts += [f"not known: {', '.join(found['unknown'])}"] if found["unknown"] else []
    return [f"error budget {total:.2f}″: {'; '.join((', '.join(parts[: len(known)]), *parts[len(known) :]))}"]


def rates_text(answer: Mapping[str, Any]) -> str:
    """Tracking rates as a few lines."""
    lines = [f"{answer['target']} at {answer['utc']}"]
    lines += [
        f"  {axis['name']}: {axis['angle_deg']:.5f}°  {axis['rate_deg_s']:+.9f}°/s"
        + (f"  {axis['rate_counts_s']:+.5f} counts/s" if "rate_counts_s" in axis else "")
        + _register(axis)
        for axis in answer["axes"]
    ]
    lines += [f"  {line}" for line in _rotator_lines(answer)]
    lines += _notes(answer)
    return "\n".join(lines)


def arrival_text(answer: Mapping[str, Any]) -> str:
    """An arrival as a line, with what is to be said of the target."""
    arrival = (
        f"on {answer['target']} at {answer['arrived_utc']} (predicted {answer['arrival_utc']}), "
        f"{answer['arrival_error_arcsec']:.2f}″ off on landing, {answer['slews']} slew(s)"
    )
    of_the_target = [note for note in _notes(answer) if note.startswith(f"  note: {answer['target']}: ")]
    return "\n".join((arrival, *of_the_target, *(f"  warning: {text}" for text in answer["warnings"])))


def guide_text(answer: Mapping[str, Any]) -> str:
    """The sum of the pulses as a line."""
    return f"guided by {_east_north(answer['guide'])} in all"


def centre_text(answer: Mapping[str, Any]) -> str:
    """What an image told, as two lines."""
    how = "slewn" if answer["slewed"] else "moved"
    pulses = answer["guide_cleared"]
    cleared = f"\n  it took in and cleared the guide pulses, {_east_north(pulses)}" if pulses else ""
    return (
        f"{answer['target']} on {answer['instrument']}: the counts stood {_east_north(answer['error'])} of the image "
        f"of {answer['exposure_utc']}\n  {how} by {answer['moved_arcsec']:.2f}″; "
        f"in force is centre {_east_north(answer['centre'])}{cleared}"
    )


def instrument_text(answer: Mapping[str, Any]) -> str:
    """The pointing origins, a line each."""
    lines = [
        f"{'*' if name == answer['instrument'] else ' '} {name}: x {row['x_arcsec']:+.2f}″  y {row['y_arcsec']:+.2f}″"
        for name, row in answer["instruments"].items()
    ]
    if answer["limits_widened_deg"]:
        lines.append(f"  horizon and Sun are kept {answer['limits_widened_deg']:.2f}° wider, for the tube")
    if answer["moved"]:
        lines.append("  the target was put on it")
    return "\n".join(lines)


def _east_north(arcsec: Mapping[str, float]) -> str:
    return f"{arcsec['east_arcsec']:+.2f}″ east, {arcsec['north_arcsec']:+.2f}″ north"


def live_line(status: Mapping[str, Any]) -> str:
    """The telescope in one line."""
    if "observed" not in status:
        return f"{status['doing']}: the drive has not answered yet"
    place, error = status["observed"], status["error_arcsec"]
    off = "" if error is None else f"  {error:.2f}″ off"
    doing = "coming to rest" if status["coming_to_rest"] else status["doing"]
    waiting = status["waiting"]
    if waiting is not None:
        return f"{waiting['text']}: {waiting['left_s']:.0f} s left"
    return (
        f"{doing} {status['target'] or ''}  azimuth {place['azimuth_deg']:.4f}°  "
        f"altitude {place['altitude_deg']:.4f}°{off}"
    )


def status_text(status: Mapping[str, Any]) -> str:
    """Everything in `status`, a line each."""
    lines = [f"{status['telescope']} ({status['drive']}) at {status['utc']}", f"  {live_line(status)}"]
    if "observed" in status:
        synchronised = "yes" if status["synchronised"] else f"no: {status['unsynchronised_because']}"
        icrs = status["icrs"]
        lines += [
            f"  ICRS {icrs['ra_deg']:.5f}° {icrs['dec_deg']:+.5f}°  posture {status['posture']}",
            f"  synchronised: {synchronised}",
            *(
                f"  {axis['name']}: {axis['angle_deg']:.5f}°  {_position(axis)}  {axis['rate_deg_s']:+.6f}°/s"
                f"{'  slewing' if axis['slewing'] else ''}"
                for axis in status["axes"]
            ),
            *(f"  {line}" for line in _rotator_lines(status)),
            (
                f"  motors {'powered' if status['powered'] else 'in standby'}; moved by {_listed(status['motion'])}; "
                f"limits {_listed(status['limits'])}; alarms {_listed(status['alarms'])}"
            ),
            *(
                f"  {'ok ' if check['ok'] else 'NOT'} {check['name']}: {check['detail']}"
                for check in status["checks"]
            ),
            *(f"  {line}" for line in _limit_lines(status["next_limit"])),
            "  corrections in force:",
            *(f"    {_correction(row)}" for row in status["corrections"]),
        ]
    if status["parked"]:
        lines.append("  parked; `clockdrive unpark` allows motion")
    lines += [f"  warning: {text}" for text in status["warnings"]]
    lines += [f"  {text}" for text in (status["trouble"], *status["notes"]) if text]
    return "\n".join(lines)


def _notes(answer: Mapping[str, Any]) -> list[str]:
    return [f"  note: {note}" for note in answer.get("notes", ())]


def _correction(row: Mapping[str, Any]) -> str:
    age = f", {row['age_s']:.0f} s old" if "age_s" in row else ""
    return f"{row['name']}: {row['value']:.3f} {row['unit']} ({row['origin']}{age})"


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names) or "none"
