"""A program as blocks of pieces, so that it can be shrunk, and numbered for the interpreter's account of its lines."""

from __future__ import annotations

import re
from dataclasses import dataclass

_NUMBER = re.compile(r"[ \t]*[nN][ \t]*[\d ]+")
_FLOW = re.compile(r"[ \t]*[oO]")
_SIDE = re.compile(r"G4[12]\.1(?!\d)", re.I)
_CENTRE = re.compile(r"G(?:40(?![\d.])|40\.|\[39\+1\])", re.I)


@dataclass(frozen=True)
class Block:
    """``pieces``: words, assignments and comments with the blanks around them; ``slash``: the block may be skipped."""

    pieces: tuple[str, ...]
    slash: bool = False

    @property
    def text(self) -> str:
        return ("/" if self.slash else "") + "".join(self.pieces)

    def numbered(self, number: int) -> str:
        """The block with ``number`` as its N word; O words, tape marks and empty lines as they are."""
        pieces = self.pieces[1:] if self.pieces and _NUMBER.fullmatch(self.pieces[0]) else self.pieces
        rest = "".join(pieces)
        if _FLOW.match(rest) or rest.strip() in ("", "%") or rest.lstrip().startswith(";"):
            return self.text
        return f"{'/' if self.slash else ''}N{number} {rest}"


@dataclass(frozen=True)
class Made:
    """A program; ``delete``: the operator's switch skips blocks with a slash; ``offsets``: seed of the nine offsets in
    the control's memory."""

    blocks: tuple[Block, ...]
    delete: bool
    offsets: int

    @property
    def text(self) -> str:
        return "".join(block.text + "\n" for block in self.blocks)

    @property
    def numbered(self) -> str:
        """The same program with its line numbers as N words, which rs274 prints beside each motion."""
        return "".join(block.numbered(line) + "\n" for line, block in enumerate(self.blocks, 1))

    @property
    def beside(self) -> dict[int, bool]:
        """Lines in which the tool runs beside the contour by its radius, and the one with G40 -> whether that states
        a motion.  rs274 prints each such motion when it reads a later block, beside the line of that."""
        found: dict[int, bool] = {}
        active = False
        for line, block in enumerate(self.blocks, 1):
            text = re.sub(r"\([^)]*\)|;.*|[ \t]", "", block.text)
            if active and _CENTRE.search(text):
                active, found[line] = False, bool(re.search(r"[XYZ]", text, re.I))
                continue
            active = active or bool(_SIDE.search(text))
            if active:
                found[line] = False
        return found
