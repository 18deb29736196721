"""The places of a pointing run: even by area, inside every limit for as long as a place is kept, on a short way."""

import cmath
import itertools
import math
import random

import numpy as np
import pytest
from planning_bench import MIDNIGHT, noon_of, planner

from pointing.catalogue import bright_stars
from pointing.errors import PointingError
from pointing.instant import Instant
from pointing.limits import Horizon, separation
from pointing.mount import MountType
from pointing.run_plan import place_angles, short_way, spread_places, star_places
from pointing.vectors import from_azimuth_altitude

N = 50
STAYS_S = 240.0  # a slew, a solver of three minutes
SPEEDS = (1.0, 1.0)
BOTH = {  # travels in which each mount has both postures
    MountType.EQUATORIAL_FORK: ((-170.0, 170.0), (-260.0, 100.0)),
    MountType.ALTAZ_FORK: ((-270.0, 270.0), (0.0, 180.0)),
    MountType.GERMAN: ((-20.0, 200.0), (-220.0, 220.0)),
}
LATITUDES = (-42.4, 51.5)
MOUNTS = list(itertools.product(BOTH, LATITUDES))


def two_sided(kind, latitude=-42.4, **others):
    return planner(kind, latitude, limits_deg=BOTH[kind], **others)


def at_random(subject, n, seed=3):
    """Places by chance, where one of the postures can be had: what even places are compared with."""
    rng, found = random.Random(seed), []  # noqa: S311
    while len(found) < n:
        direction = from_azimuth_altitude(rng.uniform(0.0, math.tau), math.asin(rng.uniform(0.09, 1.0)))
        for posture in ("normal", "beyond"):
            angles = subject.mount.axes(direction, posture)
            if abs(math.cos(angles[1])) > 0.06 and any(True for _ in subject.windings(angles, (-0.04, -0.04))):
                found.append((direction, posture))
    return found


def gaps(places, probes):
    """How far places that can be reached are from the nearest place of the run in their posture, radians."""
    return np.array(
        [
            min(separation(direction, place.direction) for place in places if place.posture == posture)
            for direction, posture in probes
        ]
    )


@pytest.mark.parametrize(("kind", "latitude"), MOUNTS)
def test_places_are_even_by_area_in_every_posture_that_can_be_reached(kind, latitude):
    subject = two_sided(kind, latitude)
    places = spread_places(subject, N, MIDNIGHT)
    probes = at_random(subject, 400)
    side = {posture: sum(place.posture == posture for place in places) for posture in ("normal", "beyond")}
    share = sum(posture == "normal" for _, posture in probes) / len(probes)
    chance = [gaps([_Spot(*probe) for probe in at_random(subject, N, seed)], probes) for seed in range(20, 25)]
    gap = gaps(places, probes)
    rms, by_chance = (math.degrees(np.sqrt(np.mean(np.square(each)))) for each in (gap, chance))
    widest, widest_by_chance = math.degrees(gap.max()), math.degrees(np.mean([each.max() for each in chance]))
    print(
        f"{kind.text} at {latitude}°: {side['normal']} normal, {side['beyond']} beyond (reached area {share:.0%} "
        f"normal); RMS way to the nearest {rms:.1f}°, by chance {by_chance:.1f}°; widest {widest:.1f}° and "
        f"{widest_by_chance:.1f}°"
    )
    assert len(places) == N
    assert side["normal"] / N == pytest.approx(share, abs=0.12)
    assert rms < 0.85 * by_chance
    assert widest < widest_by_chance


class _Spot:
    def __init__(self, direction, posture):
        self.direction, self.posture = direction, posture


