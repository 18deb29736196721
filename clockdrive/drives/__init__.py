"""The kinds of drives: one folder each, which says what a configuration means for the drive of this kind.

A kind is loaded when it is first asked for, so that a plan for one drive does not load the others.
"""

from importlib import import_module
from typing import cast

from clockdrive.configuration import Configuration
from clockdrive.drives.kind import Kind

_HOME = {
    "tc410": "clockdrive.drives.tc410.kind",
    "avr-box": "clockdrive.drives.avr_box.kind",
    "apo": "clockdrive.drives.apo.kind",
    "sdss": "clockdrive.drives.apo.kind",
    "awr": "clockdrive.drives.awr.kind",
}


def kind_of(configuration: Configuration) -> Kind:
    """What a configuration's kind of drive is here."""
    return cast("Kind", import_module(_HOME[configuration.drive.kind]))
