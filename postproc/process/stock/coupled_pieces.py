"""The pieces of sweeps whose engagement and displacement are solved together, and the places at their ends."""

from __future__ import annotations

from typing import NamedTuple

from postproc.base.arrays import Floats, Ints
from postproc.process.stock.borrowed import borrowed
from postproc.process.stock.compiled import compiled


class Pieces(NamedTuple):
    """P pieces of sweeps in the order in which they run.

    rows (P, ROW): as programmed; laws (P, 9), live (P, 2), heading (P, 3): as of ``SweepCutters``; start, end (P,):
    their nodes; fresh (P,): 1 where the node at the start is solved, 0 where it is the end of the piece before;
    earlier: sweeps of the stock before the first of them; known: 1 where the wrenches of the nodes are near the
    solution, 0 where that of the place before is a better guess.
    """

    rows: Floats
    laws: Floats
    live: Floats
    heading: Floats
    start: Ints
    end: Ints
    fresh: Ints
    earlier: int
    known: int


class Nodes(NamedTuple):
    """K places of paths, in the axes of the stock, wrenches [N, N m] about the tip.

    base (K, 6): displacement without wrench, shift [m] and turn [rad]; slope (K, 6, 6): its derivative by the wrench;
    wrench (K, 6): of the nominal engagement, or as it was solved before, to be replaced by the solution; residual (K,)
    [m]: what remains between both displacements, 0 where it was not solved before; area (K,) [m2]: removed area across
    the feed.
    """

    base: Floats
    slope: Floats
    wrench: Floats
    residual: Floats
    area: Floats


@compiled
def lent_pieces(pieces: Pieces) -> Pieces:
    """The same pieces, for compiled code that does not count references to them."""
    return Pieces(
        borrowed(pieces.rows),
        borrowed(pieces.laws),
        borrowed(pieces.live),
        borrowed(pieces.heading),
        borrowed(pieces.start),
        borrowed(pieces.end),
        borrowed(pieces.fresh),
        pieces.earlier,
        pieces.known,
    )


@compiled
def lent_nodes(nodes: Nodes) -> Nodes:
    """The same places, for compiled code that does not count references to them."""
    return Nodes(
        borrowed(nodes.base),
        borrowed(nodes.slope),
        borrowed(nodes.wrench),
        borrowed(nodes.residual),
        borrowed(nodes.area),
    )
