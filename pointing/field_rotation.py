"""How the sky lies at a place and how it turns there: position angles through the whole chain.

A *position angle* counts at a place on the sky from north, of the ICRS axes, through east. The *parallactic angle* is
the position angle of the zenith. What is seen of a position angle is its direction carried through the chain from the
ICRS to the observed sky, by the exact derivative: aberration, precession and refraction are all in it. Refraction
flattens the field towards the zenith, so that two directions a right angle apart are not seen so: by 2″ at 1° off the
axis at 45° altitude. Therefore a direction is carried for the position angle that is asked for, not north for all.
"""

import math

from pointing.errors import PointingError
from pointing.sky import SkyFrame
from pointing.vectors import Vector, tangent

_ZENITH: Vector = (0.0, 0.0, 1.0)
_STILL: Vector = (0.0, 0.0, 0.0)
_POLE = 1e-9  # closer than this to the pole there is no north


class SkyAt:
    """The sky around one observed direction.

    Parameters
    ----------
    frame : SkyFrame
        The sky at a moment.
    observed : Vector
        Unit vector, horizon frame.

    Raises
    ------
    PointingError
        The direction is a celestial pole, where there is no north.
    """

    def __init__(self, frame: SkyFrame, observed: Vector) -> None:
        self.observed = observed
        self._frame = frame
        self._astrometric = x, y, z = frame.astrometric(observed)
        rho = math.hypot(x, y)
        if rho < _POLE:
            raise PointingError("a position angle at the celestial pole, where there is no north: hold the horizon")
        self._north, self._east = (-z * x / rho, -z * y / rho, rho), (-y / rho, x / rho, 0.0)
        _, self._still = frame.observe_with_rate(self._astrometric, _STILL)

    def direction(self, position_angle: float) -> Vector:
        """The way on the observed sky, a unit vector along it, in which a position angle points, radians."""
        c, s = math.cos(position_angle), math.sin(position_angle)
        (a, b, d), (e, f, g) = self._north, self._east
        return tangent(self._seen((c * a + s * e, c * b + s * f, c * d + s * g)), self.observed)

    def position_angle(self, direction: Vector) -> float:
        """The position angle, in (−π, π], of a tangent on the observed sky; inverse of `direction`."""
        north, east = self._seen(self._north), self._seen(self._east)
        nn, ne, ee = _dot(north, north), _dot(north, east), _dot(east, east)
        n, e = _dot(direction, north), _dot(direction, east)
        return math.atan2(e * nn - n * ne, n * ee - e * ne)

    def _seen(self, along: Vector) -> Vector:
        """The derivative of the chain along a tangent of the ICRS: what a motion along it adds to the rate."""
        (x, y, z), (a, b, c) = self._frame.observe_with_rate(self._astrometric, along)[1], self._still
        return x - a, y - b, z - c

    @property
    def parallactic_angle(self) -> float:
        """Position angle of the zenith, positive west of the meridian; 0 where the zenith itself is looked at."""
        return self.position_angle(upright(self.observed)) if math.hypot(*self.observed[:2]) > _POLE else 0.0


def upright(observed: Vector) -> Vector:
    """The way to the zenith from an observed direction, a unit vector along the sky.

    Raises
    ------
    PointingError
        It is the zenith.
    """
    if math.hypot(observed[0], observed[1]) < _POLE:
        raise PointingError("an angle to the horizon at the zenith, where every way leads down: hold the sky")
    return tangent(_ZENITH, observed)


def turned(direction: Vector, observed: Vector, angle: float) -> Vector:
    """A tangent at an observed direction turned by an angle, as north through east."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = observed
    a, b, d = direction
    return c * a + s * (b * z - d * y), c * b + s * (d * x - a * z), c * d + s * (a * y - b * x)


def _dot(a: Vector, b: Vector) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
