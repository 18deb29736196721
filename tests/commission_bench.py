"""Mounts that are not what their configuration says, and a witness of what really happens to them.

The simulated unit is built of the true hardware, the telescope of what its owner believes. Where the axes truly are
comes from the unit's own 48-bit positions and the true gears, never from the planner.
"""

import random
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from fractions import Fraction
from math import radians, remainder
from typing import Any

from clockdrive import Telescope, VirtualClock
from clockdrive.commission import Stage
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.drives.tc410.gears import park_counts
from clockdrive.drives.tc410.registers import registers
from clockdrive.drives.tc410.sections import simulator_of
from clockdrive.true_sky import SimulatedSky
from mounts.tc410.simulator import SimulatedTC410
from mounts.tc410.simulator_settings import AxisHardware, SimulatorSettings
from mounts.true_mount import TrueMount
from pointing.gearing import Gearing

T0 = 1_800_000_000.0


@dataclass(frozen=True)
class TrueAxis:
    """What one axis really is; the defaults are what everyone believes."""

    reversed: bool = False
    main_gear: str = "1/285"
    secondary_gear: str = "16/40"
    encoder_bits: int = 0
    encoder_reversed: bool = False
    encoder_at_centre: int = 0x8000

    @property
    def ratio(self) -> Fraction:
        return Fraction(self.main_gear) * Fraction(self.secondary_gear)

    @property
    def step_deg(self) -> Fraction:
        return 360 * self.ratio / 2000

    @property
    def zeros_apart_deg(self) -> float:
        """How far an encoder zero at the centre count and one at count 0 differ where they preset the axis."""
        return abs(remainder(float(2**23 * self.step_deg), 360.0))

    @property
    def encoder_step_deg(self) -> float:
        return 360.0 / 2**self.encoder_bits


@dataclass(frozen=True)
class Truth:
    """A mount as it is, and as it is believed to be."""

    axes: tuple[TrueAxis, TrueAxis] = (TrueAxis(), TrueAxis())
    simulator: dict[str, Any] = field(default_factory=dict)
    believed: dict[str, Any] = field(default_factory=dict)


class Watched:
    """A telescope under commissioning, with the true extremes of its moves."""

    def __init__(self, truth: Truth, scope: Telescope, device: SimulatedTC410) -> None:
        self.truth, self.scope, self.device = truth, scope, device
        sections = scope.configuration.axes
        starts = park_counts(scope.configuration)
        gearings = tuple(
            Gearing(axis.step_deg, start, section.park_deg, axis.reversed)
            for axis, start, section in zip(truth.axes, starts, sections, strict=True)
        )
        mount = TrueMount(device.settings, "equatorial-fork", radians(scope.configuration.site.latitude_deg))
        self.sky = SimulatedSky(device, gearings, mount, scope.clock)
        self.step: Stage | None = None
        self.origin = self.counts()
        self.excursions: dict[str, tuple[float, float]] = {}  # by step: the largest true way and its bound, degrees
        self.requests = 0
        self.before = lambda _data: None
        receive = device.receive

        def received(data: bytes, t: float) -> bytes:
            self.requests += 1
            self.before(data)
            answer = receive(data, t)
            self._see()
            return answer

        device.receive = received

    def counts(self) -> tuple[float, float]:
        return self.device.true_position(1), self.device.true_position(2)

    def watch(self, stage: Stage) -> None:
        self.device.advance(self.scope.clock.now())
        self._see()
        self.step = stage
        if stage.findings is None:
            self.origin = self.counts()
            self._see()

    def _see(self) -> None:
        if self.step is None:
            return
        gone = max(
            abs(here - start) * float(axis.step_deg)
            for here, start, axis in zip(self.counts(), self.origin, self.truth.axes, strict=True)
        )
        step = self.step.step
        before = self.excursions.get(step.name, (0.0, 0.0))[0]
        self.excursions[step.name] = max(gone, before), step.bound_deg

    def commission(self, only=(), witness="sky", **more):
        return self.scope.commission(only, self.sky if witness == "sky" else witness, self.watch, **more)


@contextmanager
def mount(folder, truth: Truth, monkeypatch, **overrides):
    """Open a telescope on a mount that may be another than its configuration says."""
    believed = {"state.path": str(folder), "limits.sun_avoidance_deg": 0.0, "limits.horizon_deg": 0.0,
                **{f"simulator.{name}": value for name, value in truth.simulator.items()},
                **truth.believed, **overrides}  # fmt: skip
    made = []

    def true_unit(configuration, time, snapshot):
        known = {f.name for f in fields(SimulatorSettings)}
        settings = SimulatorSettings(**{k: v for k, v in vars(simulator_of(configuration)).items() if k in known})
        kept = {k: v for k, v in registers(configuration).items() if not k.endswith("encoder_zero")}
        unit = SimulatedTC410(settings, time, tuple(_hardware(axis) for axis in truth.axes), kept,
                              park_counts(configuration))  # fmt: skip
        if snapshot is not None:
            unit.restore(snapshot)
            unit.advance(time)
        made.append(unit)
        return unit

    with monkeypatch.context() as patch:
        patch.setattr(tc410, "simulated", true_unit)
        with Telescope.simulated(clock=VirtualClock(T0), overrides=believed) as scope:
            yield Watched(truth, scope, made[-1])


