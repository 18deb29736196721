"""The errors of `pointing`: one base; the text gives the value, the bound and what to do."""


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
    """

    def __init__(self, reason: str, reachable: float | None = None) -> None:
        super().__init__(reason)
        self.reachable = reachable
