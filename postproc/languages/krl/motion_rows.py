"""The motions as they are found, in their order, and why they are refused."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from typing import NamedTuple

from postproc.base.arrays import Floats
from postproc.base.document import Document
from postproc.languages.core.comments_in_force import InForce
from postproc.languages.core.motion_sources import Meeting, Source
from postproc.languages.krl.external_axes import UNSTATED, carried_on, six
from postproc.languages.krl.modal_state import Anchor, FrameIndex, ModalState
from postproc.languages.krl.source_map import Auxiliary, PointVariable, Relative
from postproc.languages.krl.spatial import Arc, Numbers
from postproc.languages.krl.target import KrlTarget, UnknownValue
from postproc.languages.krl.vectorised import VectorisedLines
from postproc.toolpath import Annotation

NAN = float("nan")
NAN6: Numbers = (NAN,) * 6
NO_ARC = (NAN,) * 7


class RowRefusal(NamedTuple):
    """Why a row is refused; equal ``cause`` and code are reported together."""

    code: str
    message: str
    cause: str = ""


class MotionRow(NamedTuple):
    """A motion that was read alone; see Toolpath and KrlSourceMap for what its entries mean (mm, deg).  inserted: of
    points that are inserted into it, the approximation with C_DIS."""

    kind: int
    line: int
    motion: tuple[int, int, int, int]
    values: Numbers
    axes: Numbers
    feed: float
    base: int
    tool: int
    blend: float
    target: KrlTarget | None
    inherits: int
    path: tuple[float, ...]
    orientation: int = 0
    arc_frame: int = 0
    external: Numbers = UNSTATED
    inserted: float = NAN


class VectorisedLot(NamedTuple):
    """A run of common lines, and the state in which it is passed; external: E1..E6 of all lines, or of each (K, 6)."""

    vectorised: VectorisedLines
    feed: float
    base: int
    tool: int
    blend: float
    external: Numbers | Floats
    orientation: int = 0
    arc_frame: int = 0


@dataclass
class MotionRows:
    """``chunks``: single rows and runs of common lines in their order; ``places``: rows by what is rare.

    ``passing``: points of spline blocks; ``entries``: first point of such a block -> line of its header.
    ``sources_of``: rows that may start elsewhere than where the row before ends -> where.
    ``stopped``: rows before which the advance run stops (2) or may (1);
    ``stopped_at_end``: the same of ends of routines: the count of rows, their sources, and 2 or 1.
    ``meetings``: of places that have a name: labels, routines.
    ``calls``: the count of rows, and after which ones a routine of another module moves the robot.
    ``unfollowed_ends``: where routines end after which it is not known what runs.
    ``never_from``: the first row of those that never run.
    ``in_force``: rows from which on other FORCE and COMPENSATE comments are in force -> these.
    """

    document: Document
    chunks: list[list[MotionRow] | VectorisedLot] = field(default_factory=list)
    count: int = 0
    anchors: dict[int, Anchor] = field(default_factory=dict)
    reasons: dict[int, RowRefusal] = field(default_factory=dict)
    ranges: list[tuple[int, int, RowRefusal]] = field(default_factory=list)
    variables: dict[int, PointVariable] = field(default_factory=dict)
    locked: dict[int, str] = field(default_factory=dict)
    arcs: dict[int, Auxiliary] = field(default_factory=dict)
    relative: dict[int, Relative] = field(default_factory=dict)
    no_insert_before: dict[int, str] = field(default_factory=dict)
    sources_of: dict[int, frozenset[Source]] = field(default_factory=dict)
    stopped: dict[int, int] = field(default_factory=dict)
    stopped_at_end: list[tuple[int, frozenset[Source], int]] = field(default_factory=list)
    calls: list[tuple[int, frozenset[Source]]] = field(default_factory=list)
    unfollowed_ends: set[Source] = field(default_factory=set)
    never_from: int | None = None
    approximated: dict[int, float] = field(default_factory=dict)
    builds_on: dict[int, frozenset[Source]] = field(default_factory=dict)
    reads: list[tuple[int, frozenset[Source]]] = field(default_factory=list)
    meetings: defaultdict[bytes, Meeting] = field(default_factory=lambda: defaultdict(Meeting))
    annotations: list[Annotation] = field(default_factory=list)
    in_force: dict[int, tuple[InForce, InForce]] = field(default_factory=dict)
    comments: list[Annotation] = field(default_factory=list)
    passing: dict[int, bool] = field(default_factory=dict)
    entries: dict[int, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return self.count

    def add(self, row: MotionRow, anchor: Anchor | None) -> int:
        """Adds a motion; gives its number."""
        if not self.chunks or not isinstance(self.chunks[-1], list):
            self.chunks.append([])
        chunk = self.chunks[-1]
        assert isinstance(chunk, list)
        chunk.append(row)
        if anchor is not None:
            self.anchors[self.count] = anchor
        self.count += 1
        return self.count - 1

    def add_vectorised(
        self, vectorised: VectorisedLines, state: ModalState, reason: RowRefusal | None
    ) -> int:
        """Adds a run of common lines; gives the number of the last row."""
        first = self.count
        external = carried_on(state.external, vectorised.external, bool(state.external_apart))
        frames = index(state.base), index(state.tool)
        self.chunks.append(
            VectorisedLot(
                vectorised,
                state.steady_feed,
                *frames,
                state.steady_blend,
                external,
                state.orientation,
                state.arc_frame,
            )
        )
        self.count += len(vectorised)
        state.external = external if isinstance(external, tuple) else six(external[-1].tolist())
        if reason is not None:
            self.ranges.append((first, self.count, reason))
        return self.count - 1

    def note_start(self, state: ModalState) -> None:
        """Notes where the next row may start, if that is not where the row before ends, and whether the advance run
        stops before it."""
        sources = state.sources
        if state.stop:
            self.stopped[self.count] = state.stop
            state.stop = 0
        self._note_comments(state.comments)
        if len(sources) != 1 or self.count - 1 not in sources:
            self.sources_of[self.count] = sources

    def _note_comments(self, in_force: tuple[InForce, InForce]) -> None:
        """Notes the comments in force at the next row, if they are not those of the row before, or some precede it."""
        last = self.in_force[next(reversed(self.in_force))] if self.in_force else (None, None)
        if in_force != last or (self.annotations and self.annotations[-1].row == self.count):
            self.in_force[self.count] = in_force

    def note_call(self, sources: frozenset[Source]) -> None:
        """Notes that after these a routine of another module moves the robot first."""
        self.calls.append((self.count, sources))

    def label(self, start: int, name: bytes) -> Meeting:
        """Where the paths to a label of the routine meet that starts with this statement."""
        return self.meetings[b"label %d " % start + name]

    def truncate(self, count: int) -> None:
        """Takes the rows from ``count`` on out again."""
        while self.count > count:
            chunk = self.chunks[-1]
            size = len(chunk) if isinstance(chunk, list) else len(chunk.vectorised)
            if isinstance(chunk, list) and self.count - size < count:
                del chunk[count - self.count :]  # a copy of what stays would take the time of all of it
                self.count = count
            else:
                self.chunks.pop()
                self.count -= size
        for sparse in (
            self.anchors, self.reasons, self.variables, self.locked, self.arcs, self.relative,
            self.no_insert_before, self.approximated, self.builds_on,
            self.passing, self.entries, self.sources_of, self.stopped, self.in_force,
        ):  # fmt: skip
            while sparse and next(reversed(sparse)) >= count:
                sparse.popitem()
        while self.calls and self.calls[-1][0] > count:
            self.calls.pop()
        while self.stopped_at_end and self.stopped_at_end[-1][0] > count:
            self.stopped_at_end.pop()
        while self.ranges and self.ranges[-1][0] >= count:
            self.ranges.pop()


def index(frame: FrameIndex | UnknownValue) -> int:
    """Index in the table of frames, -1 for one that is not known."""
    return frame.index if isinstance(frame, FrameIndex) else -1


def refusal(value: UnknownValue, subject: str, cause: str = "") -> RowRefusal:
    return RowRefusal(value.code, f"{subject}{value.message}", cause)


def path_of(arc: Arc | None) -> tuple[float, ...]:
    """Centre [mm], normal and sweep [deg] in a row."""
    return NO_ARC if arc is None else (*arc.centre, *arc.normal, arc.sweep)
