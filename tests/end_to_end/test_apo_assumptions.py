"""Controllers that read the manual otherwise than the driver assumes: it notices or refuses, and never mispoints."""

import pytest
from apo_bench import ApoWitness, apo_telescope
from telescope_bench import star_at

from clockdrive.errors import ClockdriveError
from mounts.errors import DriveError
from transports.errors import TransportError

OURS = (ClockdriveError, DriveError, TransportError)
HARMLESS = {
    "it goes on when its path runs out": ("apo", {"simulator__on_expiry": "extrapolate"}),
    "it halts when its path runs out": ("apo", {"drive__on_expiry": "extrapolate"}),
    "it holds more nodes": ("apo", {"drive__max_nodes": 4}),
    "it joins the first node": ("apo", {"simulator__first_node": "join"}),
    "it is silent about what it does not obey": ("sdss", {"simulator__refusals": "silence"}),
    "its clocks are 0.3 s ahead": ("sdss", {"simulator__clock_offset_s": 0.3}),
    "its clocks gain 20 ppm": ("apo", {"simulator__clock_drift_ppm": 20.0}),
}
NOTED = {
    "its limits have another command": (
        "apo",
        {"simulator__limits_command": "LIMITS"},
        "does not tell its soft limits",
    ),
    "it does not tell its settings": ("sdss", {"simulator__tells_settings": False}, "does not tell its MAXV"),
}
REFUSED = {
    "it holds fewer nodes": ("apo", {"simulator__max_nodes": 4}, r"the buffer holds 4 nodes.*max_nodes"),
    "it holds fewer and is silent": (
        "apo",
        {"simulator__max_nodes": 4, "simulator__refusals": "silence"},
        "path|motion error",
    ),
    "the axis stands on a line of its own": ("sdss", {"simulator__axis_select": "line"}, "axis_select"),
    "the axis stands before the command": ("sdss", {"drive__axis_select": "line"}, "axis_select"),
    "its clocks are not set": ("apo", {"simulator__clock_set": False}, "azimuth: .*clock is not set"),
    "its clocks keep UTC": ("apo", {"simulator__clock_offset_s": -37.0}, r"azimuth: .*-37\.000 s off.*UTC.*0\.4 s"),
    "its clocks keep GPS time": ("sdss", {"simulator__clock_offset_s": -19.0}, r"-19\.000 s off.*GPS time"),
    "its clocks are half a second late": (
        "sdss",
        {"simulator__clock_offset_s": -0.5},
        r"-0\.500 s off, more than 0\.4",
    ),
}


@pytest.mark.parametrize("reading", HARMLESS)
def test_it_points_as_well_all_the_same(reading, tmp_path):
    kind, wrong = HARMLESS[reading]
    with apo_telescope(kind, tmp_path, **wrong) as scope:
        witness, worst = ApoWitness(scope), 0.0
        for azimuth, altitude in ((150.0, 50.0), (40.0, 70.0)):
            star = star_at(scope, azimuth, altitude, scope.clock.now() + 60.0)
            scope.goto(star)
            at_arrival = witness.on_sky_arcsec(star, witness.at_arrival(), witness.arrivals[-1])
            worst = max(worst, at_arrival, *witness.tracked_arcsec(star, 40.0, 1.3))
        print(f"{reading}: at most {worst:.4f}″ off at arrival and afterwards")
        assert worst < 0.05
        assert not witness.dry()


@pytest.mark.parametrize("reading", NOTED)
def test_what_cannot_be_asked_for_is_said(reading, tmp_path):
    kind, wrong, said = NOTED[reading]
    with apo_telescope(kind, tmp_path, **wrong) as scope:
        assert any(said in note for note in scope.status()["notes"])
        scope.goto(star_at(scope, 150.0, 50.0))
        assert scope.status()["doing"] == "tracking"


@pytest.mark.parametrize("reading", REFUSED)
def test_it_refuses_with_axis_value_and_remedy_and_all_axes_stand(reading, tmp_path):
    kind, wrong, said = REFUSED[reading]
    with pytest.raises(OURS, match=said) as refusal:
        _gone(kind, tmp_path, wrong)
    print(refusal.value)


def _gone(kind, folder, wrong):
    """Open, go, and see the axes stand, whatever became of it."""
    with apo_telescope(kind, folder, **wrong) as scope:
        try:
            scope.goto(star_at(scope, 150.0, 50.0))
        finally:
            scope.wait(60.0)
            scope.simulator.advance(scope.clock.now())
            assert all(abs(axis.servo.velocity) < 1e-9 for axis in scope.simulator.axes)
