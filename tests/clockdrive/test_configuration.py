"""A configuration is right as a whole or refused as a whole, with key, value and allowed range."""

import contextlib
import copy
import dataclasses
import pickle
import subprocess
import sys
import time
import tomllib
from fractions import Fraction
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clockdrive.configuration import load
from clockdrive.configuration_file import commented_template, markdown_table
from clockdrive.configuration_keys import DRIVE_KINDS, KEYS, MOUNT_TYPES
from clockdrive.drives.tc410.sections import axes_of, simulator_of
from clockdrive.errors import ConfigurationError
from mounts.tc410.simulator_settings import SimulatorSettings


def read(folder: Path, text: str, environment=None, overrides=None, unit=None):
    path = folder / "telescope.toml"
    path.write_text(text, encoding="utf-8")
    return load(path, environment or {}, overrides, unit)


def problems(folder: Path, text: str, environment=None, overrides=None) -> tuple[str, ...]:
    with pytest.raises(ConfigurationError) as caught:
        read(folder, text, environment, overrides)
    for problem in caught.value.problems:
        assert problem in str(caught.value)
    return caught.value.problems


def test_the_example_of_the_design_loads_unchanged(shared, tmp_path):
    design = (shared / "DESIGN.md").read_text(encoding="utf-8")
    example = design.split("```toml\n", 1)[1].split("```", 1)[0]
    configuration = read(tmp_path, example)
    assert axes_of(configuration)[0].main_gear == Fraction(1, 285)
    assert axes_of(configuration)[0].secondary_gear == Fraction(2, 5)
    assert configuration.weather.pressure_hpa == 1010.0
    assert configuration.mount.pointing_model == tmp_path / "model.mod"
    assert configuration.axes[1].centre_deg == -42.4
    assert configuration.drive.link == "tcp://127.0.0.1:10001"


