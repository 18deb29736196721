"""How a command ends, for whoever started it."""

DONE, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130
