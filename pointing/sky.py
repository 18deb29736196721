"""From the astrometric direction of a target to where it is seen, and back.

`Sky(site).at(instant)` gives a `SkyFrame`, which holds all that depends on time and place; its `observe` takes a
direction through light deflection by the Sun, aberration, precession-nutation, Earth rotation and refraction. ERFA's
`apco`, `atciqz` and `atioq` are the authority: the same formulas, with Earth and pole from `ephemeris`, and the chain
of rotations multiplied out once a frame. Astrometric directions are unit vectors of the ICRS axes, observed ones of
the horizon frame (x south, y east, z zenith). Plain floats throughout: this is the planner's hot path.

What is near the Earth has a place instead, in metres from its centre and in TEME, the axes in which the orbits of
satellites are given: `from_teme`, `topocentric` and `observe_near` take it to where it is seen. It goes with the
Earth, so there is no annual aberration.
"""

import math
from functools import lru_cache, partial

from pointing.earth_orientation import EarthOrientationSource, earth_orientation
from pointing.ephemeris import ephemeris, pole_rate
from pointing.instant import DAY, Instant
from pointing.refraction import lowered, refract, refract_with_rate, refraction, unrefract
from pointing.site import Site
from pointing.vectors import Vector

AU_M = 149597870.7e3
YEAR_DAYS = 365.25
_J2000 = 51544.5
LIGHT_M_S = 299792458.0
_LIGHT_AU_S = LIGHT_M_S / AU_M
_LIGHT_AU_DAY = 1.0 / (_LIGHT_AU_S * DAY)  # au a day in units of the speed of light
_SCHWARZSCHILD_AU = 1.97412574336e-8  # of the Sun
_ROTATION = 1.00273781191135448 * math.tau / DAY  # of the Earth, rad/s
_ROTATION_DAY = _ROTATION * DAY
SIDEREAL_ROTATION = 1.00273790935 * math.tau / DAY  # of the Earth against its mean equinox (GMST82), rad/s
_SUN_GRAVITY = 0.01720209895**2 * _LIGHT_AU_DAY / DAY  # au² × c/s
_EQUATOR_M, _FLATTENING = 6378137.0, 1.0 / 298.257223563  # WGS84
_TIO = -47e-6 * math.pi / 648000.0 / 36525.0  # s′ a day, IERS Conventions 2003 (sp00)
_FRAMES = 32  # that are kept: planner, pursuit, checks and status ask for the same moments, a path for a few ahead
_CLOSED = 1e-15  # rad, what is left when the inverse has converged

Matrix = tuple[float, float, float, float, float, float, float, float, float]


class Sky:
    """The sky over one site.

    Parameters
    ----------
    site : Site
        Place and weather.
    earth_orientation : callable
        Gives the Earth's orientation at an instant; the bundled IERS table by default.
    """

    def __init__(self, site: Site, earth_orientation: EarthOrientationSource = earth_orientation) -> None:
        self.site = site
        self.earth_orientation = earth_orientation
        self.refraction_constants = site.weather.refraction_constants()
        self.column_m = site.weather.column_m()
        sp, cp = math.sin(site.latitude), math.cos(site.latitude)
        sl, cl = math.sin(site.longitude), math.cos(site.longitude)
        # Rows: south, east and zenith in the axes of the Earth.
        self.local = (sp * cl, sp * sl, -cp, -sl, cl, 0.0, cp * cl, cp * sl, sp)
        flat = (1.0 - _FLATTENING) ** 2
        curvature = _EQUATOR_M / math.sqrt(cp * cp + flat * sp * sp)
        equatorial, polar = (curvature + site.height_m) * cp, (flat * curvature + site.height_m) * sp
        # The observer from the Earth's centre, au, along south and zenith.
        self.south_au = (sp * equatorial - cp * polar) / AU_M
        self.zenith_au = (cp * equatorial + sp * polar) / AU_M
        # His speed, to the east, in units of the speed of light.
        self.east_c = _ROTATION * equatorial / LIGHT_M_S
        self._frames = lru_cache(maxsize=_FRAMES)(partial(SkyFrame, self))

    def at(self, instant: Instant) -> "SkyFrame":
        """The sky at a moment: what ERFA's `apco` prepares. One that was asked for lately is there already."""
        return self._frames(instant)

    def refraction(self, altitude: float) -> float:
        """How much refraction lifts a direction seen at an *observed* altitude, radians."""
        return refraction(altitude, *self.refraction_constants)


