"""The errors of `pointing`: one base; the text gives the value, the bound and what to do."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pointing.limits import Check


class PointingError(Exception):
    """Base of all errors of `pointing`."""


class TargetError(PointingError):
    """The target cannot be understood or is not known."""


class Unreachable(PointingError):  # noqa: N818 - the word of the refusal
    """The telescope cannot or must not go there.

    Attributes
    ----------
    reachable : float or None
        POSIX time at which the target can first be reached; None when not within a day.
    checks : tuple of Check
        All that was asked of the quickest way there, failed and passed.
    """

    def __init__(self, reason: str, reachable: float | None = None, checks: "tuple[Check, ...]" = ()) -> None:
        super().__init__(reason)
        self.reachable = reachable
        self.checks = checks
