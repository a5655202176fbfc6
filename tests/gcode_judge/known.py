"""Differences of the present reader that are known: the least program of each class, and how others are told."""

from __future__ import annotations

import re
from dataclasses import dataclass

from .blocks import Block, Made

_BLANK = re.compile(r"[ \t]+|\([^)]*\)|;.*")
_LINE_NUMBER = re.compile(r"^N\d+")


@dataclass(frozen=True)
class Known:
    """kinds: of ``Difference``; pattern: of a shrunk program in capitals without blanks, comments and N words."""

    name: str
    says: str
    kinds: tuple[str, ...]
    program: str
    pattern: str

    @property
    def made(self) -> Made:
        return written(self.program)


KNOWN: tuple[Known, ...] = ()


def written(text: str) -> Made:
    """A program from its text, every line a block of words."""
    return Made(tuple(Block((line,)) for line in text.splitlines()), False, 1)


def normalised(made: Made) -> str:
    """Capitals without blanks, comments and N words, a line a block."""
    lines = (_LINE_NUMBER.sub("", _BLANK.sub("", block.text)).upper() for block in made.blocks)
    return "".join(line + "\n" for line in lines if line)


def find_known(made: Made, kind: str) -> str | None:
    """The name of the class that a shrunk program is of."""
    text = normalised(made)
    for entry in KNOWN:
        if kind in entry.kinds and re.search(entry.pattern, text, re.M):
            return entry.name
    return None