def test_missing_files_are_told_with_all_else_that_is_wrong_where_files_are_asked_for(tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text(
        '[site]\nlatitude_deg = 91\n[mount]\npointing_model = "model.mod"\n[limits]\nhorizon = "trees.csv"\n',
        encoding="utf-8",
    )
    with pytest.raises(ConfigurationError) as caught:
        load(path, {}, with_files=True)
    trees, model, latitude = sorted(caught.value.problems)
    assert latitude.startswith("site.latitude_deg = 91: allowed")
    assert model.startswith(f"mount.pointing_model = {tmp_path / 'model.mod'}: there is no such file")
    assert trees.startswith(f"limits.horizon = {tmp_path / 'trees.csv'}: there is no such file")
    path.write_text('[mount]\npointing_model = "model.mod"\n', encoding="utf-8")
    assert load(path, {}).mount.pointing_model == tmp_path / "model.mod"


def test_gears_keep_the_teeth_that_they_are_written_with(tmp_path):
    gear = axes_of(read(tmp_path, '[axis1]\nsecondary_gear = "16/40"\n'))[0].secondary_gear
    assert gear == Fraction(2, 5)
    for kept in (gear, copy.copy(gear), copy.deepcopy(gear), pickle.loads(pickle.dumps(gear))):  # noqa: S301 - our own
        assert (kept.teeth, str(kept), float(kept)) == ((16, 40), "16/40", 0.4)
    (problem,) = problems(tmp_path, '[axis1]\nsecondary_gear = "40000/100000"\n')
    assert problem.startswith("axis1.secondary_gear = '40000/100000': allowed two whole numbers")


def test_without_a_file_the_embedded_simulator_is_used_and_says_so():
    configuration = load(None, {})
    assert configuration.simulated
    assert configuration.drive.kind == "tc410"
    assert (configuration.site.latitude_deg, configuration.site.longitude_deg) == (-42.4, 173.7)
    assert "embedded simulator" in configuration.notice
    assert "clockdrive init tc410" in configuration.notice
    assert load(None, {}, {"drive.link": "COM3"}).notice == ""


def test_a_flag_wins_over_the_environment_that_over_the_file_that_over_the_unit(tmp_path):
    file = "[axis1]\npark_deg = 1.0\nmin_deg = -100.0\nmax_deg = 100.0\n"
    environment = {"CLOCKDRIVE_AXIS1__PARK_DEG": "2", "CLOCKDRIVE_AXIS1__MIN_DEG": "-90", "CLOCKDRIVE_SHARED": "x"}
    unit = {"axis1.park_deg": 5.0, "axis1.max_deg": 5.0, "axis2.park_deg": -30.0, "axis2.main_gear": "1/360"}
    configuration = read(tmp_path, file, environment, {"axis1.park_deg": "3.5"}, unit)
    axis = configuration.axes[0]
    assert (axis.park_deg, axis.min_deg, axis.max_deg) == (3.5, -90.0, 100.0)
    assert configuration.axes[1].park_deg == -30.0
    assert axes_of(configuration)[1].main_gear == Fraction(1, 360)
    names = ("axis1.park_deg", "axis1.min_deg", "axis1.max_deg", "axis2.park_deg", "axis2.min_deg")
    origins = tuple(configuration.origins[name] for name in names)
    assert origins == ("flag", "environment", "file", "unit", "default")


def test_a_key_of_the_unit_that_nobody_configured_is_left_to_the_unit(tmp_path):
    left = read(tmp_path, "[axis1]\nmotor_steps = 400\n[site]\nlatitude_deg = 10\n").left_to_the_unit()
    assert "axis1.motor_steps" not in left
    assert "site.latitude_deg" not in left
    assert {"axis2.motor_steps", "axis1.min_deg", "mount.type", "drive.fan_start_c"} <= set(left)
    assert "site.height_m" not in left
    assert "axis1.centre_deg" not in left


def test_everything_that_is_wrong_is_told_at_once_with_value_and_range(tmp_path):
    found = problems(
        tmp_path,
        """
        [site]
        latitude_deg = 95
        longitud_deg = 10
        height_m = "high"
        [site.weather]
        refraction = 1
        relative_humidity = 60.0
        [drive]
        kind = "tc410"
        link = "tcp://somewhere"
        max_nodes = 12
        [mount]
        type = "dobson"
        [axis1]
        main_gear = "1/0"
        motor_steps = 200.5
        [axis2]
        min_deg = 30.0
        max_deg = -30.0
        [sight]
        """,
        {"CLOCKDRIVE_LIMITS__HORIZON_DEG": "ninety-five"},
        {"state.pth": "x"},
    )
    for words in (
        ("site.latitude_deg = 95", "−90 to 90 deg"),
        ("site.longitud_deg is no key", "did you mean site.longitude_deg?"),
        ("site.height_m = 'high'", "−500 to 9000 m"),
        ("site.weather.refraction = 1", "true or false"),
        ("site.weather.relative_humidity = 60.0", "0 to 1"),
        ("drive.link = 'tcp://somewhere'", "tcp://HOST:PORT"),
        ("drive.max_nodes is no key", "a key of apo and sdss"),
        ("mount.type = 'dobson'", "equatorial-fork | german | altaz-fork"),
        ("axis1.main_gear = '1/0'", '"1/285"'),
        ("axis1.motor_steps = 200.5", "1 to 65535 steps"),
        ("axis2.min_deg = 30 ", "axis2.max_deg = -30"),
        ("sight is no key", "did you mean site?"),
        ("limits.horizon_deg = 'ninety-five'", "environment CLOCKDRIVE_LIMITS__HORIZON_DEG"),
        ("state.pth is no key (flag)", "did you mean state.path?"),
    ):
        assert any(all(word in problem for word in words) for problem in found), words
    assert len(found) == 14


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[axis1]\npark_deg = 175.0", ("axis1.park_deg = 175", "-170 to 170")),
        ("[axis1]\nmin_deg = 10.0\nmax_deg = 10.0", ("axis1.min_deg = 10", "could not move")),
        ("[axis1]\nmax_speed_deg_s = 5.1", ("5.1", "5.0526 deg/s", "20000 units/s", "gecko")),
        ('[axis1]\ndrive_type = "ims"\nmax_speed_deg_s = 3.2', ("3.2", "3.1578 deg/s", "ims")),
        ('[axis1]\ndrive_type = "ims"\nmotor_current_a = 4.0', ("motor_current_a = 4", "1 to 3 A")),
        ('[axis1]\nmain_gear = "1/60000"', ("axis1.max_deg = 170", "24 bits", "-10.07 to 10.07")),
        ('[limits]\nhorizon = "h.csv"\nhorizon_deg = 10', ("limits.horizon_deg are both given",)),
        ("[drive]\nfan_start_c = 20\nfan_stop_c = 25", ("fan_stop_c = 25", "below drive.fan_start_c = 20")),
        ("[axis1]\nmin_deg = nan", ("axis1.min_deg = nan", "−720 to 720")),
        ("[axis1]\nmin_deg = inf", ("axis1.min_deg = inf",)),
        ("[axis1]\nmotor_steps = true", ("axis1.motor_steps = True",)),
        ("[axis1]\nmain_gear = 0.0035", ("axis1.main_gear = 0.0035", "two whole numbers")),
        ('[axis1]\nmain_gear = "-1/285"', ("axis1.main_gear = '-1/285'",)),
        ('[axis1]\nmain_gear = "1/70000"', ("axis1.main_gear = '1/70000'", "each 1 to 65535")),
        ('[drive]\nlink = "tcp://host:99999"', ("drive.link = 'tcp://host:99999'",)),
        ('[drive]\nlink = ""', ("drive.link = ''",)),
        ("site = 5", ("site is no key",)),
        ("[site.latitude_deg]\nx = 1", ("site.latitude_deg.x is no key",)),
        ("[[site]]\nname = 'a'", ("site is no key",)),
        ("not toml", ("line 1", "correct that line")),
        ("[drive]\nmax_nodes = 3", ("drive.max_nodes is no key", "drive.kind is tc410")),
        ("[site]\nlatitude_deg = 1" + "0" * 400, ("site.latitude_deg = 1000",)),
    ],
)
def test_what_is_impossible_is_one_sentence_with_the_bound(tmp_path, text, words):
    found = problems(tmp_path, text)
    assert len(found) == (2 if "60000" in text else 1), found
    assert any(all(word in problem for word in words) for problem in found), found