class SkyFrame:
    """The sky at one moment; made by `Sky.at`.

    Attributes
    ----------
    instant : Instant
        The moment.
    sky : Sky
        The site's sky it is of.
    earth_orientation : EarthOrientation
        What was used, with a note when it may be wrong.
    years : float
        Julian years of TT since J2000.
    position_au, velocity_c : Vector
        The observer's barycentric position in au and velocity in units of the speed of light, ICRS axes.
    geocentric_au, spin_au_day : Vector
        The observer's position from the Earth's centre in au, and the velocity in au a day at which the Earth's turn
        carries it round, ICRS axes.
    """

    __slots__ = (
        "_from_sun",
        "_lorentz",
        "_pole",
        "_rotation",
        "_sun",
        "_sun_au",
        "earth_orientation",
        "geocentric_au",
        "instant",
        "position_au",
        "sky",
        "spin_au_day",
        "velocity_c",
        "years",
    )

    def __init__(self, sky: Sky, instant: Instant) -> None:
        self.instant = instant
        self.sky = sky
        self.earth_orientation = orientation = sky.earth_orientation(instant)
        dut1, xp, yp, *_ = orientation
        x, y, z, vx, vy, vz, hx, hy, hz, pole_x, pole_y, cio = ephemeris(instant)
        self.years = (instant.day - _J2000 + instant.seconds / DAY) / YEAR_DAYS
        day, seconds = instant.utc()
        turned = (seconds + dut1) / DAY
        days = day - _J2000 + turned
        # Earth rotation angle (era00); s′ and the CIO locator turn about the same pole.
        angle = math.tau * ((turned + 0.2790572732640 + 0.00273781191135448 * days) % 1.0) + _TIO * days - cio
        pole_z = math.sqrt(1.0 - pole_x * pole_x - pole_y * pole_y)
        self._pole = (pole_x, pole_y, pole_z)
        self._rotation = rotation = _product(
            _terrestrial(sky.local, xp, yp), _celestial(angle, pole_x, pole_y, pole_z)
        )
        s0, s1, s2, _, _, _, z0, z1, z2 = rotation

        # The observer: from the Earth's centre, au, and carried round by its rotation, au a day.
        south, zenith = sky.south_au, sky.zenith_au
        px, py, pz = south * s0 + zenith * z0, south * s1 + zenith * z1, south * s2 + zenith * z2
        ux = _ROTATION_DAY * (pole_y * pz - pole_z * py)
        uy = _ROTATION_DAY * (pole_z * px - pole_x * pz)
        uz = _ROTATION_DAY * (pole_x * py - pole_y * px)
        self.geocentric_au = (px, py, pz)
        self.spin_au_day = (ux, uy, uz)
        self.position_au = (x + px, y + py, z + pz)
        vx, vy, vz = (vx + ux) * _LIGHT_AU_DAY, (vy + uy) * _LIGHT_AU_DAY, (vz + uz) * _LIGHT_AU_DAY
        self.velocity_c = (vx, vy, vz)
        self._lorentz = math.sqrt(1.0 - (vx * vx + vy * vy + vz * vz))
        hx, hy, hz = hx + px, hy + py, hz + pz
        self._sun_au = sun_au = math.sqrt(hx * hx + hy * hy + hz * hz)
        self._from_sun = (hx / sun_au, hy / sun_au, hz / sun_au)
        self._sun: Vector | None = None

    def observe(self, direction: Vector, from_sun: Vector | None = None) -> Vector:
        """Observed direction of an astrometric one.

        Parameters
        ----------
        direction : Vector
            Unit vector in the ICRS axes: where the target would be seen from this place by an observer at rest.
        from_sun : Vector, optional
            Unit vector from the Sun to the target, ICRS axes, where that is another than from the observer: the
            light of what is near is bent less. The zero vector for the Sun itself.

        Returns
        -------
        Vector
            Unit vector in the horizon frame, within 1e-4 mas of ERFA's `atciqz` and `atioq`.
        """
        px, py, pz = self._proper(direction, direction if from_sun is None else from_sun)
        a, b, c, d, e, f, g, h, i = self._rotation
        level = (a * px + b * py + c * pz, d * px + e * py + f * pz, g * px + h * py + i * pz)
        return refract(level, *self.sky.refraction_constants)

    def astrometric(self, observed: Vector) -> Vector:
        """Astrometric direction of an observed one; inverse of `observe` to 1e-12 rad.

        Parameters
        ----------
        observed : Vector
            Unit vector in the horizon frame.

        Returns
        -------
        Vector
            Unit vector in the ICRS axes.
        """
        x, y, z = unrefract(observed, *self.sky.refraction_constants)
        a, b, c, d, e, f, g, h, i = self._rotation
        gx, gy, gz = a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z
        px, py, pz = gx, gy, gz
        # A step leaves 1e-4 of the error, as aberration does of a direction; deflection near the Sun, 1/50.
        for _ in range(12):
            x, y, z = self._proper((px, py, pz), (px, py, pz))
            dx, dy, dz = gx - x, gy - y, gz - z
            px, py, pz = px + dx, py + dy, pz + dz
            n = 1.0 / math.sqrt(px * px + py * py + pz * pz)
            px, py, pz = px * n, py * n, pz * n
            if abs(dx) + abs(dy) + abs(dz) < _CLOSED:
                break
        return px, py, pz

    def observe_with_rate(
        self, direction: Vector, rate: Vector, from_sun: tuple[Vector, Vector] | None = None
    ) -> tuple[Vector, Vector]:
        """Observed direction and its derivative: that of the whole chain, Earth's turn and refraction included.

        Parameters
        ----------
        direction, rate : Vector
            Unit vector in the ICRS axes and how it changes per second of TT.
        from_sun : tuple of Vector, optional
            As for `observe`, with how it changes per second.

        Returns
        -------
        tuple[Vector, Vector]
            Unit vector in the horizon frame, and its derivative per second to 1e-9 deg/s.
        """
        (px, py, pz), (dx, dy, dz) = self._proper_with_rate(direction, rate, from_sun or (direction, rate))
        # Seen from the Earth the sky turns by −Ω, Ω = ω k + k × k̇ with k the pole: the CIO does not turn about it.
        kx, ky, kz = self._pole
        dkx, dky = pole_rate(self.instant)
        dkz = -(kx * dkx + ky * dky) / kz
        ox = _ROTATION * kx + ky * dkz - kz * dky
        oy = _ROTATION * ky + kz * dkx - kx * dkz
        oz = _ROTATION * kz + kx * dky - ky * dkx
        dx, dy, dz = dx + py * oz - pz * oy, dy + pz * ox - px * oz, dz + px * oy - py * ox
        a, b, c, d, e, f, g, h, i = self._rotation
        return refract_with_rate(
            (a * px + b * py + c * pz, d * px + e * py + f * pz, g * px + h * py + i * pz),
            (a * dx + b * dy + c * dz, d * dx + e * dy + f * dz, g * dx + h * dy + i * dz),
            *self.sky.refraction_constants,
        )

    def from_teme(self) -> Matrix:
        """Rotation from TEME to the horizon frame: Greenwich mean sidereal time, polar motion, the site."""
        dut1, xp, yp, *_ = self.earth_orientation
        day, seconds = self.instant.utc()
        angle = _gmst82(day, seconds + dut1)
        s, c = math.sin(angle), math.cos(angle)
        m0, m1, m2, m3, m4, m5, m6, m7, m8 = _terrestrial(self.sky.local, xp, yp)
        return (
            c * m0 - s * m1, s * m0 + c * m1, m2,
            c * m3 - s * m4, s * m3 + c * m4, m5,
            c * m6 - s * m7, s * m6 + c * m7, m8,
        )  # fmt: skip

    def topocentric(self, place: Vector) -> Vector:
        """Metres from the observer of a place in metres from the Earth's centre, both in the horizon frame."""
        x, y, z = place
        return x - self.sky.south_au * AU_M, y, z - self.sky.zenith_au * AU_M

    def observe_near(self, place: Vector, velocity: Vector) -> tuple[Vector, Vector]:
        """Observed direction and its derivative of what is near the Earth: diurnal aberration and refraction.

        Parameters
        ----------
        place, velocity : Vector
            Metres from the observer, horizon frame: from where the light comes that arrives now, and how that changes
            per second.

        Returns
        -------
        tuple[Vector, Vector]
            Unit vector in the horizon frame, and its derivative per second.
        """
        sky = self.sky
        a, b = sky.refraction_constants
        if a or b:
            place, velocity = lowered(place, velocity, a, b, sky.column_m)
        (x, y, z), rate = _unit(place, velocity)
        # The observer's speed is the same all the time; its square is 2e-12.
        return refract_with_rate(*_unit((x, y + sky.east_c, z), rate), a, b)

    def sun(self) -> Vector:
        """Observed direction of the Sun's centre, horizon frame, to 0.001°."""
        if self._sun is None:
            x, y, z = self._from_sun
            self._sun = self.observe((-x, -y, -z))
        return self._sun

    def _proper(self, direction: Vector, from_sun: Vector) -> Vector:
        """Proper direction, GCRS axes, of an astrometric one: deflected by the Sun and aberrated."""
        px, py, pz = direction
        qx, qy, qz = from_sun
        ex, ey, ez = self._from_sun
        vx, vy, vz = self.velocity_c
        sun_au = self._sun_au
        # Deflection (ld): p + w (e (p·q) − q (p·e)) with e from the Sun to the observer and q from the Sun to the
        # target, bounded inside the Sun's disc (ldsun).
        potential = _SCHWARZSCHILD_AU / sun_au
        pe = px * ex + py * ey + pz * ez
        pq = px * qx + py * qy + pz * qz
        nearness = 1.0 + qx * ex + qy * ey + qz * ez
        limit = 1e-6 / (sun_au * sun_au) if sun_au > 1.0 else 1e-6
        w = potential / max(nearness, limit)
        k, m = w * pq, w * pe
        px, py, pz = px + k * ex - m * qx, py + k * ey - m * qy, pz + k * ez - m * qz
        # Aberration (ab), with the Sun's potential.
        pv = px * vx + py * vy + pz * vz
        along = 1.0 + pv / (1.0 + self._lorentz) + potential
        k = self._lorentz - potential * pv
        px, py, pz = k * px + along * vx, k * py + along * vy, k * pz + along * vz
        n = 1.0 / math.sqrt(px * px + py * py + pz * pz)
        return px * n, py * n, pz * n

    def _proper_with_rate(
        self, direction: Vector, rate: Vector, from_sun: tuple[Vector, Vector]
    ) -> tuple[Vector, Vector]:
        """`_proper` and its derivative: the same steps, each differentiated."""
        px, py, pz = direction
        dx, dy, dz = rate
        (qx, qy, qz), (dqx, dqy, dqz) = from_sun
        ex, ey, ez = self._from_sun
        vx, vy, vz = self.velocity_c
        sun_au, lorentz = self._sun_au, self._lorentz
        # The Sun itself moves by 1e-5 of the Earth's speed: the barycentric velocity serves as the heliocentric.
        ev = (ex * vx + ey * vy + ez * vz) * _LIGHT_AU_S / sun_au
        turn = _LIGHT_AU_S / sun_au
        dex, dey, dez = vx * turn - ex * ev, vy * turn - ey * ev, vz * turn - ez * ev
        potential = _SCHWARZSCHILD_AU / sun_au
        pe = px * ex + py * ey + pz * ez
        dpe = dx * ex + dy * ey + dz * ez + px * dex + py * dey + pz * dez
        pq = px * qx + py * qy + pz * qz
        dpq = dx * qx + dy * qy + dz * qz + px * dqx + py * dqy + pz * dqz
        nearness = 1.0 + qx * ex + qy * ey + qz * ez
        dnearness = dqx * ex + dqy * ey + dqz * ez + qx * dex + qy * dey + qz * dez
        limit = 1e-6 / (sun_au * sun_au) if sun_au > 1.0 else 1e-6
        w = potential / max(nearness, limit)
        dw = -w * (ev + (dnearness / nearness if nearness > limit else 0.0))
        k, dk = w * pq, dw * pq + w * dpq
        m, dm = w * pe, dw * pe + w * dpe
        dx, px = dx + dk * ex + k * dex - dm * qx - m * dqx, px + k * ex - m * qx
        dy, py = dy + dk * ey + k * dey - dm * qy - m * dqy, py + k * ey - m * qy
        dz, pz = dz + dk * ez + k * dez - dm * qz - m * dqz, pz + k * ez - m * qz
        # The observer's acceleration: the Sun's gravity (the Moon's pull is 0.5 % of it) and the Earth's turn.
        kx, ky, kz = self._pole
        ux, uy, uz = self.spin_au_day
        fall, spin = -_SUN_GRAVITY / (sun_au * sun_au), _ROTATION * _LIGHT_AU_DAY
        ax = fall * ex + spin * (ky * uz - kz * uy)
        ay = fall * ey + spin * (kz * ux - kx * uz)
        az = fall * ez + spin * (kx * uy - ky * ux)
        pv = px * vx + py * vy + pz * vz
        dpv = dx * vx + dy * vy + dz * vz + px * ax + py * ay + pz * az
        along, dalong = 1.0 + pv / (1.0 + lorentz) + potential, dpv / (1.0 + lorentz)
        k, dk = lorentz - potential * pv, -potential * dpv
        dx, px = dk * px + k * dx + dalong * vx + along * ax, k * px + along * vx
        dy, py = dk * py + k * dy + dalong * vy + along * ay, k * py + along * vy
        dz, pz = dk * pz + k * dz + dalong * vz + along * az, k * pz + along * vz
        n = 1.0 / math.sqrt(px * px + py * py + pz * pz)
        px, py, pz = px * n, py * n, pz * n
        dx, dy, dz = dx * n, dy * n, dz * n
        k = px * dx + py * dy + pz * dz
        return (px, py, pz), (dx - k * px, dy - k * py, dz - k * pz)


