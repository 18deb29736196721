"""The terms that are tried when nobody names any, in the order in which a telescope is likely to need them."""

from dataclasses import dataclass
from itertools import chain

from pointing.model.place import MountKind
from pointing.model.terms import Term, terms


@dataclass(frozen=True)
class Tier:
    """Terms that are tried together, after those before have had their chance.

    Parameters
    ----------
    terms : tuple of Term
        The terms.
    worth : float
        By how much a term must lower BIC to be taken. Nothing for what every mount has by its geometry; otherwise
        positive (2 to 6) and strong evidence (6 to 10; Kass & Raftery 1995, J. Am. Stat. Assoc. 90, 773): of many
        terms that are tried some please by chance, and harmonics have no reason of their own.
    """

    terms: tuple[Term, ...]
    worth: float


INDEX: dict[MountKind, str] = {"equatorial": "IH ID", "altazimuth": "IA IE"}
"""Every telescope has them."""

_NAMED = 2.0  # worth of what a user names

# Without aliases, and without NRX and NRY: only a Nasmyth focus has them, and each displaces like two others.
_NAMES: dict[MountKind, tuple[tuple[str, float], ...]] = {
    "equatorial": (
        ("CH NP MA ME", 0.0),
        ("TF TX FO HF DAF HCES HCEC DCES DCEC DNP X2HC", 4.0),
        ("HDSH HDSH2 HDCH2 HHSH2 HHCH2 HDSD2 HDCD2 HXCH HXSH2 HPCH", 8.0),
    ),
    "altazimuth": (
        ("CA NPAE AN AW", 0.0),
        ("TF TX ACES ACEC ECES", 4.0),
        ("HESA HECA HESA2 HECA2 HASA2 HACA2 HSSA HSCA HSSA2 HSCA2 HESE2 HECE2 HESA3 HECA3 HASA3 HACA3", 8.0),
    ),
}


_GEOMETRIC = {name for kind, names in INDEX.items() for name in chain(names.split(), _NAMES[kind][0][0].split())}


def geometric(each: Term) -> bool:
    """Whether every mount has this term by its geometry: index, collimation, non-perpendicularity, tilt of axis 1."""
    return each.name in _GEOMETRIC


def tiers(kind: MountKind, named: str | None = None) -> tuple[Tier, ...]:
    """Return the candidates for a kind of mount, or those named, the geometric ones in the first tier.

    Raises
    ------
    PointingError
        A name is no term of this kind of mount.
    """
    if named is None:
        return tuple(Tier(terms(names, kind), worth) for names, worth in _NAMES[kind])
    listed = terms(named, kind)
    return (
        Tier(tuple(each for each in listed if geometric(each)), _NAMED),
        Tier(tuple(each for each in listed if not geometric(each)), _NAMED),
    )
