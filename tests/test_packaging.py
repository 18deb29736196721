"""The service and the udev rule fit the program that they start and the pages that explain them."""

import configparser
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from clockdrive.cli.exit_codes import INTERRUPTED, USAGE
from clockdrive.cli.parser import parser
from clockdrive.configuration import load
from mounts import deadman_process

CHECKOUT = Path(__file__).resolve().parents[1]
SERVICE = CHECKOUT / "packaging" / "clockdrive.service"
RULES = CHECKOUT / "packaging" / "99-clockdrive.rules"

pytestmark = pytest.mark.checkout


@pytest.fixture
def service() -> dict[str, str]:
    unit = configparser.ConfigParser(interpolation=None, delimiters=("=",), comment_prefixes=("#",))
    unit.optionxform = str  # systemd's keys have capitals
    unit.read(SERVICE, encoding="utf-8")
    assert unit.sections() == ["Unit", "Service", "Install"]
    return dict(unit["Service"])


def test_the_command_that_is_started_is_one_that_there_is(service):
    program, *words = shlex.split(service["ExecStart"])
    assert Path(program).name == "clockdrive"
    assert parser().parse_args(words).command == "run"


def test_the_state_is_where_the_service_may_write(service):
    variable, _, path = service["Environment"].partition("=")
    assert path == f"%S/{service['StateDirectory']}"
    found = load(None, environment={variable: path.replace("%S", "/var/lib")}, overrides={})
    assert found.state_directory == Path("/var/lib/clockdrive")


def test_a_death_is_followed_by_a_start_and_a_wrong_configuration_is_not(service):
    assert service["Restart"] == "on-failure"
    assert int(service["SuccessExitStatus"]) == INTERRUPTED
    assert int(service["RestartPreventExitStatus"]) == USAGE


def test_the_dead_man_process_outlives_its_owner_and_may_finish(service):
    assert service["KillMode"] == "control-group"
    attempts, quick = deadman_process.ATTEMPTS, deadman_process.QUICK_ATTEMPTS
    pauses = quick * deadman_process.QUICK_PAUSE_S + (attempts - quick) * deadman_process.PAUSE_S
    one = deadman_process.CONNECT_S + deadman_process.SENDS * deadman_process.ANSWER_S
    patience = attempts * one + pauses
    print(f"the dead-man process gives up after {patience:.0f} s at the latest")
    assert int(service["TimeoutStopSec"]) > patience


def test_a_serial_port_may_be_opened(service):
    assert service["SupplementaryGroups"] == "dialout"
    assert 'GROUP="dialout"' in RULES.read_text(encoding="utf-8")


def test_systemd_takes_the_service(tmp_path):
    analyze = shutil.which("systemd-analyze")
    if analyze is None:
        pytest.skip("systemd is not installed here")
    unit = tmp_path / SERVICE.name
    text = SERVICE.read_text(encoding="utf-8").replace("/opt/clockdrive/bin/clockdrive", sys.executable)
    unit.write_text(text, encoding="utf-8")
    run = subprocess.run(
        [analyze, "verify", "--man=no", str(unit)], capture_output=True, text=True, check=False, timeout=60
    )
    about = [row for row in (run.stdout + run.stderr).splitlines() if unit.name in row]
    assert not about


def test_every_udev_rule_is_well_formed_and_makes_the_name_of_the_pages():
    rules = [row for row in RULES.read_text(encoding="utf-8").splitlines() if row and not row.startswith("#")]
    one = r'[A-Z]+(?:\{[A-Za-z_]+\})?(?:==|!=|\+=|=)"[^"]*"'
    assert all(re.fullmatch(rf"{one}(?:, {one})*", rule) for rule in rules)
    assert 'SYMLINK+="clockdrive"' in rules[0]
    assert "serial:///dev/clockdrive" in (CHECKOUT / "docs" / "service.md").read_text(encoding="utf-8")
