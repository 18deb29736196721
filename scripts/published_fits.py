"""`python -m scripts.published_fits [--check]`: write into docs/ the published fits beside those made here.

Reads the shared runs: `../shared` beside the checkout, or where CLOCKDRIVE_SHARED points.
"""

import os
import sys
from pathlib import Path

from scripts.sections import CHECKOUT, markdown_table, write_section

sys.path.append(str(CHECKOUT / "tests"))
from published_fits import (
    GERMAN,
    GERMAN_TERMS,
    PUBLISHED,
    ZERO_POINTS,
    Published,
    fitted,
    run_of,
    without_the_rule,
)

from pointing.model.fit import fit

PAGE = CHECKOUT / "docs" / "pointing-models.md"
HEAD = ("run", "stars", "what", "published", "ours", "difference")


def table(shared: Path) -> str:
    """Return all published numbers, with ours."""
    rows = [row for each in PUBLISHED for row in of_one(shared, each)]
    for name, (terms, published) in ZERO_POINTS.items():
        ours = fit(run_of(shared, name), terms).popn_sd_arcsec
        rows.append(row(shared, name, f"population SD of {terms} alone", published, ours, 2))
    for name, (joint, without) in GERMAN.items():
        run = run_of(shared, name)
        ours = fit(run, GERMAN_TERMS).sky_rms_arcsec
        rows.append(row(shared, name, f"sky RMS of {GERMAN_TERMS}, both sides", joint, ours, 1))
        ours = fit(without_the_rule(run), GERMAN_TERMS).sky_rms_arcsec
        rows.append(row(shared, name, "the same without the rule beyond the pole", without, ours, 1))
    return markdown_table(HEAD, rows)


def of_one(shared: Path, published: Published) -> list[tuple[str, ...]]:
    """Return the rows of one published fit: its coefficients, the worst σ, and its statistics."""
    found = fitted(shared, published)
    name = published.run
    rows = [row(shared, name, term, value, found[term].arcsec, 4) for term, value in published.coefficients.items()]
    if published.sigmas:
        off = {term: found[term].sigma_arcsec / value - 1.0 for term, value in published.sigmas.items()}
        worst = max(off, key=lambda term: abs(off[term]))
        rows.append(
            row(shared, name, f"σ of {worst}, the worst", published.sigmas[worst], found[worst].sigma_arcsec, 5)
        )
    if published.sky_rms is not None:
        rows.append(row(shared, name, "sky RMS", published.sky_rms, found.sky_rms_arcsec, 4))
    if published.popn_sd is not None:
        rows.append(row(shared, name, "population SD", published.popn_sd, found.popn_sd_arcsec, 3))
    return rows


def row(shared: Path, name: str, what: str, published: float, ours: float, digits: int) -> tuple[str, ...]:
    """Return the cells of one number, arcseconds."""
    stars = str(len(run_of(shared, name)))
    difference = round(ours - published, digits) + 0.0  # no −0
    shown = f"{published:.{digits}f}", f"{ours:.{digits}f}", f"{difference:+.{digits}f}"
    return name, stars, what, *(text.replace("-", "−") for text in shown)


def main(arguments: list[str]) -> int:
    """Write the table, or check that it is current; return the exit code."""
    check = arguments == ["--check"]
    if arguments and not check:
        print(__doc__, file=sys.stderr)
        return 2
    shared = Path(os.environ.get("CLOCKDRIVE_SHARED", CHECKOUT.parent / "shared"))
    current = write_section(PAGE, "published", table(shared), check=check)
    if not current:
        print("stale, run python -m scripts.published_fits" if check else "written")
    return 1 if check and not current else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
