"""The mount registers X and Y in force: the configured ones, or what a polar alignment has put in their place.

What an alignment writes is in force until the telescope is closed, or cleared by its name in `status`. From then on
it is the configuration of this telescope, for `drive diff` and `drive push` as well.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from clockdrive.configuration import Configuration, Origin
from clockdrive.session import Session
from clockdrive.state import StateStore

NAMES = ("mount x", "mount y")
"""Of the corrections, in `status`."""
ALIGNED: Origin = "polar alignment"
"""Their origin, where an alignment has written them."""
_KEYS = ("mount.mount_x_mas", "mount.mount_y_mas")
_MAS = math.radians(1.0 / 3_600_000.0)
_OF_THE_UNIT = "mount registers"  # what was read from it last, as the store knows it


class MountRegisters:
    """Puts mount registers in force.

    Parameters
    ----------
    session : Session
        Whose telescope; as it is opened, with the configured registers.
    configuration : Configuration
        Of that telescope.
    changed : callable
        Given the configuration whenever it has become another.
    """

    def __init__(
        self, session: Session, configuration: Configuration, changed: Callable[[Configuration], object]
    ) -> None:
        self._session, self._configured, self._changed = session, configuration, changed
        self.by_hand = False
        if configuration.origins[_KEYS[0]] == "unit":
            given = {key: configuration.values[key] for key in _KEYS}
            session.store.learn(_OF_THE_UNIT, given, session.clock.now())

    @property
    def in_force(self) -> tuple[float, float]:
        """X and Y, radians."""
        mount = self._session.planner.mount
        return mount.x, mount.y

    def write(self, x_mas: int, y_mas: int) -> None:
        """Point with other registers from now on; the telescope stops.

        Raises
        ------
        Refused
            The telescope is slewing.
        """
        values = dict(zip(_KEYS, (x_mas, y_mas), strict=True))
        origins = dict.fromkeys(_KEYS, ALIGNED)
        configured = self._configured
        self._put(
            replace(
                configured,
                mount=replace(configured.mount, mount_x_mas=x_mas, mount_y_mas=y_mas),
                values={**configured.values, **values},
                origins={**configured.origins, **origins},
            ),
            "by polar alignment",
        )
        self.by_hand = True

    def clear(self) -> None:
        """Let the configured registers be in force again, both of them; the telescope stops.

        Raises
        ------
        Refused
            The telescope is slewing.
        """
        self._put(self._configured, "as configured")
        self.by_hand = False

    def _put(self, configuration: Configuration, why: str) -> None:
        session = self._session
        session.require_free(parked=True)
        if session.pursuit is not None:
            session.stop()
        one, two = configuration.mount.mount_x_mas, configuration.mount.mount_y_mas
        session.planner.mount = replace(session.planner.mount, x=one * _MAS, y=two * _MAS)
        session.history.forget("other mount registers were put in force after it")
        self._changed(configuration)
        session.note("mount registers", f"mount_x_mas {one}, mount_y_mas {two}, {why}")


def configured(configuration: Configuration, store: StateStore) -> tuple[float, float]:
    """X and Y that will be in force, radians, with no drive at hand: those left to the unit as last read from it."""
    known = store.learnt(_OF_THE_UNIT) if _KEYS[0] in configuration.left_to_the_unit() else {}
    if configuration.simulated:  # whose registers are given by the configuration
        known = {}
    one, two = (float(str(known.get(key, configuration.values[key]))) * _MAS for key in _KEYS)
    return one, two
