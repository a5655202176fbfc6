"""The feed frames: z from the tip back to the spindle, x the feed across it, y = z x x."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.batches import in_blocks
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import rotation_from_vector, turned
from postproc.base.units import DEG
from postproc.cell import MotionFrames
from postproc.process.path_length import MotionRuns, PathLength
from postproc.process.stated_forces import FEED, StatedForces
from postproc.toolpath import Toolpath

ALONG_SPINDLE = 1 * DEG
"""A feed this near to the spindle axis has no direction across it."""


class FeedFrames:
    """The feed frame at the start and at the end of N motions, and on their path, computed for the rows asked for.

    matters (N,): the force or the moment has a part across z, so that x and y are needed.  undirected (N,): they are,
    and several motions may precede the motion, so that its feed direction is not known.
    """

    def __init__(
        self,
        stated: StatedForces,
        toolpath: Toolpath,
        frames: MotionFrames,
        path_length: PathLength,
        runs: MotionRuns,
        carries: Bools,
        file: str,
    ) -> None:
        """Of N motions, of which ``carries`` (N,) have a force.  Raises Refusal where the frame is not defined on the
        motions that need it."""
        self.path_length = path_length
        asked = carries & (stated.frames == FEED)
        _check_spindle(asked & path_length.known, toolpath, frames, file)
        # x and y matter only to a force or moment across z
        self.matters = stated.any((0, 1, 3, 4))
        needed = asked & path_length.known & self.matters
        self.undirected = needed & ~path_length.continues

        n = len(toolpath)
        self._back = np.empty((n, 3))

        def fill_back(rows: slice) -> None:
            spindle = np.einsum("nij,nj->ni", toolpath.rotation[rows], frames.spindle_in_tool[rows])
            turned = np.einsum("nij,nj->ni", frames.base_in_robot.rotation[rows], spindle)
            np.negative(turned, out=self._back[rows])

        for _ in in_blocks(fill_back, n):
            pass

        # starts and ends in turn, as the tool comes by them: which of them have a direction, and whose each takes
        own = np.zeros((n, 2), bool)

        def mark_own(rows: slice) -> None:
            at = rows.start + np.flatnonzero(carries[rows])
            for side in (0, 1):
                own[at, side] = ~np.isnan(across(self._tangent(at, side), self.back(at, side))[:, 0])

        if needed.any():
            for _ in in_blocks(mark_own, n):
                pass
        self._own = own.reshape(-1)
        latest, coming = runs.latest(self._own), runs.coming(self._own)
        self._source = np.where(latest >= 0, latest, coming)

        without = np.flatnonzero(needed & ~own[:, 1])
        undefined = np.zeros(n, bool)

        def mark_undefined(part: slice) -> None:
            at = without[part]
            undefined[at] = np.isnan(across(self._ahead(at, 1), self.back(at, 1))[:, 0])

        for _ in in_blocks(mark_undefined, len(without)):
            pass
        # a run with an unknown target stays as it is, whatever its force
        unknown = np.append(np.int32(0), np.cumsum(carries & ~path_length.known, dtype=np.int32))
        lost = np.flatnonzero(undefined)
        lost = lost[unknown[runs.stop[lost] + 1] == unknown[runs.start[lost]]]
        several = ~path_length.continues[runs.start[lost]]
        self.undirected[lost[several]] = True
        lost = lost[~several]
        if len(lost):
            raise Refusal(_no_direction(lost, toolpath, file))
        unresolved = without[~undefined[without]]
        unresolved = unresolved[~self.undirected[unresolved]]
        before, after = latest[2 * unresolved + 1], coming[2 * unresolved + 1]
        findings = []
        continued, borrowed = unresolved[before >= 0], unresolved[(before < 0) & (after >= 0)]
        if len(continued):
            what = f"{len(continued)} motions have no feed direction across the spindle and keep the last one"
            findings.append(Finding("FRC010", what, file, int(toolpath.line[continued[0]])))
        if len(borrowed):
            what = f"{len(borrowed)} motions before any feed use the direction of the next motion"
            findings.append(Finding("FRC008", what, file, int(toolpath.line[borrowed[0]])))
        self.findings = tuple(findings)

    def back(self, rows: Ints, side: Ints | int) -> Floats:
        """(M, 3) z of ``rows`` (M,) at their start (``side``, scalar or (M,): 0) or end (1); where the start is not
        known, that at the end."""
        at = rows - ((np.asarray(side) == 0) & self.path_length.starts[rows])
        return np.asarray(self._back.take(at, axis=0))

    def _tangent(self, rows: Ints, side: Ints | int) -> Floats:
        """(M, 3) of each motion at its start or end; that of an arc from inside where it lies along z there."""
        side = np.broadcast_to(side, len(rows))
        tangent = self.path_length.tangent(rows, side.astype(float))
        curved = np.flatnonzero(self.path_length.arc[rows] & self.path_length.moved[rows])
        along = np.isnan(across(tangent[curved], self.back(rows[curved], side[curved]))[:, 0])
        curved = curved[along]
        if len(curved):
            inwards = np.minimum(0.5, 2 * ALONG_SPINDLE / self.path_length.sweep[rows[curved]])
            inside = side[curved] + np.where(side[curved] == 0, 1, -1) * inwards
            tangent[curved] = self.path_length.tangent(rows[curved], inside)
        return tangent

    def _ahead(self, rows: Ints, side: Ints | int) -> Floats:
        """(M, 3) what becomes x when it is projected across z: the motion's own tangent, or the x that stays where it
        has none; NaN where there is none in the run."""
        at = 2 * rows + side
        source = self._source[at].astype(np.int64)
        row, end = np.divmod(np.maximum(source, 0), 2)
        ahead = self._tangent(row, end)
        others = np.flatnonzero(~self._own[at])
        ahead[others] = across(ahead[others], self.back(row[others], end[others]))
        ahead[source < 0] = np.nan
        return ahead

    def end(self, rows: Ints, side: int) -> Floats:
        """(M, 3, 3) frames of ``rows`` (M,) at their start (``side`` 0) or end (1): rows of the matrix are x, y, z."""
        z = self.back(rows, side)
        x = np.zeros_like(z)
        matters = self.matters[rows]
        x[matters] = across(self._ahead(rows[matters], side), z[matters])
        return np.stack([x, np.cross(z, x), z], axis=-2)

    def along(self, rows: Ints, fraction: Floats) -> Floats:
        """(K, 3, 3) frames at the shares ``fraction`` (K,) of the motions ``rows`` (K,).

        The spindle turns evenly between its directions at the ends, besides turning with its arc.  Where the tangent
        lies along it, x is that of the nearer end.
        """
        share = fraction[:, None]
        arc = self.path_length.arc_turn(rows)
        z = (1 - share) * self.back(rows, 0) + share * turned(rotation_from_vector(-arc), self.back(rows, 1))
        z = turned(rotation_from_vector(share * arc), z / np.linalg.norm(z, axis=1, keepdims=True))
        ahead = self.path_length.tangent(rows, fraction)
        for ends, side in ((fraction <= 0, 0), (fraction >= 1, 1)):
            ahead[ends] = self._ahead(rows[ends], side)
        along = np.flatnonzero(np.isnan(across(ahead, z)[:, 0]))
        ahead[along] = self._ahead(rows[along], np.where(fraction[along] < 0.5, 0, 1))
        x = across(ahead, z)
        free = np.flatnonzero(np.isnan(x[:, 0]) & ~self.matters[rows])
        other = np.eye(3)[np.argmin(np.abs(z[free]), axis=1)]  # any direction will do
        x[free] = across(other, z[free])
        return np.stack([x, np.cross(z, x), z], axis=-2)


def across(vector: Floats, z: Floats) -> Floats:
    """(N, 3) unit vectors: ``vector`` (N, 3) (of unit length) projected across ``z`` (N, 3); NaN where it lies along
    it."""
    projected = vector - np.einsum("ni,ni->n", vector, z)[:, None] * z
    length = np.sqrt(np.einsum("ni,ni->n", projected, projected))
    defined = length > np.sin(ALONG_SPINDLE)  # False for NaN
    return np.where(defined[:, None], projected / np.where(defined, length, 1.0)[:, None], np.nan)


def _check_spindle(rows: Bools, toolpath: Toolpath, frames: MotionFrames, file: str) -> None:
    lost = np.flatnonzero(rows & np.isnan(frames.spindle_in_tool[:, 0]))
    tools, first = np.unique(toolpath.tool[lost], return_index=True)
    findings = []
    for tool, at in zip(tools, first, strict=True):
        number = toolpath.frames[tool].number
        name = "the tool" if number is None else f"tool {number}"
        message = f"the force is in the feed frame, and the spindle axis of {name} is not known"
        if number == 0:
            help = "tool 0 is the bare flange; the program must set its tool before it cuts"
        else:
            key = "a tool with the pose that the program sets" if number is None else name
            entry = f"{{{number or 1}: {{x: ..., y: ..., z: ..., axis: +z}}}}"
            help = f"add {key} with its axis to the cell: tools: {entry}"
        line = int(toolpath.line[lost[at]])
        findings.append(Finding("FRC005", message, file, line, help=help))
    if findings:
        raise Refusal(*findings)


def _no_direction(rows: Ints, toolpath: Toolpath, file: str) -> Finding:
    more = f" (and {len(rows) - 1} more motions)" if len(rows) > 1 else ""
    return Finding(
        "FRC005",
        f"the force is in the feed frame, and no motion of this cut has a feed direction across the spindle{more}",
        file,
        int(toolpath.line[rows[0]]),
        help="state the force @tool or @base here; in @feed only fz and mz need no direction",
    )
