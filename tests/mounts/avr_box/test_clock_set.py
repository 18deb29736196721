"""The computer's clock is set while a box goes on by its own."""

from dataclasses import replace

import pytest
from avr_bench import SETTINGS, SIDEREAL, T0, Bench, Line, like

from mounts.avr_box.memory import at_park
from mounts.avr_box.reasons import STEPPED

BLIND = replace(SETTINGS, encoder_counts_per_turn=0)
PROVED = {**at_park((0, 0), T0, ""), "proved": True}


def blind(memory=PROVED):
    bench = Bench(BLIND, like(encoder_counts_per_turn=0), memory)
    bench.connect()
    return bench


def tracked(bench, seconds, rate=1.0):
    bench.follow(Line((bench.read().axes[0].counts, 0.0), (rate * SIDEREAL, 0.0), bench.clock.now()), seconds)
    return bench.read()


@pytest.mark.parametrize("step_s", [3.0, 10.0, 25.0])
@pytest.mark.parametrize("index", [False, True], ids=["switched on", "an index pulse"])
def test_a_clock_that_is_set_while_the_bin_is_small_is_taken_for_no_index_pulse(index, step_s):
    bench = blind()
    if index:
        bench.box.bin = 200
        bench.drive._ticks.forget()
        bench.box._missed[0] = shift = bench.box._worm_steps - 10.0 * SIDEREAL
        bench.box.motors[0].position += round(shift)
        assert not tracked(bench, 15.0).unsynchronised
        assert bench.box.bin < 20
    else:
        tracked(bench, 5.0)
    bench.box._t0 += step_s
    bench.clock.sleep(step_s)
    reading = tracked(bench, 8.0)
    off = abs(reading.axes[0].counts - bench.box.true_position(1))
    print(
        f"\n{off:.0f} microsteps off, stated {reading.axes[0].uncertainty_counts:.0f}; {reading.unsynchronised[:50]}"
    )
    assert reading.unsynchronised == STEPPED
