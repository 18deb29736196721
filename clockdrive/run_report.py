"""From a kept pointing run to a fit and a recommendation.

Star places are put into the frame of the mount registers that are in force, as a pointing model adds to those; the
mechanical angles are raw. So an old run can be fitted again for whatever the mount is told today.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from html import escape
from statistics import median
from typing import Any

import numpy as np

from clockdrive.errors import ClockdriveError
from clockdrive.fitting import Fitted, Wanted, fit_run
from clockdrive.run_store import Observation, StoredRun
from clockdrive.state import Zero
from clockdrive.utc import utc
from pointing.limits import separation
from pointing.model.cross_validation import cv_sky_rms_arcsec, fewest_predicted
from pointing.model.fit import fit
from pointing.model.fitted import Fit
from pointing.model.place import MountKind
from pointing.model.polar_alignment import angle_text, end_of_axis
from pointing.model.run import PointingRun
from pointing.mount import Mount, MountType
from pointing.site import Weather
from pointing.vectors import Vector, equatorial_to_horizon, from_azimuth_altitude

_UNEXPLAINED = 3.0  # times the scatter of the looks, beyond which stars scatter for another reason
_MISTRUSTED = 6.0  # σ, where neighbours share an error: 4.6 were seen of a term that is not there
_FEW = 20  # with which no more than the standard terms are told apart
_SCATTER_ARCSEC = 2.0  # of any star: worm, air, flexure; a look that is surer than that does not rule the fit
_ALIGN_FIRST_ARCSEC = 600.0  # a polar axis farther off is put right before it is modelled
_INDEX: dict[MountKind, str] = {"equatorial": "IH ID", "altazimuth": "IA IE"}
_TYPES: dict[MountKind, MountType] = {"equatorial": MountType.EQUATORIAL_FORK, "altazimuth": MountType.ALTAZ_FORK}


class TooFewStars(ClockdriveError):  # noqa: N818 - what was found
    """A run cannot be fitted yet."""


@dataclass(frozen=True, eq=False)
class RunReport:
    """A pointing run, what it says of the telescope, and what to do.

    Parameters
    ----------
    stored : StoredRun
        The run as it is kept.
    run : PointingRun
        What was fitted.
    fitted : Fitted
        The fit, with what was found of the run and how its terms were chosen.
    cross_validation_arcsec : float
        Sky RMS of patches of the sky predicted by a fit of all others: what blind pointing will be like.
    before_arcsec : float
        Sky RMS with the zero points of the axes alone.
    notes : tuple of str
        What losses of the position mean for this run, a sentence each.
    registers : tuple of float
        The mount registers X and Y on which the model comes, radians.
    """

    stored: StoredRun
    run: PointingRun
    fitted: Fitted
    cross_validation_arcsec: float
    before_arcsec: float
    notes: tuple[str, ...] = ()
    registers: tuple[float, float] = (0.0, 0.0)

    @property
    def name(self) -> str:
        """Of the run."""
        return self.stored.name

    @property
    def fit(self) -> Fit:
        """The fit itself: coefficients, plots, `save`."""
        return self.fitted.fit

    @property
    def recommendation(self) -> tuple[str, ...]:
        """What to do, a sentence each."""
        names = " ".join(each.name for each in self.fit.model.terms)
        there, elsewhere = f"{self.fit.sky_rms_arcsec:.1f}″ RMS", f"{self.cross_validation_arcsec:.1f}″"
        said = [
            (
                f"point with {names}: {there} on these {self.fit.n} stars, {elsewhere} where none was observed; "
                f"{self.before_arcsec:.1f}″ without a model"
            ),
            *self._axis(),
        ]
        if self.fit.n < _FEW:
            said.append(f"{self.fit.n} stars tell little apart: append {_FEW - self.fit.n} or more")
        said += self._scatter()
        if self.stored.skipped:
            skipped = _counted(len(self.stored.skipped), "place")
            said.append(f"skipped: {skipped}; `pointing-run show {self.name}` says why")
        said += self.notes
        write = f"`pointing-run fit {self.name} -o model.mod`"
        said.append(f"{write} writes the model, which `[mount] pointing_model` puts in force")
        return tuple(said)

    def _scatter(self) -> list[str]:
        """What ± means where stars scatter by more than their witness does."""
        looked = [each.sigma_arcsec for each in self.stored.observations if each.sigma_arcsec > 0.0]
        found = self.fit.popn_sd_arcsec
        if not looked or not _UNEXPLAINED * math.hypot(median(looked), _SCATTER_ARCSEC) < found < math.inf:
            return []
        scatter = f"stars scatter by {found:.1f}″ where their witness is good to {median(looked):.1f}″"
        why = "something that no term explains, as the worm, of which neighbours have the same part"
        so = f"each ± holds for independent errors, so mistrust terms below {_MISTRUSTED:g} ±"
        return [f"{scatter}: {why}; {so}"]

    def _axis(self) -> list[str]:
        """What to do first where the polar axis is far off."""
        model = self.fit.model
        if not {each.name for each in model.terms} & {"MA", "ME"}:
            return []
        pole = equatorial_to_horizon((0.0, 0.0, -1.0 if model.latitude < 0.0 else 1.0), model.latitude)
        arcsec = math.degrees(separation(end_of_axis(model), pole)) * 3600.0
        if arcsec < _ALIGN_FIRST_ARCSEC:
            return []
        off = angle_text(arcsec)
        why = "the model takes that, and the field turns while it tracks"
        return [f"the polar axis is {off} off: {why}; `polar-align` puts it right, and then take the run again"]

    @property
    def text(self) -> str:
        """The fit, what to beware of, and what to do."""
        findings = (f"beware: {each}" for each in self.fitted.findings)
        return "\n".join((repr(self.fit), *findings, *self.recommendation))

    @property
    def json(self) -> dict[str, Any]:
        """As `pointing-run --json` has it."""
        return {
            **self.fitted.json,
            "run": run_json(self.stored),
            "cross_validation_arcsec": self.cross_validation_arcsec
            if math.isfinite(self.cross_validation_arcsec)
            else None,
            "before_arcsec": self.before_arcsec,
            "recommendation": list(self.recommendation),
        }

    def __repr__(self) -> str:
        return f"<RunReport of {self.name}>\n{self.text}"

    def _repr_html_(self) -> str:
        items = "".join(f"<li>{escape(each)}</li>" for each in self.recommendation)
        return f"{self.fit._repr_html_()}<ul>{items}</ul>"


def report_of(
    stored: StoredRun,
    registers: tuple[float, float] = (0.0, 0.0),
    wanted: Wanted | None = None,
    zero: Zero | None = None,
) -> RunReport:
    """Fit a kept run.

    Parameters
    ----------
    stored : StoredRun
        The run.
    registers : tuple of float
        The mount registers X and Y on which the model shall come, radians.
    wanted : Wanted, optional
        Which terms, and how; by default they are chosen, and what does not belong is masked.
    zero : Zero, optional
        What axis angles are counted from today, as for `pointing_run`.

    Raises
    ------
    TooFewStars
        There are not stars enough.
    PointingError
        A fit of it would mean nothing; says what is wrong.
    """
    run, wanted = pointing_run(stored, registers, zero), wanted or Wanted(by_run=True)
    kept, k = int(np.count_nonzero(run.masked(wanted.mask).kept)), wanted.free(run.mount)
    if kept < (needed := fewest_predicted(k)):
        raise TooFewStars(
            f"the run {stored.name} has {_counted(kept, 'star')} to fit, "
            f"{_counted(len(stored.skipped), 'place')} skipped; a fit of {_counted(k, 'term')} needs {needed}, and "
            "20 to 50 make a good one: "
            f"{'resume it or append to it' if stored.pending or stored.skipped else 'append to it'}"
        )
    if wanted.by_run:
        wanted = replace(wanted, auto=kept >= _FEW, outliers=kept >= _FEW)
    fitted = fit_run(run, wanted)
    return RunReport(
        stored, run, fitted,
        cv_sky_rms_arcsec(fitted.fit.run, fitted.fit.model), fit(fitted.fit.run, _INDEX[run.mount]).sky_rms_arcsec,
        _notes(stored, zero), registers,
    )  # fmt: skip


def _counted(n: int, what: str) -> str:
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def pointing_run(
    stored: StoredRun, registers: tuple[float, float] = (0.0, 0.0), zero: Zero | None = None
) -> PointingRun:
    """The observations of a kept run as fits read them, masked ones included.

    Angles are brought onto the zero points of today, by what syncs have moved them since. Where the position was lost
    in between nothing is known of that: then those of the last observation serve, and what was observed before such a
    loss is masked. An observation counts by 1 / (σ² + s²), the best one 1, with σ of its look and s of any star.
    """
    mount = Mount(_TYPES[stored.mount], math.radians(stored.latitude_deg), *registers)
    seen = stored.observations
    zeros = [zero_of(each) for each in seen]
    today = _reference(zeros, zero)
    star1, star2 = np.array([mount.axes(_direction(each), "normal") for each in seen]).reshape(-1, 2).T
    moved = [_moved(each, today) for each in zeros]
    axis1, axis2 = (
        np.radians([np.add(each.axes_deg, by) for each, by in zip(seen, moved, strict=True)]).reshape(-1, 2).T
    )
    known = [each is None or each.lost == today.lost for each in zeros]
    variance = np.array([each.sigma_arcsec**2 + _SCATTER_ARCSEC**2 for each in seen])
    return PointingRun(
        stored.mount,
        mount.latitude,
        star1,
        star2,
        axis1,
        axis2,
        weight=np.array([each.weight for each in seen]) * variance.min(initial=math.inf) / variance,
        kept=np.array([not each.masked and counts for each, counts in zip(seen, known, strict=True)], bool),
        time=np.array([math.nan if each.time is None else each.time for each in seen], float),
        caption=stored.name,
        date=datetime.fromtimestamp(stored.began, UTC).date(),
        weather=_weather(seen),
    )


def zero_of(seen: Observation) -> Zero | None:
    """What the angles of an observation are counted from; None of a run from elsewhere, which nothing moves."""
    row = seen.in_force.get("zero")
    return None if row is None else Zero(int(row["lost"]), (float(row["moved_deg"][0]), float(row["moved_deg"][1])))


def _reference(zeros: Sequence[Zero | None], today: Zero | None) -> Zero:
    """Today's zero points where the run can be brought onto them, else those of its last observation."""
    known = [each for each in zeros if each is not None]
    if not known or (today is not None and any(each.lost == today.lost for each in known)):
        return today or Zero()
    return known[-1]


