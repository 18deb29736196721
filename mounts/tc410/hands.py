"""The hands that a stop takes off the axes: joystick and autoguiders, whose held deflection "all stop" does not end.

Their bits of the velocity control are cleared, and set again as soon as their inputs rest, or are others than at
the stop: let go, or pushed another way. A stick that is held as it was moves nothing.
"""

from collections.abc import Collection, Mapping

from mounts.tc410.registers import by_name
from mounts.tc410.unit import Unit

_ANALOGUE = {  # ADC registers by source
    "joystick": ("joystick_adc_axis1", "joystick_adc_axis2"),
    "analogue_autoguider": ("autoguider_adc_axis1", "autoguider_adc_axis2"),
}
_DIGITAL = "digital_autoguider"
_SOURCES = (*_ANALOGUE, _DIGITAL)  # a paddle has no bit
_DIRECTIONS = {f"autoguider_{direction}" for direction in ("north", "south", "east", "west")}
_CENTRE, _AT_REST = 128.0, 4.0  # ADC steps of 256
_ANOTHER = 16.0  # ADC steps: more than a hand trembles


class Hands:
    """Which hands a unit is kept from.

    Parameters
    ----------
    unit : Unit
        Whose inputs they are.
    barred : int
        Bits of the velocity control that were cleared and not given back.
    """

    def __init__(self, unit: Unit, barred: int = 0) -> None:
        self._unit = unit
        self.barred = barred
        """Bits of the velocity control to give back."""
        self._inputs: Mapping[str, float] | None = None  # as first seen after that

    def bar(self, moving: Collection[str], control: int) -> bool:
        """Bar the hands among what moves the axes and `control` lets; return whether there is one."""
        bits = sum(_mask(source) for source in _SOURCES if source in moving) & control
        if bits:
            self.barred, self._inputs = self.barred | bits, None
        return bool(bits)

    def let_go(self) -> bool:
        """Whether every barred hand rests, or one of them does something else than when it was barred."""
        inputs = self._unit.read("digital_inputs", "autoguider_adc_axis2")
        before, self._inputs = self._inputs or inputs.values, self._inputs or inputs.values
        pushed = _DIRECTIONS.intersection(by_name("digital_inputs").asserted(int(inputs["digital_inputs"])))
        rest, changed = not (self.barred & _mask(_DIGITAL) and pushed), False
        if self.barred & _mask(_DIGITAL):
            changed = inputs["digital_inputs"] != before["digital_inputs"]
        for source, names in _ANALOGUE.items():
            if self.barred & _mask(source):
                rest = rest and all(abs(inputs[name] - _CENTRE) <= _AT_REST for name in names)
                changed = changed or any(abs(inputs[name] - before[name]) > _ANOTHER for name in names)
        return rest or changed

    def given_back(self) -> None:
        """The unit takes them again."""
        self.barred, self._inputs = 0, None


def _mask(source: str) -> int:
    return by_name("velocity_control").mask(source)
