"""The calls that every door offers: the control socket, and the command line when it is the owner itself.

Arguments and results are plain values, as they travel in JSON; the command line prints the results as they are.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from clockdrive.alignment_calls import alignment_calls
from clockdrive.commission.calls import commission_calls
from clockdrive.drive_registers import drive_calls
from clockdrive.errors import InputError
from clockdrive.rotating import OPTIONS
from clockdrive.run_calls import run_calls
from clockdrive.slewing import Progress
from clockdrive.telescope import Telescope
from mounts.errors import StillMoving

Emit = Callable[[Mapping[str, object]], object]


class Service:
    """A telescope's calls by name.

    Parameters
    ----------
    telescope : Telescope
        Whose calls they are.
    """

    def __init__(self, telescope: Telescope) -> None:
        self._telescope = telescope
        self._calls: dict[str, Callable[[dict[str, Any], Emit], object]] = {
            **alignment_calls(telescope),
            "centre": self._centre,
            **commission_calls(telescope),
            "clear": lambda args, _: _done(lambda: telescope.clear(args["correction"])),
            **drive_calls(telescope),
            **run_calls(telescope),
            "drive_at": lambda args, emit: (
                telescope.drive_at(args["deg_s"][0], args["deg_s"][1], args["seconds"], _reported(emit)).json
            ),
            "flip": lambda _, emit: telescope.flip(_reported(emit)).json,
            "goto": lambda args, emit: telescope.goto(args["target"], _reported(emit), **_wishes(args)).json,
            "guide": self._guide,
            "home": lambda _, emit: telescope.home(_reported(emit)).json,
            "instrument": lambda args, emit: telescope.instrument(args.get("instrument"), _reported(emit)).json,
            "jog": lambda args, emit: (
                telescope.jog(args["axis"], args["deg_s"], args["seconds"], _reported(emit)).json
            ),
            "offset": lambda args, _: _done(lambda: telescope.offset(args["east_arcsec"], args["north_arcsec"])),
            "park": lambda _, emit: telescope.park(_reported(emit)).json,
            "plan": lambda args, _: telescope.plan(args["target"], args.get("at"), **_wishes(args)).json,
            "power": lambda args, _: _done(lambda: telescope.power(on=args["on"])),
            "rates": lambda args, _: telescope.rates(args["target"], args.get("at"), **_wishes(args)).json,
            "registers": lambda _args, _: {"ok": True, "registers": telescope.registers()},
            "status": lambda _args, _: telescope.status().json,
            "stop": lambda _args, _: _stopped(telescope),
            "sync": self._sync,
            "unpark": lambda _args, _: {"ok": True, "was_parked": telescope.unpark()},
        }

    def __call__(self, name: str, args: dict[str, Any], emit: Emit) -> object:
        """Do one call; progress goes to `emit`.

        Raises
        ------
        InputError
            There is no such call, or an argument is missing.
        """
        if name not in self._calls:
            raise InputError(f"no call {name!r}; there is {', '.join(self._calls)}")
        try:
            return self._calls[name](args, emit)
        except KeyError as missing:
            raise InputError(f"the call {name!r} needs the argument {missing}") from missing

    def _centre(self, args: dict[str, Any], emit: Emit) -> Mapping[str, object]:
        force = bool(args.get("force"))
        return self._telescope.centre(args["place"], args.get("at"), _reported(emit), force=force).json

    def _guide(self, args: dict[str, Any], _: Emit) -> dict[str, object]:
        east, north = self._telescope.guide(args["direction"], args["milliseconds"])
        return {"ok": True, "guide": {"east_arcsec": east, "north_arcsec": north}}

    def _sync(self, args: dict[str, Any], _: Emit) -> dict[str, object]:
        force = bool(args.get("force"))
        axes: list[float] = []
        if args.get("target"):
            axes = list(self._telescope.sync_axes(args["target"], args.get("posture"), force=force))
            moved = max(map(abs, axes))
        else:
            angle, lies = args["rotator_angle_deg"], args["position_angle_deg"]
            moved = self._telescope.sync_rotator(angle, position_angle_deg=lies, force=force)
        noted = next((event.text for event in self._telescope.events(10) if event.kind == "sync"), "")
        return {
            "ok": True,
            "moved_deg": moved,
            "moved_arcsec": moved * 3600.0,
            "axes_moved_arcsec": [each * 3600.0 for each in axes],
            "noted": noted,
        }


def _wishes(args: dict[str, Any]) -> dict[str, Any]:
    """Rates of one's own, and what the rotator is to hold, where a call has them."""
    return {name: args.get(name) for name in ("rate_arcsec_s", "rate_from", *OPTIONS)}


def _stopped(telescope: Telescope) -> dict[str, object]:
    """Stop; what a drive without a stop says is an answer, as nothing more can be done."""
    try:
        telescope.stop()
    except StillMoving as moving:
        return {"ok": True, "note": str(moving)}
    return {"ok": True}


def _done(work: Callable[[], None]) -> dict[str, object]:
    work()
    return {"ok": True}


def _reported(emit: Emit) -> Callable[[Progress], None]:
    def report(progress: Progress) -> None:
        emit(
            {
                "target": progress.target,
                "remaining_s": progress.remaining_s,
                "eta_s": progress.eta_s if math.isfinite(progress.eta_s) else None,
                "counts": list(progress.counts),
                "waiting": str(progress.waiting) if progress.waiting else None,
            }
        )

    return report
