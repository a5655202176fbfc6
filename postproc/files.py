"""Reading a whole file that may be anything: what is no file, or too large, is told and not read."""

from __future__ import annotations

import stat
from pathlib import Path

from postproc.findings import Finding, Refusal

MAX_BYTES = 1_000_000_000
"""Sixteen million motions; offsets in a program are held in 32 bits."""

MAX_LINE = 1_000_000
"""Bytes: no controller and no table has lines of a hundredth of it, and in memory a line is many times its length."""


def read_file(path: Path) -> bytes:
    """The bytes of a file.  Raises Refusal FIL001: not readable, a pipe or a device, larger than ``MAX_BYTES``."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
            raise OSError("it is a pipe or a device, not a file")
        if status.st_size > MAX_BYTES:
            raise OSError(f"it is larger than {MAX_BYTES} bytes")
        return path.read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a name with NUL
        why = getattr(error, "strerror", None) or error
        raise Refusal(Finding("FIL001", f"can not be read: {why}", str(path))) from None
