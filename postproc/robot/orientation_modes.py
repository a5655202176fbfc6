"""The orientations that a controller runs where the text states others: motions keep that with which they start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding
from postproc.base.geometry import Poses, lengths, product, rotation_from_vector, turn_between
from postproc.base.units import DEG
from postproc.robot.axis_track import all_axes, external_joint, home_rows, nominal_flange
from postproc.robot.description import Robot
from postproc.toolpath import ArcFrame, Kind, OrientationMode, Toolpath

NO_EFFECT = 0.01 * DEG
"""Written orientations that are nearer to the one that is run mean it."""


def as_run(
    path: Toolpath, base: Poses, tool: Poses, robot: Robot, start: Floats | None, file: str
) -> tuple[Toolpath, list[Finding]]:
    """The toolpath with the orientations that the controller runs, and what is to be reported of it.

    Under $ORI_TYPE=#CONSTANT a path motion keeps the orientation of the flange with which it starts, whatever its
    target states; an arc under $CIRC_TYPE=#PATH turns it with its tangent (KUKA System Software, programming manual for
    system integrators, orientation control of CP motions, recalled).  So the orientation is that of the last motion
    before that is no such one.

    base, tool (N): programmed bases in the robot base, tools on the flange; start (n,): joint values before the first
    motion.  Where that orientation is not known the motion is refused.
    """
    keeps = path.keeps_orientation
    if not keeps.any():
        return path, []
    rows = np.flatnonzero(keeps)
    anchor = np.maximum.accumulate(np.where(keeps, -1, np.arange(len(path))))[rows]
    flange = _flange(path, base, tool, robot, start, anchor)
    apart = np.maximum.accumulate(np.where(path.continues, -1, np.arange(len(path))))[rows]
    flange[apart > anchor] = np.nan  # several motions may precede it
    turn = path.arcs.turn(rows, base.rotation[rows])
    unclear = (path.kind == Kind.CIRC) & (path.arcs.frame != ArcFrame.BASE) & ~path.arcs.turns_along
    turn[unclear[rows]] = np.nan
    turns = _along(turn, anchor)
    own = product(
        np.swapaxes(base.rotation[rows], 1, 2), product(product(turns, flange), tool.rotation[rows])
    )
    written = path.rotation[rows]
    own[np.isnan(path.position[rows, 0])] = np.nan
    rotation = path.rotation.copy()
    rotation[rows] = own
    lost = rows[np.isnan(own[:, 0, 0]) & np.isfinite(written[:, 0, 0])]
    refused = dict(path.constraints.refused)
    for row in lost.tolist():
        message = (
            "it keeps the orientation of the motion before, which is not known (constant orientation control)"
        )
        refused.setdefault(row, Finding("KIN010", message, file, int(path.line[row])))
    control = replace(path.orientation_control, programmed=path.rotation)
    run = path.with_columns(rotation=rotation, orientation_control=control).with_refused(
        dict(sorted(refused.items()))
    )
    return run, _without_effect(path, rows, written, own, file)


def _flange(
    path: Toolpath, base: Poses, tool: Poses, robot: Robot, start: Floats | None, anchor: Ints
) -> Floats:
    """(K, 3, 3) orientations of the flange in the robot base after the motions ``anchor`` (K,), -1 for the start; NaN
    where they are not known."""
    rotations = np.full((len(anchor), 3, 3), np.nan)
    starts = (anchor < 0) | np.isin(anchor, home_rows(path))
    if start is not None and starts.any():
        rotations[starts] = nominal_flange(robot, start[None]).rotation
    on_axes = ~starts & path.on_axes[anchor]
    if on_axes.any():
        at = anchor[on_axes]
        axes = all_axes(robot, path.axes[at], external_joint(robot, path, at, start))
        rotations[on_axes] = nominal_flange(robot, axes).rotation
    jumps = np.isin(path.kind, (Kind.PTP, Kind.AXIS))
    ends: Bools = path.known & (jumps | (path.orientation_control.mode != OrientationMode.UNKNOWN))
    known: Bools = ~starts & ~on_axes & ends[anchor]
    at = anchor[known]
    tool_in_robot = product(base.rotation[at], path.rotation[at])
    rotations[known] = product(tool_in_robot, np.swapaxes(tool.rotation[at], 1, 2))
    return rotations


def _along(turn: Floats, anchor: Ints) -> Floats:
    """(K, 3, 3) products exp(turn_k) ... exp(turn_1) of all motions since the same ``anchor`` (K,), ascending."""
    total = rotation_from_vector(turn)
    if not turn.any():
        return total
    step = 1
    while step < len(turn):
        more = np.flatnonzero(anchor[step:] == anchor[:-step]) + step
        if not len(more):
            break
        total[more] = product(total[more], total[more - step])
        step *= 2
    return total


def _without_effect(path: Toolpath, rows: Ints, written: Floats, own: Floats, file: str) -> list[Finding]:
    known = np.isfinite(written[:, 0, 0]) & np.isfinite(own[:, 0, 0])
    off = lengths(turn_between(own[known], written[known]))
    if not (off > NO_EFFECT).any():
        return []
    first = int(rows[known][np.argmax(off > NO_EFFECT)])
    count = int((off > NO_EFFECT).sum())
    more = f" of {count} motions" if count > 1 else ""
    message = (
        f"the written orientation{more} has no effect; the orientation that is kept differs by up to"
        f" {off.max() / DEG:.2f} deg"
        " (constant orientation control)"
    )
    return [Finding("KIN011", message, file, int(path.line[first]))]
