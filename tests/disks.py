"""Disks that fail: at any write, any sync or any renaming, full ones and read-only ones."""

from __future__ import annotations

import builtins
import contextlib
import errno
import io
import os
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

KINDS = {
    "write": ("write", "writev", "pwrite", "pwritev", "sendfile", "copy_file_range", "truncate", "ftruncate"),
    "sync": ("fsync", "fdatasync"),
    "rename": ("rename", "replace", "renames", "link"),
}
"""What is asked of a disk, and the functions of ``os`` that ask for it; files opened to write count as well."""


def failing(kind: str, at: int, code: int, below: Path) -> None:
    """From now on the request number ``at`` of this ``kind`` to a file below a folder fails in this process.

    A write that fails wrote half of what it was to write.  ``disk failed`` is printed when it does.
    """
    asked = 0

    def ask(file: object, half: Callable[[], object] = lambda: None) -> None:
        nonlocal asked
        if not _place(file).startswith(f"{below}{os.sep}"):
            return
        asked += 1
        if asked == at:
            half()
            print("disk failed", flush=True)
            raise OSError(code, os.strerror(code))

    def wrapped(real: Callable[..., Any], number: int) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            ask(arguments[number])
            return real(*arguments, **named)

        return call

    for name in KINDS[kind]:
        # of two names the one that comes to be counts
        setattr(os, name, wrapped(getattr(os, name), 1 if kind == "rename" else 0))
    if kind == "write":

        class File(io.FileIO):
            def write(self, data: Any) -> int:
                ask(self.fileno(), lambda: super(File, self).write(memoryview(data)[: len(data) // 2]))
                return super().write(data)

        opened = io.open

        def open_(file: Any, mode: str = "r", buffering: int = -1, *rest: Any, **named: Any) -> Any:
            if "b" not in mode or not set(mode) & set("wxa"):
                return opened(file, mode, buffering, *rest, **named)
            raw = File(file, mode.replace("b", ""), closefd=named.get("closefd", True))
            return raw if buffering == 0 else io.BufferedWriter(raw)

        io.open = builtins.open = open_  # type: ignore[assignment]


def _place(file: object) -> str:
    if isinstance(file, int):
        with contextlib.suppress(OSError):
            return os.readlink(f"/proc/self/fd/{file}")
        return ""
    return os.path.abspath(os.fsdecode(file))  # type: ignore[arg-type]


@contextlib.contextmanager
def a_disk(place: Path, options: str) -> Iterator[Callable[[str], None]]:
    """A file system in memory at ``place``; what is given can mount it anew with other options."""
    place.mkdir(exist_ok=True)

    def mount(*words: str) -> None:
        done = subprocess.run(["mount", *words], capture_output=True, text=True, check=False)
        if done.returncode:
            pytest.skip(f"nothing can be mounted here: {done.stderr.strip()}")

    mount("-t", "tmpfs", "-o", options, "tmpfs", str(place))
    try:
        yield lambda changed: mount("-o", f"remount,{changed}", str(place))
    finally:
        subprocess.run(["umount", "-l", str(place)], check=False)


ERRORS = (errno.ENOSPC, errno.EIO, errno.EDQUOT)
