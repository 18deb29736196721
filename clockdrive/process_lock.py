"""A lock between processes that ends with its process, however that ends: the operating system keeps it."""

import os
import sys
from pathlib import Path

from clockdrive.errors import StateError

if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> None:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)

else:
    import fcntl

    def _lock(descriptor: int) -> None:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)


class ProcessLock:
    """The lock of one file; the file itself stays, empty.

    Parameters
    ----------
    path : Path
        Made when it does not exist; its folder must exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._descriptor: int | None = None

    def acquire(self) -> bool:
        """Take the lock; False when another process, or another `ProcessLock`, has it.

        Raises
        ------
        StateError
            The file cannot be opened.
        """
        try:
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT, 0o600)
        except OSError as error:
            text = f"the lock file {self.path} cannot be opened: {error.strerror}; set [state] path to another folder"
            raise StateError(text) from error
        try:
            _lock(descriptor)
        except OSError:
            os.close(descriptor)
            return False
        self._descriptor = descriptor
        return True

    @property
    def held(self) -> bool:
        """Whether this object has it."""
        return self._descriptor is not None

    def release(self) -> None:
        """Give it back; twice is harmless."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None
