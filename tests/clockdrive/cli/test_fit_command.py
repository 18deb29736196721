"""`fit` and `model` from their words to their exit codes: what they say, write and refuse."""

import ast
import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import erfa
import numpy as np
import pytest
from astropy.table import QTable
from simulated_runs import TRUTH, simulated_run

from clockdrive.cli import main
from clockdrive.cli.spoken import spoken
from clockdrive.fitting import DEFAULT_TERMS
from pointing import model
from pointing.model.ecsv_run import write_ecsv
from pointing.model.model_file import ModelFile, ModelRow, read_model_file, write_model_file
from pointing.model.tpoint_file import write_tpoint


@pytest.fixture
def run(capsys):
    def runs(*words):
        code = main([str(word) for word in words])
        done = capsys.readouterr()
        assert "Traceback" not in done.err, done.err
        return code, done.out, done.err

    return runs


@pytest.fixture
def answer(run):
    def runs(*words):
        code, out, _ = run(*words, "--json")
        return code, json.loads(out)

    return runs


@pytest.fixture
def observations(tmp_path):
    """A function that writes a simulated run and returns its file."""

    def write(mount="fork", n=60, **options):
        path = tmp_path / f"{mount}.ecsv"
        write_ecsv(simulated_run(mount, 40.0, TRUTH[mount], n, np.random.default_rng(9), **options).run, path)
        return path

    return write


@pytest.mark.parametrize("mount", ["fork", "german", "altazimuth"])
def test_the_usual_terms_of_the_mount_find_the_telescope(answer, observations, mount):
    code, found = answer("fit", observations(mount))
    assert code == 0
    assert found["ok"]
    off = {
        each["name"]: (each["arcsec"] - TRUTH[mount][each["name"]]) / each["sigma_arcsec"] for each in found["terms"]
    }
    print(mount, {name: f"{value:+.1f}σ" for name, value in off.items()})
    assert " ".join(off) == DEFAULT_TERMS["altazimuth" if mount == "altazimuth" else "equatorial"]
    assert max(map(abs, off.values())) < 4.0
    assert (found["n"], found["masked"]) == (60, [])
    assert found["popn_sd_arcsec"] == pytest.approx(found["sky_rms_arcsec"] * math.sqrt(60 / 53))
    assert found["condition"] > 1.0
    assert any("axis" in line or "base" in line for line in found["advice"])


def test_a_person_sees_terms_statistics_and_advice(run, observations):
    code, out, _ = run("fit", observations())
    print(out)
    assert code == 0
    lines = out.splitlines()
    assert [line.split()[0] for line in lines[1:8]] == DEFAULT_TERMS["equatorial"].split()
    assert lines[8].startswith("sky RMS ")
    assert any(line.startswith(("lower the polar axis by", "raise the polar axis by")) for line in lines)


def test_given_terms_fixed_ones_and_a_mask_are_heeded(answer, observations):
    code, found = answer(
        "fit", observations(), "--terms", "IH ID CH MA ME", "--fixed", "CH=90, MA=-150.0", "--mask", "3,7"
    )
    assert code == 0
    assert {each["name"]: each["arcsec"] for each in found["terms"] if each["fixed"]} == pytest.approx(
        {"CH": 90.0, "MA": -150.0}
    )
    assert (found["n"], found["masked"]) == (58, [3, 7])


def test_outliers_are_masked_and_told_and_the_robust_fit_needs_no_mask(answer, observations):
    path = observations(outliers=0.05)
    _, masked = answer("fit", path, "--outliers")
    assert len(masked["masked"]) == 3
    assert [each["index"] for each in masked["outliers"]] == masked["masked"]
    assert masked["sky_rms_arcsec"] < 4.0
    _, robust = answer("fit", path, "--robust")
    _, plain = answer("fit", path)
    assert robust["masked"] == plain["masked"] == []
    off = [
        max(abs(each["arcsec"] - TRUTH["fork"][each["name"]]) for each in found["terms"]) for found in (robust, plain)
    ]
    print(f"worst coefficient: robust {off[0]:.1f}″, plain {off[1]:.1f}″")
    assert off[0] < off[1]


def test_both_sides_of_a_pier_may_have_their_own_index_errors(answer, observations):
    code, found = answer("fit", observations("german"), "--by-pier")
    assert code == 0
    assert [each["name"] for each in found["terms"]][:2] == ["IHB", "IDB"]
    code, found = answer("fit", observations("fork"), "--by-pier")
    assert code == 1
    assert "both" in found["reason"]


