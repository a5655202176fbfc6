"""Whether what is cut before each motion is what the motions before it in the table cut.

The stock is simulated as if every motion ran once, in the order of the table. A row that may start elsewhere than where
the row before it ends (``MotionSequence.predecessors``) is behind a branch, in a loop or behind a routine of another
file: cuts between may be left out or run again, or others come before it.
"""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools
from postproc.base.findings import Finding
from postproc.toolpath import Toolpath

_ELSEWHERE = -2


def unordered_removal(toolpath: Toolpath, cuts: Bools, program: str) -> list[Finding]:
    """STK034 at the first motion before which other material may be removed than in the simulation, if a motion from
    there on cuts; cuts (N,): motions that remove stock."""
    cutting = np.flatnonzero(cuts)
    last = int(cutting[-1]) if len(cutting) else -1
    found: list[tuple[int, int, int]] = []
    for row, sources in sorted(toolpath.sequence.predecessors.items()):
        if row > last:
            break
        for source in sources:
            low, high = (source + 1, row) if source < row else (row, source + 1)
            if source == _ELSEWHERE:
                found.append((row, row, row - 1))
            elif cuts[max(low, 0) : high].any():
                found.append((row, max(low, 0), high - 1))
    if not found:
        return []
    row, low, high = found[0]
    own = cutting[(cutting >= low) & (cutting <= high)]
    if not len(own):
        what = "what the program runs before this motion is not in its table of motions, and may cut"
    else:
        low_line, high_line = toolpath.line[own[[0, -1]]].tolist()
        lines = f"in line {low_line}" if low_line == high_line else f"in lines {low_line} to {high_line}"
        runs = "may run several times" if low >= row else "may be skipped before this motion"
        what = f"motions that cut {lines} {runs}"
    rows = len({one[0] for one in found})
    more = f" ({rows} places, the first one here)" if rows > 1 else ""
    message = f"{what}: the stock is simulated as if all motions ran once in the order of their lines{more}"
    return [Finding("STK034", message, program, int(toolpath.line[row]))]
