"""The words of an AWR Microstep as it may come from the factory, for a plan without one and for the simulator."""

SIDEREAL = 50.0  # steps a second, of the example of the configuration
_COUNTS = 18000  # of the sidereal rate
_POSITIVE, _ENABLE, _POSTSCALER = 0x2, 0x1, 0x0400
_FORWARD, _BACK = _POSTSCALER | _POSITIVE | _ENABLE, _POSTSCALER | _ENABLE
_STOPPED = _POSTSCALER | _POSITIVE


def factory(
    sidereal: float = SIDEREAL,
    *,
    frequency_unit: float = 1.0,
    acceleration_unit: float = 1.0,
    reversed1: bool = False,
    rate_reference: str = "motor",
    backlash: tuple[int, int] = (0, 0),
) -> dict[int, int]:
    """The words of a unit as it comes: guide 30 %, centre 2×, move 32×, slew 480× sidereal, 1.2 s to full speed.

    Parameters
    ----------
    sidereal : float
        Motor steps a second at sidereal rate.
    frequency_unit, acceleration_unit : float
        Steps a second, and a second squared, of one unit.
    reversed1 : bool
        Larger hour angles are the way of RIGHT.
    rate_reference : str
        Whether guide and centre rates are those of the motor or on the sky.
    backlash : tuple of int
        Steps that either axis takes up.
    """
    ahead, against = (_FORWARD, _BACK) if not reversed1 else (_BACK, _FORWARD)
    with_drive, drive = (1.0, ahead)
    left, right = ("guide_left", "guide_right") if not reversed1 else ("guide_right", "guide_left")
    own = with_drive if rate_reference == "motor" else 0.0
    rates = {
        "drive_ra": (1.0, drive),
        "drive_dec": (1.0, _STOPPED),
        "guide_up": (0.3, _FORWARD),
        "centre_up": (2.0, _FORWARD),
        left: (own + 0.3, ahead),
        right: (abs(own - 0.3), ahead if own > 0.3 else against),
        left.replace("guide", "centre"): (own + 2.0, ahead),
        right.replace("guide", "centre"): (abs(own - 2.0), against),
    }
    order = ("drive_ra", "drive_dec", "guide_up", "guide_right", "guide_left", "centre_up", "centre_right",
             "centre_left")  # fmt: skip
    words = {0x00: 0}
    for i, name in enumerate(order):
        times, flags = rates[name]
        words[1 + 2 * i], words[2 + 2 * i] = round(_COUNTS / times), flags
    to_larger, to_smaller = (0x13, 0x12) if not reversed1 else (0x12, 0x13)
    frequencies = {0x11: 32.0, to_larger: 33.0, to_smaller: 31.0, 0x14: 480.0, 0x15: 480.0}
    words |= {address: max(1, round(times * sidereal / frequency_unit)) for address, times in frequencies.items()}
    words |= {address: max(1, round(400.0 * sidereal / acceleration_unit)) for address in (0x16, 0x17)}
    return words | {0x18: 0, 0x19: backlash[0], 0x1A: backlash[1], 0x3F: 0xC3C3}
