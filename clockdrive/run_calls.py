"""The call of a pointing run as it travels in JSON, for the control socket and the command line alike."""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clockdrive.observing import RunProgress
    from clockdrive.telescope import Telescope

Emit = Callable[[Mapping[str, object]], object]
Call = Callable[[dict[str, Any], Emit], object]
_OPTIONS = {"run": "name", **{name: name for name in ("stars", "resume", "append", "bright", "settle_s")}}


def run_calls(telescope: "Telescope") -> dict[str, Call]:
    """`pointing_run`, with the arguments of `Telescope.pointing_run`, of which `name` is `run` here, and two more.

    `fit` false leaves the fit to the caller, who asks `run_frame` for what it must be fitted. `reply` answers what a
    run asks. `try_witness` looks once where the telescope rests. `use_model` takes the path of a model file, or None.
    """

    def pointing_run(args: dict[str, Any], emit: Emit) -> object:
        from clockdrive.run_report import run_json  # noqa: PLC0415 - the mathematics takes 0.2 s to load
        from clockdrive.run_taking import RunSettings  # noqa: PLC0415 - likewise

        given = {option: args[name] for name, option in _OPTIONS.items() if args.get(name) is not None}
        name = telescope.take_run(
            RunSettings(**given),
            args.get("witness") or "simulator",
            lambda progress: emit(_told(progress)),
            lambda what: emit({"ask": what}),
        )
        if args.get("fit", True):
            return telescope.runs.report(name).json
        return {"ok": True, "run": run_json(telescope.runs[name])}

    def run_frame(_args: dict[str, Any], _: Emit) -> object:
        return {"ok": True, **telescope.runs.frame}

    def try_witness(args: dict[str, Any], emit: Emit) -> object:
        return telescope.try_witness(args.get("witness") or "simulator", ask=lambda what: emit({"ask": what}))

    def use_model(args: dict[str, Any], _: Emit) -> object:
        telescope.use_model(args["model"])
        return {"ok": True}

    return {"pointing_run": pointing_run, "run_frame": run_frame, "try_witness": try_witness, "use_model": use_model}


def _told(progress: "RunProgress") -> dict[str, object]:
    return {
        "number": progress.number,
        "of": progress.of,
        "azimuth_deg": math.degrees(progress.place.azimuth) % 360.0,
        "altitude_deg": math.degrees(progress.place.altitude),
        "posture": progress.place.posture,
        "star": progress.place.name,
        "state": progress.state,
        "detail": progress.detail,
        "observed": progress.observed,
        "skipped": progress.skipped,
        "run": progress.run,
        "minutes_left": progress.minutes_left,
    }
