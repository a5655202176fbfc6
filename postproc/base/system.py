"""What differs between the systems that this package runs on."""

from __future__ import annotations

import errno
import os
import sys
import unicodedata
from collections.abc import Iterable
from pathlib import Path, PureWindowsPath

from postproc.base.sanitize import sanitize

WINDOWS = sys.platform == "win32"

LONGEST_PATH = 259
"""Characters of a path that every program on Windows can open (MAX_PATH without its end)."""

_DEVICES = frozenset(
    ["con", "prn", "aux", "nul", "conin$", "conout$"]
    + [f"{port}{number}" for port in ("com", "lpt") for number in "123456789¹²³"]
)


def windows_name_problem(path: Path | PureWindowsPath) -> str:
    """Why Windows would not write a file of this name where it says so; an empty text where it would.

    A name such as ``aux.src`` is a device there, what follows a colon is a hidden stream, and dots and blanks at the
    end are dropped.
    """
    name = path.name
    if name.partition(".")[0].rstrip(" ").casefold() in _DEVICES:
        return f"{name!r} is the name of a device on Windows"
    forbidden = sorted({one for one in name if one in '<>:"|?*\\/' or ord(one) < 32})
    if forbidden:
        return f"Windows allows no {' '.join(forbidden)} in a name"
    if name.endswith((".", " ")):
        return "Windows drops dots and blanks at the end of a name"
    return ""


def relative_path(path: Path | str, folder: Path | str) -> str:
    """``path`` as seen from ``folder``; its absolute path where none leads there, as from one drive to another."""
    try:
        return os.path.relpath(path, folder)
    except ValueError:
        return os.path.abspath(path)


class FileSet:
    """Files, to ask whether a path leads to one of them.

    Links are followed, and on a file system that ignores the case of names (Windows, macOS, a USB stick) it does not
    matter in which one they are written.  Two names that one file has on purpose are two files.
    """

    def __init__(self, paths: Iterable[Path]) -> None:
        self._places: dict[str, list[str]] = {}
        for place in dict.fromkeys(os.path.realpath(path) for path in paths):
            self._places.setdefault(_folded(place), []).append(place)

    def __contains__(self, path: Path) -> bool:
        place = os.path.realpath(path)
        return any(
            place == other or _is_one_file(place, other) for other in self._places.get(_folded(place), ())
        )


def _is_one_file(place: str, other: str) -> bool:
    try:
        return os.path.samefile(place, other)
    except (OSError, ValueError):
        return False


def _folded(place: str) -> str:
    return unicodedata.normalize("NFC", place).casefold()


NO_MEMORY = "the memory of this machine is too small for this run"

_NO_MEMORY = (
    "can't start new thread",
    "failed to map segment",
    "cannot allocate memory",
    "Cannot allocate memory",
)
"""What else says that there is no memory: no room for a thread's stack or for a library."""

LONGEST_NAME = 80
"""Characters of a name of a file that a message shows."""


def refusal_of_the_system(error: BaseException | None) -> str:
    """What the system did not give, in words; an empty text for a defect of this program."""
    while error is not None:
        if isinstance(error, MemoryError) or any(words in str(error) for words in _NO_MEMORY):
            return NO_MEMORY
        if isinstance(error, OSError) and error.errno is not None:
            if error.errno in (errno.EMFILE, errno.ENFILE):
                return "this process may open too few files (ulimit -n)"
            name = sanitize(str(error.filename or ""))
            name = name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}..."
            return f"{name}{': ' if name else ''}{error.strerror}"
        error = error.__cause__ or error.__context__
    return ""
