"""Motion about the Sun by integrating its equation of motion: what closed forms are held against.

r″ = −µ r / r³ as a power series in time, its coefficients by recurrence through r² and r⁻³, summed over steps that
are a small share of the time in which the body would fall into the Sun or fly its distance. No element and no Kepler
equation enters.
"""

import erfa
import numpy as np

GM = 0.01720209895**2  # Gauss, au³/day²
OBLIQUITY = np.radians(84381.448 / 3600.0)  # IAU 1976
ORDER = 24


def series(place, velocity):
    """Return the Taylor coefficients of the position: an array of shape (ORDER + 1, dimensions)."""
    x = np.zeros((ORDER + 1, len(place)))
    x[0], x[1] = place, velocity
    square, cube = np.zeros(ORDER + 1), np.zeros(ORDER + 1)  # r² and r⁻³
    for k in range(ORDER - 1):
        square[k] = np.sum(x[: k + 1] * x[k::-1])
        if k == 0:
            cube[0] = square[0] ** -1.5
        else:  # u = s^p: k s₀ u_k = Σ (p (i) − (k − i)) s_i u_{k−i}, p = −3/2
            i = np.arange(1, k + 1)
            cube[k] = np.sum((-1.5 * i - (k - i)) * square[1 : k + 1] * cube[k - 1 :: -1][:k]) / (k * square[0])
        pull = cube[: k + 1] @ x[k::-1]
        x[k + 2] = -GM * pull / ((k + 1) * (k + 2))
    return x


def integrated(place, velocity, days):
    """Position and velocity after `days`, au and au a day."""
    place, velocity = np.array(place, float), np.array(velocity, float)
    while days:
        far, fast = np.linalg.norm(place), np.linalg.norm(velocity)
        step = np.sign(days) * min(abs(days), 0.15 * min(far**1.5 / np.sqrt(GM), far / fast))
        x = series(place, velocity)
        powers = step ** np.arange(ORDER + 1)
        velocity = (np.arange(1, ORDER + 1)[:, None] * x[1:] * powers[:-1, None]).sum(axis=0)
        place = (x * powers[:, None]).sum(axis=0)
        days -= step
    return place, velocity


def at_perihelion(q, e):
    """Position and velocity in the orbit's plane, by the energy: v² = µ (1 + e) / q."""
    return (q, 0.0, 0.0), (0.0, np.sqrt(GM * (1.0 + e) / q), 0.0)


def ecliptic_to_equator(vector, inclination, node, argument):
    """ERFA's rotations of the frame, applied backwards, with the obliquity of the Minor Planet Center."""
    turn = np.eye(3)
    for rotate, angle in ((erfa.rx, OBLIQUITY), (erfa.rz, node), (erfa.rx, inclination), (erfa.rz, argument)):
        turn = rotate(angle, turn)
    return turn.T @ np.array(vector)
