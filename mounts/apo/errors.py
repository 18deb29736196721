"""What can be wrong between host and axis controller; failures of the line itself are errors of `transports`."""

from mounts.errors import DriveError


class ApoError(DriveError):
    """Base of all errors of `mounts.apo`."""


class ImpossibleCommand(ApoError):  # noqa: N818 - what was asked for
    """The manual has no such command, or not with these arguments, or its line would be too long."""


class MalformedReply(ApoError):  # noqa: N818 - what came
    """A reply that is not what its command is answered with."""


class CommandRefused(ApoError):  # noqa: N818 - what the controller did
    """The controller answered `ERR:`; the command was not carried out.

    Attributes
    ----------
    reason : str
        The controller's own words behind `ERR:`.
    """

    def __init__(self, message: str, reason: str) -> None:
        super().__init__(message)
        self.reason = reason
