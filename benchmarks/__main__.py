"""`python -m benchmarks [NAME …] [--markdown]`: measure, print, and fail when a bound is not kept."""

import argparse
import importlib
import os
import pkgutil
import platform
import sys
from pathlib import Path

import benchmarks
from benchmarks.benchmark import BENCHMARKS, Benchmark, Result
from scripts.sections import markdown_table, write_section

README = Path(__file__).resolve().parents[1] / "README.md"


def main(arguments: list[str]) -> int:
    """Run the benchmarks named, or all; return the exit code."""
    for module in pkgutil.iter_modules(benchmarks.__path__):
        if module.name != "__main__":
            importlib.import_module(f"benchmarks.{module.name}")
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=benchmarks.__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"one of {', '.join(BENCHMARKS)}; absent: all")
    parser.add_argument("--markdown", action="store_true", help="also write the table into README.md")
    options = parser.parse_args(arguments)
    if unknown := set(options.names) - set(BENCHMARKS):
        parser.error(f"no benchmark {', '.join(sorted(unknown))}; there are {', '.join(BENCHMARKS)}")
    if options.markdown and options.names:
        parser.error("--markdown writes the whole table: name no benchmark with it")

    print(machine())
    measured = [
        (each, report(each)) for each in BENCHMARKS.values() if not options.names or each.name in options.names
    ]
    if options.markdown:
        write_section(README, "measured", table(measured))
    missed = [each.name for each, result in measured if not each.kept(result)]
    print(f"{len(measured)} measured, {len(missed)} over the bound{': ' if missed else ''}{', '.join(missed)}")
    return 1 if missed else 0


def report(each: Benchmark) -> Result:
    """Measure one and print it."""
    result = each.run()
    verdict = "" if each.kept(result) else "  OVER"
    bound = f" ({each.bound})" if each.bound else ""
    remark = f"; {result.remark}" if result.remark else ""
    print(
        f"{each.title}: {each.shown(result)}{bound}{verdict}{remark}  [{each.command}, {result.seconds:.1f} s]",
        flush=True,
    )
    return result


def table(measured: list[tuple[Benchmark, Result]]) -> str:
    """Return the Markdown table of all that was measured."""
    rows = [
        (each.title, each.shown(result), each.bound, result.remark, f"`{each.command}`") for each, result in measured
    ]
    return f"{machine()}\n\n{markdown_table(('what', 'measured', 'bound', 'remark', 'command'), rows)}"


def machine() -> str:
    """Say what the numbers were measured on."""
    return f"Python {platform.python_version()}, {platform.system()} {platform.machine()}, {os.cpu_count()} cores."


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
