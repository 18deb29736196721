"""The asking side against a scripted far end, which shares nothing with the simulator."""

import contextlib
from collections import deque

import pytest
from faults import Fault, FaultMachine, FaultyLink, by_chance

from clockdrive.clock import VirtualClock
from mounts.apo.commands import command
from mounts.apo.controller import AXIS_WORDS, Controller
from mounts.apo.errors import CommandRefused, MalformedReply
from mounts.apo.line import Line, Request
from transports.errors import LinkError, NoAnswer, WrongAnswer
from transports.memory import MemoryLink

T0 = 1_800_000_000.0


class Numbered:
    """Answers every command by its echo and its own number, so that an answer tells to which asking it belongs."""

    def __init__(self) -> None:
        self.asked: list[str] = []

    def receive(self, data: bytes, t: float) -> bytes:
        del t
        text = data.decode("ascii").strip()
        self.asked.append(text)
        return f"{text}\r\n{len(self.asked)}.0 0.00000 100.000 0 0.0 OK\r\n".encode("ascii")


class Scripted:
    """Answers with what it is handed, one piece for each line; then as `Numbered`."""

    def __init__(self, *answers: bytes | None) -> None:
        self.answers = deque(answers)
        self.unit = Numbered()

    def receive(self, data: bytes, t: float) -> bytes:
        answer = self.unit.receive(data, t)
        scripted = self.answers.popleft() if self.answers else None
        return answer if scripted is None else scripted


def bench(device, plan=(), **settings):
    clock = VirtualClock(T0)
    machine = FaultMachine(plan)
    opened = []

    def open_link():
        opened.append(clock.now())
        return FaultyLink(MemoryLink(device, clock), clock, machine)

    line = Line(open_link, clock, **settings)
    line.opened, line.clock = opened, clock
    return line


def test_an_answer_carries_its_times():
    line = bench(Numbered())
    answer = line.ask(Request("STATUS"))
    assert answer.reply.lines == ("1.0 0.00000 100.000 0 0.0",)
    assert answer.asked <= answer.sent <= answer.received < answer.asked + 0.2


def test_a_wrong_echo_is_never_an_answer_and_an_unrepeatable_command_is_sent_once():
    device = Scripted(b"MOVE 9.0\r\nOK\r\n")
    line = bench(device)
    with pytest.raises(WrongAnswer, match=r"echoed as 'MOVE 9\.0'.*obeyed"):
        line.ask(Request("MOVE 1.0 2.0 3.0", repeatable=False))
    assert device.unit.asked == ["MOVE 1.0 2.0 3.0"]


def test_an_echo_in_other_blanks_and_case_is_the_same():
    line = bench(Scripted(b"move  1.0 \r\n OK\r\n"))
    assert line.ask(Request("MOVE 1.0")).reply.ok


def test_a_repeatable_command_is_asked_again_after_silence():
    device = Numbered()
    line = bench(device, [Fault.DROP])
    assert line.ask(Request("DRIFT")).reply.lines[0].startswith("3.0")
    assert device.asked == ["DRIFT", "ID", "DRIFT"]


def test_silence_is_told_within_the_deadline():
    line = bench(Scripted(*[b""] * 9))
    with pytest.raises(NoAnswer, match=r"no answer within 0\.5 s"):
        line.ask(Request("STATUS"))
    assert line.clock.now() - T0 < 2.0 + 0.5


def test_a_late_answer_is_never_taken_for_the_next_of_the_same_command():
    """STATUS after STATUS is the case in which the echo tells nothing."""
    device = Numbered()
    line = bench(device, [Fault.DELAY])
    for _ in range(5):
        answer = line.ask(Request("STATUS"))
        assert float(answer.reply.lines[0].split()[0]) == len(device.asked)


def test_a_late_answer_that_outlives_the_connection_is_passed_over():
    """A terminal server keeps what the controller says, and hands it to the next connection."""

    class Server:
        def __init__(self) -> None:
            self.unit, self.kept, self.count = Numbered(), b"", 0

        def receive(self, data: bytes, t: float) -> bytes:
            self.count += 1
            come, answer = self.kept, self.unit.receive(data, t)
            self.kept = b""
            if self.count == 1:
                self.kept = answer
                return b""
            return come + answer

    server = Server()
    answer = bench(server).ask(Request("STATUS"))
    assert server.unit.asked == ["STATUS", "ID", "STATUS"]
    assert answer.reply.lines[0].startswith("3.0")


def test_where_no_marker_is_left_the_line_must_be_quiet_for_a_whole_time_out():
    device = Numbered()
    line = bench(device, [Fault.DROP] * 3, deadline_s=9.0)
    assert line.ask(Request("ID", markers=("ID",))).reply.lines[0].startswith("4.0")
    gaps = [after - before for before, after in zip(line.opened, line.opened[1:], strict=False)]
    assert min(gaps) >= 0.5


