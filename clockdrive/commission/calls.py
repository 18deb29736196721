"""The calls of a commissioning as they travel in JSON, for the control socket and the command line alike."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from mounts.commissioning import Finding

if TYPE_CHECKING:
    from clockdrive.commission import Stage
    from clockdrive.telescope import Telescope

Emit = Callable[[Mapping[str, object]], object]
Call = Callable[[dict[str, Any], Emit], object]


def commission_calls(telescope: "Telescope") -> dict[str, Call]:
    """`commission`, with arguments `only`, `witness` and `written`; and `reply` to what it asks."""

    def commission(args: dict[str, Any], emit: Emit) -> object:
        found = telescope.commission(
            args.get("only") or (),
            args.get("witness") or "encoders",
            lambda stage: emit(_stage(stage)),
            written=args.get("written"),
            ask=lambda what: emit({"ask": what}),
        )
        return {"ok": True, "findings": _rows(found), "changes": changes(found)}

    def reply(args: dict[str, Any], _: Emit) -> object:
        telescope.reply(args["text"])
        return {"ok": True}

    return {"commission": commission, "reply": reply}


def changes(findings: Sequence[Finding]) -> dict[str, object]:
    """What the configuration must say instead, by dotted key."""
    return {each.key: each.found for each in findings if each.changes}


def _stage(stage: "Stage") -> dict[str, object]:
    step = stage.step
    row: dict[str, object] = {
        "step": step.name,
        "finds": step.finds,
        "bound_deg": step.bound_deg,
        "number": stage.number,
        "of": stage.of,
    }
    return row if stage.findings is None else row | {"findings": _rows(stage.findings)}


def _rows(findings: Sequence[Finding]) -> list[dict[str, object]]:
    plain = (str, int, float, bool, type(None))
    return [
        {name: value if isinstance(value, plain) else str(value) for name, value in asdict(each).items()}
        for each in findings
    ]
