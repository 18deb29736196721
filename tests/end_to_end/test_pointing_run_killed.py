"""A pointing run in a process of its own, which is killed in the middle of a star: the next process goes on there."""

import json
import signal
import subprocess
import sys
from pathlib import Path

STARS, KILLED_AT = 40, 17
LATER_S = 300.0  # until somebody has noticed
PROGRAM = """
import json, sys
from clockdrive import Telescope, VirtualClock

start, folder, resume, stop_at = float(sys.argv[1]), sys.argv[2], sys.argv[3] == "resume", int(sys.argv[4])
clock = VirtualClock(start)
overrides = {
    "state.path": folder, "mount.type": "german", "limits.sun_avoidance_deg": 0.0,
    "simulator.misalignment_x_arcsec": 2546.0, "simulator.misalignment_y_arcsec": -2546.0,
    "simulator.collimation_arcsec": 180.0, "simulator.nonperpendicularity_arcsec": 30.0,
    "simulator.flexure_arcsec": 20.0, "simulator.periodic_error_arcsec": 5.0, "simulator.sky_noise_arcsec": 2.0,
} | {f"axis{axis}.{ramp}_register": 255 for axis in (1, 2) for ramp in ("acceleration", "deceleration")}
visited = []

def watch(progress):
    if progress.state != "looking":
        return
    visited.append(progress.number)
    if progress.number == stop_at:
        print(json.dumps({"time": clock.now(), "visited": visited}), flush=True)
        sys.stdin.read()

with Telescope.simulated(clock=clock, overrides=overrides) as scope:
    report = scope.pointing_run(40, name=None if resume else "night", resume=resume, watch=watch)
    terms = {each.name: (each.arcsec, each.sigma_arcsec) for each in report.fit.coefficients}
    print(json.dumps({"visited": visited, "terms": terms, "rms": report.fit.sky_rms_arcsec,
                      "seen": len(report.stored.observations), "skipped": len(report.stored.skipped)}))
"""


def started(folder, start, resume="new", stop_at=0):
    command = [sys.executable, "-c", PROGRAM, str(start), str(folder), resume, str(stop_at)]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def ended(process):
    out, _ = process.communicate(timeout=90)
    assert process.returncode == 0
    return json.loads(out.splitlines()[-1])


def test_a_run_killed_at_star_17_of_40_goes_on_at_17_and_ends_with_the_same_fit(tmp_path: Path):
    """What is seen at a place does not depend on when that is: the scatter of a look is one of its place.

    The two differ in how far the slew to star 17 goes and in the Earth's turn meanwhile: by a count, 0.9″, at most.
    """
    whole = started(tmp_path / "whole", 1.8e9)
    killed = started(tmp_path / "killed", 1.8e9, stop_at=KILLED_AT)
    with killed:
        told = json.loads(killed.stdout.readline())
        killed.kill()
    assert killed.wait(30) == -signal.SIGKILL
    assert told["visited"] == list(range(1, KILLED_AT + 1))
    resumed = ended(started(tmp_path / "killed", told["time"] + LATER_S, "resume"))
    undisturbed = ended(whole)
    assert resumed["visited"] == list(range(KILLED_AT, STARS + 1))
    assert (resumed["seen"], resumed["skipped"]) == (undisturbed["seen"], undisturbed["skipped"]) == (STARS, 0)
    print(f"\nsky RMS {undisturbed['rms']:.3f}″ undisturbed, {resumed['rms']:.3f}″ killed at {KILLED_AT} and resumed")
    for name, (arcsec, sigma) in undisturbed["terms"].items():
        again = resumed["terms"][name][0]
        print(f"  {name:<5} {arcsec:+10.3f}″ ± {sigma:.3f}″  resumed {again:+10.3f}″  {again - arcsec:+.4f}″")
    assert list(resumed["terms"]) == list(undisturbed["terms"])
    assert max(abs(resumed["terms"][name][0] - arcsec) for name, (arcsec, _) in undisturbed["terms"].items()) < 0.01