@pytest.mark.parametrize("fault", list(Fault))
def test_every_fault_is_survived_and_no_answer_is_anothers(fault):
    device = Numbered()
    line = bench(device, by_chance(5, 0.3, (fault,)))
    heard = failed = 0
    for count in range(200):
        text = ("STATUS", "DRIFT", f"MOVE 1.0 0.0 {count}.0")[count % 3]
        try:
            answer = line.ask(Request(text, repeatable=count % 3 < 2))
        except (NoAnswer, WrongAnswer, LinkError):
            failed += 1
            line.clock.sleep(0.2)
            continue
        heard += 1
        assert answer.reply.echo == text
        if fault not in {Fault.GARBLE, Fault.WRONG}:  # a digit may be garbled; an older STATUS may be made to come
            assert float(answer.reply.lines[0].split()[0]) == len(device.asked)
    print(f"{fault}: {heard} heard, {failed} failed, {len(line.opened)} connections")
    assert heard > 100


def test_a_node_is_never_sent_twice_whatever_happens():
    for seed in range(20):
        device = Numbered()
        line = bench(device, by_chance(seed, 0.5))
        for count in range(40):
            with contextlib.suppress(NoAnswer, WrongAnswer, LinkError):
                line.ask(Request(f"MOVE 1.0 0.0 {count}.0", repeatable=False))
        nodes = [text for text in device.asked if text.startswith("MOVE")]
        assert len(nodes) == len(set(nodes))


def test_a_link_that_cannot_be_opened_is_told_with_the_remedy():
    clock = VirtualClock(T0)

    def refused():
        raise LinkError("tcp://1.2.3.4:5: cannot connect")

    line = Line(refused, clock)
    with pytest.raises(LinkError, match="check cable and power"):
        line.ask(Request("STATUS"))
    assert 1.0 < clock.now() - T0 < 2.5


def test_a_half_open_connection_is_opened_anew():
    """The far end has forgotten the connection: nothing comes until it is opened again."""
    clock, device = VirtualClock(T0), Numbered()

    class Mute:
        def receive(self, data: bytes, t: float) -> bytes:
            del data, t
            return b""

    links = iter([Mute(), device])
    line = Line(lambda: MemoryLink(next(links), clock), clock)
    assert line.ask(Request("STATUS")).reply.ok


def test_babble_is_told_as_such():
    class Babble:
        def __init__(self, clock) -> None:
            self.clock, self.name = clock, "serial:///dev/null"

        def write(self, data: bytes) -> float:
            del data
            return self.clock.now()

        def read(self, max_bytes: int, timeout_s: float) -> bytes:
            del timeout_s
            self.clock.sleep(0.01)
            return b"\xff" * min(max_bytes, 10)

        def close(self) -> None:
            pass

    clock = VirtualClock(T0)
    with pytest.raises(LinkError, match="does not fall silent"):
        Line(lambda: Babble(clock), clock).ask(Request("STATUS"))


def test_a_long_answer_gets_its_line_time():
    clock = VirtualClock(T0)

    class Long:
        def receive(self, data: bytes, t: float) -> bytes:
            del t
            return data + b"\n" + b"1.0 2.0 3.0 4.0 0 0.0\r\n" * 80 + b"OK\r\n"

    line = Line(lambda: MemoryLink(Long(), clock, baud=9600), clock, baud=9600)
    controller = Controller(line, "apo")
    assert len(controller.fiducials()) == 80
    assert clock.now() - T0 > 1.9


# The controller --------------------------------------------------------------------------------------------------


def test_what_is_refused_raises_with_the_controllers_own_words():
    controller = Controller(bench(Scripted(b"MOVE 1.000000000000\r\nERR: look out OK\r\n")), "apo")
    with pytest.raises(CommandRefused, match="look out") as refusal:
        controller.tell("MOVE", 1.0)
    assert refusal.value.reason == "look out"


def test_values_come_with_the_times_between_which_they_were_taken():
    controller = Controller(bench(Numbered()), "apo")
    timed = controller.status()
    assert timed.value.position_deg == 1.0
    assert timed.sent < timed.received
    with pytest.raises(MalformedReply):
        controller.drift()


@pytest.mark.parametrize("select", ["prefix", "line"])
def test_three_axes_share_a_line_each_by_its_word(select):
    device = Numbered()
    line = bench(device)
    axes = [Controller(line, "sdss", word, axis_select=select) for word in AXIS_WORDS]
    for axis in axes:
        axis.tell("MOVE", 1.0)
    move = "MOVE 1.000000000000"
    expected = (
        [f"{word} {move}" for word in AXIS_WORDS] if select == "prefix" else ["AZ", move, "ALT", move, "ROT", move]
    )
    assert device.asked == expected
    assert axes[2].name == "sim: ROT"


def test_after_a_doubt_the_axis_is_selected_anew():
    device = Numbered()
    line = bench(device, [None, Fault.DROP])
    Controller(line, "sdss", "ALT", axis_select="line").status()
    assert device.asked[-2:] == ["ALT", "STATUS"]


def test_the_limits_go_by_the_name_that_is_configured():
    device = Numbered()
    controller = Controller(bench(device), "apo", limits_command="SET.LIMIT")
    controller.tell("SET.LIMITS", 6.0, 85.0)
    assert device.asked == ["SET.LIMIT 6.000000000000 85.000000000000"]
    assert controller.line_time(command("STATUS")) == 0.0
