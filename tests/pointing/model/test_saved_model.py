"""A fit written as a TPOINT model file comes back as the same model."""

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing import PointingModel, own_term, read_model
from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.model_file import ModelRow, read_model_file
from pointing.model.saved_model import save


@pytest.mark.parametrize(("mount", "by_pier"), [("fork", False), ("german", True), ("altazimuth", False)])
def test_a_saved_model_is_read_back_to_the_last_digit(tmp_path, mount, by_pier):
    run = simulated_run(mount, 40.0, TRUTH[mount], 40, np.random.default_rng(1)).run
    found = fit(run, " ".join(TRUTH[mount]), by_pier=by_pier)
    path = tmp_path / "model.mod"
    found.save(path)
    read = read_model(path, 40.0)
    off = max(abs(a - b) for a, b in zip(read.coefficients, found.model.coefficients, strict=True))
    assert read.terms == found.model.terms
    assert read.kind == run.mount
    assert off < 1e-18  # arcseconds to radians and back
    assert np.degrees(read.sigmas) * 3600.0 == pytest.approx([each.sigma_arcsec for each in found.coefficients])
    assert (read.n, read.free, read.path) == (40, found.free, path)
    place = (0.4, 2.1) if by_pier else (0.4, 0.7)
    assert read.star(*place) == pytest.approx(found.model.star(*place), abs=1e-15)
    assert read.telescope(*place) == pytest.approx(found.model.telescope(*place), abs=1e-15)


def test_a_fixed_term_stays_fixed_in_the_file(tmp_path):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run
    fit(run, "IH ID CH", fixed={"CH": 90.0}).save(tmp_path / "model.mod")
    assert read_model_file(tmp_path / "model.mod").rows[2] == ModelRow("CH", 90.0, None, fixed=True)


@pytest.mark.parametrize("moves", ["D", "X"])
def test_a_term_of_ones_own_is_refused_before_the_file_is_touched(moves, tmp_path):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run
    found = fit(run, ["IH", "ID", own_term("SAG", moves, lambda h, d: np.sin(h) ** 2 + 0.0 * d)])
    path = tmp_path / "model.mod"
    path.write_text("last night's", encoding="utf-8")
    with pytest.raises(PointingError, match=r"^SAG: a term of one's own .*save a fit without it, or keep the run"):
        found.save(path)
    assert path.read_text(encoding="utf-8") == "last night's"


def test_a_model_of_no_terms_is_refused_as_it_is_when_read(tmp_path):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run
    with pytest.raises(PointingError, match="the model has no term"):
        fit(run, PointingModel("equatorial", run.latitude, (), ())).save(tmp_path / "model.mod")
    assert not (tmp_path / "model.mod").exists()


def test_a_file_that_cannot_be_written_is_told(tmp_path):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run
    with pytest.raises(PointingError, match="cannot be written"):
        save(fit(run, "IH ID"), tmp_path / "absent" / "model.mod")
