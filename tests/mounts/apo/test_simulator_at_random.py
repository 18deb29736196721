"""Whatever is typed and whatever befalls, a simulated axis moves as an axis can."""

import random

import pytest

from mounts.apo.replies import ReplyDecoder
from mounts.apo.simulator import SimulatedObservatory
from mounts.apo.simulator_settings import SimulatorSettings

T0 = 1_800_000_000.0
STEP_S = 1.0 / 16.0  # exact in POSIX seconds, so that differences are exact too
WORDS = ("MOVE", "DRIFT", "INIT", "STOP", "P", "+ 2", "- 1", "STEP 0.3", "MS.ON", "STATUS", "CORRECT")
ABRUPT = 5.0  # times the acceleration, as the manual's emergency stop is here


def something(chance: random.Random, count: float, position: float, node: list[float]) -> str:
    """A line to type; nodes go on from where the last one was."""
    kind = chance.choice(("move", "line", "node", "node", "node", "node", "offset", "word", "limit"))
    if kind == "move":
        return f"MOVE {chance.uniform(-250, 450):.6f}"
    if kind == "line":
        return f"MOVE {position + chance.uniform(-3, 3):.6f} {chance.uniform(-3, 3):.6f}"
    if kind == "offset":
        return f"+MOVE {chance.uniform(-0.5, 0.5):.6f} {chance.choice((0.0, 0.001))}"
    if kind == "limit":
        return f"MAXV {chance.uniform(0.3, 1.75):.3f}"
    if kind == "word":
        return chance.choice(
            ("MOVE", "DRIFT", "INIT", "STOP", "P", "+ 2", "- 1", "STEP 0.3", "MS.ON", "STATUS", "CORRECT")
        )
    ahead = chance.uniform(-0.5, 6.0)
    node[0] = max(node[0], count) + ahead
    node[1] += chance.uniform(-0.3, 0.3)
    return f"MOVE {node[1]:.9f} {chance.uniform(-0.3, 0.3):.9f} {(28_837.0 + node[0]) % 86_400.0:.9f}"


def befall(axis, chance: random.Random, t: float) -> None:
    match chance.choice(("stop", "restart", "switch", "release")):
        case "stop":
            axis.fail("stop_button")
        case "restart":
            axis.restart(t)
        case "switch":
            axis.press_limit(chance.choice((-1, 1)))
        case "release":
            axis.release_limits()


@pytest.mark.parametrize("seed", range(10))
def test_velocity_acceleration_and_limits_hold_whatever_is_typed(seed):
    chance = random.Random(seed)  # noqa: S311
    settings = SimulatorSettings(
        on_expiry=chance.choice(("halt", "extrapolate")), first_node=chance.choice(("wait", "join")), boot_s=1.0
    )
    unit = SimulatedObservatory("apo", settings, T0, positions=(chance.choice((-179.0, 90.0, 359.0)), 40.0, 0.0))
    axis, line, decoder = unit.axes[0], unit.lines[0], ReplyDecoder()
    node = [0.0, axis.servo.position]
    places = [axis.true_position()]
    fastest = hardest = 0.0
    for step in range(1, 6_000):
        t = T0 + step * STEP_S
        if chance.random() < 0.01:
            if chance.random() < 0.3:
                node = [step * STEP_S, axis.servo.position]
            decoder.feed(line.receive((something(chance, step * STEP_S, places[-1], node) + "\r").encode(), t))
        if chance.random() < 0.0005:
            befall(axis, chance, t)
        if chance.random() < 0.001:
            axis.repair("stop_button")
            line.receive(b"INIT\r", t)
        axis.advance(t)
        places.append(axis.true_position())
        velocity = (places[-1] - places[-2]) / STEP_S
        fastest = max(fastest, abs(velocity))
        if step > 1:
            hardest = max(hardest, abs(velocity - (places[-2] - places[-3]) / STEP_S) / STEP_S)
    print(
        f"seed {seed}: {fastest:.3f} deg/s, {hardest:.3f} deg/s², {min(places):.2f} to {max(places):.2f}°, "
        f"{axis.record.nodes} nodes, {len(axis.record.dry)} dry, {len(axis.record.refused)} refused"
    )
    assert fastest <= 1.75 * (1 + 1e-6)
    assert hardest <= 0.1 * ABRUPT * (1 + 1e-6)
    assert -181.0 - 3.1 < min(places) <= max(places) < 361.0 + 3.1  # a switch, and 1.75² / (2 · 0.5)
