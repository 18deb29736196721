"""Why nobody knows where the axes are, or how surely, each with what to do about it."""

SWITCHED = "the box was switched off and on: its encoders began anew; `sync` on a known star"
ABSENT = (
    "no program watched, and without encoders nobody knows whether the box was switched off or the telescope turned "
    "meanwhile; `sync` on a known star"
)
BAD_LINE = (
    "the line lost or mutilated an answer soon after a command, which it may have mutilated too, and there are no "
    "encoders to tell; look at the telescope, switch the box off if it runs, mend cable or port, then `sync`"
)
STEPPED = (
    "the ticks of the box are not where they should be: it was switched off and on, or this computer's clock was set "
    "while axis 1 tracked; `sync` on a known star"
)
MAY_RUN = (
    "the box did not answer after a move, which may have been mutilated, and there are no encoders to see it: both "
    "axes were given moves of 5′ to end it; look at the telescope, switch the box off if it runs, then `sync`"
)
STILL = (
    "the encoder of axis {} stands still, whatever the axis is told: its cable came off, or the motor stands, and "
    "nobody knows how far the axis went; look at the telescope, mend encoder or motor, or do without encoders by "
    "`encoder_counts_per_turn` = 0, then `sync`"
)
SHORT = (
    "by its encoder axis {} has fallen {:.0f}° short of what it was told since the last `sync`: its motor misses "
    "steps, or the encoder slips; look at the telescope, mend that, then `sync`"
)
AGAINST = (
    "the encoder of axis {} says the opposite of what the axis was told: swap its A and B wires, or set `reversed` "
    "of that axis where it turns the wrong way, or `axis_bit` where it moves instead of the other one (`commission` "
    "tells which), then `sync`; where that happens once on a line that loses bytes, a command was mutilated"
)
COUNTS = (
    'by the encoders moves go {} as far as they should, again and again: set `move_count` to "{}", unless '
    "`commission` finds `encoder_counts_per_turn` or the gears wrong, or the box has another `slew_table`; then "
    "`sync`"
)
RUNS_UNENDED = 'axis {} runs, and by `busy = "ignore"` no move ends it: switch the box off now, then on, and `sync`'
RUNS_ON = "axis {} runs on, and a move of 5′ did not end it: switch the box off now, then on, and `sync`"
_CREEPS = "axis {} is where its encoder says, ± 2 counts, not where {} lead: `{}` may be wrong, `commission` tells"
CREEPS = (
    _CREEPS.format(1, "tracking and guiding", "guide_counts"),
    _CREEPS.format(2, "its single steps", "north_reversed"),
)
UNTRIED = (
    "there are no encoders, and no `sync` has shown yet that moves lead where they should: axis 1 may be {:.1f}° "
    "off, axis 2 {:.1f}°, if `move_count`, `axis_bit`, `reversed` or `slew_table` are otherwise; look where it "
    "points, and `sync` on a star after a slew of both axes by a degree or more"
)
