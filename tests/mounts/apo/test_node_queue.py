"""What is left of an axis's path: where it leads, how long it lasts."""

import pytest

from mounts.apo.node_queue import NodeQueue, PathNode, between

LINE = PathNode(100.0, 10.0, 0.5)
NODES = (PathNode(102.0, 11.0, 0.5), PathNode(104.0, 13.0, 1.0), PathNode(109.0, 17.0, 0.0))


def queue() -> NodeQueue:
    made = NodeQueue()
    made.begin(LINE)
    for node in NODES:
        made.append(node)
    return made


def manual_cubic(one: PathNode, two: PathNode, time: float) -> float:
    """The manual's own words: with v̄ = Δx/dt, a = (2/dt)(3v̄ − 2v_i − v_f), j = (6/dt²)(v_i + v_f − 2v̄)."""
    dt, u = two.time - one.time, time - one.time
    mean = (two.position - one.position) / dt
    a = 2.0 / dt * (3.0 * mean - 2.0 * one.velocity - two.velocity)
    j = 6.0 / dt**2 * (one.velocity + two.velocity - 2.0 * mean)
    return one.position + one.velocity * u + a * u**2 / 2.0 + j * u**3 / 6.0


def test_between_two_nodes_it_is_the_manuals_cubic():
    for k in range(11):
        time = 104.0 + 0.5 * k
        assert between(NODES[1], NODES[2], time)[0] == pytest.approx(manual_cubic(*NODES[1:], time), abs=1e-12)


def test_the_drift_goes_on_until_the_first_node():
    assert queue().at(101.0) == pytest.approx((10.5, 0.5))


def test_nothing_is_known_behind_the_last_node():
    assert queue().at(109.0) == (17.0, 0.0)
    assert queue().at(109.001) is None


def test_a_path_whose_beginning_is_forgotten_is_still_the_same():
    forgotten = queue()
    forgotten.forget_before(105.0 + 10.0)
    assert forgotten.at(101.0) is None
    assert forgotten.at(106.0) == queue().at(106.0)
    assert forgotten.ends == 109.0


def test_nodes_to_come_are_counted():
    assert [queue().pending(time) for time in (100.0, 102.0, 103.0, 108.0, 110.0)] == [3, 2, 2, 1, 0]
    assert queue().ahead(103.0) == NODES[1:]


def test_a_displacement_moves_all_of_it():
    moved = queue()
    moved.shift(0.25)
    for time in (100.5, 103.0, 107.0):
        assert moved.at(time)[0] - queue().at(time)[0] == pytest.approx(0.25)


def test_after_a_halt_nothing_is_left():
    halted = queue()
    halted.clear()
    assert not halted.is_path
    assert halted.last is None
    assert halted.at(103.0) is None
    assert halted.ends < 0.0


def test_a_path_that_comes_earlier_is_the_same_at_earlier_times():
    queue = NodeQueue()
    for k in range(3):
        queue.append(PathNode(100.0 + 5.0 * k, 7.0 + k * k, 0.1 * k))
    before = queue.at(107.0)
    queue.retime(-0.25)
    assert queue.at(106.75) == pytest.approx(before)
    assert queue.ends == 109.75
    assert queue.pending(104.8) == 1


def test_a_path_cruises_where_its_velocity_stays_for_long_enough():
    queue = NodeQueue()
    for time, position, velocity in ((0.0, 0.0, 0.0), (2.0, 1.0, 1.0), (12.0, 11.0, 1.0), (14.0, 12.0, 0.0)):
        queue.append(PathNode(100.0 + time, position, velocity))
    assert [queue.cruises(100.0 + time, 3.0) for time in (-1.0, 1.0, 5.0, 10.0, 13.0, 15.0)] == [
        *(False, False, True, False, False, False)
    ]
    assert not queue.rests_from(105.0)
    assert queue.rests_from(112.0)
