"""A mount with a pointing model: against the model's own arrays, the simulator's rigid mount and measured rates."""

import math
import random
from types import SimpleNamespace

import numpy as np
import pytest
from rate_oracle import ALLOWED_DEG_S, ALLOWED_SHARE, extrapolated
from satellites import ORBITS

from mounts.true_mount import TrueMount, separation_arcsec
from pointing.ephemeris_table import EphemerisTable
from pointing.errors import PointingError, Unreachable
from pointing.instant import Instant
from pointing.limits import separation
from pointing.minor_body import MinorBody
from pointing.model.pointing_model import PointingModel
from pointing.model.terms import PIER_TERMS, term
from pointing.mount import POSTURES, Mount, MountType
from pointing.offset import OffsetTarget
from pointing.rate_offset import RateOffsetTarget
from pointing.satellite import Satellite
from pointing.site import Site
from pointing.sky import Sky
from pointing.solar_system import SolarSystemBody
from pointing.targets import FixedAltAz, FixedHaDec, Star
from pointing.tle import Tle
from pointing.two_body import Orbit

ARCSEC = math.pi / 648_000.0
LATITUDES = (-42.4, 51.5)
LATITUDE = -42.4
SKY = Sky(Site.from_degrees(LATITUDE, 173.7, 30.0))
NOW = Instant.from_utc_iso("2026-11-24T12:00:00Z")
ORIGIN = (900.0 * ARCSEC, -600.0 * ARCSEC)
RIGID = {
    "equatorial": {"IH": 400.0, "ID": -250.0, "CH": 120.0, "NP": 60.0, "MA": -200.0, "ME": 300.0},
    "altazimuth": {"IA": -400.0, "IE": 250.0, "CA": 120.0, "NPAE": -60.0, "AN": -200.0, "AW": 300.0},
}
SEVEN = {kind: {**arcsec, "TF": 20.0} for kind, arcsec in RIGID.items()}
MANY = {
    "equatorial": {**SEVEN["equatorial"], "HF": 30.0, "DNP": 20.0, "FO": 10.0, "DAF": 15.0, "HDSH2": 5.0},
    "altazimuth": {**SEVEN["altazimuth"], "NRX": 10.0, "NRY": 4.0, "HESA2": 3.0, "ACEC": 6.0, "HSCZ1": 5.0},
}
ALONE = {"equatorial": {"TF": 40.0}, "altazimuth": {"HASA2": 12.0}}
WORM = {
    "equatorial": {**SEVEN["equatorial"], "WHS285": 8.0, "WDC570": 3.0},
    "altazimuth": {**SEVEN["altazimuth"], "WAS285": 8.0, "WEC570": 3.0},
}
POWERS = {
    "equatorial": {**SEVEN["equatorial"], "PHH1": 20.0, "PXH1": 15.0, "PDD1": -20.0, "PDA1": 5.0, "PXH1D1": 3.0},
    "altazimuth": {**SEVEN["altazimuth"], "PAA1": 20.0, "PEE2": 15.0, "PSA1": -10.0, "PEH1": 5.0, "PAA1E1": 3.0},
}
MODELS = {
    "rigid": RIGID, "seven terms": SEVEN, "many terms": MANY, "no rigid term": ALONE, "a worm": WORM,
    "powers": POWERS,
}  # fmt: skip

kinds = pytest.mark.parametrize("kind", MountType)
postures = pytest.mark.parametrize("posture", POSTURES)
models = pytest.mark.parametrize("terms", MODELS)


def seeded(seed):
    return random.Random(seed)  # noqa: S311 - nothing secret


def model(kind, latitude_deg, terms):
    return PointingModel.of(kind.kind, latitude_deg, **MODELS[terms][kind.kind])


def mount(kind, latitude_deg, pointing_model=None, origin=(0.0, 0.0)):
    return Mount(kind, math.radians(latitude_deg), 0.01, -0.02, *origin, pointing_model)


def random_axes(rng, subject, posture):
    one, two = rng.uniform(-math.pi, math.pi), math.asin(rng.uniform(-0.998, 0.998))
    south = subject.latitude < 0 and subject.type is not MountType.ALTAZ_FORK
    return (one, two) if posture == "normal" else (one, (-math.pi if south else math.pi) - two)


def wound(rng, axes):
    """The same axes, each by up to two turns on."""
    return tuple(angle + math.tau * rng.randint(-2, 2) for angle in axes)


