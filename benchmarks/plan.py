"""One whole plan, path checks included, against the calls that others make for the place alone."""

import math
from fractions import Fraction
from functools import cache
from itertools import count

from benchmarks.benchmark import benchmark, best_seconds
from benchmarks.sky import DEC, HEIGHT, LATITUDE, LONGITUDE, MIDNIGHT, RA, WEATHER, atco13_seconds
from mounts.tc410.registers import CENTRE, COUNTS_PER_SECOND
from mounts.tc410.slew import Tc410SlewModel
from pointing.gearing import Gearing
from pointing.instant import Instant
from pointing.limits import Horizon, Limits
from pointing.model.pointing_model import PointingModel
from pointing.mount import Mount, MountType
from pointing.plan import Axis, Start, Timing
from pointing.planner import Planner
from pointing.site import Site
from pointing.sky import Sky
from pointing.targets import Star

RISEN = MIDNIGHT + 3600.0 * 2.0  # POSIX; the star stands well above the horizon
HERE = (CENTRE + 60_000.0, CENTRE - 90_000.0)


SEVEN_TERMS = {"IH": 12.0, "ID": -8.0, "CH": 45.0, "NP": -20.0, "MA": -60.0, "ME": 90.0, "TF": 15.0}  # arcseconds


def telescope(**terms: float) -> tuple[Planner, Timing]:
    """Return a planner of a misaligned fork with every limit on, and its drive; `terms` are of a pointing model."""
    latitude = math.radians(LATITUDE)
    one, two = (
        Gearing.of_motor(200, Fraction(1, 285), Fraction(16, 40), 10, centre_counts=CENTRE, centre_deg=centre)
        for centre in (0.0, LATITUDE)
    )
    model = PointingModel.of("equatorial", LATITUDE, **terms) if terms else None
    planner = Planner(
        Sky(Site.from_degrees(LATITUDE, LONGITUDE, HEIGHT, weather=WEATHER)),
        Mount(MountType.EQUATORIAL_FORK, latitude, 0.002, -0.003, model=model),
        (
            Axis("axis1", one, math.radians(-170.0), math.radians(170.0)),
            Axis("axis2", two, math.radians(-130.0), math.radians(60.0)),
        ),
        Limits(Horizon.level(15.0), math.radians(20.0)),
    )
    slew = Tc410SlewModel(26, 26, int(4.5 / one.step_deg_float / COUNTS_PER_SECOND))
    return planner, Timing((slew, slew), latency=0.05)


@cache
def plan_seconds(**terms: float) -> float:
    """Return the seconds of one warm plan of a parsed target, a new time each."""
    planner, timing = telescope(**terms)
    star, seconds = Star.from_degrees(RA, DEC), count()
    return best_seconds(lambda: planner.plan(star, Start(RISEN + next(seconds) * 0.01, HERE), timing))


@benchmark("one plan at a new time, path checks included, in calls of `erfa.atco13`", unit="", at_most=4.0)
def plan() -> tuple[float, str]:
    """Target and time to counts, rates, arrival and checks."""
    ours, theirs = plan_seconds(), atco13_seconds()
    return ours / theirs, f"{ours * 1e6:.0f} µs, `erfa.atco13` {theirs * 1e6:.0f} µs"


@benchmark("the same with a pointing model of seven terms", unit="", at_most=10.0)
def plan_with_a_model() -> tuple[float, str]:
    """Each way to point and each look along the path goes through the model."""
    ours, theirs = plan_seconds(**SEVEN_TERMS), atco13_seconds()
    return ours / theirs, f"{ours * 1e6:.0f} µs, `erfa.atco13` {theirs * 1e6:.0f} µs"


@benchmark(
    "axis angles and rates through a pointing model of seven terms, in calls of `erfa.atco13`", unit="", at_most=1.0
)
def axes_through_a_model() -> tuple[float, str]:
    """The exact inverse and the derivatives of the whole model."""
    mount, theirs = telescope(**SEVEN_TERMS)[0].mount, atco13_seconds()
    place, rate = mount.observed(0.7, 0.4), (2e-5, 3e-5, 1e-5)
    ours = best_seconds(lambda: mount.axes_and_rates(place, rate, "normal"))
    return ours / theirs, f"{ours * 1e6:.0f} µs"


@benchmark("one plan from `SkyCoord` and `Time`", unit="ms")
def plan_from_astropy() -> tuple[float, str]:
    """The same with astropy's types at the edge."""
    from astropy.coordinates import SkyCoord  # noqa: PLC0415 - only what is measured is imported
    from astropy.time import Time  # noqa: PLC0415 - as above

    planner, timing = telescope()
    coord, start, seconds = SkyCoord(RA, DEC, unit="deg"), Time(RISEN, format="unix"), count()

    def once() -> object:
        late = Time(start.jd1, start.jd2 + next(seconds) * 1e-7, format="jd", scale="utc")
        day, part = divmod(late.utc.jd1 - 2_400_000.5, 1.0)
        instant = Instant.from_utc(int(day), (part + late.utc.jd2) * 86_400.0)
        return planner.plan(Star.from_skycoord(coord), Start(instant.posix(), HERE), timing)

    return best_seconds(once) * 1e3, f"{plan_seconds() * 1e6:.0f} µs of it the plan"


@benchmark("one plan in astropy transforms from ICRS to AltAz", unit="")
def plan_in_transforms() -> tuple[float, str]:
    """What astropy needs for the place alone, at a new time each."""
    from astropy import units  # noqa: PLC0415 - only what is measured is imported
    from astropy.coordinates import AltAz, EarthLocation, SkyCoord  # noqa: PLC0415 - as above
    from astropy.time import Time  # noqa: PLC0415 - as above
    from astropy.utils import iers  # noqa: PLC0415 - as above

    place = EarthLocation.from_geodetic(LONGITUDE, LATITUDE, HEIGHT)
    air = {"pressure": 1010.0 * units.hPa, "temperature": 12.0 * units.deg_C, "relative_humidity": 0.5}
    coord, seconds = SkyCoord(RA, DEC, unit="deg"), count()

    def once() -> object:
        time = Time(RISEN + next(seconds) * 0.01, format="unix")
        return coord.transform_to(AltAz(obstime=time, location=place, obswl=0.55 * units.um, **air))

    with iers.conf.set_temp("auto_download", False), iers.conf.set_temp("auto_max_age", None):  # noqa: FBT003
        theirs = best_seconds(once)
    return plan_seconds() / theirs, f"the transform takes {theirs * 1e6:.0f} µs"
