"""The formulas of the page on pointing models, read as they are printed, are what the terms do to first order."""

import math
import re
from pathlib import Path

import pytest

from pointing.model.place import Frame, Place
from pointing.model.terms import term

CHECKOUT = Path(__file__).resolve().parents[3]
PAGE = CHECKOUT / "docs" / "pointing-models.md"
SMALL = 1e-7
FUNCTIONS = {"sin": math.sin, "cos": math.cos, "tan": math.tan, "sec": lambda angle: 1.0 / math.cos(angle)}
ROW = re.compile(r"\| `(\w+)` \| ([^|]+) \| [^|]+ \| ([^|]+) \|")

pytestmark = pytest.mark.checkout


def rows():
    """Every (term, formula, mount) of the page; none away from the checkout, where these tests are left out."""
    found = ROW.findall(PAGE.read_text(encoding="utf-8")) if PAGE.exists() else []
    return [
        pytest.param(name, formula, kind, id=f"{name}-{kind}")
        for name, formula, kinds in found
        for kind in kinds.strip().split(", ")
    ]


def value(product, angles):
    """Evaluate `−ME sin h tan δ` with a coefficient of one."""
    words = product.split()
    result = -1.0 if words[0].startswith("−") else 1.0
    for function, angle in zip(words[1::2], words[2::2], strict=True):
        multiple, letter = re.fullmatch(r"(\d*)(\D+)", angle).groups()
        result *= FUNCTIONS[function](int(multiple or 1) * angles[letter])
    return result


def above(frame, lon, lat):
    """Cosine of the zenith distance."""
    if frame.kind == "altazimuth":
        return math.sin(lat)
    return math.sin(lat) * math.sin(frame.latitude) + math.cos(lat) * math.cos(lon) * math.cos(frame.latitude)


@pytest.mark.parametrize("latitude_deg", [40.0, -30.0])
@pytest.mark.parametrize(("name", "formula", "kind"), rows())
def test_a_printed_formula_is_what_the_term_does(name, formula, kind, latitude_deg):
    frame = Frame(kind, math.radians(latitude_deg))
    lon, lat = (0.6, 0.3) if kind == "equatorial" else (2.1, 0.8)
    after = term(name, kind).forward(Place(frame, lon, lat), SMALL)
    zenith = [math.acos(above(frame, *at)) for at in ((lon, lat), (after.lon, after.lat))]
    angles = {"h": lon, "δ": lat, "A": lon, "Aₛ": math.pi - lon, "E": lat, "Z": zenith[0]}
    done = dict.fromkeys(("Δh", "ΔA"), after.lon - lon) | dict.fromkeys(("Δδ", "ΔE"), after.lat - lat)
    done["ΔZ"] = zenith[1] - zenith[0]
    said = dict(part.split(" = ") for part in formula.strip().split(", "))
    for coordinate, product in said.items():
        assert done[coordinate] / SMALL == pytest.approx(value(product, angles), abs=1e-5)
    if "ΔZ" not in said:
        rest = {"Δh", "Δδ"} if kind == "equatorial" else {"ΔA", "ΔE"}
        assert all(abs(done[coordinate]) < 1e-5 * SMALL for coordinate in rest - set(said))


def test_every_named_term_stands_on_the_page():
    from pointing.model.terms import NAMED

    assert {each.values[0] for each in rows()} == {each.name for each in NAMED}
