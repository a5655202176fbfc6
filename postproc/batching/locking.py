"""One at a time: a lock that the system takes back when its holder dies, whatever it died of."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
from collections.abc import Callable, Iterator
from pathlib import Path

from postproc.output.atomic_write import refused

RACES = 1000
"""Attempts to make a folder that others take away; it does not fail as often in a row but for another reason."""


@contextlib.contextmanager
def locked(path: Path, waits: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Hold the lock file ``path``; while another process has it, wait, and call ``waits`` once.

    The file exists only while a process has locked it or was killed with it; an orphaned one is free to take.  Raises
    Refusal FIL004 where the folder takes no file, or its file system no locks.
    """
    try:
        handle = _acquired(path, waits)
    except OSError as error:
        raise refused(
            path,
            f"the folder of the results cannot be locked: {error.strerror or error}",
            "the folder must be writable, on a file system with locks (flock)",
        ) from None
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            path.unlink()
        os.close(handle)
        with contextlib.suppress(OSError):  # where nothing came to be
            path.parent.rmdir()
            path.parent.parent.rmdir()


def _acquired(path: Path, waits: Callable[[], None]) -> int:
    races = 0
    while True:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.parent.is_symlink():
                raise NotADirectoryError(errno.ENOTDIR, "its folder is a symbolic link")
            handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o666)
        except (FileNotFoundError, FileExistsError):  # the last holder took the folders away just now
            races += 1
            if races > RACES:
                raise
            continue
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                waits()
                waits = _silent
                fcntl.flock(handle, fcntl.LOCK_EX)
            # The former owner removed its name: a lock on a file without a name keeps nobody out.
            with contextlib.suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(handle), os.stat(path)):
                    return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _silent() -> None:
    pass
