"""A stepper box on a real port: a program is killed in the middle of a slew, and the next one knows where it is."""

import signal

from clockdrive.clock import SystemClock
from clockdrive.configuration import load
from clockdrive.drives.avr_box import kind
from transports.serve import serve

STEPS_PER_DEGREE = 200 * 64 * 57 / 11 / 2  # of axis 2


def test_after_its_program_was_killed_in_a_slew_the_next_program_says_where_it_is(tmp_path, started, run, answer):
    path = tmp_path / "telescope.toml"

    def write(link):
        path.write_text(
            f"[site]\nlatitude_deg = 52.0\nlongitude_deg = 5.0\n[limits]\nsun_avoidance_deg = 0.0\n"
            f'[state]\npath = "{tmp_path / "state"}"\n[drive]\nkind = "avr-box"\nlink = "{link}"\n'
            "max_uninterruptible_s = 4.0\n",
            encoding="utf-8",
        )

    write("sim:")
    unit = kind.simulated(load(path, {}, {}), SystemClock().now(), None)
    parked = unit.true_position(2)
    with serve(unit, SystemClock(), "tcp://127.0.0.1:0") as server:
        write(server.address)
        run("-c", path, "sync", "hadec:0,40", "--force")
        slewing = started("-c", path, "goto", "hadec:-1,43")
        slewing.until("slew")
        slewing.signal(signal.SIGKILL)
        slewing.ended()
        status = answer("-c", path, "status")
        unit.advance(SystemClock().now())
        true = unit.true_position(2) - parked + 40.0 * STEPS_PER_DEGREE
    found = status["axes"][1]["counts"]
    print(f"\n{status['trouble']}: axis 2 is said to be at {found:.0f}, and is at {true:.0f}")
    assert "was cut short; no command ends its last move" in status["trouble"]
    assert any("power switch" in note for note in status["notes"])
    assert status["left_alone"]["in_s"] > 0.0
    if status["synchronised"]:
        assert abs(found - true) <= status["axes"][1]["uncertainty_counts"] + 1.0
    else:
        assert "while it sent a move" in status["unsynchronised_because"]
