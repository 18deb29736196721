"""How a TC410 is sent to its targets."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from mounts.drive import AxisSlew, Reading
from mounts.errors import DriveRefused, Unsynchronised
from mounts.tc410.parts import AXES, REMOTE, SLEW, START_EXCHANGES, TRACK
from mounts.tc410.registers import COUNTS_PER_SECOND, by_name
from mounts.tc410.sighting import Sighting
from mounts.tc410.slew_watch import AxisWatch, SlewWatch


class Slewing(Sighting):
    """Starts slews of both axes."""

    def start(self, axes: Sequence[AxisSlew], time: float) -> float:
        """Write targets and tracking velocities, then raise the slew bit: both axes start in the same tick.

        Raises
        ------
        Unsynchronised, DriveRefused
            The position may be wrong; there is no power, or an alarm stands.
        RegisterError
            A target or rate is outside what the drive can hold; nothing was sent.
        """
        targets = self._encoded("target_position", [slew.target for slew in axes])
        velocities = self._encoded("tracking_velocity", [slew.rate_after / COUNTS_PER_SECOND for slew in axes])
        lowered = self._speeds_to_lower(axes)
        self._learn()
        exchanges = self._unit.exchanges
        reading = self._ready(self.read(time))
        self._slew = self._landing = self._tracked = None
        self._write_control(self._control & ~SLEW)  # an axis that is led goes on until the slew takes it over
        self._set_speeds(lowered)
        self._write_targets(targets)
        told = [
            self._unit.write_words(f"axis{axis}_tracking_velocity", words)
            for axis, words in zip(AXES, velocities, strict=True)
        ]
        turned = told if "tracking" in reading.motion else [None, None]  # a drive that tracks obeys at once
        tracks = any(any(words) for words in velocities)
        began = self._write_control(self._control & ~(TRACK | REMOTE) | SLEW | (TRACK if tracks else 0))
        self._direct.end()
        if self._unit.exchanges - exchanges == START_EXCHANGES:  # more when it came from motion, or to a lower speed
            self._learnt = self._learnt.started(began - time)
        one, two = (self._watch(i, reading, slew, lowered, began, turned[i]) for i, slew in enumerate(axes))
        self._slew = SlewWatch((one, two))
        return began

    def _ready(self, reading: Reading) -> Reading:
        if reading.unsynchronised:
            raise Unsynchronised(reading.unsynchronised)
        if reading.alarms:
            raise DriveRefused(f"power supply alarm: {', '.join(reading.alarms)}; find its cause before moving")
        if not reading.powered:
            raise DriveRefused("the motors have no power (standby); `drive power on`, then try again")
        return reading

    def _speeds_to_lower(self, axes: Sequence[AxisSlew]) -> dict[str, float]:
        """Top speeds for one move that must be slower, by register."""
        lowered = {}
        for axis, slew, model in zip(AXES, axes, self.slew_models, strict=True):
            if slew.max_rate is not None and slew.max_rate < model.max_rate:
                name = f"axis{axis}_max_speed"
                speed = slew.max_rate / COUNTS_PER_SECOND
                lowered[name] = by_name(name).decode(self._unit.encoded(name, speed))
        return lowered

    def _watch(
        self,
        i: int,
        reading: Reading,
        slew: AxisSlew,
        lowered: Mapping[str, float],
        began: float,
        turned: float | None,
    ) -> AxisWatch:
        """Watch an axis that began to slew; `turned` when it took up its new tracking rate before that."""
        axis, target = reading.axes[i], round(slew.target)
        model = self.slew_models[i]
        model = replace(model, max_velocity=int(lowered.get(f"axis{i + 1}_max_speed", model.max_velocity)))
        start, rate = axis.counts + axis.rate * (began - reading.time), axis.rate
        if turned is not None:
            start += (slew.rate_after - rate) * (began - turned)
            rate = slew.rate_after
        travel = model.travel(start, target, rate, 0.0)
        return AxisWatch(model, start, rate, target, travel, slew.rate_after, began)