def where_angles_leap(subject, axes, posture):
    """Within 0.5° of where H or A leap by a turn, and its powers with it: lower culmination, or the north."""
    leap = (subject.type is not MountType.ALTAZ_FORK) + (posture == "beyond")
    return abs(math.remainder(axes[0] - math.pi * leap, math.tau)) < math.radians(0.5)


def apart_arcsec(a, b):
    """Between two pairs of axis angles, on the sky and with no regard to whole turns."""
    one, two = (math.remainder(x - y, math.tau) for x, y in zip(a, b, strict=True))
    return math.hypot(one * math.cos(a[1]), two) / ARCSEC


@kinds
@postures
@models
def test_the_axes_read_what_the_model_makes_of_the_star_and_lead_back_however_they_are_wound(kind, posture, terms):
    rng, forth, back = seeded(4), 0.0, 0.0
    for latitude in LATITUDES:
        wanted = model(kind, latitude, terms)
        subject, bare = mount(kind, latitude, wanted), mount(kind, latitude)
        for _ in range(150):
            axes = wound(rng, random_axes(rng, subject, posture))
            (lon,), (lat,) = wanted.star(np.array([axes[0]]), np.array([axes[1]]))
            star = bare.observed(float(lon), float(lat))
            forth = max(forth, separation(subject.observed(*axes), star) / ARCSEC)
            assert subject.posture(axes[1]) == posture
            if terms != "powers" or not where_angles_leap(subject, axes, posture):
                back = max(back, apart_arcsec(axes, subject.axes(star, posture)))
    print(f"{kind.text}, {posture}, {terms}: to the star {forth:.1e}″, back {back:.1e}″")
    assert forth < 1e-8
    assert back < 1e-8


@kinds
@postures
def test_a_pointing_origin_acts_where_collimation_and_index_of_axis_2_act(kind, posture):
    """x as CH or −CA, y as ID or IE; so the chain stays exact with all other terms."""
    across, along = ("CA", "IE") if kind is MountType.ALTAZ_FORK else ("CH", "ID")
    sense = -1.0 if kind is MountType.ALTAZ_FORK else 1.0
    arcsec, rng = MODELS["many terms"][kind.kind], seeded(5)
    for latitude in LATITUDES:
        x, y = (each / ARCSEC for each in ORIGIN)
        shifted = {**arcsec, across: arcsec[across] + sense * x, along: arcsec[along] + y}
        subject = mount(kind, latitude, PointingModel.of(kind.kind, latitude, **arcsec), ORIGIN)
        other = mount(kind, latitude, PointingModel.of(kind.kind, latitude, **shifted))
        for _ in range(50):
            axes = random_axes(rng, subject, posture)
            assert separation(subject.observed(*axes), other.observed(*axes)) < 1e-9 * ARCSEC
            assert apart_arcsec(axes, subject.axes(subject.observed(*axes), posture)) < 1e-8


@kinds
@pytest.mark.parametrize("latitude", LATITUDES)
def test_a_model_of_the_simulators_errors_sees_where_the_simulator_looks(kind, latitude):
    """Left is the product of collimation and non-perpendicularity, and of X and Y: 0.03″ at these values."""
    x, y, collimation, skew, flexure = 60.0, -90.0, 40.0, -30.0, 15.0
    errors = SimpleNamespace(
        misalignment_x_arcsec=x, misalignment_y_arcsec=y, collimation_arcsec=collimation,
        nonperpendicularity_arcsec=skew, flexure_arcsec=flexure, periodic_error_arcsec=0.0, backlash_arcsec=0.0,
    )  # fmt: skip
    true = TrueMount(errors, kind.text, math.radians(latitude))
    arcsec = (
        {"CA": collimation, "NPAE": skew, "AW": x, "AN": -y, "TF": flexure}
        if kind is MountType.ALTAZ_FORK
        else {"CH": collimation, "NP": skew, "MA": -x, "ME": -y, "TF": flexure}
    )
    subject = Mount(kind, math.radians(latitude), model=PointingModel.of(kind.kind, latitude, **arcsec))
    rng, worst = seeded(6), 0.0
    for _ in range(300):
        axes = rng.uniform(-math.pi, math.pi), rng.uniform(-1.4, 1.4)
        worst = max(worst, separation_arcsec(true.observed(*axes), subject.observed(*axes)))
    print(f"{kind.text} at {latitude}°: true mount and model agree to {worst:.3f}″")
    assert worst < 0.05


def beyond_pole(kind):
    """IHB, IDB or IAB, IEB: index errors that a mount has more beyond the pole."""
    names = ("IA", "IE") if kind is MountType.ALTAZ_FORK else ("IH", "ID")
    one, two = (PIER_TERMS[name] for name in names)
    return one, two


