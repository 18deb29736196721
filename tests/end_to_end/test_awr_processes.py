"""An AWR Microstep on real ports: hosted by one command, moved by another, its keys guarded by a third process."""

import json
import os
import re

import pytest

FULL = os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full"


@pytest.fixture
def hosted(started, tmp_path):
    """A hosted unit, and the configuration that reaches it."""

    def host(listen):
        process = started("simulate", "awr", "--listen", listen)
        (link,) = re.findall(r"(?:tcp|serial)://[^\s;,]+", process.until("Ctrl-C ends"))
        path = tmp_path / "telescope.toml"
        path.write_text(
            f'[drive]\nkind = "awr"\nlink = "{link}"\nsidereal_steps_per_s = 50.0\nevent_jitter_s = 0.003\n'
            f"[axis2]\nsteps_per_degree = 12000.0\n"
            f'[limits]\nsun_avoidance_deg = 0.0\n[state]\npath = "{tmp_path / "state"}"\n',
            encoding="utf-8",
        )
        return path

    return host


@pytest.mark.parametrize("listen", ["tcp://127.0.0.1:0", "pty:"] if FULL else ["pty:"])
def test_sync_goto_and_the_drive_verbs_over_a_real_line(listen, hosted, run, answer):
    path = hosted(listen)
    if FULL:
        refused = run("-c", path, "goto", "hadec:0,-40", "--exit", code=1)
        assert "never synchronised" in refused.stderr
    run("-c", path, "sync", "hadec:0,-42.4")
    found = answer("-c", path, "goto", "hadec:0.3,-42.2", "--for", "1s")
    print(f"\n{listen}: {found['eta_s']:.1f} s, {found['arrival_error_arcsec']:.2f}″ at arrival")
    assert found["slews"] == 1
    assert found["arrival_error_arcsec"] < 5.0
    assert "on (was" in run("-c", path, "drive", "set", "relay_1", "on").stdout
    if not FULL:
        return
    shown = json.loads(run("-c", path, "drive", "show", "--json").stdout)["registers"]
    assert shown["version"]["text"] == "0.77"
    assert "in RAM only" in run("-c", path, "drive", "set", "guide_up_counts", "59000").stdout
    assert "upper case" in run("-c", path, "drive", "set", "guide_up_counts", "0xe000", code=1).stderr
    assert "held at guide speed" in run("-c", path, "drive", "raw", "axis2", "UP", "guide", "0.3").stdout
    status = json.loads(run("-c", path, "status", "--json").stdout)
    assert status["synchronised"]
    assert "relays: 1 on, 2 off, 3 off" in status["notes"]