def _gmst82(day: int, ut1: float) -> float:
    """Greenwich mean sidereal time of 1982, radians, at seconds of UT1 of a day (MJD): ERFA's `gmst82`."""
    t = (day - _J2000 + ut1 / DAY) / (100.0 * YEAR_DAYS)
    seconds = 24110.54841 + (8640184.812866 + (0.093104 - 6.2e-6 * t) * t) * t + ut1
    return math.tau * ((seconds / DAY) % 1.0)


def _unit(v: Vector, rate: Vector) -> tuple[Vector, Vector]:
    """A vector brought to unit length, and the derivative of that."""
    x, y, z = v
    dx, dy, dz = rate
    n = 1.0 / math.sqrt(x * x + y * y + z * z)
    x, y, z, dx, dy, dz = x * n, y * n, z * n, dx * n, dy * n, dz * n
    along = x * dx + y * dy + z * dz
    return (x, y, z), (dx - along * x, dy - along * y, dz - along * z)


def _celestial(angle: float, x: float, y: float, z: float) -> Matrix:
    """GCRS to the Earth's equator: precession-nutation (IERS Conventions 2010, eq. 5.10), then the Earth's turn."""
    s, c = math.sin(angle), math.cos(angle)
    a = 1.0 / (1.0 + z)
    q00, q01, q11 = 1.0 - a * x * x, -a * x * y, 1.0 - a * y * y
    return (
        c * q00 + s * q01, c * q01 + s * q11, -c * x - s * y,
        c * q01 - s * q00, c * q11 - s * q01, s * x - c * y,
        x, y, z,
    )  # fmt: skip


