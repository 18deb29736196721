"""What is asked of an AWR Microstep that it cannot do, or says that it should not."""

from mounts.errors import DriveError


class AwrError(DriveError):
    """A command, register or value that the unit does not have; the text says what it has."""
