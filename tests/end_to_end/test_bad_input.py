"""Whatever is wrong is a sentence with the value, the bound and what to do; the telescope does not move for it."""

import json
import os
import socket
import sys
import threading
import time

import pytest
from satellites import NO_DRAG, lines
from telescope_bench import telescope

from clockdrive import Telescope
from clockdrive.cli import main
from clockdrive.clock import SystemClock
from clockdrive.clock_watch import ClockWatch
from clockdrive.configuration import load
from clockdrive.drives.tc410 import kind as tc410
from clockdrive.owner import Ownership
from clockdrive.state import FILE_NAME
from transports.serve import serve

SIM = '[site]\nlatitude_deg = -42.4\nlongitude_deg = 173.7\n[drive]\nkind = "tc410"\nlink = "{link}"\n'

REFUSED = [  # words, exit code, what the sentence says
    ("goto Betelgeuze", 1, ["Betelgeuze", "Betelgeuse"]),
    ("goto NGC 99999", 1, ["NGC 99999"]),
    ("goto 05:34:61 +22:00:52", 2, ["61", "below 60", "check the target"]),
    ("goto 25:00:00 +22:00:00", 2, ["25", "0 to 24"]),
    ("goto 400.0,10.0", 2, ["400", "0 to 360"]),
    ("goto 10.0,95.0", 2, ["95", "−90 to 90"]),
    ("goto 05:34:31.9", 2, ["05:34:31.9", "give a name"]),
    ("goto altaz:90", 2, ["altaz:AZIMUTH,ALTITUDE"]),
    ("goto altaz:nan,45", 2, ["altaz:AZIMUTH,ALTITUDE"]),
    ("goto altaz:90,100", 2, ["100", "−90 to 90"]),
    ("goto altaz:180,5", 1, ["10.00° below", "15.00°"]),
    ("goto Polaris", 1, ["below the horizon limit of 15.00°", "not be allowed within a day: choose another target"]),
    ("goto Sun", 1, ["0.0° from the Sun", "only with a filter in front of the whole aperture"]),
    ("goto hadec:175,80", 1, ["below the horizon limit of 15.00°"]),
    ("goto tle:FILE#ISS", 1, ["TLE file", "there is no such file", "check the path"]),
    ("passes nowhere.tle", 1, ["TLE file nowhere.tle", "there is no such file"]),
    ("passes all.tle#ISS", 1, ["'all.tle#ISS' is no file and no target", "write tle:all.tle#ISS"]),
    ("passes Nowhere", 1, ["Nowhere"]),
    ("passes Vega --hours 0", 2, ["--hours 0", "more than 0 up to 8784"]),
    ("passes Vega --hours nan", 2, ["--hours nan"]),
    ("passes Vega --above 90", 2, ["--above 90", "below 90°"]),
    ("passes Vega --at yesterday", 2, ["yesterday", "no moment"]),
    ("goto best --for -3s", 2, ["no duration"]),
    ("goto best --for nan", 2, ["no duration", "30s"]),
    ("goto best --for inf", 2, ["no duration"]),
    ("goto best --for 400d", 2, ["no duration"]),
    ("track best --for soon", 2, ["soon", "no duration"]),
    ("plan best --at yesterday", 2, ["yesterday", "no moment"]),
    ("plan best --from 1,2,3", 2, ["C1,C2"]),
    ("plan best --from -1,5", 2, ["C1,C2", "0 to 16777215"]),
    ("plan best --from nan,5", 2, ["C1,C2"]),
    ("rates Nowhere", 1, ["Nowhere"]),
    ("jog 1 nan --for 1s", 2, ["a jog at nan", "finite number of degrees a second"]),
    ("jog 1 inf --for 1s", 2, ["a jog at inf", "finite number of degrees a second"]),
    ("jog 1 99 --for 1s", 1, ["99°/s", "up to ±4."]),
    ("jog 1 0.5 --for 0s", 2, ["0 s", "above 0 up to 3600 s"]),
    ("jog 2 4 --for 3000s", 1, ["outside", "to 89.9"]),
    ("jog 2 0.5 --for -1s", 2, ["no duration"]),
    ("offset inf 0", 2, ["an offset of inf", "finite number of arcseconds"]),
    ("offset nan 0", 2, ["an offset of nan", "finite number of arcseconds"]),
    ("offset 5000 0", 1, ["5000", "at most ±3600″"]),
    ("offset 5", 2, ["two numbers"]),
    ("offset east 5", 2, ["two numbers"]),
    ("offset clear", 2, ["give the name"]),
    ("offset clear mount x", 1, ["mount x cannot be cleared: take mount_x_mas out"]),
    ("sync altaz:90,20", 1, ["more than 5°", "--force"]),
    ("sync altaz:90,-20 --force", 1, ["below the horizon"]),
    ("guide N 0", 2, ["0 ms", "1 to 10000 ms"]),
    ("guide N nan", 2, ["nan", "finite number of milliseconds"]),
    ("guide up 100", 2, ["give one of north"]),
    ("guide N 100", 1, ["nothing is: `goto` one first"]),
    ("centre 83.6 95", 2, ["declination 95"]),
    ("centre altaz:1,2", 2, ["no place of an image"]),
    ("centre 83.6 22", 1, ["nothing is: `goto` one first"]),
    ("sync 25:00:00 +22:00:00", 2, ["0 to 24"]),
    ("instrument spectrograph", 1, ["there is main"]),
    ("drive speed nan 0 --for 1s", 2, ["a speed of nan", "finite number of degrees a second"]),
    ("drive speed 0.1 0 --for 0s", 2, ["0 s", "above 0 up to 600 s"]),
    ("drive speed 99 0 --for 1s", 1, ["99°/s", "up to ±4."]),
    ("drive set axis1_park nan", 2, ["axis1_park = nan", "finite number"]),
    ("drive set axis1_park up", 2, ["axis1_park = 'up'"]),
    ("plan best --rate nan,0", 2, ["EAST,NORTH"]),
    ("plan best --rate-from now", 2, ["without rates"]),
    ("plan tle:", 2, ["tle:FILE#NAME"]),
    ("plan ephem:", 2, ["ephem:FILE"]),
    ("plan mpc:none.txt#1P", 1, ["none.txt", "cannot be read"]),
    ("drive show on", 1, ["no register 'on'"]),
    ("drive set axis1_park 1e99", 1, ["axis1_park"]),
    ("jog 3 1 --for 1s", 2, ["'3'", "no rotator"]),
    ("jog 4 1 --for 1s", 2, ["'4'", "axis1"]),
]  # fmt: skip
USAGE = ["", "gotoo M1", "goto", "jog 1 fast --for 1s", "jog 1 1",
         "drive power", "drive power off", "drive shove", "goto best --for 3s --exit",
         "simulate none", "init none", "status --frequently", "sync best --posture sideways"]  # fmt: skip


