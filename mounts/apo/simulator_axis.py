"""One simulated axis controller: its clock, servo, fiducials and status, and what can befall it.

What it does when it is told to is in `simulator_commands`. Times inside are counts of its own clock.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from mounts.apo.commands import Kind
from mounts.apo.simulator_clock import ControllerClock
from mounts.apo.simulator_fiducials import Fiducials
from mounts.apo.simulator_path import Piece
from mounts.apo.simulator_servo import Servo
from mounts.apo.simulator_settings import AxisHardware, SimulatorSettings
from mounts.apo.status_word import StatusWord, mask_of, sticky_mask

HALTING = frozenset(
    {
        "overspeed",
        "disable_switch",
        "output_disabled",
        "motion_error",
        "amplifier_hot",
        "amplifier_bad",
        "out_of_closed_loop",
        "motor_velocity",
    }
)
"""Conditions on which a controller brakes and wants INIT."""

_GAVE_UP: Mapping[Kind, str] = {"apo": "motion_error", "sdss": "out_of_closed_loop"}
_RESTARTED = 1 << 30
_EDGE = 1e-6  # degrees from a soft limit at which the axis counts as being on it


@dataclass
class Record:
    """What was commanded, for tests to judge; degrees and seconds, times as POSIX.

    Attributes
    ----------
    velocity, acceleration, jerk : float
        The largest on the cubics between nodes.
    position_jump, velocity_jump : float
        The largest step at a node, against the path before it.
    nodes : int
        How many were taken.
    late, refused : list
        Times of nodes that came too late; times and reasons of all that was not obeyed.
    dry : list
        Times at which the last node was past and no other there.
    """

    velocity: float = 0.0
    acceleration: float = 0.0
    jerk: float = 0.0
    position_jump: float = 0.0
    velocity_jump: float = 0.0
    nodes: int = 0
    late: list[float] = field(default_factory=list)
    refused: list[tuple[float, str]] = field(default_factory=list)
    dry: list[float] = field(default_factory=list)

    def clear(self) -> None:
        """Begin anew."""
        self.__init__()  # type: ignore[misc]

    def take(self, piece: Piece, position: float, velocity: float, *, is_first: bool) -> None:
        """Note a node, at the end of `piece`."""
        self.nodes += 1
        if piece.jerk or piece.acceleration or not is_first:
            self.velocity = max(self.velocity, piece.top_velocity(piece.start, piece.end))
            self.acceleration = max(self.acceleration, piece.top_acceleration(piece.start, piece.end))
            self.jerk = max(self.jerk, abs(piece.jerk))
        before, speed = piece.at(piece.end)
        if is_first:
            self.position_jump = max(self.position_jump, abs(position - before))
            self.velocity_jump = max(self.velocity_jump, abs(velocity - speed))


class SimulatedController:
    """One controller with its axis.

    Parameters
    ----------
    kind : str
        Whose status bits and habits it has.
    settings : SimulatorSettings
        How it reads the manual.
    hardware : AxisHardware
        Its axis.
    t0 : float
        POSIX time at which it starts.
    position : float
        Degrees at which the axis stands, and which the controller believes.
    """

    def __init__(
        self, kind: Kind, settings: SimulatorSettings, hardware: AxisHardware, t0: float, position: float
    ) -> None:
        self.kind: Kind = kind
        self.settings = settings
        self.hardware = hardware
        self.clock = ControllerClock(t0, settings.clock_drift_ppm * 1e-6)
        if settings.clock_set:
            self.clock.set(t0, settings.clock_offset_s)
        self.record = Record()
        self.fiducials = Fiducials(hardware)
        self.servo = Servo(hardware, position, self._crossed, halts_on_expiry=settings.on_expiry == "halt")
        self.slip = 0.0  # true position minus the one believed
        self.conditions: set[str] = set()  # names of status bits that hold now
        self.pressed: dict[int, float] = {}  # limit switches that somebody holds, by side
        self.logged: list[str] = []
        self.debug = False
        self.output_limit = 100
        self.silent_until = float("-inf")
        self.sticky = 0  # status bits that stay until cleared
        self.needs_init = False
        self.step = 0.0  # of + and -, degrees
        self.index = position
        self.banner = ""  # still to be said
        self._watch()

    # Time ------------------------------------------------------------------------------------------------------

    @property
    def count(self) -> float:
        """Its clock's count, as of the last `advance`."""
        return self.servo.now

    def advance(self, t: float) -> None:
        """Let the axis run until POSIX `t`; a time already passed changes nothing."""
        self.servo.run(self.clock.count(t))
        self.collect()

    def true_position(self) -> float:
        """Where the axis truly is, degrees."""
        return self.servo.position + self.slip

    def _crossed(self, motion: Piece) -> bool:
        correction = self.fiducials.cross(motion, self.slip) if motion.end > motion.start else 0.0
        if not correction:
            return False
        self.learn(correction)
        return True

    def learn(self, correction: float) -> None:
        """Add to the position; the axis stays where it is."""
        self.servo.displace(correction)
        self.slip -= correction
        self._watch()

    def _watch(self) -> None:
        """Tell the servo where something is to be seen."""
        margin = self.hardware.switch_margin_deg
        low = self.pressed.get(-1, self.hardware.lowest_deg - margin)
        high = self.pressed.get(1, self.hardware.highest_deg + margin)
        self.servo.switches = low - self.slip, high - self.slip
        self.servo.watched = tuple(edge - self.slip for edge in self.fiducials.edges)

    def collect(self) -> None:
        """Take what has happened to the axis into status bits and record."""
        if self.servo.dry:
            self.record.dry += [self.clock.posix(count) for count in self.servo.dry]
            self.servo.dry.clear()
        happened, self.servo.happened = self.servo.happened, set()
        if "gave_up" in happened:
            happened = happened - {"gave_up"} | {_GAVE_UP[self.kind]}
            self.needs_init = True
        for name in happened:
            self.sticky |= mask_of(name, self.kind)

    # Status ----------------------------------------------------------------------------------------------------

    def status_word(self) -> StatusWord:
        """The bits as they would be reported now."""
        names = set(self.conditions)
        servo = self.servo
        if not servo.path.interpolated:
            names.add("buffer_empty")
        if servo.at_soft_limit < 0 or servo.position <= servo.limits.lowest + _EDGE:
            names.add("reverse_soft_limit")
        if servo.at_soft_limit > 0 or servo.position >= servo.limits.highest - _EDGE:
            names.add("forward_soft_limit")
        if servo.position <= servo.switches[0] + _EDGE:
            names.add("reverse_limit_switch")
        if servo.position >= servo.switches[1] - _EDGE:
            names.add("forward_limit_switch")
        if self.fiducials.too_large:
            names.add("fiducial_error")
        if self.kind == "sdss" and not self.clock.is_set:
            names.add("clock_not_set")
        now = sum(mask_of(name, self.kind) for name in names)
        self.sticky |= now & sticky_mask(self.kind)
        return StatusWord(self.sticky | now, self.kind)

    # What happens to it ----------------------------------------------------------------------------------------

    def restart(self, t: float, *, loses_position: bool = False, loses_clock: bool = False) -> None:
        """Start anew, abruptly: silent for a while, then with bit 30, and moves refused until INIT."""
        self.advance(t)
        self.servo.brake(abruptly=True)
        self.silent_until = t + self.settings.boot_s
        self.banner = self.settings.boot_banner
        self.fiducials.switch(on=False)
        self.debug = False
        self.sticky, self.needs_init = _RESTARTED, True
        if loses_position:
            self.believe(0.0)
        if loses_clock:
            self.clock.is_set = False

    def fail(self, name: str) -> None:
        """Let a condition hold, by the name of its status bit; some of them halt the axis.

        Raises
        ------
        KeyError
            A controller of this kind has no such bit.
        """
        self.sticky |= mask_of(name, self.kind) & sticky_mask(self.kind)
        self.conditions.add(name)
        if name == "stop_button" or name in HALTING:
            self.servo.brake(abruptly=name == "stop_button")
            self.needs_init = True

    def repair(self, name: str) -> None:
        """Let a condition hold no longer."""
        self.conditions.discard(name)

    @property
    def is_halted(self) -> bool:
        """Whether something that holds now keeps it from moving."""
        return bool(self.conditions & (HALTING | {"stop_button"}))

    def lose_one_hz(self, t: float, gain_ppm: float) -> None:
        """Take the 1 Hz signal away at POSIX `t`: the clock then runs by its own crystal."""
        self.advance(t)
        self.clock.retune(t, gain_ppm * 1e-6)
        self.fail("one_hz_lost")

    def press_limit(self, direction: int) -> None:
        """Close the upper (+1) or lower (−1) limit switch right where the axis is."""
        self.pressed[direction] = self.true_position()
        self._watch()
        self.servo.look()

    def release_limits(self) -> None:
        """Put the limit switches back where they belong."""
        self.pressed.clear()
        self._watch()

    def let_slip(self, degrees: float) -> None:
        """Let the axis stand elsewhere than the encoder says."""
        self.slip += degrees
        self._watch()

    def believe(self, position: float) -> None:
        """Take the present position to be another; the axis stays where it is."""
        self.slip += self.servo.position - position
        self.index = 0.0
        self.servo.declare(position)
        self._watch()

    def said_at_boot(self) -> str:
        """Return what it said when it started, once."""
        banner, self.banner = self.banner, ""
        return banner

    # Snapshots -------------------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return the state as JSON-able values; settings and hardware are not in it."""
        return {
            "clock": dict(vars(self.clock)),
            "record": {
                name: list(told) if isinstance(told, list) else told for name, told in vars(self.record).items()
            },
            "fiducials": self.fiducials.state(),
            "servo": self.servo.state(),
            "slip": self.slip,
            "conditions": sorted(self.conditions),
            "pressed": [[side, place] for side, place in self.pressed.items()],
            "logged": list(self.logged),
            "debug": self.debug,
            "output_limit": self.output_limit,
            "silent_until": max(self.silent_until, self.clock.t0),
            "sticky": self.sticky,
            "needs_init": self.needs_init,
            "step": self.step,
            "index": self.index,
            "banner": self.banner,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go back to a state."""
        self.clock = ControllerClock(**state["clock"])
        self.record = Record(**state["record"])
        self.record.refused = [(time, reason) for time, reason in self.record.refused]
        self.fiducials.restore(state["fiducials"])
        self.servo.restore(state["servo"])
        self.slip, self.conditions = state["slip"], set(state["conditions"])
        self.pressed = dict(state["pressed"])
        self.logged, self.debug, self.output_limit = list(state["logged"]), state["debug"], state["output_limit"]
        self.silent_until, self.sticky = state["silent_until"], state["sticky"]
        self.needs_init, self.step = state["needs_init"], state["step"]
        self.index, self.banner = state["index"], state["banner"]
        self._watch()
