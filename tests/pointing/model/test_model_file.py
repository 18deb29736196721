"""TPOINT's model files: real ones come back byte for byte, and every number to the last digit."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pointing.errors import PointingError
from pointing.model.model_file import ModelFile, ModelRow, read_model_file, write_model_file

PUBLISHED = {
    "auxtel_2022-04": (54, 3.1416, {"IA": (-292.0063, 2.16741), "IE": (-213.0469, 0.90851), "AN": (39.1647, 0.50375),
                                    "AW": (70.8896, 0.49754), "TX10": (-6.8641, 0.72265), "CA": (90.9256, 1.51859)}),
    "auxtel_2020-02": (18, 23.2020, {"IA": (-213.2994, 13.35831), "IE": (-279.3958, 5.67797),
                                     "NPAE": (-69.0157, 9.0499), "CA": (0.0, None), "AN": (49.0853, 6.26479),
                                     "AW": (60.3376, 6.15091)}),
}  # fmt: skip


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_real_model_is_read_and_written_byte_for_byte(shared, tmp_path, name):
    path = shared / "data" / "tpoint" / f"{name}.mod"
    model = read_model_file(path)
    n, rms, terms = PUBLISHED[name]
    assert (model.method, model.n, model.sky_rms_arcsec) == ("T", n, rms)
    assert {row.name: (row.arcsec, row.sigma_arcsec) for row in model.rows} == terms
    assert [row.name for row in model.rows if row.fixed] == (["CA"] if name == "auxtel_2020-02" else [])
    write_model_file(model, tmp_path / "again.mod")
    assert (tmp_path / "again.mod").read_bytes() == path.read_bytes()


NUMBER = st.floats(-1e7, 1e7)
ROW = st.builds(
    ModelRow, st.from_regex(r"[A-Z][A-Z0-9]{0,9}", fullmatch=True).filter(lambda name: name != "END"), NUMBER,
    st.none() | st.floats(0.0, 1e5), st.booleans(), st.booleans(),
)  # fmt: skip


@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    st.sampled_from(["END", "end", "T 5 1.0", ""])
    | st.from_regex(r"[A-Za-z0-9][A-Za-z0-9.,:°-]{0,20}( [a-z]{1,5})?", fullmatch=True),
    st.integers(0, 10**6), st.floats(0.0, 1e6), NUMBER, NUMBER, st.lists(ROW, max_size=8, unique_by=lambda r: r.name),
)  # fmt: skip
def test_any_model_comes_back_to_the_last_digit(tmp_path_factory, caption, n, rms, a, b, rows):
    model = ModelFile(caption, "T", n, rms, a, b, tuple(rows))
    path = tmp_path_factory.getbasetemp() / "any.mod"
    write_model_file(model, path)
    assert read_model_file(path) == model


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "m.mod is no model: give caption, T n RMS A B, terms and END"),
        ("Caption\n12 3\nEND\n", "m.mod, line 2, column 1: '12 3': wanted is T, then n"),
        ("Caption\nT 12\nEND\n", "line 2, column 1: 'T 12': 1 numbers"),
        ("Caption\nEND\n", "line 2, column 2: 'ND': no number; wanted are n, sky RMS"),
        ("END\nT 12 3\n IA 1\n", "line 3, column 1: ' IA 1': the model ends without END"),
        ("Caption\nT 12.5 3 0 0\nEND\n", "line 2, column 3: '12.5': a number of observations"),
        ("Caption\nT 12 3 0 x\nEND\n", "line 2, column 10: 'x': no number"),
        ("Caption\nT 1 2 0 0\n IA 1.0 2.0 3.0\nEND\n", "line 3, column 4: ' 1.0 2.0 3.0': 3 numbers"),
        ("Caption\nT 1 2 0 0\n IA\nEND\n", "line 3, column 4: '': 0 numbers"),
        ("Caption\nT 1 2 0 0\n IA one\nEND\n", "line 3, column 5: 'one': no number"),
        ("Caption\nT 1 2 0 0\n 12 13\nEND\n", "line 3, column 1: ' 12 13': no term"),
        ("Caption\nT 1 2 0 0\n IA 1 -2\nEND\n", "line 3, column 7: '-2': a standard deviation"),
        ("Caption\nT 1 2 0 0\n IA 1\n =ia 2\nEND\n", "line 4, column 1: ' =ia 2': the term IA a second time"),
        ("Caption\nT 1 2 0 0\n IH 10,5\nEND\n", "line 3, column 7: ',5': a comma inside a number"),
        ("Caption\nT 1 2,5 0 0\n IH 10\nEND\n", "line 2, column 6: ',5 0 0': a comma inside a number"),
        ("Caption\nT 1 2 0 0\n IA 1\nEND\n\n IE 2\n", "line 6, column 1: ' IE 2': text behind END"),
        ("Caption\nT 1 2 0 0\n IA 1\n", "line 3, column 1: ' IA 1': the model ends without END"),
    ],
)
def test_what_is_no_model_is_refused_with_line_column_and_text(tmp_path, text, said):
    path = tmp_path / "m.mod"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(PointingError) as refused:
        read_model_file(path)
    assert said in str(refused.value)


def test_flags_comments_and_a_head_without_refraction_are_read(tmp_path):
    path = tmp_path / "m.mod"
    path.write_bytes(b"Old\r\nT 10 2.5\r\n! comment\r\n&=NP +1.5\r\n  ch -2.25 .125\r\nEND\r\n! more\r\n\r\n")
    model = read_model_file(path)
    assert model == ModelFile(
        "Old",
        "T",
        10,
        2.5,
        rows=(ModelRow("NP", 1.5, None, True, True), ModelRow("CH", -2.25, 0.125)),  # noqa: FBT003
    )
    assert "<td>NP</td><td>+1.5000</td><td></td><td>fixed</td>" in model._repr_html_()
