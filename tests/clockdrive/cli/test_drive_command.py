"""The drive's registers on the command line: all of the manual's, each seen, each writable one written and restored.

The manual's own tables are the oracle: addresses and descriptions are taken from its text.
"""

import json
import re
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from clockdrive.cli.backend import backend
from clockdrive.cli.main import main
from clockdrive.clock import SystemClock, VirtualClock
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.drives.tc410.sections import axes_of, drive_of
from clockdrive.telescope import parts
from mounts.tc410.registers import REGISTERS, at, by_name
from mounts.tc410.upkeep import ACTIONS
from transports.serve import serve

KINDS = {"Coil": "coil", "Discrete": "discrete", "Input": "input", "Holding": "holding"}


def manual_rows(text):
    """(table, kind, address, description) of Tables 17 to 31; a table stands above its caption."""
    rows, waiting = [], []
    for line in text[text.index("### 4.8. Modbus registers") :].splitlines():
        if found := re.match(r"0x([0-9A-F]{4})\t(.*)", line):
            waiting.append((int(found[1], 16), found[2].strip()))
        elif found := re.match(r"\*?Table (\d+): Modbus (\w+)", line):
            rows += [(int(found[1]), KINDS[found[2]], *row) for row in waiting]
            waiting = []
    assert not waiting
    return rows


@pytest.fixture
def manual(shared):
    return manual_rows((shared / "manuals" / "000_tc410.txt").read_text(encoding="utf-8"))


@pytest.fixture
def run(capsys, tmp_path):
    """Run a command of the telescope hosted over TCP; return its answer, or its refusal."""
    with hosted(tmp_path) as (config, device):

        def do(*words, ok=True):
            code = main(["-c", str(config), *words, "--json"])
            answer = json.loads(capsys.readouterr().out.splitlines()[-1])
            assert (code == 0) is ok, answer
            assert answer["ok"] is ok
            return answer

        do.device, do.config = device, config
        yield do


@contextmanager
def hosted(folder, **more):
    configuration = load(None, {}, {"limits.sun_avoidance_deg": 0.0, **more})
    clock = SystemClock()
    device = tc410.simulated(configuration, clock.now(), None)
    with serve(device, clock, "tcp://127.0.0.1:0") as server:
        path = folder / "telescope.toml"
        path.write_text(
            "# my telescope\n[site]\nlatitude_deg = -42.4  # south\nlongitude_deg = 173.7\nheight_m = 30.0\n"
            f'[drive]\nkind = "tc410"\nlink = "{server.address}"  # loopback\n'
            "[limits]\nsun_avoidance_deg = 0.0\nhorizon_deg = -5.0\n"
            f'[state]\npath = "{(folder / "state").as_posix()}"\n'
            "[axis1]\nacceleration_register = 26   # from the maker\n# park_deg = 0.0\n",
            encoding="utf-8",
        )
        yield path, device


def test_every_row_of_the_manuals_tables_is_in_the_register_table_and_in_drive_show(manual, run):
    assert {row[0] for row in manual} == set(range(17, 32))
    print(f"{len(manual)} rows in Tables 17 to 31")
    shown = run("drive", "show")["registers"]
    for table, kind, address, description in manual:
        if description == "Reserved":
            assert not any(r.kind == kind and r.address <= address < r.address + r.words for r in REGISTERS)
            continue
        row = at(kind, address)
        if table == 31:
            assert row.access == "write"
            continue
        found = shown[row.name]
        assert found["kind"] == kind
        assert found["address"] <= address < found["address"] + len(found["raw"])
        axis = re.match(r"Axis (\d)", description)
        if axis and kind == "discrete":
            assert row.name.startswith(f"axis{axis[1]}_")
        for word in ("hard", "soft", "positive", "negative", "joystick", "tracking", "encoder"):
            if re.search(rf"\b{word}\b", description, re.IGNORECASE) and kind == "discrete":
                assert word in row.name
    addresses = {(kind, address) for _, kind, address, description in manual if description != "Reserved"}
    ours = {(row.kind, row.address + word) for row in REGISTERS for word in range(row.words)}
    assert ours == addresses


def another(name, was):
    """A value that the register also takes, and that is told from the one it has."""
    if name == "velocity_control":
        return 0x38
    if name in {"joystick_mode", "autoguider_mode"}:
        return 5
    if name.endswith("_motor_current"):
        return was - 0.5
    if name.endswith("_temperature"):
        return was - 1.5
    return was - 0x100 if name.endswith(("_limit", "_max_speed", "_park")) else was + 1


