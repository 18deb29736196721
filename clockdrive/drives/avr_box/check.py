"""What is impossible in a configuration of a stepper box, and what unwise."""

from collections.abc import Iterator

from clockdrive.configuration_keys import Facts, number_of
from clockdrive.drives import Finding
from clockdrive.gear_teeth import GearTeeth
from mounts.avr_box.settings import LEAST_BLIND_S, SIDEREAL_DAY_S
from mounts.avr_box.timers import tracking_rate

_COARSEST_ARCSEC = 2.0  # of a microstep of a box that a telescope can be held by; its own gears make 0.1
_OFF_SIDEREAL = 2.0  # times the rate that the divisor of a box can make with no gears that are as its manual has them


def contradictions(facts: Facts) -> Iterator[Finding]:
    """Gears that no telescope has, and moves too short to be ended where no encoder sees them."""
    for section in ("axis1", "axis2"):
        yield from _gears(facts, section)
    longest, encoders = "drive.max_uninterruptible_s", "drive.encoder_counts_per_turn"
    if facts[encoders] == 0 and number_of(facts, longest) < LEAST_BLIND_S:
        text = (
            f"{longest} = {number_of(facts, longest):g}: without encoders each move is ended by others of 5′, "
            f"whatever became of it, and for those it takes {LEAST_BLIND_S:g} s or more"
        )
        yield (longest, encoders), text


def _gears(facts: Facts, axis: str) -> Iterator[Finding]:
    """Gears that slow the axis, and by which axis 1 tracks about as the sky does, as its divisor is fixed."""
    names = tuple(f"{axis}.{name}" for name in ("motor_steps", "microsteps", "main_gear", "secondary_gear"))
    steps, microsteps, main, secondary = (facts[name] for name in names)
    if not (isinstance(main, GearTeeth) and isinstance(secondary, GearTeeth)):
        raise TypeError(names)
    turn = number_of(facts, names[0]) * number_of(facts, names[1]) / float(main * secondary)
    given = f"{axis}.main_gear = {main}, secondary_gear = {secondary}, {steps} steps of {microsteps} microsteps"
    if 1_296_000.0 / turn > _COARSEST_ARCSEC:
        text = (
            f"{given}: a microstep would be {1_296_000.0 / turn:.4g}″ of the axis, allowed up to "
            f'{_COARSEST_ARCSEC:g}″; a gear that slows the axis is less than 1, as "1/360"'
        )
        yield names, text
        return
    of_sidereal = tracking_rate() / turn * SIDEREAL_DAY_S
    if axis == "axis1" and not 1.0 / _OFF_SIDEREAL <= of_sidereal <= _OFF_SIDEREAL:
        text = (
            f"{given}: the box would track at {of_sidereal:.4g} times the sidereal rate, allowed "
            f"{1.0 / _OFF_SIDEREAL:g} to {_OFF_SIDEREAL:g}; compare the gears with the mount's"
        )
        yield names, text


def cautions(_facts: Facts) -> Iterator[str]:
    """Nothing of it is possible, and unwise."""
    yield from ()
