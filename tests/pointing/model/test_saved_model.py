"""A fit written as a TPOINT model file comes back as the same model."""

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.model_file import ModelFile, ModelRow, read_model
from pointing.model.saved_model import kind_of, model_of, save


@pytest.mark.parametrize(("mount", "by_pier"), [("fork", False), ("german", True), ("altazimuth", False)])
def test_a_saved_model_is_read_back_to_the_last_digit(tmp_path, mount, by_pier):
    run = simulated_run(mount, 40.0, TRUTH[mount], 40, np.random.default_rng(1)).run
    found = fit(run, " ".join(TRUTH[mount]), by_pier=by_pier)
    path = tmp_path / "model.mod"
    found.save(path)
    read = model_of(read_model(path), 40.0)
    off = max(abs(a - b) for a, b in zip(read.coefficients, found.model.coefficients, strict=True))
    assert read.terms == found.model.terms
    assert read.kind == run.mount
    assert off < 1e-18  # arcseconds to radians and back
    rows = {row.name: row for row in read_model(path).rows}
    assert all(rows[each.name].sigma_arcsec == each.sigma_arcsec for each in found.coefficients)
    assert read_model(path).n == 40


def test_a_fixed_term_stays_fixed_in_the_file(tmp_path):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run
    fit(run, "IH ID CH", fixed={"CH": 90.0}).save(tmp_path / "model.mod")
    assert read_model(tmp_path / "model.mod").rows[2] == ModelRow("CH", 90.0, None, fixed=True)


def test_the_kind_of_mount_follows_from_the_terms():
    assert kind_of(ModelFile("a", rows=(ModelRow("TF", 1.0), ModelRow("IA", 1.0)))) == "altazimuth"
    assert kind_of(ModelFile("a", rows=(ModelRow("IH", 1.0),))) == "equatorial"


def test_terms_of_two_kinds_of_mount_are_refused():
    mixed = ModelFile("mixed", rows=(ModelRow("IA", 1.0), ModelRow("IH", 1.0)))
    with pytest.raises(PointingError, match=r"mixed is for no mount: equatorial: .*IA.*altazimuth: .*IH"):
        kind_of(mixed)
    with pytest.raises(PointingError, match="is for an altazimuth mount"):
        model_of(mixed, 40.0, "equatorial")


def test_a_file_that_cannot_be_written_is_told(tmp_path):
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run
    with pytest.raises(PointingError, match="cannot be written"):
        save(fit(run, "IH ID"), tmp_path / "absent" / "model.mod")
