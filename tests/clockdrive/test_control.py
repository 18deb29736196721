"""One thread does all the work, whatever comes: calls queue, a stop jumps the queue, errors reach who called."""

import threading

import pytest

from clockdrive.clock import SystemClock, VirtualClock
from clockdrive.control import InlineControl, ThreadedControl, control_for
from clockdrive.errors import Refused

SHORT_S = 0.005


@pytest.fixture(params=["thread", "inline"])
def control(request):
    clock = SystemClock() if request.param == "thread" else VirtualClock(0.0)
    made = control_for(clock, lambda: SHORT_S)
    yield made
    made.close()


@pytest.fixture
def threaded():
    made = ThreadedControl(SystemClock(), lambda: SHORT_S)
    yield made
    made.close()


def counted(steps, log):
    for number in range(steps):
        log.append(number)
        yield SHORT_S
    return "done"


def endless(began):
    try:
        while True:
            began.set()
            yield SHORT_S
    finally:
        began.ended = True


def in_the_background(work):
    """Run in a thread; return it and where its outcome will be."""
    outcome = []

    def run():
        try:
            outcome.append(work())
        except Exception as error:  # noqa: BLE001 - it is looked at by the test
            outcome.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    return thread, outcome


def test_the_clock_decides_which_loop():
    assert isinstance(control_for(VirtualClock(0.0), lambda: 1.0), InlineControl)


def test_steps_run_to_their_end_and_return_what_they_return(control):
    log = []
    assert control.perform(counted(3, log)) == "done"
    assert log == [0, 1, 2]


def test_what_a_call_raises_reaches_who_called_and_the_loop_goes_on(control):
    def fail():
        raise ValueError("a fault")

    def failing():
        yield SHORT_S
        raise KeyError("in a step")

    for _ in range(3):
        with pytest.raises(ValueError, match="a fault"):
            control.call(fail)
        with pytest.raises(KeyError, match="in a step"):
            control.perform(failing())
    assert control.call(lambda: 42) == 42


def test_a_step_may_call_and_what_it_interrupts_is_its_own_command(control):
    log = []

    def asking():
        yield SHORT_S
        log.append(control.call(lambda: "asked"))
        with pytest.raises(Refused, match="another command"):
            control.perform(counted(1, log))
        control.interrupt(lambda: log.append("stopped"), "stopped by command")
        log.append("never")

    with pytest.raises(Refused, match="stopped by command"):
        control.perform(asking())
    assert log == ["asked", "stopped"]
    assert control.perform(counted(1, [])) == "done"


def test_a_second_command_is_refused_while_the_first_goes_on(threaded):
    began = threading.Event()
    thread, outcome = in_the_background(lambda: threaded.perform(endless(began)))
    assert began.wait(5.0)
    with pytest.raises(Refused, match=r"another command is moving the telescope.*stop"):
        threaded.perform(counted(1, []))
    threaded.interrupt(lambda: None, "stopped by command")
    thread.join(5.0)
    assert str(outcome[0]) == "stopped by command"
    assert began.ended


def test_a_stop_is_done_before_the_calls_that_wait(threaded):
    order, at_work, go_on = [], threading.Event(), threading.Event()

    def long():
        at_work.set()
        go_on.wait(5.0)

    waiting = [in_the_background(lambda: threaded.call(long))[0]]
    assert at_work.wait(5.0)
    waiting += [in_the_background(lambda: threaded.call(lambda: order.append("call")))[0] for _ in range(3)]
    while len(threaded._calls) < 3:
        pass
    waiting.append(in_the_background(lambda: threaded.interrupt(lambda: order.append("stop"), "stopped"))[0])
    while not threaded._urgent:
        pass
    go_on.set()
    for thread in waiting:
        thread.join(5.0)
    assert order == ["stop", "call", "call", "call"]


def test_the_background_goes_on_after_any_fault(caplog):
    cycles, enough = [], threading.Event()

    def cycle():
        cycles.append(len(cycles))
        if len(cycles) == 1:
            raise RuntimeError("a fault of the program")
        enough.set()
        return SHORT_S

    control = ThreadedControl(SystemClock(), cycle)
    try:
        assert enough.wait(5.0)
        assert control.call(lambda: "alive") == "alive"
    finally:
        control.close()
    assert "the background cycle failed" in caplog.text


def test_closing_ends_the_command_under_way_and_refuses_the_next(threaded):
    began = threading.Event()
    thread, outcome = in_the_background(lambda: threaded.perform(endless(began)))
    assert began.wait(5.0)
    threaded.close()
    thread.join(5.0)
    assert str(outcome[0]) == "the telescope was closed"
    assert began.ended
    with pytest.raises(Refused, match="closed; open it again"):
        threaded.call(lambda: None)
    threaded.close()


def test_virtual_time_passes_through_every_cycle_that_is_due():
    clock, times = VirtualClock(100.0), []

    def cycle():
        times.append(clock.now())
        clock.sleep(0.25)
        return 1.0

    control = InlineControl(clock, cycle)
    control.let_pass(3.5)
    assert times == [100.0, 101.0, 102.0, 103.0]
    assert clock.now() == 103.5
    control.let_pass(-1.0)
    assert clock.now() == 103.5


def test_callers_without_end_do_not_keep_the_telescope_from_being_looked_at():
    looks = []

    def look():
        looks.append(threading.current_thread().name)
        return SHORT_S

    control = ThreadedControl(SystemClock(), look)
    busy = threading.Event()

    def call_again_and_again():
        while not busy.is_set():
            control.call(lambda: busy.wait(2.0 * SHORT_S))

    callers = [threading.Thread(target=call_again_and_again) for _ in range(4)]
    for caller in callers:
        caller.start()
    began = len(looks)
    for _ in range(20):
        control.call(lambda: None)
    seen = len(looks) - began
    busy.set()
    for caller in callers:
        caller.join()
    control.close()
    print(f"{seen} looks while 20 calls waited behind four callers without end")
    assert seen >= 20
