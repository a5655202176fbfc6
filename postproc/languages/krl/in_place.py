"""Edits of targets in place: their literals, and what their aggregates leave out."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.decimals import fixed
from postproc.base.document import Edit, Edits, Span
from postproc.languages.krl.write_plan import KEYS, LETTER, Components, KrlWritePlan

_KEY = re.compile(rb"[A-Za-z]")
_LAST_KEY = re.compile(rb"[A-Za-z](?=[^A-Za-z]*\Z)")


def literal_edits(task: KrlWritePlan, rows: Ints) -> Edits:
    """Edits of rows (K,) whose targets are literals of their own: of those that change."""
    said, wanted, kept = task.targets(rows)
    return _edits(task, said, wanted, ~kept)


def _edits(task: KrlWritePlan, components: Components, wanted: Floats, chosen: Bools) -> Edits:
    """Edits of the ``chosen`` (K, 6) literals to the ``wanted`` (K, 6) values."""
    start, stop, file = components.start[chosen], components.stop[chosen], components.file[chosen]
    before = np.zeros(len(start), np.uint8)
    for index, raw in enumerate(task.raws):
        here = file == index
        before[here] = raw[start[here] - 1]
    # "Z- 30" is Z and a number, "Z30.1" would be a name.
    texts, ends = fixed(wanted[chosen], components.decimals[chosen], LETTER[before])
    return Edits(file, start, stop, texts, ends)


def completion(
    task: KrlWritePlan, home: int, at: int, texts: Sequence[bytes], missing: Sequence[int]
) -> Edit:
    """The insertion of the ``missing`` of six components into an aggregate: after its last one or before its first."""
    raw = task.documents[home].raw
    first = bool(LETTER[raw[at]])
    key = _KEY.match(raw, at) if first else _LAST_KEY.search(raw, max(at - 80, 0), at)
    keys = KEYS.lower() if key is not None and key[0].islower() else KEYS
    words = b",".join([keys[i].encode() + b" " + texts[i] for i in missing])
    return Edit(Span(home, at, at), words + b"," if first else b"," + words)


def partial_edits(task: KrlWritePlan, rows: Ints, completed: Bools) -> Edits:
    """Edits of partial targets (K,) in their lines; completed (N, 6): the components that they get."""
    said, wanted, kept = task.targets(rows)
    home, insert, gets = task.places.home[rows], task.places.insert[rows], completed[rows]
    added = [
        completion(
            task,
            int(home[k]),
            int(insert[k]),
            task.texts(said, wanted, kept, k),
            np.flatnonzero(gets[k]).tolist(),
        )
        for k in np.flatnonzero(gets.any(axis=1)).tolist()
    ]
    return Edits.joined(_edits(task, said, wanted, ~kept & (task.places.start[rows] >= 0)), added)
