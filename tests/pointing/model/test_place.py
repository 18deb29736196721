"""A place in a mount's frame: the way over the pole."""

import math

import numpy as np
import pytest

from pointing.model.place import Frame
from pointing.model.run import PointingRun
from pointing.mount import Mount, MountType

KINDS = ("equatorial", "altazimuth")
LATITUDES_DEG = (51.5, -42.4)

kinds = pytest.mark.parametrize("kind", KINDS)
latitudes = pytest.mark.parametrize("latitude_deg", LATITUDES_DEG)


def vector(lon, lat):
    return np.array((np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)))


@kinds
@latitudes
def test_run_model_and_mount_go_beyond_the_pole_alike_and_over_the_visible_one(kind, latitude_deg):
    frame = Frame(kind, math.radians(latitude_deg))
    lon, lat = np.radians([-120.0, 10.0, 75.0]), np.radians([-30.0, 20.0, 60.0])
    over = frame.beyond_the_pole(lon, lat)
    assert np.allclose(vector(*over), vector(lon, lat), atol=1e-15)
    visible = -1.0 if kind == "equatorial" and latitude_deg < 0.0 else 1.0
    assert np.all(visible * over[1] > math.pi / 2.0)
    run = PointingRun(kind, frame.latitude, lon, lat, *over)
    assert np.array_equal(run.mechanical_star(), over)
    mount = Mount(MountType.ALTAZ_FORK if kind == "altazimuth" else MountType.EQUATORIAL_FORK, frame.latitude)
    for one, two, *there in zip(lon.tolist(), lat.tolist(), *over, strict=True):
        assert frame.beyond_the_pole(one, two) == tuple(there)
        found = mount.axes(mount.observed(one, two), "beyond")
        assert math.remainder(found[0] - there[0], math.tau) == pytest.approx(0.0, abs=1e-14)
        assert found[1] == pytest.approx(there[1], abs=1e-14)