def test_an_unreadable_file_is_a_sentence(tmp_path):
    for path, words in (
        (tmp_path / "absent.toml", "clockdrive init tc410"),
        (tmp_path, "cannot be read"),
    ):
        with pytest.raises(ConfigurationError, match=words):
            load(path, {})
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"[site]\nname = '\xff'")
    with pytest.raises(ConfigurationError, match="not UTF-8"):
        load(binary, {})


@pytest.mark.parametrize(
    "link",
    ["sim:", "COM3", "tcp://drive.local:10001", "tcp://[::1]:502", "serial:///dev/ttyUSB0?baud=9600",
     "serial:///dev/ttyUSB0", "serial://COM3?baud=9600"],
)  # fmt: skip
def test_every_form_of_link_is_accepted(link):
    assert load(None, {}, {"drive.link": link}).drive.link == link


@pytest.mark.parametrize(
    ("mount", "latitude", "centre", "low", "high", "park"),
    [
        ("equatorial-fork", -42.4, (0, -42.4), (-170, -90), (170, 90), (0, -42.4)),
        ("equatorial-fork", 52.0, (0, 52.0), (-170, -90), (170, 90), (0, 52.0)),
        ("german", 52.0, (90, 90), (-10, -90), (190, 270), (90, 90)),
        ("german", -42.4, (90, -90), (-10, -270), (190, 90), (90, -90)),
        ("altaz-fork", 52.0, (0, 45), (-270, -5), (270, 95), (0, 45)),
    ],
)
def test_the_defaults_of_the_axes_follow_the_mount_and_the_hemisphere(mount, latitude, centre, low, high, park):
    axes = load(None, {}, {"mount.type": mount, "site.latitude_deg": latitude}).axes
    assert tuple(axis.centre_deg for axis in axes) == centre
    assert tuple(axis.min_deg for axis in axes) == low
    assert tuple(axis.max_deg for axis in axes) == high
    assert tuple(axis.park_deg for axis in axes) == park


