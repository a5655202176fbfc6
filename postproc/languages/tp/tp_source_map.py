"""Where the text has what may be edited."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.languages.tp.position_data import TpPosition, TpPositions
from postproc.languages.tp.tp_listing import TpListing
from postproc.languages.tp.tp_rows import TpRows
from postproc.languages.tp.tp_statements import TpMove


@dataclass(frozen=True, eq=False)
class TpSourceMap:
    """What the text says of N motions.

    numbers, vias (N, 6): X, Y, Z [mm], W, P, R [deg] of targets and auxiliary points, NaN where not known; ``moves``:
    None where one is not understood; starts (N,): offsets of their texts; targets, middles (N,): numbers of their
    points, -1 without; ``runs``: row of an A motion -> rows of its run; ``shared``: points that are used several times;
    ``read``: points that other statements read; ``any_read``: a statement reads one that is computed.
    """

    listing: TpListing
    positions: TpPositions
    numbers: Floats
    vias: Floats
    moves: tuple[TpMove | None, ...]
    starts: Ints
    targets: Ints
    middles: Ints
    runs: dict[int, tuple[int, ...]]
    shared: frozenset[int]
    read: frozenset[int]
    any_read: bool

    @staticmethod
    def of(
        listing: TpListing,
        positions: TpPositions,
        rows: TpRows,
        runs: dict[int, tuple[int, ...]],
        read: tuple[set[int], bool],
    ) -> TpSourceMap:
        used, counts = np.unique(np.concatenate([rows.targets, rows.middles]), return_counts=True)
        return TpSourceMap(
            listing, positions, rows.numbers, rows.vias, tuple(rows.moves), rows.starts, rows.targets, rows.middles,
            runs, frozenset(used[counts > 1].tolist()), frozenset(read[0]), read[1],
        )  # fmt: skip

    def target(self, row: int) -> TpPosition | None:
        return self.positions.get(int(self.targets[row]))

    def middle(self, row: int) -> TpPosition | None:
        """The auxiliary point of an arc."""
        return self.positions.get(int(self.middles[row]))
