"""A configuration file is changed as a person would: the line that matters, and nothing else."""

import tomllib

import pytest

from clockdrive.configuration import load
from clockdrive.configuration_edit import change, edited, lines
from clockdrive.configuration_file import commented_template
from clockdrive.drives.tc410.sections import axes_of, drive_of
from clockdrive.errors import ConfigurationError

TEXT = """\
# my telescope
[site]
latitude_deg = -42.4   # south
name = "Hill # 3"      # a name with a mark

[axis1]   # the polar axis
# acceleration_register = 26  # of the maker
main_gear = "1/285"# tight
"""


def test_a_value_is_changed_where_it_stands_and_comments_stay():
    after = edited(TEXT, {"site.latitude_deg": -41.0, "site.name": 'The "Hill"', "axis1.main_gear": "1/288"})
    assert "latitude_deg = -41.0   # south" in after
    assert 'name = "The \\"Hill\\""      # a name with a mark' in after
    assert 'main_gear = "1/288"# tight' in after
    assert after.count("\n") == TEXT.count("\n")


def test_a_key_that_is_not_there_goes_below_its_commented_line_or_head_or_into_a_new_section():
    after = edited(TEXT, {"axis1.acceleration_register": 30, "axis1.motor_steps": 400, "drive.fan_start_c": 40.5})
    assert "# acceleration_register = 26  # of the maker\nacceleration_register = 30\n" in after
    assert "[axis1]   # the polar axis\nmotor_steps = 400\n" in after
    assert after.endswith("\n\n[drive]\nfan_start_c = 40.5\n")
    assert tomllib.loads(after)["axis1"]["motor_steps"] == 400


def test_a_whole_template_takes_every_change_and_stays_valid(tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text(commented_template("tc410"), encoding="utf-8")
    before = path.read_text(encoding="utf-8").splitlines()
    change(path, {"axis2.park_deg": 12.5, "drive.joystick_mode": 5, "axis1.main_gear": "1/288"})
    made = load(path)
    assert (made.axes[1].park_deg, drive_of(made).joystick_mode, axes_of(made)[0].main_gear.denominator) == (
        12.5,
        5,
        288,
    )
    after = path.read_text(encoding="utf-8").splitlines()
    assert [line for line in before if line not in after] == []
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("text", "changes", "reason"),
    [
        ('axis1.main_gear = "1/285"\n', {"axis1.main_gear": "1/288"}, "put in by hand"),
        ('axis1 = {main_gear = "1/285"}\n', {"axis1.main_gear": "1/288"}, "put in by hand"),
        (TEXT, {"axis1.motor_steps": -3}, "axis1.motor_steps = -3"),
    ],
)
def test_a_file_that_cannot_be_changed_so_stays_as_it_was(text, changes, reason, tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match=reason):
        change(path, changes)
    assert path.read_text(encoding="utf-8") == text
    assert [each.name for each in tmp_path.iterdir()] == ["telescope.toml"]


def test_changes_alone_are_lines_of_a_file():
    text = lines({"axis1.park_deg": 1.5, "axis1.main_gear": "1/285", "drive.fan_stop_c": 20})
    assert tomllib.loads(text) == {"axis1": {"park_deg": 1.5, "main_gear": "1/285"}, "drive": {"fan_stop_c": 20}}
