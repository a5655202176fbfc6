"""Where the motions of a G-code program stand in its text, and what its words mean there: for the writer."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.gcode.orientation import Orientation
from postproc.dialects.gcode.words import Text, key
from postproc.geometry import Poses

COLUMNS = tuple(key(letter) for letter in "XYZABCIJKRPFUVWE")
"""Keys of the columns of ``Places.word``; a control's own follow."""


@dataclass(frozen=True, eq=False)
class Places:
    """One row a motion, as in the Toolpath; every motion is a block.

    text: words, blocks.  block (N,): row in text.blocks.
    columns (K,): keys; word (N, K): row in text.words of the word with that key in the block, -1 where it has none.
    verb (N,): row in text.words of the code (G1, G02 ...) that states the motion, -1 where it is inherited.
    insert (N,): offset at which words that are missing are inserted (behind the last word of the block).
    move (N,) Move and plane (N,) in force (0 XY, 1 ZX, 2 YZ); incremental (N,): axis words are differences (a word's
    own AC, IC goes before it: text.words.how); arc_absolute (N,): I J K are coordinates, else differences from the
    begin.
    scale (N,) [m]: what one unit of a length word is; increment (N,) [m]: what one unit of a length word without a
    decimal point is (the same but for controls that count in increments).
    frame (N,): row in ``frames``, the programmed coordinates in the base: base = frame @ (number * scale).
    begin (N, 3) [m]: where the motion begins, in its ``frame``; NaN where not known.
    orient (N,): row in ``orientations``, what the orientation words mean there, -1 where none are in force;
    turned_values, turned_before (N, 3): the numbers of these words in force at the end of the motion, and just before
    its block; NaN where not known.
    feed_mode (N,) Feed: F of INVERSE_TIME belongs to the whole motion.
    """

    text: Text
    block: Ints
    columns: tuple[int, ...]
    word: Ints
    verb: Ints
    insert: Ints
    move: Ints
    plane: Ints
    incremental: Bools
    arc_absolute: Bools
    scale: Floats
    increment: Floats
    frame: Ints
    frames: Poses
    begin: Floats
    orient: Ints
    orientations: tuple[Orientation, ...]
    turned_values: Floats
    turned_before: Floats
    feed_mode: Ints

    def __len__(self) -> int:
        return len(self.block)

    def column(self, letter: str, index: int | None = None) -> Ints:
        """(N,) row in text.words of the words with this address."""
        wanted = key(letter, index)
        return self.word[:, self.columns.index(wanted)]
