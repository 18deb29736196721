"""The calls of a polar alignment as they travel in JSON; the owner keeps the alignment from one to the next."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from clockdrive.errors import Refused

if TYPE_CHECKING:
    from clockdrive.alignment import Alignment
    from clockdrive.telescope import Telescope

Emit = Callable[[Mapping[str, object]], object]
Call = Callable[[dict[str, Any], Emit], object]
_OPTIONS = ("witness", "pole", "goal_arcsec", "scatter_arcsec", "settle_s")


def alignment_calls(telescope: "Telescope") -> dict[str, Call]:
    """`polar_begin`, with the arguments of `Telescope.polar_alignment`; `polar_look`; `polar_anew`; `polar_write`."""
    kept: list[tuple[Alignment, list[Emit]]] = []  # the one under way, and who listens to it

    def current(emit: Emit) -> "Alignment":
        if not kept:
            raise Refused("no polar alignment has begun: `polar-align` looks at three stars first")
        alignment, listeners = kept[-1]
        listeners[:] = [emit]
        return alignment

    def begin(args: dict[str, Any], emit: Emit) -> object:
        given = {name: args[name] for name in _OPTIONS if args.get(name) is not None}
        listeners = [emit]
        alignment = telescope.polar_alignment(
            **given,
            report=lambda text: listeners[-1]({"told": text}),
            ask=lambda what: listeners[-1]({"ask": what}),
        )
        kept[:] = [(alignment, listeners)]  # one that could not begin leaves the one under way
        return alignment.state.json

    def look(args: dict[str, Any], emit: Emit) -> object:
        turned, another = bool(args.get("turned", True)), bool(args.get("another"))
        return current(emit).look(turned=turned, another=another).json

    def anew(_args: dict[str, Any], emit: Emit) -> object:
        return current(emit).anew().json

    def write(_args: dict[str, Any], emit: Emit) -> object:
        x_mas, y_mas = current(emit).write_mount()
        kept.clear()
        return {"ok": True, "mount_x_mas": x_mas, "mount_y_mas": y_mas}

    return {"polar_begin": begin, "polar_look": look, "polar_anew": anew, "polar_write": write}