def test_a_wider_german_window_moves_the_limits_of_axis_1():
    axes = load(None, {}, {"mount.type": "german", "limits.hour_angle_past_meridian_deg": "25"}).axes
    assert (axes[0].min_deg, axes[0].max_deg) == (-25.0, 205.0)


def test_without_weather_the_air_is_the_standard_atmosphere_at_the_height():
    # US Standard Atmosphere 1976, table I: 2000 m, 2.0 °C (275.154 K at geometric altitude 2000 m), 795.01 hPa.
    weather = load(None, {}, {"site.height_m": 2000.0}).weather
    assert weather.pressure_hpa == pytest.approx(795.0, abs=0.3)
    assert weather.temperature_c == pytest.approx(2.0, abs=0.1)
    assert (weather.relative_humidity, weather.refraction) == (0.5, True)


def test_the_speed_stays_possible_when_only_the_gearing_is_given():
    axis = axes_of(load(None, {}, {"axis1.drive_type": "ims"}))[0]
    assert axis.max_speed_deg_s == pytest.approx(0.9 * 20000 * 360 / 200 / 285 * 0.4 / 16, rel=1e-2)
    assert axis.counts_per_step == 16


def test_instruments_are_free_names(tmp_path):
    configuration = read(tmp_path, "[instruments.guider]\nx_arcsec = 30\n[instruments.main]\ny_arcsec = -5\n")
    assert configuration.instruments["guider"].x_arcsec == 30.0
    assert configuration.instruments["main"].y_arcsec == -5.0
    assert list(load(None, {}).instruments) == ["main"]
    found = problems(tmp_path, "[instruments.guider]\nx_arcmin = 30\n")
    assert "did you mean instruments.guider.x_arcsec?" in found[0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[telescope]\nname = "x"\nowner = "y"\n', "telescope is no key: the tables are axis1, axis2, drive, instr"),
        ("[title]\n", "title is no key: the tables are axis1,"),
        ("[mounts]\ntype = 1\n", "mounts is no key: did you mean mount?"),
        ("[site.whether]\nrefraction = true\n", "site.whether is no key: did you mean site.weather?"),
        ("[limits]\nzenith = 1\n", "limits.zenith is no key: [limits] has horizon_deg, horizon, sun_escape"),
        ("[drive]\nlatitude_deg = 1\n", "drive.latitude_deg is no key: did you mean site.latitude_deg?"),
        ("latitude_deg = 1\n", "latitude_deg is no key: did you mean site.latitude_deg?"),
        ("colour = 1\n", "colour is no key: a key stands in a table, such as [site]"),
    ],
)
def test_what_is_no_key_is_told_once_with_what_there_is_and_no_command_that_lists_nothing(tmp_path, text, said):
    (found,) = problems(tmp_path, text)
    assert found.startswith(said)
    assert "config check" not in found


@pytest.mark.parametrize("drive", DRIVE_KINDS)
@pytest.mark.parametrize("mount", [None, *MOUNT_TYPES])
def test_a_template_loads_unchanged_and_with_every_default_switched_on(tmp_path, drive, mount):
    text = commented_template(drive, mount)
    configuration = read(tmp_path, text)
    assert configuration.drive.kind == drive
    assert mount in {None, configuration.mount.type}
    optional = {key.name for key in KEYS if key.default is None or key.dotted == "state.path"}
    lines = [
        line.removeprefix("# ") if " = " in line and line[2:].split(" = ")[0] not in optional else line
        for line in text.splitlines()
    ]
    switched_on = read(tmp_path, "\n".join(lines))
    assert switched_on.values == configuration.values
    assert "default" not in {o for k, o in switched_on.origins.items() if k.rsplit(".", 1)[1] not in optional}


@pytest.mark.parametrize(
    ("drive", "name", "latitude"), [("apo", "Apache Point", 32.78), ("tc410", "Kaikoura", -42.4)]
)
def test_a_template_stands_where_such_drives_do_and_says_whose_place_it_is(tmp_path, drive, name, latitude):
    text = commented_template(drive)
    site = read(tmp_path, text).site
    assert f"These are {name}'s values: put in your own." in text
    assert (site.name, site.latitude_deg) == (name, pytest.approx(latitude, abs=0.01))


