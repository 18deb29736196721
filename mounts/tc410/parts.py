"""The parts of a TC410's driver: unit, encoders, what is trusted and learnt, how registers are written."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from mounts.beside import Guardian
from mounts.drive import Capabilities, Reading
from mounts.errors import DriveRefused
from mounts.tc410.calibration import Learnt
from mounts.tc410.direct import DirectSpeed
from mounts.tc410.encoders import Encoders
from mounts.tc410.hands import Hands
from mounts.tc410.registers import Register, by_name
from mounts.tc410.settings import TC410Settings
from mounts.tc410.slew import Tc410SlewModel
from mounts.tc410.startup import read_models, write_soft_limits
from mounts.tc410.trust import BY_HAND, REINTERPRETED, RELOADED, Trust
from mounts.tc410.unit import Unit
from mounts.tc410.upkeep import Upkeep
from transports.modbus_ascii import ModbusAscii

if TYPE_CHECKING:
    from mounts.tc410.landing import Landing
    from mounts.tc410.slew_watch import SlewWatch
    from mounts.tc410.tracking import TrackedAxis

AXES = (1, 2)
SLEW, REMOTE, TRACK = (
    by_name("velocity_control").mask(name) for name in ("slew_to_target", "remote_control", "tracking")
)
START_EXCHANGES = 9  # of a start: three reads, two writes of words and four of pairs
_START_CHARACTERS = 3 * (17 + 27) + 2 * 17 + 17 + 4 * (27 + 17)  # up to the end of the last request


class Parts:
    """What a driver works with; see `TC410`."""

    def __init__(
        self,
        modbus: ModbusAscii,
        settings: TC410Settings,
        memory: Mapping[str, object],
        remember: Callable[[Mapping[str, object]], None] = lambda memory: None,  # noqa: ARG005 - a test need not
        guardian: Guardian | None = None,
    ) -> None:
        self._unit = Unit(modbus, settings.baud)
        self.upkeep = Upkeep(self._unit, self._about_to_write, self._written)
        """The registers, for a person."""
        self._direct = DirectSpeed(self._unit, guardian)
        barred = memory.get("hands")
        self._hands = Hands(self._unit, barred if isinstance(barred, int) else 0)
        self._settings = settings
        self._remember = remember
        self._trust = Trust(memory)
        if not self._trust.unsynchronised and memory.get("meaning", settings.meaning) != settings.meaning:
            self._trust.lose(REINTERPRETED)
        one, two = settings.axes
        self.encoders = Encoders(
            self._unit,
            (one.encoder, two.encoder),
            ((one.lowest_counts, one.highest_counts), (two.lowest_counts, two.highest_counts)),
            memory,
        )
        """The absolute encoders, and what is believed of them."""
        self._compare_encoders = True  # with the next position that can be trusted
        self._learnt = Learnt.from_json(memory.get("learnt"))
        lowered = memory.get("restore")
        self._lowered: dict[str, float] = dict(lowered) if isinstance(lowered, Mapping) else {}
        self._borrowed = False  # whether what is lowered was borrowed, and not for a slew that ends by itself
        self._notes: list[str] = []
        self._models: tuple[Tc410SlewModel, Tc410SlewModel] | None = None
        self._control = 0
        self._control_known = True  # else a write of it may have reached the unit, or not
        self._last: Reading | None = None
        self._counts: tuple[float, float] | None = None
        self._moved = (math.inf, math.inf)  # by how many counts, between the last two looks
        self._powered = True
        self._looked = math.inf  # POSIX seconds of the last look
        self._seen_at = (math.inf, math.inf)  # POSIX seconds of the positions then
        self._since_look = (0.0, 0.0)  # seconds between the last two positions
        self._slew: SlewWatch | None = None
        self._landing: Landing | None = None
        self._tracked: tuple[TrackedAxis, TrackedAxis] | None = None

    @property
    def capabilities(self) -> Capabilities:
        """It has a position and a stop, and tracks on when the host is gone."""
        return Capabilities(
            has_position=True,
            can_stop=True,
            rate_control=True,
            path_nodes=False,
            holds_rate_alone=True,
            units="counts",
        )

    @property
    def slew_models(self) -> tuple[Tc410SlewModel, Tc410SlewModel]:
        """The landing law of both axes with the unit's registers and all that has been learnt."""
        if self._models is None:
            raise DriveRefused("the drive is not connected; connect first")
        one, two = (
            replace(model, acceleration_scale=known.acceleration_scale, landing_s=known.landing_s)
            for model, known in zip(self._models, self._learnt.axes, strict=True)
        )
        return one, two

    @property
    def start_latency(self) -> float:
        """Seconds from `start` to the motion: as learnt, else at the pace of the exchanges seen so far."""
        known = self._learnt.start_latency_s
        return self._unit.burst_s(START_EXCHANGES, _START_CHARACTERS) if known is None else known

    @property
    def axes_land_together(self) -> bool:
        """Whether tracking resumes when the whole slew ends: as found out, else as configured."""
        return (self._learnt.slew_idle or self._settings.slew_idle) == "both"

    @property
    def memory(self) -> Mapping[str, object]:
        """Position, boot cookie, registers to restore, and all that has been learnt."""
        return {
            **self._trust.as_json(),
            "learnt": self._learnt.as_json(),
            "meaning": self._settings.meaning,
            "restore": dict(self._lowered),
            "hands": self._hands.barred,
            "encoders": self.encoders.as_json(),
        }

    @property
    def notes(self) -> tuple[str, ...]:
        """Differences from the configuration, assumptions refuted."""
        notes = (*self._notes, *self.encoders.notes)
        found = self._learnt.slew_idle
        if found is None or found == self._settings.slew_idle:
            return notes
        said = (
            f'slew_idle: slews show "{found}", the configuration says "{self._settings.slew_idle}"; planned as seen'
        )
        return (*notes, said)

    @property
    def unit(self) -> Unit:
        """The unit's registers, for what this driver has no word of; `borrow` changes one for a while."""
        return self._unit

    @property
    def learnt(self) -> Learnt:
        """All that this unit's slews have taught."""
        return self._learnt

    def borrow(self, changes: Mapping[str, float]) -> None:
        """Change registers until `give_back`, the next slew or the next connection, whichever comes first.

        What they hold is remembered first, so that the next process gives it back when this one cannot.
        """
        found = {name: self._unit.read(name)[name] for name in changes if name not in self._lowered}
        self._lowered, self._borrowed = {**self._lowered, **found}, True
        self._remember(self.memory)
        for name, value in changes.items():
            self._unit.write(name, value)

    def give_back(self) -> None:
        """Write back what was borrowed."""
        self._restore_speed()

    @property
    def lent(self) -> Mapping[str, float]:
        """What the registers that are changed for a while hold otherwise, by name."""
        return dict(self._lowered)

    def _restore_speed(self) -> None:
        for name, value in self._lowered.items():
            self._unit.write(name, value)
        self._borrowed = False
        if self._lowered:
            self._lowered = {}
            self._remember(self.memory)

    def _set_speeds(self, lowered: Mapping[str, float]) -> None:
        """Lower top speeds, having the true ones remembered first; give back what an earlier move lowered."""
        self._restore_speed()
        if not lowered:
            return
        models = dict(zip((f"axis{axis}_max_speed" for axis in AXES), self.slew_models, strict=True))
        self._lowered = {name: models[name].max_velocity for name in lowered}
        self._remember(self.memory)
        for name, speed in lowered.items():
            self._unit.write(name, speed)

    def _encoded(self, name: str, values: Sequence[float]) -> list[tuple[int, ...]]:
        """The words of a register of both axes; what they cannot hold is refused here, before anything is sent."""
        return [self._unit.encoded(f"axis{axis}_{name}", value) for axis, value in zip(AXES, values, strict=True)]

    def _axis_register(self, axis: int, name: str) -> float:
        return self._unit.read(f"axis{axis}_{name}")[f"axis{axis}_{name}"]

    def _read_control(self) -> None:
        self._control = int(self._unit.read("velocity_control")["velocity_control"])
        self._control_known = True

    def _write_control(self, bits: int) -> float:
        self._control_known = False
        written = self._unit.write("velocity_control", bits)
        self._control, self._control_known = bits, True
        return written

    def _write_targets(self, words: Sequence[tuple[int, ...]]) -> None:
        """Write both, and have them remembered first: a host that dies in between leaves either in the unit."""
        self._trust.will_hold(words)
        self._remember(self.memory)
        for axis, pair in zip(AXES, words, strict=True):
            self._unit.write_words(f"axis{axis}_target_position", pair)
        self._trust.holds(words)

    def _read_models(self) -> None:
        self._restore_speed()  # else a speed lowered for one move would be taken for the unit's own
        models, self._notes = read_models(self._unit, self._settings)
        self._models = models

    def _about_to_write(self, row: Register, words: tuple[int, ...]) -> None:
        """Have remembered what a person's writing will change, and saved nothing that was changed for a while."""
        if row.saved or row.name == "save_configuration":
            self._restore_speed()
        elif row.name.endswith("_target_position"):
            self._trust.will_hold(self._targets_with(row, words))
            self._remember(self.memory)

    def _targets_with(self, row: Register, words: tuple[int, ...]) -> list[tuple[int, ...]]:
        return [words if row.axis == axis else self._unit.words(f"axis{axis}_target_position") for axis in AXES]

    def _written(self, row: Register, words: tuple[int, ...]) -> None:
        """Take in what a person has written."""
        if row.name == "velocity_control":
            self._control = words[0]
        elif row.name.endswith("_target_position"):
            self._trust.holds(self._targets_with(row, words))
        elif row.name in {"axis1_position", "axis2_position"}:
            self._trust.lose(BY_HAND)
        elif row.name in {"load_factory", "load_configuration"}:
            self._lowered = {}
            self._trust.lose(RELOADED)
            write_soft_limits(self._unit, self._settings)
        if row.saved or row.name.startswith("load_"):
            self._read_models()
        self._remember(self.memory)