def _terrestrial(local: Matrix, xp: float, yp: float) -> Matrix:
    """The Earth's equator to the horizon frame: polar motion Rx(−yp) Ry(−xp), then the site."""
    a, b, c, d, e, f, g, h, i = local
    # Microradians: to second order the sines are the angles.
    cx, cy, xy = 1.0 - 0.5 * xp * xp, 1.0 - 0.5 * yp * yp, xp * yp
    cc = cx * cy
    return (
        a * cx + b * xy - c * xp, b * cy + c * yp, a * xp - b * yp + c * cc,
        d * cx + e * xy - f * xp, e * cy + f * yp, d * xp - e * yp + f * cc,
        g * cx + h * xy - i * xp, h * cy + i * yp, g * xp - h * yp + i * cc,
    )  # fmt: skip


def _product(m: Matrix, n: Matrix) -> Matrix:
    a, b, c, d, e, f, g, h, i = m
    n00, n01, n02, n10, n11, n12, n20, n21, n22 = n
    return (
        a * n00 + b * n10 + c * n20, a * n01 + b * n11 + c * n21, a * n02 + b * n12 + c * n22,
        d * n00 + e * n10 + f * n20, d * n01 + e * n11 + f * n21, d * n02 + e * n12 + f * n22,
        g * n00 + h * n10 + i * n20, g * n01 + h * n11 + i * n21, g * n02 + h * n12 + i * n22,
    )  # fmt: skip
