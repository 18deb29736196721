"""Guide, centre, offset and instrument from a second terminal, while the first one tracks."""

import pytest

from clockdrive.cli import main


@pytest.fixture
def tracked(started, written):
    """A telescope at the simulator's link that tracks in a process of its own; the configuration's file."""
    file = written("sim:")
    with file.open("a", encoding="utf-8") as text:
        text.write("[instruments.main]\nx_arcsec = 0.0\n[instruments.camera]\nx_arcsec = 120.0\n")
    started("-c", file, "goto", "hadec:1,-41").until("off on landing")
    return file


def named(status):
    return {row["name"]: row for row in status["corrections"]}


def test_pulses_solutions_and_origins_are_shown_and_cleared_by_their_names(tracked, run, answer):
    command = ("-c", tracked)
    assert "-15.04″ north in all" in run(*command, "guide", "S", "2000").stdout
    assert named(answer(*command, "status"))["guide north"]["value"] == pytest.approx(-15.041, abs=0.001)
    run(*command, "offset", "clear", "guide")
    assert "guide north" not in named(answer(*command, "status"))

    then = answer(*command, "status")
    place = f"{then['icrs']['ra_deg']:.6f}", f"{then['icrs']['dec_deg'] + 0.002:.6f}"
    found = answer(*command, "centre", *place, "--at", then["position_utc"])
    assert found["error"]["north_arcsec"] == pytest.approx(-7.2, abs=0.05)
    assert found["error"]["east_arcsec"] == pytest.approx(0.0, abs=0.05)
    shown = run(*command, "status").stdout
    assert "centre north: " in shown
    assert "on hadec:1,-41" in shown
    run(*command, "guide", "N", "1000")
    said = run(*command, "centre", *place, "--at", then["position_utc"]).stdout
    assert "it took in and cleared the guide pulses, +0.00″ east, +7.52″ north" in said
    assert "guide north" not in named(answer(*command, "status"))
    run(*command, "offset", "clear", "centre north")
    assert "centre north" not in named(answer(*command, "status"))

    assert "* main: x +0.00″" in run(*command, "instrument").stdout
    assert "the target was put on it" in run(*command, "instrument", "camera").stdout
    rows = named(answer(*command, "status"))
    assert rows["pointing origin x"]["value"] == pytest.approx(120.0)
    assert rows["pointing origin x"]["origin"] == "camera"


BAD = {
    ("guide", "up", "100"): "give one of north",
    ("guide", "N", "0"): "1 to 10000 ms",
    ("centre", "83.6", "95"): "declination 95",
    ("centre", "altaz:1,2"): "no place of an image",
    ("instrument", "spectrograph"): "there is main, camera",
    ("offset", "clear", "mount x"): "mount_x_mas",
    ("plan", "M1", "--instrument", "camera"): "goes with --from",
    ("rates", "M1", "--instrument", "x"): "no instrument 'x'",
}


def test_bad_input_is_a_sentence(tracked, capsys):
    """This process is the second terminal: a program of its own for each would take most of the time."""
    for words, said in BAD.items():
        assert main(["-c", str(tracked), *words]) == (2 if words[0] in {"plan", "guide", "centre"} else 1)
        assert said in capsys.readouterr().err