def test_auto_chooses_terms_and_says_why(answer, run, observations):
    path = observations("altazimuth")
    code, found = answer("fit", path, "--auto")
    assert code == 0
    chosen = {each["name"] for each in found["terms"]}
    print(sorted(chosen))
    assert {"IA", "IE", "CA", "AN", "AW"} <= chosen
    assert {step["action"] for step in found["choice"]} >= {"begun with", "taken"}
    _, out, _ = run("fit", path, "--auto")
    assert "taken AN AW: " in out


def test_the_model_the_residuals_and_the_picture_are_written(answer, observations, tmp_path):
    paths = [tmp_path / name for name in ("out.mod", "out.ecsv", "out.png")]
    code, found = answer("fit", observations(), "-o", paths[0], "--residuals", paths[1], "--plot", paths[2])
    assert code == 0
    assert sorted(found["written"]) == sorted(str(path) for path in paths)
    rows = {row.name: row.arcsec for row in read_model_file(paths[0]).rows}
    assert rows == {each["name"]: each["arcsec"] for each in found["terms"]}
    assert len(QTable.read(paths[1], format="ascii.ecsv")) == 60
    assert paths[2].read_bytes().startswith(b"\x89PNG")


def test_an_equatorial_tpoint_file_is_fitted_in_the_frame_that_is_named(answer, tmp_path):
    path = tmp_path / "run.dat"
    write_tpoint(simulated_run("fork", 40.0, TRUTH["fork"], 60, np.random.default_rng(9)).run, path)
    code, found = answer("fit", path)
    assert code == 1
    assert "frame" in found["reason"]
    code, found = answer("fit", path, "--places", "observed")
    assert code == 0
    assert found["sky_rms_arcsec"] < 4.0


def test_refusals_and_findings_name_options_and_not_arguments_of_python(answer, tmp_path):
    path = tmp_path / "run.dat"
    good = simulated_run("fork", 40.0, TRUTH["fork"], 60, np.random.default_rng(9)).run
    write_tpoint(good, path)
    text = path.read_text(encoding="utf-8")
    (tmp_path / "twice.dat").write_text(text + text, encoding="utf-8")
    (tmp_path / "old.dat").write_text(text.replace(":EQUAT", ":EQUAT EQUINOX B1950.0"), encoding="utf-8")
    said = [
        answer("fit", *words)[1]["reason"]
        for words in (
            [path],
            [path, "--places", "apparent"],
            [path, "--places", "observed", "--by-pier"],
            [tmp_path / "twice.dat", "--places", "observed"],
            [tmp_path / "old.dat", "--places", "icrs"],
        )
    ]
    print(*said, sep="\n")
    assert "give --places apparent (of date), --places icrs (J2000) or --places observed (refracted)" in said[0]
    assert "`clockdrive fit` says so" in said[0]
    assert "give --weather HPA,C, or --weather none" in said[1]
    assert "leave --by-pier out" in said[2]
    assert said[3].endswith("a second run begins here, of 2: split the file")
    assert "and --places icrs are of J2000" in said[4]
    assert not re.search(r"\w=|\w_\w|\w\(\w*\)", " ".join(said))


def test_no_text_of_the_readers_keeps_an_argument_of_python():
    readers = ("tpoint_file", "tpoint_records", "equatorial_places", "residual_checks", "range_checks", "fit")
    sources = (Path(model.__path__[0], f"{name}.py").read_text(encoding="utf-8") for name in readers)
    nodes = (node for source in sources for node in ast.walk(ast.parse(source)) if isinstance(node, ast.Constant))
    found = [node.value for node in nodes if isinstance(node.value, str) and "\n" not in node.value]
    python = re.compile(
        r"\b(places|weather|by_pier|outliers|robust|fixed|model) ?= ?['\w]|by_pier out|read_tpoint_all"
    )
    spoilt = [text for text in found if python.search(text)]
    print(*spoilt, sep="\n")
    assert len(spoilt) >= 6
    assert not [text for text in map(spoken, spoilt) if python.search(text)]