def test_a_template_carries_what_a_unit_said(tmp_path):
    text = commented_template("tc410", "german", {"axis1.main_gear": "1/360", "site.name": 'a "name" \\ here'})
    configuration = read(tmp_path, text)
    assert axes_of(configuration)[0].main_gear == Fraction(1, 360)
    assert configuration.site.name == 'a "name" \\ here'
    assert configuration.origins["axis1.main_gear"] == "file"


def test_every_key_is_in_the_documentation_and_in_its_template():
    table = markdown_table()
    for key in KEYS:
        assert f"`{key.name}`" in table
        text = commented_template(key.drives[0])
        assert f"\n{key.name} = " in text or f"\n# {key.name} = " in text, key


def test_the_simulator_section_is_the_simulators_own_settings():
    section = dataclasses.asdict(simulator_of(load(None, {})))
    assert section.pop("sky_noise_arcsec") == 0.0  # of who looks at the sky, not of the unit
    assert section == dataclasses.asdict(SimulatorSettings())


def test_loading_is_fast_and_drags_in_no_mathematics():
    code = (
        "import sys, clockdrive.configuration as c\n"
        "print([m for m in ('numpy', 'erfa', 'astropy', 'pymodbus', 'rich') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.strip() == "[]"
    text = commented_template("tc410")
    assert tomllib.loads(text)
    load(None, {})
    best = min(_elapsed(lambda: load(None, {})) for _ in range(10))
    print(f"loading a configuration: {best * 1e3:.2f} ms")
    assert best < 0.010


def _elapsed(work) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


_scalars = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20) | st.lists(st.integers())
_names = st.sampled_from(sorted({name for key in KEYS for name in key.dotted.split(".")})) | st.text(max_size=8)
_tables = st.recursive(_scalars, lambda inner: st.dictionaries(_names, inner, max_size=6), max_leaves=20)


@settings(max_examples=200, deadline=None)
@given(
    overrides=st.dictionaries(
        st.sampled_from([key.dotted for key in KEYS]) | st.text(max_size=20), _scalars, max_size=8
    )
)
def test_any_values_are_a_configuration_or_a_configuration_error(overrides):
    with contextlib.suppress(ConfigurationError):
        load(None, {}, overrides)


@settings(max_examples=200, deadline=None)
@given(text=st.text(max_size=200) | st.sampled_from(["[" * 5000, "a." * 3000 + "b = 1", "x = " + "[" * 3000]))
def test_any_text_is_a_configuration_or_a_configuration_error(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("any") / "telescope.toml"
    path.write_text(text, encoding="utf-8", errors="replace")
    with contextlib.suppress(ConfigurationError):
        load(path, {})


def test_a_configuration_with_every_kind_of_value_can_be_completed_from_the_unit(tmp_path):
    file = tmp_path / "telescope.toml"
    file.write_text(
        '[drive]\nkind = "tc410"\nlink = "tcp://127.0.0.1:10001"\n[axis1]\nmain_gear = "1/360"\n'
        '[limits]\nhorizon = "horizon.csv"\n[state]\npath = "state"\n',
        encoding="utf-8",
    )
    before = load(file, {}, {})
    after = before.completed({"site.latitude_deg": 51.5, "axis1.main_gear": "1/285"})
    assert after.site.latitude_deg == 51.5
    assert after.state_directory == tmp_path / "state"
    assert after.limits.horizon == tmp_path / "horizon.csv"
    assert axes_of(after)[0].main_gear == axes_of(before)[0].main_gear


@pytest.mark.parametrize(
    ("wiring", "rating", "label", "highest"),
    [
        ("4-lead", "per-phase", 2.0, 2.0),
        ("4-lead", "bipolar", 2.0, 2.0),
        ("6-lead-half", "per-phase", 2.0, 2.0),
        ("6-lead-full", "per-phase", 3.0, 2.1),
        ("8-lead-parallel", "per-phase", 2.0, 2.8),
        ("8-lead-parallel", "bipolar", 2.8, 2.8),
        ("8-lead-series", "per-phase", 2.0, 1.4),
        ("8-lead-series", "bipolar", 2.8, 1.4),
    ],
)
def test_a_motor_is_given_what_its_label_and_wiring_allow(wiring, rating, label, highest):
    """The factors are those of section 3 of the drive's manual."""

    def with_current(current_a):
        motor = {"motor_wiring": wiring, "motor_rating": rating, "motor_rated_a": label, "motor_current_a": current_a}
        return load(None, {}, {f"axis2.{name}": value for name, value in motor.items()})

    assert with_current(highest).cautions == ()
    with pytest.raises(ConfigurationError, match=rf"allowed at most {highest:.2f} A"):
        with_current(highest + 0.1)
    if highest / 2.0 > 1.1:
        (said,) = with_current(highest / 2.0 - 0.1).cautions
        assert f"below {highest / 2.0:.2f} A" in said
    assert with_current(max(1.0, highest / 2.0)).cautions == ()


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"axis1.motor_wiring": "6-lead-full", "axis1.motor_rating": "bipolar", "axis1.motor_rated_a": 3.0},
         ("6-lead-full", "per-phase")),
        ({"axis1.drive_type": "ims", "axis1.motor_current_a": 3.1}, ("3.1", "1 to 3 A", "ims")),
        ({"axis1.main_gear": "285/1"}, ("285", "100 deg/s", '"1/285"')),
        ({"axis1.park_deg": 175.0}, ("175", "-170 to 170")),
        ({"drive.fan_start_c": 30.0, "drive.fan_stop_c": 30.0}, ("30", "below drive.fan_start_c")),
    ],
)  # fmt: skip
def test_what_contradicts_itself_in_a_drive_is_a_sentence(keys, words):
    with pytest.raises(ConfigurationError) as refused:
        load(None, {}, keys)
    assert all(word in str(refused.value) for word in words), str(refused.value)


