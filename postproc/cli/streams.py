"""Standard output and error, which may be closed, full, or a terminal that is gone.

A run that has written its files has done so whether anybody reads its words or not: what cannot be printed is noted
here and never raised.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from collections.abc import Iterable, Iterator
from typing import Any, TextIO

STREAMS = ("stdin", "stdout", "stderr")


class GuardedStream:
    """A text stream that never raises OSError; ``problem``: why what was printed is lost, or nothing.

    ``stream``: the stream, None for one that was closed before this process started.
    """

    def __init__(self, stream: TextIO | None) -> None:
        self._stream: TextIO = io.StringIO() if stream is None else stream
        self._closed = stream is None
        self.problem = ""
        self.reader_left = False

    def write(self, text: str) -> int:
        if self._closed:
            self.problem = self.problem or "it is closed"
            return len(text)
        try:
            return self._stream.write(text)
        except (OSError, ValueError) as error:  # ValueError: it is closed
            self._lose(error)
            return len(text)

    def write_bytes(self, raw: bytes) -> None:
        """Writes bytes as they are, after what was printed before."""
        if self._closed:
            self.problem = self.problem or "it is closed"
            return
        try:
            self._stream.flush()
            self._stream.buffer.write(raw)
            self._stream.buffer.flush()
        except (OSError, ValueError) as error:
            self._lose(error)

    def writelines(self, lines: Iterable[str]) -> None:
        for line in lines:
            self.write(line)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except (OSError, ValueError) as error:
            self._lose(error)

    def abandon(self) -> None:
        """From now on nothing is printed, and nobody waits for a reader."""
        with contextlib.suppress(OSError, ValueError):
            number = self._stream.fileno()
            nowhere = os.open(os.devnull, os.O_WRONLY)
            try:
                os.dup2(nowhere, number)
            finally:
                os.close(nowhere)

    def _lose(self, error: OSError | ValueError) -> None:
        self.problem = self.problem or getattr(error, "strerror", None) or str(error)
        self.reader_left = getattr(error, "errno", None) in (errno.EPIPE, errno.EINVAL)  # EINVAL: on Windows
        self.abandon()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


def write_bytes(raw: bytes) -> None:
    """Writes bytes to standard output, which ``guarded_streams`` guards."""
    assert isinstance(sys.stdout, GuardedStream)
    sys.stdout.write_bytes(raw)


@contextlib.contextmanager
def guarded_streams() -> Iterator[GuardedStream]:
    """``sys.stdout`` and ``sys.stderr`` guarded inside of the ``with``; gives the first of them.

    What their encoding (cp1252, ASCII) does not have is printed as an escape.
    """
    before = sys.stdout, sys.stderr
    _open_closed_ones()
    for stream in before:
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    out = GuardedStream(sys.stdout)
    sys.stdout, sys.stderr = out, GuardedStream(sys.stderr)
    try:
        yield out
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        sys.stdout, sys.stderr = before


def _open_closed_ones() -> None:
    """A file that is opened while a standard stream is closed would get its number, and what is printed."""
    for number, name in enumerate(STREAMS):
        if getattr(sys, name) is None:
            try:
                os.fstat(number)
            except OSError:
                with contextlib.suppress(OSError):
                    os.open(os.devnull, os.O_RDWR)
