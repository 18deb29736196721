"""The pages say what the code does: tables are those the code reads, and examples work."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from simulated_runs import TRUTH, simulated_run

from clockdrive.cli.parser import parser, shielded
from clockdrive.configuration import load
from pointing.model.tpoint_file import write_tpoint

CHECKOUT = Path(__file__).resolve().parents[1]
PAGES = sorted([*CHECKOUT.glob("*.md"), *(CHECKOUT / "docs").rglob("*.md")])

pytestmark = pytest.mark.checkout


def blocks(language: str) -> list[pytest.param]:
    """Return the code blocks of all pages in `language`."""
    return [
        pytest.param(block, id=f"{page.relative_to(CHECKOUT)}-{number}")
        for page in PAGES
        for number, block in enumerate(
            re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
        )
    ]


@pytest.mark.parametrize("script", ["docs_tables", "chain_drawing", "example_runs"])
def test_what_the_pages_show_of_the_code_is_that_of_the_code(script):
    command = [sys.executable, "-m", f"scripts.{script}", "--check"]
    run = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=False, timeout=60)
    assert run.returncode == 0, run.stdout + run.stderr


def test_every_picture_is_shown_and_small():
    shown = [name for page in PAGES for name in re.findall(r"!\[[^\]]+\]\(pictures/(.+?)\)", page.read_text("utf-8"))]
    pictures = {path.name: path.stat().st_size for path in (CHECKOUT / "docs" / "pictures").iterdir()}
    print(pictures)
    assert sorted(shown) == sorted(pictures)
    assert max(pictures.values()) < 100_000


def test_the_published_fits_of_the_page_are_those_measured(shared):
    command = [sys.executable, "-m", "scripts.published_fits", "--check"]
    environment = {**os.environ, "CLOCKDRIVE_SHARED": str(shared.resolve())}
    run = subprocess.run(
        command, cwd=CHECKOUT, env=environment, capture_output=True, text=True, check=False, timeout=60
    )
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("block", blocks("toml"))
def test_every_configuration_shown_is_accepted(block, tmp_path):
    file = tmp_path / "telescope.toml"
    file.write_text(block, encoding="utf-8")
    load(file, environment={}, overrides={})


@pytest.mark.parametrize("block", blocks("python"))
def test_every_python_example_is_python(block):
    compile(block, "example", "exec")


def test_the_examples_of_the_python_page_run_in_their_order(tmp_path, monkeypatch):
    monkeypatch.setenv("CLOCKDRIVE_STATE__PATH", str(tmp_path))
    page = (CHECKOUT / "docs" / "python.md").read_text(encoding="utf-8")
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        exec(compile(block, "docs/python.md", "exec"), names)  # noqa: S102 - our own page
    assert names["arrival"]["slews"] == 1
    assert names["plan"].eta.to_value("s") > 0.0
    assert "horizon" in str(names["told"])
    assert names["owner"] is None
    assert 0.0 <= names["azimuth"] <= 360.0


def test_the_examples_of_the_page_on_pointing_models_run_in_their_order(tmp_path, monkeypatch):
    import matplotlib.pyplot as plt

    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    write_tpoint(simulated_run("fork", 40.0, TRUTH["fork"], 40, np.random.default_rng(1)).run, tmp_path / "run.dat")
    page = (CHECKOUT / "docs" / "pointing-models.md").read_text(encoding="utf-8")
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL):
        exec(compile(block, "docs/pointing-models.md", "exec"), names)  # noqa: S102 - our own page
    plt.close("all")
    assert (tmp_path / "model.mod").read_text(encoding="utf-8").startswith("Pointing run")
    assert len(names["table"]) == 40
    assert 0.0 < names["place"].sigma.to_value("arcsec") < 5.0


def command_lines() -> list[pytest.param]:
    """Return every line of the pages that a person would type to `clockdrive`."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        lines = re.findall(r"^(?:.*&& )?(?:\$ )?(?:\S*/)?(clockdrive [^&\n]+)$", text, re.MULTILINE)
        lines += re.findall(r"`(clockdrive [^`\n]+)`", text)
        found += [(page.relative_to(CHECKOUT), re.split(r" [#>|] ?", line)[0].strip()) for line in lines]
    return [pytest.param(line, id=f"{page} {line}") for page, line in dict.fromkeys(found) if not is_prose(line)]


def is_prose(line: str) -> bool:
    """Say whether a line is of the layers' picture, or only hints at a command."""
    return bool(re.search(r"…|  |\b[A-Z]{3,}\b(?<!NGC)", line))


@pytest.mark.parametrize("line", command_lines())
def test_every_command_shown_is_one_that_the_command_line_knows(line):
    parser().parse_args(shielded(shlex.split(line)[1:]))
