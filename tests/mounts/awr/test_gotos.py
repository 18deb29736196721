"""Gotos and tracking through the whole driver, against the unit simulated on its wire: where the axes truly end."""

import math
import os
import random
import statistics
from dataclasses import replace

import erfa
import numpy as np
import pytest
from awr_bench import SETTINGS, SIDEREAL, Bench

from mounts.awr.factory import factory
from mounts.awr.registers import BY_NAME
from mounts.awr.simulator_settings import SimulatorSettings
from mounts.awr.uncertainty import Jitter
from mounts.drive import AxisSlew

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"
GOTOS, FARTHEST = (1000, 13.5) if FULL else (60, 9.0)
LOOK_S = 0.5
MOON_H = 1.0 if FULL else 0.02
STEPS_PER_RADIAN = math.degrees(SIDEREAL / 0.00417807)
ARCSEC_PER_STEP = math.degrees(3600.0 / STEPS_PER_RADIAN)


PLAYS = (200.0, 300.0)  # motor steps, a minute of arc and half as much again
_BLIPS = factory(backlash=(200, 300))
UNITS = {
    "no play": ({}, {}),
    "play that the unit takes up": ({"plays": PLAYS, "words": _BLIPS}, {}),
    "play that it is told to take up": ({"plays": PLAYS}, {"plays": PLAYS}),
    "play that it cannot take up": ({"plays": PLAYS, "firmware": 0.57}, {"plays": PLAYS}),
}


def random_gotos(stamp_s, seed, execution_s=5e-3, play="no play", bench=None, many=GOTOS):
    """Gotos of one unit.

    Returns
    -------
    tuple
        The bench; true errors of both axes together, guide steps, the smallest first; whether each axis was as surely
        there as stated; how many gotos ended later than told.
    """
    of_unit, of_settings = UNITS[play]
    unit = SimulatorSettings(stamp_jitter_s=stamp_s, execution_jitter_s=execution_s, seed=seed, **of_unit)
    bench = bench or Bench(replace(SETTINGS, jitter=Jitter(5e-3, stamp_s), **of_settings), unit)
    bench.connect()
    rng, drive = random.Random(seed), bench.drive  # noqa: S311
    errors, held, late = [], [], 0
    for _ in range(many):
        now = bench.clock.now()
        for axis, true in zip(drive.axes, bench.true(), strict=True):
            axis.known(true, now, 0.0)
        targets = [
            min(max(true + rng.choice((-1, 1)) * math.exp(rng.uniform(4.0, FARTHEST)), -6e5), 6e5)
            for true in bench.true()
        ]
        models = drive.slew_models
        travels = [
            model.travel(axis.at(now).counts, target, 0.0, rate).duration
            for model, axis, target, rate in zip(models, drive.axes, targets, (SIDEREAL, 0.0), strict=True)
        ]
        arrival = now + drive.start_latency + max(travels)
        drive.start([AxisSlew(targets[0], SIDEREAL, None, arrival), AxisSlew(targets[1], 0.0, None, arrival)], now)
        while any(axis.slewing for axis in bench.read().axes):
            bench.clock.sleep(LOOK_S)
        end, true = bench.clock.now(), bench.true()
        late += end - LOOK_S > arrival
        wanted = targets[0] + SIDEREAL * (end - arrival), targets[1]
        steps = drive.ladder.guide_steps
        errors.append(math.hypot((true[0] - wanted[0]) / steps[0], (true[1] - wanted[1]) / steps[1]))
        stated = [axis.at(end).uncertainty for axis in drive.axes]
        held += [abs(off) <= doubt for off, doubt in zip(bench.off(), stated, strict=True) if doubt]
        assert not drive.supervision.unsynchronised, drive.supervision.unsynchronised
    return bench, sorted(errors), held, late


def chance(many, share):
    """Three standard deviations of how many of so many are in a share of them, when each is by chance."""
    return 3.0 * math.sqrt(many * share * (1.0 - share))


