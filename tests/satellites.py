"""Element sets made for tests: orbits of every kind, with right checksums."""

import random

EPOCH = "26328.50000000"  # 2026 November 24, 12 h UTC
EPOCH_UTC = "2026-11-24T12:00:00Z"
NO_DRAG = " 00000-0"


def signed(line):
    """A line of 68 columns with its checksum."""
    assert len(line) == 68, line
    return line + str(sum(int(c) if c.isdigit() else c == "-" for c in line) % 10)


def lines(number, inclination, node, eccentricity, perigee, anomaly, motion, drag=" 38792-4", epoch=EPOCH):
    """The two lines of an orbit: degrees, revolutions a day."""
    return (
        signed(f"1 {number:05d}U 98067A   {epoch}  .00001764  00000-0 {drag} 0  999"),
        signed(
            f"2 {number:05d} {inclination:8.4f} {node:8.4f} {round(eccentricity * 1e7):07d} {perigee:8.4f}"
            f" {anomaly:8.4f} {motion:11.8f}    1"
        ),
    )


ORBITS = {
    "400 km": lines(25544, 51.6, 211.2, 0.0007, 17.0, 85.0, 15.5),
    "sun-synchronous": lines(39084, 98.2, 100.0, 0.001, 90.0, 270.0, 14.57),
    "Molniya": lines(24960, 63.4, 20.0, 0.72, 270.0, 10.0, 2.006, NO_DRAG),
    "GPS": lines(36585, 55.0, 30.0, 0.01, 40.0, 50.0, 2.0056, NO_DRAG),
    "geostationary": lines(41866, 0.05, 80.0, 0.0002, 90.0, 52.0, 1.00273, NO_DRAG),
}


def catalogue(count, seed=3):
    """Three-line sets of random satellites, mostly low ones, as the text of a file."""
    rng = random.Random(seed)  # noqa: S311 - nothing secret
    text = []
    for i in range(count):
        motion, eccentricity = rng.uniform(12.5, 15.6), rng.uniform(0.0, 0.004)
        if i % 10 == 0:
            motion, eccentricity = rng.choice([(2.0057, 0.01), (1.0027, 0.0003), (2.006, 0.7), (4.0, 0.2)])
        angles = [rng.uniform(0.0, 359.9) for _ in range(3)]
        text += [
            f"TEST {i}",
            *lines(10000 + i, rng.uniform(0.0, 110.0), angles[0], eccentricity, *angles[1:], motion, NO_DRAG),
        ]
    return "\n".join(text) + "\n"