@pytest.mark.parametrize(
    ("kind", "section", "bounds"),
    [  # azimuth, altitude and rotator as the two observatories' own tables have them
        ("apo", "axis1", (-180.0, 360.0, 1.75, 0.1, 0.5)),
        ("apo", "axis2", (6.0, 85.0, 1.5, 0.1, 0.5)),
        ("apo", "rotator", (-180.0, 180.0, 3.5, 0.7, 7.0)),
        ("sdss", "axis1", (-195.0, 435.0, 2.0, 0.2, 0.2)),
        ("sdss", "axis2", (18.2, 90.0, 1.5, 0.08, 0.08)),
        ("sdss", "rotator", (-180.0, 361.0, 2.0, 0.25, 0.25)),
    ],
)
def test_the_axes_of_a_node_drive_have_the_limits_of_their_observatory(tmp_path, kind, section, bounds):
    configuration = read(tmp_path, f'[drive]\nkind = "{kind}"\n[rotator]\n')
    names = ("min_deg", "max_deg", "max_speed_deg_s", "acceleration_deg_s2", "jerk_deg_s3")
    assert tuple(configuration.values[f"{section}.{name}"] for name in names) == bounds


def test_there_is_a_rotator_where_its_table_is_even_an_empty_one(tmp_path):
    drive = '[drive]\nkind = "apo"\n'
    assert read(tmp_path, drive).rotator is None
    assert not any(name.startswith("rotator.") for name in read(tmp_path, drive).values)
    for text, environment in (("[rotator]\n", {}), ("", {"CLOCKDRIVE_ROTATOR__MODE": "sky"})):
        rotator = read(tmp_path, drive + text, environment).rotator
        assert rotator is not None
        assert (rotator.mode, rotator.position_angle_deg, rotator.min_deg, rotator.park_deg) == ("sky", 0.0, -180, 0)
    (problem,) = problems(tmp_path, drive + '[rotator]\nmode = "star"\n')
    assert problem == "rotator.mode = 'star': allowed sky | horizon | mount"
    assert problems(tmp_path, '[rotator]\nmode = "sky"\n')  # a TC410 turns none


@pytest.mark.parametrize(("kind", "there"), [("tc410", False), ("awr", False), ("apo", True), ("sdss", True)])
def test_a_template_has_a_rotator_where_the_observatory_has_one(tmp_path, kind, there):
    assert (read(tmp_path, commented_template(kind)).rotator is not None) == there
