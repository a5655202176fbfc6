"""One batch at a time does a program: a lock file beside the records."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Callable, Iterator
from pathlib import Path

from postproc.base.locks import lock_file
from postproc.output.atomic_write import refused

RACES = 1000
"""Attempts to make a folder that others take away; it does not fail as often in a row but for another reason."""


@contextlib.contextmanager
def locked(path: Path, waits: Callable[[], None] = lambda: None) -> Iterator[None]:
    """Hold the lock file ``path``, in a folder that is made for it and taken away with it where it stays empty; while
    another process has it, wait, and call ``waits`` once.

    Raises Refusal FIL004 where the folder takes no file.
    """
    with contextlib.ExitStack() as held:
        try:
            _acquire(path, waits, held)
        except OSError as error:
            raise refused(
                path,
                f"the folder of the results cannot be locked: {error.strerror or error}",
                "the folder must be writable",
            ) from None
        yield


def _acquire(path: Path, waits: Callable[[], None], stack: contextlib.ExitStack) -> None:
    for races in range(RACES + 1):
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if path.parent.is_symlink():
                raise NotADirectoryError(errno.ENOTDIR, "its folder is a symbolic link")
            with contextlib.ExitStack() as own:
                own.callback(_remove_empty, path.parent)
                own.enter_context(lock_file(path, waits))
                stack.push(own.pop_all())
            return
        except (FileNotFoundError, FileExistsError):  # the last holder took the folders away just now
            if races == RACES:
                raise


def _remove_empty(folder: Path) -> None:
    with contextlib.suppress(OSError):
        folder.rmdir()
        folder.parent.rmdir()
