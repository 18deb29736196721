"""Any damage to any file of a run or model is refused in one line, or leaves something finite."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError
from pointing.model.ecsv_run import read_ecsv, write_ecsv
from pointing.model.model_file import ModelFile, ModelRow, read_model_file, write_model_file
from pointing.model.run import PointingRun
from pointing.model.run_file import read_run
from pointing.model.spk_file import read_spk, write_spk
from pointing.model.tpoint_file import write_tpoint

RUN = PointingRun.from_degrees("equatorial", 39.0, [1, 2], [3, 4], [-1, 2.5], [3, 176], caption="A run")
MODEL = ModelFile("A model", "T", 10, 2.5, rows=(ModelRow("IH", -1.5, 0.25), ModelRow("ID", 2.0, fixed=True)))
FORMATS = {
    "ecsv": (read_ecsv, write_ecsv, RUN),
    "spk": (read_spk, write_spk, RUN),
    "tpoint": (lambda path: read_run(path, places="observed"), write_tpoint, RUN),
    "model": (read_model_file, write_model_file, MODEL),
}


def finite(thing):
    if isinstance(thing, PointingRun):
        return all(np.isfinite(getattr(thing, name)).all() for name in ("star1", "star2", "axis1", "axis2"))
    return bool(np.isfinite([row.arcsec for row in thing.rows]).all())


@pytest.mark.parametrize("name", FORMATS)
@settings(derandomize=True, deadline=None, max_examples=30)
@given(data=st.data())
def test_any_damage_is_a_refusal_in_one_line_or_leaves_something_finite(tmp_path_factory, name, data):
    read, write, thing = FORMATS[name]
    path = tmp_path_factory.getbasetemp() / f"damaged.{name}"
    write(thing, path)
    whole = path.read_bytes()
    at = data.draw(st.integers(0, len(whole)))
    cut = data.draw(st.integers(0, 40))
    path.write_bytes(whole[:at] + data.draw(st.binary(max_size=5)) + whole[at + cut :])
    try:
        found = read(path)
    except PointingError as refused:
        assert "\n" not in str(refused)  # noqa: PT017 - a refusal is as good as a run
    else:
        assert finite(found)
