"""A model file as a pointing model of one mount."""

import math

import pytest

from pointing.errors import PointingError
from pointing.model.model_file import ModelFile, ModelRow, write_model_file
from pointing.model.model_on_file import ModelOnFile, read_model

ARCSEC = math.pi / 648_000.0
TEXT = """\
a mount
T   39   2.9130   58.294   -0.0668
  IH  +12.5  0.8
 &=CH  -45
! no longer: NP +3
  TF  +15.0 1.2
{more}END
"""


def written(folder, more=""):
    path = folder / "model.mod"
    path.write_text(TEXT.replace("{more}", more), encoding="utf-8")
    return path


def test_it_holds_terms_coefficients_sigmas_and_what_the_fit_left(tmp_path):
    path = written(tmp_path)
    model = ModelOnFile.read(path, "equatorial", 0.7)
    assert model.arcsec == pytest.approx({"IH": 12.5, "CH": -45.0, "TF": 15.0})
    assert model.sigmas == (pytest.approx(0.8 * ARCSEC), None, pytest.approx(1.2 * ARCSEC))
    assert (model.n, model.sky_rms, model.caption) == (39, pytest.approx(2.913 * ARCSEC), "a mount")
    assert (model.path, model.modified) == (path, path.stat().st_mtime)
    assert model.text == "model.mod: IH CH TF, fitted to 39 stars, 2.91″ left on the sky"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("  AN +3\n", r"model\.mod, line 7, column 1: '  AN \+3': the term AN .* is for an altazimuth mount"),
        ("&=HQSH1 +3\n", r"line 7.*no pointing term 'HQSH1'; for this mount there are IH"),
        ("  ME +200000 1.0\n", r"line 7.*ME of 55\.5556°: possible are −45° to 45°; coefficients are arcseconds"),
        ("  IH +1\n", r"line 7.*IH a second time"),
    ],
)
def test_what_is_wrong_is_refused_with_file_and_line(more, said, tmp_path):
    with pytest.raises(PointingError, match=said):
        ModelOnFile.read(written(tmp_path, more), "equatorial", 0.7)


def test_a_caption_end_hides_no_term(tmp_path):
    path = written(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace("a mount", "END"), encoding="utf-8")
    model = ModelOnFile.read(path, "equatorial", 0.7)
    assert (model.caption, model.arcsec) == ("END", pytest.approx({"IH": 12.5, "CH": -45.0, "TF": 15.0}))


def test_a_file_without_a_term_is_refused_as_it_would_leave_the_telescope_unmodelled(tmp_path):
    path = tmp_path / "model.mod"
    path.write_text("a mount\nT 39 2.9\nEND\n", encoding="utf-8")
    with pytest.raises(PointingError, match=r"model\.mod: the model has no term.*: write NAME and coefficient"):
        ModelOnFile.read(path, "equatorial", 0.7)


@pytest.mark.parametrize(
    ("names", "kind"), [("TF IA", "altazimuth"), ("IH", "equatorial"), ("TF", "equatorial"), ("IHB", "equatorial")]
)
def test_the_kind_of_mount_follows_from_the_terms(names, kind, tmp_path):
    rows = tuple(ModelRow(name, 1.0) for name in names.split())
    write_model_file(ModelFile("a mount", rows=rows), tmp_path / "model.mod")
    model = read_model(tmp_path / "model.mod", -35.0)
    assert (model.kind, math.degrees(model.latitude)) == (kind, pytest.approx(-35.0))
    assert model == ModelOnFile.read(tmp_path / "model.mod", kind, math.radians(-35.0))


def test_a_given_kind_is_that_of_the_mount_where_the_terms_have_both(tmp_path):
    write_model_file(ModelFile("a mount", rows=(ModelRow("TF", 1.0),)), tmp_path / "model.mod")
    assert read_model(str(tmp_path / "model.mod"), 40.0, "altazimuth").kind == "altazimuth"


def test_terms_of_two_kinds_of_mount_are_refused(tmp_path):
    path = tmp_path / "mixed.mod"
    write_model_file(ModelFile("mixed", rows=(ModelRow("IA", 1.0), ModelRow("IH", 1.0))), path)
    with pytest.raises(PointingError, match=r"mixed\.mod is for no mount: equatorial: .*IA.*altazimuth: .*IH"):
        read_model(path, 40.0)
    with pytest.raises(PointingError, match=r"mixed\.mod, line 3.*is for an altazimuth mount"):
        read_model(path, 40.0, "equatorial")


def test_a_latitude_that_is_none_is_refused(tmp_path):
    with pytest.raises(PointingError, match=r"^latitude 91°: possible are −90° to 90°"):
        read_model(written(tmp_path), 91.0)


def test_a_file_that_is_not_there_is_refused_by_its_name(tmp_path):
    with pytest.raises(PointingError, match=r"none\.mod"):
        ModelOnFile.read(tmp_path / "none.mod", "equatorial", 0.7)
