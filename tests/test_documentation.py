"""The pages say what the code does: tables are those the code reads, and examples work."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from clockdrive.configuration import load

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


def test_the_tables_of_the_pages_are_those_of_the_code():
    command = [sys.executable, "-m", "scripts.docs_tables", "--check"]
    run = subprocess.run(command, cwd=CHECKOUT, capture_output=True, text=True, check=False, timeout=60)
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("block", blocks("toml"))
def test_every_configuration_shown_is_accepted(block, tmp_path):
    file = tmp_path / "telescope.toml"
    file.write_text(block, encoding="utf-8")
    load(file, environment={}, overrides={})


@pytest.mark.parametrize("block", blocks("python"))
def test_every_python_example_is_python(block):
    compile(block, "example", "exec")