def test_every_writable_register_is_written_read_back_and_restored(manual, run):
    writable = {at(kind, address).name for table, kind, address, text in manual
                if kind == "holding" and table != 31 and text != "Reserved"}  # fmt: skip
    assert len(writable) == sum(row.access == "read-write" and row.kind == "holding" for row in REGISTERS)
    with backend(str(run.config), "run", may_attach=False):  # commands attach to it
        before = run("drive", "show")["registers"]
        for name in sorted(writable):
            was = before[name]["value"]
            other = another(name, was)
            row = run("drive", "set", name, str(other), "--force")["registers"][name]
            assert row["value"] == pytest.approx(other), name
            assert run("drive", "show", name)["registers"][name]["raw"] == row["raw"] != before[name]["raw"]
            restored = run("drive", "set", name, str(was), "--force")["registers"][name]
            assert restored["raw"] == before[name]["raw"], name
        after = run("drive", "show")["registers"]
        changed = [name for name in before if after[name]["raw"] != before[name]["raw"]]
        print(f"{len(writable)} registers written, read back and restored; changed afterwards: {changed}")
        assert changed == []


@pytest.mark.parametrize(
    ("name", "value", "remedy"),
    [
        ("axis1_position", "8388608", "`sync TARGET`"),
        ("axis2_target_position", "8388608", "`goto`"),
        ("axis1_target_velocity", "1000", "`drive speed`"),
        ("velocity_control", "0x38", "`goto`"),
        ("power", "0", "`drive power standby`"),
        ("axis1_positive_limit", "9000000", "max_deg"),
        ("all_stop", "1", "`stop`"),
        ("load_factory", "1", "`drive factory --yes`"),
        ("axis1_encoder", "1", "`drive show`"),
        ("axis1_motor_current", "6", "outside 1 to 5 A"),
        ("fan_start_temperature", "4000", "outside -3276.8 to 3276.7"),
        ("fan_start_temperature", "30", "allowed above fan_stop_temperature = 30 °C"),
        ("fan_stop_temperature", "35.1", "allowed below fan_start_temperature = 35 °C"),
        ("joystick_mode", "18", "allowed 0 to 17, a shift of the linear range, or 128, logarithmic"),
        ("autoguider_mode", "0xC0", "allowed 0 to 17, a shift of the linear range, or 128, logarithmic"),
        ("nonsense", "1", "no register"),
    ],
)
def test_what_would_move_or_mislead_is_refused_with_the_command_that_does_it(name, value, remedy, run):
    before = dict(run.device.memory._words)
    assert remedy in run("drive", "set", name, value, ok=False)["reason"]
    after = {address: word for address, word in run.device.memory._words.items() if before[address] != word}
    of_a_connection = {0x12, 0x13, 0x32, 0x33, 0x50, 0x51, 0x52, 0x53, 0x60, 0x61, 0x62, 0x63}  # limits, boot cookie
    assert not set(after) - of_a_connection


def test_the_bits_that_move_the_telescope_are_not_set_by_hand_even_with_force(run):
    reason = run("drive", "set", "velocity_control", "remote_control", "--force", ok=False)["reason"]
    assert "remote_control would change" in reason
    row = run("drive", "set", "velocity_control", "joystick, digital_autoguider", "--force")["registers"]
    assert row["velocity_control"]["flags"] == ["joystick", "digital_autoguider"]


def test_more_current_than_an_ims_drive_gives_is_refused(capsys, tmp_path):
    with hosted(tmp_path, **{"axis1.drive_type": "ims"}) as (config, _):
        assert main(["-c", str(config), "drive", "set", "axis1_motor_current", "3.5", "--json"]) == 1
        assert "allowed 1 to 3 A with the drive type IMS" in json.loads(capsys.readouterr().out)["reason"]


@pytest.mark.parametrize(("start", "stop"), [(50.0, 45.5), (-5.7, -12.3)])
def test_fan_temperatures_are_pushed_together_and_each_alone_is_judged_beside_the_other(start, stop, run):
    text = run.config.read_text(encoding="utf-8")
    fans = f"# loopback\nfan_start_c = {start}\nfan_stop_c = {stop}"
    run.config.write_text(text.replace("# loopback", fans), encoding="utf-8")
    alone = ("drive.fan_stop_c", "drive.fan_start_c")[start < 0.0]  # beside what the unit has, 35 and 30 °C
    assert "change that one first" in run("drive", "push", alone, ok=False)["reason"]
    written = run("drive", "push")["registers"]
    assert written["fan_start_temperature"]["value"] == start
    assert run.device.memory.raw("fan_stop_temperature") == round(10.0 * stop) & 0xFFFF


