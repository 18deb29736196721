"""SPK's files: which pair is the star, and in which sense azimuth counts, is told by the published signs."""

import math

import numpy as np
import pytest
from first_order_fit import fit
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError
from pointing.model.run import PointingRun
from pointing.model.spk_file import read_spk, write_spk

PUBLISHED = {  # terms, their values, σ (a population's), the first order's worth of error, all in arcseconds
    "spk_equat": ("equatorial", 39, {"IH": -92.258, "ID": -126.738, "CH": 44.210, "ME": 64.848, "MA": -2.992,
                                     "TF": 10.993}, 5.780, 0.1),
    "spk_altaz": ("altazimuth", 105, {"IA": -142.148, "IE": -117.293, "CA": 19.843, "AN": -23.758, "AW": 19.261,
                                      "TF": 279.752}, 8.349, 0.35),
}  # fmt: skip


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_published_signs_come_out(shared, name):
    mount, n, terms, sigma, allowed = PUBLISHED[name]
    run = read_spk(shared / "data" / "tpoint" / f"{name}.dat")
    found = fit(run, " ".join(terms))
    worst = max(abs(found.arcsec[term] - value) for term, value in terms.items())
    deviation = found.sky_rms_arcsec * math.sqrt(n / (n - len(terms)))
    print(f"{name}: coefficients within {worst:.3f}″, σ {deviation:.3f}″, published {sigma}″")
    assert (run.mount, len(run)) == (mount, n)
    assert worst < allowed
    assert deviation == pytest.approx(sigma, rel=0.005)


@settings(derandomize=True, deadline=None, max_examples=40)
@given(
    st.sampled_from(["equatorial", "altazimuth"]), st.floats(-90.0, 90.0),
    st.lists(st.tuples(*[st.floats(-359.0, 359.0), st.floats(-90.0, 90.0)] * 2), min_size=1, max_size=4),
)  # fmt: skip
def test_any_run_is_written_and_read_back(tmp_path_factory, mount, latitude, rows):
    run = PointingRun.from_degrees(mount, latitude, *np.array(rows).T, caption="Any")
    path = tmp_path_factory.getbasetemp() / "any.dat"
    write_spk(run, path)
    again = read_spk(path)
    assert (again.mount, again.caption) == (mount, "Any")
    assert again.latitude == pytest.approx(run.latitude, abs=1e-13)
    for name in ("star1", "star2", "axis1", "axis2"):
        assert getattr(again, name) == pytest.approx(getattr(run, name), abs=1e-12)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("Run\nA\n", "s.dat is no SPK file"),
        ("Run\nX\n30\n", "s.dat, line 2, column 1: 'X': wanted is A"),
        ("Run\nA\n300\n", "line 3, column 1: '300': wanted is the latitude"),
        ("Run\nA\n30\n1 2 3\n", "line 4, column 1: '1 2 3': 3 columns"),
        ("Run\nE\n30\n\n1 95 3 4\n", "line 5, column 3: '95 3 4': declination of a star"),
    ],
)
def test_what_is_no_run_is_refused_with_line_and_column(tmp_path, text, said):
    path = tmp_path / "s.dat"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PointingError) as refused:
        read_spk(path)
    assert said in str(refused.value)


def test_masked_observations_are_left_out_and_weights_refused(tmp_path):
    run = PointingRun.from_degrees("altazimuth", 30.0, [1, 2], [3, 4], [1, 2], [3, 4])
    write_spk(run.masked([0]), tmp_path / "run.dat")
    assert np.degrees(read_spk(tmp_path / "run.dat").star1) == pytest.approx([2.0])
    weighted = PointingRun.from_degrees("altazimuth", 30.0, [1], [3], [1], [3], weight=np.array([2.0]))
    with pytest.raises(PointingError, match="write ECSV"):
        write_spk(weighted, tmp_path / "run.dat")