@pytest.mark.campaign
@pytest.mark.parametrize("stamp_s", [1e-4, 5e-3], ids=["events to 0.1 ms", "events to 5 ms"])
@pytest.mark.parametrize("play", UNITS)
def test_random_gotos_end_where_they_should_and_as_surely_as_is_said(stamp_s, play):
    bench, errors, held, late = random_gotos(stamp_s, seed=11, play=play)
    of, many = bench.drive.ladder, len(errors)
    blurred = 2.0 * math.sqrt(2.0) * max(of.slew_rates) * stamp_s / min(of.guide_steps)
    bound = max(2.0, blurred) if stamp_s > 1e-3 else 2.0
    error, share = errors[math.ceil(0.95 * many) - 1], statistics.fmean(held)
    print(
        f"{many} gotos, {play}: 95 % within {error:.2f} of {bound:.1f} guide steps, the stated interval holds "
        f"{100.0 * share:.1f} %, {late} after the time that was told"
    )
    assert sum(each > bound for each in errors) <= 0.05 * many + (0.0 if FULL else chance(many, 0.05))
    assert late <= 1 + 0.01 * many
    unsure = 0.02 if FULL else chance(len(held), 0.05) / len(held)
    assert 0.95 - unsure <= share <= 0.95 + unsure


@pytest.mark.campaign
def test_a_play_that_is_hardly_known_widens_what_is_stated_by_as_much():
    rng, held = random.Random(5), []  # noqa: S311
    for seed in range(200 if FULL else 12):
        plays = tuple(rng.gauss(play, 15.0) for play in PLAYS)
        unit = SimulatorSettings(seed=seed, plays=plays, words=factory(backlash=(150, 250)))
        settings = replace(SETTINGS, jitter=Jitter(5e-3, 1e-4), plays=PLAYS, play_sigmas=(15.0, 15.0))
        bench = Bench(settings, unit)
        bench.connect()
        bench.slew(500.0, 500.0)  # both motors push their axes to larger counts
        for axis, true in zip(bench.drive.axes, bench.true(), strict=True):
            axis.known(true, bench.clock.now(), 0.0)
        for i in range(5):
            bench.slew(500.0 * (i % 2), 500.0 * (i % 2))
        held += [
            abs(off) <= axis.uncertainty_counts for off, axis in zip(bench.off(), bench.read().axes, strict=True)
        ]
    share = statistics.fmean(held)
    print(f"{len(held)} axes with plays 15 steps off: the stated interval holds {100.0 * share:.1f} %")
    assert abs(share - 0.95) <= chance(len(held), 0.05) / len(held)


def test_keys_that_are_less_punctual_than_configured_are_noticed_and_widen_what_is_stated():
    bench, errors, held, _ = random_gotos(5e-3, seed=3, execution_s=12e-3)
    keys, share = bench.drive.keys.punctuality, statistics.fmean(held)
    print(
        f"{len(errors)} gotos: {keys.widened:.2f} times as unpunctual, the stated interval holds {100 * share:.1f} %"
    )
    assert 1.5 < keys.widened < 2.2  # √(12² + 5²) / √(5² + 5²) = 1.84
    assert any("lasted longer or shorter than planned" in note for note in bench.drive.notes)
    as_configured, *_ = random_gotos(5e-3, seed=4)
    assert as_configured.drive.keys.punctuality.widened == 1.0
    assert not any("longer or shorter" in note for note in as_configured.drive.notes)


def test_one_goto_after_the_other_slews_as_fast_as_the_first():
    bench = Bench()
    bench.connect()
    slews = []
    for target in (5000.0, -5000.0, 8000.0):
        bench.slew(target, target)
        slews.append([bench.drive.words.ram[BY_NAME[name].address] for name in ("slew_right", "slew_up")])
    assert slews[0] == slews[1] == slews[2]
    assert slews[0][1] == round(bench.drive.ladder.slew_rates[1]) < bench.drive.words.lasting[0x14]
    bench.drive.start([AxisSlew(0.0, SIDEREAL, 2000.0), AxisSlew(0.0, 0.0, 2000.0)], bench.clock.now())
    assert bench.drive.words.ram[0x14] == 2000
    bench.drive.stop(bench.clock.now())
    bench.slew(3000.0, 3000.0)
    assert [bench.drive.words.ram[BY_NAME[name].address] for name in ("slew_right", "slew_up")] == slews[0]


