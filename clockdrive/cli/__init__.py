"""The command line: `clockdrive [-c FILE] COMMAND …`.

Results go to stdout, progress and remarks to stderr. Exit codes: 0 done, 1 refused or failed, 2 usage, to which an
argument belongs that can never be right, 130 interrupted, which stops the motion first.
"""

from clockdrive.cli.main import main

__all__ = ["main"]
