"""One at a time: a lock file that the system takes back when its holder dies, whatever it died of.

The library ``filelock`` locks it: by ``flock`` on Linux and macOS, by ``LockFileEx`` on Windows, and where a file
system has neither, by the existence of the file with the id of its process in it.  It also sees that the last holder
has removed the file that it waited for, which a library that locks open handles (portalocker) leaves to its caller.
"""

from __future__ import annotations

import contextlib
import os
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

from filelock import FileLock, Timeout

from postproc.base.system import WINDOWS

POLL = 0.02
"""[s] Between two attempts to take a lock that another process holds."""


@contextlib.contextmanager
def lock_file(path: Path, waits: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Hold the lock file ``path``; while another process or thread has it, wait, and call ``waits`` once.

    The file exists only while it is locked, or was when its process was killed; an orphaned one is free to take.  A
    symbolic link of this name is not followed.  Raises OSError where the folder takes no file.
    """
    lock = FileLock(path, poll_interval=POLL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it locks by the file's existence is not the user's concern
            try:
                lock.acquire(blocking=False)
            except Timeout:
                # a folder that takes no file (/proc) looks to the library like another holder: this raises OSError
                os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o644))
                waits()
                lock.acquire()
        yield
    finally:
        if lock.is_locked:  # a signal may have come before
            # Elsewhere than on Windows while it is held: a lock on a file without a name keeps nobody out, and whoever
            # gets one sees that and takes another.
            if not WINDOWS:
                _remove(path)
            with contextlib.suppress(OSError):  # what was done under it is done
                lock.release()
            if WINDOWS:
                _remove(path)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()
