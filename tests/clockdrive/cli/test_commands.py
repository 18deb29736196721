"""Every command from its words to its exit code, on the embedded simulator; JSON is one document, alone on stdout."""

import json
import re
import signal
import subprocess
import sys
import zipfile
from datetime import UTC, datetime

import pytest
from astropy import units as u
from astropy.io import fits
from astropy.table import Table
from mpc_lines import COMETS
from satellites import NO_DRAG, lines

from clockdrive.cli import command_line, display, main
from pointing import kernel

SITE = """
[site]
name = "Test"
latitude_deg = -42.4
longitude_deg = 173.7
[drive]
kind = "tc410"
link = "sim:"
[limits]
sun_avoidance_deg = 0.0
"""
QUICK = "".join(
    f"[axis{axis}]\nacceleration_register = 255\ndeceleration_register = 255\nmax_speed_deg_s = 4.5\n"
    for axis in (1, 2)
)
UP = "hadec:1,-41"  # near the park position


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "telescope.toml"
    path.write_text(f'{SITE}{QUICK}[state]\npath = "{tmp_path / "state"}"\n', encoding="utf-8")
    return path


@pytest.fixture
def run(file, capsys):
    def runs(line, *words):
        code = main(["-c", str(file), *line.split(), *words])
        done = capsys.readouterr()
        assert "Traceback" not in done.err, done.err
        return code, done.out, done.err

    return runs


@pytest.fixture
def answer(run):
    def runs(line, *words):
        code, out, _ = run(line, *words, "--json")
        return code, json.loads(out)

    return runs


def test_goto_then_track_for_a_time_then_stop(run):
    code, out, err = run(f"goto {UP} --for 1s")
    assert code == 0
    assert out.startswith(f"on {UP} at ")
    assert "predicted" in out
    assert "1 slew(s)" in out
    assert f"slewing to {UP}" in err
    assert "s left" in err
    assert "tracking" in err
    assert err.rstrip().endswith("stopped")


def test_into_a_file_goes_a_line_for_each_change_and_no_carriage_return(run):
    _, _, err = run(f"goto {UP} --for 2.5s")
    assert "\r" not in err
    assert "\x1b" not in err
    slewing, tracking, stopped = err.splitlines()
    assert slewing.startswith(f"slewing to {UP}: ")
    assert tracking.startswith(f"tracking {UP}")
    assert stopped == "stopped"


