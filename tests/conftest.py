"""What every test can ask for: the shared data, and whether it runs on the installed distribution."""

import os
from pathlib import Path

# One thread for linear algebra, here and in all processes that tests start: tests fill the cores side by side, and
# threads that wait for each other cost a third more. Read when numpy is first imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Processes that tests start find what the first of them compiled, as those of an installation do: a third of a start.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

import pytest

CHECKOUT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of shared reference data: CLOCKDRIVE_SHARED, else `../shared` beside the checkout."""
    named = os.environ.get("CLOCKDRIVE_SHARED")
    folder = Path(named) if named else CHECKOUT.parent / "shared"
    if folder.is_dir():
        return folder
    missing = f"no shared data at {folder}; set CLOCKDRIVE_SHARED to the folder that holds data/ and manuals/"
    if os.environ.get("CI") == "true":
        pytest.fail(missing)
    pytest.skip(missing)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the tests of the checkout itself when the installed distribution is under test."""
    if os.environ.get("CLOCKDRIVE_INSTALLED") != "1":
        return
    about_the_checkout = [item for item in items if item.get_closest_marker("checkout")]
    config.hook.pytest_deselected(items=about_the_checkout)
    items[:] = [item for item in items if item not in about_the_checkout]
