"""Small programs that were once misread, each for a reason of its own."""

from __future__ import annotations

from .blocks import Block, Made

MISREADINGS = {
    "words beside an assignment": "G21 G90 G0 X1 Y2 Z3\nF100\n#1=4 G1 X80\nM2",
    "the place after a canned cycle": "G21 G90 G0 X1 Y2 Z3\nF100 G81 X5 Z-5 R1\nG1 X9\nM2",
    "coordinates after a tool length offset": "G21 G90 G0 X1 Y2 Z3\nF100 G43 H2\nG1 X9\nM2",
    "a code that is computed": "G21 G90 G0 X1 Y2 Z3\nG[55+1]\nG1 X5 Y3 Z2 F100\nM2",
    "a full circle that may run often or never": "G21 G90 G0 X1 Y2 Z3\no1 repeat [2]\nG2 I5 F100\no1 endrepeat\nM2",
}


def written(text: str) -> Made:
    """A program from its text, every line a block of words."""
    lines = text.splitlines()
    return Made(tuple(Block((line.removeprefix("/"),), line.startswith("/")) for line in lines), False, 1)