@pytest.fixture
def written(tmp_path):
    def write(text, link="sim:"):
        path = tmp_path / "telescope.toml"
        state = "" if "[state]" in text else f'[state]\npath = "{tmp_path / "state"}"\n'
        path.write_text(text.replace("{link}", link) + state, encoding="utf-8")
        return str(path)

    return write


@pytest.fixture
def refused(capsys):
    """Run a command that must be refused; return its sentence."""

    def run(file, words, code):
        found = main(["-c", file, *words.split()])
        done = capsys.readouterr()
        assert "Traceback" not in done.err, done.err
        assert found == code, (words, done.out, done.err)
        assert done.err.startswith("clockdrive: ") or "\nclockdrive: " in done.err
        assert done.out == ""
        return done.err

    return run


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """A telescope at park that all the refusals leave where it is."""
    folder = tmp_path_factory.mktemp("kept")
    path = folder / "telescope.toml"
    path.write_text(SIM.replace("{link}", "sim:") + f'[state]\npath = "{folder / "state"}"\n', encoding="utf-8")
    yield str(path)
    with Telescope.open(path) as scope:
        status = scope.status()
        assert [axis["counts"] for axis in status["axes"]] == [0x800000 + 0.5] * 2
        assert [row["name"] for row in status["corrections"] if "age_s" in row] == []
        assert {event.kind for event in scope.events()} <= {"drive", "simulator"}


