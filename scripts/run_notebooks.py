"""`python -m scripts.run_notebooks [--check] [FILE ...]`: execute the notebooks and write what they show into them.

With `--check` nothing is written: a notebook fails where a cell fails or warns, where a number that stands in it is
not the one computed now, where its outputs are too large, or where more than cells and outputs are kept in it. Each
runs in a real kernel, in its own folder, with a state and a profile of its own, and reaches nothing but loopback.
"""

import json
import os
import re
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from itertools import zip_longest
from pathlib import Path
from typing import Any

import nbformat
from matplotlib.font_manager import fontManager
from nbclient import NotebookClient

from scripts.sections import CHECKOUT

NOTEBOOKS = CHECKOUT / "notebooks"
LARGEST = 300_000  # bytes of a notebook with its outputs
PATIENCE_S = 60  # of a notebook
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}
ROUNDING = 1e-6  # of numbers with more digits than another processor gives alike
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
TABLE = re.compile(r' id="table\d+"')
ONLY_LOOPBACK = """
import sys
def _only_loopback(event, arguments):
    if event == "socket.connect" and isinstance(arguments[1], tuple):
        host = arguments[1][0]
    elif event == "socket.getaddrinfo":
        host = arguments[0]
    else:
        return
    if host not in (None, "", "localhost", "::1") and not str(host).startswith("127."):
        raise PermissionError(f"a notebook must not reach {host}")
sys.addaudithook(_only_loopback)
"""


def executed(notebook: nbformat.NotebookNode, folder: Path) -> nbformat.NotebookNode:
    """Return the notebook as a kernel of its own leaves it, working in `folder`; cells go on after one that fails."""
    fresh = cleaned(notebook)
    with tempfile.TemporaryDirectory() as own:
        client = NotebookClient(
            fresh,
            timeout=PATIENCE_S,
            kernel_name="python3",
            allow_errors=True,
            record_timing=False,
            resources={"metadata": {"path": str(folder)}},
            extra_arguments=[
                f"--IPKernelApp.exec_lines={json.dumps([f'exec({ONLY_LOOPBACK!r})'])}",
                "--IPKernelApp.log_level=ERROR",
            ],
        )
        client.execute(env={**os.environ, "IPYTHONDIR": own, "CLOCKDRIVE_STATE__PATH": str(Path(own, "state"))})
    return cleaned(fresh, keep=True)


def cleaned(notebook: nbformat.NotebookNode, *, keep: bool = False) -> nbformat.NotebookNode:
    """Return the cells alone, and with `keep` their outputs; nothing of when, where and by what they ran."""
    cells = []
    for number, cell in enumerate(notebook.cells, start=1):
        own = {"id": f"cell-{number}", "cell_type": cell.cell_type, "metadata": {}, "source": cell.source}
        if cell.cell_type == "code":
            outputs = _joined(_cleaned_output(each) for each in cell.outputs)
            own |= {"execution_count": cell.execution_count if keep else None, "outputs": outputs if keep else []}
        cells.append(own)
    return nbformat.from_dict({"cells": cells, "metadata": METADATA, "nbformat": 4, "nbformat_minor": 5})


