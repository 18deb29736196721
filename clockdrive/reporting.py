"""What a motion tells of its progress, to a callback of whoever asked for it: its failure is not the telescope's."""

from collections.abc import Callable
from typing import TypeVar

from clockdrive.errors import ClockdriveError

T = TypeVar("T")


class ReportFailed(ClockdriveError):  # noqa: N818 - what happened
    """The callback failed; the motion ends with that.

    Attributes
    ----------
    error : Exception
        What it raised, which is what its caller gets.
    """

    def __init__(self, error: Exception) -> None:
        self.error = error
        super().__init__(f"the callback `progress` failed with {error!r}; the telescope was stopped")


def tell(report: Callable[[T], object], progress: T) -> None:
    """Call back.

    Raises
    ------
    ReportFailed
        The callback raised what no call to the telescope inside it does.
    """
    try:
        report(progress)
    except ClockdriveError:
        raise
    except Exception as error:
        raise ReportFailed(error) from error
