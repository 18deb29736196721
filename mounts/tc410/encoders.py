"""Absolute encoders: where the axes are, after a power-cycle as well (manual, 4.7.4).

A reading is n/65536 of a turn, from its zero and against the axis where the encoder is reversed; it says nothing of
whole turns. It is believed only when it has agreed with a synchronised position where a reversed encoder would have
read otherwise, or stands where reversal makes no difference: an encoder whose zero or sense is configured wrongly is
told, never pointed by.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from mounts.tc410.registers import gray_to_binary

if TYPE_CHECKING:
    from mounts.tc410.unit import Unit  # what an encoder means is asked without a link as well

TURN = 0x10000  # units of a reading
_ARCSEC_PER_TURN = 1_296_000.0
_TOLERANCE = 2.0  # times the uncertainty: encoder and position are each known to that, and gears are not perfect

Belief = Literal["unproved", "proved", "refuted"]
_BELIEFS: tuple[Belief, ...] = ("unproved", "proved", "refuted")


@dataclass(frozen=True)
class Encoder:
    """The encoder of one axis as configured.

    Parameters
    ----------
    bits : int
        14 or 16; the lower bits of a reading are 0.
    counts_per_turn : float
        Motor counts in a turn of the axis.
    zero : int
        The reading where the motor position is `zero_counts`.
    zero_counts : int
        The centre count, or count 0.
    reversed : bool
        The encoder counts against the motor.
    """

    bits: int
    counts_per_turn: float
    zero: int
    zero_counts: int
    reversed: bool = False

    @property
    def uncertainty_counts(self) -> float:
        """One step of the encoder: 20″ with 16 bits, 79″ with 14."""
        return self.counts_per_turn / 2.0**self.bits

    @property
    def uncertainty_arcsec(self) -> float:
        """One step of the encoder."""
        return _ARCSEC_PER_TURN / 2.0**self.bits

    def counts(self, reading: int, near: float, *, reversed: bool | None = None) -> float:  # noqa: A002 - the term
        """Position in counts, of those a whole turn apart the one nearest to `near`."""
        backwards = self.reversed if reversed is None else reversed
        turns = (self._of_its_bits(reading) - self.zero) / TURN
        base = self.zero_counts + (-turns if backwards else turns) * self.counts_per_turn
        return base + round((near - base) / self.counts_per_turn) * self.counts_per_turn

    def zero_for(self, reading: int, counts: float) -> int:
        """The zero with which `reading` means `counts`."""
        turned = round((counts - self.zero_counts) / self.counts_per_turn * TURN)
        return (self._of_its_bits(reading) + (turned if self.reversed else -turned)) % TURN

    def _of_its_bits(self, reading: int) -> int:
        """The reading without the lower bits, which repeat the last one of a Gray code that ends above them."""
        unused = 16 - self.bits
        return reading >> unused << unused

    def judged(self, reading: int, counts: float, margin: float, before: Belief) -> Belief:
        """What to believe of it after a look at a position known to `margin` counts."""
        tolerance = _TOLERANCE * self.uncertainty_counts + margin
        if abs(self.counts(reading, counts) - counts) > tolerance:
            return "refuted"
        other = self.counts(reading, counts, reversed=not self.reversed)
        if abs(other - counts) > 2.0 * tolerance:
            return "proved"
        return "unproved" if before == "refuted" else before

    def placed(self, reading: int, lowest: float, highest: float, belief: Belief) -> tuple[float, str]:
        """Counts at which the axis stands, and why that cannot be known; the reason is empty when it can."""
        middle = (lowest + highest) / 2.0
        here = self.counts(reading, middle)
        if belief == "refuted":
            return here, "it contradicted the last synchronised position"
        other = self.counts(reading, here, reversed=not self.reversed)
        if belief == "unproved" and abs(other - here) > _TOLERANCE * self.uncertainty_counts:
            return here, "it was never compared with a synchronised position away from its zero"
        around = [here + turns * self.counts_per_turn for turns in range(-12, 13)]
        within = [counts for counts in around if lowest <= counts <= highest]
        if len(within) > 1:
            return here, f"the axis may stand in {len(within)} places a whole turn apart within its limits"
        return (within or [here])[0], ""


@dataclass(frozen=True)
class EncoderReading:
    """One axis's encoder as it reads now."""

    detected: bool
    gray: int  # the raw word
    binary: int

    @property
    def degrees(self) -> float:
        """Angle of the encoder itself."""
        return self.binary / TURN * 360.0


