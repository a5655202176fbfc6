"""Which files a piece of work reads, and what was in them: recorded where Python opens them, not predicted.

A list of inputs maintained by hand forgets the file that a later version reads, and a result would then pass for
unchanged.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import stat
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import postproc

ABSENT = "absent"
"""Digest of a file that is not there."""


def digest_of(path: Path | str) -> str:
    """SHA-256 of a file, or ``ABSENT``, as of what is no file: a pipe and a device have no end; of ``folder/*.dat``
    that of the names of such files."""
    folder, name = os.path.split(path)
    try:
        if name.startswith("*.") and not os.path.exists(path):
            names = sorted(one for one in os.listdir(folder) if one.lower().endswith(name[1:]))
            return hashlib.sha256("/".join(names).encode(errors="surrogateescape")).hexdigest()
        if not stat.S_ISREG(os.stat(path).st_mode):
            return ABSENT
        with open(path, "rb") as stream:
            return hashlib.file_digest(stream, "sha256").hexdigest()
    except OSError:
        return ABSENT


@contextlib.contextmanager
def readings() -> Iterator[dict[str, str]]:
    """Path -> digest of every file that this thread opens to read inside of the ``with``, as it was then.

    The files of Python and of this package are left out; ``code_digest`` covers them.
    """
    _install()
    digests: dict[str, str] = {}
    _mine.digests = digests
    try:
        yield digests
    finally:
        _mine.digests = None


@functools.cache
def code_digest() -> str:
    """Digest of what computes: version, every file of this package, Python and numpy."""
    import numpy

    folder = _package()
    digest = hashlib.sha256(f"{postproc.__version__} {sys.version} {numpy.__version__}".encode())
    for path in sorted(folder.rglob("*")):
        if path.is_file() and "__pycache__" not in path.parts and not path.name.startswith("."):
            digest.update(f"{path.relative_to(folder).as_posix()} {digest_of(path)}\n".encode())
    return digest.hexdigest()


_mine = threading.local()


@functools.cache
def _install() -> None:
    """Once a process: a hook cannot be taken out again; without a ``readings`` it does nothing."""
    sys.addaudithook(_opened)


def _opened(event: str, arguments: tuple[object, ...]) -> None:
    if event != "open":
        return
    digests: dict[str, str] | None = getattr(_mine, "digests", None)
    if digests is None:
        return
    _mine.digests = None  # what the digest itself opens does not count
    try:
        name, mode, flags = arguments
        if isinstance(name, str | bytes | os.PathLike) and _reads(mode, flags):
            path = os.path.abspath(os.fsdecode(name))
            if path not in digests and not path.startswith(_others()) and not os.path.isdir(path):
                digests[path] = digest_of(path)
    finally:
        _mine.digests = digests


def _reads(mode: object, flags: object) -> bool:
    if isinstance(mode, str):
        return "r" in mode and "+" not in mode
    return isinstance(flags, int) and not flags & (os.O_WRONLY | os.O_RDWR)


@functools.cache
def _package() -> Path:
    return Path(postproc.__file__ or "").resolve().parent


@functools.cache
def _others() -> tuple[str, ...]:
    """Starts of the paths of files that are no input."""
    folders = {sys.prefix, sys.base_prefix, str(_package()), "/proc", "/sys", "/dev"}
    if sys.pycache_prefix is not None:
        folders.add(sys.pycache_prefix)
    return tuple(os.path.join(folder, "") for folder in sorted(folders))
