"""From a mount that nobody has aligned to arcseconds: a run of 50 stars, its model, and where blind gotos end.

The true mount is worked out with matrices (`mounts.true_mount`), apart from all that points and fits. What no model
of the run can take away is known beforehand: the worm, and the scatter of a look at the sky.
"""

import math
import os
import random

import pytest
from telescope_bench import QUICK, star_at, telescope

from clockdrive.telescope import nobody
from mounts.true_mount import TrueMount, separation_arcsec
from pointing.instant import Instant

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
CHECKED = 100
DRIVEN = CHECKED if FULL else 2  # gotos that are really made; the others are worked out for the same axis angles
WORM, TOOTH = 5.0, 285  # 10″ peak to peak, that many a turn
NOISE = 2.0
MORE = 0.15  # than worm and scatter: three standard deviations, 1/(2√n), of the RMS of 100 stars
TILT = 3600.0 / math.sqrt(2.0)  # a degree in all
ARCSEC = math.pi / 648_000.0
TRUTH = {
    "simulator__misalignment_x_arcsec": TILT,
    "simulator__misalignment_y_arcsec": -TILT,
    "simulator__collimation_arcsec": 180.0,
    "simulator__nonperpendicularity_arcsec": 30.0,
    "simulator__flexure_arcsec": 20.0,
    "simulator__periodic_error_arcsec": WORM,
    "simulator__sky_noise_arcsec": NOISE,
}
BOTH = {  # travels in which a mount has both postures
    "equatorial-fork": {"axis2__min_deg": -260.0, "axis2__max_deg": 90.0},
    "german": {},
    "altaz-fork": {"axis2__max_deg": 175.0},
}


class Blind:
    """Stars that no run has seen, and by how much they are missed."""

    def __init__(self, scope, driven, seed=11):
        self.scope, self.session, self.count = scope, scope._session, driven
        configuration = scope.configuration
        latitude = math.radians(configuration.site.latitude_deg)
        self.mount = TrueMount(configuration.simulator, configuration.mount.type, latitude, TOOTH)
        self.chance = random.Random(f"{configuration.mount.type} {seed}")  # noqa: S311
        self.places = list(self.chosen())

    def chosen(self):
        """Places at random over the sky, every other one in the other posture."""
        for i in range(CHECKED):
            posture = ("normal", "beyond")[i % 2]
            while not self.reached(
                place := (
                    self.chance.uniform(0.0, 360.0),
                    math.degrees(math.asin(self.chance.uniform(math.sin(math.radians(20.0)), 0.99))),
                ),
                posture,
            ):
                pass
            yield place, posture

    def reached(self, place, posture):
        azimuth, altitude = map(math.radians, place)
        direction = (
            -math.cos(altitude) * math.cos(azimuth), math.cos(altitude) * math.sin(azimuth), math.sin(altitude),
        )  # fmt: skip
        planner = self.session.planner
        slack = (math.radians(-4.0),) * 2  # for what a degree of misalignment asks, and for what it tracks
        angles = planner.mount.axes(direction, posture)
        away = 0.1 if self.scope.configuration.mount.type == "altaz-fork" else 0.06  # from the pole of axis 1
        return abs(math.cos(angles[1])) > away and any(True for _ in planner.windings(angles, slack))

    def misses(self):
        """Of each star: how far off it a goto sees it, arcseconds, and the axis angles; the real gotos come first."""
        for number, (place, posture) in enumerate(self.places):
            star = star_at(self.scope, *place)
            yield self.driven(star, posture) if number < self.count else self.worked_out(star, posture)

    def driven(self, star, posture):
        scope, session = self.scope, self.session
        scope._perform(scope._slewing.goto(star, nobody, posture=posture))
        sighting = scope._perform(scope.true_sky.look())
        session.poll()
        counts = session.history.counts(sighting.time)
        frame = session.planner.sky.at(Instant.from_posix(sighting.time))
        return separation_arcsec(sighting.observed, star.observed(frame)), session.planner.angles(counts)

    def worked_out(self, star, posture):
        planner, now = self.session.planner, self.scope.clock.now()
        middle = [(axis.minimum + axis.maximum) / 2.0 for axis in planner.free]
        (one, _), (two, _) = planner.track(star, now, posture, tuple(middle))
        angles = planner.angles(
            tuple(axis.nearest(angle) for axis, angle in zip(planner.axes, (one, two), strict=True))
        )
        seen = self.mount.turn(*angles)
        target = star.observed(planner.sky.at(Instant.from_posix(now)))
        across, up = (self.chance.gauss(0.0, NOISE / math.sqrt(2.0)) for _ in "12")
        east, north = _tangent(target, seen)
        return math.hypot(east + across, north + up), angles


def _tangent(target, seen):
    """Where `seen` lies beside `target` on the sky, arcseconds to two sides."""
    x, y, z = target
    level = math.hypot(x, y)
    one, two = (-y / level, x / level, 0.0), (-z * x / level, -z * y / level, level)
    return tuple(sum(a * b for a, b in zip(seen, axis, strict=True)) / ARCSEC for axis in (one, two))


def left(misses):
    """RMS of the misses, and of what no model can take: the worm as it is on the sky, and the scatter of a look."""
    n = len(misses)
    worm = sum((WORM * math.sin(TOOTH * one) * math.cos(two)) ** 2 for _, (one, two) in misses) / n
    return math.sqrt(sum(off * off for off, _ in misses) / n), math.sqrt(worm + NOISE**2)


@pytest.mark.campaign
@pytest.mark.timeout(600)
@pytest.mark.parametrize("driven", [DRIVEN], ids=[f"{DRIVEN} of {CHECKED} driven"])
@pytest.mark.parametrize("kind", list(BOTH))
def test_blind_gotos_end_as_near_as_the_worm_and_the_air_let_them_after_a_run_of_50_stars(kind, driven, tmp_path):
    with telescope(tmp_path, mount__type=kind, **TRUTH, **BOTH[kind], **QUICK) as scope:
        blind = Blind(scope, driven)
        before, _ = left(list(blind.misses()))
        scope.stop()
        report = scope.pointing_run(50)
        scope.use_model(report.fit)
        misses = list(blind.misses())
    after, injected = left(misses)
    side = {
        name: left([miss for miss, (_, posture) in zip(misses, blind.places, strict=True) if posture == name])
        for name in ("normal", "beyond")
    }
    print(
        f"\n{kind:16} before {before:7.1f}″  after {after:5.2f}″ (normal {side['normal'][0]:.2f}″, beyond "
        f"{side['beyond'][0]:.2f}″)  injected {injected:.2f}″  ratio {after / injected:.3f}  "
        f"expected by cross-validation {report.cross_validation_arcsec:.2f}″  {driven} gotos driven  "
        f"{' '.join(each.name for each in report.fit.model.terms)}"
    )
    postures = {each.posture for each in report.stored.observations}
    assert len(report.stored.observations) == 50
    assert postures == {"normal", "beyond"}
    assert before > 1500.0
    assert after <= (1.0 + MORE) * injected
    for rms, unavoidable in side.values():  # of half as many stars, whose RMS scatters by √2 more
        assert rms <= (1.0 + MORE * math.sqrt(2.0)) * unavoidable
    assert report.cross_validation_arcsec == pytest.approx(injected, rel=0.25)
