"""From where each motion may start: only from the end of the row before it, or from elsewhere too."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable

import numpy as np

from postproc.base.arrays import Bools
from postproc.languages.core import motion_sources
from postproc.languages.core.motion_sources import ELSEWHERE, Meeting, Source
from postproc.languages.krl.motion_rows import MotionRows

MOST = 30
"""Predecessors of a motion that are distinguished."""
_MEETINGS = 4 * MOST
"""Places where paths meet that are looked at for them."""
_TWO = 2
"""So many sources are distinguished; more are as good as two."""


def single_sources(rows: MotionRows) -> Bools:
    """(N,) the motion surely starts where the row before it ends, the first one where the program starts."""
    single = np.ones(len(rows), np.bool_)
    resolved = _resolved(rows)
    for row, sources in rows.sources_of.items():
        single[row] = _distinct(sources, resolved) == {row - 1}
    single[rows.never_from :] = False
    return single


def continuous(rows: MotionRows, single: Bools) -> Bools:
    """(N,) the motion surely starts where the row before it ends, and no other motion starts there; ``single`` (N,): as
    of ``single_sources``."""
    result = single.copy()
    for row in expanded(rows, _sources_of_others(rows, single)):
        if 0 <= row < len(result) - 1:
            result[row + 1] = False
    return result


def predecessors(rows: MotionRows, continues: Bools) -> dict[int, tuple[int, ...]]:
    """Row that does not continue the one before it (``continues`` (N,)) -> where it may start, as of a Toolpath."""
    found: dict[int, tuple[int, ...]] = {}
    many: set[Source] = set()
    for row in np.flatnonzero(~continues).tolist():
        if rows.never_from is not None and row >= rows.never_from:
            continue
        sources = rows.sources_of.get(row)
        known = {row - 1} if sources is None else distinguished_sources(rows, sources, many)
        found[row] = tuple(sorted(known)) or (ELSEWHERE,)
    return found


def distinguished_sources(rows: MotionRows, sources: frozenset[Source], many: set[Source]) -> set[int]:
    """The rows after sources, none where they are more than ``MOST``; many: meetings of so many, to which
    those are added that are found to."""
    seen: set[Source] = set()
    found: set[int] = set()
    todo = list(sources)
    while todo:
        source = todo.pop()
        if source in seen:
            continue
        seen.add(source)
        if isinstance(source, int):
            found.add(_there(rows, source))
        else:
            todo.extend(source.sources)
        if source in many or len(found) > MOST or len(seen) > _MEETINGS:
            if len(sources) == 1:
                many |= sources
            return set()
    return found


def _sources_of_others(rows: MotionRows, single: Bools) -> Iterable[Source]:
    """Where the motions start that do not simply follow the row before them."""
    others = {source for row, sources in rows.sources_of.items() if not single[row] for source in sources}
    return others | rows.unfollowed_ends


def expanded(rows: MotionRows, sources: Iterable[Source], visited: set[Meeting] | None = None) -> set[int]:
    """The rows (and ``START``, ``ELSEWHERE``) among sources, as of the core."""
    return {_there(rows, source) for source in motion_sources.expanded(sources, visited)}


def _there(rows: MotionRows, row: int) -> int:
    """The row; of a loop that was given up the rows are gone, and what starts there starts elsewhere."""
    return row if row < len(rows) else ELSEWHERE


def _distinct(sources: Iterable[Source], resolved: dict[Meeting, set[int]]) -> set[int]:
    found: set[int] = set()
    for source in sources:
        found |= {source} if isinstance(source, int) else resolved[source]
        if len(found) >= _TWO:
            break
    return found


def _resolved(rows: MotionRows) -> dict[Meeting, set[int]]:
    """Of the meetings from which rows may start, the rows that meet there; of more than two some two."""
    users: defaultdict[Meeting, list[Meeting]] = defaultdict(list)
    resolved: dict[Meeting, set[int]] = {}
    todo: list[tuple[Meeting, int]] = []
    waiting = [one for sources in rows.sources_of.values() for one in sources if isinstance(one, Meeting)]
    while waiting:
        meeting = waiting.pop()
        if meeting in resolved:
            continue
        resolved[meeting] = set()
        for source in meeting.sources:
            if isinstance(source, int):
                todo.append((meeting, source))
            else:
                users[source].append(meeting)
                waiting.append(source)
    while todo:
        meeting, row = todo.pop()
        known = resolved[meeting]
        if row not in known and len(known) < _TWO:
            known.add(row)
            todo.extend((user, row) for user in users[meeting])
    return resolved
