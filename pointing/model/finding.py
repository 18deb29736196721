"""What is wrong with a pointing run, or may be: a name, how bad it is, and a sentence with numbers and remedy."""

from dataclasses import dataclass
from html import escape
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pointing.model.run import PointingRun

Severity = Literal["refuse", "warn"]
_LISTED = 6


@dataclass(frozen=True)
class Finding:
    """A fault found before a fit.

    Parameters
    ----------
    name : str
        Key of the fault.
    severity : str
        `refuse` where a fit would mean nothing, `warn` where it may.
    text : str
        Values, bound and remedy.
    """

    name: str
    severity: Severity
    text: str

    def __str__(self) -> str:
        return f"{self.name}: {self.text}"

    def _repr_html_(self) -> str:
        return f"<p><b>{escape(self.severity)}: {escape(self.name)}</b> {escape(self.text)}</p>"


def listed(run: PointingRun, which: NDArray[np.bool_]) -> str:
    """Name observations: by their lines where the file has them, else by their index from 0."""
    chosen = np.flatnonzero(which)
    has_lines = bool(np.all(run.line[chosen] > 0))
    numbers = [int(run.line[i]) if has_lines else int(i) for i in chosen[:_LISTED]]
    more = f" and {chosen.size - _LISTED} more" if chosen.size > _LISTED else ""
    return f"{'line' if has_lines else 'observation'} {', '.join(map(str, numbers))}{more}"
