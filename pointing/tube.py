"""A tube on two axes, in closed form: index errors, collimation, pointing origin and non-perpendicularity.

Directions are unit vectors in the axes' own frame: z along axis 1; axis 1 at `zero` turns axis 2's plane through x,
and the lateral angle atan2(y, x) falls as axis 1 grows. On the way out the index errors are added to both angles.
Then the tube looks γ beside the plane of axis 2, along the great circle in the direction of increasing axis 1, and
the direction is turned by ν about the horizontal point of its own meridian: TPOINT's CH and NP, or CA and NPAE.

A *pointing origin* is fixed to the tube. Its place (x, y) in the focal plane therefore acts as collimation does: x
adds to γ and y to the index of axis 2.

The way in, after Wallace 2002 (SPIE 4848, 125), for the model's own order of motions. With ρ² = X² + Y² and
B² = sin² ν + sin² γ cos² ν, the sine of the blind spot's radius about axis 1,

    axis 2 = atan2(Z, c),  c² = ρ² − B²
    axis 1 = zero − atan2(Y, X) − atan2(Z sin ν, l) − atan2(sin γ cos ν, c),  l² = ρ² − sin² ν

in normal posture; beyond, axis 2 is turned over and the two last of axis 1 change sign. Rates are the derivatives of
these, with c ċ = l l̇ = ρ ρ̇.
"""

import math
from dataclasses import dataclass, field

from pointing.errors import Unreachable
from pointing.vectors import Vector, tangent

AngleRates = tuple[tuple[float, float], tuple[float, float]]

_POLE = 1e-12  # closer to axis 1 than this, its angle is taken as 0 and its rate as 0: there is none
_GRAZING = 1e-12  # square of the reach below which a tube that looks aside passes the pole by


def turn_of_axis2(*, equatorial: bool, latitude: float) -> float:
    """What both angles of axis 2 that see one direction add up to, radians: π, or −π on a southern equatorial mount.

    So the declination axis goes on over the visible pole. It stands here, and not beside `Frame.beyond_the_pole`, for
    those who do without NumPy.
    """
    return -math.pi if equatorial and latitude < 0.0 else math.pi


