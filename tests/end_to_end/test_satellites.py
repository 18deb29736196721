"""High satellites are met by one slew and followed, on the simulator's wire."""

import pytest
from satellites import EPOCH_UTC, NO_DRAG, ORBITS, lines

from clockdrive import Telescope, VirtualClock
from pointing.instant import Instant
from pointing.satellite import Satellite
from pointing.tle import Tle
from pointing.visibility import passes

START = Instant.from_utc_iso(EPOCH_UTC).posix()
HIGH = {
    "Molniya": ORBITS["Molniya"],
    "GPS": ORBITS["GPS"],
    "geostationary": lines(41867, 0.05, 80.0, 0.0002, 90.0, 250.0, 1.00273, NO_DRAG),  # one that the site sees
}


def opened(time):
    return Telescope.simulated("tc410", clock=VirtualClock(time))


@pytest.mark.parametrize("name", HIGH)
def test_a_high_satellite_is_met_by_one_slew_and_followed(name, tmp_path, monkeypatch):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path))
    target = Satellite(Tle(*HIGH[name], name))
    with opened(START) as scope:
        found = max(passes(scope._session.planner, target, START, START + 86400.0), key=lambda each: each.duration)
    with opened(found.rise.time + found.duration / 3.0) as scope:
        arrival = scope.goto(target)
        worst = 0.0
        for _ in range(60):
            scope.wait(5.0)
            worst = max(worst, scope.status()["error_arcsec"])
        print(f"{name}: {arrival['arrival_error_arcsec']:.2f}″ on landing, at most {worst:.2f}″ in five minutes")
        assert arrival["slews"] == 1
        assert arrival["arrival_error_arcsec"] < 5.0  # a tenth of a second of its way, before tracking
        assert worst < 1.0
        assert scope.status()["doing"] == "tracking"
