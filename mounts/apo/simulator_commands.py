"""What a simulated controller does when it is told to: one function a command, from the manual.

Of the driver's side it shares the table of commands, and nothing that computes.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

from mounts.apo.commands import TABLE, Argument, Command, decode, row_of
from mounts.apo.errors import ImpossibleCommand
from mounts.apo.simulator_axis import SimulatedController
from mounts.apo.simulator_path import line
from mounts.apo.status_word import mask_of

VERSION = "axis code: 2009-10-16 379M, axis.ini version $Revision: 1.41 $"
_MOVES = {"MOVE", "+MOVE", "+", "-", "P"}

_Arguments = Sequence[Argument]
_Lines = Sequence[str]


class Refusal(Exception):  # noqa: N818 - what the controller says
    """The controller's reason not to obey."""


def obey(axis: SimulatedController, text: str, t: float) -> tuple[_Lines, str]:
    """Let a controller obey a line at POSIX `t`; return lines of data and its error, empty for none."""
    axis.advance(t)
    try:
        what = _understood(axis, text)
        _require_able(axis, what)
        if what.flushes:
            axis.fiducials.off_at = None
        if what.ends_corrections:
            axis.fiducials.switch(on=False)
        return _HANDLERS[what.name](axis, what.arguments, t), ""
    except (Refusal, ImpossibleCommand) as refusal:
        axis.record.refused.append((t, str(refusal)))
        return (), str(refusal) if axis.settings.refusals == "told" else ""
    finally:
        axis.collect()


def _understood(axis: SimulatedController, text: str) -> Command:
    head, *rest = text.split(maxsplit=1) or [""]
    limits = axis.settings.limits_command.upper()
    if head.upper() == "SET.LIMITS" != limits:
        raise Refusal("unknown command SET.LIMITS")
    what = decode(" ".join(("SET.LIMITS" if head.upper() == limits else head, *rest)))
    if what.name in axis.settings.unknown:
        raise Refusal(f"unknown command {what.name}")
    return what


def _require_able(axis: SimulatedController, what: Command) -> None:
    if what.name not in _MOVES:
        return
    if "semaphore_taken" in axis.conditions:
        raise Refusal("the semaphore is owned by another")
    if (axis.needs_init or axis.is_halted) and (what.arguments or what.name != "MOVE"):
        raise Refusal("the axis is halted, INIT first")


# Motion ------------------------------------------------------------------------------------------------------------


def _move(axis: SimulatedController, arguments: _Arguments, t: float) -> _Lines:
    values = [float(value) for value in arguments]
    if len(values) == 3:
        _node(axis, values[0], values[1], values[2], t)
    elif values:
        velocity = _clipped(axis, values[1]) if len(values) == 2 else 0.0
        axis.servo.follow(line(axis.count, values[0], velocity))
    elif not (axis.needs_init or axis.is_halted):
        axis.servo.follow(line(axis.count, axis.servo.position))
    return ()


def _node(axis: SimulatedController, position: float, velocity: float, time: float, t: float) -> None:
    servo = axis.servo
    if not axis.clock.is_set:
        raise Refusal("the clock is not set")
    at = axis.clock.count_at(time, axis.count)
    if at <= axis.count:
        axis.sticky |= mask_of("update_late", axis.kind)
        axis.record.late.append(t)
        raise Refusal(f"the time of the node passed {axis.count - at:.3f} s ago")
    is_first = not servo.path.interpolated
    if not is_first and at <= servo.path.known_until:
        raise Refusal("the time of the node is not after that of the node before")
    if len(servo.path.pieces) >= axis.settings.max_nodes:
        raise Refusal(f"the buffer holds {axis.settings.max_nodes} nodes")
    velocity = _clipped(axis, velocity)
    piece = servo.take(position, velocity, at, axis.settings.first_node)
    axis.record.take(piece, position, velocity, is_first=is_first)


def _clipped(axis: SimulatedController, velocity: float) -> float:
    most = axis.servo.limits.velocity
    if abs(velocity) > most:
        axis.sticky |= mask_of("velocity_limited", axis.kind)
    return min(max(velocity, -most), most)


