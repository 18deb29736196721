"""What the simulated TC410 and the telescope behind it are like: the `[simulator]` configuration and the hardware."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

from mounts.tc410.registers import PositionFormat


@dataclass(frozen=True)
class SimulatorSettings:
    """The keys of `[simulator]`; the defaults are a perfect mount on a unit that is as assumed.

    Attributes
    ----------
    misalignment_x_arcsec, misalignment_y_arcsec : float
        Rotation of the mount's axes from the sky's.
    collimation_arcsec, nonperpendicularity_arcsec, flexure_arcsec : float
        CH, NP and TF of equatorial mounts; CA, NPAE and TF of altazimuth ones.
    periodic_error_arcsec : float
        Amplitude, once a turn of the worm of axis 1.
    backlash_arcsec : float
        Play of both axes.
    encoder_noise_arcsec : float
        Standard deviation of a reading of the absolute encoders.
    acceleration_error : float
        True ramps are 1 + this times the registers.
    landing_s : float
        Seconds taken by the last `landing_counts` of a slew; 0 lands by the law.
    landing_counts : int
        See `landing_s`.
    clock_drift_ppm : float
        How much longer the unit's ticks last than 2 ms.
    latency_s, baud : float, int
        Of the link to the unit; 0 baud is a line that takes no time. Used by whoever opens the link.
    position_format : str
        Where the 24 bits of a position stand in their pair of registers.
    slew_idle : str
        Whether tracking resumes when "both" axes have landed or "per-axis".
    slew_bit_clears : bool
        Whether the bit that starts a slew clears itself at its end.
    limit_shift, speed_shift : int
        Bits below the 16 kept of soft limits and park positions, and of the maximum speed.
    encoder_zero_at : str
        Whether the stored encoder zero belongs to the centre count or to count 0.
    volatile_targets : bool
        Whether target positions and velocities are lost with the power.
    power_at_boot : bool
        Whether the motors have power after the unit started.
    standby_steps : float
        Full steps by which the axes may have moved while in standby.
    dead_zone : int
        ADC steps around the centre in which joystick and analogue autoguider are idle.
    guide_velocity : int
        Velocity of the digital autoguider.
    seed : int
        Of everything random.
    """

    misalignment_x_arcsec: float = 0.0
    misalignment_y_arcsec: float = 0.0
    collimation_arcsec: float = 0.0
    nonperpendicularity_arcsec: float = 0.0
    flexure_arcsec: float = 0.0
    periodic_error_arcsec: float = 0.0
    backlash_arcsec: float = 0.0
    encoder_noise_arcsec: float = 0.0
    acceleration_error: float = 0.0
    landing_s: float = 0.0
    landing_counts: int = 20
    clock_drift_ppm: float = 0.0
    latency_s: float = 0.001
    baud: int = 0
    position_format: PositionFormat = "right"
    slew_idle: Literal["both", "per-axis"] = "both"
    slew_bit_clears: bool = True
    limit_shift: int = 8
    speed_shift: int = 8
    encoder_zero_at: Literal["centre", "zero"] = "centre"
    volatile_targets: bool = True
    power_at_boot: bool = True
    standby_steps: float = 2.0
    dead_zone: int = 4
    guide_velocity: int = 6937
    seed: int = 1


@dataclass(frozen=True)
class AxisHardware:
    """What is bolted to one axis: motor, gears, encoder and limit switches.

    Attributes
    ----------
    motor_steps : int
        Full steps a turn of the motor.
    main_gear, secondary_gear : Fraction
        Ratios of worm and wheel, and of motor and worm.
    drive_type : str
        "gecko" counts 10, "ims" 16 microsteps a full step.
    encoder_bits : int
        0 for none, 14 or 16.
    encoder_at_centre : int
        Binary reading of the encoder, in 1/65536 turn, at the centre of travel.
    encoder_reversed : bool
        Whether the encoder decreases when the position increases.
    negative_switch, positive_switch : int, optional
        True positions, in counts, at which the limit switches close.
    """

    motor_steps: int = 200
    main_gear: Fraction = Fraction(1, 285)
    secondary_gear: Fraction = Fraction(16, 40)
    drive_type: Literal["gecko", "ims"] = "gecko"
    encoder_bits: Literal[0, 14, 16] = 0
    encoder_at_centre: int = 0x8000
    encoder_reversed: bool = False
    negative_switch: int | None = None
    positive_switch: int | None = None

    @property
    def counts_per_step(self) -> int:
        """Counts of a full motor step."""
        return {"gecko": 10, "ims": 16}[self.drive_type]

    @property
    def turns_per_count(self) -> Fraction:
        """Turns of the axis for one count."""
        return self.main_gear * self.secondary_gear / (self.motor_steps * self.counts_per_step)


PERFECT_HARDWARE = (AxisHardware(), AxisHardware())