def test_apparent_places_are_refracted_by_the_air_that_is_given(answer, tmp_path):
    path = tmp_path / "run.dat"
    write_tpoint(simulated_run("fork", 40.0, TRUTH["fork"], 60, np.random.default_rng(9)).run, path)
    assert "temperature and pressure" in answer("fit", path, "--places", "apparent")[1]["reason"]
    flexure = [
        next(each["arcsec"] for each in found["terms"] if each["name"] == "TX")
        for _, found in (
            answer("fit", path, "--terms", "IH ID CH NP MA ME TF TX", "--places", "apparent", "--weather", weather)
            for weather in ("none", "505,12", "1010,12,0.6")
        )
    ]
    tangent = math.degrees(erfa.refco(1010.0, 12.0, 0.6, 0.55)[0]) * 3600.0
    print([f"{value:.1f}″" for value in flexure], f"{tangent:.1f}″ tan Z is the air's greatest part")
    assert flexure[0] - flexure[2] == pytest.approx(tangent, rel=0.05)  # the rest, −0.07″ tan³ Z, takes some of it
    assert flexure[1] - flexure[2] == pytest.approx(tangent / 2.0, rel=0.05)


def test_the_pole_to_which_the_axis_shall_point_is_chosen(answer, observations):
    _, true = answer("fit", observations())
    _, refracted = answer("fit", observations(), "--pole", "refracted")
    assert "(to the true pole)" in true["advice"][0]
    assert "(to the refracted pole)" in refracted["advice"][0]
    assert true["terms"] == refracted["terms"]


@pytest.mark.parametrize(
    ("words", "code", "text"),
    [
        (["--terms", "IH ID IA"], 1, "IA .* is for an altazimuth mount"),
        (["--terms", "IH XYZ"], 2, "no pointing term 'XYZ'"),
        (["--terms", "IH IA"], 1, "IA .* is for an altazimuth mount"),
        (["--terms", ""], 2, "--terms '' names none"),
        (["--fixed", "CH=1 CH=2"], 2, "CH stands twice"),
        (["-o", "fork.ecsv"], 1, "-o fork.ecsv|--output fork.ecsv would write over the observations"),
        (["--residuals", "./fork.ecsv"], 1, "--residuals ./fork.ecsv would write over the observations"),
        (["-o", "z", "--residuals", "z"], 1, "--output z would write over what --residuals writes"),
        (["--terms", "IH IH"], 1, "named twice"),
        (["--fixed", "ACES=1"], 1, "ACES is to be held fixed, but is no term"),
        (["--fixed", "CH"], 2, "give NAME=ARCSEC"),
        (["--fixed", "CH=much"], 2, "give NAME=ARCSEC"),
        (["--weather", "1010"], 2, "give pressure in hPa"),
        (["--weather", "1010,12,0.5,1"], 2, "give pressure in hPa"),
        (["--weather", "9999,12"], 1, "--weather 9999,12: pressure_hpa"),
        (["--mask", "3,x"], 2, "counted from 0"),
        (["--mask", "99"], 1, "the run has 60"),
        (["--auto", "--fixed", "CH=0"], 2, "--fixed goes with --terms"),
        (["--plot", "picture.unknown"], 1, "cannot be drawn"),
        (["-o", "absent/model.mod"], 1, "cannot be written"),
        (["--residuals", "absent/residuals.ecsv"], 1, "cannot be written: there is no folder 'absent'"),
        (["--plot", "picture"], 1, "picture cannot be drawn: .*possible are .*png"),
        (["-o", "."], 1, "is a folder: name a file in it"),
    ],
)
def test_what_cannot_be_done_is_refused_in_a_sentence(run, observations, tmp_path, monkeypatch, words, code, text):
    monkeypatch.chdir(tmp_path)
    found, out, err = run("fit", observations(), *words)
    assert found == code
    assert out == ""
    assert len(err.splitlines()) == 1
    assert re.search(text, err)