@pytest.mark.parametrize(("kind", "latitude"), MOUNTS)
def test_no_place_leaves_a_limit_while_its_star_is_tracked(kind, latitude):
    """The star that stands at a place goes on through the sky; asked is where it is minutes later."""
    walls = Horizon(((0.0, math.radians(35.0)), (2.0, math.radians(8.0)), (4.0, math.radians(25.0))))
    subject = two_sided(kind, latitude, horizon=walls)
    places = spread_places(subject, N, MIDNIGHT)
    frame, least = subject.sky.at(Instant.from_posix(MIDNIGHT)), math.inf
    for place in places:
        target = frame.astrometric(place.direction)
        for late in (0.0, STAYS_S):
            later = subject.sky.at(Instant.from_posix(MIDNIGHT + late))
            direction = later.observe(target)
            least = min(least, subject.limits.horizon.margin(direction))
            angles = subject.mount.axes(direction, place.posture)
            assert any(True for _ in subject.windings(angles, (0.0, 0.0))), (place, late)
    print(f"{kind.text} at {latitude}°: least margin above the horizon {math.degrees(least):.2f}°")
    assert least > 0.0


def test_no_place_comes_near_the_sun_while_the_run_lasts():
    subject = two_sided(MountType.GERMAN, sun_deg=30.0)
    noon, lasts = noon_of(subject), 4500.0
    places = spread_places(subject, N, noon, lasts)
    suns = [subject.sky.at(Instant.from_posix(noon + lasts * part / 20.0)).sun() for part in range(21)]
    near = min(separation(place.direction, sun) for place in places for sun in suns)
    print(f"nearest to the Sun {math.degrees(near):.1f}°, its zone 30°")
    assert near > math.radians(30.0)
    assert {place.posture for place in places} == {"normal", "beyond"}


@pytest.mark.parametrize("kind", list(BOTH))
def test_no_place_is_in_the_keyhole_about_axis_1(kind):
    subject = two_sided(kind)
    pole = (0.0, 0.0, 1.0) if kind is MountType.ALTAZ_FORK else from_azimuth_altitude(math.pi, math.radians(42.4))
    nearest = min(separation(place.direction, pole) for place in spread_places(subject, 300, MIDNIGHT))
    print(f"{kind.text}: nearest to the pole of axis 1 {math.degrees(nearest):.2f}°")
    assert nearest > math.radians(2.9)


@pytest.mark.parametrize("n", [30, 50, 100])
@pytest.mark.parametrize("kind", list(BOTH))
def test_a_worm_does_not_pass_for_a_slow_wave_of_axis_1(kind, n):
    """At even places an error of 285 waves a turn would be one of a few, to a fit; by chance 1/√n of it are."""
    subject = two_sided(kind)
    angles = [place_angles(subject, place)[0] for place in spread_places(subject, n, MIDNIGHT)]
    shares = [
        abs(sum(cmath.exp(1j * (teeth + slow) * angle) for angle in angles)) / n
        for teeth in (144, 180, 233, 285, 360, 377)
        for slow in range(-6, 7)
    ]
    print(f"{kind.text}, {n} places: at most {max(shares):.2f} of a worm is seen as a slow wave")
    assert max(shares) < 3.5 / math.sqrt(n)


@pytest.mark.parametrize(("kind", "latitude"), MOUNTS)
def test_the_way_is_much_shorter_than_in_the_order_of_the_list_and_changes_sides_seldom(kind, latitude):
    subject = two_sided(kind, latitude)
    places = spread_places(subject, N, MIDNIGHT)
    start = place_angles(subject, places[0])
    way = short_way(subject, places, start, SPEEDS)
    length = {
        "as listed": travelled(subject, places, start),
        "by azimuth": travelled(subject, sorted(places, key=lambda place: place.azimuth), start),
        "planned": travelled(subject, way, start),
    }
    sides = sum(a.posture != b.posture for a, b in itertools.pairwise(way))
    shown = ", ".join(f"{name} {math.degrees(angle):.0f}°" for name, angle in length.items())
    print(f"{kind.text} at {latitude}°: {shown}; {sides} changes of side")
    assert sorted(way, key=str) == sorted(places, key=str)
    assert length["planned"] < 0.4 * length["as listed"]
    assert length["planned"] < 0.6 * length["by azimuth"]
    assert sides <= 8


