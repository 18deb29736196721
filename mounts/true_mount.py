"""Where a simulated telescope really points, which nobody in the control software knows.

The rigid mount: the tube with its collimation error turns about axis 2, which stands askew on axis 1, which stands
askew on the sky; the tube droops towards the ground. Worm and play stand between motor and axis. The rotations are
worked out here with matrices, apart from the formulas of the pointing mathematics, so that the two prove each other.

Base frame of equatorial mounts: x to the meridian on the equator, y east, z the north celestial pole; of altazimuth
mounts and of the directions returned: x south, y east, z zenith. Signs are those of TPOINT: a coefficient is what is
added to the telescope's place to obtain the star's.
"""

from dataclasses import dataclass
from math import acos, asin, atan2, cos, degrees, radians, sin, sqrt, tau
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

MountType = Literal["equatorial-fork", "german", "altaz-fork"]
Direction = tuple[float, float, float]
Matrix = NDArray[np.float64]


class MountErrors(Protocol):
    """What is wrong with a mount, in arcseconds; `SimulatorSettings` has these and more."""

    @property
    def misalignment_x_arcsec(self) -> float:
        """Rotation of the mount's axes from the sky's about x."""
        ...

    @property
    def misalignment_y_arcsec(self) -> float:
        """The same about y; both are components of one rotation vector."""
        ...

    @property
    def collimation_arcsec(self) -> float:
        """CH of an equatorial mount, CA of an altazimuth mount."""
        ...

    @property
    def nonperpendicularity_arcsec(self) -> float:
        """NP of an equatorial mount, NPAE of an altazimuth mount."""
        ...

    @property
    def flexure_arcsec(self) -> float:
        """TF: the star stands this much times sin Z farther from the zenith than the tube."""
        ...

    @property
    def periodic_error_arcsec(self) -> float:
        """Amplitude of the worm of axis 1."""
        ...

    @property
    def backlash_arcsec(self) -> float:
        """Play of both axes, from stop to stop."""
        ...


def rotation(x: float, y: float, z: float) -> Matrix:
    """Active rotation by the rotation vector (x, y, z), radians: Rodrigues' formula."""
    angle = sqrt(x * x + y * y + z * z)
    if angle == 0.0:
        return np.eye(3)
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) / angle
    turned: Matrix = np.eye(3) + sin(angle) * k + (1.0 - cos(angle)) * (k @ k)
    return turned


@dataclass
class Play:
    """The gears' play on one axis: it follows once the motor has crossed the gap.

    `play` is the whole gap and `place` where the axis is, radians.
    """

    play: float
    place: float | None = None

    def follow(self, motor: float) -> float:
        """Where the axis is when the motor's end has come to `motor`."""
        half = self.play / 2.0
        place = motor if self.place is None else min(max(self.place, motor - half), motor + half)
        self.place = place
        return place


class TrueMount:
    """The mechanics between the motors and the sky.

    Parameters
    ----------
    errors : MountErrors
        What is wrong with it.
    mount_type : str
        As in the configuration.
    latitude : float
        Radians, north positive.
    worm_turns : float
        Turns of the worm for one turn of axis 1.
    """

    def __init__(
        self,
        errors: MountErrors,
        mount_type: MountType,
        latitude: float,
        worm_turns: float = 285.0,
    ) -> None:
        self._errors = errors
        self._altazimuth = mount_type == "altaz-fork"
        self._worm_turns = worm_turns
        arcsec = radians(1.0 / 3600.0)
        self._flexure = errors.flexure_arcsec * arcsec
        self._periodic = errors.periodic_error_arcsec * arcsec
        self._plays = (Play(errors.backlash_arcsec * arcsec), Play(errors.backlash_arcsec * arcsec))
        sense = 1.0 if self._altazimuth else -1.0  # hour angle runs against the rotation about the pole
        collimation = sense * errors.collimation_arcsec * arcsec
        self._tube = np.array([cos(collimation), sin(collimation), 0.0])
        self._skew = rotation(sense * errors.nonperpendicularity_arcsec * arcsec, 0.0, 0.0).T
        self._tilt = rotation(errors.misalignment_x_arcsec * arcsec, errors.misalignment_y_arcsec * arcsec, 0.0)
        self._horizon = np.eye(3) if self._altazimuth else rotation(0.0, latitude - tau / 4.0, 0.0)

    def observed(self, axis1: float, axis2: float) -> Direction:
        """Unit vector of the observed place when the axes stand at these angles; x south, y east, z zenith.

        Angles are radians: mechanical hour angle and declination, or azimuth and elevation, beyond ±90° of axis 2
        being the other posture.
        """
        about_pole = tau / 2.0 - axis1 if self._altazimuth else -axis1
        tube = rotation(0.0, -axis2, 0.0) @ self._tube
        base = self._tilt @ rotation(0.0, 0.0, about_pole) @ self._skew @ tube
        x, y, z = (float(component) for component in self._horizon @ base)
        return self._droop(x, y, z)

    def turn(self, motor1: float, motor2: float) -> Direction:
        """Observed place after the motors brought the axes towards these angles; play remembers the way they came."""
        axis1 = self._plays[0].follow(motor1 + self._periodic * sin(self._worm_turns * motor1))
        return self.observed(axis1, self._plays[1].follow(motor2))

    def lean(self, first: float, second: float) -> None:
        """Turn the whole mount on the ground, radians: its north end up, then eastward about the zenith.

        Under an altazimuth mount it is its north side up, then its west side.
        """
        up = rotation(0.0, first, 0.0)
        then = rotation(-second, 0.0, 0.0) if self._altazimuth else rotation(0.0, 0.0, -second)
        self._tilt = self._horizon.T @ then @ up @ self._horizon @ self._tilt

    @property
    def pole(self) -> Direction:
        """Where axis 1 really points, its end of increasing axis 2; x south, y east, z zenith."""
        x, y, z = (float(component) for component in self._horizon @ self._tilt[:, 2])
        return x, y, z

    def _droop(self, x: float, y: float, z: float) -> Direction:
        """Move the direction away from the zenith by TF sin Z."""
        across = sqrt(x * x + y * y)
        if not self._flexure or across == 0.0:
            return x, y, z
        zenith_distance = atan2(across, z)
        zenith_distance += self._flexure * sin(zenith_distance)
        scale = sin(zenith_distance) / across
        return x * scale, y * scale, cos(zenith_distance)


def separation_arcsec(a: Direction, b: Direction) -> float:
    """Angle between two unit vectors, arcseconds, exact for small angles too."""
    dot = sum(p * q for p, q in zip(a, b, strict=True))
    half = sqrt(sum((p - q) ** 2 for p, q in zip(a, b, strict=True))) / 2.0
    return degrees(2.0 * asin(half) if half < 0.7 else acos(max(-1.0, min(1.0, dot)))) * 3600.0
