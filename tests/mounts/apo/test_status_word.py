import pytest

from mounts.apo.status_word import ERROR_MASKS, TABLES, WARNING_MASKS, StatusWord, mask_of, sticky_mask

APO = {0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 12, 13, 14, 15, 16, 18, 19, 24, 29, 30}
SDSS = {0, 1, 2, 3, 4, 5, 6, 7, 11, 12, 13, 14, 16, 17, 18, 24}


def test_the_sample_of_the_manual_has_bits_0_11_20_21():
    word = StatusWord(3147777, "apo")
    assert word.names == ("buffer_empty", "stop_button")
    assert word.unknown == (20, 21)
    assert word.errors == ("stop_button",)
    assert word.warnings == ("buffer_empty",)
    assert word.meanings[2] == "bit 20, which the manual does not explain"


@pytest.mark.parametrize(("kind", "named"), [("apo", APO), ("sdss", SDSS)])
def test_every_bit_of_both_tables_alone_is_named_or_told_raw(kind, named):
    for bit in range(32):
        word = StatusWord(1 << bit, kind)
        if bit in named:
            assert len(word.names) == 1
            assert word.unknown == ()
            assert word.has(word.names[0])
            assert mask_of(word.names[0], kind) == 1 << bit
        else:
            assert word.names == ()
            assert word.unknown == (bit,)
        assert len(word.meanings) == 1


@pytest.mark.parametrize("kind", ["apo", "sdss"])
def test_the_masks_are_the_manuals_with_stop_and_slip_added(kind):
    errors = sum(1 << bit for bit in range(32) if StatusWord(1 << bit, kind).errors)
    warnings = sum(1 << bit for bit in range(32) if StatusWord(1 << bit, kind).warnings)
    besides = (1 << 11, 1 << 15) if kind == "apo" else (0, 0)
    assert errors == ERROR_MASKS[kind] | besides[0]
    assert warnings == WARNING_MASKS[kind] & ~ERROR_MASKS[kind] | besides[1]
    assert (ERROR_MASKS[kind], WARNING_MASKS[kind]) == ((0xCD71CC, 0x61040033), (0x45800, 0x610320FF))[kind == "sdss"]


def test_limits_fiducials_stop_and_buffer_do_not_stick():
    for kind in ("apo", "sdss"):
        loose = {row.name for row in TABLES[kind] if not sticky_mask(kind) >> row.bit & 1}
        assert loose - {"semaphore_taken"} == {
            "buffer_empty", "reverse_soft_limit", "forward_soft_limit", "reverse_limit_switch",
            "forward_limit_switch", "stop_button", "fiducial_error",
        }  # fmt: skip


def test_a_signed_report_is_the_same_word():
    assert StatusWord(-(1 << 31)).unknown == (31,)
    assert (StatusWord(1) | StatusWord(1 << 30)).restarted


def test_a_bit_of_the_other_kind_is_never_set():
    assert not StatusWord((1 << 32) - 1, "apo").has("semaphore_taken")
