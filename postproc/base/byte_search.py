"""Looking through all bytes of a large file piece by piece: what was looked through need not stay in memory."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from postproc.base.paged_memory import release_pages
from postproc.base.read_files import MAX_LINE

CHUNK = 16 << 20
"""Bytes that are looked through at a time."""

NEAR = 64 << 10
"""Bytes about a word in which a pattern is tried."""


def matches(
    pattern: re.Pattern[bytes], raw: bytes, words: Sequence[bytes] = (), longest: int = MAX_LINE
) -> Iterator[re.Match[bytes]]:
    """All matches of ``pattern``, as of ``finditer``; none has more than ``longest`` bytes.  ``words``: each match
    contains one of these, in capitals or not; the pattern, which takes ten times as long, is tried near them alone."""
    at, chunk = 0, NEAR if words else CHUNK
    while at < len(raw):
        after = stop = at + chunk
        looked_at = raw[at : stop + longest].upper() if words else b""
        if not words or any(word in looked_at for word in words):
            for found in pattern.finditer(raw, at, stop + longest):
                if found.start() >= stop:
                    break
                yield found
                after = max(after, found.end())
        at = after
        release_pages()


def occurrences(pattern: re.Pattern[bytes], raw: bytes) -> Iterator[int]:
    """Where ``pattern`` occurs: the starts of its ``matches``."""
    return (found.start() for found in matches(pattern, raw))


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
