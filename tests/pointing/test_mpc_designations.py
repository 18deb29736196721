"""Packed texts of the Minor Planet Center, against the examples of its own pages."""

from datetime import date

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pointing.mpc_designations import key, packed_day, unpacked

MJD_2000 = 51544  # 2000 January 1


@pytest.mark.parametrize(
    ("packed", "written"),
    [
        ("00001", "(1)"),
        ("03202", "(3202)"),
        ("50000", "(50000)"),
        ("A0345", "(100345)"),
        ("a0017", "(360017)"),
        ("K3289", "(203289)"),
        ("~0000", "(620000)"),
        ("~000z", "(620061)"),
        ("~AZaz", "(3140113)"),
        ("~zzzz", "(15396335)"),
        ("J95X00A", "1995 XA"),
        ("J95X01L", "1995 XL1"),
        ("J95F13B", "1995 FB13"),
        ("J98SA8Q", "1998 SQ108"),
        ("J98SC7V", "1998 SV127"),
        ("J98SG2S", "1998 SS162"),
        ("K99AJ3Z", "2099 AZ193"),
        ("K08Aa0A", "2008 AA360"),
        ("K07Tf8A", "2007 TA418"),
        ("PLS2040", "2040 P-L"),
        ("T1S3138", "3138 T-1"),
        ("T3S4101", "4101 T-3"),
        ("_QC0000", "2026 CA620"),
        ("_QC0aEM", "2026 CZ6190"),
        ("_QCzzzz", "2026 CL591673"),
        ("0001P", "1P"),
        ("0073P      b", "73P-B"),
        ("0073P     bc", "73P-BC"),
        ("CJ95O010", "C/1995 O1"),
        ("J95O010", "1995 O1"),
        ("PJ94P01b", "P/1994 P1-B"),
        ("CK15X07X", "C/2015 XX7"),
        ("nonsense", "nonsense"),
        ("", ""),
    ],
)
def test_a_packed_designation_is_what_people_write(packed, written):
    assert unpacked(packed) == written


@pytest.mark.parametrize(
    ("packed", "day"),
    [
        ("J9611", date(1996, 1, 1)),
        ("J961A", date(1996, 1, 10)),
        ("J969U", date(1996, 9, 30)),
        ("J96AV", date(1996, 10, 31)),
        ("K01AM", date(2001, 10, 22)),
        ("K25BL", date(2025, 11, 21)),
    ],
)
def test_a_packed_date_is_a_day(packed, day):
    assert packed_day(packed) == MJD_2000 + (day - date(2000, 1, 1)).days


@pytest.mark.parametrize("text", ["", "K25BV", "K252U", "K25DL", "X25BL", "K25B", "K25B0", "k25bl"])
def test_what_is_no_packed_date_is_none(text):
    assert packed_day(text) is None


def test_names_compare_without_case_blanks_and_punctuation():
    assert key(" C/1995 O1 (Hale-Bopp)") == key("c1995O1 HALE BOPP")
    assert key("_QC0000") != key("QC0000")


@given(st.text())
def test_any_text_unpacks_to_some_text(text):
    assert isinstance(unpacked(text), str)
    assert packed_day(text) is None or len(text) == 5
