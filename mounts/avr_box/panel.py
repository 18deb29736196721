"""What a person can read of a stepper box and set in it by hand."""

from collections.abc import Mapping, Sequence

from mounts.avr_box import commands
from mounts.avr_box.axis import BoxAxis
from mounts.avr_box.box import Box
from mounts.avr_box.encoders import EncoderSeen
from mounts.avr_box.tick_clock import TickClock
from mounts.avr_box.tick_watch import TickWatch


class Panel:
    """Of one box.

    Parameters
    ----------
    box : Box
        Is asked and told.
    axes : sequence of BoxAxis
        Have the encoders, where there are some.
    ticks, watch : TickClock, TickWatch
        Know the clock of the box, and begin anew where its bin was set.
    """

    def __init__(self, box: Box, axes: Sequence[BoxAxis], ticks: TickClock, watch: TickWatch) -> None:
        self._box, self._axes, self._ticks, self._watch = box, axes, ticks, watch

    def registers(self) -> Mapping[str, str]:
        """All that it can be asked, and what is known of its clock."""
        pec = self._watch.ask()
        shown = {"pec_bin": str(pec.pair.one), "pec_zero": str(pec.pair.two)}
        if self._axes[0].encoder is not None:
            said = self._box.ask(commands.ASK_ENCODERS).pair
            shown |= {"encoder_1": str(said.one), "encoder_2": str(said.two)}
        doubt = self._ticks.crystal_uncertainty * 1e6
        return shown | {"crystal": f"{(self._ticks.crystal - 1.0) * 1e6:+.1f} ± {doubt:.1f} ppm"}

    def set_pec(self, name: str, number: int) -> None:
        """Set `pec_bin` or `pec_zero`.

        Raises
        ------
        AvrBoxError
            There is no such bin, or its bytes could be taken for a command.
        """
        self._box.send(commands.set_bin(number) if name == "pec_bin" else commands.set_zero(number))
        self._ticks.forget()

    def encoders(self, *, synchronised: bool) -> tuple[EncoderSeen, ...]:
        """What both encoders say, and where that is; nothing where none are fitted.

        Raises
        ------
        TransportError
            They do not answer.
        """
        if self._axes[0].encoder is None:
            return ()
        told = self._box.ask(commands.ASK_ENCODERS)
        seen = []
        for axis, said in zip(self._axes, told.pair, strict=True):
            encoder = axis.encoder
            if encoder is not None:
                here = encoder.steps(said) if encoder.zero is not None and synchronised else None
                seen.append(EncoderSeen(said, encoder.step, here, axis.at(told.middle).counts))
        return tuple(seen)
