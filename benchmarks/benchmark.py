"""A benchmark: a function that measures one number, and the bound that number must keep."""

import time
from collections.abc import Callable
from dataclasses import dataclass

Measure = Callable[[], float | tuple[float, str]]

BENCHMARKS: dict[str, "Benchmark"] = {}


@dataclass(frozen=True)
class Result:
    """One number as it came out, with a remark on how."""

    value: float
    remark: str
    seconds: float  # how long the measurement took


@dataclass(frozen=True)
class Benchmark:
    """A number with its name, unit and bound; without a bound it is only reported."""

    name: str
    title: str
    unit: str
    at_most: float | None
    measure: Measure

    @property
    def command(self) -> str:
        """The command that measures this number alone."""
        return f"python -m benchmarks {self.name}"

    @property
    def bound(self) -> str:
        """The bound in words; empty where there is none."""
        return "" if self.at_most is None else f"≤ {self.at_most:g} {self.unit}".rstrip()

    def run(self) -> Result:
        """Measure."""
        started = time.perf_counter()
        outcome = self.measure()
        value, remark = outcome if isinstance(outcome, tuple) else (outcome, "")
        return Result(value, remark, time.perf_counter() - started)

    def kept(self, result: Result) -> bool:
        """Whether the bound is kept."""
        return self.at_most is None or result.value <= self.at_most

    def shown(self, result: Result) -> str:
        """Return the number with its unit, to three digits."""
        return f"{result.value:#.3g}".rstrip(".") + f" {self.unit}".rstrip()


def benchmark(title: str, *, unit: str, at_most: float | None = None) -> Callable[[Measure], Measure]:
    """Make a function a benchmark; it returns the number, or the number and a remark.

    Parameters
    ----------
    title : str
        What is measured, as it stands in the table.
    unit : str
        Of the number and of the bound; empty for a ratio.
    at_most : float, optional
        The bound.
    """

    def register(measure: Measure) -> Measure:
        name = measure.__name__
        if name in BENCHMARKS:
            raise ValueError(f"two benchmarks are called {name}; rename one")
        BENCHMARKS[name] = Benchmark(name, title, unit, at_most, measure)
        return measure

    return register


def best_seconds(call: Callable[[], object], *, repeats: int = 7, at_least: float = 0.02) -> float:
    """Return the seconds of one `call`: the least of some repeats, each of enough calls to last `at_least` seconds.

    The least, because what disturbs a measurement only ever adds to it.
    """
    number = 1
    while (spent := _seconds(call, number)) < at_least:
        number = max(2 * number, int(1.2 * number * at_least / max(spent, 1e-9)))
    return min(_seconds(call, number) for _ in range(repeats)) / number


def _seconds(call: Callable[[], object], number: int) -> float:
    started = time.perf_counter()
    for _ in range(number):
        call()
    return time.perf_counter() - started