@kinds
@postures
def test_a_worm_and_the_side_of_the_pier_are_those_of_the_axes_own_reading(kind, posture):
    """They act before all else, a pointing origin too, which would turn a worm of 360 teeth by 90°."""
    base, rng = model(kind, 51.5, "many terms"), seeded(7)
    axis1, axis2 = "AE" if kind is MountType.ALTAZ_FORK else "HD"
    worms = tuple(term(name, kind.kind) for name in (f"W{axis1}S360", f"W{axis2}C360"))
    more, arcsec = (*beyond_pole(kind), *worms), (80.0, -30.0, 12.0, 7.0)
    wanted = PointingModel(
        base.kind, base.latitude, (*base.terms, *more), (*base.coefficients, *(each * ARCSEC for each in arcsec))
    )
    subject, bare = mount(kind, 51.5, wanted), mount(kind, 51.5)
    offset = mount(kind, 51.5, wanted, ORIGIN)
    reading = PointingModel(base.kind, base.latitude, more, tuple(each * ARCSEC for each in arcsec))
    unread = mount(kind, 51.5, base, ORIGIN)
    for _ in range(50):
        axes = random_axes(rng, subject, posture)
        (lon,), (lat,) = wanted.star(np.array([axes[0]]), np.array([axes[1]]))
        star = bare.observed(float(lon), float(lat))
        assert separation(subject.observed(*axes), star) < 1e-8 * ARCSEC
        assert apart_arcsec(axes, subject.axes(star, posture)) < 1e-8
        read = tuple(float(each[0]) for each in reading.star(np.array([axes[0]]), np.array([axes[1]])))
        assert separation(offset.observed(*axes), unread.observed(*read)) < 1e-8 * ARCSEC
        assert apart_arcsec(axes, offset.axes(offset.observed(*axes), posture)) < 1e-8


def targets():
    """One of every kind, with the step over which its place is smooth enough to be measured, seconds."""
    star = Star.from_degrees(83.633, -22.0145)
    orbit = Orbit(NOW.plus(-60.0 * 86400.0), 1.1, 0.3, 0.4, 2.0, 1.0)
    low, high = (Satellite(Tle(*ORBITS[name], name)) for name in ("400 km", "GPS"))
    return {
        "star": (star, 32.0),
        "Moon": (SolarSystemBody("moon"), 32.0),
        "Jupiter": (SolarSystemBody("jupiter"), 32.0),
        "ephemeris table": (table(), 32.0),
        "minor body": (MinorBody("a comet", orbit), 32.0),
        "low satellite": (low, 1.0),
        "satellite of the GPS": (high, 32.0),
        "offset star": (OffsetTarget(star, 2e-3, -1e-3), 32.0),
        "star with a rate": (RateOffsetTarget(star, 1e-6, 2e-6, NOW), 32.0),
        "hour angle and declination": (FixedHaDec(0.3, -0.2), 32.0),
        "azimuth and altitude": (FixedAltAz(0.3, 0.8), 32.0),
    }


def table():
    """A body's places each hour, as from the site."""
    body = MinorBody("a comet", Orbit(NOW.plus(-60.0 * 86400.0), 1.1, 0.3, 0.4, 2.0, 1.0))
    times = tuple(NOW.plus(3600.0 * k) for k in range(-13, 14))
    frames = [SKY.at(time) for time in times]
    places = tuple(body.astrometric(frame) for frame in frames)
    return EphemerisTable("a table", times, places)


def moments(rng, target, kind, count):
    """Instants within half a day at which a target stands 10° high and 10° from the poles of the axes."""
    bare, found = mount(kind, LATITUDE), []
    for _ in range(3000):
        instant = NOW.plus(rng.uniform(-43_000.0, 43_000.0))
        observed = target.observed(SKY.at(instant))
        if observed[2] > 0.17 and abs(bare.axes(observed, "normal")[1]) < 1.4:
            found.append(instant)
        if len(found) == count:
            return found
    raise AssertionError(target.name)