def _offset(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    values = [float(value) for value in arguments]
    if not values:
        return ()
    offset, rate = values[0], values[1] if len(values) > 1 else 0.0
    if len(values) == 3:
        offset += rate * (axis.count - axis.clock.count_at(values[2], axis.count))
    axis.servo.shift(offset, rate)
    return ()


def _step(sign: float, axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    count = float(arguments[0]) if arguments else 1.0
    axis.servo.shift(sign * count * axis.step, 0.0)
    return ()


def _set_step(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    axis.step = float(arguments[0])
    return ()


def _drift(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    servo = axis.servo
    if not axis.is_halted:
        servo.follow(line(axis.count, servo.position, _clipped(axis, servo.velocity)))
    return (_place(axis),)


def _init(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    axis.servo.brake()
    axis.sticky = 0
    axis.needs_init = axis.is_halted
    return ()


def _stop(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    axis.servo.brake(abruptly=True)
    return ()


def _stow(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    axis.servo.follow(line(axis.count, axis.hardware.stow_deg))
    return ()


def _reset(axis: SimulatedController, _arguments: _Arguments, t: float) -> _Lines:
    axis.restart(t)
    return ()


# Position and limits -----------------------------------------------------------------------------------------------


def _set_position(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    if not axis.servo.stopped:
        raise Refusal("the axis moves")
    axis.believe(float(arguments[0]) if arguments else 0.0)
    return ()


def _limits(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    limits = axis.servo.limits
    if not arguments:
        return _told(axis, f"{limits.lowest:.7f} {limits.highest:.7f}")
    limits.lowest, limits.highest = sorted(float(value) for value in arguments)
    axis.servo.look()
    return ()


def _max_velocity(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    limits = axis.servo.limits
    if not arguments:
        return _told(axis, f"{limits.velocity:.5f}")
    limits.velocity = min(abs(float(arguments[0])), axis.hardware.velocity)
    axis.servo.look()
    return ()


def _told(axis: SimulatedController, setting: str) -> _Lines:
    if not axis.settings.tells_settings:
        raise Refusal("an argument is missing")
    return (setting,)


def _output(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    if not arguments:
        return (str(axis.output_limit),)
    axis.output_limit = int(arguments[0])
    return ()


# Fiducials ---------------------------------------------------------------------------------------------------------


def _corrections_on(axis: SimulatedController, _arguments: _Arguments, t: float) -> _Lines:
    axis.fiducials.switch(on=True)
    return () if axis.fiducials.too_large else _correct(axis, (), t)


def _corrections_off(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    if arguments:
        axis.fiducials.off_at = axis.clock.count_at(float(arguments[0]), axis.count)
    else:
        axis.fiducials.switch(on=False)
    return ()


def _correct(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    if correction := axis.fiducials.take_saved():
        axis.learn(correction)
        axis.servo.look()
    return ()


def _dump(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    rows = (
        f"{axis.clock.posix(count):.3f} {position:.6f} {velocity:.6f} {error:.6f} {int(edge)} {correction:.6f}"
        for count, position, velocity, error, edge, correction in axis.fiducials.passages
    )
    return ("time position velocity error edge correction", *rows)


# Status and the rest -----------------------------------------------------------------------------------------------


def _status(axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    text = f"{_place(axis)} {axis.status_word().value} {axis.index:.7f}"
    if axis.kind == "sdss":
        axis.sticky = 0
    return (text,)


def _place(axis: SimulatedController) -> str:
    return f"{axis.servo.position:.7f} {axis.servo.velocity:.5f} {axis.clock.reading(axis.count):.3f}"


def _set_time(axis: SimulatedController, _arguments: _Arguments, t: float) -> _Lines:
    if axis.kind == "sdss":
        axis.clock.set(t)
    return ()


def _identify(_axis: SimulatedController, _arguments: _Arguments, _t: float) -> _Lines:
    return (VERSION,)


def _log(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    axis.logged.append(str(arguments[0]))
    return ()


def _debug(axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    axis.debug = str(arguments[0]).lower() == "on"
    return ()


def _help(_axis: SimulatedController, arguments: _Arguments, _t: float) -> _Lines:
    rows = [row_of(str(arguments[0]))] if arguments else TABLE
    return [f"{' | '.join((row.name, *row.aliases))}: {row.effect}" for row in rows]


_HANDLERS: Mapping[str, Callable[[SimulatedController, _Arguments, float], _Lines]] = MappingProxyType(
    {
        "+": partial(_step, +1.0),
        "-": partial(_step, -1.0),
        "STEP": _set_step,
        "DEBUG": _debug,
        "DRIFT": _drift,
        "HELP": _help,
        "ID": _identify,
        "INIT": _init,
        "LOG": _log,
        "MAXV": _max_velocity,
        "MOVE": _move,
        "+MOVE": _offset,
        "MS.DUMP": _dump,
        "MS.OFF": _corrections_off,
        "MS.ON": _corrections_on,
        "CORRECT": _correct,
        "OUTPUT.LIMIT": _output,
        "P": _stow,
        "RESET": _reset,
        "SET.LIMITS": _limits,
        "SET.POSITION": _set_position,
        "SET.TIME": _set_time,
        "STATUS": _status,
        "STOP": _stop,
        "ZERO": _set_position,
    }
)
