"""The terms of pointing models, by TPOINT's names: a table, and the grammar of the generic ones.

A coefficient is *added to the telescope's (encoder) position to obtain the star's observed place*. To first order:

equatorial  Δh, Δδ: IH, ID added; CH sec δ; NP tan δ; MA (−cos h tan δ, sin h); ME (sin h tan δ, cos h); ΔZ = TF sin Z
altazimuth  ΔA, ΔE: −IA, IE; −CA sec E; −NPAE tan E; AN (−sin A tan E, −cos A); AW (−cos A tan E, sin A)

tan Z of TX is sin Z / cos Z with a cosine not below that of 89°: below 1° of elevation TX goes on as a flexure.

A generic harmonic is `H r f c [n] [f c [n]]`, a polynomial `P r c [n] [c [n]]`: r the result (see
`pointing.model.results`), f S or C, c one of H, D, A, E, Z, Q, n the multiple or the power, up to 99.
`pointing.model.own_term` makes a term of a function that none of these has.

The periodic error of a worm is a harmonic of the axis's own reading, before anything is corrected: `W r f n`, r the
axis (H, D, A or E), n the number of turns of the worm to one of the axis, or a multiple of it: WHS360 WHC360 for a
wheel of 360 teeth. TPOINT has none of these.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Literal

from pointing.errors import PointingError
from pointing.model.amount import Beyond, Factor, Factors, amount
from pointing.model.functions import Real
from pointing.model.place import KINDS, Angle, MountKind, Place
from pointing.model.results import RESULTS, Result

Evidence = Literal["published", "unconfirmed", "own"]

_HARMONIC = re.compile(r"H([HXDULPASZENWV])([SC])([HDAEZQ])([0-9]{0,2})(?:([SC])([HDAEZQ])([0-9]{0,2}))?")
_POLYNOMIAL = re.compile(r"P([HXDULPASZENWV])([HDAEZQ])([0-9]{0,2})(?:([HDAEZQ])([0-9]{0,2}))?")
_WORM = re.compile(r"W([HDAE])([SC])([1-9][0-9]*)")
_CHECKED = frozenset({"HESA2", "HECA", "HACA3", "HASA2", "PZZ1", "PZZ3"})

_RANK = {"H": 0, "D": 0, "A": 0, "E": 0, "X": 1, "S": 1, "P": 2, "V": 2, "L": 3, "W": 3, "U": 4, "N": 4}


@dataclass(frozen=True)
class Term:
    """One term: what it moves, and by how much at a place for a coefficient of one.

    Parameters
    ----------
    name : str
        TPOINT's name.
    result : str
        A key of `RESULTS`.
    factors : tuple
        The functions whose product is the amount; none: one everywhere.
    sentence : str
        What it stands for on a telescope.
    sign : float
        Of the coefficient.
    unconfirmed : tuple of str
        The kinds of mount for which no published fit confirms it: derived from the geometry.
    own : bool
        It is none of TPOINT's.
    """

    name: str
    result: str
    factors: Factors = ()
    sentence: str = field(default="", compare=False)
    sign: float = field(default=1.0)
    unconfirmed: tuple[MountKind, ...] = field(default=(), compare=False)
    own: bool = field(default=False, compare=False)

    @property
    def moves(self) -> Result:
        """What it moves."""
        return RESULTS[self.result]

    @property
    def mounts(self) -> tuple[MountKind, ...]:
        """The kinds of mount it is for."""
        return self.moves.mounts

    @property
    def is_index(self) -> bool:
        """Whether it is the zero point of an axis, which a `sync` may change."""
        return self.name in ("IH", "ID", "IA", "IE")

    @cached_property
    def rank(self) -> int:
        """Place in the order of application, telescope to star: TPOINT's standard terms come first, others last.

        Before all others stands what the axis's own reading decides: its worm, and the side of the pier.
        """
        if _WORM.fullmatch(self.name) or (self.factors and all(isinstance(each, Beyond) for each in self.factors)):
            return -1
        if not self.factors:
            return _RANK.get(self.result, len(_RANK))
        return len(_RANK)

    def evidence(self, kind: MountKind) -> Evidence:
        """What confirms it on a kind of mount."""
        if self.own:
            return "own"
        return "unconfirmed" if kind in self.unconfirmed else "published"

    def amount(self, place: Place) -> Angle:
        """γ for a coefficient of one, with its gradient (∂/∂lon, ∂/∂lat)."""
        sign = self.sign * self.moves.sign
        if not self.factors:
            return sign, 0.0, 0.0
        value, by_lon, by_lat = amount(self.factors, place)
        return (value, by_lon, by_lat) if sign == 1.0 else (sign * value, sign * by_lon, sign * by_lat)

    def forward(self, place: Place, coefficient: Real) -> Place:
        """Return the place after the term, for a coefficient in radians."""
        return self.moves.forward(place, coefficient * self.amount(place)[0]).to


_E: tuple[MountKind, ...] = ("equatorial",)


def _s(letter: str, number: int = 1) -> Factor:
    return Factor("S", letter, number)


def _c(letter: str, number: int = 1) -> Factor:
    return Factor("C", letter, number)


NAMED: tuple[Term, ...] = (
    Term("IH", "H", (), "index error in hour angle"),
    Term("ID", "D", (), "index error in declination"),
    Term("CH", "X", (), "collimation: the tube is not square to the declination axis"),
    Term("NP", "P", (), "the declination axis is not square to the polar axis", unconfirmed=_E),
    Term("MA", "L", (), "polar axis misaligned sideways"),
    Term("ME", "U", (), "polar axis misaligned in elevation"),
    Term("TF", "Z", (_s("Z"),), "tube flexure, proportional to sin Z"),
    Term("TX", "Z", (Factor("T", "Z"),), "tube flexure or refraction, proportional to tan Z", unconfirmed=_E),
    Term("TX10", "Z", (Factor("T", "Z"),), "as TX: a published fit comes out to 0.0004″ with tan Z", unconfirmed=_E),
    Term("FO", "D", (_c("H"),), "fork flexure, proportional to cos h", unconfirmed=_E),
    Term("HF", "X", (_s("H"),), "horseshoe flexure, proportional to sin h", unconfirmed=_E),
    Term("DAF", "X", (_c("Z"),), "flexure of a cantilevered declination axis", sign=-1.0, unconfirmed=_E),
    Term("HCES", "H", (_s("H"),), "hour-angle circle off centre, sine", unconfirmed=_E),
    Term("HCEC", "H", (_c("H"),), "hour-angle circle off centre, cosine", unconfirmed=_E),
    Term("DCES", "D", (_s("D"),), "declination circle off centre, sine", unconfirmed=_E),
    Term("DCEC", "D", (_c("D"),), "declination circle off centre, cosine", unconfirmed=_E),
    Term("DNP", "P", (_s("H"),), "non-perpendicularity that changes with sin h", unconfirmed=_E),
    Term("X2HC", "X", (_c("H", 2),), "twice a turn of the hour angle, east-west, cosine", unconfirmed=_E),
    Term("IA", "A", (), "index error in azimuth"),
    Term("IE", "E", (), "index error in elevation"),
    Term("CA", "S", (), "collimation: the tube is not square to the elevation axis"),
    Term("NPAE", "V", (), "the elevation axis is not square to the azimuth axis"),
    Term("AN", "N", (), "azimuth axis tilted to the north"),
    Term("AW", "W", (), "azimuth axis tilted to the west"),
    Term("ACES", "A", (_s("A"),), "azimuth circle off centre, sine"),
    Term("ACEC", "A", (_c("A"),), "azimuth circle off centre, cosine"),
    Term("ECES", "E", (_s("E"),), "elevation circle off centre, sine"),
    Term("ECEC", "E", (_c("E"),), "elevation circle off centre, cosine"),
    Term("FLOP", "E", (), "the tube flops in elevation", sign=-1.0),
    Term("NRX", "NRX", (), "Nasmyth rotator axis displaced horizontally"),
    Term("NRY", "NRY", (), "Nasmyth rotator axis displaced vertically"),
)
"""All named terms. Other names are read by the grammar of generic terms."""

PIER_TERMS: dict[str, Term] = {
    name: Term(f"{name}B", _result, (Beyond(),), f"what {name} has more beyond the pole", own=True)
    for name, _result in (("IH", "H"), ("ID", "D"), ("IA", "A"), ("IE", "E"))
}
"""By the index term whose value differs between the sides of the pier. TPOINT has none of these."""

_BY_NAME = {term.name: term for term in (*NAMED, *PIER_TERMS.values())}


def known(name: str) -> Term | None:
    """Return the term of a name, on whatever mount; None if there is none."""
    wanted = name.strip().upper()
    return _BY_NAME.get(wanted) or _generic(wanted)


def term(name: str, kind: MountKind) -> Term:
    """Return the term of a name on a kind of mount.

    Raises
    ------
    PointingError
        There is no such term, or it is not for this kind of mount.
    """
    found = known(name)
    if found is None:
        there = " ".join(each.name for each in NAMED if kind in each.mounts)
        raise PointingError(
            f"there is no pointing term {name!r}; for this mount there are {there}, harmonics such as "
            f"{'HESA2' if kind == 'altazimuth' else 'HDSH2'} and polynomials such as PZZ3"
        )
    if kind not in found.mounts:
        here = "an altazimuth" if kind == "altazimuth" else "an equatorial"
        raise PointingError(
            f"the term {found.name} ({found.sentence}) is for an {found.mounts[0]} mount, this is {here} one"
        )
    return found


def terms(names: str | Sequence[Term | str], kind: MountKind) -> tuple[Term, ...]:
    """Return the terms of a list of names, separated by blanks or commas, or of a list of terms and names.

    Raises
    ------
    PointingError
        A name is no term of this kind of mount, stands twice, or there is none.
    """
    return _listed(tuple(names.replace(",", " ").split()) if isinstance(names, str) else tuple(names), kind)


@lru_cache(maxsize=128)
def _listed(names: tuple[Term | str, ...], kind: MountKind) -> tuple[Term, ...]:
    if not names:
        raise PointingError('no pointing terms are named: give some, as in "IH ID CH NP MA ME"')
    found = tuple(term(each, kind) if isinstance(each, str) else each for each in names)
    refuse_twice(found)
    return found


def worm_terms(axis: str, teeth: int, harmonics: int = 1) -> str:
    """Return the names of the terms of a worm's periodic error: sine and cosine of each harmonic.

    Parameters
    ----------
    axis : {"H", "D", "A", "E"}
        Hour angle, declination, azimuth or elevation.
    teeth : int
        Turns of the worm to one of the axis.
    harmonics : int
        1 for the worm's turn alone, 2 for half a turn, too, and so on.

    Raises
    ------
    PointingError
        The axis is none, or a number is not positive.
    """
    if axis not in ("H", "D", "A", "E") or teeth < 1 or harmonics < 1:
        raise PointingError(
            f"worm of axis {axis!r}, {teeth} teeth, {harmonics} harmonics: give H, D, A or E, and from 1"
        )
    return " ".join(f"W{axis}{function}{teeth * n}" for n in range(1, harmonics + 1) for function in "SC")


def refuse_twice(listed: Sequence[Term]) -> None:
    """Refuse a list in which two terms have one name.

    Raises
    ------
    PointingError
        Says which.
    """
    names = [each.name for each in listed]
    if len(set(names)) == len(names):
        return
    for name in names:
        if names.count(name) > 1:
            raise PointingError(f"the pointing term {name} is named twice: name each once")


def _generic(name: str) -> Term | None:
    """Read a harmonic's or a polynomial's name."""
    evidence = () if name in _CHECKED else KINDS
    if worm := _WORM.fullmatch(name):
        axis, function, number = worm.groups()
        factor = Factor(function, axis, int(number))
        return Term(name, axis, (factor,), f"periodic error of a worm: {factor.text}", own=True)
    if harmonic := _HARMONIC.fullmatch(name):
        result, *rest = harmonic.groups()
        factors = tuple(_factor(*three) for three in (rest[:3], rest[3:]) if three[0])
    elif polynomial := _POLYNOMIAL.fullmatch(name):
        result, *rest = polynomial.groups()
        factors = tuple(_factor("P", *two) for two in (rest[:2], rest[2:]) if two[0])
    else:
        return None
    if any(factor.number == 0 for factor in factors):
        return None
    formula = " ".join(factor.text for factor in factors)
    return Term(name, result, factors, f"{RESULTS[result].sentence}: {formula}", unconfirmed=evidence)


def _factor(function: str, letter: str, number: str) -> Factor:
    return Factor(function, letter, int(number or 1))
