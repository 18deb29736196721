"""What is wrong with a pointing run, told before a fit.

First what the numbers tell by their range, or by one change of them that explains all; only where these make sense,
what a small first-order model leaves.
Masked observations are not looked at.
"""

from collections.abc import Callable, Iterator

from pointing.errors import PointingError
from pointing.model.finding import Finding
from pointing.model.first_order import SMALL_MODEL
from pointing.model.mix_ups import mixed_up, no_telescope
from pointing.model.range_checks import (
    below_the_horizon,
    duplicates,
    exchanged_coordinates,
    half_turns,
    impossible_places,
    radians_as_degrees,
    too_few_stars,
)
from pointing.model.residual_checks import second_run, wrong_frame
from pointing.model.run import PointingRun

Check = Callable[[PointingRun], Iterator[Finding]]
USUAL_TERMS = 6  # zero points, collimation, non-perpendicularity, axis tilt
RANGE_CHECKS: tuple[Check, ...] = (
    impossible_places, radians_as_degrees, exchanged_coordinates, mixed_up, half_turns, below_the_horizon, duplicates,
)  # fmt: skip
RESIDUAL_CHECKS: tuple[Check, ...] = (no_telescope, wrong_frame, second_run)


def diagnose(run: PointingRun, terms: int = USUAL_TERMS) -> tuple[Finding, ...]:
    """Find the faults of a run.

    Parameters
    ----------
    run : PointingRun
        Its kept observations are looked at.
    terms : int
        How many terms shall be fitted.

    Returns
    -------
    tuple of Finding
        Empty for a good run; what makes a fit meaningless comes first.

    Raises
    ------
    PointingError
        There are less than 1 terms.
    """
    if terms < 1:
        raise PointingError(f"{terms} terms; a model has at least 1")
    kept = run.subset(run.kept)
    found = list(too_few_stars(kept, terms))
    if len(kept):
        found += _asked(RANGE_CHECKS, kept)
    if 2 * len(kept) > SMALL_MODEL and not any(finding.severity == "refuse" for finding in found):
        found += _asked(RESIDUAL_CHECKS, kept)
    return tuple(sorted(found, key=lambda finding: finding.severity != "refuse"))


def _asked(checks: tuple[Check, ...], run: PointingRun) -> list[Finding]:
    """Ask check after check; behind the first that refuses, the others would speak of its consequences."""
    found: list[Finding] = []
    for check in checks:
        found += check(run)
        if any(finding.severity == "refuse" for finding in found):
            break
    return found
