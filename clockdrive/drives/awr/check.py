"""What is impossible in a configuration of an AWR Microstep, and what unwise."""

from collections.abc import Iterator

from clockdrive.configuration_keys import Facts
from clockdrive.drives import Finding

_FACTORY = {
    "drive.sidereal_steps_per_s": "RA motor steps a second at sidereal rate, printed on the calibration sheet that "
    "AWR supplies with the drive box",
    "axis2.steps_per_degree": "Dec motor steps a degree, steps of the motor times microsteps times gear ratio / 360, "
    "as the calibration sheet of AWR has them",
}


def contradictions(facts: Facts) -> Iterator[Finding]:
    """What only the factory's sheet tells must be given."""
    for dotted, what in _FACTORY.items():
        if facts.get(dotted) is None:
            text = f"{dotted} is missing, and there is no default: the {what}; ask AWR for it with the serial number"
            yield (dotted,), text


def cautions(_facts: Facts) -> Iterator[str]:
    """Nothing of it is possible, and unwise."""
    yield from ()
