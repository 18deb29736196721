"""The table of the periodic error, driven by the simulated timers against a worm whose error is known."""

import math
import random

import numpy as np
import pytest
from avr_bench import RA_ARCSEC, SIDEREAL, STEPS_PER_TURN, T0, like

from clockdrive.configuration import load
from clockdrive.drives.avr_box.pec_table import pec_table
from mounts.avr_box.pec import PecError, PeriodicError, as_assembler, as_c, fitted, read_measured, table
from mounts.avr_box.simulator import SimulatedAvrBox
from mounts.avr_box.timers import TICK_S

WORM_STEPS = STEPS_PER_TURN[0] / 360.0
WORM_S = WORM_STEPS / SIDEREAL
WORM = PeriodicError((110.0, -20.0, 6.0), (-60.0, 35.0, 4.0))  # microsteps: 6.8″ and 2.2″, 0.4″


def residuals(values):
    """By how many arcseconds the telescope is ahead, over two turns of the worm, with a table in the box."""
    unit = SimulatedAvrBox(like(pec_table=values), T0, STEPS_PER_TURN, WORM_STEPS)
    found = []
    for t in np.arange(0.0, 2.0 * WORM_S, 0.7):
        unit.advance(T0 + float(t))
        made = unit.true_position(1)
        found.append((made + WORM.at(math.tau * made / WORM_STEPS) - WORM.at(0.0) - SIDEREAL * t) * RA_ARCSEC)
    return np.asarray(found) - np.mean(found)


def test_a_table_of_measured_errors_takes_a_worm_of_seven_arcseconds_below_a_third_of_one():
    chance = random.Random(5)  # noqa: S311 - nothing secret
    times = [1.5 * k for k in range(500)]
    ahead = [WORM.at(math.tau * t / WORM_S) + 0.4 * t + chance.gauss(0.0, 6.0) for t in times]  # 0.3″ of seeing
    error = fitted(times, ahead, WORM_S)
    assert error.drift == pytest.approx(0.4, abs=0.01)
    before, after = residuals((225,) * 519), residuals(table(error, SIDEREAL, WORM_S))
    print(f"\nperiodic error {np.std(before):.2f}″ RMS without, {np.std(after):.3f}″ RMS with the table")
    assert np.std(after) < 0.33
    assert np.ptp(after) < 1.5


def test_without_an_error_the_table_makes_the_sidereal_rate_of_neighbouring_divisors():
    values = table(PeriodicError((), ()), SIDEREAL, WORM_S)
    assert set(values) == {224, 225}
    made = sum(16e6 / 256 / (value + 1) * TICK_S for value in values)
    assert made == pytest.approx(SIDEREAL * 519 * TICK_S, abs=0.6)  # half of a step of the rate for one bin


@pytest.mark.parametrize(
    ("times", "said"),
    [(range(10), "looks for 10 unknowns"), (range(200), "less than a turn"), ([math.nan] * 400, "no number")],
)
def test_too_little_is_refused_with_what_is_wanted(times, said):
    with pytest.raises(PecError, match=said):
        fitted(list(times), [0.0] * len(list(times)), WORM_S)


@pytest.mark.parametrize("harmonics", [0, -1, 51])
def test_harmonics_that_are_none_or_too_many_are_refused_with_their_range(harmonics):
    times = [0.5 * i for i in range(2000)]
    with pytest.raises(PecError, match="give 1 to 50"):
        fitted(times, [0.0] * len(times), 240.0, harmonics)


def test_an_error_that_no_divisor_follows_is_refused():
    with pytest.raises(PecError, match=r"bin \d+ wants"):
        table(PeriodicError((40_000.0,), (0.0,)), SIDEREAL, WORM_S)


def test_the_firmware_is_given_519_numbers_in_either_language():
    values = tuple(range(200, 256)) * 9 + tuple(range(200, 215))
    c, assembler = as_c(values), as_assembler(values)
    assert c.startswith("const uint8_t PEC_table[519] PROGMEM = {\n    200, 201")
    for text in (c.partition("{")[2].partition("}")[0], assembler.replace("PEC_table:", "").replace(".balign 2", "")):
        assert tuple(int(word) for word in text.replace(".byte", ",").replace(",", " ").split()) == values


def test_a_file_of_measurements_is_read_and_a_wrong_line_is_named(tmp_path):
    path = tmp_path / "worm.txt"
    path.write_text("# bin arcsec\n0, 1.5\n\n3 -2\n")
    assert read_measured(path) == ([0.0, 3.0], [1.5, -2.0])
    path.write_text("0 1\n2 x\n")
    with pytest.raises(PecError, match="line 2"):
        read_measured(path)
    path.write_text("0 1\n\n2 60000\n")
    with pytest.raises(PecError, match=r"line 3: '2 60000' .* at most ±3600″"):
        read_measured(path)
    path.write_text("nan 1\n")
    with pytest.raises(PecError, match="line 1"):
        read_measured(path)
    with pytest.raises(PecError, match="cannot be read"):
        read_measured(tmp_path / "none")


def test_ten_turns_measured_with_pec_off_are_fitted_by_the_rate_of_that_time(tmp_path):
    bins, worm = range(0, 5190, 7), tmp_path / "worm.txt"
    turned = [math.tau * k * TICK_S * 276.548673 / WORM_STEPS for k in bins]  # 16 MHz / 128 / 226 / 2
    ahead = [6.0 * math.cos(each) + 3.0 * math.sin(2.0 * each) for each in turned]
    worm.write_text("".join(f"{k} {a:.6f}\n" for k, a in zip(bins, ahead, strict=True)))
    found = pec_table(load(None, {}, {"drive.kind": "avr-box"}), str(worm)).json
    print(f"\n{found['rms_arcsec']:.4f}″ RMS are left of 4.74″")
    assert found["rms_arcsec"] < 0.001
    assert found["amplitudes_arcsec"][:2] == pytest.approx([6.0, 3.0], abs=0.001)
