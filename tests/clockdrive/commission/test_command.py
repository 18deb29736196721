"""The command line: consent first, what differs goes into the file with its comments, and JSON for programs."""

import json
from pathlib import Path

import pytest

from clockdrive.cli import main
from clockdrive.commission import steps_of
from clockdrive.configuration import load
from clockdrive.drives.tc410.sections import drive_of


@pytest.fixture
def file(tmp_path: Path, monkeypatch):
    """A configuration of the embedded simulator that is wrong in two still-standing ways."""
    monkeypatch.delenv("CLOCKDRIVE_DRIVE__POSITION_FORMAT", raising=False)
    path = tmp_path / "telescope.toml"
    path.write_text(
        "# my telescope\n"
        "[site]\nlatitude_deg = -42.4\nlongitude_deg = 173.7\n"
        '[drive]\nkind = "tc410"\nlink = "sim:"\nposition_format = "right"  # as the manual seems to say\n'
        '[simulator]\nposition_format = "left"\n'
        f'[state]\npath = "{tmp_path / "state"}"\n',
        encoding="utf-8",
    )
    yield path
    monkeypatch.delenv("CLOCKDRIVE_DRIVE__POSITION_FORMAT", raising=False)


def test_a_wrong_position_format_is_found_and_written_on_consent(file, capsys):
    assert main(["-c", str(file), "commission", "--only", "position-format", "limits", "--yes", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["changes"] == {"drive.position_format": "left"}
    assert drive_of(load(file)).position_format == "left"
    assert "# as the manual seems to say" in file.read_text(encoding="utf-8")


def test_nothing_is_written_without_consent(file, capsys):
    before = file.read_text(encoding="utf-8")
    assert main(["-c", str(file), "commission", "--only", "position-format"]) == 0
    assert 'position_format = "left"' in capsys.readouterr().out
    assert file.read_text(encoding="utf-8") == before


def test_nothing_moves_without_consent(file, capsys):
    assert main(["-c", str(file), "commission", "--only", "sense"]) == 2
    assert "--yes" in capsys.readouterr().err


def test_an_unknown_step_lists_those_there_are(file, capsys):
    assert main(["-c", str(file), "commission", "--only", "gears", "--yes"]) == 2
    assert "gearing" in capsys.readouterr().err


@pytest.mark.parametrize(("kind", "step"), [("apo", "settings"), ("sdss", "clocks"), ("avr-box", "settings")])
def test_every_kind_of_drive_is_commissioned_from_the_command_line(kind, step, tmp_path, capsys):
    path = tmp_path / "telescope.toml"
    path.write_text(f'[drive]\nkind = "{kind}"\n[state]\npath = "{tmp_path / "state"}"\n', encoding="utf-8")
    steps = [each.name for each in steps_of(kind, ()) if not each.moves]
    name = step if step in steps else steps[0]
    assert main(["-c", str(path), "commission", "--only", name, "--yes", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ok"]
