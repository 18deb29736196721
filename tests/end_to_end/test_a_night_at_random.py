"""A night of everything that moves a telescope, in random order: it never leaves what is allowed.

The true axes are asked at every call of the simulated unit, ten times a second and more, by the limits as the
configuration has them; horizon and Sun are computed here from the true direction.
"""

import collections
import math
import os
import random
import re

import pytest
from orbit import Overhead
from telescope_bench import ARCSEC_PER_COUNT, CENTRE, T0, Witness, telescope

from clockdrive.errors import ClockdriveError
from mounts.errors import DriveError
from mounts.tc410.registers import by_name
from pointing.errors import PointingError
from pointing.instant import Instant
from pointing.limits import separation
from pointing.targets import FixedAltAz, Star

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
ACTIONS = 10_000 if FULL else 75
SUN_DEG, HORIZON_DEG = 25.0, 12.0
MOVING = by_name("velocity_control").mask("tracking") | by_name("velocity_control").mask("remote_control")
# Every refusal says which limit is in the way and by how much, or what the telescope does that is.
N = r"[-−]?\d+(?:\.\d+)?"
LIMITS = (
    rf"altitude {N}° .* is (?:{N}° below|at) the horizon limit of {N}°",
    rf"{N}° from the Sun .* is {N}° inside its zone of {N}°",
    rf"(?:axis[12]|mechanical hour angle) at {N}° is (?:{N}° outside|at the end of) {N}° to {N}°",
    rf"axis[12] tracks at {N}°/s, the drive reaches {N}°/s",
    rf"axis ?[12] goes (?:at )?up to ±{N}°/s",
    rf"at most ±{N}″",
    rf"not up yet; `goto` waits for at most {N} minutes",
    "the target runs away nearly as fast as the drive slews",
    "no place that is safe from the Sun can be reached",
    "the horizon or the Sun bars the way on from here",
)
STATES = (
    "the target that is tracked, and nothing is: `goto` one first",
    "in the other posture, and none is tracked: `goto` one first",
    "too fast to be left for a flip",
    "the telescope is parked; `unpark` first",
    r"the telescope is (?:slewing|jogging|waiting); wait for it, or `stop` first",
    "stopped by command",
)
NAMED = re.compile("|".join((*LIMITS, *STATES)))


class Overseer:
    """Asks where the true axes are whenever the unit's clock goes on."""

    def __init__(self, scope):
        self.scope, self.witness = scope, Witness(scope)
        self.left, self.looks = [], 0
        device, advance = scope.simulator, scope.simulator.advance
        self._looked = 0.0

        def advanced(t):
            advance(t)
            if t - self._looked >= 0.1:
                self._looked = t
                self.look(t)

        device.advance = advanced

    def look(self, time):
        self.looks += 1
        configuration, planner = self.scope.configuration, self.scope._session.planner
        angles = self.witness.angles(self.witness.counts())
        for axis, section, angle in zip((1, 2), configuration.axes, angles, strict=True):
            beyond = max(section.min_deg - math.degrees(angle), math.degrees(angle) - section.max_deg)
            if beyond > 0.0:
                self.left.append((time, f"axis {axis} by {beyond * 3600.0 / ARCSEC_PER_COUNT:.1f} counts"))
        past = configuration.limits.hour_angle_past_meridian_deg
        if configuration.mount.type == "german" and not -past <= math.degrees(angles[0]) <= 180.0 + past:
            self.left.append((time, f"window: {math.degrees(angles[0]):.4f}°"))
        looks = planner.mount.observed(*angles)
        altitude = math.degrees(math.asin(looks[2]))
        if altitude < HORIZON_DEG - 1e-9:
            self.left.append((time, f"altitude {altitude:.4f}°"))
        sun = planner.sky.at(Instant.from_posix(time)).sun()
        if math.degrees(separation(looks, sun)) < SUN_DEG - 1e-9:
            self.left.append((time, f"{math.degrees(separation(looks, sun)):.4f}° from the Sun"))


