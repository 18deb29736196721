"""`python -m scripts.picture`: run the first command of the README and put what it shows at the top of the README."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from scripts.sections import CHECKOUT, write_section

ARGUMENTS = ("goto", "best", "--for", "20s")
COLOURS = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def main() -> int:
    """Run, write, and return the exit code of the command."""
    command = [str(Path(sys.executable).with_name("clockdrive")), *ARGUMENTS]
    with tempfile.TemporaryDirectory() as state:
        environment = {**os.environ, "COLUMNS": "100", "CLOCKDRIVE_STATE__PATH": state}
        run = subprocess.run(  # noqa: S603 - our own command
            command,
            cwd=state,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            check=False,
            timeout=300,
        )
    text = picture(run.stdout.decode("utf-8"))  # bytes until here: text mode would lose the carriage returns
    print(text)
    if run.returncode == 0:
        write_section(CHECKOUT / "README.md", "picture", f"```text\n$ clockdrive {' '.join(ARGUMENTS)}\n{text}\n```")
    return run.returncode


def picture(output: str) -> str:
    """Return what a terminal shows in the end: no colours, of a line rewritten in place only its last state."""
    lines = COLOURS.sub("", output.replace("\r\n", "\n")).split("\n")
    return "\n".join(line.rstrip("\r").rsplit("\r", 1)[-1].rstrip() for line in lines).strip("\n")


if __name__ == "__main__":
    sys.exit(main())
