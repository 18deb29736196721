"""Pointing origins by name: on which place of the focal plane targets are put.

Origins are fixed to the tube, of a telescope with a rotator too: what turns with the rotator, such as a camera, has
its origin on the rotator's axis, where turning leaves it; what does not, such as a guider, may have it anywhere.

An origin beside the tube's axis is not the only thing that must stay clear of horizon and Sun: the tube looks along
its axis, and with it all between the two. So the limits are kept wider by the origin's distance while it is in force.
"""

import math
from collections.abc import Mapping
from dataclasses import replace

from clockdrive.configuration_sections import InstrumentSection
from clockdrive.errors import Refused
from pointing.planner import Planner
from pointing.targets import ARCSEC

_DEFAULT = "main"


class Instruments:
    """The instruments of one telescope, one of which is in force.

    Parameters
    ----------
    planner : Planner
        Points along the tube, with the configured limits; from here on it points with the instrument in force.
    sections : mapping
        Pointing origins by name.
    name : str, optional
        Which is in force at first; by default `main`, or the first where none has that name.

    Raises
    ------
    Refused
        There is no such instrument.
    """

    def __init__(self, planner: Planner, sections: Mapping[str, InstrumentSection], name: str | None = None) -> None:
        self.planner = planner
        self.sections = sections
        self._limits = planner.limits
        self.name = ""
        self.take(name or (_DEFAULT if _DEFAULT in sections else next(iter(sections))))

    def take(self, name: str) -> None:
        """Put targets on this instrument from now on.

        Raises
        ------
        Refused
            There is no such instrument.
        """
        self.require(name)
        section, planner = self.sections[name], self.planner
        mount = replace(planner.mount, origin_x=section.x_arcsec * ARCSEC, origin_y=section.y_arcsec * ARCSEC)
        planner.limits = self._limits.widened(mount.origin_distance)
        planner.mount = mount
        self.name = name

    @property
    def notes(self) -> tuple[str, ...]:
        """What a plan says of an origin beside the axis."""
        distance = self.planner.mount.origin_distance
        if not distance:
            return ()
        section = self.sections[self.name]
        place = f"x {section.x_arcsec:g}″, y {section.y_arcsec:g}″"
        wider = f"horizon and Sun are kept {math.degrees(distance):.2f}° wider, for the tube"
        said = f"the target is put on {self.name}, {place} from the tube's axis; {wider}"
        turned = f"{self.name} is fixed to the tube: a rotator turns the instrument, and not where the target is put"
        return (said,) if self.planner.rotator is None else (said, turned)

    def require(self, name: str) -> None:
        """Refuse a name that no instrument has.

        Raises
        ------
        Refused
            It is none.
        """
        if name not in self.sections:
            known = ", ".join(self.sections)
            raise Refused(f"no instrument {name!r}: there is {known}; a table [instruments.NAME] adds one")