def test_on_a_terminal_the_live_line_is_written_over(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with display.live(quiet=False) as show:
        for doing in ("slewing here", "idle"):
            show({"doing": doing})
    err = capsys.readouterr().err
    first, second = err.split("\r")[1:]
    assert first == "slewing here: the drive has not answered yet"
    assert second == "idle: the drive has not answered yet".ljust(len(first)) + "\n"


def test_a_telescope_left_tracking_is_said_so_still_tracks_and_can_be_stopped(run, answer):
    code, _, err = run(f"goto {UP} --exit")
    assert code == 0
    assert "goes on tracking by itself" in err
    assert answer("status")[1]["doing"] == "tracking"
    assert answer("status")[1]["doing"] == "tracking"
    assert run("stop")[:2] == (0, "stop: done\n")
    assert answer("status")[1]["doing"] == "idle"


def test_a_telescope_whose_drive_does_not_track_by_itself_is_stopped_on_leaving_and_that_is_said(file, run, answer):
    mount = '[mount]\ntype = "altaz-fork"\n'
    file.write_text(file.read_text("utf-8").replace("tc410", "apo").replace(QUICK, mount), "utf-8")
    code, _, err = run("goto altaz:0.5,45.5 --exit")
    assert code == 0
    before, said, after = err.partition(
        "this drive does not track by itself within limits of its own: the telescope is stopped on arrival"
    )
    assert said
    assert "slewing" not in before
    assert "the telescope was stopped" in after
    assert "goes on tracking by itself" not in err
    _, status = answer("status")
    assert status["doing"] == "idle"
    assert [axis["rate_deg_s"] for axis in status["axes"]] == pytest.approx([0.0, 0.0], abs=1e-4)
    assert answer("goto altaz:0.5,45.6")[1]["goes_on_tracking"] is False


def test_goto_as_json_is_one_document_and_leaves_the_telescope_tracking(answer):
    code, arrived = answer(f"goto {UP}")
    assert code == 0
    assert {"ok", "target", "start_utc", "arrival_utc", "eta_s", "posture", "observed", "axes", "checks"} <= set(
        arrived
    )
    assert arrived["slews"] == 1
    assert arrived["goes_on_tracking"] is True
    assert arrived["arrival_error_arcsec"] < 2.0
    assert arrived["arrived_utc"][:19]
    assert answer("status")[1]["doing"] == "tracking"
    assert answer(f"goto {UP} --for 0.5s")[1]["ok"]
    assert answer("status")[1]["doing"] == "idle"
    assert answer(f"track {UP} --for 0.5s")[1]["ok"]


def test_a_drive_of_another_kind_is_not_read_as_a_tc410(run):
    for kind in ("avr-box", "awr"):
        code, out, err = run(f"init {kind} --from tcp://127.0.0.1:1")
        assert (code, out) == (2, "")
        assert f"`clockdrive init {kind}` writes the keys of the {kind}" in err
    assert run("init tc410 --from tcp://127.0.0.1:1 --mount german")[0] == 2
    for kind in ("avr-box", "awr"):
        code, out, err = run(f"init {kind}")
        assert (code, f'kind = "{kind}"' in out, err) == (0, True, "")


def test_plans_need_no_drive_when_the_counts_are_given(answer, run):
    code, plan = answer("plan 05:34:31.9 -22:00:52 --at 2026-11-22T13:00:00Z --from 8388608,8388608")
    assert code == 0
    assert plan["start_utc"] == "2026-11-22T13:00:00.000Z"
    assert [axis["from_counts"] for axis in plan["axes"]] == [8388608, 8388608]
    assert plan["axes"][0]["velocity_register"] == pytest.approx(13873, abs=30)
    assert all(check["ok"] for check in plan["checks"])
    assert run("plan best")[0] == 0
    assert answer("plan altaz:10,50")[1]["ok"]
    code, refused = answer("plan M31 --from 8388608,8388608 --at 2026-11-22T03:00:00")
    assert code == 1
    assert refused["ok"] is False
    assert "below the horizon" in refused["reason"]


def test_rates_are_those_of_the_sky(answer, run):
    code, rates = answer("rates 83.633,-22.0145 --at 2026-11-22T13:00:00Z")
    assert code == 0
    one = rates["axes"][0]
    assert one["rate_deg_s"] == pytest.approx(360.0 / 86164.09, rel=2e-3)
    assert one["rate_counts_s"] == pytest.approx(one["rate_deg_s"] * 3600.0 / 0.9094736842105263, rel=1e-9)
    assert run("rates Canopus --at 2026-11-22T13:00:00Z")[1].startswith("Canopus")


def test_the_moon_is_planned_where_others_see_it(answer, monkeypatch):
    from astropy import units
    from astropy.coordinates import AltAz, EarthLocation, get_body
    from astropy.time import Time
    from astropy.utils import iers

    monkeypatch.setenv("CLOCKDRIVE_SITE__WEATHER__REFRACTION", "false")
    code, plan = answer("plan Moon --from 8388608,8388608 --at 2026-11-25T12:00:00Z")
    assert code == 0
    with iers.conf.set_temp("auto_download", value=False), iers.conf.set_temp("auto_max_age", None):
        when = Time(plan["arrival_utc"].removesuffix("Z"))
        place = EarthLocation.from_geodetic(173.7, -42.4, 30.0)
        seen = get_body("moon", when, place).transform_to(AltAz(obstime=when, location=place))
        here = AltAz(
            az=plan["observed"]["azimuth_deg"] * units.deg,
            alt=plan["observed"]["altitude_deg"] * units.deg,
            obstime=when,
            location=place,
        )
        off = seen.separation(here).to_value(units.arcsec)
    print(f"Moon: {off:.1f}″ from where astropy's built-in series has it")
    assert off < 20.0  # which is how far that series may be off
    assert plan["target"] == "Moon"


def test_rates_of_a_planet_and_what_a_kernel_is_worth(answer, run, file, tmp_path):
    code, rates = answer("rates jupiter --at 2026-11-22T13:00:00Z")
    assert (code, rates["target"], rates["notes"]) == (0, "Jupiter", [])
    assert rates["axes"][0]["rate_deg_s"] == pytest.approx(360.0 / 86164.09, rel=2e-3)
    file.write_text(file.read_text(encoding="utf-8") + '[targets]\nkernel = "other.bsp"\n', encoding="utf-8")
    assert f"{tmp_path / 'other.bsp'}: No such file" in answer("rates Jupiter")[1]["reason"]
    assert "targets.kernel" in run("config check")[2]
    (tmp_path / "other.bsp").write_bytes(b"no kernel")
    assert "no SPK file, or damaged" in answer("rates Jupiter")[1]["reason"]
    assert "no SPK file, or damaged" in run("config check")[2]


def test_without_the_extra_the_moon_is_where_the_series_have_it_and_pluto_is_refused(answer, monkeypatch):
    monkeypatch.setattr(kernel, "find_spec", lambda _: None)
    kernel.bundled_kernel.cache_clear()
    try:
        code, rates = answer("rates Moon --at 2026-11-22T13:00:00Z")
        assert code == 0
        assert "pip install 'clockdrive[planets]'" in rates["notes"][0]
        assert "up to 20″" in rates["notes"][0]
        code, refused = answer("rates Pluto")
        assert code == 1
        assert "pip install 'clockdrive[planets]'" in refused["reason"]
    finally:
        kernel.bundled_kernel.cache_clear()


def test_rates_of_ones_own_are_taken_by_every_command_that_points(answer, run):
    at = "--at 2026-11-22T13:00:00Z"
    plain, own = (
        answer(f"rates hadec:0,0 {at} {rate}")[1]["axes"]
        for rate in ("", "--rate -3.6,7.2 --rate-from 2026-11-22T12:59:50")
    )
    gained = [(b["rate_deg_s"] - a["rate_deg_s"]) * 3600.0 for a, b in zip(plain, own, strict=True)]
    assert gained == pytest.approx([3.6, 7.2], abs=0.01)
    for line in (
        f"plan {UP} {at} --from 8388608,8388608",
        f"plan {UP}",
        f"goto {UP} --for 0.5s",
        f"track {UP} --for 0.5s",
    ):
        assert answer(f"{line} --rate 0.5,-0.25")[0] == 0, line
    code, _, err = run(f"goto {UP} --rate fast")
    assert (code, "'fast' is not EAST,NORTH" in err) == (2, True)
    assert "without rates" in run(f"plan {UP} --rate-from now")[2]
    assert "together at most 36000″/s" in run(f"goto {UP} --rate 100000,0")[2]


def test_bodies_and_tables_of_files_are_pointed_at_from_where_the_files_are(answer, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "comets.txt").write_text(COMETS, encoding="utf-8")
    at = "--at 2026-11-22T13:00:00Z"
    code, found = answer(f"rates mpc:comets.txt#1P {at}")
    assert (code, found["target"]) == (0, "1P/Halley")
    code, refused = answer("plan mpc:comets.txt#Haley")
    assert (code, "did you mean 1P/Halley" in refused["reason"]) == (1, True)
    hours = [f"2026-11-22T{hour:02d}:00:00" for hour in range(10, 16)]
    places = Table({"time": hours, "ra": [83.0 + k for k in range(6)] * u.deg, "dec": [-22.0] * 6 * u.deg})
    places.write(tmp_path / "rock.ecsv", format="ascii.ecsv")
    code, found = answer(f"plan ephem:rock.ecsv {at} --from 8388608,8388608")
    assert (code, found["target"]) == (0, "rock")
    code, _, err = run("plan ephem:rock.ecsv --at 2026-11-22T15:30:00Z --from 8388608,8388608")
    assert (code, "nothing is extrapolated" in err) == (1, True)


def test_park_home_jog_and_unpark(answer, run):
    assert answer("jog 1 -2.0 --for 1s")[1]["axes"][0]["angle_deg"] == pytest.approx(-2.0, abs=1e-3)
    assert answer("home")[1]["axes"][0]["target_counts"] == 0x800000
    assert answer("park")[0] == 0
    assert answer("status")[1]["parked"]
    code, refused = answer(f"goto {UP}")
    assert (code, refused["ok"]) == (1, False)
    assert "unpark" in refused["reason"]
    assert "parked; `clockdrive unpark` allows motion" in run("status")[1]
    assert run("unpark")[:2] == (0, "unpark: done\n")
    assert run("home")[0] == 0
    assert run("jog 2 0.5 --for 1s")[0] == 0


def test_offsets_are_shown_added_and_cleared(answer, run):
    assert answer("offset")[1]["corrections"] == []
    assert [row["value"] for row in answer("offset 10 -20.5")[1]["corrections"]] == [10.0, -20.5]
    assert "offset north: -21.50″" in run("offset 0 −1")[1]
    assert run("offset clear offset north")[0] == 0
    assert run("offset clear offset")[1] == "no offsets\n"
    code, _, err = run("offset clear offset")
    assert code == 1
    assert "no correction" in err


def test_sync_says_what_it_did(run, answer):
    code, out, _ = run("sync hadec:0.5,-42")
    assert code == 0
    said = re.fullmatch(r"synchronised on hadec:0\.5,-42, axis1 by (.*)″ and axis2 by (.*)″\n", out)
    assert [float(each) for each in said.groups()] == [pytest.approx(each, abs=0.6) for each in (1800.0, 1440.0)]
    code, refused = answer("sync hadec:-20,-42")
    assert code == 1
    assert "--force" in refused["reason"]
    assert answer("sync hadec:-20,-42 --force --posture normal")[1]["ok"]


def test_the_drive_shows_its_registers_and_takes_power(answer, run):
    code, found = answer("drive show")
    assert code == 0
    assert "axis1_position" in found["registers"]
    assert len(found["registers"]) > 90
    assert "axis1_position" in run("drive show")[1]
    assert answer("drive power standby")[0] == 0
    assert not answer("status")[1]["powered"]
    code, _, err = run(f"goto {UP}")
    assert code == 1
    assert "drive power on" in err
    assert run("drive power on")[0] == 0
    assert run(f"goto {UP} --exit")[0] == 0


def test_the_header_is_one_that_astropy_reads(answer, run):
    run(f"goto {UP} --exit")
    code, out, _ = run("header")
    assert code == 0
    header = fits.Header.fromstring(out, sep="\n")
    status = answer("status")[1]
    assert header["AZIMUTH"] == pytest.approx(status["observed"]["azimuth_deg"], abs=0.01)
    assert header["DEC"] == pytest.approx(status["icrs"]["dec_deg"], abs=0.01)
    assert header["OBSGEO-B"] == pytest.approx(-42.4, abs=1e-5)
    assert header["RADESYS"] == "ICRS"
    assert fits.Header(answer("header")[1]["cards"])["TIMESYS"] == "UTC"
    fits.PrimaryHDU(header=header).verify("exception")


def test_a_speed_is_told_with_where_it_led(run):
    code, out, _ = run("drive speed 0.2 0 --for 1s")
    assert code == 0
    assert re.search(r"moved for \d+\.\d s\naxis1: -?\d+\.\d+° → -?\d+\.\d+°\naxis2: ", out)


def test_the_report_holds_what_is_needed_and_no_key(run, answer, tmp_path):
    run("status")
    path = tmp_path / "report.zip"
    assert run("report --output", str(path))[0] == 0
    with zipfile.ZipFile(path) as archive:
        names = set(archive.namelist())
        assert {
            "versions.txt",
            "configuration.toml",
            "configuration.json",
            "events.txt",
            "event.log",
            "drive.json",
        } <= names
        assert "numpy" in archive.read("versions.txt").decode()
        assert not any(name.endswith(".key") for name in names)
    assert answer("report --output", str(tmp_path / "none" / "report.zip"))[0] == 1


@pytest.mark.parametrize("mount", ["equatorial-fork", "german", "altaz-fork"])
def test_init_writes_what_config_check_accepts(mount, run, capsys, tmp_path):
    code, out, _ = run(f"init tc410 --mount {mount}")
    assert code == 0
    path = tmp_path / "written.toml"
    path.write_text(out, encoding="utf-8")
    assert main(["-c", str(path), "config", "check"]) == 0
    assert "nothing is wrong" in capsys.readouterr().out


def test_status_shows_every_correction_and_check(run, answer):
    code, out, _ = run("status")
    assert code == 0
    for text in ("synchronised: yes", "refraction", "Earth orientation", "axis1 soft limit", "ICRS"):
        assert text in out
    found = answer("status")[1]
    assert found["synchronised"]
    assert found["position_age_s"] < 5.0


def test_without_a_file_the_embedded_simulator_is_used_and_says_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path))
    assert main(["status", "--json"]) == 0
    done = capsys.readouterr()
    assert json.loads(done.out)["drive"] == "tc410 sim:"
    assert "embedded simulator" in done.err