def travelled(subject, places, start):
    """How far the slower of two equally fast axes goes, radians."""
    angles = [start, *(place_angles(subject, place) for place in places)]
    return sum(max(abs(a - b) for a, b in zip(one, two, strict=True)) for one, two in itertools.pairwise(angles))


def test_the_way_of_a_few_places_is_the_shortest_of_all():
    subject = two_sided(MountType.GERMAN)
    for n in (4, 6, 7):
        places = spread_places(subject, n, MIDNIGHT)
        start = (0.3, -0.5)
        best = min(travelled(subject, order, start) for order in itertools.permutations(places))
        found = travelled(subject, short_way(subject, places, start, SPEEDS), start)
        print(f"{n} places: {math.degrees(found):.2f}°, the shortest of all orders {math.degrees(best):.2f}°")
        assert found <= 1.02 * best


def test_the_same_places_in_the_same_order_come_out_every_time():
    first, again = (
        short_way(subject, spread_places(subject, N, MIDNIGHT), (0.0, 0.0), SPEEDS)
        for subject in (two_sided(MountType.GERMAN), two_sided(MountType.GERMAN))
    )
    assert first == again


def test_a_run_that_has_places_gets_others_between_them():
    subject = two_sided(MountType.GERMAN)
    first, more = (spread_places(subject, N, MIDNIGHT, other=other) for other in (0, N))
    nearest = [min(separation(a.direction, b.direction) for b in first if b.posture == a.posture) for a in more]
    probes = at_random(subject, 400)
    one, both = (math.degrees(np.sqrt(np.mean(gaps(each, probes) ** 2))) for each in (first, first + more))
    print(f"RMS way to the nearest place {one:.1f}° with {N}, {both:.1f}° with as many more")
    assert min(nearest) > math.radians(0.2)
    assert both < 0.85 * one


def test_bright_stars_are_real_reached_and_each_is_taken_once_in_a_posture():
    subject = two_sided(MountType.GERMAN)
    places = star_places(subject, 25, MIDNIGHT, 2000.0, bright_stars())
    frame = subject.sky.at(Instant.from_posix(MIDNIGHT))
    stars = {star.name: star for star in bright_stars()}
    off = max(separation(stars[place.name].observed(frame), place.direction) for place in places)
    assert off < 1e-9
    assert len({(place.name, place.posture) for place in places}) == 25
    assert all(subject.limits.horizon.margin(place.direction) > 0.0 for place in places)


def test_no_bright_star_is_seen_twice_while_there_is_another():
    subject = two_sided(MountType.GERMAN)
    first = star_places(subject, 20, MIDNIGHT, 2000.0, bright_stars())
    names = [place.name for place in first]
    more = star_places(subject, 20, MIDNIGHT, 2000.0, bright_stars(), 20, names)
    print(f"{len(set(names))} stars in 20 places, {len({*names, *(place.name for place in more)})} in 40")
    assert len(set(names)) == 20
    assert len({*names, *(place.name for place in more)}) == 40


def test_what_cannot_be_planned_says_what_and_why():
    with pytest.raises(PointingError, match=r"a run of 0 places: 1 to 1000"):
        spread_places(two_sided(MountType.GERMAN), 0, MIDNIGHT)
    blocked = planner(MountType.GERMAN, horizon=Horizon.level(89.0))
    with pytest.raises(PointingError, match=r"reaches 0 of \d+ places of the sky, too few for a run of 20: look at"):
        spread_places(blocked, 20, MIDNIGHT)
    with pytest.raises(PointingError, match=r"of the bright stars are reached now, fewer than 900: ask for fewer"):
        star_places(two_sided(MountType.GERMAN), 900, MIDNIGHT, 0.0, bright_stars())
    assert short_way(two_sided(MountType.GERMAN), (), (0.0, 0.0), SPEEDS) == ()
