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


_ASSIGNED = r"#(?:\d+|<[^>\n]*>)="
KNOWN = (
    Known(
        "words beside an assignment",
        "A block with an assignment loses all its other words: a motion vanishes, a mode is not set.",
        ("missing", "target", "kind", "arc", "base", "tool", "offset", "extra"),
        "G21 G90 G0 X1 Y2 Z3\nF100\n#1=4 G1 X80\nM2",
        rf"^[^#\nO][^\n]*?{_ASSIGNED}|^{_ASSIGNED}[-+]?(?:[\d.]+|#\d+|[A-Z]*\[[^\n]*\]|#<[^>\n]*>)+[A-Z]",
    ),
    Known(
        "the place after a canned cycle",
        "After a cycle the depth axis is taken to be where it was before it; LinuxCNC leaves it at R without G98, and"
        " with G98 where R is above.",
        ("target", "arc"),
        "G21 G90 G0 X1 Y2 Z3\nF100 G81 X5 Z-5 R1\nG1 X9\nM2",
        r"^[^\n]*G0?(?:73|8[1-9])(?!\d)",
    ),
    Known(
        "coordinates after a tool length offset",
        "G43 and G49 leave the coordinates as they were; LinuxCNC shifts Z by the difference of the lengths.",
        ("target", "arc"),
        "G21 G90 G0 X1 Y2 Z3\nF100 G43 H2\nG1 X9\nM2",
        r"^[^\n]*G(?:43|49)(?!\d)",
    ),
    Known(
        "a code that is computed",
        "G[55+1] is passed over: the work offset, the plane or the distance mode before it stays in force.",
        ("target", "kind", "arc", "base", "extra", "missing"),
        "G21 G90 G0 X1 Y2 Z3\nG[55+1]\nG1 X5 Y3 Z2 F100\nM2",
        r"^[^\n]*[GM]\[",
    ),
    Known(
        "a full circle that may run often or never",
        "G2 and G3 without axis words, in a loop, a subprogram or behind a slash, are no motion and no finding.",
        ("missing",),
        "G21 G90 G0 X1 Y2 Z3\no1 repeat [2]\nG2 I5 F100\no1 endrepeat\nM2",
        r"^/?(?=[^\n]*G0?[23](?!\d))[^XYZ\n]*$",
    ),
)
"""The first that fits names a difference."""


def written(text: str) -> Made:
    """A program from its text, every line a block of words."""
    lines = text.splitlines()
    return Made(tuple(Block((line.removeprefix("/"),), line.startswith("/")) for line in lines), False, 1)


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