def test_the_words_of_a_target_need_no_quotes(answer):
    at = "--from 8388608,8388608 --at 2026-11-22T13:00:00Z"
    for words in ("05:34:31.9 -22:00:52", "-- 05:34:31.9 -22:00:52", "83.633,-22.01", "NGC 2070", "hadec:-10,-40"):
        line = f"plan {at} {words}"
        code, plan = answer(line) if "--" not in words else (0, {"ok": True})
        assert (code, plan["ok"]) == (0, True), words


def epoch_now():
    """Of elements as fresh as can be: year and day of it."""
    now = datetime.now(UTC)
    return f"{now:%y}{now.timetuple().tm_yday + now.hour / 24.0:012.8f}"


def test_a_satellite_that_needs_this_program_is_not_left_behind_by_a_goto_that_returns(run, tmp_path):
    """One that comes up within half an hour would be waited for; nothing moves for the refusal."""
    orbits = [
        lines(10000 + k, 80.0, 15.0 * k % 360.0, 0.0003, 0.0, 47.0 * k % 360.0, 15.5, NO_DRAG, epoch_now())
        for k in range(72)
    ]
    path = tmp_path / "many.tle"
    path.write_text("\n".join(f"S{k}\n{one}\n{two}" for k, (one, two) in enumerate(orbits)) + "\n", encoding="utf-8")
    code, out, err = run(f"passes {path} --hours 0.4 --json")
    assert code == 0, out + err
    name = json.loads(out)["passes"][0]["target"]
    code, out, _ = run(f"goto tle:{path}#{name} --json")
    assert code == 1
    reason = json.loads(out)["reason"]
    assert f"{name} is too fast to be left to the drive alone" in reason
    assert "--for 5m" in reason
    status = json.loads(run("status --json")[1])
    assert [axis["counts"] for axis in status["axes"]] == [0x800000 + 0.5] * 2