def test_a_direction_at_rest_is_reached_as_well_as_a_star():
    bench = Bench()  # with the drive of axis 1 off, both its guide keys lead to larger counts
    bench.connect()
    rng, worst = random.Random(6), []  # noqa: S311
    for _ in range(10):
        targets = rng.uniform(-2e4, 2e4), rng.uniform(-2e4, 2e4)
        bench.slew(*targets, rates=(0.0, 0.0))
        off = [(true - there) for true, there in zip(bench.true(), targets, strict=True)]
        worst.append(math.hypot(*off) / (0.03 * SIDEREAL))
        for axis, true in zip(bench.drive.axes, bench.true(), strict=True):
            axis.known(true, bench.clock.now(), 0.0)
    print(f"10 gotos to rest: at most {max(worst):.2f} guide steps off")
    assert sorted(worst)[-2] <= 2.0


class MoonPath:
    """Hour angle and declination of the Moon as seen from Kaikoura, motor steps."""

    def __init__(self, since: float) -> None:
        self.since = since
        self.origin = self.angles(since)

    def angles(self, time: float) -> tuple[float, float]:
        days = time / 86400.0 - 10957.5  # from J2000, POSIX 946728000
        moon = erfa.moon98(2451545.0, days)["p"] * 149597870.7
        turned = erfa.gmst06(2451545.0, days, 2451545.0, days) + math.radians(173.7)
        latitude = math.radians(-42.4)
        here = 6378.0 * np.array([
            math.cos(latitude) * math.cos(turned), math.cos(latitude) * math.sin(turned), math.sin(latitude)
        ])  # fmt: skip
        x, y, z = moon - here
        hour_angle = (turned - math.atan2(y, x)) % math.tau
        return hour_angle, math.atan2(z, math.hypot(x, y))

    def at(self, time: float) -> tuple[tuple[float, float], tuple[float, float]]:
        moment = 0.5
        before, here, after = (self.angles(time + shift) for shift in (-moment, 0.0, moment))
        one, two = (
            (
                (math.remainder(here[i] - self.origin[i], math.tau)) * STEPS_PER_RADIAN,
                math.remainder(after[i] - before[i], math.tau) * STEPS_PER_RADIAN / (2.0 * moment),
            )
            for i in (0, 1)
        )
        return one, two


@pytest.mark.campaign
def test_the_moon_is_followed_by_the_drive_registers():
    bench = Bench()
    bench.connect()
    path = MoonPath(bench.clock.now())
    (here1, _), (here2, _) = path.at(bench.clock.now())
    bench.drive.sync((0.0, 0.0), bench.clock.now())
    bench.slew(here1, here2, rates=tuple(rate for _, rate in path.at(bench.clock.now())))
    for axis, true in zip(bench.drive.axes, bench.true(), strict=True):
        axis.known(true, bench.clock.now(), 0.0)
    offs = []

    def look(now):
        offs.append([true - there for true, (there, _) in zip(bench.true(), path.at(now), strict=True)])

    bench.follow(path, 20.0)
    bench.follow(path, MOON_H * 3600.0, look)
    arcsec = np.array(offs) * ARCSEC_PER_STEP
    rms = np.sqrt((arcsec**2).mean(axis=0))
    rates = [rate * ARCSEC_PER_STEP for _, rate in path.at(bench.clock.now())]
    print(f"the Moon for {MOON_H:g} h, {rates[0]:.2f} and {rates[1]:.3f}″/s: RMS {rms[0]:.3f}″ and {rms[1]:.3f}″")
    assert len(offs) > 600 * MOON_H
    assert math.hypot(*rms) <= 0.02  # a rate between two words of it is reckoned too


def test_the_quantisation_of_a_drive_rate_is_shown():
    bench = Bench()
    bench.connect()
    shown = bench.drive.registers()
    assert shown["drive_rate_1"] == "50.0000 steps/s, the next one 0.0028 away"  # 50 / 18000 counts
    assert shown["drive_rate_2"].startswith("0.0000 steps/s")
