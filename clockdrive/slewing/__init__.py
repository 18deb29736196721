"""The commands that take time: goto, park, home, jog. Each is a run of steps in the control loop's foreground."""

from clockdrive.slewing.jogging import Jogging
from clockdrive.slewing.one_slew import Progress, Report
from clockdrive.slewing.to_target import Arrival, ToTarget

__all__ = ["Arrival", "Progress", "Report", "Slewing"]


class Slewing(ToTarget, Jogging):
    """Moves the telescope of a session.

    Parameters
    ----------
    session : Session
        Reads, checks and stops it meanwhile.
    """
