"""How a simulated axis moves: the servo, which samples its path 20 times a second.

On its path the axis is exactly where the cubic is, between the frames too; a piece on which nothing can happen (no
limit, no fiducial) is therefore taken in one stride, and any other frame by frame.

A servo cannot do more than its axis can. What it does where a path asks for more, or jumps (A, the manual says only
which bits are set): it leaves the path, sets bit 4 or 5, and goes after it. It meets it by a cubic of at most 1.6 s
that is within velocity and acceleration; where there is none yet it goes with the largest of both, braking in time,
as it does for MOVE to a position. When it is farther behind an interpolated path than the axis may be, it gives up:
motion error on the 3.5 m, out of closed loop on the SDSS, and the axis brakes. Jerk is not limited. At a soft limit
the axis brakes so as to stand on it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, floor, inf, sqrt
from typing import Any, Literal

from mounts.apo.simulator_path import Path, Piece, joined, line, piece_of_state, piece_state
from mounts.apo.simulator_settings import AxisHardware

FRAME_S = 0.05
_STRIDE_S = 10.0  # of a line that never ends
_LANDINGS = (1, 2, 4, 8, 16, 32)  # frames in which the servo may meet its path
_BRAKING = 0.9  # share of the acceleration that is planned for braking
_ABRUPT = 5.0  # times the acceleration, when it stops like the stop button
_ON_PATH = 1e-9  # degrees, and degrees per second: rounding, 4 µas
_NEARBY = 1e-6  # degrees
_FITS = 1.0 + 1e-9
_ROUNDING_S = 1e-9

Mode = Literal["on path", "chasing", "landing", "braking"]


@dataclass
class Limits:
    """What the controller holds its axis to; degrees and seconds."""

    lowest: float
    highest: float
    velocity: float
    acceleration: float


class Servo:
    """The axis and what drives it.

    Parameters
    ----------
    hardware : AxisHardware
        What it may do.
    position : float
        Degrees at which it stands at count 0.
    crossed : callable
        Called with every motion that is over; returns whether it has displaced the axis.
    halts_on_expiry : bool
        Whether the axis brakes when the last node is past, rather than going on.
    """

    def __init__(
        self, hardware: AxisHardware, position: float, crossed: Callable[[Piece], bool], *, halts_on_expiry: bool
    ) -> None:
        self.limits = Limits(hardware.lowest_deg, hardware.highest_deg, hardware.velocity, hardware.acceleration)
        self.path = Path(line(0.0, position))
        self.position, self.velocity, self.now = position, 0.0, 0.0
        margin = hardware.switch_margin_deg
        self.switches = hardware.lowest_deg - margin, hardware.highest_deg + margin
        self.watched: tuple[float, ...] = ()  # positions at which something happens
        self.at_soft_limit = 0  # the side on which a soft limit stopped the axis
        self.happened: set[str] = set()  # names of status bits, for whoever collects them
        self.dry: list[float] = []  # times at which the last node was past
        self._hardware = hardware
        self._crossed = crossed
        self._halts = halts_on_expiry
        self._mode: Mode = "on path"
        self._excused = True  # the path jumped on purpose
        self._rate = 0.0  # of braking
        self._motion = line(0.0, position)

    # Time ------------------------------------------------------------------------------------------------------

    def run(self, count: float) -> None:
        """Move until this count; one already passed changes nothing."""
        while self._motion.end <= count:
            self._finish(self._motion.end)
            self._begin()
        if count > self.now and self._finish(count):
            self._begin()

    def look(self) -> None:
        """Look anew, after limits, switches or position have changed."""
        self._begin()

    @property
    def moving(self) -> bool:
        """Whether the axis moves, or is about to."""
        return self.velocity != 0.0 or self._mode != "on path" or self.path.interpolated

    @property
    def stopped(self) -> bool:
        """Whether it stands still and nothing moves it."""
        return not self.moving and self.path.tail.velocity == 0.0

    def _finish(self, end: float) -> bool:
        """Move to `end` of the present motion; return whether something on the way displaced the axis."""
        motion, begun = self._motion, self.now
        self.position, self.velocity = motion.at(end)
        self.now = end
        return self._crossed(Piece(begun, end, *motion.at(begun), *_derivatives(motion, begun)))

    # Commands --------------------------------------------------------------------------------------------------

    def follow(self, tail: Piece) -> None:
        """Drop all nodes, and follow a line."""
        self.path = Path(tail)
        self._mode, self._excused, self.at_soft_limit = "chasing", True, 0
        self._begin()

    def take(self, position: float, velocity: float, time: float, first: Literal["wait", "join"]) -> Piece:
        """Take a node; return the piece that ends in it."""
        if self._mode == "braking":
            self.path = Path(line(self.now, self.position + self.velocity * abs(self.velocity) / (2.0 * self._rate)))
            self._mode = "chasing"
        piece = self.path.append(self.now, position, velocity, time, first)
        self.at_soft_limit = 0
        self._begin()
        return piece

    def brake(self, *, abruptly: bool = False) -> None:
        """Drop all nodes, and come to rest."""
        self._brake(self.limits.acceleration * (_ABRUPT if abruptly else 1.0))
        self._begin()

    def shift(self, offset: float, rate: float) -> None:
        """Offset the whole path."""
        self.path.shift(offset, rate, self.now)
        self.at_soft_limit = 0
        if self._mode != "braking":
            self._mode, self._excused = "chasing", True
        self._begin()

    def declare(self, position: float) -> None:
        """Take the present position to be another; the axis stays where it is."""
        self.path.shift(position - self.position, 0.0, self.now)
        self.position = position
        self._begin()

    def displace(self, by: float) -> None:
        """Learn that the position is another than believed; the path stays, and the servo goes after it."""
        self.position += by
        self._mode, self._excused = ("braking" if self._mode == "braking" else "chasing"), True

    def _brake(self, rate: float) -> None:
        self.path = Path(line(self.now, self.position))
        self._mode, self._rate = "braking", rate

    # The next motion -------------------------------------------------------------------------------------------

    def _begin(self) -> None:
        """Choose what the axis does from now on, until the motion's end."""
        if self.path.passed(self.now):
            self._expire()
        if self._mode == "braking":
            self._motion = self._braking()
            if self._mode == "braking":
                return
        piece = self.path.piece(self.now)
        position, velocity = piece.at(self.now)
        near = abs(position - self.position) <= _ON_PATH and abs(velocity - self.velocity) <= _ON_PATH
        if near:
            self._mode, self._excused = "on path", False
            end = min(piece.end, self.now + _STRIDE_S) if velocity or piece.end < inf else inf
            if self._harmless(piece, end):
                self._motion = Piece(self.now, end, position, velocity, *_derivatives(piece, self.now))
                return
        self._motion = self._frame(piece, on_path=near)
        if self._stopped_by_a_limit(self._motion):
            self._begin()

    def _frame(self, piece: Piece, *, on_path: bool) -> Piece:
        """Return the motion of one frame, on the path or after it."""
        end = (floor(self.now / FRAME_S + 1e-6) + 1) * FRAME_S
        if end - self.now < _ROUNDING_S:
            end += FRAME_S
        if on_path:
            end = min(end, piece.end)
            too_fast = piece.top_velocity(self.now, end) > self.limits.velocity * _FITS
            too_hard = piece.top_acceleration(self.now, end) > self.limits.acceleration * _FITS
            if not (too_fast or too_hard):
                return Piece(self.now, end, self.position, self.velocity, *_derivatives(piece, self.now))
            if self.path.interpolated:
                self.happened |= {"velocity_limited"} if too_fast else set()
                self.happened |= {"acceleration_limited"} if too_hard else set()
        self._mode = "chasing"
        return self._landing() or self._chase(end)

    def _landing(self) -> Piece | None:
        """Return the cubic that meets the path soonest within the limits; none where there is none yet."""
        for frames in _LANDINGS:
            end = self.now + frames * FRAME_S
            if end > self.path.known_until:
                return None
            piece = self.path.piece(end)
            motion = joined(self.now, self.position, self.velocity, end, *piece.at(end))
            if (
                motion.top_acceleration(self.now, end) <= self.limits.acceleration * _FITS
                and motion.top_velocity(self.now, end) <= self.limits.velocity * _FITS
            ):
                self._mode = "landing"
                return motion
        return None

    def _chase(self, end: float) -> Piece:
        """Return one frame after the path, at constant acceleration.

        With the error e and the relative velocity w, the relative velocity u at the frame's end is the largest from
        which the axis can brake within what is left: u²/2a + (w + u)·dt/2 = e.
        """
        dt = end - self.now
        target, speed = self.path.piece(end).at(end)
        error = target - speed * dt - self.position
        relative = self.velocity - speed
        braking = self.limits.acceleration * _BRAKING
        ahead = error - relative * dt / 2.0
        half = braking * dt / 2.0
        wanted = speed + copysign(sqrt(half * half + 2.0 * braking * abs(ahead)) - half, ahead)
        wanted = min(max(wanted, -self.limits.velocity), self.limits.velocity)
        most = self.limits.acceleration * dt
        wanted = min(max(wanted, self.velocity - most), self.velocity + most)
        if self.path.interpolated and not self._excused and abs(error) > self._hardware.following_error_deg:
            self.happened.add("gave_up")
            self._brake(self.limits.acceleration)
            return self._braking()
        return Piece(self.now, end, self.position, self.velocity, (wanted - self.velocity) / dt)

    def _braking(self) -> Piece:
        """Return the motion to rest; at rest the axis is on the path again."""
        if abs(self.velocity) <= _ON_PATH:
            self.velocity = 0.0
            self.path = Path(line(self.now, self.position))
            self._mode = "on path"
            return self.path.tail
        duration = abs(self.velocity) / self._rate
        return Piece(
            self.now, self.now + duration, self.position, self.velocity, copysign(self._rate, -self.velocity)
        )

    def _expire(self) -> None:
        """The last node is past and no other came."""
        self.dry.append(self.path.tail.start)
        self.happened.add("update_late")
        if self._halts:
            self._brake(self.limits.acceleration)

    # Limits ----------------------------------------------------------------------------------------------------

    def _harmless(self, piece: Piece, end: float) -> bool:
        """Whether nothing can happen on this piece until `end`."""
        begin = self.now
        if not (piece.velocity or piece.acceleration or piece.jerk):
            return True
        fastest = piece.top_velocity(begin, end)
        if fastest > self.limits.velocity or piece.top_acceleration(begin, end) > self.limits.acceleration:
            return False
        low, high = piece.extent(begin, end)
        room = fastest * fastest / (2.0 * self.limits.acceleration) + fastest * FRAME_S
        return (
            low - room > max(self.limits.lowest, self.switches[0])
            and high + room < min(self.limits.highest, self.switches[1])
            and not any(low - _NEARBY <= place <= high + _NEARBY for place in self.watched)
        )

    def _stopped_by_a_limit(self, motion: Piece) -> bool:
        """Whether a limit ends this motion before it begins; then the axis brakes."""
        position, velocity = motion.at(motion.end) if motion.end < inf else (motion.position, motion.velocity)
        side = 1 if velocity > 0.0 else -1 if velocity < 0.0 else 0
        if not side or self._mode == "braking":
            return False
        switch = self.switches[side > 0]
        if side * (self.position - switch) >= 0.0:
            self._brake(self.limits.acceleration * _ABRUPT)
            return True
        limit = self.limits.highest if side > 0 else self.limits.lowest
        stop = position + side * velocity * velocity / (2.0 * self.limits.acceleration)
        if side * (stop - limit) <= _ON_PATH:
            return False
        self.at_soft_limit = side
        room, most = side * (limit - self.position), self.limits.acceleration * _ABRUPT
        on_the_limit = self.velocity**2 / (2.0 * room) if room > _ON_PATH else most
        self._brake(min(on_the_limit, most) if side * self.velocity > 0.0 else self.limits.acceleration)
        return True

    # Snapshots -------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return the state as JSON-able values."""
        return {
            "limits": list(vars(self.limits).values()),
            "path": self.path.state(),
            "at": [self.position, self.velocity, self.now],
            "switches": list(self.switches),
            "at_soft_limit": self.at_soft_limit,
            "happened": sorted(self.happened),
            "dry": list(self.dry),
            "mode": self._mode,
            "excused": self._excused,
            "rate": self._rate,
            "motion": piece_state(self._motion),
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Go back to a state."""
        self.limits = Limits(*state["limits"])
        self.path = Path.of_state(state["path"])
        self.position, self.velocity, self.now = state["at"]
        low, high = state["switches"]
        self.switches = low, high
        self.at_soft_limit = state["at_soft_limit"]
        self.happened, self.dry = set(state["happened"]), list(state["dry"])
        self._mode, self._excused, self._rate = state["mode"], state["excused"], state["rate"]
        self._motion = piece_of_state(state["motion"])


def _derivatives(piece: Piece, time: float) -> tuple[float, float]:
    """Acceleration and jerk of a piece at a time."""
    return piece.acceleration + piece.jerk * (time - piece.start), piece.jerk
