"""What a family says of the rows of a program beside their targets: where they start, and why some stay as they are."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from postproc.base.arrays import Bools, FewRows, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.geometry import arc_through
from postproc.base.units import DEG
from postproc.toolpath import FrameRef, Toolpath

OTHER_PATHS = "several paths of the program lead to it or from the motion before it"
SHOWN = 20
"""Statements that are not understood are reported one by one up to this number."""


class LockedRows:
    """Rows whose end stays where it is, and why; the first reason counts.

    finding: of a row, a code and a message.  arcs, reads: codes of what is said of arcs and of readings.
    """

    def __init__(self, finding: Callable[[int, str, str], Finding], arcs: str, reads: str) -> None:
        self._finding, self._arcs, self._reads = finding, arcs, reads
        self._found: dict[int, Finding] = {}

    def add(self, rows: Iterable[int], code: str, message: str) -> None:
        for row in rows:
            if row not in self._found:
                self._found[row] = self._finding(row, code, message)

    def start_arc(self, rows: Iterable[int], line: int) -> None:
        """At their ends the arc in a ``line`` starts."""
        message = f"the arc in line {line} starts at this end point and is not corrected"
        self.add(rows, self._arcs, message)

    def are_read(self, rows: Iterable[int], line: int) -> None:
        """Their ends are read in a ``line``."""
        self.add(rows, self._reads, f"line {line} reads the end position of this motion")

    def done(self) -> dict[int, Finding]:
        """The rows in their order."""
        return dict(sorted(self._found.items()))


def axis_targets(axes: Mapping[int, Sequence[float]], count: int) -> FewRows:
    """Angles (6) [deg] of some of ``count`` rows, in rad."""
    rows = sorted(axes)
    return FewRows(
        np.array(rows, np.int32), np.array([axes[row] for row in rows]).reshape(-1, 6) * DEG, count
    )


def circles(starts: Floats, vias: Floats, ends: Floats, nearest: float) -> tuple[Floats, Floats, Floats]:
    """Centres, normals (K, 3) and sweeps (K,) [m, rad] of the arcs from ``starts`` (K, 3) through ``vias`` (K, 3) to
    ``ends`` (K, 3) [m]; NaN where these define none that is known, or two of them are ``nearest`` [m] or less apart."""
    centre, normal, sweep = arc_through(starts, vias, ends)
    pairs = ((starts, vias), (vias, ends), (starts, ends))
    near = np.min([np.linalg.norm(one - other, axis=1) for one, other in pairs], axis=0)
    with np.errstate(invalid="ignore"):
        lost = ~(np.isfinite(sweep) & np.isfinite(centre).all(axis=1) & (near > nearest))
    centre[lost], normal[lost], sweep[lost] = np.nan, np.nan, np.nan
    return centre, normal, sweep


def follow_on(joined: Bools, rows: Sequence[int], before: Sequence[tuple[int, ...]]) -> Bools:
    """(N,) each motion surely starts where the row before it ends, and no other motion starts there.

    ``rows``: those of which ``before`` says after which rows they run; of any other one ``joined`` (N,) says it.
    """
    found = joined.copy()
    followers = Counter(chain.from_iterable(before))
    for row, places in zip(rows, before, strict=True):
        found[row] = places == (row - 1,) and followers[row - 1] == 1
    return found


def only_used(path: Toolpath) -> Toolpath:
    """Without the frames that no motion has: nobody needs to know their pose."""
    base, tool, frames = used_frames(path.base, path.tool, path.frames)
    return path.with_columns(base=base, tool=tool, frames=frames)


def used_frames(
    base: Ints, tool: Ints, frames: Sequence[FrameRef]
) -> tuple[Ints, Ints, tuple[FrameRef, ...]]:
    """``base`` and ``tool`` (N,), (N,) as indices in those of ``frames`` that motions have, and these."""
    present = np.zeros(len(frames) + 1, np.bool_)
    present[base] = present[tool] = True  # the last entry is for those that are not known, -1
    kept = np.flatnonzero(present[:-1]).tolist()
    renamed = np.full(len(frames) + 1, -1, np.int32)
    renamed[kept] = np.arange(len(kept))
    return renamed[base], renamed[tool], tuple(frames[i] for i in kept)


def grouped(
    refused: Mapping[int, Finding], lines: Ints, cause_of: Callable[[int], str] = lambda row: ""
) -> list[Finding]:
    """The refusals of rows, those of one code and cause as one finding; lines (N,): of all rows; ``cause_of`` a
    row: "" where its message says it."""
    groups: dict[tuple[str, str], list[int]] = {}
    for row, finding in refused.items():
        groups.setdefault((finding.code, cause_of(row) or finding.message), []).append(row)
    found = []
    for chosen in groups.values():
        first = refused[chosen[0]]
        if len(chosen) > 1:
            these = lines[chosen]
            message = f"{first.message}; {len(chosen)} motions, lines {these.min()} to {these.max()}"
            first = replace(first, message=message)
        found.append(first)
    return found


def moving_external(external: Floats) -> tuple[int, str] | None:
    """The first row at which an external axis is not where it was first, and what is stated there; external (N, 6)."""
    moving = []
    for axis in range(6):
        values = external[:, axis]
        stated = values[~np.isnan(values)]
        if len(stated) and (not np.isfinite(stated).all() or (stated != stated[0]).any()):
            moving.append((int(np.argmax(~np.isnan(values) & (values != stated[0]))), f"E{axis + 1}"))
    if not moving:
        return None
    verb = "moves" if len(moving) == 1 else "move"
    names = ", ".join(name for _, name in moving)
    return min(moving)[0], f"{names} {verb}; the cell must state what external axes carry"


def not_understood(
    texts: Sequence[tuple[bytes, int]], finding: Callable[[str, int], Finding]
) -> list[Finding]:
    """Statements, each with the byte where it starts, that are not understood: some one by one, then their number."""
    found = [finding(f"{shown(text)!r} is not understood", at) for text, at in texts[:SHOWN]]
    if len(texts) > SHOWN:
        message = f"{len(texts) - SHOWN} further statements are not understood"
        found.append(finding(message, texts[SHOWN][1]))
    return found


def shown(text: bytes) -> str:
    """The start of a statement as messages have it."""
    return " ".join(text.decode("latin-1").split())[:60]
