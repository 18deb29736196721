"""A model that no telescope can have is refused with the numbers; those of real and of badly made ones are not."""

from dataclasses import replace

import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.errors import PointingError
from pointing.model.fit import fit
from pointing.model.model_on_file import read_model
from pointing.model.pointing_model import PointingModel
from pointing.model.polar_alignment import polar_alignment
from pointing.model.possible import refuse_impossible


@pytest.mark.parametrize("latitude_deg", [-70.0, 0.0, 40.0, 90.0])
@pytest.mark.parametrize(
    ("kind", "arcsec", "blamed"),
    [
        ("equatorial", {"CH": 1e5, "NP": 1e5}, "CH|NP"),
        ("equatorial", {"CH": 36100.0}, "CH"),
        ("altazimuth", {"IA": 5.0, "CA": 36100.0}, "CA"),
        ("equatorial", {"IH": 3.0, "PZZ99": 10.0}, "PZZ99"),
        ("altazimuth", {"AN": 40000.0, "CA": 20.0}, "AN"),
    ],
)
def test_more_than_ten_degrees_is_refused_with_the_term_and_where(latitude_deg, kind, arcsec, blamed):
    with pytest.raises(
        PointingError, match=rf"at azimuth .*10°, index errors apart: most is of ({blamed}), "
    ) as refused:
        refuse_impossible(PointingModel.of(kind, latitude_deg, **arcsec))
    print(refused.value)


@pytest.mark.parametrize("latitude_deg", [-70.0, 0.0, 40.0, 90.0])
def test_a_collimation_of_so_many_degrees_is_told_as_so_many(latitude_deg):
    """Collimation displaces by itself, everywhere, and the cone that it keeps out of reach is as wide."""
    with pytest.raises(PointingError, match="displaces by 20° "):
        refuse_impossible(PointingModel.of("equatorial", latitude_deg, CH=72000.0))
    refuse_impossible(PointingModel.of("equatorial", latitude_deg, CH=35990.0))


@pytest.mark.parametrize("latitude_deg", [-70.0, 0.0, 40.0, 90.0])
@pytest.mark.parametrize(
    ("kind", "arcsec"),
    [
        ("equatorial", {"IH": 150_000.0, "ID": -90_000.0}),
        (
            "equatorial",
            {"IH": 900.0, "ID": -400.0, "CH": 7200.0, "NP": -600.0, "MA": 9000.0, "ME": -12000.0, "TF": 60.0},
        ),
        ("altazimuth", {"IA": -7e4, "CA": 3000.0, "NPAE": 900.0, "AN": 3600.0, "AW": -3600.0, "TX": 60.0}),
        ("equatorial", {}),
    ],
)
def test_index_errors_of_any_size_and_errors_of_degrees_are_possible(latitude_deg, kind, arcsec):
    refuse_impossible(PointingModel.of(kind, latitude_deg, **arcsec))


def test_a_file_of_such_a_model_is_refused_with_its_name(tmp_path):
    """By the one judge that library, `model check` and the configuration ask."""
    path = tmp_path / "cone.mod"
    path.write_text("A cone\nT 9 2.0 0 0\n CH 1e5\n NP 1e5\nEND\n", encoding="utf-8")
    with pytest.raises(PointingError, match=r"cone\.mod: the model displaces by .*possible is up to 10°"):
        read_model(path, 40.0)


def test_a_fit_that_leaves_degrees_gives_no_advice_and_says_so_first():
    run = simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(3)).run
    found = fit(replace(run, star1=np.roll(run.star1, 1), star2=np.roll(run.star2, 1)), "IH ID")
    print(found.warnings[0])
    assert found.warnings[0].startswith(
        f"the fit leaves {found.sky_rms_arcsec / 3600.0:.3g}° on the sky, possible is"
    )
    with pytest.raises(PointingError, match="possible is up to 1°"):
        polar_alignment(found)
    good = fit(run, "IH ID CH NP MA ME TF")
    assert not any("possible is" in each for each in good.warnings)
    assert polar_alignment(good).text