LOADED_FOR_NOTHING = (
    *("astropy", "scipy", "ruckig", "matplotlib", "rich", "serial", "pymodbus", "asyncio", "multiprocessing"),
    *("sqlite3", "importlib.metadata", "sgp4", "jplephem", "clockdrive.telescope", "clockdrive.owner"),
    *("clockdrive.weather", "clockdrive.cli.fit_command", "pointing.satellite", "pointing.offset", "transports.link"),
    *("mounts.apo", "mounts.avr_box", "mounts.awr", "mounts.drive", "mounts.tc410.unit"),
)


def test_a_plan_from_given_counts_loads_no_link_no_owner_and_no_other_drive():
    words = ("plan", "05:34:31.9 +22:00:52", "--at", "2026-11-22T13:00:00Z", "--from", "8388608,8388608", "--json")
    code = (
        f"import sys; from clockdrive.cli import main; main({words!r}); "
        f"print([name for name in {LOADED_FOR_NOTHING!r} if name in sys.modules], len(sys.modules), file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True, timeout=60)
    print(run.stderr)
    assert json.loads(run.stdout)["ok"]
    assert "[] " in run.stderr


INTERRUPTED_LOADING = """
import sys
class Interrupting:
    def find_spec(self, name, *_):
        if name == sys.argv[1]:
            raise KeyboardInterrupt
sys.meta_path.insert(0, Interrupting())
from clockdrive.cli import main
sys.exit(main(["status"]))
"""


@pytest.mark.parametrize(
    "module",
    ["clockdrive.cli.command_line", "clockdrive.cli.commands", "clockdrive.configuration", "pointing.errors"],
)
def test_an_interruption_while_the_command_is_loaded_ends_it_without_a_word(module):
    command = [sys.executable, "-P", "-c", INTERRUPTED_LOADING, module]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_an_interruption_that_a_compiled_module_takes_for_its_own_failure_is_one_all_the_same(monkeypatch, capsys):
    def loading(_args):
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise ImportError("numpy._core.multiarray failed to import") from None

    monkeypatch.setitem(command_line.COMMANDS, "status", loading)
    assert main(["status"]) == 130
    assert capsys.readouterr().err == "interrupted\n"


def test_what_a_running_owner_answers_needs_no_mathematics_here():
    code = (
        "import sys, clockdrive.cli.command_line, clockdrive.cli.commands, clockdrive.owner; "
        "import clockdrive.control_socket; "
        "print([name for name in ('numpy', 'erfa', 'astropy') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout == "[]\n"
