"""A link that is kept: opened once, opened anew after a doubt, and given up with a remedy."""

import pytest

from clockdrive.clock import VirtualClock
from transports.errors import LinkError, NoAnswer
from transports.kept_link import REOPEN_PAUSE_S, KeptLink, LinkAtNeed
from transports.memory import MemoryLink

T0 = 1_800_000_000.0


class Babbling:
    """Something that never falls silent."""

    name = "babble"

    def __init__(self, clock):
        self.clock = clock

    def read(self, max_bytes, timeout_s):
        self.clock.sleep(timeout_s / 2.0)
        return b"x" * min(max_bytes, 3)

    def close(self):
        pass


class Bench:
    def __init__(self, refusals=0):
        self.clock, self.opened, self.settled, self.refusals = VirtualClock(T0), 0, 0, refusals
        self.kept = KeptLink(self.open, self.clock, deadline_s=2.0, remedy="plug it in")

    def open(self):
        if self.refusals:
            self.refusals -= 1
            raise LinkError("sim: nobody there")
        self.opened += 1
        return MemoryLink(None, self.clock)

    def settle(self, _):
        self.settled += 1

    def in_step(self, *, clear=True):
        return self.kept.in_step(lambda _: clear, self.settle, self.clock.now() + 1.0)


def test_a_clear_link_is_kept_and_settled_once():
    bench = Bench()
    assert bench.in_step() is bench.in_step()
    assert (bench.opened, bench.settled, bench.kept.name) == (1, 1, "sim:")


def test_a_link_that_is_not_clear_is_opened_anew():
    bench = Bench()
    assert bench.in_step() is not bench.in_step(clear=False)
    assert (bench.opened, bench.settled) == (2, 2)


def test_opening_is_tried_again_until_the_deadline_and_then_refused_with_a_remedy():
    bench = Bench(refusals=5)
    bench.in_step()
    assert bench.clock.now() - T0 == pytest.approx(5 * REOPEN_PAUSE_S)
    bench = Bench(refusals=50)
    with pytest.raises(LinkError, match="nobody there; tried for 2 s: plug it in"):
        bench.in_step()
    assert bench.clock.now() - T0 <= 1.0


def test_what_settling_raises_is_for_whoever_asks_but_a_lost_link_is_opened_again():
    bench, raised = Bench(), iter([LinkError("lost"), NoAnswer("nothing")])

    def settle(_):
        raise next(raised)

    with pytest.raises(NoAnswer):
        bench.kept.in_step(lambda _: True, settle, T0 + 1.0)
    assert bench.opened == 2


def test_a_line_that_never_falls_silent_is_not_waited_for():
    bench = Bench()
    with pytest.raises(LinkError, match="babble: the line does not fall silent"):
        list(bench.kept.drained(Babbling(bench.clock), 0.1, T0 + 1.0))
    assert bench.clock.now() - T0 < 1.2


def test_a_link_at_need_is_opened_once_until_it_is_closed_and_says_when_it_is_another():
    bench, renewed = Bench(), []
    link = LinkAtNeed(bench.open, lambda: renewed.append(bench.opened))
    assert (link.name, bench.opened) == ("link not opened yet", 0)
    assert link.opened() is link.opened()
    link.close()
    link.close()
    name = link.name
    assert link.opened().name == name
    assert (bench.opened, renewed) == (2, [1, 2])
