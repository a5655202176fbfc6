"""Writing files so that a reader sees the old ones or the new ones, never half of either."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import re
import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures import wait as wait_for
from pathlib import Path
from typing import BinaryIO

from postproc.base import system
from postproc.base.findings import Code, Finding, Refusal, define
from postproc.base.locks import lock_file
from postproc.output.publications import note_publication

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
        "FIL017": Code(
            "error",
            "edited file would be replaced",
            meaning="The file that is there was edited: a post with your edits, or a plan with your readings.",
            consequence="It stays as it is; nothing is written.",
            action="Keep it and name another place, or ask for a new post with --replace.",
            example="`compensate posts robodk -o C:/RoboDK/Posts` after editing the post there.",
        ),
    }
)

Content = bytes | Iterable[bytes]
"""Of a file: as a whole, or in parts that are built while it is written."""

LOCK = ".compensate.lock"
"""In a folder while one run writes into it."""

SYNCED = 8
"""Files at most that go to the disk at once."""

PATIENCE = (0.05, 0.1, 0.2, 0.4, 0.8)
"""[s] Waits between attempts to rename a file that another program holds open, which Windows refuses: a virus scanner
or an indexer is soon done with it, Excel is not."""

LONGEST_STEM = 200
"""Bytes of a name that temporary names repeat; a longer one is replaced by its digest, so that they stay short enough
for the file system."""


def write_atomically(
    files: Mapping[Path, Content], last: Path | None = None, still: Callable[[], None] = lambda: None
) -> None:
    """Write all of ``files`` or none.

    Every file is written whole beside its place and synced before the first one is renamed into it.  ``last``, the
    program itself, is taken away first and comes last: at any moment it is absent or belongs to its companions.
    Folders are made as needed.  A name that is a link is replaced; what it leads to stays as it is.  Of runs that write
    into one folder at once each waits for the one before it (where the folder takes a lock file), so what is there is
    of one of them; half-written files of one that was killed are removed.  ``still``: called when all are written
    beside their places; where it raises, everything stays as it was.  Raises Refusal FIL004 when the disk or its rights
    do not allow it; the files that were there before are then there again.
    """
    made: list[Path] = []
    try:
        with contextlib.ExitStack() as locks:
            _put_in_place(files, last, still, locks, made)
    except BaseException:
        for folder in sorted(made, key=lambda folder: len(folder.parts), reverse=True):
            with contextlib.suppress(OSError):
                folder.rmdir()  # only an empty one
        raise


def replace_file(path: Path, content: bytes, still: Callable[[], None] = lambda: None) -> None:
    """Write one file over the one that is there: at any moment it is the old one or the new one, never absent.

    For a record that grows from run to run.  ``still`` and what it raises: as ``write_atomically``."""
    ready = path.with_name(f".{_stem(path)}.{secrets.token_hex(4)}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.ExitStack() as locks:
            if _lock_folders({path.parent}, locks):
                _sweep([path])
            _sync(_write(ready, content))
            still()
            _rename(ready, path)
            _sync_folder(path.parent)
    except OSError as error:
        raise _unwritable(path, error) from None
    finally:
        _unlink(ready)


def sweep(files: Iterable[Path]) -> None:
    """Remove the half-written ``files`` of a run that was killed.

    Waits for runs that write into these folders now, as ``write_atomically`` does; does nothing where the folders take
    no lock file.
    """
    there = [path for path in files if os.path.isdir(path.parent)]
    with contextlib.ExitStack() as locks:
        if _lock_folders({path.parent for path in there}, locks):
            _sweep(there)


def refused(path: Path, message: str, help: str) -> Refusal:
    """The refusal (FIL004) of an output that cannot be written."""
    return Refusal(Finding("FIL004", message, str(path), help=help))


def edited_file(path: Path, message: str, help: str) -> Refusal:
    """The refusal (FIL017) of an output in whose place a file is that somebody edited."""
    return Refusal(Finding("FIL017", message, str(path), help=help))


def _put_in_place(
    files: Mapping[Path, Content],
    last: Path | None,
    still: Callable[[], None],
    locks: contextlib.ExitStack,
    created: list[Path],
) -> None:
    # names are noted before their files are created: a signal may come between the two
    ready = {path: path.with_name(f".{_stem(path)}.{secrets.token_hex(4)}.tmp") for path in files}
    spare: dict[Path, Path] = {}
    placed: list[Path] = []
    at = next(iter(files), Path())
    try:
        for at in files:
            if system.WINDOWS and (problem := system.windows_name_problem(at)):
                raise OSError(errno.EINVAL, problem)
            if at.is_dir() and not at.is_symlink():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            created += [folder for folder in (at.parent, *at.parent.parents) if not os.path.lexists(folder)]
            at.parent.mkdir(parents=True, exist_ok=True)
        if _lock_folders({path.parent for path in files}, locks):
            _sweep(files)
        with ThreadPoolExecutor(SYNCED, "sync") as pool:  # the disk takes them together in half of the time
            synced: dict[Path, Future[None]] = {}
            for at, content in files.items():
                try:
                    stream = _write(ready[at], content)
                except OSError as error:
                    if error.errno not in (errno.EMFILE, errno.ENFILE):
                        raise
                    wait_for(synced.values())  # then these are closed
                    stream = _write(ready[at], content)
                synced[at] = pool.submit(_sync, stream)
            for at in synced:
                synced[at].result()
        still()
        order = sorted(files, key=lambda path: path == last)
        for at in reversed(order):
            if os.path.lexists(at):
                spare[at] = at.with_name(f"{ready[at].name}.old")
                _rename(at, spare[at])
        for at in order:
            placed.append(at)
            _rename(ready[at], at)
        for folder in {path.parent for path in files}:
            _sync_folder(folder)
        note_publication()
    except BaseException as error:
        for path in reversed(placed):
            if not ready[path].exists():
                _unlink(path)
        for path, old in reversed(spare.items()):
            with contextlib.suppress(OSError):
                _rename(old, path)
        spare.clear()
        if isinstance(error, OSError):
            raise _unwritable(at, error) from None
        raise
    finally:
        with contextlib.ExitStack() as cleanup:  # goes on with the others where a signal ends one
            for path in [*ready.values(), *spare.values()]:
                cleanup.callback(_unlink, path)


def _unwritable(path: Path, error: OSError) -> Refusal:
    if system.WINDOWS and isinstance(error, PermissionError) and path.exists():
        return refused(
            path,
            "the file cannot be replaced: it is open in another program, or write-protected",
            "nothing of this program is written; close the file there (Excel, an editor, a viewer) and repeat",
        )
    help = (
        "nothing of this program is written; check the folder's rights and the free space,"
        " or name another place with -o and --report"
    )
    if system.WINDOWS and len(os.path.abspath(path)) > system.LONGEST_PATH:
        help = f"the path has more than {system.LONGEST_PATH} characters; name a shorter place with -o and --report"
    return refused(path, f"the file cannot be written: {error.strerror or error}", help)


def _rename(source: Path, target: Path) -> None:
    """Rename a file over another one; Windows refuses that while any program has one of them open."""
    for wait in PATIENCE if system.WINDOWS else ():
        try:
            os.replace(source, target)
        except PermissionError:
            time.sleep(wait)
        else:
            return
    os.replace(source, target)


def _lock_folders(folders: Iterable[Path], locks: contextlib.ExitStack) -> bool:
    """Keep other writers out of ``folders`` until ``locks`` is closed or this process dies; False where one of them
    takes no lock file."""
    places: dict[tuple[int, int], Path] = {}
    try:
        for folder in folders:
            stat = os.stat(folder)
            places.setdefault((stat.st_dev, stat.st_ino), folder)  # one folder may have two names
        for _, folder in sorted(places.items()):  # all in one order: no two wait for each other
            locks.enter_context(lock_file(folder / LOCK))
    except OSError:
        return False
    return True


def _stem(path: Path) -> str:
    """What temporary names of a file contain: its name, or its digest where that would be too long for the system."""
    name = path.name
    too_long = len(os.fsencode(name)) > LONGEST_STEM or (
        system.WINDOWS and len(os.path.abspath(path)) > system.LONGEST_PATH - 20
    )
    return hashlib.sha256(os.fsencode(name)).hexdigest()[:16] if too_long else name


def _sweep(files: Iterable[Path]) -> None:
    """Remove temporary files of ``files``: with their folders locked, only a killed run can have written them."""
    names: dict[Path, list[str]] = {}
    for path in files:
        names.setdefault(path.parent, []).append(re.escape(_stem(path)))
    for folder, own in names.items():
        temporary = re.compile(rf"\.({'|'.join(own)})\.[a-z0-9_]{{8}}\.tmp(\.old)?")
        with contextlib.suppress(OSError):
            for entry in list(os.scandir(folder)):
                if temporary.fullmatch(entry.name):
                    os.unlink(entry.path)


def _write(path: Path, content: Content) -> BinaryIO:
    """A new file with its content, which may not be on the disk yet."""
    stream = open(path, "xb")  # noqa: SIM115 (closed by _sync)
    try:
        stream.writelines([content] if isinstance(content, bytes) else content)
        stream.flush()
    except BaseException:
        stream.close()
        raise
    return stream


def _sync(stream: BinaryIO) -> None:
    with stream:
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
