"""Kernels against jplephem's own evaluation, and what is said of files that are damaged or hold too little."""

import math
import random
import struct
import sys

import numpy as np
import pytest
from jplephem.daf import DAF
from jplephem.excerpter import write_excerpt
from jplephem.spk import SPK

from pointing.errors import TargetError
from pointing.instant import DAY, Instant
from pointing.kernel import Kernel, bundled_kernel, kernel
from pointing.site import Site
from pointing.sky import AU_M, LIGHT_M_S, Sky
from pointing.solar_system import SolarSystemBody

AU_KM = AU_M / 1e3
FIRST, LAST = 2461000.5, 2461064.5  # of the excerpt, JD
WITHIN = Instant(61030, 4321.0)


def excerpt(path, bodies=(3, 5, 10, 301, 399)):
    """64 days of a few bodies, written by jplephem."""
    with SPK.open(bundled_kernel()) as whole, path.open("w+b") as file:
        wanted = [(name, values) for name, values in whole.daf.summaries() if values[2] in bodies]
        write_excerpt(whole, file, FIRST, LAST, wanted)
    return path


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return excerpt(tmp_path_factory.mktemp("kernel") / "small.bsp")


def test_places_and_velocities_are_jplephems():
    rng = random.Random(41)  # noqa: S311 - nothing secret
    ours, place, velocity = kernel(bundled_kernel()), 0.0, 0.0
    with SPK.open(bundled_kernel()) as theirs:
        for _ in range(200):
            instant = Instant(rng.randrange(15021, 71100), rng.uniform(0, DAY))
            day, part = 2400000.5 + instant.day, instant.seconds / DAY
            for body, chain in (
                (301, ((0, 3), (3, 301))),
                (199, ((0, 1), (1, 199))),
                (9, ((0, 9),)),
                (10, ((0, 10),)),
            ):
                found = [theirs[pair].compute_and_differentiate(day, part) for pair in chain]
                at, moving = ours.state(body, instant)
                place = max(place, math.dist([sum(p) / AU_KM for p in zip(*(f[0] for f in found), strict=True)], at))
                there = [sum(p) / AU_KM / DAY for p in zip(*(f[1] for f in found), strict=True)]
                velocity = max(velocity, math.dist(there, moving))
    print(f"against jplephem: places {place * AU_M:.1e} m, velocities {velocity * AU_M:.1e} m/s")
    assert place * AU_M < 0.1  # a float of 40 au resolves 1 mm, jplephem's of the time 0.03 mm
    assert velocity * AU_M < 1e-6


def test_a_body_is_known_from_the_second_day_of_its_file_on(small):
    begin, end = Kernel(small).span(301)
    assert begin <= (FIRST - 2451545.0 + 1.0) * DAY
    assert end >= (LAST - 2451545.0) * DAY
    assert Kernel(small).span(499) is None


def test_a_body_that_the_file_does_not_hold_is_a_sentence(small):
    with pytest.raises(TargetError, match=r"small.bsp does not hold Mars.*499 or 4.*\[targets\] kernel"):
        SolarSystemBody("Mars", small)
    with pytest.raises(TargetError, match="body 499 is not in it"):
        Kernel(small).state(499, WITHIN)
    assert SolarSystemBody("Jupiter", small).note_at(WITHIN) == ""


def test_a_planet_is_itself_where_the_file_holds_it_and_else_its_barycentre(small, tmp_path):
    """Jupiter, a tenth of the Moon's way from the barycentre of its system."""
    path = tmp_path / "jupiter.bsp"
    path.write_bytes(small.read_bytes())
    with SPK.open(small) as given, path.open("r+b") as file:
        (name, moon) = next((n, v) for n, v in given.daf.summaries() if v[2] == 301)
        numbers = given.daf.map_array(moon[-2], moon[-1]).copy()
        size = int(numbers[-2])
        for record in numbers[:-4].reshape(-1, size):
            record[2:] /= 10.0
        DAF(file).add_array(name, (*moon[:2], 599, 5, *moon[4:6]), numbers)
    frame = Sky(Site.from_degrees(0, 0)).at(WITHIN)
    itself, system = (SolarSystemBody("Jupiter", each).astrometric(frame) for each in (path, small))
    left = WITHIN.plus(-system.distance_au * AU_M / LIGHT_M_S)
    moved, moon = (np.subtract(*(Kernel(path).state(n, left)[0] for n in pair)) for pair in ((599, 5), (301, 3)))
    assert moved == pytest.approx(moon / 10.0, abs=1e-14)
    across = np.linalg.norm(np.cross(moved, system.direction)) / system.distance_au
    assert math.dist(itself.direction, system.direction) == pytest.approx(across, rel=1e-3)


def test_an_excerpt_says_what_the_whole_says(small):
    assert Kernel(small).state(301, WITHIN) == kernel(bundled_kernel()).state(301, WITHIN)


def test_the_bundled_kernel_is_found_without_importing_its_package():
    assert bundled_kernel().name == "de421.bsp"
    assert "skyfield_data" not in sys.modules


