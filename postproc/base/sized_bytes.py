"""Byte strings of a known size that are written once, part after part, without a second copy at any time."""

from __future__ import annotations

import ctypes
from collections.abc import Iterable

from postproc.base.paged_memory import LOOK, release_pages, room_in_file

_new_bytes = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_char_p, ctypes.c_ssize_t)(
    ("PyBytes_FromStringAndSize", ctypes.pythonapi)
)
"""Without a text the bytes may be filled as long as nobody else has them."""


class SizedBytes:
    """``size`` bytes that are being written; of a large program they lie in a temporary file from the start.  More than
    ``size`` may come, which costs a copy."""

    def __init__(self, size: int) -> None:
        self.text: bytes = _new_bytes(None, size)
        room_in_file(self.text)
        first = id(self.text) + bytes.__basicsize__ - 1
        self.rest = memoryview((ctypes.c_char * size).from_address(first)).cast("B")
        self.more: list[bytes] = []
        self.since = 0

    def write(self, part: bytes | memoryview) -> None:
        """Put ``part`` behind what is there."""
        fitting, view = min(len(part), len(self.rest)), memoryview(part)
        for at in range(0, fitting, LOOK):  # nobody else works, or gives pages back, while bytes are copied
            size = min(LOOK, fitting - at)
            self.rest[:size] = view[at : at + size]
            self.rest = self.rest[size:]
            self.since += size
            if self.since >= LOOK:
                self.since = 0
                release_pages()
        if fitting < len(part):
            self.more.append(bytes(part[fitting:]))

    def write_all(self, parts: Iterable[bytes | memoryview]) -> None:
        for part in parts:
            self.write(part)

    def done(self) -> bytes:
        """What was written; nothing can be written from now on."""
        text = self.text if not self.rest else self.text[: -len(self.rest)]
        self.rest = memoryview(b"")
        return b"".join([text, *self.more]) if self.more else text
