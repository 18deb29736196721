"""The telescope as the steps of a commissioning use it: moves within a bound, looks at a witness and at the encoders.

Every move is planned, so limits, horizon and Sun are asked of its path, and every reading on the way passes the
session's safety rules. A step is begun only where its whole bound is allowed to both sides: which way an axis turns
may be what it is about to find out.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from clockdrive.configuration import Configuration
from clockdrive.control import Steps
from clockdrive.errors import Refused
from clockdrive.session import Session
from clockdrive.state import Activity
from clockdrive.witness import Sighting, SkyWitness, WitnessError
from mounts.commissioning import Encoder, Move, Step
from mounts.drive import AxisSlew, Drive, Reading
from pointing.errors import Unreachable
from pointing.limits import separation
from pointing.plan import Plan, Timing

_PERIOD_S = 0.2
_RAMP_PERIOD_S = 0.05  # while the axes speed up, which shows their acceleration
_RAMP_S = 2.0
_LANDING_PERIOD_S = 0.02
_LANDING_WINDOW_S = 0.4
_LATE_S = 3.0  # beyond which a landing is waited for at leisure
_LINK_LOST_S = 15.0
_STOPPED_S = 10.0
_FAR_OFF = math.radians(10.0)  # beyond which a witness and the position cannot both be right

Encoders = Callable[[], tuple[Encoder | None, Encoder | None]]


class Impossible(Exception):  # noqa: N818 - what a step finds
    """A step cannot be done here and now; the text says why and what to do."""


@dataclass(frozen=True)
class Seen:
    """One look at everything: positions in counts, axis angles on the sky in degrees, encoders."""

    counts: tuple[float, float]
    sky_deg: tuple[float, float] | None
    sigma_arcsec: float
    encoders: tuple[Encoder | None, Encoder | None]


class CommissioningBench:
    """A session's telescope while it is commissioned; keeps `mounts.commissioning.Bench`.

    Parameters
    ----------
    session : Session
        Reads, checks and stops it.
    configuration : Configuration
        What is compared.
    witness : SkyWitness or None
        Tells where the telescope points, if anyone does.
    encoders : callable
        Reads the absolute encoders.
    written : mapping
        Values of the configuration file where the telescope was opened with others.
    """

    def __init__(
        self,
        session: Session,
        configuration: Configuration,
        witness: SkyWitness | None,
        encoders: Encoders,
        written: dict[str, object],
    ) -> None:
        self.session = session
        self._configuration = configuration
        self.witness = witness
        self.encoders = encoders
        self._written = written
        self.scales = [1.0, 1.0]
        """True over configured size of a move, above 1, once it is known; moves are made so much smaller."""
        self.encoder_words: tuple[set[int], set[int]] = (set(), set())
        self.encoder_senses: list[tuple[float, float] | None] = [None, None]
        self.position_errors_deg: tuple[float | None, float | None] = (None, None)
        self._step: Step | None = None
        self._origin = (0.0, 0.0)
        self.moved = False
        """Whether the step has moved away from its origin."""
        self.stopped_at = 0.0
        """When the last `halt` had reached the drive."""

    @property
    def drive(self) -> Drive:
        """The drive."""
        return self.session.drive

    def configured(self, dotted: str) -> Any:  # noqa: ANN401 - any kind of value
        """The value of a configuration key."""
        return self._written.get(dotted, self._configuration.values[dotted])

    def has_encoder(self, axis: int) -> bool:
        """Whether an axis can have an absolute encoder that is seen beside its position."""
        return f"axis{axis + 1}.encoder_bits" in self._configuration.values

    def counts_per_deg(self, axis: int) -> float:
        """Counts of a degree of axis 0 or 1 by the configured gears."""
        return 1.0 / self.session.planner.axes[axis].gearing.step_deg_float

    def encoder_sense(self, axis: int) -> tuple[float, float] | None:
        """Encoder turns for one count, with sign, and the relative uncertainty, once measured."""
        return self.encoder_senses[axis]

    def position_error_deg(self, axis: int) -> float | None:
        """How far the sky was seen from the position, degrees of axis 0 or 1; None where nobody saw it."""
        return self.position_errors_deg[axis]

    # Beginning -------------------------------------------------------------------------------------------------

    def begin(self, step: Step) -> None:
        """Make sure that a step may be done here, and take this place as its origin.

        Raises
        ------
        Impossible
            Its bound does not fit into the limits, or the position is not to be trusted.
        """
        self._step, self.moved = step, False
        if not step.moves:
            return
        self.session.poll()
        reading = self.session.reading
        if reading is None:
            raise Impossible("the drive does not answer; check the link")
        if reading.unsynchronised:
            raise Impossible(
                f"nothing is moved while the position is not synchronised ({reading.unsynchronised}): limits, "
                "horizon and Sun could not be kept. A rough `sync` on a bright star is enough"
            )
        self._origin = self.session.planner.angles(self.session.start().counts)
        self._require_room(step)

    def _require_room(self, step: Step) -> None:
        """Plan to all corners of the step's bound; where one axis moves at a time, to the ends of each alone."""
        start, timing = self.session.start(), self.session.timing()
        bound, needs = math.radians(step.bound_deg), f"`{step.name}` needs {step.bound_deg:g}° to all sides"
        for signs in product((-1.0, 0.0, 1.0), repeat=2):
            if all(signs) and not step.together:
                continue
            angles = self._origin[0] + signs[0] * bound, self._origin[1] + signs[1] * bound
            try:
                self.session.planner.plan_axes("its bound", angles, start, timing)
            except Unreachable as error:
                raise Impossible(f"{needs}, and {error}; `goto` a freer place and run it again") from error

    # Moving ----------------------------------------------------------------------------------------------------

    def move(self, move: Move) -> Steps[list[Reading]]:
        """Go to a place within the step's reach; return the readings on the way.

        Raises
        ------
        Refused, Unreachable, DriveError, TransportError
            A safety rule, the drive or the link ends it; the telescope was stopped.
        """
        session, step = self.session, self._step
        if step is None or not step.reaches(move):
            raise Refused(f"a move to {move.offsets_deg}° is beyond the reach of this step")
        session.poll()
        tops = [None if move.top_deg_s is None else move.top_deg_s * self.counts_per_deg(i) for i in (0, 1)]
        plan = self._planned(step.name, move.offsets_deg, tops)
        one, two = plan.axes
        session.begin(
            Activity(
                "commissioning",
                plan.start,
                plan.arrival,
                (one.from_counts, two.from_counts),
                (one.target_counts, two.target_counts),
                step.name,
            )
        )
        self.moved = True
        slews = [
            AxisSlew(axis.target_counts, rate * self.counts_per_deg(i), tops[i])
            for i, (axis, rate) in enumerate(zip(plan.axes, move.rates_after_deg_s, strict=True))
        ]
        began = session.drive.start(slews, session.clock.now())
        session.remember()
        if move.until_s is not None:
            return (yield from self._stopped_at(began + move.until_s))
        readings = yield from self._landing(plan)
        if not any(move.rates_after_deg_s):
            self._require_landed(plan, readings[-1])
        return readings

    def rest(self) -> None:
        """Say that nothing moves any more."""
        self.session.drive.stop(self.session.clock.now())
        self.session.now_doing("idle")

    def wait(self, seconds: float) -> Steps[list[Reading]]:
        """Let the drive go on as it does, for a time."""
        end = self.session.clock.now() + seconds
        readings = []
        while self.session.clock.now() < end:
            yield _PERIOD_S
            reading = self._polled()
            if reading is not None:
                readings.append(reading)
        return readings

    def halt(self) -> Steps[list[Reading]]:
        """Stop, and watch until the axes rest; the first reading is the last before the stop."""
        session = self.session
        before = self._polled()
        readings = [before] if before is not None else []
        session.drive.stop(session.clock.now())
        self.stopped_at = session.clock.now()
        end = self.stopped_at + _STOPPED_S
        while session.clock.now() < end:
            yield _LANDING_PERIOD_S
            reading = self._polled()
            if reading is None:
                continue
            readings.append(reading)
            if len(readings) > 2 and readings[-1].counts == readings[-2].counts:
                session.now_doing("idle")
                return readings
        raise Impossible(f"the axes still move {_STOPPED_S:g} s after the stop; use the drive's own switch")

    def _planned(self, name: str, offsets_deg: Sequence[float], tops: Sequence[float | None]) -> Plan:
        session = self.session
        timing = _limited(session.timing(), tops)
        one, two = (
            origin + math.radians(offset) / scale
            for origin, offset, scale in zip(self._origin, offsets_deg, self.scales, strict=True)
        )
        return session.planner.plan_axes(f"commission {name}", (one, two), session.start(), timing)

    def _landing(self, plan: Plan) -> Steps[list[Reading]]:
        readings: list[Reading] = []
        while True:
            left = plan.arrival - self.session.clock.now()
            near = -_LATE_S < left < _LANDING_WINDOW_S
            ramping = self.session.clock.now() < plan.start + _RAMP_S
            yield _LANDING_PERIOD_S if near else min(_RAMP_PERIOD_S if ramping else _PERIOD_S, abs(left))
            reading = self._polled()
            if reading is None:
                continue
            readings.append(reading)
            if not any(axis.slewing for axis in reading.axes):
                break
        settled = self._polled()  # of the last reading the positions may be older than the flags
        return readings if settled is None else [*readings, settled]

    def _stopped_at(self, end: float) -> Steps[list[Reading]]:
        readings: list[Reading] = []
        while self.session.clock.now() < end or len(readings) < 2:
            yield min(_PERIOD_S, max(0.0, end - self.session.clock.now()))
            reading = self._polled()
            if reading is not None:
                readings.append(reading)
                if not any(axis.slewing for axis in reading.axes):
                    break
        readings += yield from self.halt()
        return readings

    def _polled(self) -> Reading | None:
        reading = self.session.poll()
        since = self.session.link_lost_since
        if reading is None and since is not None and self.session.clock.now() - since > _LINK_LOST_S:
            why = f"the drive has not answered for {_LINK_LOST_S:.0f} s; it ends its move by itself. Check the link"
            self.session.halt(why)
        return reading

    def _require_landed(self, plan: Plan, reading: Reading) -> None:
        for axis, setup, read in zip(plan.axes, self.session.planner.axes, reading.axes, strict=False):
            off = abs(read.counts - axis.target_counts)
            if off > setup.landed + read.uncertainty_counts + self.session.drive.capabilities.rests_within:
                far = f"{off:.5f}°" if setup.units == "degrees" else f"{off:.0f} counts"
                self.session.halt(f"{axis.name} ended {far} from where it was sent; check what blocks it")

    # Looking ---------------------------------------------------------------------------------------------------

    def look(self) -> Steps[Seen]:
        """See where the axes are by everything there is; the telescope rests.

        Raises
        ------
        WitnessError
            The witness fails, or contradicts the position by more than can be.
        """
        seen = self.glance()
        if self.witness is None:
            return seen
        sighting = yield from self.witness.look()
        return replace(seen, sky_deg=self._axis_angles(sighting, seen.counts), sigma_arcsec=sighting.sigma_arcsec)

    def glance(self) -> Seen:
        """See where the axes are by position and encoders alone; the telescope rests."""
        reading = self.session.synchronised()
        encoders = self.encoders()
        for words, encoder in zip(self.encoder_words, encoders, strict=True):
            if encoder is not None:
                words.add(encoder.word)
        return Seen(reading.counts, None, 0.0, encoders)

    def _axis_angles(self, sighting: Sighting, counts: tuple[float, float]) -> tuple[float, float]:
        planner = self.session.planner
        here = planner.observed(counts)
        apart = separation(here, sighting.observed)
        if not apart <= _FAR_OFF:
            raise WitnessError(
                f"the witness sees the telescope {math.degrees(apart):.1f}° from its position, at most "
                f"{math.degrees(_FAR_OFF):g}° can be explained; check time, site and image, or `sync` on what it sees"
            )
        believed = planner.angles(counts)
        one, two = planner.mount.axes(sighting.observed, planner.mount.posture(believed[1]))
        return tuple(  # type: ignore[return-value]  # two axes
            math.degrees(near + math.remainder(angle - near, math.tau))
            for angle, near in zip((one, two), believed, strict=True)
        )


def _limited(timing: Timing, tops: Sequence[float | None]) -> Timing:
    one, two = (
        model if top is None else model.limited(min(top, model.max_rate))
        for model, top in zip(timing.slew, tops, strict=True)
    )
    return replace(timing, slew=(one, two))
