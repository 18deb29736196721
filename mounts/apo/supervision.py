"""What the status words of the axes mean for the telescope: alarms, limits, and what a person should know."""

from collections.abc import Collection, Iterable, Sequence

from mounts.apo.axis import LIMITS, ControlledAxis, Sight

_NO_TROUBLE = frozenset({*LIMITS, "buffer_empty", "restarted"})
_OFF_DEG = 0.02  # by which an axis may be off its path before it is called so
_OFF_S = 0.05  # of its present speed, likewise


def alarms(axes: Iterable[ControlledAxis]) -> tuple[str, ...]:
    """The errors that stand, each with its axis; a limit is none."""
    return tuple(
        f"{axis.name} {_spoken(name)}" for axis in axes for name in axis.word.errors if name not in _NO_TROUBLE
    )


def warnings(axes: Iterable[ControlledAxis]) -> tuple[str, ...]:
    """The warnings since the last INIT, each with its axis."""
    return tuple(
        f"{axis.name} {_spoken(name)}" for axis in axes for name in axis.word.warnings if name not in _NO_TROUBLE
    )


def notes(axes: Sequence[ControlledAxis], lost: Collection[int]) -> tuple[str, ...]:
    """What a person should know of the axes: clocks that are off, warnings, rotators whose position is lost."""
    clocks = (
        f"{axis.name}: the controller's clock is {axis.offset.value:+.4f} s off; node times are corrected for it"
        for axis in axes
        if axis.offset.value and not axis.clock_trouble()
    )
    warned = (f"{text} since the last INIT" for text in warnings(axes))
    unknown = (
        f"{axes[i].name}: its position is not known, and the sky tells it by an image only: `sync --position-angle "
        "DEG` of a solved image, or `sync --rotator-angle DEG` read on its scale"
        for i in sorted(lost)
        if i > 1
    )
    return (*clocks, *warned, *unknown)


def limits(axes: Iterable[ControlledAxis]) -> tuple[str, ...]:
    """The limits reached now."""
    return tuple(
        f"{axis.name} {_spoken(name)}"
        for axis in axes
        if axis.sight is not None
        for name in LIMITS
        if axis.sight.word.has(name)
    )


def off_its_path(axis: ControlledAxis, sight: Sight) -> str:
    """By how much an axis is off the path it was given, in words; empty where it is on it, or has none."""
    expected = axis.queue.at(sight.time)
    if expected is None or not axis.queue.is_path:
        return ""
    off = abs(sight.position - expected[0])
    bound = _OFF_DEG + _OFF_S * abs(expected[1]) + sight.uncertainty
    if off <= bound:
        return ""
    return (
        f"{axis.name} is at {sight.position:.4f}°, its path at {expected[0]:.4f}°: more than {bound:.3f}° off; "
        "check what blocks it and its status bits, then `goto` again"
    )


def _spoken(name: str) -> str:
    return name.replace("_", " ")
