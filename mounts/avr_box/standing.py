"""What is known of the position of a box, and what was seen that a person should know."""

from collections.abc import Sequence

from mounts.avr_box.axis import BoxAxis

_NOTES = 5


class Standing:
    """Of both axes together.

    Parameters
    ----------
    axes : sequence of BoxAxis
        Make no further move once nobody knows where they are.
    unsynchronised : str
        Why nobody knows where they are; empty where that is known.
    """

    def __init__(self, axes: Sequence[BoxAxis], unsynchronised: str) -> None:
        self._axes = axes
        self.unsynchronised = unsynchronised
        self.runaways: tuple[str, ...] = ()
        """Alarms for axes that run on."""
        self.blind: set[int] = set()
        """The axes, 0 or 1, whose encoders see nothing."""
        self._events: list[str] = []

    @property
    def alarms(self) -> tuple[str, ...]:
        """What must be seen to before anything moves again."""
        return self.runaways + tuple(f"the encoder of axis {index + 1} stands still" for index in sorted(self.blind))

    @property
    def notes(self) -> tuple[str, ...]:
        """What was seen, the newest last."""
        return tuple(self._events[-_NOTES:])

    def given(self) -> None:
        """A person says where they are."""
        self.unsynchronised, self.runaways = "", ()
        self.blind.clear()

    def lose(self, why: str) -> None:
        """From here on nobody knows where they are."""
        self.abandon()
        self.unsynchronised = why
        self.note(why)

    def abandon(self) -> None:
        """Send no further piece of a slew."""
        for axis in self._axes:
            axis.abandon()

    def note(self, text: str) -> None:
        """Something was seen; said once where it is seen again and again."""
        if not self._events or self._events[-1] != text:
            self._events.append(text)