@pytest.mark.parametrize(("words", "code", "said"), REFUSED, ids=[row[0] for row in REFUSED])
def test_is_refused_with_a_sentence_and_nothing_moves(words, code, said, kept, refused):
    text = refused(kept, words, code)
    for each in said:
        assert each in text, text


AWR = '[drive]\nkind = "awr"\nlink = "sim:"\n[simulator]\nfirmware = {}\n'
WORDS = {
    "drive set 2C 5": ["no register 2C", "00 to 1A, 3F or FF", "`drive show` lists them all"],
    "drive set 1a 5": ["register 1a", "upper case here, 1A"],
    "drive set 05 70000": ["guide_up_counts (05) = 70000", "give 16 to 65535"],
    "drive set BF 1": ["BF is never written", "what may be written are 00 to 17, 19 and 1A"],
}


def test_words_of_an_awr_that_are_not_there_or_never_written_are_refused_with_what_may_be(written, refused):
    file = written(AWR.format(0.77))
    for words, said in WORDS.items():
        text = refused(file, words, 1)
        assert all(each in text for each in said), text


def test_firmware_of_an_awr_that_is_too_old_is_refused_and_a_newer_one_named(written, refused, capsys):
    text = refused(written(AWR.format(0.53)), "status", 1)
    assert all(each in text for each in ("firmware 0.53 is older", "0.59 or later is needed", "ask AWR")), text
    assert main(["-c", written(AWR.format(1.23)), "status"]) == 0
    assert "firmware 1.23 is newer than 0.77, the last that the manual describes" in capsys.readouterr().out


@pytest.mark.parametrize("words", USAGE)
def test_a_command_that_does_not_exist_is_a_matter_of_usage(words, kept, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["-c", kept, *words.split()])
    assert ended.value.code == 2
    assert "usage: clockdrive" in capsys.readouterr().err


_BOX = '[drive]\nkind = "avr-box"\n[axis1]\n{}\n[axis2]\n{}\n'
CONFIGURATIONS = {
    "a key that is none": ("[site]\nlatitud_deg = 1.0\n", ["site.latitud_deg", "latitude_deg"]),
    "a latitude beyond the pole": ("[site]\nlatitude_deg = 95.0\n", ["95", "−90 to 90"]),
    "no TOML": ("[site\n", ["not TOML"]),
    "no factory calibration": ('[drive]\nkind = "awr"\nlink = "COM3"\n[axis2]\nsteps_per_degree = 4000.0\n',
                               ["drive.sidereal_steps_per_s is missing", "printed on the calibration sheet"]),
    "none of the other axis": ('[drive]\nkind = "awr"\nlink = "COM3"\nsidereal_steps_per_s = 50.0\n',
                               ["axis2.steps_per_degree is missing", "as the calibration sheet of AWR has them"]),
    "a model that is not there": ('[mount]\npointing_model = "model.mod"\n', ["pointing_model", "model.mod"]),
    "limits the wrong way round": ("[axis1]\nmin_deg = 10.0\nmax_deg = -10.0\n", ["axis1"]),
    "a park outside the limits": ("[axis1]\npark_deg = 175.0\n",
                                  ["axis1.park_deg = 175: allowed -170 to 170 deg", "axis1.min_deg and max_deg"]),
    "gears that the limits contradict": ('[axis1]\nmain_gear = "1/60000"\n',
                                         ["axis1.max_deg = 170: allowed -10.07 to 10.07 deg", "24 bits"]),
    "gears upside down": ('[axis2]\nmain_gear = "285/1"\n', ["allowed up to 100 deg/s", '"1/285"']),
    "gears of a box upside down": (_BOX.format('main_gear = "360/1"', "main_gear = 360"),
                                   ["axis1.main_gear = 360/1", "axis2.main_gear = 360", "allowed up to 2″",
                                    '"1/360"']),
    "a second gear of a box upside down": (_BOX.format('secondary_gear = "57/11"', 'secondary_gear = "57/11"'),
                                           ["track at 26.8 times the sidereal rate, allowed 0.5 to 2",
                                            "axis2.main_gear = 2/360, secondary_gear = 57/11", "2.915″ of the axis"]),
    "gears too slow for the speed": ("[axis1]\nmax_speed_deg_s = 6.0\n",
                                     ["axis1.max_speed_deg_s = 6: allowed at most 5.0526 deg/s", "gecko"]),
    "a current beyond the drive type": ('[axis1]\ndrive_type = "ims"\nmax_speed_deg_s = 3.0\nmotor_current_a = 3.1\n',
                                        ["axis1.motor_current_a = 3.1: allowed 1 to 3 A with drive_type = ims"]),
}  # fmt: skip