def test_no_file_is_a_sentence(tmp_path):
    with pytest.raises(TargetError, match=r"absent.bsp: No such file.*\[targets\] kernel"):
        kernel(tmp_path / "absent.bsp")
    with pytest.raises(TargetError, match=r"\[targets\] kernel"):
        kernel(tmp_path)


@pytest.mark.parametrize("content", [b"", b"DAF/SPK ", b"\0" * 5000, b"latitude_deg = 12\n" * 300])
def test_what_is_no_kernel_is_a_sentence(content, tmp_path):
    path = tmp_path / "other.bsp"
    path.write_bytes(content)
    with pytest.raises(TargetError, match="no SPK file, or damaged"):
        kernel(path)


def test_a_file_cut_short_anywhere_is_a_sentence(small, tmp_path):
    whole, path = small.read_bytes(), tmp_path / "short.bsp"
    for size in range(0, len(whole) - 8, 509):
        path.write_bytes(whole[:size])
        with pytest.raises(TargetError, match="damaged"):
            Kernel(path).state(301, WITHIN)


def test_damaged_bytes_give_a_place_or_a_sentence(small, tmp_path):
    rng = random.Random(42)  # noqa: S311 - nothing secret
    whole, path, said = small.read_bytes(), tmp_path / "damaged.bsp", []
    for _ in range(600):
        damaged = bytearray(whole)
        for _ in range(rng.choice([1, 3, 30])):
            damaged[rng.randrange(4096 if rng.random() < 0.7 else len(whole))] = rng.randrange(256)
        path.write_bytes(damaged)
        try:
            made = Kernel(path)
            if made.span(301) is not None:
                assert all(map(math.isfinite, made.state(301, WITHIN)[0]))
        except TargetError as error:
            said.append(str(error))
    print(f"600 damaged files: {len(said)} refused")
    assert len(said) > 50
    assert all("damaged.bsp" in text and "[targets] kernel" in text for text in said)


def test_a_file_that_changed_under_a_running_telescope_is_a_sentence(small, tmp_path):
    path = tmp_path / "changing.bsp"
    path.write_bytes(small.read_bytes())
    opened = Kernel(path)
    path.write_bytes(b"")
    with pytest.raises(TargetError, match="record"):
        opened.state(301, WITHIN)
    path.unlink()
    with pytest.raises(TargetError, match="cannot be read any more"):
        opened.state(399, WITHIN)


def test_without_the_reader_the_sentence_says_what_to_install(small, monkeypatch):
    monkeypatch.setitem(sys.modules, "jplephem.daf", None)
    with pytest.raises(TargetError, match=r"pip install 'clockdrive\[planets\]'"):
        Kernel(small)


def rewritten(source, path, kind, change):
    """A kernel of type 2 as one of another type, each record as `change` makes it."""
    with SPK.open(source) as given, path.open("w+b") as file:
        file.write(source.read_bytes()[:1024])
        daf = DAF(file)
        daf.fward = daf.bward = 2
        daf.free = 3 * 128 + 1
        daf.write_file_record()
        daf.write_record(2, struct.pack("<ddd", 0.0, 0.0, 0.0).ljust(1024, b"\0"))
        daf.write_record(3, b" " * 1024)
        for name, values in given.daf.summaries():
            numbers = given.daf.map_array(values[-2], values[-1])
            initial, length, size, count = numbers[-4:]
            records = [change(record) for record in numbers[:-4].reshape(int(count), int(size))]
            words = np.concatenate([*records, [initial, length, len(records[0]), count]])
            daf.add_array(name, (*values[:5], kind), words)
    return path


def test_a_kernel_with_velocities_of_its_own_gives_the_same_places(small, tmp_path):
    """SPK type 3: after the series of the place those of the velocity."""
    path = rewritten(small, tmp_path / "type3.bsp", 3, lambda record: [*record, *record[2:] * 7.0])
    assert Kernel(path).state(301, WITHIN) == Kernel(small).state(301, WITHIN)


def test_a_kernel_of_another_kind_is_a_sentence(small, tmp_path):
    with pytest.raises(TargetError, match=r"holds no body as Chebyshev series \(SPK types 2 and 3\)"):
        Kernel(rewritten(small, tmp_path / "type13.bsp", 13, lambda record: record))


def test_of_two_parts_the_one_that_covers_the_moment_is_taken(small, tmp_path):
    """Kernels of many centuries come in segments, one after the other in time."""
    early, late = 2451000.5, 2451064.5
    path = tmp_path / "parts.bsp"
    with SPK.open(bundled_kernel()) as whole, path.open("w+b") as file:
        moon = [(n, v) for n, v in whole.daf.summaries() if v[2] in {3, 301}]
        write_excerpt(whole, file, early, late, moon)
    with SPK.open(small) as later, path.open("r+b") as file:
        both = DAF(file)
        for name, values in later.daf.summaries():
            if values[2] in {3, 301}:
                both.add_array(name, values[:-2], later.daf.map_array(values[-2], values[-1]))
    joined = Kernel(path)
    for instant in (WITHIN, Instant(51030, 7.0)):
        assert joined.state(301, instant) == kernel(bundled_kernel()).state(301, instant)
    with pytest.raises(TargetError, match="body 301 is not in it at MJD 56000"):
        joined.state(301, Instant(56000, 0.0))
