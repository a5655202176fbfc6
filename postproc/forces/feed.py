"""The feed frames: z from the tip back to the spindle, x the feed across it, y = z x x."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.cell import Frames
from postproc.findings import Finding, Refusal
from postproc.forces.stated import FEED, Stated
from postproc.forces.way import Runs, Way
from postproc.toolpath import Toolpath
from postproc.units import DEG

ALONG_SPINDLE = 1 * DEG
"""A feed this near to the spindle axis has no direction across it."""


class FeedFrames:
    """The feed frame at the begin and at the end of every motion, and on its way.

    matters (N,): the force or the moment has a part across z, so that x and y are needed.  back (N, 2, 3): z.
    ahead (N, 2, 3): what becomes x when it is projected across z: the motion's own tangent, or the x that stays where
    it has none; NaN where there is none in the run.
    """

    def __init__(
        self,
        stated: Stated,
        toolpath: Toolpath,
        frames: Frames,
        way: Way,
        runs: Runs,
        carries: Bools,
        file: str,
    ) -> None:
        self.way = way
        asked = carries & (stated.frame == FEED)
        _check_spindle(asked & way.known, toolpath, frames, file)
        spindle = np.einsum("nij,nj->ni", toolpath.rotation, frames.spindle_in_tool)
        end = -np.einsum("nij,nj->ni", frames.base_in_robot.rotation, spindle)
        begin = end.copy()
        rows = np.flatnonzero(way.begins)
        begin[rows] = end[rows - 1]
        self.back = np.stack([begin, end], axis=1)

        # begins and ends in turn, as the tool comes by them
        tangent = self._tangents().reshape(-1, 3)
        side = across(tangent, self.back.reshape(-1, 3))
        own = np.repeat(carries, 2) & ~np.isnan(side[:, 0])
        latest, coming = runs.latest(own), runs.coming(own)
        source = np.where(latest >= 0, latest, coming)
        ahead = np.where((source >= 0)[:, None], side[source], np.nan)
        ahead[own] = tangent[own]
        self.ahead = ahead.reshape(-1, 2, 3)

        # x and y matter only to a force or moment across z
        sideways = [0, 1, 3, 4]
        self.matters = np.any((stated.values[:, sideways] != 0) | (stated.begin[:, sideways] != 0), axis=1)
        needed = asked & way.known & self.matters
        undefined = needed & np.isnan(across(self.ahead[:, 1], self.back[:, 1])[:, 0])
        # a run with an unknown target is left as it is, whatever its force
        unknown = np.append(0, np.cumsum(carries & ~way.known))
        lost = np.flatnonzero(undefined & (unknown[runs.stop + 1] == unknown[runs.start]))
        if len(lost):
            raise Refusal(_no_direction(lost, toolpath, file))
        before, after = latest.reshape(-1, 2)[:, 1], coming.reshape(-1, 2)[:, 1]
        lacks = needed & ~own.reshape(-1, 2)[:, 1] & ~undefined
        findings = []
        kept, borrowed = (
            np.flatnonzero(lacks & (before >= 0)),
            np.flatnonzero(lacks & (before < 0) & (after >= 0)),
        )
        if len(kept):
            what = f"motions without a direction across the spindle that keep the last one: {len(kept)}"
            findings.append(Finding("FRC010", what, file, int(toolpath.line[kept[0]])))
        if len(borrowed):
            what = f"direction of the next motion taken for motions before any feed: {len(borrowed)}"
            findings.append(Finding("FRC008", what, file, int(toolpath.line[borrowed[0]])))
        self.findings = tuple(findings)

    def _tangents(self) -> Floats:
        """(N, 2, 3) of each motion at its begin and end; that of an arc from inside where it lies along z there."""
        tangent = self.way.direction.copy()
        for side, inwards in ((0, 1), (1, -1)):
            rows = np.flatnonzero(
                self.way.arc & self.way.moved & np.isnan(across(tangent[:, side], self.back[:, side])[:, 0])
            )
            inside = side + inwards * np.minimum(0.5, 2 * ALONG_SPINDLE / self.way.sweep[rows])
            tangent[rows, side] = self.way.tangent(rows, inside)
        return tangent

    def end(self, rows: Ints, side: int) -> Floats:
        """(M, 3, 3) frames of ``rows`` at their begin (``side`` 0) or end (1): rows of the matrix are x, y, z."""
        z = self.back[rows, side]
        x = across(self.ahead[rows, side], z)
        x[~self.matters[rows]] = 0.0
        return np.stack([x, np.cross(z, x), z], axis=-2)

    def on_the_way(self, rows: Ints, fraction: Floats) -> Floats:
        """(K, 3, 3) frames at the shares ``fraction`` (K,) of the motions ``rows`` (K,).

        The spindle turns evenly between its directions at the ends.  Where the tangent lies along it, x is that of the
        nearer end.
        """
        share = fraction[:, None]
        z = (1 - share) * self.back[rows, 0] + share * self.back[rows, 1]
        z /= np.linalg.norm(z, axis=1, keepdims=True)
        ahead = self.way.tangent(rows, fraction)
        ahead = np.where(share <= 0, self.ahead[rows, 0], np.where(share >= 1, self.ahead[rows, 1], ahead))
        along = np.isnan(across(ahead, z)[:, 0])
        ahead[along] = self.ahead[rows[along], np.where(fraction[along] < 0.5, 0, 1)]
        x = across(ahead, z)
        return np.stack([x, np.cross(z, x), z], axis=-2)


def across(vector: Floats, z: Floats) -> Floats:
    """(N, 3) unit vectors: ``vector`` (of unit length) projected across ``z``; NaN where it lies along it."""
    projected = vector - np.einsum("ni,ni->n", vector, z)[:, None] * z
    length = np.sqrt(np.einsum("ni,ni->n", projected, projected))
    defined = length > np.sin(ALONG_SPINDLE)  # False for NaN
    return np.where(defined[:, None], projected / np.where(defined, length, 1.0)[:, None], np.nan)


def _check_spindle(rows: Bools, toolpath: Toolpath, frames: Frames, file: str) -> None:
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
            key = "a tool with the pose of $TOOL" if number is None else name
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
        f"the force is in the feed frame, and no motion of this cut gives it a direction across the spindle{more}",
        file,
        int(toolpath.line[rows[0]]),
        help="give the force @tool or @base here; in @feed only fz and mz need no direction",
    )
