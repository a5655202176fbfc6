"""Writing files so that a reader sees the old ones or the new ones, never half of either."""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from postproc.findings import Finding, Refusal


def publish(files: Mapping[Path, bytes], last: Path | None = None) -> None:
    """Write all of ``files`` or none.

    Every file is written whole beside its place and synced before the first one is renamed into it.  ``last``, the
    program itself, is taken away first and comes last: at any moment it is absent or belongs to its companions.
    Folders are made as needed.  Raises Refusal FIL004 when the disk or its rights do not allow it; the files that
    were there before are then there again.
    """
    ready: dict[Path, Path] = {}
    spare: dict[Path, Path] = {}
    placed: list[Path] = []
    at = next(iter(files), Path())
    try:
        for at, content in files.items():
            if at.is_dir() and not at.is_symlink():
                raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
            at.parent.mkdir(parents=True, exist_ok=True)
            ready[at] = _written_beside(at, content)
        order = sorted(files, key=lambda path: path == last)
        for at in reversed(order):
            if at.exists():
                aside = at.with_name(f"{ready[at].name}.old")
                os.replace(at, aside)
                spare[at] = aside
        for at in order:
            os.replace(ready[at], at)
            placed.append(at)
        for folder in {path.parent for path in files}:
            _sync_folder(folder)
    except BaseException as error:
        for path in placed:
            with contextlib.suppress(OSError):
                path.unlink()
        for path, old in spare.items():
            with contextlib.suppress(OSError):
                os.replace(old, path)
        spare.clear()
        if isinstance(error, OSError):
            raise Refusal(
                Finding(
                    "FIL004",
                    f"can not be written: {error.strerror or error}",
                    str(at),
                    help="nothing of this program was written; check the folder's rights and the free space,"
                    " or name another place with -o and --report",
                )
            ) from None
        raise
    finally:
        for path in [*ready.values(), *spare.values()]:
            with contextlib.suppress(OSError):
                path.unlink()


def _written_beside(path: Path, content: bytes) -> Path:
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.chmod(0o666 & ~_umask())
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def _umask() -> int:
    mask = os.umask(0o022)
    os.umask(mask)
    return mask


def _sync_folder(folder: Path) -> None:
    with contextlib.suppress(OSError):  # not every file system syncs folders
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
