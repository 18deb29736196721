"""The words in which a run is read and advice is asked for; without imports, for the grammar of a command line."""

from typing import Literal, get_args

Places = Literal["apparent", "icrs", "observed"]
"""Frames of an equatorial file's right ascensions; `pointing.model.equatorial_places` says what they are."""
PLACES: tuple[Places, ...] = get_args(Places)

Pole = Literal["true", "refracted"]
"""To which a polar axis shall be turned."""
POLES: tuple[Pole, ...] = get_args(Pole)
