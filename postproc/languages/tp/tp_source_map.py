"""Where the text has what may be edited."""

from __future__ import annotations

from dataclasses import dataclass

from postproc.base.arrays import Floats
from postproc.languages.tp.position_data import TpPosition
from postproc.languages.tp.tp_listing import TpListing
from postproc.languages.tp.tp_rows import TpRows
from postproc.languages.tp.tp_statements import TpMove


@dataclass(frozen=True, eq=False)
class TpSourceMap:
    """What the text says of N motions.

    numbers, vias (N, 6): X, Y, Z [mm], W, P, R [deg] of targets and auxiliary points, NaN where not known; ``moves``:
    None where one is not understood; ``points``: target and auxiliary point; ``runs``: row of an A motion -> rows of
    its run; ``uses``: number of a point -> points of motions that it is; ``read``: points that other statements read;
    ``any_read``: a statement reads one that is computed.
    """

    listing: TpListing
    positions: dict[int, TpPosition]
    numbers: Floats
    vias: Floats
    moves: tuple[TpMove | None, ...]
    points: tuple[tuple[TpPosition | None, TpPosition | None], ...]
    runs: dict[int, tuple[int, ...]]
    uses: dict[int, int]
    read: frozenset[int]
    any_read: bool

    @staticmethod
    def of(
        listing: TpListing,
        positions: dict[int, TpPosition],
        rows: TpRows,
        runs: dict[int, tuple[int, ...]],
        read: tuple[set[int], bool],
    ) -> TpSourceMap:
        uses: dict[int, int] = {}
        for move in rows.moves:
            for point in () if move is None else move.points:
                uses[point.number] = uses.get(point.number, 0) + 1
        return TpSourceMap(
            listing, positions, rows.numbers, rows.vias, tuple(rows.moves), tuple(rows.points), runs, uses,
            frozenset(read[0]), read[1],
        )  # fmt: skip
