"""Lines that an edit would make longer than the control reads."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Ints
from postproc.base.document import Edits
from postproc.languages.gcode.source_map import SourceMapPart


def overlong(edits: Edits, places: SourceMapPart, rows: Ints, longest: int | None) -> Ints:
    """(K,) of ``rows`` (N,) of ``places``, which are edited, those whose line would be too long and is not yet;
    longest: bytes of a line without its end, None for any."""
    if longest is None or not len(edits):
        return np.empty(0, np.int64)
    rows = rows[np.argsort(places.text.blocks.start[places.block[rows]], kind="stable")]
    start, stop = (
        column[places.block[rows]] for column in (places.text.blocks.start, places.text.blocks.stop)
    )
    line = np.maximum(np.searchsorted(start, edits.start, side="right") - 1, 0)
    growth = np.zeros(len(rows), np.int64)
    np.add.at(growth, line, np.diff(edits.ends) - (edits.stop - edits.start))
    length = stop - start
    found = [
        k
        for k in np.flatnonzero((length <= longest) & (length + growth > longest)).tolist()
        if _longest_after(edits, places.raw, int(start[k]), int(stop[k])) > longest
    ]
    return np.asarray(rows[found])


def _longest_after(edits: Edits, raw: bytes, start: int, stop: int) -> int:
    """Bytes of the longest line that takes the place of that in ``start`` .. ``stop``."""
    low, high = np.searchsorted(edits.start, start), np.searchsorted(edits.start, stop, side="right")
    text, at = b"", start
    for edit in edits[int(low) : int(high)]:
        text += raw[at : edit.span.start] + edit.text
        at = edit.span.stop
    return max(len(line) for line in (text + raw[at:stop]).splitlines())
