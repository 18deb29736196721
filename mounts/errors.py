"""The errors of the drives: one base; the text says what was found and what to do."""


class DriveError(Exception):
    """Base of all errors of `mounts`."""


class Unsynchronised(DriveError):  # noqa: N818 - the word of the status display
    """The position may be wrong, so nothing may be pointed by it; `sync` repairs."""


class DriveRefused(DriveError):  # noqa: N818 - what the drive did
    """The drive is in a state in which it must not or cannot move: standby, alarm, undecided format."""


class StillMoving(DriveRefused):
    """A stop has done all that it can: what is under way ends by itself, and the text says when."""


class WrongProtocol(DriveError):  # noqa: N818 - what was found at the other end
    """What answers at this link is not the drive of the configuration."""