def read_encoder(unit: "Unit", axis: int) -> EncoderReading:
    """Read one encoder, both forms in one request.

    Raises
    ------
    TransportError
        No valid answer.
    """
    name = f"axis{axis}_encoder"
    detected = bool(unit.read(f"{name}_detected")[f"{name}_detected"])
    found = unit.read(f"{name}_raw", name)
    return EncoderReading(detected, found.words[f"{name}_raw"][0], int(found[name]))


def fault(axis: int, encoder: Encoder, reading: EncoderReading) -> str:
    """What is wrong with a reading that cannot be used; empty when nothing is."""
    if not reading.detected:
        return (
            f"axis {axis}: encoder_bits = {encoder.bits}, but the drive detects no encoder (input 0x0{9 + axis:X}); "
            "check its plug and supply, or set encoder_bits = 0"
        )
    if (binary := gray_to_binary(reading.gray)) != reading.binary:
        return (
            f"axis {axis}: the encoder reads 0x{reading.gray:04X} in Gray code, which is {binary}, and "
            f"{reading.binary} in binary; check the wiring of its lines D0 to D15"
        )
    if unused := reading.gray & ((1 << (16 - encoder.bits)) - 1):
        return (
            f"axis {axis}: a {encoder.bits}-bit encoder reads 0x{reading.gray:04X}, with {unused} in unused lines; "
            "connect it to D15 downwards, or set encoder_bits = 16"
        )
    return ""


def beliefs(stored: object) -> tuple[Belief, Belief]:
    """Return the beliefs remembered for both axes; what cannot be read counts as unproved."""
    kept = stored if isinstance(stored, list | tuple) and len(stored) == 2 else ("", "")
    one, two = (next((belief for belief in _BELIEFS if belief == each), _BELIEFS[0]) for each in kept)
    return one, two


class Encoders:
    """The encoders of both axes, and what is believed of them.

    Parameters
    ----------
    unit : Unit
        Whose they are.
    configured : tuple of Encoder or None
        None for an axis without one.
    limits : tuple of (float, float)
        Lowest and highest counts of each axis.
    memory : Mapping
        Holds `as_json` under "encoders" when they were used before.
    """

    def __init__(
        self,
        unit: "Unit",
        configured: tuple[Encoder | None, Encoder | None],
        limits: tuple[tuple[float, float], tuple[float, float]],
        memory: Mapping[str, object],
    ) -> None:
        self._unit = unit
        self.configured = configured
        self._limits = limits
        self._beliefs = list(beliefs(memory.get("encoders")))
        self.notes: tuple[str, ...] = ()
        """What a person should know of them."""

    def as_json(self) -> list[Belief]:
        """Return what the next process must know."""
        return list(self._beliefs)

    def compare(self, counts: tuple[float, float], margin: float) -> None:
        """Compare with a synchronised position, known to `margin` counts, at rest."""
        notes = []
        for i, encoder in enumerate(self.configured):
            if encoder is None:
                continue
            reading = read_encoder(self._unit, i + 1)
            if wrong := fault(i + 1, encoder, reading):
                notes.append(wrong)
                continue
            self._beliefs[i] = encoder.judged(reading.binary, counts[i], margin, self._beliefs[i])
            if self._beliefs[i] == "refuted":
                off = encoder.counts(reading.binary, counts[i]) - counts[i]
                zero = encoder.zero_for(reading.binary, counts[i])
                notes.append(
                    f"axis {i + 1}: the encoder says {off:+.0f} counts from the synchronised position, more than "
                    f"{encoder.uncertainty_arcsec:.0f}″ explain: encoder_zero = {encoder.zero}, encoder_zero_at or "
                    f"encoder_reversed is wrong (encoder_zero = {zero} would agree here); it is not used"
                )
        self.notes = tuple(notes)

    def position(self) -> tuple[tuple[float, float] | None, float, str]:
        """Where the encoders say the axes are: counts, their uncertainty, and why not; the reason is empty if so."""
        found: list[float] = []
        uncertainty = 0.0
        for i, encoder in enumerate(self.configured):
            if encoder is None:
                return None, 0.0, f"axis {i + 1} has no encoder (encoder_bits = 0)"
            reading = read_encoder(self._unit, i + 1)
            if wrong := fault(i + 1, encoder, reading):
                return None, 0.0, wrong
            counts, why = encoder.placed(reading.binary, *self._limits[i], self._beliefs[i])
            if why:
                return None, 0.0, f"the encoder of axis {i + 1} is not used: {why}"
            found.append(counts)
            uncertainty = max(uncertainty, encoder.uncertainty_counts)
        return (found[0], found[1]), uncertainty, ""
