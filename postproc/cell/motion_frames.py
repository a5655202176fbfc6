"""The frames of every motion of a program, from its cell."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import UNKNOWN, Poses, vector_from_rotation
from postproc.base.units import DEG, MM
from postproc.cell.description import Cell
from postproc.robot.external_axes import External
from postproc.toolpath import FrameRef, Toolpath

SAME_POSITION = 0.01 * MM
SAME_ANGLE = 0.01 * DEG
"""Within these a literal $TOOL is taken for a tool of the cell."""


@dataclass(frozen=True, eq=False)
class MotionFrames:
    """The frames of every motion.

    base_in_robot (N): programmed base in the robot root; tool_in_flange (N): TCP; spindle_in_tool (N, 3): unit
    vector of the spindle, tip-ward, in tool axes.  NaN where unknown.  Read-only.  external: what external axes move;
    where they do, the robot root is that for all of them at zero, turning with the part.  diameters: of the cutters of
    the cell's tools by their numbers [m], where stated.  bases: the cell's by their numbers, poses (1,) in the robot
    root; none where external axes carry some.
    """

    base_in_robot: Poses
    tool_in_flange: Poses
    spindle_in_tool: Floats
    external: External | None = None
    diameters: Mapping[int, float] = field(default_factory=dict)
    bases: Mapping[int, Poses] = field(default_factory=dict)


def frames_of(
    cell: Cell, toolpath: Toolpath, file: str | Path, external: External | None = None
) -> MotionFrames:
    """The base, tool and spindle axis of every motion of ``toolpath``, which was read from ``file``.

    A frame that the program gives as a pose wins over the cell's of the same number, and that over what the
    controller's own file declares.  Refusal CEL002 for every
    frame that neither gives and that a motion with a known target uses; without such a motion it is NaN.
    """
    tools = {number: tool.pose for number, tool in cell.tools.items()}
    robot_from_world = cell.robot_base.inverse()
    known = toolpath.known | (
        (toolpath.partial_targets.inherits_from_row >= 0) & (toolpath.base >= 0) & (toolpath.tool >= 0)
    )
    missing = _missing(cell, toolpath, toolpath.base[known], cell.bases, "base", str(file))
    missing += _missing(cell, toolpath, toolpath.tool[known], tools, "tool", str(file))
    if missing:
        raise Refusal(*missing)
    base_in_world = [_pose(frame, cell.bases) for frame in toolpath.frames]
    tool_in_flange = [_pose(frame, tools) for frame in toolpath.frames]
    base_in_robot = [robot_from_world @ pose for pose in base_in_world]
    if external is not None:
        frames = zip(toolpath.frames, base_in_robot, strict=True)
        base_in_robot = [external.base_moved(frame) @ pose for frame, pose in frames]
    axes = [_spindle(frame, cell) for frame in toolpath.frames]
    return MotionFrames(
        _per_row(base_in_robot, toolpath.base),
        _per_row(tool_in_flange, toolpath.tool),
        _rows(np.array([*axes, np.full(3, np.nan)]), toolpath.tool),
        external,
        {number: tool.diameter for number, tool in cell.tools.items() if tool.diameter is not None},
        {}
        if external is not None
        else {number: (robot_from_world @ pose)[None] for number, pose in cell.bases.items()},
    )


def number_literal_tools(cell: Cell, toolpath: Toolpath) -> Toolpath:
    """The toolpath with the number of the cell's tool for each ``$TOOL = {...}`` that has the pose of exactly one: its
    mass, cutter and cutting process belong to it.  The pose stays that of the program."""
    used = set(np.unique(toolpath.tool).tolist()) - {-1}
    frames = list(toolpath.frames)
    for index in used:
        frame = frames[index]
        if frame.number is None and frame.pose is not None:
            numbers = [number for number, tool in cell.tools.items() if _same(tool.pose, frame.pose)]
            if len(numbers) == 1:
                frames[index] = replace(frame, number=numbers[0])
    return toolpath if frames == list(toolpath.frames) else toolpath.with_columns(frames=tuple(frames))


def _pose(frame: FrameRef, numbered: dict[int, Poses]) -> Poses:
    if frame.pose is not None:
        return frame.pose
    if frame.number == 0:  # $NULLFRAME
        return Poses.identity()
    found = None if frame.entry is None else numbered.get(frame.entry, frame.declared)
    if found is None:
        return UNKNOWN
    return frame.placed_in(found)


def _spindle(frame: FrameRef, cell: Cell) -> Floats:
    """The spindle axis (3,) that goes with a tool frame; NaN where the cell has no such tool, or two that differ."""
    unknown = np.full(3, np.nan)
    if frame.number is not None:
        tool = cell.tools.get(frame.number)
        return unknown if tool is None else tool.axis
    if frame.in_entry is not None:
        number, within = frame.in_entry
        return within.rotation.T @ cell.tools[number].axis if number in cell.tools else unknown
    if frame.pose is None:
        return unknown
    axes = [tool.axis for tool in cell.tools.values() if _same(tool.pose, frame.pose)]
    if not axes or any(np.max(np.abs(axis - axes[0])) > 1e-6 for axis in axes):
        return unknown
    return axes[0]


def _same(one: Poses, two: Poses) -> bool:
    away = np.linalg.norm(one.position - two.position)
    turned = np.linalg.norm(vector_from_rotation(one.rotation.T @ two.rotation))
    return bool(away <= SAME_POSITION and turned <= SAME_ANGLE)


def _missing(
    cell: Cell, toolpath: Toolpath, used: Ints, numbered: dict[int, Poses], word: str, file: str
) -> list[Finding]:
    findings: dict[int, Finding] = {}
    for index in np.unique(used):
        frame = toolpath.frames[index]
        number = frame.entry
        if (
            frame.pose is not None
            or frame.declared is not None
            or number is None
            or number == 0
            or number in numbered
            or number in findings
        ):
            continue
        listed = ", ".join(str(n) for n in sorted(numbered))
        has = (
            f"the cell {cell.path} has {word}s {listed}"
            if numbered
            else f"the cell {cell.path} has no {word}s"
        )
        findings[number] = Finding(
            "CEL002",
            f"{word} {number} is not defined: the program does not define it, and {has}",
            file,
            frame.line,
            help=f"add it to {cell.path}: {word}s: {{{number}: {{x: ..., y: ..., z: ..., a: ..., b: ..., c: ...}}}}",
        )
    return list(findings.values())


def _per_row(poses: list[Poses], index: Ints) -> Poses:
    """The poses (N) that ``index`` (N,) picks; NaN for -1."""
    rotations = np.array([pose.rotation for pose in [*poses, UNKNOWN]])
    positions = np.array([pose.position for pose in [*poses, UNKNOWN]])
    return Poses(_rows(rotations, index), _rows(positions, index))


def _rows(table: Floats, index: Ints) -> Floats:
    """``table[index]``, without a copy where all rows share one entry (the usual program: 0.2 GB in 1e6 rows)."""
    if len(index) and np.all(index == index[0]):
        return np.broadcast_to(table[index[0]], (len(index), *table.shape[1:]))
    picked = table[index]
    picked.setflags(write=False)
    return picked