def _joined(outputs: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Outputs in which what one stream says in pieces, as the kernel's timing will have it, is one."""
    joined: list[dict[str, Any]] = []
    for output in outputs:
        before = joined[-1] if joined else {}
        if output["output_type"] == "stream" and before.get("name") == output["name"]:
            before["text"] += output["text"]
        else:
            joined.append(output)
    return joined


def _cleaned_output(output: nbformat.NotebookNode) -> dict[str, Any]:
    """An output without metadata, and without the number of an object in memory that astropy gives its tables."""
    if "data" not in output:
        return dict(output)
    data = {kind: TABLE.sub("", each) if kind == "text/html" else each for kind, each in output.data.items()}
    return {**output, "data": data, "metadata": {}}


def faults(notebook: nbformat.NotebookNode) -> Iterator[str]:
    """Yield what went wrong in an executed notebook, a sentence each."""
    for number, output in outputs_of(notebook):
        if output.output_type == "error":
            yield f"cell {number} fails: {output.ename}: {output.evalue}"
        elif output.get("name") == "stderr":
            yield f"cell {number} warns: {output.text.strip()}"
    size = len(nbformat.writes(notebook))
    if size > LARGEST:
        yield f"it has {size} bytes with its outputs, at most {LARGEST} are allowed: draw less"


def differences(kept: nbformat.NotebookNode, fresh: nbformat.NotebookNode) -> Iterator[str]:
    """Yield where a notebook shows what its code does not: texts but for the last digit, pictures by kind."""
    if nbformat.writes(cleaned(kept, keep=True)) != nbformat.writes(kept):
        yield "more than cells and outputs is kept in it"
    for one, other in zip_longest(outputs_of(kept), outputs_of(fresh)):
        if one is None or other is None or one[0] != other[0]:
            yield f"cell {(one or other)[0]} shows more or less than it did"
            return
        shown, computed = texts(one[1]), texts(other[1])
        if shown.keys() != computed.keys():
            yield f"cell {one[0]} shows {', '.join(computed)} where it showed {', '.join(shown)}"
        yield from (
            f"cell {one[0]} shows {shown[kind][:200]!r}, computed is {computed[kind][:200]!r}"
            for kind in shown.keys() & computed.keys()
            if not same(shown[kind], computed[kind])
        )


def same(shown: str, computed: str) -> bool:
    """Say whether two texts are the same but for one unit of the last digit of each number."""
    if NUMBER.split(shown) != NUMBER.split(computed):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(computed), strict=True)
    return all(abs(float(a) - float(b)) <= max(1.01 * unit(a), 1.01 * unit(b), ROUNDING * float(a)) for a, b in pairs)


def unit(number: str) -> float:
    """One unit of the last digit of a number as it is written."""
    mantissa, _, exponent = number.lower().partition("e")
    return float(f"1e{int(exponent or 0) - len(mantissa.partition('.')[2])}")


def texts(output: nbformat.NotebookNode) -> dict[str, str]:
    """What an output shows by kind: text as it is, nothing of a picture but that it is there."""
    if output.output_type == "stream":
        return {output.name: output.text}
    if output.output_type == "error":
        return {"error": output.evalue}
    pictured = {kind for kind in output.data if kind.startswith("image/")}
    of_picture = pictured | ({"text/plain"} if pictured else set())  # <Figure size …>
    return {kind: "" if kind in of_picture else str(text) for kind, text in output.data.items()}


def outputs_of(notebook: nbformat.NotebookNode) -> list[tuple[int, Any]]:
    """All outputs, each with the number of its cell."""
    found: list[tuple[int, Any]] = []
    for number, cell in enumerate(notebook.cells, start=1):
        found += [(number, output) for output in cell.get("outputs", ())]
    return found


def processor_s() -> float:
    """Processor time of the kernels that have ended, seconds; 0 on Windows."""
    return os.times().children_user + os.times().children_system


def main(arguments: list[str]) -> int:
    """Execute and write, or check, the notebooks named, else all; return the exit code."""
    check = "--check" in arguments
    paths = [Path(each).resolve() for each in arguments if each != "--check"] or sorted(NOTEBOOKS.glob("*.ipynb"))
    os.environ["JUPYTER_PREFER_ENV_PATH"] = "1"  # the kernel of this environment, whatever the user has
    fontManager.findfont("sans")  # builds the cache of fonts where there is none, which would be a warning in a cell
    failed = 0
    for path in paths:
        kept = nbformat.read(path, as_version=4)
        began, used = time.perf_counter(), processor_s()
        fresh = executed(kept, path.parent)
        seconds, of_processor = time.perf_counter() - began, processor_s() - used
        wrong = [*faults(fresh), *(differences(kept, fresh) if check else ())]
        if not check:
            path.write_text(nbformat.writes(fresh) + "\n", encoding="utf-8")
        size = len(nbformat.writes(fresh)) / 1000.0
        print(f"{path.name}: {seconds:.1f} s, {of_processor:.1f} s of a processor, {size:.0f} kB", *wrong, sep="\n  ")
        failed += bool(wrong)
    if failed and check:
        print("run python -m scripts.run_notebooks, and look at what has changed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
