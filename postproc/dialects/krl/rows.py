"""The motions as they are found, and what they become: a Toolpath, its places and its findings."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

from postproc.arrays import Ints
from postproc.dialects.krl.state import Anchor, Frame, Frames, Numbers, Point, Source, State
from postproc.dialects.krl.target import NOWHERE, Target, Unclear
from postproc.document import Document
from postproc.findings import Finding
from postproc.geometry import rotation_from_abc
from postproc.toolpath import Annotation, FrameRef, Kind, Toolpath
from postproc.units import DEG, MM


@dataclass(frozen=True)
class Places:
    """Where the numbers of a motion stand in the text.

    start, stop (N, 6): byte range of the literals of X, Y, Z, A, B, C; -1 where the text has none.
    file (N,): the document that holds them, -1 where the motion has no aggregate of numbers.
    insert (N,): offset at which missing components are inserted (behind the last component).
    """

    start: Ints
    stop: Ints
    file: Ints
    insert: Ints


NAN6: Numbers = (float("nan"),) * 6
SHARED = "KRL007"


@dataclass(frozen=True, slots=True)
class Reason:
    """Why a row is refused; equal ``cause`` and code are told together.  ``subject`` begins the message."""

    code: str
    message: str
    cause: str = ""


HELP = {
    "KRL001": "Write it as PTP or LIN with an aggregate of numbers, or leave it as it is.",
    "KRL002": "Write the target as numbers: LIN {X .., Y .., Z .., A .., B .., C ..}.",
    "KRL003": "Put the module's .dat beside its .src, or declare the point there.",
    "KRL004": "Write all of X, Y, Z, A, B, C in the first Cartesian motion after that.",
    "KRL005": "Set $BASE and $TOOL before it: to numbers, to BASE_DATA[n] and TOOL_DATA[n], or with BAS.",
    "KRL006": "Write the cut as a straight run of motions, outside of loops and branches.",
    "KRL007": "Give every motion a point of its own that nothing else uses.",
    "KRL008": "Write the motion and the one before it with absolute targets.",
    "KRL009": "Let the post-processor write arcs and splines as LIN, or leave them uncorrected.",
    "KRL010": "Check what the routine does; write all components in the motion after it.",
    "KRL011": "Set $BASE to numbers or to BASE_DATA[n] for this cut.",
    "KRL013": "Programs with a stationary tool are not corrected by this version.",
    "KRL014": "Close every block and every DEF.",
    "KRL015": "Move the cut into the first DEF of the file, or make the subprogram a file of its own.",
    "KRL016": "Nothing needs to be done.",
    "KRL017": "Write all of X, Y, Z, A, B, C in the first motion after the change of frame.",
    "KRL022": "Correct only cuts in which no external axis carries the robot or the workpiece.",
    "KRL019": "Write the declaration as an aggregate of numbers.",
}


@dataclass
class Rows:
    """One entry a motion in every list."""

    document: Document
    kind: list[int] = field(default_factory=list)
    values: list[Numbers] = field(default_factory=list)
    axes: list[Numbers] = field(default_factory=list)
    feed: list[float] = field(default_factory=list)
    base: list[int] = field(default_factory=list)
    tool: list[int] = field(default_factory=list)
    status: list[int] = field(default_factory=list)
    turn: list[int] = field(default_factory=list)
    at: list[int] = field(default_factory=list)
    line: list[int] = field(default_factory=list)
    start: list[tuple[int, ...]] = field(default_factory=list)
    stop: list[tuple[int, ...]] = field(default_factory=list)
    file: list[int] = field(default_factory=list)
    insert: list[int] = field(default_factory=list)
    anchors: dict[int, Anchor] = field(default_factory=dict)
    reasons: dict[int, Reason] = field(default_factory=dict)
    points: dict[int, tuple[bytes, Point]] = field(default_factory=dict)
    builds_on: dict[int, frozenset[Source]] = field(default_factory=dict)
    reads: list[tuple[int, frozenset[Source]]] = field(default_factory=list)
    sources: defaultdict[bytes, set[Source]] = field(default_factory=lambda: defaultdict(set))
    annotations: list[Annotation] = field(default_factory=list)
    external: dict[bytes, float | None] = field(default_factory=dict)
    moving: dict[bytes, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.kind)

    def add(
        self,
        kind: Kind,
        line: int,
        at: int,
        state: State,
        values: Numbers | None,
        axes: Numbers | None = None,
        target: Target | None = None,
        anchor: Anchor | None = None,
    ) -> int:
        """Adds a motion; gives its row."""
        if anchor is not None:
            self.anchors[len(self.kind)] = anchor
        self.kind.append(kind)
        self.values.append(NAN6 if values is None else values)
        self.axes.append(NAN6 if axes is None else axes)
        # $VEL.CP is the speed of continuous-path motions only.
        self.feed.append(float("nan") if kind in (Kind.PTP, Kind.AXIS) else state.feed)
        self.base.append(state.base.index if isinstance(state.base, Frame) else -1)
        self.tool.append(state.tool.index if isinstance(state.tool, Frame) else -1)
        self.line.append(line)
        self.at.append(at)
        if target is None or target.axes is not None or (values is None and anchor is None):
            self.start.append(NOWHERE)
            self.stop.append(NOWHERE)
            self.file.append(-1)
            self.insert.append(-1)
        else:
            self.start.append(target.start)
            self.stop.append(target.stop)
            self.file.append(target.file)
            self.insert.append(target.insert)
        self.status.append(-1 if target is None else target.status)
        self.turn.append(-1 if target is None else target.turn)
        return len(self.kind) - 1

    def follow_external(self, row: int, target: Target) -> None:
        """Notes in ``moving`` the first row at which an external axis is not where it was before."""
        for key, value in target.external:
            if value is None or self.external.setdefault(key, value) != value:
                self.moving.setdefault(key, row)

    def told_external(self) -> list[Finding]:
        names = {key.decode(): row for key, row in sorted(self.moving.items())}
        if not names:
            return []
        verb = "moves" if len(names) == 1 else "move"
        message = f"{', '.join(names)} {verb}; robot and base are taken as standing still"
        return [self._finding(min(names.values()), "KRL022", message)]

    def judge_points(self, mentioned: set[bytes], assigned: set[bytes], declared: set[int]) -> None:
        """Refuses the motions whose point serves more than them.

        mentioned: names that other code reads; assigned: names that the program assigns; declared: ids of
        the points of the .dat, whose numbers do not hold when the program assigns the name.
        """
        for row, (name, point) in self.points.items():
            # Axis targets are air moves that are never edited.
            if row in self.reasons or self.kind[row] == Kind.AXIS:
                continue
            shown = name.decode("latin-1")
            plain = name.split(b"[")[0]
            chain = []
            link: Point | None = point
            while link is not None:
                chain.append(link)
                link = link.origin
            blocked = next((p.blocked for p in chain if p.blocked), None)
            rows = max((p.rows for p in chain), key=len)
            if blocked is not None:
                self.reasons[row] = Reason(SHARED, f"point {shown}: {blocked.message}", blocked.message)
            elif len(rows) > 1:
                lines = sorted({self.line[i] for i in rows})
                places = ", ".join(map(str, lines[:6])) + (" ..." if len(lines) > 6 else "")
                self.reasons[row] = Reason(
                    SHARED,
                    f"point {shown} is the target of several motions (lines {places})",
                    f"many {shown}",
                )
            elif plain in mentioned:
                self.reasons[row] = Reason(SHARED, f"point {shown} is read by other code too", "read")
            elif plain in assigned and id(chain[-1]) in declared:
                self.reasons[row] = Reason(
                    SHARED, f"point {shown} of the .dat is assigned in the program", "set"
                )

    def _finding(self, row: int, code: str, message: str) -> Finding:
        line, column = self.document.place(self.at[row])
        return Finding(code, message, str(self.document.path), line, column, HELP.get(code, ""))

    def refused(self) -> dict[int, Finding]:
        return {
            row: self._finding(row, reason.code, reason.message)
            for row, reason in sorted(self.reasons.items())
        }

    def told(self, refused: dict[int, Finding]) -> list[Finding]:
        """The refusals, those of one code and cause as one finding."""
        groups: dict[tuple[str, str], list[int]] = {}
        for row in refused:
            reason = self.reasons[row]
            groups.setdefault((reason.code, reason.cause or reason.message), []).append(row)
        findings = []
        for rows in groups.values():
            first = refused[rows[0]]
            if len(rows) == 1:
                findings.append(first)
                continue
            lines = f"lines {self.line[rows[0]]} to {self.line[rows[-1]]}"
            message = f"{first.message}; {len(rows)} motions, {lines}"
            findings.append(Finding(first.code, message, first.file, first.line, first.column, first.help))
        return findings

    def _rows_of(self, sources: frozenset[Source]) -> set[int]:
        """The rows after which the robot may stand, marks of labels and routines followed to their callers."""
        rows: set[int] = set()
        seen: set[Source] = set()
        todo: list[Source] = list(sources)
        while todo:
            source = todo.pop()
            if source in seen:
                continue
            seen.add(source)
            if isinstance(source, int):
                rows.add(source)
            else:
                todo.extend(self.sources[source])
        return rows

    def pinned(self, refused: dict[int, Finding]) -> dict[int, Finding]:
        """Rows that a refused motion builds on, or whose reached position the program reads."""
        pins: dict[int, Finding] = {}
        for row in refused:
            if row in self.builds_on:
                for pin in self._rows_of(self.builds_on[row]):
                    code = self.reasons[row].code
                    message = (
                        f"the motion in line {self.line[row]} builds on this end point and is not corrected"
                    )
                    pins.setdefault(pin, self._finding(pin, code, message))
        for line, sources in self.reads:
            for pin in self._rows_of(sources):
                message = f"line {line} reads the position that this motion reaches"
                pins.setdefault(pin, self._finding(pin, "KRL002", message))
        return dict(sorted(pins.items()))

    def finished(self, frames: Frames) -> tuple[Toolpath, Places, list[Finding]]:
        n = len(self)
        values = np.array(self.values, dtype=float).reshape(n, 6)
        refused = self.refused()
        base, tool, used = _used(np.array(self.base, int), np.array(self.tool, int), frames.refs())
        anchor, given = np.full(n, -1), np.full((n, 6), np.nan)
        for row, at in self.anchors.items():
            anchor[row] = at.row
            given[row] = [np.nan if value is None else value for value in at.given]
        toolpath = Toolpath(
            kind=np.array(self.kind, dtype=np.int64),
            position=values[:, :3] * MM,
            rotation=rotation_from_abc(values[:, 3:] * DEG),
            axes=np.array(self.axes, dtype=float).reshape(n, 6) * DEG,
            feed=np.array(self.feed, dtype=float),
            base=base,
            tool=tool,
            status=np.array(self.status, dtype=np.int64),
            turn=np.array(self.turn, dtype=np.int64),
            line=np.array(self.line, dtype=np.int64),
            frames=used,
            refused=refused,
            pinned=self.pinned(refused),
            annotations=tuple(self.annotations),
            anchor=anchor,
            given=given * ([MM] * 3 + [DEG] * 3),
        )
        places = Places(
            start=np.array(self.start, dtype=np.int64).reshape(n, 6),
            stop=np.array(self.stop, dtype=np.int64).reshape(n, 6),
            file=np.array(self.file, dtype=np.int64),
            insert=np.array(self.insert, dtype=np.int64),
        )
        return toolpath, places, [*self.told(refused), *self.told_external()]


def _used(base: Ints, tool: Ints, frames: tuple[FrameRef, ...]) -> tuple[Ints, Ints, tuple[FrameRef, ...]]:
    """The indices and frames without those that no motion has: nobody needs to know their pose."""
    kept = [i for i in range(len(frames)) if (base == i).any() or (tool == i).any()]
    renamed = np.full(len(frames) + 1, -1, dtype=np.int64)
    renamed[kept] = np.arange(len(kept))
    return renamed[base], renamed[tool], tuple(frames[i] for i in kept)


def refusal(unclear: Unclear, subject: str, cause: str = "") -> Reason:
    return Reason(unclear.code, f"{subject}{unclear.message}", cause)