def test_diff_pull_and_push_join_file_and_unit(run):
    assert run("drive", "diff")["differences"] == []
    run("drive", "set", "axis1_acceleration", "31")
    run("drive", "set", "axis2_main_gear_divisor", "288")
    run("drive", "set", "axis1_park", str(0x800000 + 0x2000))
    (row,) = [d for d in run("drive", "diff")["differences"] if d["register"] == "axis1_acceleration"]
    assert (row["key"], row["unit"], row["configured"]) == ("axis1.acceleration_register", 31.0, 26.0)
    changed = run("drive", "pull")["changed"]
    assert changed["axis1.acceleration_register"] == 31
    text = run.config.read_text(encoding="utf-8")
    assert "acceleration_register = 31   # from the maker" in text
    assert "# my telescope" in text
    assert re.search(r"# park_deg = 0.0\npark_deg = 2\.0", text)
    assert run("drive", "diff")["differences"] == []
    run.config.write_text(text.replace("= 31 ", "= 27 "), encoding="utf-8")
    written = run("drive", "push", "axis1.acceleration_register")["registers"]
    assert written["axis1_acceleration"]["value"] == 27.0
    assert run.device.memory.raw("axis1_acceleration") == 27
    assert "no key that the drive keeps" in run("drive", "push", "site.name", ok=False)["reason"]


def test_gears_are_compared_pulled_and_begun_from_by_their_teeth(run, capsys):
    """16/40 in the unit and in the file are the same, and neither is made 2/5 of."""
    assert run.device.memory.raw("axis1_secondary_gear_multiplier") == 16
    text = run.config.read_text(encoding="utf-8")
    run.config.write_text(text.replace("[axis1]", '[axis1]\nsecondary_gear = "16/40"'), encoding="utf-8")
    assert run("drive", "diff")["differences"] == []
    run("drive", "set", "axis1_secondary_gear_multiplier", "18")
    run("drive", "set", "axis1_secondary_gear_divisor", "45")
    assert run("drive", "pull")["changed"] == {"axis1.secondary_gear": "18/45"}
    assert run("drive", "diff")["differences"] == []
    assert main(["init", "--from", load(run.config).drive.link]) == 0
    assert 'secondary_gear = "18/45" ' in capsys.readouterr().out


def test_a_unit_whose_gears_contradict_the_file_is_told_by_value_and_range_and_let_go(run):
    """A link left open would be an error here, as every warning is."""
    run.device.memory.put(by_name("axis1_main_gear_divisor"), (60000,))
    reason = run("status", ok=False)["reason"]
    assert re.search(r"axis1\.min_deg = -170: allowed -\d+\.\d\d to \d+\.\d\d deg, which the drive's 24 bits", reason)
    run.device.memory.put(by_name("axis1_main_gear_divisor"), (285,))
    assert "axes" in run("status")


def test_saved_registers_survive_the_power_and_others_do_not(run):
    run("drive", "set", "axis1_joystick_centre", "130")
    run.device.power_cycle()
    assert run("drive", "show", "joystick_centre")["registers"]["axis1_joystick_centre"]["value"] == 0
    run("drive", "set", "axis1_joystick_centre", "130")
    run("drive", "save")
    run.device.power_cycle()
    assert run("drive", "show", "joystick_centre")["registers"]["axis1_joystick_centre"]["value"] == 130


@pytest.mark.parametrize("action", ["factory", "reload"])
def test_loading_registers_anew_wants_a_word_and_leaves_no_position(action, run):
    run("drive", "set", "axis1_joystick_centre", "130")
    assert "--yes" in run("drive", action, ok=False)["reason"]
    assert run.device.memory.raw("axis1_joystick_centre") == 130
    limits = run.device.memory.raw("axis1_negative_limit")
    run("drive", action, "--yes")
    assert run.device.memory.raw("axis1_joystick_centre") == 0
    assert run.device.memory.raw("axis1_negative_limit") == limits  # the host's bound is back at once
    assert "loaded anew" in run("status")["unsynchronised_because"]


def test_standby_and_power_are_switched(run):
    run("drive", "power", "standby")
    assert not run.device.powered
    run("drive", "power", "on")
    assert run.device.powered


def test_an_unconfigured_encoder_is_shown_as_it_reads(run):
    one, two = run("drive", "encoders")["encoders"]
    assert (one["axis"], one["detected"], one["bits"], two["axis"]) == (1, False, 0, 2)


