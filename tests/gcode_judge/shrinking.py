"""The least program for which something still holds: without blocks, then without words, then plainly written."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from .blocks import Block, Made

_LABEL = re.compile(r"[ \t]*(?:[nN][\d ]+)?[oO][ \t]*(\d+|<[^>]*>)")
_INNER = re.compile(r"\[[^\[\]]*\]|#[ \t]*(?:\d+|<[^>]*>)")


@dataclass
class Shrinking:
    """``holds``: of a program; ``trials``: how many more are tried."""

    holds: Callable[[Made], bool]
    trials: int = 400

    def least(self, made: Made) -> Made:
        """The least program that is found."""
        made = self.first(made, [made._replace(delete=False)])
        changed = True
        while changed and self.trials > 0:
            before = made
            for candidates in (self.without_blocks, self.without_pairs, self.without_words, self.plainer):
                made = self.improve(made, candidates)
            changed = made != before
        return made

    def first(self, made: Made, candidates: list[Made]) -> Made:
        for candidate in candidates:
            if candidate != made and self.trials > 0:
                self.trials -= 1
                if self.holds(candidate):
                    return candidate
        return made

    def improve(self, made: Made, candidates: Callable[[Made], Iterator[Made]]) -> Made:
        """The first candidate that holds replaces the program, as long as there is one."""
        again = True
        while again and self.trials > 0:
            again = False
            for candidate in candidates(made):
                if self.trials <= 0:
                    break
                self.trials -= 1
                if self.holds(candidate):
                    made, again = candidate, True
                    break
        return made

    @staticmethod
    def without_blocks(made: Made) -> Iterator[Made]:
        """Without a run of blocks: the longest first, the last blocks first."""
        count = len(made.blocks)
        size = count // 2
        while size:
            for stop in range(count, 0, -size):
                start = max(stop - size, 0)
                yield made._replace(blocks=made.blocks[:start] + made.blocks[stop:])
            size //= 2

    @staticmethod
    def without_pairs(made: Made) -> Iterator[Made]:
        """Without the O words of a label."""
        labels = [_label(block) for block in made.blocks]
        for label in sorted({label for label in labels if label}):
            kept = [block for block, own in zip(made.blocks, labels, strict=True) if own != label]
            yield made._replace(blocks=tuple(kept))
            places = [index for index, own in enumerate(labels) if own == label]
            yield made._replace(blocks=made.blocks[: places[0]] + made.blocks[places[-1] + 1 :])

    @staticmethod
    def without_words(made: Made) -> Iterator[Made]:
        for index, block in enumerate(made.blocks):
            if block.slash:
                yield _with(made, index, block._replace(slash=False))
            for at in range(len(block.pieces) if len(block.pieces) > 1 else 0):
                yield _with(made, index, block._replace(pieces=block.pieces[:at] + block.pieces[at + 1 :]))

    @staticmethod
    def plainer(made: Made) -> Iterator[Made]:
        """Numbers for expressions, single blanks, capitals."""
        for index, block in enumerate(made.blocks):
            plain = tuple(piece.strip().upper() for piece in block.pieces)
            plain = tuple(piece if at == 0 else " " + piece for at, piece in enumerate(plain))
            if plain != block.pieces:
                yield _with(made, index, block._replace(pieces=plain))
            if _label(block):
                continue
            for at, piece in enumerate(block.pieces):
                for found in _INNER.finditer(piece):
                    if "=" in piece and found.start() <= piece.index("#"):
                        continue
                    text = piece[: found.start()] + "3" + piece[found.end() :]
                    yield _with(
                        made, index, block._replace(pieces=(*block.pieces[:at], text, *block.pieces[at + 1 :]))
                    )


def _label(block: Block) -> str:
    found = _LABEL.match(block.text)
    return found[1] if found else ""


def _with(made: Made, index: int, block: Block) -> Made:
    return made._replace(blocks=(*made.blocks[:index], block, *made.blocks[index + 1 :]))
