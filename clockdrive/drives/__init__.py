"""The kinds of drives: one folder each, which says what a configuration means for the drive of this kind.

A kind is loaded when it is first asked for, so that a plan for one drive does not load the others.
"""

from importlib import import_module
from typing import cast

from clockdrive.configuration import Configuration
from clockdrive.configuration_keys import DRIVEN, NO_OTHER_DRIVE
from clockdrive.drives.kind import Kind
from clockdrive.errors import ConfigurationError

_HOME = {
    "tc410": "clockdrive.drives.tc410.kind",
    "avr-box": "clockdrive.drives.avr_box.kind",
    "apo": "clockdrive.drives.apo.kind",
    "sdss": "clockdrive.drives.apo.kind",
}


def kind_of(configuration: Configuration) -> Kind:
    """What a configuration's kind of drive is here.

    Raises
    ------
    ConfigurationError
        This version does not drive it.
    """
    name = configuration.drive.kind
    if name not in DRIVEN:
        text = f'[drive] kind = "{name}": {NO_OTHER_DRIVE}; its keys are checked all the same'
        raise ConfigurationError(configuration.source, [text])
    return cast("Kind", import_module(_HOME[name]))
