"""From a file of what was measured of the worm to the table of a stepper box, and a picture of both."""

import math
from pathlib import Path
from typing import Any

from clockdrive.answers import Answer
from clockdrive.configuration import Configuration
from clockdrive.drives.avr_box.sections import axes_of
from clockdrive.drives.avr_box.settings import steps_per_turn, worm_steps
from clockdrive.errors import InputError

_ARCSEC_PER_TURN = 1_296_000.0


def pec_table(
    configuration: Configuration,
    path: str,
    *,
    harmonics: int = 4,
    assembler: bool = False,
    picture: str | None = None,
) -> Answer:
    """Fit a file of bins and arcseconds, ahead positive; return the table as text, and draw it where asked to.

    Bins are counted on beyond 518 for further turns of the worm, with PEC off as they are measured.

    Raises
    ------
    InputError
        A picture cannot be drawn.
    PecError
        The file cannot be read, or no table can be made of it.
    """
    from mounts.avr_box import pec  # noqa: PLC0415 - numpy takes a moment to load
    from mounts.avr_box.settings import SIDEREAL_DAY_S  # noqa: PLC0415 - likewise
    from mounts.avr_box.timers import TICK_S, tracking_rate  # noqa: PLC0415 - likewise

    axis = axes_of(configuration)[0]
    turn = steps_per_turn(axis)
    arcsec, rate = _ARCSEC_PER_TURN / turn, turn / SIDEREAL_DAY_S
    worm_s = worm_steps(axis) / rate
    bins, ahead = pec.read_measured(path)
    times = [number * TICK_S for number in bins]
    measured_worm_s = worm_steps(axis) / tracking_rate()  # with PEC off the worm turns slower
    error = pec.fitted(times, [each / arcsec for each in ahead], measured_worm_s, harmonics)
    values = pec.table(error, rate, worm_s)
    if picture is not None:
        _draw(Path(picture), bins, ahead, [error.at(math.tau * k * TICK_S / worm_s) * arcsec for k in range(519)])
    text = pec.as_assembler(values) if assembler else pec.as_c(values)
    amplitudes = [(a * a + b * b) ** 0.5 * arcsec for a, b in zip(error.cosines, error.sines, strict=True)]
    return Answer(
        {
            "ok": True,
            "table": list(values),
            "text": text,
            "amplitudes_arcsec": amplitudes,
            "rms_arcsec": error.rms * arcsec,
            "drift_arcsec_s": error.drift * arcsec,
            "picture": picture,
        }
    )


def _draw(path: Path, bins: list[float], ahead: list[float], fitted: list[float]) -> None:
    try:
        from matplotlib.figure import Figure  # noqa: PLC0415 - an extra
    except ImportError:
        raise InputError("a picture needs matplotlib: pip install 'clockdrive[plots]'") from None
    figure: Any = Figure(figsize=(8.0, 4.0), layout="constrained")
    axes = figure.subplots()
    axes.plot([number % 519 for number in bins], ahead, ".", markersize=3, label="measured")
    axes.plot(range(519), fitted, label="fitted")
    axes.set(xlabel="PEC bin", ylabel="ahead, arcsec", title="Periodic error of the worm")
    axes.legend()
    try:
        figure.savefig(path)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: {error}") from None