@dataclass(frozen=True)
class Tube:
    """A tube on two axes.

    Parameters
    ----------
    zero : float
        Lateral angle, radians, at which axis 1 reads nothing.
    turn : float
        What both angles of axis 2 that see one direction add up to, radians: see `turn_of_axis2`.
    collimation : float
        γ, radians, pointing origin included.
    skew : float
        ν, radians.
    index1, index2 : float
        Added to the angle of an axis, radians; that of axis 2 with the pointing origin.
    aside : str
        For refusals: what does not come to the pole within `{blind}` degrees, and what helps.
    """

    zero: float
    turn: float
    collimation: float = 0.0
    skew: float = 0.0
    index1: float = 0.0
    index2: float = 0.0
    aside: tuple[str, str] = ("", "")
    _straight: bool = field(init=False, repr=False, compare=False)
    _across: tuple[float, float] = field(init=False, repr=False, compare=False)  # sin γ, cos γ
    _askew: tuple[float, float] = field(init=False, repr=False, compare=False)  # sin ν, cos ν
    _blind: float = field(init=False, repr=False, compare=False)  # B

    def __post_init__(self) -> None:
        sin_g, cos_g = math.sin(self.collimation), math.cos(self.collimation)
        sin_n, cos_n = math.sin(self.skew), math.cos(self.skew)
        object.__setattr__(self, "_straight", not (self.collimation or self.skew))
        object.__setattr__(self, "_across", (sin_g, cos_g))
        object.__setattr__(self, "_askew", (sin_n, cos_n))
        object.__setattr__(self, "_blind", math.hypot(sin_n, sin_g * cos_n))

    def beyond(self, axis2: float) -> bool:
        """Whether the pointing origin is beyond the pole of axis 1 at an angle of axis 2."""
        return math.cos(axis2 + self.index2) < 0.0

    def direction(self, axis1: float, axis2: float) -> Vector:
        """Where the pointing origin looks at these angles; inverse of `axes`."""
        lateral, up = self.zero - axis1 - self.index1, axis2 + self.index2
        c, z = math.cos(up), math.sin(up)
        x, y = math.cos(lateral), math.sin(lateral)
        if self._straight:
            return c * x, c * y, z
        (sin_g, cos_g), (sin_n, cos_n) = self._across, self._askew
        along = c * cos_g
        z *= cos_g
        x, y = along * x + sin_g * y, along * y - sin_g * x
        if sin_n:
            turned = z * sin_n / math.copysign(math.hypot(along, sin_g), c)
            x, y, z = x + turned * y, y - turned * x, z * cos_n
        return x, y, z

    def up(self, axis1: float, axis2: float) -> Vector:
        """How the tube is rolled: the way on the sky, a unit vector, that its upper side points at these angles.

        The upper side is the one towards which axis 2 grows. It is fixed to the tube, and so turned over beyond the
        pole. That the tube turns about axis 2, which stands askew by ν about the horizontal that axis 2's plane
        contains, makes it −s f + c (z cos ν + k sin ν) for the horizontal f along and k across that plane.
        """
        lateral, up = self.zero - axis1 - self.index1, axis2 + self.index2
        s, c = math.sin(up), math.cos(up)
        x, y = math.cos(lateral), math.sin(lateral)
        sin_n, cos_n = self._askew
        rolled = c * sin_n * y - s * x, -c * sin_n * x - s * y, c * cos_n
        return tangent(rolled, self.direction(axis1, axis2))

    def axes(self, direction: Vector, *, beyond: bool) -> tuple[float, float]:
        """Angles of both axes at which the pointing origin looks in a direction.

        Raises
        ------
        Unreachable
            The direction is in the blind spot about axis 1.
        """
        x, y, z = direction
        axis1, reach = self.zero - math.atan2(y, x), math.hypot(x, y)
        if not self._straight:
            rho, reach = reach, self._reach(reach)
            aside = math.atan2(self._across[0] * self._askew[1], reach)
            if sin_n := self._askew[0]:
                aside += math.atan2(z * sin_n, math.sqrt(rho * rho - sin_n * sin_n))
            axis1 += aside if beyond else -aside
        axis2 = math.atan2(z, reach)
        if beyond:
            return axis1 + math.pi - self.index1, self.turn - axis2 - self.index2
        return axis1 - self.index1, axis2 - self.index2

    def axes_and_rates(self, direction: Vector, rate: Vector, *, beyond: bool) -> AngleRates:
        """Angle and rate of each axis that keep the pointing origin on a moving direction.

        Parameters
        ----------
        direction, rate : Vector
            Unit vector and its derivative per second.
        beyond : bool
            Whether to point there over the pole of axis 1.

        Returns
        -------
        tuple
            ((angle, rate) of axis 1, (angle, rate) of axis 2), radians and radians per second.

        Raises
        ------
        Unreachable
            As for `axes`.
        """
        x, y, z = direction
        vx, vy, vz = rate
        outwards, rho2 = x * vx + y * vy, x * x + y * y
        reach = rho = math.sqrt(rho2)
        axis1 = self.zero - math.atan2(y, x)
        aside = turning = 0.0
        if not self._straight:
            reach = self._reach(rho)
            aside, turning = self._aside(z, vz, rho2, reach, outwards)
        axis2 = math.atan2(z, reach)
        if rho < _POLE:
            rate1, rate2 = 0.0, math.copysign(math.hypot(vx, vy), -z)
        else:
            rate1 = (y * vx - x * vy) / rho2
            rate2 = (vz * reach - z * outwards / reach) / (reach * reach + z * z)
        if beyond:
            return (
                (axis1 + aside + math.pi - self.index1, rate1 + turning),
                (self.turn - axis2 - self.index2, -rate2),
            )
        return (axis1 - aside - self.index1, rate1 - turning), (axis2 - self.index2, rate2)

    def _aside(self, z: float, vz: float, rho2: float, reach: float, outwards: float) -> tuple[float, float]:
        """By how much axis 1 stands back for collimation and non-perpendicularity, and its derivative."""
        sin_n, cos_n = self._askew
        across, level2 = self._across[0] * cos_n, rho2 - sin_n * sin_n
        aside, turning = math.atan2(across, reach), -across * outwards / (reach * level2)
        if sin_n:
            level = math.sqrt(level2)
            aside += math.atan2(z * sin_n, level)
            turning += sin_n * (vz * level - z * outwards / level) / (level2 + (z * sin_n) ** 2)
        return aside, turning

    def _reach(self, rho: float) -> float:
        """Return c, for a direction whose distance from axis 1 has the sine `rho`.

        Raises
        ------
        Unreachable
            There is none: the tube passes by.
        """
        reach2 = (rho - self._blind) * (rho + self._blind)
        if reach2 < _GRAZING:
            blind, here = (math.degrees(math.asin(min(sine, 1.0))) for sine in (self._blind, rho))
            what, remedy = self.aside
            raise Unreachable(
                f"the place is {here:.4f}° from the pole of axis 1, where {what.format(blind=blind)}: {remedy}"
            )
        return math.sqrt(reach2)