def edge(scope, chance, azimuth):
    low = math.radians(HORIZON_DEG + chance.uniform(-0.5, 0.5))
    scope.goto(FixedAltAz(azimuth, low if chance.random() < 0.5 else math.pi / 2 - 1e-3))


def satellite(scope, chance, azimuth):
    miss = math.radians(chance.uniform(-12.0, 12.0))
    scope.goto(Overhead(scope.clock.now() + chance.uniform(-100.0, 150.0), azimuth, miss))
    scope.wait(chance.uniform(0.0, 60.0))


def guide(scope, chance, _):
    scope.guide(chance.choice("NSEW"), chance.uniform(50.0, 9000.0))
    scope.wait(chance.uniform(0.0, 2.0))


# What a person might do, and how often.
ACTS = {
    "star": (14, lambda s, c, _: s.goto(Star.from_degrees(c.uniform(0.0, 360.0), c.uniform(-90.0, 60.0)))),
    "edge": (8, edge),
    "satellite": (4, satellite),
    "jog": (14, lambda s, c, _: s.jog(c.choice((1, 2)), c.uniform(-3.0, 3.0), c.uniform(0.2, 8.0))),
    "speed": (6, lambda s, c, _: s.drive_at(c.uniform(-2.0, 2.0), c.uniform(-2.0, 2.0), c.uniform(0.5, 6.0))),
    "guide": (22, guide),
    "offset": (8, lambda s, c, _: s.offset(c.uniform(-1500.0, 1500.0), c.uniform(-1500.0, 1500.0))),
    "wait": (14, lambda s, c, _: s.wait(c.uniform(0.0, 25.0))),
    "stop": (3, lambda s, *_: s.stop()),
    "flip": (3, lambda s, *_: s.flip()),
    "Sun": (2, lambda s, *_: s.goto("Sun")),
    "home": (2, lambda s, *_: s.home()),
}


def act(scope, chance, done):
    """Do one thing."""
    kind = chance.choices(list(ACTS), [weight for weight, _ in ACTS.values()])[0]
    done[kind] += 1
    ACTS[kind][1](scope, chance, chance.uniform(0.0, math.tau))


@pytest.mark.campaign
@pytest.mark.timeout(36000)
@pytest.mark.parametrize("kind", ["german", "altaz-fork", "equatorial-fork"])
def test_a_night_of_everything_at_random_never_leaves_what_is_allowed(kind, tmp_path):
    chance = random.Random(f"a night on a {kind}")  # noqa: S311 - nothing secret
    done, refused = collections.Counter(), collections.Counter()
    unnamed, unwatched = [], []
    with telescope(
        tmp_path,
        start=T0 - 3.0 * 3600.0,  # before sunset
        mount__type=kind,
        mount__flip="auto" if kind == "german" else "command",
        limits__horizon_deg=HORIZON_DEG,
        limits__sun_avoidance_deg=SUN_DEG,
        limits__sun_escape="away",
    ) as scope:
        began = scope.clock.now()
        scope.goto("altaz:150,50")
        overseer = Overseer(scope)
        for _ in range(ACTIONS // 3):
            try:
                act(scope, chance, done)
            except (ClockdriveError, DriveError, PointingError) as refusal:
                refused[type(refusal).__name__] += 1
                if not NAMED.search(str(refusal)):
                    unnamed.append(str(refusal))
            if scope._session.doing in {"idle", "parked"} and scope.simulator.memory.raw("velocity_control") & MOVING:
                unwatched.append((scope.clock.now(), scope._session.doing))
            if overseer.left or unwatched:
                break
        trouble = scope.status()["trouble"]
        hours = (scope.clock.now() - began) / 3600.0
    print(
        f"{kind}: {sum(done.values())} actions in {hours:.1f} h, {overseer.looks} looks, {sum(refused.values())} "
        f"refused ({dict(refused)}); {dict(done)}"
    )
    assert not overseer.left, (overseer.left[:3], trouble, CENTRE)
    assert not unwatched, (unwatched, trouble)
    assert not unnamed, unnamed[:5]
    assert sum(refused.values()) < sum(done.values())
