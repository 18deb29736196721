"""`python -m scripts.chain_drawing [--check]`: draw the chain from a catalogue to the motors into docs/pictures.

The places and the steps between them are a table, read from the star downwards; on the way back each is undone.
"""

import sys
from dataclasses import dataclass
from html import escape

from scripts.sections import CHECKOUT

PATH = CHECKOUT / "docs" / "pictures" / "chain.svg"


@dataclass(frozen=True)
class Stage:
    """A place in its frame, and the steps from it to the next, a line each.

    Parameters
    ----------
    name, frame : str
        What it is, and of what it is told.
    steps : tuple of (str, str)
        What is done next, and its formula, sign or unit.
    """

    name: str
    frame: str
    steps: tuple[tuple[str, str], ...] = ()


CHAIN = (
    Stage(
        "catalogue place",
        "ICRS: right ascension, declination",
        (
            ("proper motion, parallax", "to the date and the observer's place"),
            ("light bent by the Sun", "away from the Sun"),
            ("aberration", "annual and diurnal, towards the observer's motion"),
        ),
    ),
    Stage(
        "proper direction",
        "axes of the ICRS, of date and place",
        (
            ("precession, nutation", "IAU 2006/2000A, the celestial pole"),
            ("Earth rotation, polar motion", "UT1 and pole from the IERS table"),
        ),
    ),
    Stage(
        "topocentric place",
        "horizon: x south, y east, z zenith",
        (("refraction", "lifts: ΔZ = −(A tan Z + B tan³ Z)"),),
    ),
    Stage(
        "observed place",
        "h west positive, δ; or A north through east, E",
        (("mount registers X, Y", "rotation vector (X, Y, 0) of the base: MA = −X, ME = −Y; AW = X, AN = −Y"),),
    ),
    Stage(
        "place over the base",
        "as the pointing model's star: lon, lat",
        (
            ("all other terms", "the last listed first: TF, TX, FO, harmonics"),
            ("tilt of axis 1", "ME, then MA; AN, then AW"),
            ("non-perpendicularity", "NP; NPAE. Changes sign beyond the pole"),
            ("collimation", "CH; CA, and the x of the pointing origin. Changes sign beyond the pole"),
            ("index errors", "IH ID; IA IE, and the y of the origin. Added to the reading to find the star"),
        ),
    ),
    Stage(
        "mechanical angles",
        "axis 1, axis 2; beyond the pole |axis 2| > 90°",
        (("worm, side of the pier", "W terms, IHB, IDB: by the axis's own reading"),),
    ),
    Stage(
        "axis readings",
        "as the axes say; a sync sets their index",
        (("gearing", "count = centre ± (angle − centre_deg) / step; − where reversed"),),
    ),
    Stage("motor counts", "what the drive is sent"),
)

WIDTH, LEFT, BOX, TALL, LINE, MARGIN = 900, 20, 330, 46, 21, 16
STYLE = (
    "text{font-family:sans-serif;font-size:14px;fill:#222}.name{font-weight:bold}.small{font-size:13px;fill:#555}"
    ".box{fill:#eaf3f9;stroke:#0072B2}.model{fill:#fdf3e1;stroke:#E69F00}.way{stroke:#0072B2;stroke-width:2;fill:none}"
)


def drawing() -> str:
    """Return the chain as SVG."""
    parts, y = [], MARGIN
    for stage in CHAIN:
        parts += _box(stage, y)
        y += TALL
        if stage.steps:
            deep = LINE * len(stage.steps) + 18
            parts += _steps(stage, y, deep)
            y += deep
    height = y + MARGIN
    return "\n".join(
        (
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" role="img" '
                'aria-label="The chain from a catalogue place to motor counts">'
            ),
            f"<style>{STYLE}</style>",
            (
                '<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="6" markerHeight="6" orient="auto">'
                '<path d="M0 0L8 4L0 8z" fill="#0072B2"/></marker>'
            ),
            f'<rect width="{WIDTH}" height="{height}" fill="white"/>',
            *parts,
            "</svg>\n",
        )
    )


def _box(stage: Stage, y: int) -> list[str]:
    middle = LEFT + BOX // 2
    return [
        f'<rect class="box" x="{LEFT}" y="{y}" width="{BOX}" height="{TALL}" rx="6"/>',
        f'<text class="name" x="{middle}" y="{y + 19}" text-anchor="middle">{escape(stage.name)}</text>',
        f'<text class="small" x="{middle}" y="{y + 37}" text-anchor="middle">{escape(stage.frame)}</text>',
    ]


def _steps(stage: Stage, y: int, deep: int) -> list[str]:
    x, parts = LEFT + 30, []
    if stage.name == "place over the base":  # what follows is the pointing model
        parts.append(
            f'<rect class="model" x="{x + 14}" y="{y + 4}" width="{WIDTH - x - 34}" height="{deep - 8}" rx="6"/>'
        )
    parts.append(f'<path class="way" d="M{x} {y}V{y + deep - 1}" marker-end="url(#tip)"/>')
    for i, (what, how) in enumerate(stage.steps):
        line = y + 24 + LINE * i
        parts.append(f'<text x="{x + 24}" y="{line}">{escape(what)}</text>')
        parts.append(f'<text class="small" x="{x + 250}" y="{line}">{escape(how)}</text>')
    return parts


def main(arguments: list[str]) -> int:
    """Draw, or check that the drawing is current; return the exit code."""
    text = drawing()
    if arguments == ["--check"]:
        current = PATH.read_text(encoding="utf-8") == text
        if not current:
            print(f"{PATH.name} is stale, run python -m scripts.chain_drawing")
        return 0 if current else 1
    PATH.parent.mkdir(exist_ok=True)
    PATH.write_text(text, encoding="utf-8")
    print("drawn:", PATH.name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
