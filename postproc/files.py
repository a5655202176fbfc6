"""Reading a whole file that may be anything: what is no file, or too large, is told and not read."""

from __future__ import annotations

import stat
from pathlib import Path

from postproc.findings import Finding, Refusal
from postproc.inputs import note

MAX_BYTES = 1_000_000_000
"""Sixteen million motions; offsets in a program are held in 32 bits."""

MAX_LINE = 1_000_000
"""Bytes: no controller and no table has lines of a hundredth of it, and in memory a line is many times its length."""


def read_file(path: Path, most: int | None = None) -> bytes:
    """The bytes of a file, noted as an input of the run.

    ``most``: of a larger file so many and one more, for a reader that has its own words for that.  Raises Refusal
    FIL001: not readable, a pipe or a device, larger than ``MAX_BYTES``; FIL010: not what it was when last read.
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
            raise OSError("it is a pipe or a device, not a file")
        if most is None and status.st_size > MAX_BYTES:
            raise OSError(f"it is larger than {MAX_BYTES} bytes")
        with path.open("rb") as stream:
            raw = stream.read() if most is None else stream.read(most + 1)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL
        why = getattr(error, "strerror", None) or error
        raise Refusal(Finding("FIL001", f"can not be read: {why}", str(path))) from None
    note(path, raw)
    return raw
