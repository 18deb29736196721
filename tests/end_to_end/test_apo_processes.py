"""Axis controllers on real ports: hosted by one command, gone to by another."""

import json
import re

import pytest


@pytest.fixture
def hosted(started, tmp_path):
    """Two hosted controllers of a 3.5 m telescope, and the configuration that reaches them."""

    def host(kind):
        process = started("simulate", kind, "--listen", "tcp://127.0.0.1:0")
        links = re.findall(r"tcp://[\d.:]+", process.until("Ctrl-C ends"))
        path = tmp_path / "telescope.toml"
        if kind == "apo":
            drive = "".join(f'[axis{i}]\nlink = "{link}"\n' for i, link in enumerate(links, start=1))
        else:
            drive = f'link = "{links[0]}"\n'
        path.write_text(
            f"[site]\nlatitude_deg = 32.7803\nlongitude_deg = -105.8203\nheight_m = 2788.0\n"
            f'[limits]\nsun_avoidance_deg = 0.0\n[state]\npath = "{tmp_path / "state"}"\n'
            f'[drive]\nkind = "{kind}"\n{drive}',
            encoding="utf-8",
        )
        return links, path

    return host


@pytest.mark.parametrize(("kind", "lines"), [("apo", 2), ("sdss", 1)])
def test_a_goto_over_tcp_arrives_and_another_terminal_asks_the_controllers(kind, lines, hosted, run, answer):
    links, path = hosted(kind)
    assert len(links) == lines
    found = answer("-c", path, "goto", "altaz:3,46", "--for", "2s")
    print(f"{kind}: {found['eta_s']:.1f} s, {found['arrival_error_arcsec']:.3f}″ at arrival over TCP")
    assert found["slews"] == 1
    assert found["arrival_error_arcsec"] < 1.0
    shown = json.loads(run("-c", path, "drive", "show", "--json").stdout)["registers"]
    assert shown["azimuth velocity"]["text"] == "+0.00000°/s"
    assert "clock offset" in " ".join(shown)
    assert "agrees" in run("-c", path, "drive", "diff").stdout
    assert "axis code" in run("-c", path, "drive", "raw", "altitude", "ID").stdout
    refused = run("-c", path, "drive", "raw", "azimuth", "SET.POSITION", "3.0", code=2)
    assert "--yes" in refused.stderr
