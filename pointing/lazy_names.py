"""Names of a package that are loaded when they are first used (PEP 562), so that importing it costs nothing."""

from collections.abc import Callable, Mapping
from importlib import import_module


def lazy_names(package: str, home: Mapping[str, str]) -> Callable[[str], object]:
    """Return the `__getattr__` of a package.

    Parameters
    ----------
    package : str
        Its name.
    home : mapping
        The module of each name.
    """

    def loaded(name: str) -> object:
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(home[name]), name)

    return loaded
