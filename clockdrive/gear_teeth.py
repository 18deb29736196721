"""A gear as its maker states it: a ratio, and the teeth that make it. 16/40 turns as 2/5 does, with other wheels."""

from fractions import Fraction
from typing import Self, SupportsIndex


class GearTeeth(Fraction):
    """The ratio of two wheels, exact like any fraction, that keeps their teeth.

    Parameters
    ----------
    driving, driven : int
        Teeth, or a worm's starts; the ratio is the driven wheel's turns for one of the driving.
    """

    __slots__ = ("teeth",)
    teeth: tuple[int, int]

    def __new__(cls, driving: int, driven: int = 1) -> Self:  # noqa: D102 - as the class says
        ratio = super().__new__(cls, driving, driven)
        ratio.teeth = (driving, driven)
        return ratio

    def __str__(self) -> str:
        return f"{self.teeth[0]}/{self.teeth[1]}"

    def __reduce_ex__(self, protocol: SupportsIndex) -> tuple[type[Self], tuple[int, int]]:
        return type(self), self.teeth

    def __copy__(self) -> Self:
        return self

    def __deepcopy__(self, memo: object) -> Self:
        return self