def _hardware(axis: TrueAxis) -> AxisHardware:
    return AxisHardware(
        main_gear=Fraction(axis.main_gear),
        secondary_gear=Fraction(axis.secondary_gear),
        encoder_bits=axis.encoder_bits,
        encoder_at_centre=axis.encoder_at_centre,
        encoder_reversed=axis.encoder_reversed,
    )


def random_truth(seed: int) -> Truth:
    """A mount of chance: about a third of what can be wrong is."""
    chance = random.Random(seed)  # noqa: S311

    def wrong() -> bool:
        return chance.random() < 0.35

    axes, believed = [], {}
    for number in (1, 2):
        main, secondary = "1/285", "16/40"
        match chance.choice(("right", "right", "teeth", "pinion", "wheel", "odd")):
            case "teeth":
                main = f"1/{285 + chance.choice((-5, -4, -3, 3, 4, 5))}"
            case "pinion":
                secondary = f"{chance.choice((15, 17))}/40"
            case "wheel":
                secondary = f"16/{chance.choice((39, 41))}"
            case "odd":
                off = chance.choice((-1, 1)) * chance.uniform(0.012, 0.02)
                secondary = str(Fraction(round(4000 * (1.0 + off)), 10000))
        bits = chance.choice((0, 14, 16))
        reverse, encoder_reverse = chance.random() < 0.5, bits > 0 and chance.random() < 0.5
        axes.append(TrueAxis(reverse, main, secondary, bits, encoder_reverse, chance.randrange(0x1000, 0xF000)))
        believed[f"axis{number}.reversed"] = reverse != wrong()
        believed[f"axis{number}.encoder_bits"] = bits
        believed[f"axis{number}.encoder_reversed"] = encoder_reverse != (bits > 0 and wrong())
    believed["axis1.park_deg"], believed["axis2.park_deg"] = chance.uniform(-20, 20), chance.uniform(-30, 5)
    idle = chance.choice(("both", "per-axis"))
    believed["drive.slew_idle"] = chance.choice(("both", "per-axis"))
    zero = chance.choice(("centre", "zero"))
    for number in (1, 2):
        believed[f"axis{number}.encoder_zero_at"] = chance.choice(("centre", "zero"))
    simulator = {
        "acceleration_error": chance.uniform(-0.1, 0.1),
        "landing_s": chance.choice((0.0, chance.uniform(0.0, 2.0))),
        "position_format": chance.choice(("right", "left")),
        "slew_idle": idle,
        "encoder_zero_at": zero,
        "slew_bit_clears": chance.random() < 0.5,
        "latency_s": chance.uniform(0.001, 0.08),
        "baud": chance.choice((0, 9600)),
        "misalignment_x_arcsec": chance.uniform(-180, 180),
        "misalignment_y_arcsec": chance.uniform(-180, 180),
        "collimation_arcsec": chance.uniform(-60, 60),
        "nonperpendicularity_arcsec": chance.uniform(-60, 60),
        "flexure_arcsec": chance.uniform(-30, 30),
        "periodic_error_arcsec": chance.uniform(0, 10),
        "backlash_arcsec": chance.uniform(0, 60),
        "encoder_noise_arcsec": chance.uniform(0, 10),
        "seed": seed,
    }
    return Truth((axes[0], axes[1]), simulator, believed)


def wrong_keys(truth: Truth) -> dict[str, object]:
    """Return the keys that must be found wrong, with their true values; `axisN gears` with the true ratio."""
    values = {**load(None, {}, truth.believed).values}
    found: dict[str, object] = {}
    for number, axis in enumerate(truth.axes, start=1):
        true = {"reversed": axis.reversed, "encoder_reversed": axis.encoder_reversed,
                "encoder_bits": axis.encoder_bits}  # fmt: skip
        if axis.encoder_bits and axis.zeros_apart_deg > axis.encoder_step_deg:  # else both preset the same position
            true["encoder_zero_at"] = truth.simulator.get("encoder_zero_at", "centre")
        found |= {f"axis{number}.{k}": v for k, v in true.items() if values[f"axis{number}.{k}"] != v}
        if axis.ratio != Fraction("1/285") * Fraction("16/40"):
            found[f"axis{number} gears"] = axis.ratio
    idle = truth.simulator.get("slew_idle", "both")
    if values["drive.slew_idle"] != idle:
        found["drive.slew_idle"] = idle
    return found
