"""A clock that is set is found; one that is merely corrected by running differently is not."""

import pytest

from clockdrive.clock_watch import ClockWatch, running_time


class Clocks:
    """A clock that can be set, and one that cannot; reading either takes `reading_s`."""

    def __init__(self, reading_s=0.0):
        self.true = 0.0
        self.offset = 1_780_000_000.0
        self.rate = 1.0
        self.reading_s = reading_s

    def now(self):
        self.true += self.reading_s
        return self.offset + self.true * self.rate

    def running(self):
        self.true += self.reading_s
        return self.true


@pytest.mark.parametrize("step", [2.4, -2.4, 0.11, -0.11, 3600.0, -86400.0])
def test_a_step_is_found_once_with_its_size(step):
    clocks = Clocks()
    watch = ClockWatch(clocks.now, clocks.running)
    clocks.true += 1.0
    assert watch.look() is None
    clocks.true += 0.5
    clocks.offset += step
    clocks.true += 0.5
    found = watch.look()
    assert found.step_s == pytest.approx(step, abs=1e-6)
    assert found.after - found.before == pytest.approx(1.0 + step, abs=1e-6)
    clocks.true += 1.0
    assert watch.look() is None


@pytest.mark.parametrize("step", [0.09, -0.09, 0.0])
def test_less_than_a_tenth_of_a_second_is_no_step(step):
    clocks = Clocks()
    watch = ClockWatch(clocks.now, clocks.running)
    clocks.offset += step
    assert watch.look() is None


@pytest.mark.parametrize("ppm", [-500.0, 500.0])
def test_a_clock_that_is_slewed_for_a_night_is_not_stepped(ppm):
    clocks = Clocks()
    clocks.rate = 1.0 + ppm * 1e-6
    watch = ClockWatch(clocks.now, clocks.running)
    for number in range(2000):
        clocks.true += (0.1, 1.0, 60.0, 600.0)[number % 4]
        assert watch.look() is None


def test_a_reading_that_was_interrupted_is_taken_again():
    clocks = Clocks()
    watch = ClockWatch(clocks.now, clocks.running)
    interruptions = iter([3.0])

    def interrupted():
        now = clocks.now()
        clocks.true += next(interruptions, 0.0)
        return now

    watch._now = interrupted
    assert watch.look() is None
    assert next(interruptions, None) is None


def test_a_computer_on_which_every_reading_takes_long_invents_no_step():
    clocks = Clocks(reading_s=0.3)
    watch = ClockWatch(clocks.now, clocks.running)
    for _ in range(10):
        clocks.true += 1.0
        assert watch.look() is None


def test_the_sentence_gives_the_step_the_bound_and_the_sky():
    clocks = Clocks()
    watch = ClockWatch(clocks.now, clocks.running)
    clocks.offset += 2.4
    text = watch.look().during("the slew to M1")
    print(text)
    assert text.startswith("the clock was stepped by +2.4 s during the slew to M1")
    assert "0.1 s" in text
    assert "36″" in text
    assert "goto" in text


def test_the_clocks_of_this_computer_agree():
    watch = ClockWatch()
    assert [watch.look() for _ in range(100)] == [None] * 100
    assert running_time() <= running_time()
