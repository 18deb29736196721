"""Whether each line leads to the axis it should: a controller tells limits, a speed, perhaps a name, and no more.

Soft limits and MAXV that fit the configuration better when axes are exchanged say that their lines are. Differences
that no exchange explains are those of a telescope whose configuration is not up to date.
"""

import re
from collections.abc import Sequence
from itertools import permutations

from mounts.apo.connecting import Setting
from mounts.apo.settings import AxisSettings

_CALLED = {
    "azimuth": re.compile(r"\b(AZ|AZIMUTH)\b", re.IGNORECASE),
    "altitude": re.compile(r"\b(ALT|ALTITUDE)\b", re.IGNORECASE),
    "rotator": re.compile(r"\b(ROT|ROTATOR)\b", re.IGNORECASE),
}
_BETTER = 0.5  # times as far off as it is now, at which an exchange explains the differences
_FITS = 0.02  # of a travel or a speed, within which there is nothing to explain

Found = Sequence[Sequence[Setting]]  # of each axis


def exchanged(axes: Sequence[AxisSettings], identities: Sequence[str], found: Found) -> str:
    """Say which axes seem to be exchanged, with what was told and configured; empty where none do.

    Parameters
    ----------
    axes : sequence of AxisSettings
        As configured.
    identities : sequence of str
        What each controller answered to ID.
    found : sequence of sequences of Setting
        What each controller tells of its limits.
    """
    for axis, text in zip(axes, identities, strict=True):
        if text and (other := _named_otherwise(axis.name, text)):
            return f"the controller of {axis.name} calls itself that of the {other} ({text[:60]!r}); {_REMEDY}"
    order = range(len(axes))
    as_it_is = _misfit(axes, found, tuple(order))
    best = min(permutations(order), key=lambda each: _misfit(axes, found, each))
    if as_it_is <= _FITS or _misfit(axes, found, best) > _BETTER * as_it_is:
        return ""
    i = next(i for i in order if best[i] != i)
    told, meant = "; ".join(_both(each) for each in found[i] if each.differs), axes[best[i]].name
    return (
        f"{axes[i].name}: its controller has {told}: that fits the {meant}, as if the two were exchanged; {_REMEDY}"
    )


_REMEDY = "nothing was moved: check `link` of each axis, then its limits and speed in the configuration"


def _named_otherwise(name: str, text: str) -> str:
    """The axis that an identity names, if it names others only."""
    called = [each for each, pattern in _CALLED.items() if pattern.search(text)]
    return "" if name in called or not called else called[0]


def _misfit(axes: Sequence[AxisSettings], found: Found, order: Sequence[int]) -> float:
    """How far all that is told is off the configuration of the axes in this order, as parts of travel and speed."""
    return sum(_off(axes[order[i]], each) for i, told in enumerate(found) for each in told)


def _off(axis: AxisSettings, told: Setting) -> float:
    if told.name == "MAXV":
        return abs(told.told - axis.max_speed_deg_s) / axis.max_speed_deg_s
    configured = axis.lowest_deg if told.name.startswith("lower") else axis.highest_deg
    return abs(told.told - configured) / (axis.highest_deg - axis.lowest_deg)


def _both(setting: Setting) -> str:
    return f"{setting.name} {setting.told:g} {setting.unit}, configured {setting.configured:g}"
