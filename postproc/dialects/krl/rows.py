"""The motions as they are found, in their order, and why they are refused."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

from postproc.dialects.krl.bulk import Bulk
from postproc.dialects.krl.places import Auxiliary, InlineForm, Relative, Variable
from postproc.dialects.krl.spatial import Arc, Numbers
from postproc.dialects.krl.state import Anchor, Frame, Source, State
from postproc.dialects.krl.target import Target, Unclear
from postproc.document import Document
from postproc.toolpath import Annotation

NAN = float("nan")
NAN6: Numbers = (NAN,) * 6
FEW = 8
"""Places where the robot may come from that are kept apart."""

NO_ARC = (NAN,) * 7


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a row is refused; equal ``cause`` and code are told together."""

    code: str
    message: str
    cause: str = ""


HELP = {
    "KRL001": "Write it as PTP or LIN with an aggregate of numbers, or leave it as it is.",
    "KRL002": "Write the target as numbers: LIN {X .., Y .., Z .., A .., B .., C ..}.",
    "KRL003": "Put the module's .dat beside its .src, declare the point there, or give the $config.dat that does.",
    "KRL004": "Write all of X, Y, Z, A, B, C in the first Cartesian motion after that.",
    "KRL005": "Set $BASE and $TOOL before it, to numbers or to BASE_DATA[n] and TOOL_DATA[n]; give the $config.dat if"
    " an FDAT of it does.",
    "KRL006": "Write the cut as a straight run of motions, outside of loops and branches that inputs decide.",
    "KRL008": "Write the motion and the one before it with absolute targets.",
    "KRL009": "Write the motion before the arc with all components, and the arc with three points apart.",
    "KRL010": "Check what the routine does; write all components in the motion after it.",
    "KRL011": "Set $BASE to numbers or to BASE_DATA[n] for this cut.",
    "KRL013": "Programs with a stationary tool are not corrected by this version.",
    "KRL014": "Close every block and every DEF.",
    "KRL015": "Call it where it always runs with the same values, or make the subprogram a file of its own.",
    "KRL016": "Nothing needs to be done.",
    "KRL017": "Write all of X, Y, Z, A, B, C in the first motion after the change of frame.",
    "KRL022": "Correct only cuts in which no external axis carries the robot or the workpiece.",
    "KRL019": "Write the declaration as an aggregate of numbers.",
    "KRL023": "Nothing needs to be done if these motions are not meant to run.",
    "KRL025": "Write the names with the letters A to Z; retype a word that only looks like one of KRL.",
    "KRL024": "Let the post-processor write the loop as a straight run of motions.",
}


class Row(NamedTuple):
    """A motion that was read alone; see Toolpath and Places for what its entries mean (mm, deg)."""

    kind: int
    line: int
    motion: tuple[int, int, int, int]
    values: Numbers
    axes: Numbers
    feed: float
    base: int
    tool: int
    blend: float
    target: Target | None
    inherits: int
    way: tuple[float, ...]


class Lot(NamedTuple):
    """A run of common lines, and the state in which it is passed."""

    bulk: Bulk
    feed: float
    base: int
    tool: int
    blend: float


@dataclass
class Rows:
    """``chunks``: single rows and runs of common lines in their order; ``places``: rows by what is rare."""

    document: Document
    chunks: list[list[Row] | Lot] = field(default_factory=list)
    count: int = 0
    anchors: dict[int, Anchor] = field(default_factory=dict)
    reasons: dict[int, Reason] = field(default_factory=dict)
    ranges: list[tuple[int, int, Reason]] = field(default_factory=list)
    variables: dict[int, Variable] = field(default_factory=dict)
    locked: dict[int, str] = field(default_factory=dict)
    arcs: dict[int, Auxiliary] = field(default_factory=dict)
    relative: dict[int, Relative] = field(default_factory=dict)
    whole: dict[int, str] = field(default_factory=dict)
    apart: list[tuple[int, int]] = field(default_factory=list)
    inline: dict[int, InlineForm] = field(default_factory=dict)
    slurred: dict[int, float] = field(default_factory=dict)
    builds_on: dict[int, frozenset[Source]] = field(default_factory=dict)
    reads: list[tuple[int, frozenset[Source]]] = field(default_factory=list)
    sources: defaultdict[bytes, set[Source]] = field(default_factory=lambda: defaultdict(set))
    annotations: list[Annotation] = field(default_factory=list)
    comments: list[Annotation] = field(default_factory=list)
    external: dict[bytes, float | None] = field(default_factory=dict)
    moving: dict[bytes, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return self.count

    def add(self, row: Row, anchor: Anchor | None) -> int:
        """Adds a motion; gives its number."""
        if not self.chunks or not isinstance(self.chunks[-1], list):
            self.chunks.append([])
        chunk = self.chunks[-1]
        assert isinstance(chunk, list)
        chunk.append(row)
        if anchor is not None:
            self.anchors[self.count] = anchor
        if row.target is not None and row.target.external:
            self.follow_external(self.count, row.target.external)
        self.count += 1
        return self.count - 1

    def add_bulk(self, bulk: Bulk, state: State, reason: Reason | None) -> int:
        """Adds a run of common lines; gives the number of the last row."""
        first = self.count
        self.chunks.append(Lot(bulk, state.feed, index(state.base), index(state.tool), state.blend))
        self.count += len(bulk)
        for at, external in bulk.external:
            self.follow_external(first + at, external)
        if reason is not None:
            self.ranges.append((first, self.count, reason))
        return self.count - 1

    def joined(self, sources: frozenset[Source]) -> frozenset[Source]:
        """The same rows and marks, as one mark where they are many."""
        if len(sources) <= FEW:
            return sources
        mark = b"join %d" % len(self.sources)
        self.sources[mark] |= sources
        return frozenset([mark])

    def truncate(self, count: int) -> None:
        """Takes the rows from ``count`` on out again."""
        while self.count > count:
            chunk = self.chunks.pop()
            size = len(chunk) if isinstance(chunk, list) else len(chunk.bulk)
            self.count -= size
            if self.count < count and isinstance(chunk, list):
                self.chunks.append(chunk[: count - self.count])
                self.count = count
        for sparse in (
            self.anchors, self.reasons, self.variables, self.locked, self.arcs, self.relative, self.whole, self.inline,
            self.slurred, self.builds_on,
        ):  # fmt: skip
            while sparse and next(reversed(sparse)) >= count:
                sparse.popitem()
        while self.ranges and self.ranges[-1][0] >= count:
            self.ranges.pop()

    def follow_external(self, row: int, external: tuple[tuple[bytes, float | None, bytes], ...]) -> None:
        """Notes in ``moving`` the first row at which an external axis is not where it was before."""
        for key, value, _ in external:
            if value is None or self.external.setdefault(key, value) != value:
                self.moving.setdefault(key, row)


def index(frame: Frame | Unclear) -> int:
    """Index in the table of frames, -1 for one that is not known."""
    return frame.index if isinstance(frame, Frame) else -1


def refusal(unclear: Unclear, subject: str, cause: str = "") -> Reason:
    return Reason(unclear.code, f"{subject}{unclear.message}", cause)


def way_of(arc: Arc | None) -> tuple[float, ...]:
    """Centre [mm], normal and sweep [deg] in a row."""
    return NO_ARC if arc is None else (*arc.centre, *arc.normal, arc.sweep)
