"""The notebooks run, and what stands in them is what their code shows; the judge of that finds what is not."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]
NOTEBOOKS = sorted((CHECKOUT / "notebooks").glob("*.ipynb"))
LONGEST_S = 60.0
LARGEST = 300_000

pytestmark = pytest.mark.checkout


def judged(path):
    """Execute a notebook in a kernel of its own and judge it, as `python -m scripts.run_notebooks --check` does."""
    command = [sys.executable, "-m", "scripts.run_notebooks", "--check", str(path)]
    return subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=False, timeout=110)


def notebook(path, *cells, **shown):
    """Write a notebook of these code cells; `cell_2="text"` is what the second one is said to have printed."""
    outputs = {
        int(name.removeprefix("cell_")): [{"output_type": "stream", "name": "stdout", "text": text}]
        for name, text in shown.items()
    }
    written = [
        {"cell_type": "code", "id": f"cell-{n}", "metadata": {}, "source": cell, "execution_count": n,
         "outputs": outputs.get(n, [])}
        for n, cell in enumerate(cells, start=1)
    ]  # fmt: skip
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    metadata = {"kernelspec": kernel, "language_info": {"name": "python"}}
    path.write_text(json.dumps({"cells": written, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}))
    return path


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_within_a_minute_and_shows_what_stands_in_it(path):
    run = judged(path)
    print(run.stdout.strip())
    assert run.returncode == 0, run.stdout + run.stderr
    seconds = float(re.search(r": ([\d.]+) s,", run.stdout)[1])
    assert seconds < LONGEST_S
    assert path.stat().st_size < LARGEST


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_has_pictures_and_as_much_text_as_code(path):
    cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
    kinds = [cell["cell_type"] for cell in cells]
    pictures = [
        output for cell in cells for output in cell.get("outputs", []) if "image/png" in output.get("data", {})
    ]
    assert kinds[0] == "markdown"
    assert "".join(cells[0]["source"]).startswith("# ")
    assert len(pictures) >= 2
    assert kinds.count("markdown") >= kinds.count("code") / 3


def test_what_fails_warns_reaches_out_or_shows_another_number_is_found(tmp_path):
    path = notebook(
        tmp_path / "wrong.ipynb",
        "print('RMS 2.18″ of 46 stars')",
        "import warnings; warnings.warn('look here')",
        "1 / 0",
        "import socket; socket.create_connection(('192.0.2.1', 80), 1.0)",
        "import urllib.request; urllib.request.urlopen('http://telescope.example')",
        "from IPython.display import HTML; HTML('x' * 300_000)",
        cell_1="RMS 2.16″ of 46 stars\n",
    )
    said = judged(path).stdout
    assert "cell 1 shows 'RMS 2.16″ of 46 stars\\n', computed is 'RMS 2.18″ of 46 stars\\n'" in said
    assert re.search("cell 2 warns: .*look here", said)
    assert "cell 3 fails: ZeroDivisionError" in said
    assert "cell 4 fails: PermissionError: a notebook must not reach 192.0.2.1" in said
    assert re.search("cell 5 fails: .*a notebook must not reach telescope.example", said)
    assert re.search(r"it has \d+ bytes with its outputs, at most 300000 are allowed", said)


def test_what_a_stream_says_in_pieces_is_one_however_the_kernel_was_timed():
    import nbformat

    from scripts.run_notebooks import cleaned

    cell = nbformat.v4.new_code_cell("look()")
    cell.outputs = [nbformat.v4.new_output("stream", name="stdout", text=text) for text in ("one\n", "two\n")]
    (found,) = cleaned(nbformat.v4.new_notebook(cells=[cell]), keep=True).cells[0].outputs
    assert (found.name, found.text) == ("stdout", "one\ntwo\n")


def test_a_telescope_on_the_systems_clock_works_beside_the_event_loop_of_a_kernel(tmp_path):
    """Its control thread goes on while a cell awaits, and is called from the loop's thread and from others."""
    path = notebook(
        tmp_path / "live.ipynb",
        "import asyncio, threading\nfrom clockdrive import Telescope\n"
        "assert asyncio.get_running_loop().is_running()\n"
        "scope = Telescope.simulated(overrides={'limits.sun_avoidance_deg': 0.0})",
        "before = scope.status()['axes'][0]['counts']\n"
        "moved = await asyncio.to_thread(scope.jog, 1, -1.0, 0.5)\n"
        "assert moved['axes'][0]['target_counts'] != before",
        "found = await asyncio.gather(*(asyncio.to_thread(scope.status) for _ in range(4)))\n"
        "assert {each['doing'] for each in found} == {'idle'}\n"
        "assert scope.status()['axes'][0]['counts'] != before",
        "names = [thread.name for thread in threading.enumerate()]\n"
        "scope.close()\nprint(names.count('clockdrive control'))",
        cell_4="1\n",
    )
    run = judged(path)
    print(run.stdout.strip())
    assert run.returncode == 0, run.stdout + run.stderr
