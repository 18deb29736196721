"""How long a slew takes: sums over the table against the simulated timers, which step cycle by cycle."""

import os
import random

import pytest
from avr_bench import coarser_table

from mounts.avr_box.simulator_motor import Motor
from mounts.avr_box.slew_table import ENTRIES, SlewLaw, SlewTableError, checked, laws, read_slew_table, standard
from mounts.avr_box.timers import CRYSTAL_HZ, SLEW_GEARS

MOVES = 10_000 if os.environ.get("CLOCKDRIVE_CAMPAIGN") == "full" else 1_000


def stepped(law: SlewLaw, half: int) -> int:
    """Cycles that the motor of the simulator takes, from its own stepping."""
    motor = Motor(law.table, law.gears.low, law.gears.high)
    motor.begin(half, 1)
    given = 1 << 50
    return given - motor.run(given)


@pytest.mark.campaign
@pytest.mark.parametrize("table", [standard(), coarser_table()], ids=["standard", "stairs"])
def test_the_predicted_duration_of_any_move_is_that_of_the_timers(table):
    rng, worst = random.Random(8), 0.0  # noqa: S311
    pairs = laws(table)
    for _ in range(MOVES):
        law = rng.choice(pairs)
        half = round(10.0 ** rng.uniform(0.0, 6.3))
        worst = max(worst, abs(law.cycles(half) - stepped(law, half)) / CRYSTAL_HZ)
    print(f"{MOVES} moves: the worst prediction is {worst * 1e3:.6f} ms off")
    assert worst < 1e-3


@pytest.mark.parametrize("half", [1, 2, 15, 1023, 1024, 1025, 1040, 16383, 16384, 16385, 200_000])
def test_a_whole_move_up_and_down_takes_what_is_predicted_to_the_cycle(half):
    for law in laws(coarser_table()):
        assert stepped(law, half) == law.cycles(half)


def test_the_standard_table_accelerates_as_the_manual_says():
    one, two = laws(standard())
    assert standard()[-1] == 15
    assert one.fastest == pytest.approx(15625.0)
    assert two.fastest == pytest.approx(7812.5)
    assert one.climb_cycles(16384) / CRYSTAL_HZ == pytest.approx(2.08, abs=0.03)
    assert two.climb_cycles(16384) / CRYSTAL_HZ == pytest.approx(4.16, abs=0.06)


@pytest.mark.parametrize("half", [1, 700, 5000, 40_000])
def test_where_a_move_is_at_any_moment_is_where_the_motor_is(half):
    rng = random.Random(half)  # noqa: S311
    law = SlewLaw(standard(), SLEW_GEARS[1])
    for cycles in sorted(rng.randrange(law.cycles(half) + 1000) for _ in range(60)):
        motor = Motor(law.table, law.gears.low, law.gears.high)
        motor.begin(half, 1)
        motor.run(cycles)
        assert motor.position == law.made(half, cycles)


def test_the_longest_move_within_a_time_ends_within_it_and_the_next_one_does_not():
    for law in laws(standard()):
        for seconds in (0.1, 1.0, 2.0, 30.0):
            half = law.half_within(round(seconds * CRYSTAL_HZ))
            assert law.cycles(half) <= seconds * CRYSTAL_HZ < law.cycles(half + 1)


@pytest.mark.parametrize(
    ("table", "said"),
    [
        (standard()[:-1], "1023 entries"),
        ((*standard()[:-1], 256), "a byte is 0 to 255"),
        ((*standard()[:500], 255, *standard()[501:]), "a slew only gets faster"),
        ((0,) * ENTRIES, "no motor follows"),
    ],
)
def test_a_broken_table_is_refused_with_what_is_wrong(table, said):
    with pytest.raises(SlewTableError, match=said):
        checked(table)


def test_a_table_is_read_from_a_file_with_remarks(tmp_path):
    path = tmp_path / "table.txt"
    path.write_text("# mine\n" + ",\n".join(map(str, standard())))
    assert read_slew_table(path) == standard()
    path.write_text("1, two")
    with pytest.raises(SlewTableError, match="no whole numbers"):
        read_slew_table(path)
    with pytest.raises(SlewTableError, match="cannot be read"):
        read_slew_table(tmp_path / "none.txt")