@kinds
@postures
@pytest.mark.parametrize("terms", ["seven terms", "many terms", "a worm", "powers"])
def test_axis_rates_are_the_derivatives_of_the_whole_chain_for_every_kind_of_target(kind, posture, terms):
    """Against Richardson-extrapolated differences of axis angles over the two-part time, with a pointing origin."""
    subject, rng, worst = mount(kind, LATITUDE, model(kind, LATITUDE, terms), ORIGIN), seeded(8), {}
    quick = 32.0 if terms == "a worm" else 1.0  # it turns 570 times as fast as the axis
    for name, (target, step) in targets().items():
        for instant in moments(rng, target, kind, 2):
            near = subject.axes(target.observed(SKY.at(instant)), posture)

            def angles(at, target=target, near=near):
                found = subject.axes(target.observed(SKY.at(at)), posture)
                return [a - math.tau * round((a - b) / math.tau) for a, b in zip(found, near, strict=True)]

            state = subject.axes_and_rates(*target.observed_with_rate(SKY.at(instant)), posture)
            assert apart_arcsec([angle for angle, _ in state], near) < 1e-8
            for (_, stated), measured in zip(state, extrapolated(angles, instant, step / quick), strict=True):
                allowed = ALLOWED_DEG_S + ALLOWED_SHARE * abs(math.degrees(stated))
                worst[name] = max(worst.get(name, 0.0), abs(math.degrees(stated - measured)) / allowed)
    shown = ", ".join(f"{name} {share:.2f}" for name, share in worst.items())
    print(f"{kind.text}, {posture}, {terms}: of 1e-9°/s + 1e-8·|rate|: {shown}")
    assert max(worst.values()) <= 1.0


@kinds
@postures
def test_the_blind_spot_about_the_pole_is_refused_with_its_radius_and_its_edge_is_reached(kind, posture):
    """Collimation 120″ and non-perpendicularity 60″ keep √(120² + 60²)″ = 0.0373° out of reach."""
    subject = mount(kind, 51.5, model(kind, 51.5, "rigid"))
    across = "CA" if kind is MountType.ALTAZ_FORK else "CH"
    square = {name: arcsec for name, arcsec in RIGID[kind.kind].items() if name not in {across, "NP", "NPAE"}}
    pole = mount(kind, 51.5, PointingModel.of(kind.kind, 51.5, **square))
    index2 = math.radians(RIGID[kind.kind]["IE" if kind is MountType.ALTAZ_FORK else "ID"] / 3600.0)

    def beside_pole(off_deg):
        return pole.observed(0.3, math.radians(90.0 - off_deg) - index2)

    for call in (subject.axes, lambda v, p: subject.axes_and_rates(v, (0.0, 0.0, 0.0), p)):
        with pytest.raises(Unreachable, match=r"0\.0200° from the pole of axis 1.*0\.0373°.*wait"):
            call(beside_pole(0.02), posture)
    edge = beside_pole(0.0375)
    assert separation(subject.observed(*subject.axes(edge, posture)), edge) < 1e-6 * ARCSEC


@kinds
@postures
def test_next_to_the_pole_terms_that_change_over_the_sky_are_undone_as_well(kind, posture):
    """Where Newton's method does not settle, the terms are undone one by one."""
    rng = seeded(9)
    subject = mount(kind, 51.5, model(kind, 51.5, "many terms"))
    tilts = {name: arcsec for name, arcsec in RIGID[kind.kind].items() if name in {"MA", "ME", "AN", "AW"}}
    pole = mount(kind, 51.5, PointingModel.of(kind.kind, 51.5, **tilts))
    for off_deg in (2.0, 0.3, 0.1):
        star = pole.observed(rng.uniform(-3.0, 3.0), math.radians(90.0 - off_deg))
        assert separation(subject.observed(*subject.axes(star, posture)), star) < 1e-7 * ARCSEC


@kinds
def test_a_model_of_nothing_is_no_model(kind):
    names = MODELS["many terms"][kind.kind]
    nothing = mount(kind, 51.5, PointingModel.of(kind.kind, 51.5, **dict.fromkeys(names, 0.0)))
    bare = mount(kind, 51.5)
    star, rate = bare.observed(0.4, 0.5), (1e-5, 2e-5, -1e-5)
    for posture in POSTURES:
        for (angle, speed), (wanted, meant) in zip(
            nothing.axes_and_rates(star, rate, posture), bare.axes_and_rates(star, rate, posture), strict=True
        ):
            assert angle == pytest.approx(wanted, abs=1e-15)
            assert speed == pytest.approx(meant, abs=1e-19)


def test_the_model_of_another_mount_or_site_is_refused():
    with pytest.raises(PointingError, match=r"altazimuth mount at latitude 51\.5000°.*equatorial one at latitude"):
        mount(MountType.GERMAN, 51.5, PointingModel.of("altazimuth", 51.5, IA=1.0))
    with pytest.raises(PointingError, match=r"latitude 51\.7000°.*take the model of this one"):
        mount(MountType.GERMAN, 51.5, PointingModel.of("equatorial", 51.7, IH=1.0))
