"""The few lines that a notebook needs, from the packages themselves."""

import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from pointing.model.tpoint_file import write_tpoint

mpl.use("Agg")


def test_read_fit_and_draw_in_three_lines(tmp_path):
    import matplotlib.pyplot as plt

    from pointing import PointingModel, Site, fit, read_tpoint

    write_tpoint(simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run, tmp_path / "run.dat")
    run = read_tpoint(tmp_path / "run.dat", places="observed")
    result = fit(run, "IH ID CH NP MA ME TF")
    axes = result.plot_residuals()
    assert axes.shape == (3, 3)
    assert isinstance(result.model, PointingModel)
    assert Site.from_degrees(40.0, 10.0, 0.0).latitude == pytest.approx(run.latitude)
    plt.close(axes[0, 0].figure)


def test_the_application_exports_the_same():
    import clockdrive
    import pointing

    assert set(pointing.__all__) <= set(clockdrive.__all__)
    for name in pointing.__all__:
        assert getattr(clockdrive, name) is getattr(pointing, name)


def test_the_words_of_a_command_line_cost_no_mathematics():
    code = (
        "import sys; from pointing.model.words import PLACES, POLES; print(*PLACES, *POLES);"
        "print([name for name in ('numpy', 'erfa', 'astropy') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout == "apparent icrs observed true refracted\n[]\n"


def test_a_fit_loads_neither_astropy_nor_matplotlib():
    code = (
        "import sys; from pointing import fit, PointingRun;"
        "run = PointingRun.from_degrees('altazimuth', 40.0, [0, 90, 200], [30, 40, 50], [0, 90, 200], [30, 40, 50]);"
        "repr(fit(run, 'IA IE')); fit(run, 'IA IE').warnings;"
        "print([name for name in ('astropy.coordinates', 'astropy.table', 'matplotlib') if name in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert run.stdout == "[]\n"
