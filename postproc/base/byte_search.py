"""Looking through all bytes of a large file piece by piece: what was looked through need not stay in memory."""

from __future__ import annotations

import re
from collections.abc import Iterator

from postproc.base.paged_memory import release_pages
from postproc.base.read_files import MAX_LINE

CHUNK = 16 << 20
"""Bytes that are looked through at a time."""


def occurrences(pattern: re.Pattern[bytes], raw: bytes) -> Iterator[int]:
    """Where ``pattern`` occurs, as of ``finditer``.  It matches no line's end, so that no occurrence is longer than a
    line may be."""
    at = 0
    while at < len(raw):
        after = stop = at + CHUNK
        for found in pattern.finditer(raw, at, stop + MAX_LINE):
            if found.start() >= stop:
                break
            yield found.start()
            after = max(after, found.end())
        at = after
        release_pages()


def occurs(pattern: re.Pattern[bytes], raw: bytes) -> bool:
    """Whether there is one of ``occurrences``."""
    return next(occurrences(pattern, raw), None) is not None


def find_word(raw: bytes, word: bytes, start: int = 0) -> int:
    """``raw.find(word, start)``"""
    for at in range(start, len(raw), CHUNK):
        found = raw.find(word, at, at + CHUNK + len(word) - 1)
        if found >= 0:
            return found
        release_pages()
    return -1
