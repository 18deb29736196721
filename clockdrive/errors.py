"""The errors of the application: one base; each text gives the value, the bound and what to do next."""

import math
from collections.abc import Sequence
from numbers import Real

from pointing.errors import TargetError


class ClockdriveError(Exception):
    """Base of all errors of `clockdrive`."""


class ConfigurationError(ClockdriveError):
    """The configuration cannot be used.

    Attributes
    ----------
    problems : tuple of str
        Everything that is wrong with it, one sentence each.
    """

    def __init__(self, source: str, problems: Sequence[str]) -> None:
        self.problems = tuple(problems)
        count = "a problem" if len(self.problems) == 1 else f"{len(self.problems)} problems"
        super().__init__("\n  ".join((f"{source} has {count}:", *self.problems)))


class Refused(ClockdriveError):  # noqa: N818 - what the session does
    """The telescope will not do this now, and nothing has moved.

    Attributes
    ----------
    reason : str
        Why, with the value and the bound.
    reachable_utc : float or None
        POSIX seconds from which it can be done, when that is known.
    """

    def __init__(self, reason: str, reachable_utc: float | None = None) -> None:
        self.reason = reason
        self.reachable_utc = reachable_utc
        super().__init__(reason)


class OwnedElsewhere(ClockdriveError):  # noqa: N818 - what was found
    """Another process owns the telescope; the text says which one and what to do."""


class OwnerGone(ClockdriveError):  # noqa: N818 - what happened
    """The owner of the telescope ended, or closed the connection, before it answered."""


class StateError(ClockdriveError):
    """The state store cannot be read or written; the text says how to repair it."""


class WeatherError(ClockdriveError):
    """A source of weather gave no usable values; the text says what it gave and what to do."""


class InputError(ClockdriveError):
    """A time, a duration or a pair of counts is not written as it must be."""


class ArgumentError(InputError, Refused):
    """An argument that can never be right, whatever the telescope: no number, or outside what the command takes."""


class TargetFormError(InputError, TargetError):
    """A target is not written as one must be."""


def finite(what: str, value: object, unit: str) -> float:
    """Return a number that somebody gave.

    Raises
    ------
    ArgumentError
        It is none, or not finite.
    """
    if isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value):
        return float(value)
    raise ArgumentError(f"{what} {value!r}: give a finite number of {unit}")
