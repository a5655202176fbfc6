"""Reading a whole file that may be anything: what is no file, or too large, is reported and not read."""

from __future__ import annotations

import io
import stat
import sys
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

from postproc.base.findings import Finding, Refusal
from postproc.base.input_files import note, provided_content
from postproc.base.sized_bytes import SizedBytes

MAX_BYTES = 1_000_000_000
"""Sixteen million motions; offsets in a program have 32 bits."""

MAX_LINE = 1_000_000
"""Bytes: no controller and no table has lines of a hundredth of it, and in memory a line is many times its length."""


def read_file(path: Path, most: int | None = None) -> bytes:
    """The bytes of a file, noted as an input of the run.

    ``most``: of a larger file so many and one more, for a reader that has its own words for that.  Raises Refusal
    FIL001: not readable, a pipe or a device, larger than ``MAX_BYTES``; FIL010: not what it was when last read.
    """
    if most is None:
        return _read(path, MAX_BYTES, _whole)
    return _read(path, None, lambda stream, _: stream.read(most + 1))


def read_text_file(path: Path, code: str = "FIL003", ends: tuple[bytes, ...] = (b"\n",)) -> bytes:
    """The bytes of a text file, noted as an input of the run; what is no text is not read to its end.

    ``ends``: what a line may end with, each of one byte.  Raises Refusal as ``read_file`` does; FIL003: a NUL;
    ``code``: a line of more than ``MAX_LINE`` bytes.
    """
    return _read(path, MAX_BYTES, lambda stream, size: _text(stream, size, path, code, ends))


def list_folder(folder: Path) -> list[Path]:
    """What is in a folder, sorted.  Raises FileNotFoundError; Refusal FIL001 for a folder that cannot be listed."""
    try:
        return sorted(folder.iterdir())
    except FileNotFoundError:
        raise
    except OSError as error:
        message = f"the folder cannot be listed, so a file of the program may be missed: {error.strerror}"
        raise Refusal(Finding("FIL001", message, str(folder))) from None


def note_absent(path: Path) -> None:
    """A file that would have been read is not there: a recorded run counts as changed once it is."""
    sys.audit("open", str(path), "r", 0)


def note_listing(folder: Path, suffix: str) -> None:
    """It matters which files of this suffix a folder holds: a recorded run counts as changed once others are there."""
    sys.audit("open", str(folder / f"*{suffix}"), "r", 0)


def _read(path: Path, largest: int | None, take: Callable[[BinaryIO, int], bytes]) -> bytes:
    given = provided_content(path)
    if given is not None:
        raw = take(io.BytesIO(given), len(given))
        note(path, raw)
        return raw
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode) and not stat.S_ISDIR(status.st_mode):
            raise OSError("it is a pipe or a device, not a file")
        if largest is not None and status.st_size > largest:
            raise OSError(f"it is larger than {largest} bytes")
        with path.open("rb") as stream:
            raw = take(stream, status.st_size)
    except (OSError, ValueError) as error:  # ValueError: a name with NUL
        why = getattr(error, "strerror", None) or error
        help = _similar(path) if isinstance(error, FileNotFoundError) else ""
        raise Refusal(Finding("FIL001", f"the file cannot be read: {why}", str(path), help=help)) from None
    note(path, raw)
    return raw


def _similar(path: Path) -> str:
    """A help that names the file whose name is nearest to that of ``path``; "" where none is near."""
    if "*" in path.name or "?" in path.name:
        return f"this is a pattern: compensate batch '{path}' compensates all programs that it matches"
    try:
        names = [one.name for one in path.parent.iterdir() if one.is_file()]
    except OSError:
        return ""
    from difflib import get_close_matches  # takes its time to load

    stems = [name for name in names if Path(name).stem.lower() == path.stem.lower()]
    near = stems if len(stems) == 1 else get_close_matches(path.name, names, 1, 0.8)
    return f"is it {path.with_name(near[0])}? check the path and the right to read it" if near else ""


def _whole(stream: BinaryIO, size: int) -> bytes:
    text = SizedBytes(size)
    while block := stream.read(MAX_LINE):
        text.write(block)
    return text.done()


def _text(stream: BinaryIO, size: int, path: Path, code: str, ends: tuple[bytes, ...]) -> bytes:
    text = SizedBytes(size)
    line_bytes = 0  # bytes of the line that a block starts in the midst of
    while block := stream.read(MAX_LINE):
        nul = block.find(b"\0")
        if nul >= 0:
            raise Refusal(_no_text(text.done() + block, path))
        line_ends = [(block.find(end), block.rfind(end)) for end in ends if end in block]
        line_bytes += min((first for first, _ in line_ends), default=len(block))
        if line_bytes > MAX_LINE:
            number = _line(text.done(), ends)
            message = f"the line has more than {MAX_LINE} bytes: the file is not plain text"
            raise Refusal(Finding(code, message, str(path), number))
        if line_ends:
            line_bytes = len(block) - 1 - max(last for _, last in line_ends)
        text.write(block)
    return text.done()


def _no_text(raw: bytes, path: Path) -> Finding:
    """FIL003 of a file with a NUL: what it is instead of a text, and how it becomes one."""
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")) or raw[1:200:2].count(0) > 50 or raw[:200:2].count(0) > 50:
        message = "the file is UTF-16 (two bytes for each character)"
        return Finding(
            "FIL003", message, str(path), help="save it as UTF-8 or ANSI in the editor that wrote it"
        )
    if raw.startswith(b"PK\x03\x04") or raw.startswith(b"\xd0\xcf\x11\xe0"):
        message = "the file is a spreadsheet or an archive, and no text"
        return Finding("FIL003", message, str(path), help="save the table as CSV, or unpack the archive")
    message = f"byte {raw.find(0)} is NUL: the file is not plain text"
    return Finding("FIL003", message, str(path), help="save it as plain text (UTF-8)")


def _line(raw: bytes, ends: tuple[bytes, ...]) -> int:
    """The number of the line that ``raw`` stops in."""
    count = sum(raw.count(end) for end in ends)
    return count + 1 - (raw.count(b"\r\n") if b"\r" in ends else 0)
