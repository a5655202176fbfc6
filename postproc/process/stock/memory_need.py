"""How much memory a simulated stock needs, said before it is taken."""

from __future__ import annotations

from postproc.base.findings import Finding, Refusal
from postproc.base.memory import free_memory

OF_A_SWEEP, OF_A_CELL, OF_AN_ENTRY, OF_A_PLANE = 1200, 30, 8, 16
"""Bytes at the peak: of a part of a motion in all arrays of a run, of a cell of the blank, of an entry of its list, and
of what bounds the distance to it."""

SHARE = 0.8
"""Of the free memory that a stock may take."""


def check_memory(sweeps: int, cells: int = 0, entries: int = 0, planes: int = 0, file: str = "") -> None:
    """Refusal STK031 where so many ``sweeps``, ``cells`` of the blank, ``entries`` of their lists and ``planes`` need
    more memory than is free."""
    need = sweeps * OF_A_SWEEP + cells * OF_A_CELL + entries * OF_AN_ENTRY + planes * OF_A_PLANE
    free = free_memory()
    if free is None or need <= SHARE * free:
        return
    listed = f", {cells:,} cells and {entries:,} entries of their lists" if cells else ""
    message = (
        f"the stock needs some {need / 1e9:.2g} GB of memory for {sweeps:,} parts of motions{listed}; "
        f"{free / 1e9:.2g} GB are free"
    )
    raise Refusal(Finding("STK031", message, file))
