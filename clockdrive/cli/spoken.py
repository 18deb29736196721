"""The remedies of `pointing`, which name arguments of Python, in the words of `clockdrive fit`."""

import re

_WORDS: tuple[tuple[str, str], ...] = (  # as the library says it, and as a person types it
    (r"\bplaces ?= ?'(\w+)'", r"--places \1"),
    (r"\bweather=Weather\.standard\(height_m\)", "--weather HPA,C"),
    (r"\bweather=Weather\(refraction=False\) for no air", "--weather none"),
    (r"\bleave by_pier out", "leave --by-pier out"),
    (r", or read them as a list with read_tpoint_all", ""),
    (r"`diagnose`", "`clockdrive fit`"),
)


def spoken(text: str) -> str:
    """Return a text of the library as the command line says it."""
    for python, typed in _WORDS:
        text = re.sub(python, typed, text)
    return text
