"""A commented configuration of a drive that somebody else has set up: read from its own registers."""

from clockdrive.configuration import load
from clockdrive.configuration_file import commented_template
from clockdrive.configuration_keys import READABLE
from clockdrive.drives.tc410.registers import keys_from, registers_of, travel_from
from clockdrive.errors import InputError
from mounts.tc410.startup import identify
from mounts.tc410.unit import Unit
from transports.link import Clock
from transports.modbus_ascii import ModbusAscii
from transports.open_link import open_link


def commented_from(link: str, clock: Clock) -> str:
    """Read a TC410's registers, and return the configuration that says the same.

    Raises
    ------
    InputError
        The link is the embedded simulator.
    ConfigurationError, DriveError, TransportError
        What the registers say is impossible; it is no TC410; nothing answers.
    """
    if link == "sim:":
        raise InputError("init --from sim: the embedded simulator has no registers of its own; give a link")
    values: dict[str, object] = {"drive.kind": READABLE, "drive.link": link}
    load(None, {}, values)
    unit = Unit(ModbusAscii(lambda: open_link(link, clock), clock))
    try:
        identify(unit)
        values |= keys_from(unit)
        values |= travel_from(load(None, {}, values), registers_of(unit))
    finally:
        unit.close()
    return commented_template(READABLE, values=values)