def _notes(stored: StoredRun, today: Zero | None) -> tuple[str, ...]:
    """What losses of the position mean for a fit."""
    zeros = [zero_of(each) for each in stored.observations]
    reference = _reference(zeros, today)
    before = sum(each is not None and each.lost != reference.lost for each in zeros)
    said = []
    if before:
        stars = _counted(before, "star")
        said.append(f"left out: {stars}, seen before the position was lost: their angles mean other places")
    if today is not None and today.lost != reference.lost:
        said.append("the position was lost after this run: put its model in force, then `sync` on a star")
    return tuple(said)


def _moved(then: Zero | None, today: Zero) -> tuple[float, float]:
    """By how much syncs have moved the angles since, degrees."""
    if then is None or then.lost != today.lost:
        return 0.0, 0.0
    one, two = (now - before for now, before in zip(today.moved_deg, then.moved_deg, strict=True))
    return one, two


def worst(report: RunReport, count: int = 1) -> tuple[int, ...]:
    """Indices of the observations that lie farthest from the fit, counted from 0.

    What the fit has found not to belong is among them; what was masked before is not.
    """
    dx, dy = report.fit.residuals
    there = report.fit.weight > 0.0
    there[[each.index for each in report.fit.outliers]] = True
    far = np.where(there, np.hypot(dx, dy), -1.0)
    return tuple(int(i) for i in np.argsort(-far)[:count] if far[i] >= 0.0)