@pytest.mark.parametrize(
    "fault", [["--plot", "picture.unknown"], ["--plot", "picture.png"], ["--residuals", "absent/residuals.ecsv"]]
)
def test_what_cannot_be_written_leaves_the_model_of_last_night_in_place(
    run, observations, tmp_path, monkeypatch, fault
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    (tmp_path / "model.mod").write_text("last night's", encoding="utf-8")
    code, _, err = run("fit", observations(), "-o", "model.mod", *fault)
    assert code == 1
    assert re.search(r"pip install 'clockdrive\[plots\]'|there is no folder", err)
    assert (tmp_path / "model.mod").read_text(encoding="utf-8") == "last night's"


def test_the_result_is_shown_before_a_disk_that_fills_up(run, observations, tmp_path, monkeypatch):
    def full(*_words, **_named):
        raise OSError(28, "No space left on device")

    path = observations()
    monkeypatch.setattr(Path, "write_text", full)
    code, out, err = run("fit", path, "-o", tmp_path / "model.mod")
    assert code == 1
    assert "sky RMS" in out
    assert "written" not in out
    assert "model.mod' cannot be written (No space left on device)" in err


def test_a_run_with_a_fault_is_diagnosed_and_not_fitted(answer, tmp_path):
    good = simulated_run("altazimuth", 40.0, TRUTH["altazimuth"], 60, np.random.default_rng(9)).run
    path = tmp_path / "few.ecsv"
    write_ecsv(good.subset(np.arange(60) < 3), path)
    code, found = answer("fit", path)
    assert code == 1
    assert not found["ok"]
    assert "3" in found["reason"]
    swapped = replace(good, star1=good.star2, star2=np.clip(good.star1, -1.5, 1.5))
    write_ecsv(swapped, path)
    code, found = answer("fit", path)
    assert code == 1
    assert "exchanged" in found["reason"]
    (tmp_path / "noise.dat").write_bytes(b"\0\1\2")
    assert answer("fit", tmp_path / "noise.dat")[0] == 1
    assert answer("fit", tmp_path / "absent.dat")[0] == 1


@pytest.fixture
def models(tmp_path):
    """Two good model files and one for no mount."""
    rows = (ModelRow("IA", 10.0, 1.0), ModelRow("NPAE", 5.0), ModelRow("TX", 3.0, 0.5, fixed=True))
    write_model_file(ModelFile("one", n=20, sky_rms_arcsec=2.5, rows=rows), tmp_path / "one.mod")
    other = (ModelRow("IA", 16.0, 1.0), ModelRow("IE", -4.0, 0.2))
    write_model_file(ModelFile("two", n=30, sky_rms_arcsec=1.5, rows=other), tmp_path / "two.mod")
    write_model_file(ModelFile("bad", rows=(ModelRow("IA", 1.0), ModelRow("IH", 1.0))), tmp_path / "bad.mod")
    return tmp_path


def test_a_model_is_shown_with_what_its_terms_are(run, answer, models):
    code, out, _ = run("model", "show", models / "one.mod", models / "two.mod")
    assert code == 0
    assert "one.mod: one; altazimuth mount, n = 20, sky RMS 2.5″" in out
    assert "NPAE        +5.0000″             the elevation axis is not square to the azimuth axis" in out
    assert "(fixed)" in next(line for line in out.splitlines() if " TX " in line)
    _, found = answer("model", "show", models / "two.mod")
    assert [row["evidence"] for row in found["models"][0]["terms"]] == ["published", "published"]


def test_a_model_is_checked(answer, models):
    assert answer("model", "check", models / "one.mod", models / "two.mod")[0] == 0
    code, found = answer("model", "check", models / "one.mod", models / "bad.mod")
    assert code == 1
    assert "for no mount" in found["reason"]
    write_model_file(ModelFile("huge", rows=(ModelRow("IA", 200_000.0),)), models / "huge.mod")
    assert "possible are −45° to 45°" in answer("model", "check", models / "huge.mod")[1]["reason"]
    twins = ModelFile("twins", rows=(ModelRow("TF", 1.0), ModelRow("ECEC", 1.0)))
    write_model_file(twins, models / "twins.mod")
    assert "TF, ECEC cannot be told apart" in answer("model", "check", models / "twins.mod")[1]["reason"]
    write_model_file(ModelFile("empty"), models / "empty.mod")
    assert "no term" in answer("model", "check", models / "empty.mod")[1]["reason"]


def test_models_are_compared_in_units_of_their_sigmas(run, answer, models):
    code, found = answer("model", "compare", models / "one.mod", models / "two.mod")
    assert code == 0
    rows = {row["name"]: row for row in found["terms"]}
    assert rows["IA"]["sigmas_apart"] == pytest.approx([6.0 / math.sqrt(2.0)])
    assert rows["IE"] == {"name": "IE", "arcsec": [None, -4.0], "sigmas_apart": [None]}
    _, out, _ = run("model", "compare", models / "one.mod", models / "two.mod")
    assert "+16.000″ (+4.2σ)" in out
    assert "absent" in out
    assert answer("model", "compare", models / "one.mod")[0] == 2


def test_models_of_different_mounts_are_not_compared(answer, models):
    write_model_file(ModelFile("equatorial", rows=(ModelRow("IH", 1.0), ModelRow("TF", 1.0))), models / "eq.mod")
    code, found = answer("model", "compare", models / "one.mod", models / "eq.mod")
    assert code == 1
    assert "a comparison of these models is for no mount" in found["reason"]
