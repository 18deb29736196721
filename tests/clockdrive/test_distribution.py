"""The four packages are used together or not at all."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import clockdrive
from clockdrive.distribution import PARTS, verify


def import_clockdrive(*, with_path: Path) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(with_path)}
    command = [sys.executable, "-P", "-c", "import clockdrive; print('imported')"]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=60)


def test_accepts_the_packages_installed_with_it():
    verify()


@pytest.mark.parametrize("name", PARTS)
def test_refuses_a_foreign_package_of_the_same_name_and_gives_the_remedy(name, tmp_path):
    package = tmp_path / name
    package.mkdir()
    (package / "__init__.py").write_text('"""Somebody else\'s."""\n')
    run = import_clockdrive(with_path=tmp_path)
    assert run.returncode == 1
    message = run.stderr.splitlines()[-1]
    assert message.startswith("ImportError: ")
    assert f"`{name}` would come from {tmp_path}" in message
    assert str(Path(clockdrive.__file__).parents[1]) in message
    assert "pipx install clockdrive" in message


def test_a_folder_that_is_no_package_does_no_harm(tmp_path):
    (tmp_path / "transports").mkdir()
    run = import_clockdrive(with_path=tmp_path)
    assert run.stdout == "imported\n", run.stderr


def test_says_so_when_a_part_is_missing(monkeypatch):
    monkeypatch.setattr("clockdrive.distribution.find_spec", lambda _name: None)
    with pytest.raises(ImportError, match="without its package `mounts`: install clockdrive again"):
        verify()


def test_the_same_place_by_another_name_is_the_same_place(tmp_path, monkeypatch):
    home = Path(clockdrive.__file__).parents[1]
    other_name = tmp_path / "linked"
    try:
        other_name.symlink_to(home, target_is_directory=True)
    except OSError as error:
        pytest.skip(f"this system makes no symbolic links: {error}")
    monkeypatch.setattr("clockdrive.distribution.__file__", str(other_name / "clockdrive" / "distribution.py"))
    verify()