def run_json(stored: StoredRun) -> dict[str, Any]:
    """A kept run as plain values."""
    return {
        "name": stored.name,
        "began_utc": utc(stored.began),
        "mount": stored.mount,
        "settings": dict(stored.settings),
        "planned": len(stored.pending),
        "observed": len(stored.observations),
        "masked": [i for i, each in enumerate(stored.observations) if each.masked],
        "skipped": [
            {
                "number": each.number,
                "azimuth_deg": math.degrees(each.place.azimuth) % 360.0,
                "altitude_deg": math.degrees(each.place.altitude),
                "posture": each.place.posture,
                "reason": each.reason,
            }
            for each in stored.skipped
        ],
    }


def stored_of(run: PointingRun, name: str, began: float) -> StoredRun:
    """A run from a file, to be kept beside one's own."""
    mount = Mount(_TYPES[run.mount], run.latitude)
    seen = []
    for i in range(len(run)):
        x, y, z = mount.observed(float(run.star1[i]), float(run.star2[i]))
        time = float(run.time[i])
        seen.append(
            Observation(
                None if math.isnan(time) else time, None,
                (math.degrees(run.axis1[i]), math.degrees(run.axis2[i])),
                "beyond" if run.beyond[i] else "normal",
                math.degrees(math.atan2(y, -x)) % 360.0, math.degrees(math.atan2(z, math.hypot(x, y))), 0.0,
                run.caption, weight=float(run.weight[i]), masked="" if run.kept[i] else "in the file",
            )
        )  # fmt: skip
    settings = {"imported": run.source, "caption": run.caption}
    return StoredRun(name, began, run.mount, math.degrees(run.latitude), settings, (), tuple(seen))


def _direction(seen: Observation) -> Vector:
    return from_azimuth_altitude(math.radians(seen.azimuth_deg), math.radians(seen.altitude_deg))


def _weather(seen: Sequence[Observation]) -> Weather | None:
    airs: list[Mapping[str, Any]] = [each.weather for each in seen if each.weather]
    return Weather(**airs[len(airs) // 2]) if airs else None
