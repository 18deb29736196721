import math
import re
from itertools import pairwise

import pytest

from mounts.errors import DriveError
from mounts.tc410.registers import (
    MAX_VELOCITY,
    REGISTERS,
    RegisterError,
    at,
    binary_to_gray,
    by_name,
    flags,
    gray_to_binary,
    of_axis,
)

KIND_OF_TABLE = {17: "coil", **dict.fromkeys(range(18, 23), "discrete"), **dict.fromkeys(range(23, 26), "input")}


def manual_rows(shared):
    """Yield (table, address, text, bits) of Tables 17 to 31; a table's caption follows its rows."""
    lines = (shared / "manuals" / "000_tc410.txt").read_text().splitlines()
    start = next(index for index, line in enumerate(lines) if line.startswith("#### 4.8.1. Coils"))
    waiting = []
    for line in [*lines[start:], "Table 31:"]:  # the last caption is missing in the text
        if row := re.match(r"0x([0-9A-F]{4})\t(.*)", line):
            waiting.append((int(row[1], 16), row[2], []))
        if bit := re.search(r"\bBit (\d)\b", line):
            waiting[-1][2].append((int(bit[1]), line[bit.end() :].strip()))
        if caption := re.match(r"\*?Table (\d+):", line):
            for address, text, bits in waiting:
                yield int(caption[1]), address, text, bits
            waiting = []


def test_every_row_of_the_manual_is_in_the_table(shared):
    rows = list(manual_rows(shared))
    tables = {table for table, *_ in rows}
    assert tables == set(range(17, 32))
    seen = set()
    for table, address, text, bits in rows:
        kind = KIND_OF_TABLE.get(table, "holding")
        if text == "Reserved":
            with pytest.raises(RegisterError, match="reserved"):
                at(kind, address)
            continue
        register = at(kind, address)
        seen.add((kind, address))
        low_word = "least significant" in text or text.split(" (")[0].endswith(" lo")
        assert (address != register.address) == low_word, text
        pair = re.search(r"(most|least) significant bits\)| (hi|lo)\b", text)
        assert register.words == (2 if pair else 1), text
        used = {bit for bit, meaning in bits if not re.search(r"unused \(0\)|Reserved", meaning)}
        assert {flag.bit for flag in register.flags if bits} == used, text
    print(f"{len(rows)} rows, {len(REGISTERS)} registers")
    table_addresses = {(r.kind, r.address + word) for r in REGISTERS for word in range(r.words)}
    assert table_addresses == seen


@pytest.mark.parametrize(
    ("kind", "undefined"),
    [
        (
            "holding",
            [0x09, 0x0B, 0x1A, 0x3A, *range(0x21, 0x30), *range(0x41, 0x50), *range(0x56, 0x60), *range(0x66, 0x70)],
        ),
        ("input", [0x0F, *range(0x15, 0x20)]),
        ("discrete", [*range(0x04, 0x08), *range(0x0C, 0x10), *range(0x14, 0x18)]),
        ("coil", [0x01]),
    ],
)
def test_undefined_addresses_are_never_touched(kind, undefined):
    for address in undefined:
        with pytest.raises(RegisterError, match=f"0x{address:04X}"):
            at(kind, address)


def test_names_are_unique_and_every_row_says_what_it_means():
    assert len({register.name for register in REGISTERS}) == len(REGISTERS)
    assert all(register.meaning and register.name.isidentifier() for register in REGISTERS)
    assert issubclass(RegisterError, DriveError)


def test_every_register_returns_what_was_written_at_both_ends_of_its_range():
    for register in REGISTERS:
        if register.words == 2 or register.kind in ("input", "holding"):
            for raw in (register.conversion.lowest, register.conversion.highest):
                value = register.conversion.value(raw)
                assert register.decode(register.encode(value)) == value, register.name


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("system_temperature", 20.5, (0x00CD,)),
        ("fan_stop_temperature", -5.7, (0xFFC7,)),
        ("axis1_velocity", -13873, (0xFFFF, 0xC9CF)),
        ("axis2_tracking_velocity", MAX_VELOCITY, (0x00FF, 0xFFFF)),
        ("axis1_position", 0x800000, (0x0080, 0x0000)),
        ("latitude", -152640000, (0xF6E6, 0xE600)),
        ("axis1_motor_current", 3.0, (30,)),
        ("axis1_acceleration", 26, (0x1A,)),
        ("axis1_max_speed", 0xFFFFFF, (0xFFFF,)),
        ("axis1_park", 0x8000FF, (0x8001,)),
    ],
)
def test_values_take_the_form_the_manual_prints(name, value, words):
    register = by_name(name)
    assert register.encode(value) == words
    assert register.decode(words) == pytest.approx(value, abs=register.conversion.multiple)


def test_positions_are_justified_either_way_and_the_wrong_way_is_noticed():
    position = of_axis(2, "position")
    assert position.encode(0x123456, "left") == (0x1234, 0x5600)
    assert position.decode((0x1234, 0x5600), "left") == 0x123456
    with pytest.raises(RegisterError, match='position_format = "left"'):
        position.decode((0x1234, 0x5600), "right")
    with pytest.raises(RegisterError, match='position_format = "right"'):
        position.decode((0x0012, 0x3456), "left")


def test_soft_limits_are_rounded_inward():
    for counts in (0x123400, 0x123401, 0x1234FF):
        negative, positive = of_axis(1, "negative_limit"), of_axis(1, "positive_limit")
        assert counts <= negative.decode(negative.encode(counts)) < counts + 0x100
        assert counts - 0x100 < positive.decode(positive.encode(counts)) <= counts


@pytest.mark.parametrize(
    ("name", "value", "bound"),
    [
        ("axis1_acceleration", 0, "1 to 255"),
        ("axis1_acceleration", 256, "1 to 255"),
        ("axis1_motor_current", 5.1, "1 to 5 A"),
        ("axis1_position", 0x1000000, "0 to 1.67772e+07 counts"),
        ("axis1_target_velocity", MAX_VELOCITY + 1, "20000/2²⁴ counts/s"),
        ("axis1_position", math.nan, "counts"),
        ("axis1_negative_limit", -1000, "counts"),
    ],
)
def test_a_value_outside_is_refused_with_its_bounds(name, value, bound):
    with pytest.raises(RegisterError, match=re.escape(bound)):
        by_name(name).encode(value)


def test_flags_are_named_and_active_low_inputs_read_as_asserted():
    assert flags(by_name("slew_flags"), 0x51) == ("axis1_slewing", "axis2_slewing", "axis2_slew_negative")
    assert flags(by_name("digital_inputs"), 0xFF) == ()
    assert flags(by_name("digital_inputs"), 0xFF ^ 0x88) == ("autoguider_north", "autoguider_present")
    assert by_name("velocity_control").mask("slew_to_target", "tracking") == 0x81
    assert by_name("velocity_control").asserted(0x82) == ("remote_control", "tracking")
    with pytest.raises(RegisterError, match="has no flag 'warp'"):
        by_name("velocity_control").mask("warp")


def test_gray_code_changes_one_bit_a_step_and_inverts():
    codes = [binary_to_gray(value) for value in range(0x10000)]
    assert all((a ^ b).bit_count() == 1 for a, b in pairwise(codes))
    assert [gray_to_binary(code) for code in codes] == list(range(0x10000))
