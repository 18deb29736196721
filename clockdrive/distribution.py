"""The four packages are one distribution; a foreign package of the same name must not be used in its place."""

from importlib.util import find_spec
from pathlib import Path

PARTS = ("mounts", "pointing", "transports")


def verify() -> None:
    """Check that the packages below `clockdrive` are those installed with it.

    Raises
    ------
    ImportError
        One of them is missing, or comes from another place, as when another distribution owns a package of that name.
    """
    home = Path(__file__).parents[1]
    for name in PARTS:
        spec = find_spec(name)
        if spec is None or spec.origin is None:
            raise ImportError(
                f"clockdrive stands in {home} without its package `{name}`: install clockdrive again", name=name
            )
        found = Path(spec.origin).parents[1]
        if found != home and not found.samefile(home):
            raise ImportError(
                f"`{name}` would come from {found}, but clockdrive stands in {home}: another distribution, or a "
                "folder on the Python path, owns a package of that name. Install clockdrive where it is alone "
                "(`pipx install clockdrive`, or a virtual environment of its own), or take that folder off the path",
                name=name,
                path=spec.origin,
            )