@pytest.mark.parametrize("case", CONFIGURATIONS)
def test_an_impossible_configuration_is_refused_as_a_whole(case, written, refused):
    text, said = CONFIGURATIONS[case]
    file = written(text)
    for words in ("config check", "goto best"):
        found = refused(file, words, 2)
        for each in said:
            assert each in found, found


def test_an_encoder_that_the_unit_does_not_detect_is_told_with_its_input_and_the_remedy(written, capsys):
    unit = tc410.simulated(load(None, {}, {}), SystemClock().now(), None)
    with serve(unit, SystemClock(), "tcp://127.0.0.1:0") as server:
        file = written(SIM + "[axis1]\nencoder_bits = 16\n[axis2]\nencoder_bits = 14\n", server.address)
        assert main(["-c", file, "status"]) == 0
    told = capsys.readouterr().out
    assert "encoder_bits = 16, but the drive detects no encoder (input 0x0A)" in told
    assert "check its plug and supply, or set encoder_bits = 0" in told


WEATHER = {
    "stale": (
        '{"pressure_hpa": 1000.0, "utc": "2027-01-15T04:00:00Z"}',
        ["measured 4 h ago (bound 15 min)", "check"],
    ),
    "malformed": ("pressure: 1000", ["neither JSON nor TOML", "[site.weather]"]),
    "impossible": (
        '{"pressure_hpa": 500.0, "utc": "2027-01-15T08:00:00Z"}',
        ["pressure 500 hPa", "888 to 1090", "check height_m"],
    ),
    "not there": (None, ["cannot be read", "check the path"]),
}


@pytest.mark.parametrize("case", WEATHER)
def test_weather_that_cannot_be_used_is_told_under_the_plan_and_the_configured_air_is_used(case, tmp_path):
    text, said = WEATHER[case]
    file = tmp_path / "weather.json"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    source = {"site__weather__source": f"file:{file}", "site__weather__pressure_hpa": 1001.0}
    with telescope(tmp_path / "state", **source) as scope:
        plan = scope.plan("hadec:1,-41").json
        (told,) = (note for note in plan["notes"] if str(file) in note)
        assert all(each in told for each in (*said, "the configured air is used")), told
        assert "1001.0 hPa" in next(
            row["origin"] for row in scope.status()["corrections"] if row["name"] == "refraction"
        )


def test_a_clock_that_is_set_during_a_slew_is_told_with_step_bound_and_remedy(tmp_path):
    with telescope(tmp_path) as scope:
        step = [0.0]
        scope._session.surroundings._watch = ClockWatch(lambda: scope.clock.now() + step[0], scope.clock.now)
        scope.goto("hadec:1,-41", lambda _: step.__setitem__(0, 2.4))
        told = [event.text for event in scope.events() if "clock" in event.text]
    assert len(told) == 1
    assert "was stepped by +2.4 s during the slew to hadec:1,-41" in told[0]
    assert "(bound 0.1 s): the telescope was or is aimed 36″ off" in told[0]
    assert "check the time service, then `goto` again" in told[0]


def test_a_geostationary_satellite_below_the_horizon_is_refused_with_what_to_do(refused, written, tmp_path, capsys):
    """On the other side of the Earth: one such orbit in four or five is seen from Kaikoura."""
    epoch = time.strftime("%y%j.50000000", time.gmtime())
    said = []
    for node in (0.0, 120.0, 240.0):
        path = tmp_path / "geo.tle"
        orbit = lines(41866, 0.05, node, 0.0002, 90.0, 52.0, 1.00273, NO_DRAG, epoch)
        path.write_text("\n".join(("GEO", *orbit)) + "\n", encoding="utf-8")
        if main(["-c", written(SIM), "plan", f"tle:{path}", "--from", "8388608,8388608", "--json"]):
            capsys.readouterr()
            said.append(refused(written(SIM), f"plan tle:{path} --from 8388608,8388608", 1))
    assert said
    assert all("below the horizon limit" in text for text in said)
    assert all("not be allowed within a day: choose another target" in text for text in said), said