def test_init_writes_the_units_registers_as_a_configuration(run, capsys, tmp_path):
    run("drive", "set", "axis2_main_gear_divisor", "288")
    run("drive", "set", "fan_start_temperature", "41.5")
    link = load(run.config).drive.link
    assert main(["init", "--from", link, "--json"]) == 0
    text = json.loads(capsys.readouterr().out)["toml"]
    path = tmp_path / "made.toml"
    path.write_text(text, encoding="utf-8")
    made = load(path)
    assert axes_of(made)[1].main_gear.denominator == 288
    assert drive_of(made).fan_start_c == 41.5
    assert made.drive.link == link
    path.write_text(text + f'[state]\npath = "{(tmp_path / "other").as_posix()}"\n'
                    if "\n[state]" not in text else text, encoding="utf-8")  # fmt: skip
    assert main(["-c", str(path), "drive", "diff", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["differences"] == []


def test_actions_have_their_commands():
    assert set(ACTIONS) == {row.name for row in REGISTERS if row.access == "write"}


def test_what_people_and_power_do_is_shown_by_name(run):
    run.device.disturb(
        joystick=(200, 31), autoguider=(128, 90), directions=("north",), temperatures_c=(-5.7, 20.5, 44.0)
    )
    shown = run("drive", "show")["registers"]
    assert [shown[f"joystick_adc_axis{axis}"]["value"] for axis in (1, 2)] == [200, 31]
    assert [shown[f"autoguider_adc_axis{axis}"]["value"] for axis in (1, 2)] == [128, 90]
    assert shown["system_temperature"]["text"] == "-5.7 °C"
    assert shown["system_temperature"]["raw"] == [0xFFC7]  # as the manual's section 4.7.8 has it
    assert shown["axis1_controller_temperature"]["text"] == "20.5 °C"
    assert shown["joystick_detected"]["value"] == 1
    assert "autoguider_north" in shown["digital_inputs"]["flags"]
    assert shown["axis1_drive_type"]["text"] == "1 (Gecko)"


def test_a_supply_alarm_refuses_motion(run):
    run("sync", "--force", "altaz:0,60")
    run.device.disturb(alarms=("supply_over_current",))
    assert "supply_over_current" in run("drive", "speed", "0.1", "0", "--for", "1s", ok=False)["reason"]
    assert "supply_over_current" in run("goto", "altaz:10,60", "--exit", ok=False)["reason"]


def test_all_of_it_works_attached_to_a_running_owner(run):
    command = [sys.executable, "-m", "clockdrive", "-c", str(run.config), "run"]
    owner = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        assert "owning the telescope" in owner.stderr.readline()
        assert run("drive", "set", "axis1_acceleration", "31")["before"].startswith("26 ")
        assert run("drive", "diff")["differences"][0]["key"] == "axis1.acceleration_register"
        assert run("drive", "push")["registers"]["axis1_acceleration"]["value"] == 26
        assert len(run("drive", "show", "park")["registers"]) == 2
        run("drive", "save")
        run("sync", "--force", "altaz:0,60")
        moved = run("drive", "speed", "0.2", "-0.1", "--for", "1s")
        assert moved["to_deg"][0] - moved["from_deg"][0] == pytest.approx(0.2, abs=0.05)
        assert "--yes" in run("drive", "reload", ok=False)["reason"]
        run("drive", "reload", "--yes")
        assert "loaded anew" in run("status")["unsynchronised_because"]
        assert owner.poll() is None
    finally:
        owner.send_signal(signal.SIGINT)
        owner.communicate(timeout=20)


@pytest.mark.parametrize("words", [["show"], ["show", "park"], ["diff"], ["encoders"], ["pull"], ["push"], ["save"]])
def test_a_person_reads_lines(words, run, capsys):
    assert main(["-c", str(run.config), "drive", *words]) == 0
    text = capsys.readouterr().out
    print(text[:2000])
    assert text.strip()
    assert "{" not in text


def test_a_key_of_an_awr_that_was_held_is_told(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(parts, "SystemClock", lambda: VirtualClock(1_800_000_000.0))
    path = tmp_path / "telescope.toml"
    path.write_text(
        '[drive]\nkind = "awr"\nlink = "sim:"\nsidereal_steps_per_s = 50.0\n[axis2]\nsteps_per_degree = 12000.0\n'
        "[limits]\nsun_avoidance_deg = 0.0\nhorizon_deg = -5.0\n"
        f'[state]\npath = "{(tmp_path / "state").as_posix()}"\n',
        encoding="utf-8",
    )
    code = main(["-c", str(path), "drive", "raw", "axis2", "UP", "guide", "0.1"])
    told = capsys.readouterr()
    assert code == 0, told.err
    assert told.out == "UP was held at guide speed for 0.1 s\n"
