"""The least program for which something still holds: without blocks, then without words, then plainly written."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace

from .blocks import Block, Made

_LABEL = re.compile(r"[ \t]*(?:[nN][\d ]+)?[oO][ \t]*(\d+|<[^>]*>)")
_INNER = re.compile(r"\[[^\[\]]*\]|#[ \t]*(?:\d+|<[^>]*>)")


@dataclass
class Shrinking:
    """``holds``: of a program; ``trials``: how many more are tried."""

    holds: Callable[[Made], bool]
    trials: int = 600

    def least(self, made: Made, line: int) -> Made:
        """The least program that is found; ``line``: where the difference is, what is after it goes first."""
        ends = [index for index, block in enumerate(made.blocks) if index > line and not _label(block)]
        whole = made
        for kept in (ends[-1:], ends[-2:]):
            blocks = whole.blocks[:line] + tuple(whole.blocks[index] for index in kept)
            made = self.tried(made, replace(whole, blocks=blocks)) if made is whole else made
        made = self.tried(made, replace(made, delete=False))
        changed = True
        while changed and self.trials > 0:
            before = made
            made = self.without_blocks(made)
            made = self.without_labels(made)
            made = self.without_words(made)
            made = self.plainer(made)
            changed = made != before
        return made

    def tried(self, made: Made, candidate: Made) -> Made:
        """The candidate where it holds."""
        if candidate == made or self.trials <= 0:
            return made
        self.trials -= 1
        return candidate if self.holds(candidate) else made

    def without_blocks(self, made: Made) -> Made:
        """Without runs of blocks: the longest first, the last blocks first."""
        size = max(len(made.blocks) // 2, 1)
        while size:
            stop = len(made.blocks)
            while stop > 0:
                start = max(stop - size, 0)
                made = self.tried(made, replace(made, blocks=made.blocks[:start] + made.blocks[stop:]))
                stop = start
            size //= 2
        return made

    def without_labels(self, made: Made) -> Made:
        """Without the O words of a label, with or without what is between them."""
        for label in sorted({_label(block) for block in made.blocks} - {""}):
            places = [index for index, block in enumerate(made.blocks) if _label(block) == label]
            if not places:
                continue
            blocks = made.blocks
            shorter = self.tried(made, replace(made, blocks=blocks[: places[0]] + blocks[places[-1] + 1 :]))
            if shorter is made:
                kept = tuple(block for block in blocks if _label(block) != label)
                shorter = self.tried(made, replace(made, blocks=kept))
            made = shorter
        return made

    def without_words(self, made: Made) -> Made:
        for index in reversed(range(len(made.blocks))):
            made = self.tried(made, _with(made, index, replace(made.blocks[index], slash=False)))
            for at in reversed(range(len(made.blocks[index].pieces))):
                block = made.blocks[index]
                if len(block.pieces) > 1:
                    fewer = block.pieces[:at] + block.pieces[at + 1 :]
                    made = self.tried(made, _with(made, index, replace(block, pieces=fewer)))
        return made

    def plainer(self, made: Made) -> Made:
        """Single blanks and capitals; numbers for expressions."""
        whole = self.tried(made, replace(made, blocks=tuple(_plain(block) for block in made.blocks)))
        for index in range(len(made.blocks) if whole is made else 0):
            whole = self.tried(whole, _with(whole, index, _plain(whole.blocks[index])))
        made = whole
        for index, block in enumerate(made.blocks):
            for at, piece in enumerate(() if _label(block) else block.pieces):
                head, equals, tail = piece.rpartition("=")
                for found in _INNER.finditer(tail):
                    text = head + equals + tail[: found.start()] + "3" + tail[found.end() :]
                    pieces = (*made.blocks[index].pieces[:at], text, *made.blocks[index].pieces[at + 1 :])
                    simpler = self.tried(made, _with(made, index, replace(block, pieces=pieces)))
                    if simpler is not made:
                        made = simpler
                        break
        return made


def _plain(block: Block) -> Block:
    pieces = [piece.strip().upper() for piece in block.pieces]
    return replace(block, pieces=tuple(piece if at == 0 else " " + piece for at, piece in enumerate(pieces)))


def _label(block: Block) -> str:
    found = _LABEL.match(block.text)
    return found[1] if found else ""


def _with(made: Made, index: int, block: Block) -> Made:
    return replace(made, blocks=(*made.blocks[:index], block, *made.blocks[index + 1 :]))