def test_a_file_that_is_not_there_is_refused(refused, tmp_path):
    assert "no such file" in refused(str(tmp_path / "none.toml"), "status", 2)


def test_an_unreachable_drive_is_refused(written, refused):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
    text = refused(written(SIM, f"tcp://127.0.0.1:{port}"), "goto best", 1)
    assert f"127.0.0.1:{port}" in text
    text = refused(written(SIM, "serial:///dev/none-such"), "goto best", 1)
    assert "/dev/none-such" in text


@pytest.mark.parametrize("says", [b"SSH-2.0-OpenSSH_9.6\r\n", b"\x00\xff\x00\xff" * 50, b":010300000000FC\r\n"])
def test_another_protocol_at_the_port_is_refused(says, written, refused):
    with socket.create_server(("127.0.0.1", 0)) as listener:
        done = threading.Event()

        def talk():
            listener.settimeout(0.2)
            while not done.is_set():
                try:
                    client, _ = listener.accept()
                except TimeoutError:
                    continue
                with client:
                    client.settimeout(10.0)
                    try:
                        while client.recv(100):
                            client.sendall(says)
                    except OSError:
                        continue

        thread = threading.Thread(target=talk)
        thread.start()
        try:
            text = refused(written(SIM, f"tcp://127.0.0.1:{listener.getsockname()[1]}"), "status", 1)
        finally:
            done.set()
            thread.join()
    assert "no TC410 answers" in text
    assert "check" in text


def test_a_drive_that_another_client_holds_is_refused(written, refused):
    unit = tc410.simulated(load(None, {}, {}), SystemClock().now(), None)
    with serve(unit, SystemClock(), "tcp://127.0.0.1:0") as server:
        host, _, port = server.address.removeprefix("tcp://").rpartition(":")
        with socket.create_connection((host, int(port))) as first:
            first.sendall(b"x")
            text = refused(written(SIM, server.address), "goto best", 1)
    assert port in text


def test_a_telescope_that_another_process_owns_is_refused(written, refused):
    file = written(SIM)
    configuration = load(file, {}, {})
    with Ownership(
        configuration.state_directory, configuration.identity, name="Test", command="clockdrive run", time=1.8e9
    ):
        text = refused(file, "goto best", 1)
    assert f"process {os.getpid()}" in text
    assert "end that process" in text


def test_a_state_store_that_cannot_be_used_is_refused(written, refused, tmp_path):
    file = written(SIM)
    (tmp_path / "state").mkdir()
    (tmp_path / "state" / FILE_NAME).write_bytes(b"this is no database" * 100)
    assert "Move it away" in refused(file, "goto best", 1)
    (tmp_path / "in the way").write_text("")
    blocked = written(SIM + f'[state]\npath = "{tmp_path / "in the way" / "state"}"\n')
    assert "cannot be made" in refused(blocked, "goto best", 1)


@pytest.mark.skipif(sys.platform != "linux", reason="a file system that nobody can write is had on Linux only")
def test_a_read_only_state_directory_is_refused(written, refused):
    file = written(SIM + '[state]\npath = "/proc/self/state"\n')
    assert "state" in refused(file, "goto best", 1)


@pytest.mark.parametrize("words", ["goto Betelgeuze", "goto altaz:0,5", "jog 1 nan --for 1s", "offset inf 0"])
def test_a_refusal_as_json_is_one_document(words, kept, capsys):
    assert main(["-c", kept, *words.split(), "--json"]) in {1, 2}
    refusal = json.loads(capsys.readouterr().out)
    assert refusal["ok"] is False
    assert refusal["reason"]


def test_a_refusal_says_when_the_target_can_be_reached(kept, capsys):
    words = "plan M42 --from 8388608,8388608 --at 2026-11-22T03:00:00Z --json"
    assert main(["-c", kept, *words.split()]) == 1
    refusal = json.loads(capsys.readouterr().out)
    assert refusal["reachable_utc"].startswith("2026-11-22T08:")
