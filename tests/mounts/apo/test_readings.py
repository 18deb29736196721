import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mounts.apo import readings
from mounts.apo.errors import ApoError, MalformedReply
from mounts.apo.readings import Drift, FiducialPassage, Status, continues
from mounts.apo.replies import Reply
from mounts.apo.status_word import StatusWord

DUMP = """time position velocity error edge correction
1266860307.600 74.814029 0.241533 0.000954 1 0.000524
1266816131.180 59.597493 1.485286 -0.003319 0 0.000000
1266816131.330 59.819334 1.485286 -0.000797 1 -0.002057
1266839360.530 59.810348 -1.376835 0.006240 0 0.000000
1266839360.680 59.590300 -1.376835 0.001925 1 0.004082"""
PARSERS = (
    readings.parse_drift,
    lambda reply: readings.parse_status(reply, "sdss"),
    readings.parse_dump,
    readings.parse_identity,
    readings.parse_max_velocity,
    readings.parse_limits,
    readings.parse_output_limit,
)


def test_the_manuals_status_is_understood():
    reply = Reply("STATUS", ("0.0000306 0.00000 1664.320 3147777 0.0000000",))
    assert readings.parse_status(reply, "apo") == Status(0.0000306, 0.0, 1664.32, StatusWord(3147777, "apo"), 0.0)


def test_the_manuals_drift_is_understood():
    assert readings.parse_drift(Reply("DRIFT", ("221.3300000 0.00000 6935.400",))) == Drift(221.33, 0.0, 6935.4)


def test_a_clock_that_is_not_set_is_told():
    assert not readings.parse_drift(Reply("DRIFT", ("1.0 0.0 -1.000",))).clock_is_set
    assert readings.parse_drift(Reply("DRIFT", ("1.0 0.0 0.000",))).clock_is_set


def test_the_manuals_dump_is_a_table_whose_corrections_are_the_mean_errors():
    rows = readings.parse_dump(Reply("MS.DUMP", tuple(DUMP.splitlines())))
    assert rows[0] == FiducialPassage(1266860307.6, 74.814029, 0.241533, 0.000954, "falling", 0.000524)
    for rising, falling in (rows[1:3], rows[3:5]):
        assert (rising.edge, falling.edge) == ("rising", "falling")
        assert falling.correction_deg == pytest.approx((rising.error_deg + falling.error_deg) / 2, abs=1.01e-6)


def test_the_manuals_identity_is_understood():
    text = "axis code: 2009-10-16 379M, axis.ini version $Revision: 1.41 $"
    found = readings.parse_identity(Reply("ID", (text,)))
    assert (found.code_version, found.ini_version) == ("2009-10-16 379M", "$Revision: 1.41 $")
    assert readings.parse_identity(Reply("ID", ("MCP 7.1",))).text == "MCP 7.1"


def test_velocity_limits_and_output_are_understood():
    assert readings.parse_max_velocity(Reply("MAXV", ("1.75",))) == 1.75
    assert readings.parse_limits(Reply("SET.LIMITS", ("85.0 6.0",))) == (6.0, 85.0)
    assert readings.parse_output_limit(Reply("OUTPUT.LIMIT", ("55",))) == 55


@pytest.mark.parametrize(
    "line",
    [
        "0.0000306 0.00000 1664.320 3147777",
        "0.0000306 0.00000 1664.320 3147777 0.0 1.0",
        "0.00003x6 0.00000 1664.320 3147777 0.0000000",
        "nan 0.00000 1664.320 3147777 0.0000000",
        "1e5 0.00000 1664.320 3147777 0.0000000",
        "1_0.0 0.00000 1664.320 3147777 0.0000000",
        "0.0 0.00000 86401.0 3147777 0.0000000",
        "0.0 0.00000 -2.0 3147777 0.0000000",
        "0.0 0.00000 1664.320 31.5 0.0000000",
        "0.0 0.00000 1664.320 4294967296 0.0000000",
        "",
    ],
)
def test_what_is_no_status_is_refused(line):
    with pytest.raises(MalformedReply):
        readings.parse_status(Reply("STATUS", (line,)), "apo")


@given(st.lists(st.text(min_size=1).filter(str.strip).map(str.strip), max_size=4))
def test_any_lines_are_values_or_an_error_of_ours(lines):
    for parse in PARSERS:
        with contextlib.suppress(ApoError):
            parse(Reply("X", tuple(lines)))


@given(
    st.floats(-180, 360),
    st.floats(-1.7, 1.7),
    st.lists(st.floats(-0.1, 0.1), min_size=1, max_size=8),
    st.floats(0.02, 0.5),
    st.floats(0, 86399),
)
def test_every_motion_within_the_acceleration_continues(position, velocity, accelerations, step, time):
    before = Drift(round(position, 7), round(velocity, 5), round(time, 3))
    for acceleration in accelerations:
        position += velocity * step + acceleration * step**2 / 2.0
        velocity += acceleration * step
        time += step
    after = Drift(round(position, 7), round(velocity, 5), round(time % 86400.0, 3))
    assert continues(before, after, 0.1)


def test_a_garbled_digit_does_not_continue():
    before = Drift(120.1234567, 0.0041, 86399.9)
    assert continues(before, Drift(120.1242767, 0.0041, 0.1), 0.1)
    assert not continues(before, Drift(120.1942767, 0.0041, 0.1), 0.1)
    assert not continues(before, Drift(120.1242767, 0.9041, 0.1), 0.1)
