"""What is known of a telescope under control, what it does, and what is remembered of it."""

import logging
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from clockdrive.errors import Refused, StateError
from clockdrive.history import History
from clockdrive.left_alone import LeftAlone, unheld
from clockdrive.resting import Holding
from clockdrive.safety import Guard
from clockdrive.state import Activity, Event, Position, StateStore
from clockdrive.surroundings import Surroundings
from mounts.drive import Drive, Reading
from pointing.planner import Planner
from transports.link import Clock

if TYPE_CHECKING:
    from clockdrive.pursuit import Pursuit
    from clockdrive.waiting import Waiting
    from pointing.rotator import Hold
    from pointing.targets import Target

_LOG = logging.getLogger(__name__)
AT_REST = frozenset({"idle", "parked"})
MOVING = frozenset({"slewing", "jogging", "waiting"})
"""What a command does that another must not begin in."""
IDLE_PERIOD_S = 2.0  # from one look to the next
LEFT_ALONE_S = 60.0  # after which it is looked for again


class Account:
    """What a session knows; see `Session`."""

    def __init__(
        self,
        planner: Planner,
        drive: Drive,
        store: StateStore,
        clock: Clock,
        after_reading: Callable[[], None] = lambda: None,
        surroundings: Surroundings | None = None,
    ) -> None:
        self.planner = planner
        self.drive = drive
        self.store = store
        self.clock = clock
        self._after_reading = after_reading
        self.surroundings = surroundings or Surroundings(planner, clock)
        self.pursuit: Pursuit | None = None
        self.wanted: Target | None = None  # what is or was last pursued, as it was asked for
        self.wanted_since = -math.inf
        self.hold: Hold | None = None  # what the rotator was asked to hold at the last goto; None as configured
        self.begun: Activity | None = None  # the last slew, jog or waiting
        self.waiting: Waiting | None = None  # as long as it does
        self.history = History()
        self.doing = self._at_rest()
        self.reading: Reading | None = None
        self._trusted: Reading | None = None  # the last that could be
        self.link_lost_since: float | None = None
        self.trouble = ""
        self.sun_warning = ""  # as long as its zone is near to where the telescope looks, and nothing moves it away
        self._opened = -math.inf
        self._holding = Holding(planner)  # of a drive that cannot stop tracking
        self.held_unplaced = ""  # how, by a drive that holds what nobody knows the place of
        self._must_stop = False
        self._unstopped_because = ""
        self._others_stopped = False  # at the last reading
        self._period = IDLE_PERIOD_S  # to the next reading
        self.guard = Guard(planner)
        self._left_alone: LeftAlone | None = None

    def note(self, kind: str, text: str) -> None:
        """Write into the history; one that cannot be written must not keep the telescope from being stopped."""
        with self._unwritten():
            self.store.record_event(Event(self.clock.now(), kind, text))

    def now_doing(self, doing: str, detail: str = "") -> None:
        """Say what the telescope does from now on."""
        self.doing = doing
        if doing in AT_REST:
            self.store.end_activity()
        else:
            self.store.begin(Activity(doing, self.clock.now(), detail=detail))

    def begin(self, activity: Activity) -> None:
        """Begin a slew; it is on the disk before anything moves."""
        self.store.begin(activity)
        self.pursuit, self.trouble, self.doing = None, "", activity.kind
        self.begun, self.waiting = activity, None
        self.surroundings.stepped = self.sun_warning = ""  # what they said was of the last target

    def taken(self, reading: Reading) -> Reading:
        """Take note of a reading, here and in the store."""
        was_held, self.reading = not self.unheld, reading
        if was_held and self.unheld:
            self.note("not held", self.unheld)
        self.history.add(reading)
        if not reading.unsynchronised:
            self._trusted = reading
        uncertainty = reading.axes[0].uncertainty_counts, reading.axes[1].uncertainty_counts
        with self.store.together():
            self.store.record_position(Position(reading.time, reading.counts, uncertainty, reading.unsynchronised))
            self.remember()
            self._after_reading()
        return reading

    def remember(self) -> None:
        """Keep what the drive must be given back."""
        self.store.learn("drive", self.drive.memory, self.clock.now())

    @property
    def target_name(self) -> str:
        """What is followed, slewn to or waited for; empty while there is nothing."""
        if self.pursuit is not None:
            return self.pursuit.target.name
        return self.begun.detail if self.begun is not None and self.doing in {"slewing", "waiting"} else ""

    @property
    def left_alone(self) -> LeftAlone | None:
        """What comes of a drive that tracks whatever it is told, when nobody holds it; None for one that stops.

        From where it was last known to be; None where that was never so since this program began.
        """
        reading, rate = self._trusted, self.drive.capabilities.goes_on_at
        if not rate or reading is None:
            return None
        if self._left_alone is None or not 0.0 <= reading.time - self._left_alone.time < LEFT_ALONE_S:
            self._left_alone = LeftAlone.of(self.planner, reading, rate)
        return self._left_alone

    @property
    def unheld(self) -> str:
        """What comes of a drive that tracks on while nobody knows where it is, held or not; or nothing."""
        reading = self.reading
        if not self.drive.capabilities.goes_on_at or reading is None or not reading.unsynchronised:
            return ""
        if self.held_unplaced:
            return self.held_unplaced
        return unheld(self.left_alone, self.clock.now())

    @property
    def trusted_counts(self) -> tuple[float, float] | None:
        """Where the axes were when that was last known."""
        return None if self._trusted is None else self._trusted.counts

    @property
    def warnings(self) -> tuple[str, ...]:
        """What stands and a person must act on."""
        return tuple(text for text in (self.sun_warning, self.surroundings.stepped, self.unheld) if text)

    def synchronised(self) -> Reading:
        """The last reading, if its position can be trusted.

        Raises
        ------
        Refused
            It cannot; says why.
        """
        reading = self.reading
        if reading is None:
            raise Refused("the drive has not answered yet; try again in a moment")
        if reading.unsynchronised:
            raise Refused(f"the position is not synchronised: {reading.unsynchronised}")
        return reading

    def _at_rest(self) -> str:
        return "parked" if self.store.parked() else "idle"

    @contextmanager
    def _unwritten(self) -> Iterator[None]:
        """Log what the store cannot take."""
        try:
            yield
        except StateError as error:
            _LOG.error("not remembered: %s", error)
