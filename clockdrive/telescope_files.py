"""Files in the state directory that belong to one telescope carry its name."""

import hashlib
import re

_LONGEST = 40


def stem(kind: str, telescope: str) -> str:
    """Return a file name without its ending: readable, and no two telescopes share one.

    Parameters
    ----------
    kind : str
        What the file holds.
    telescope : str
        Which telescope, such as `Configuration.identity`.
    """
    words = re.sub(r"[^A-Za-z0-9]+", "-", telescope).strip("-")[:_LONGEST]
    return f"{kind}-{words}-{hashlib.sha256(telescope.encode()).hexdigest()[:8]}"
