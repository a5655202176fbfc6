"""Writing files so that a reader sees the old ones or the new ones, never half of either."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import secrets
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from postproc.base.findings import Code, Finding, Refusal, define

CODES = define(
    {
        "FIL004": Code(
            "error",
            "file cannot be written",
            meaning="The folder, the disk or the rights do not allow this output.",
            consequence="No output of this program is written, so no half-written file remains.",
            action="Check the folder's rights and the free space, or name another place.",
            example="`compensate panel.src -o /media/usb` with a write-protected medium.",
        ),
    }
)

Content = bytes | Iterable[bytes]
"""Of a file: as a whole, or in parts that are built while it is written."""


def write_atomically(
    files: Mapping[Path, Content], last: Path | None = None, still: Callable[[], None] = lambda: None
) -> None:
    """Write all of ``files`` or none.

    Every file is written whole beside its place and synced before the first one is renamed into it.  ``last``, the
    program itself, is taken away first and comes last: at any moment it is absent or belongs to its companions.
    Folders are made as needed.  A name that is a link is replaced; what it leads to stays as it is.  Of runs that write
    into one folder at once each waits for the one before it, so what is there is of one of them; half-written
    files of one that was killed are removed.  ``still``: called when all are written beside their places;
    where it raises, everything stays as it was.  Raises Refusal FIL004 when the disk or its rights do not
    allow it; the files that were there before are then there again.
    """
    with contextlib.ExitStack() as locks:
        _publish(files, last, still, locks)


def sweep(files: Iterable[Path]) -> None:
    """Remove the half-written ``files`` of a run that was killed.

    Waits for runs that write into these folders now, as ``write_atomically`` does; does nothing where there are no
    locks.
    """
    there = [path for path in files if path.parent.is_dir()]
    with contextlib.ExitStack() as locks:
        if _lock_folders({path.parent for path in there}, locks):
            _sweep(there)


def refused(path: Path, message: str, help: str) -> Refusal:
    """The refusal (FIL004) of an output that cannot be written."""
    return Refusal(Finding("FIL004", message, str(path), help=help))


def _publish(
    files: Mapping[Path, Content], last: Path | None, still: Callable[[], None], locks: contextlib.ExitStack
) -> None:
    # names are noted before their files are created: a signal may come between the two
    ready = {path: path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp") for path in files}
    spare: dict[Path, Path] = {}
    placed: list[Path] = []
    at = next(iter(files), Path())
    try:
        for at in files:
            if at.is_dir() and not at.is_symlink():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            at.parent.mkdir(parents=True, exist_ok=True)
        if _lock_folders({path.parent for path in files}, locks):
            _sweep(files)
        for at, content in files.items():
            _write(ready[at], content)
        still()
        order = sorted(files, key=lambda path: path == last)
        for at in reversed(order):
            if os.path.lexists(at):
                spare[at] = at.with_name(f"{ready[at].name}.old")
                os.replace(at, spare[at])
        for at in order:
            placed.append(at)
            os.replace(ready[at], at)
        for folder in {path.parent for path in files}:
            _sync_folder(folder)
    except BaseException as error:
        for path in reversed(placed):
            if not ready[path].exists():
                _unlink(path)
        for path, old in reversed(spare.items()):
            with contextlib.suppress(OSError):
                os.replace(old, path)
        spare.clear()
        if isinstance(error, OSError):
            raise refused(
                at,
                f"the file cannot be written: {error.strerror or error}",
                "nothing of this program is written; check the folder's rights and the free space,"
                " or name another place with -o and --report",
            ) from None
        raise
    finally:
        with contextlib.ExitStack() as cleanup:  # goes on with the others where a signal ends one
            for path in [*ready.values(), *spare.values()]:
                cleanup.callback(_unlink, path)


def _lock_folders(folders: Iterable[Path], locks: contextlib.ExitStack) -> bool:
    """Keep other writers out of ``folders`` until ``locks`` is closed or this process dies; False where the system or
    the file system has no such locks."""
    try:
        import fcntl
    except ImportError:
        return False
    handles: dict[tuple[int, int], int] = {}
    try:
        for folder in folders:
            handle = os.open(folder, os.O_RDONLY)
            locks.callback(os.close, handle)
            stat = os.fstat(handle)
            handles[stat.st_dev, stat.st_ino] = handle  # one folder may have two names
        for _, handle in sorted(handles.items()):  # all in one order: no two wait for each other
            fcntl.flock(handle, fcntl.LOCK_EX)
    except OSError:
        return False
    return True


def _sweep(files: Iterable[Path]) -> None:
    """Remove temporary files of ``files``: with their folders locked, only a killed run can have written them."""
    names: dict[Path, list[str]] = {}
    for path in files:
        names.setdefault(path.parent, []).append(re.escape(path.name))
    for folder, own in names.items():
        temporary = re.compile(rf"\.({'|'.join(own)})\.[a-z0-9_]{{8}}\.tmp(\.old)?")
        with contextlib.suppress(OSError):
            for entry in list(os.scandir(folder)):
                if temporary.fullmatch(entry.name):
                    os.unlink(entry.path)


def _write(path: Path, content: Content) -> None:
    with open(path, "xb") as stream:
        stream.writelines([content] if isinstance(content, bytes) else content)
        stream.flush()
        os.fsync(stream.fileno())


def _unlink(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()


def _sync_folder(folder: Path) -> None:
    with contextlib.suppress(OSError):  # not every file system syncs folders
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
