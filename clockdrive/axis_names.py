"""What people call the axes: by number, as the configuration does, or as altazimuth controllers do."""

from clockdrive.errors import ArgumentError

NAMES: tuple[tuple[str, ...], ...] = (
    ("1", "axis1", "azimuth", "az"),
    ("2", "axis2", "altitude", "alt"),
    ("3", "rotator", "rot"),
)
"""Every name of each axis that a command takes, in axis order."""
WORDS = "1, axis1 or azimuth; 2, axis2 or altitude; 3 or rotator"


def axis_of(text: str | int, count: int) -> int:
    """The number of an axis, from 0, of a telescope that has so many.

    Raises
    ------
    ArgumentError
        No axis is called so.
    """
    word = str(text).strip().lower()
    found = next((i for i, names in enumerate(NAMES) if word in names), None)
    if found is None:
        raise ArgumentError(f"axis {text!r}: use {WORDS}")
    if found >= count:
        raise ArgumentError(f"axis {text!r}: this telescope has no rotator; a table [rotator] says that there is one")
    return found
