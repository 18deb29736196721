"""What an analogue joystick or autoguider does with its deflection (manual, 4.7.7)."""

LOGARITHMIC = 0x80
MOST_SHIFT = 17  # of the linear range; beyond it no deflection causes a perceptible motion
MODES = (*range(MOST_SHIFT + 1), LOGARITHMIC)
"""The values of use: a shift of the linear speed range, or logarithmic. Bit 6 means nothing, and is written 0."""
