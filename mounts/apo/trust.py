"""Whether the positions of the controllers can be believed, and what must be remembered for that.

A controller keeps its position without the host. It may lose it when it restarts: then it must have stood, and stand
where it was last seen, else the position is unsynchronised until `sync`.
"""

from collections.abc import Mapping, Sequence

from mounts.apo.axis import STANDS_DEG_S, Sight
from mounts.apo.settings import ApoSettings

_STOOD_DEG = 1e-3  # within which an axis stands where it stood
_REACH = 1.1  # times its top speed, by which an axis can have been moved while nobody looked
REINTERPRETED = "centre, direction or site of an axis changed since the last sync; `sync` on a known target"


class Trust:
    """What is believed of the positions.

    Parameters
    ----------
    memory : Mapping
        What `as_json` gave; empty for controllers never seen.
    settings : ApoSettings
        Their axes, and what their degrees mean.
    """

    def __init__(self, memory: Mapping[str, object], settings: ApoSettings) -> None:
        self._settings = settings
        self.unsynchronised = str(memory.get("unsynchronised", ""))
        if not self.unsynchronised and memory.get("meaning", settings.meaning) != settings.meaning:
            self.unsynchronised = REINTERPRETED
        self._position = numbers(memory.get("position"), len(settings.axes))
        self._rates = numbers(memory.get("rates"), len(settings.axes)) or (0.0,) * len(settings.axes)
        lost = memory.get("lost_axes")
        self.lost_axes: set[int] = set(lost) if isinstance(lost, list) else set()
        """Axes whose position is not known."""
        self.unsure = list(numbers(memory.get("unsure"), len(settings.axes)) or (0.0,) * len(settings.axes))
        """Degrees by which each axis may be off since its controller restarted, though it is where it stood."""
        time = memory.get("time")
        self._time = float(time) if isinstance(time, int | float) else 0.0

    def as_json(self) -> dict[str, object]:
        """What must be remembered."""
        return {
            "unsynchronised": self.unsynchronised,
            "meaning": self._settings.meaning,
            "position": list(self._position or ()),
            "rates": list(self._rates),
            "lost_axes": sorted(self.lost_axes),
            "unsure": list(self.unsure),
            "time": self._time,
        }

    def seen(self, time: float, position: Sequence[float], rates: Sequence[float]) -> None:
        """Take note of where the axes are."""
        self._time, self._position, self._rates = time, tuple(position), tuple(rates)

    def restarted(self, axis: int, sight: Sight, *, led: bool, surely: bool = True) -> None:
        """Judge the position of a controller that has restarted since it was last seen, or may have: not `surely`.

        One that stood where it stands has kept it, or lost as little as it is elsewhere. Of one that moved, or was
        `led` somewhere, nobody can tell.
        """
        has = f"{self._settings.axes[axis].name}: its controller {'has' if surely else 'may have'} restarted"
        if self._position is None:
            self.lose_axis(axis, f"{has} and was never seen before; `sync` on a target")
        elif led or abs(self._rates[axis]) >= STANDS_DEG_S:
            self.lose_axis(axis, f"{has} while the axis moved; `sync` on a target")
        elif (moved := abs(sight.position - self._position[axis])) > _STOOD_DEG:
            self.lose_axis(
                axis,
                f"{has} at {sight.position:.4f}°, {moved:.4f}° from where it was last seen; `sync` on a target",
            )
        else:
            self.unsure[axis] += moved

    def found(self, axis: int, sight: Sight) -> None:
        """Judge the position of an axis that was not looked at since it was driven last: whether it can be there."""
        if self._position is None or axis in self.lost_axes:
            return
        settings, away = self._settings.axes[axis], max(sight.time - self._time, 0.0)
        moved = abs(sight.position - self._position[axis])
        if moved > _STOOD_DEG + settings.max_speed_deg_s * _REACH * away:
            self.lose_axis(
                axis,
                f"{settings.name}: its controller says {sight.position:.4f}°, {moved:.4f}° from where it was "
                f"seen last {away:.0f} s ago, farther than it can have come; `sync` on a target",
            )

    def lose_axis(self, axis: int, why: str) -> None:
        """The position of one axis may be wrong."""
        self.lost_axes.add(axis)
        self.lose(why)

    def lose(self, why: str) -> None:
        """The position may be wrong."""
        self.unsynchronised = why

    def set_by_hand(self, axis: int) -> None:
        """A person has set the position of an axis: it may be wrong, but a rotator's is what they say."""
        if axis > 1:
            self.declared(axis)
        else:
            self.lose(f"{self._settings.axes[axis].name}: its position was changed by hand; `sync` on a target")

    def declared(self, axis: int) -> None:
        """The position of one axis is right from now on; so are all, where it alone was in doubt."""
        self.lost_axes.discard(axis)
        self.unsure[axis] = 0.0
        if not self.lost_axes and self.unsynchronised.startswith(f"{self._settings.axes[axis].name}: "):
            self.unsynchronised = ""

    def synchronised(self, axes: int) -> None:
        """The position of the first so many axes is right from now on; the sky tells nothing of a rotator."""
        self.lost_axes -= set(range(axes))
        self.unsure[:axes] = [0.0] * len(self.unsure[:axes])
        self.unsynchronised = ""


def numbers(kept: object, count: int) -> tuple[float, ...] | None:
    """So many numbers as they were remembered; None where they were not."""
    if not isinstance(kept, list) or len(kept) != count:
        return None
    return tuple(float(each) for each in kept)
