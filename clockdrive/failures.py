"""What can go wrong with a telescope and is told in a sentence: the base errors of the four packages."""

from clockdrive.errors import ClockdriveError
from mounts.errors import DriveError
from pointing.errors import PointingError
from transports.errors import TransportError

FAILURES = (ClockdriveError, DriveError, PointingError, TransportError)
