"""The sky over a simulated telescope, which knows where the telescope really points."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from clockdrive.control import Steps
from clockdrive.gear_teeth import GearTeeth
from clockdrive.witness import Sighting
from pointing.gearing import Gearing
from pointing.vectors import Vector
from transports.link import Clock

if TYPE_CHECKING:
    from clockdrive.configuration import Configuration
    from clockdrive.drives.kind import Simulated
    from mounts.true_mount import TrueMount

Call = Callable[[Callable[[], Any]], Any]
_ARCSEC = math.radians(1.0 / 3600.0)
_SURE_ARCSEC = 0.5  # of a look without noise: the drive counts whole units


class SimulatedSky:
    """The true sky of a simulated drive: its true positions, through the true gears and the true mount.

    It is a witness, too: a look is a Gaussian `noise_arcsec` off, the mean square of the distance on the sky, the
    same for each place at which one looks whenever that is.

    Parameters
    ----------
    device : Simulated
        The drive.
    gearings : tuple of Gearing
        What its motors really turn.
    mount : TrueMount
        What the axes really point at.
    clock : Clock
        The time.
    noise_arcsec : float
        Of a look.
    seed : int
        Of that noise.
    call : callable
        Where the drive may be asked; with a control thread, on that.
    """

    def __init__(
        self,
        device: "Simulated",
        gearings: tuple[Gearing, Gearing],
        mount: "TrueMount",
        clock: Clock,
        noise_arcsec: float = 0.0,
        seed: int = 1,
        call: Call = lambda work: work(),
    ) -> None:
        self._device, self._gearings, self.mount, self._clock = device, gearings, mount, clock
        self._noise_arcsec, self._seed, self._call = noise_arcsec, seed, call
        self._ahead = 1.0  # or −1, where the visible end of the polar axis is the south end

    @classmethod
    def of(
        cls, device: "Simulated", configuration: "Configuration", clock: Clock, call: Call = lambda work: work()
    ) -> "SimulatedSky":
        """The sky of the embedded simulator, which is built as the configuration says."""
        from clockdrive.drives import kind_of  # noqa: PLC0415 - only where a simulator is the witness
        from clockdrive.drives.kind import Geared  # noqa: PLC0415 - likewise
        from mounts.true_mount import TrueMount  # noqa: PLC0415 - likewise

        gear = configuration.values.get("axis1.main_gear")
        worm = 1.0 / float(gear) if isinstance(gear, GearTeeth) else 1.0  # turns of the worm a turn of axis 1
        latitude = math.radians(configuration.site.latitude_deg)
        simulator = configuration.simulator
        errors = replace(simulator, backlash_arcsec=0.0) if isinstance(device, Geared) else simulator
        mount = TrueMount(errors, configuration.mount.type, latitude, worm)
        one, two = (axis.gearing for axis in kind_of(configuration).axes(configuration))
        made = cls(device, (one, two), mount, clock, simulator.sky_noise_arcsec, simulator.seed, call)
        if configuration.mount.type != "altaz-fork" and latitude < 0.0:
            made._ahead = -1.0
        return made

    def observed(self) -> Vector:
        """The observed direction at which the tube really points now, horizon frame."""
        seen: Vector = self._call(self._truly_observed)
        return seen

    def _truly_observed(self) -> Vector:
        self._device.advance(self._clock.now())
        one, two = (
            gearing.angle(self._device.true_position(axis)) for axis, gearing in enumerate(self._gearings, start=1)
        )
        return self.mount.turn(one, two)

    def look(self) -> Steps[Sighting]:
        """See where the tube points, as well as one can."""
        yield 0.0
        seen = self._blurred(self.observed())
        return Sighting(seen, self._clock.now(), max(self._noise_arcsec, _SURE_ARCSEC))

    def turn_knobs(self, first_arcsec: float, second_arcsec: float) -> None:
        """Turn the knobs under the mount, as an alignment advises.

        Parameters
        ----------
        first_arcsec : float
            By how much the end of the polar axis at the visible pole rises; the north side of an altazimuth mount.
        second_arcsec : float
            By how much that end goes east, about the vertical; the west side of an altazimuth mount rises.
        """
        first, second = (self._ahead * each * _ARCSEC for each in (first_arcsec, second_arcsec))
        self._call(lambda: self.mount.lean(first, second))

    def _blurred(self, direction: Vector) -> Vector:
        if not self._noise_arcsec:
            return direction
        x, y, z = direction
        chance = random.Random(f"{self._seed} {x:.4f} {y:.4f} {z:.4f}")  # noqa: S311 - 20 arcseconds are one place
        sigma = self._noise_arcsec * _ARCSEC / math.sqrt(2.0)
        across, up = chance.gauss(0.0, sigma), chance.gauss(0.0, sigma)
        level = math.hypot(x, y)
        one = (-y / level, x / level, 0.0) if level else (1.0, 0.0, 0.0)
        two = (-z * one[1], z * one[0], level) if level else (0.0, 1.0, 0.0)
        off = tuple(here + across * a + up * b for here, a, b in zip(direction, one, two, strict=True))
        size = math.sqrt(sum(each * each for each in off))
        return off[0] / size, off[1] / size, off[2] / size
