"""The sweeps of a program: its motions in the axes of the stock, long ones, arcs and turns in parts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, rotation_from_vector, vector_from_rotation
from postproc.base.units import DEG
from postproc.cell import MotionFrames
from postproc.process.path_length import shifted
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.distance import (
    ACROSS,
    ANGLE,
    AXIS,
    CENTRE,
    CUTTER,
    GENERAL,
    MODE,
    NORMAL,
    REMOVES,
    ROUND,
    ROW,
    STEP,
    STRAIGHT,
    TIP_POINT,
    TURN,
)
from postproc.process.stock.memory_need import check_memory
from postproc.process.stock.stock_section import StockProcess
from postproc.toolpath import Kind, OrientationPath, Toolpath

LARGEST_ANGLE, LARGEST_TURN = 20 * DEG, 5 * DEG
_PARALLEL = 1e-9
_LONGEST = 4.0  # radii of the smallest cutter


@dataclass(frozen=True, eq=False)
class MotionSweeps:
    """rows (M, ROW): see ``distance``; motion (M,): row of the toolpath; share (M, 2): of that motion; length (M,)
    [m] of the path of the tip; heading (M, 3): direction of the feed across the spindle, the last where there is
    none; cutters: in the order of CUTTER; simulated (N,): motions that are known from their start; in_stock
    (N, 3, 3): rotation of the programmed base to the stock; stock: its axes in the robot base."""

    rows: Floats
    motion: Ints
    share: Floats
    length: Floats
    heading: Floats
    cutters: tuple[Cutter, ...]
    simulated: Bools
    in_stock: Floats
    stock: Poses

    @property
    def which(self) -> Ints:
        """(M,) index into ``cutters``."""
        return self.rows[:, CUTTER].astype(np.int64)


def find_sweeps(
    toolpath: Toolpath,
    frames: MotionFrames,
    process: StockProcess,
    low: Floats,
    high: Floats,
    program: str,
    stock: Poses,
) -> MotionSweeps:
    """The sweeps of a program.  low, high (3,) [m]: the box around the blank, beside which nothing is divided; stock
    (1,): its axes in the robot base.  Refusal STK006: a tool that cuts is not stated; STK007: nothing can be simulated;
    STK031: more memory is needed than is free; STK035: the part turns."""
    pose = stock.inverse() @ frames.base_in_robot
    turned = np.broadcast_to(pose.rotation, (len(toolpath), 3, 3))
    axis = -np.einsum("nij,nj->ni", turned @ toolpath.rotation, frames.spindle_in_tool)
    tip = np.einsum("nij,nj->ni", turned, toolpath.position) + pose.position
    on_path = np.isin(toolpath.kind, (Kind.LIN, Kind.CIRC, Kind.SPL))
    moves = on_path | (toolpath.kind == Kind.PTP)
    known = toolpath.known & np.isfinite(axis[:, 0]) & np.isfinite(tip[:, 0])
    numbers = np.array([frame.number or 0 for frame in toolpath.frames] + [0])[toolpath.tool]
    simulated = known & shifted(known) & moves & toolpath.continues
    simulated[1:] &= numbers[1:] == numbers[:-1]
    if not simulated.any():
        message = "no motion has a known start, end and spindle axis"
        if toolpath.drills.any():
            message = (
                "drill cycles are not simulated, and no other motion has a known start, end and spindle axis"
            )
        raise Refusal(Finding("STK007", message, program))
    _refuse_turned_part(toolpath, simulated & on_path, program)
    cutters, which = _cutters(toolpath, numbers, simulated & on_path, process, program)
    simulated &= which >= 0
    row = np.flatnonzero(simulated)
    start, step, first = tip[row - 1], tip[row] - tip[row - 1], axis[row - 1]
    arcs = np.isfinite(toolpath.arcs.sweep[row]) & (toolpath.kind[row] == Kind.CIRC)
    angle = np.where(arcs, toolpath.arcs.sweep[row], 0.0)
    normal = np.einsum("nij,nj->ni", turned[row], np.where(arcs[:, None], toolpath.arcs.normal[row], 0.0))
    centre = np.einsum("nij,nj->ni", turned[row], np.where(arcs[:, None], toolpath.arcs.centre[row], 0.0))
    centre = np.where(arcs[:, None], centre + pose.position[row], 0.0)
    turn = vector_from_rotation(
        turned[row] @ toolpath.rotation[row] @ np.swapaxes(turned[row - 1] @ toolpath.rotation[row - 1], 1, 2)
    )
    turn[np.linalg.norm(axis[row] - first, axis=1) < _PARALLEL] = 0.0

    radius = np.array([cutter.radius for cutter in cutters])
    parts = np.maximum(np.ceil(angle / LARGEST_ANGLE), np.ceil(np.linalg.norm(turn, axis=1) / LARGEST_TURN))
    wide = np.max(radius) + np.linalg.norm(step, axis=1) * (angle > 0)
    top = np.array([cutter.edge_length for cutter in cutters])[which[row]]
    ends = np.stack([start, tip[row], start + top[:, None] * first, tip[row] + top[:, None] * axis[row]])
    beside = np.any(
        (ends.max(axis=0) + wide[:, None] < low) | (ends.min(axis=0) - wide[:, None] > high), axis=1
    )
    straight = np.linalg.norm(step, axis=1) / (_LONGEST * radius.min())
    parts = np.maximum(np.where(beside, parts, np.maximum(parts, np.ceil(straight))), 1)
    check_memory(int(parts.sum()), file=program)
    parts = parts.astype(np.int64)

    owner = np.repeat(np.arange(len(row)), parts)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    share = np.stack([place, place + 1], axis=1) / parts[owner, None]
    rows = np.zeros((len(owner), ROW))
    tips = [_tips(start, step, centre, normal, angle, owner, share[:, side]) for side in (0, 1)]
    axes = [_axes(toolpath, turned, row, first, turn, frames, owner, share[:, side]) for side in (0, 1)]
    rows[:, TIP_POINT : TIP_POINT + 3], rows[:, STEP : STEP + 3] = tips[0], tips[1] - tips[0]
    rows[:, AXIS : AXIS + 3] = axes[0]
    rows[:, TURN : TURN + 3] = _between(*axes)
    rows[:, CENTRE : CENTRE + 3], rows[:, NORMAL : NORMAL + 3] = centre[owner], normal[owner]
    rows[:, ANGLE] = (angle / parts)[owner]
    along = np.einsum("mi,mi->m", rows[:, STEP : STEP + 3], axes[0])
    general = (rows[:, ANGLE] > 0) | rows[:, TURN : TURN + 3].any(axis=1)
    level = np.abs(along) < 1e-12
    about = np.abs(np.einsum("mi,mi->m", rows[:, NORMAL : NORMAL + 3], axes[0])) > 1.0 - 1e-15
    plane = level & about & ~rows[:, TURN : TURN + 3].any(axis=1)
    rows[:, MODE] = np.where(general, np.where(plane, ROUND, GENERAL), np.where(level, ACROSS, STRAIGHT))
    rows[:, CUTTER] = which[row][owner]
    cuts = on_path[row] & ~(toolpath.feed[row] >= process.rapid)
    rows[:, REMOVES] = cuts[owner]
    flat = rows[:, STEP : STEP + 3] - along[:, None] * axes[0]
    return MotionSweeps(
        rows,
        row[owner],
        share,
        _lengths(rows),
        _headings(flat, axes[0]),
        tuple(cutters),
        simulated,
        turned,
        stock,
    )


def _refuse_turned_part(toolpath: Toolpath, on_path: Bools, program: str) -> None:
    """Refusal STK035 where words turn the part between motions ``on_path`` (N,), about axes that nothing states."""
    rows = np.flatnonzero(on_path)
    turn = np.nan_to_num(toolpath.orientation_control.part_turn[rows])
    away = np.flatnonzero(np.abs(turn - turn[:1]).max(axis=1, initial=0.0) > _PARALLEL)
    if len(away):
        message = (
            "here A, B or C has turned the part since the first cut, and the stock does not turn with it"
        )
        raise Refusal(Finding("STK035", message, program, int(toolpath.line[rows[away[0]]])))


def _cutters(
    toolpath: Toolpath, numbers: Ints, cuts: Bools, process: StockProcess, program: str
) -> tuple[list[Cutter], Ints]:
    """The cutters that the program uses, and that of each motion (N,), -1 without one."""
    missing = sorted({int(n) for n in numbers[cuts]} - set(process.cutters))
    if missing:
        stated = ", ".join(map(str, sorted(process.cutters)))
        findings = []
        for number in missing:
            row = int(np.flatnonzero(cuts & (numbers == number))[0])
            name = f"tool {number}" if number else "the tool, which has no number,"
            message = f"{name} is not stated in {process.path.name}, which has the tools {stated}"
            help = f"add it: tools: {{{number or 1}: {{shape: flat, diameter: ..., length: ...}}}}"
            findings.append(Finding("STK006", message, program, int(toolpath.line[row]), help=help))
        raise Refusal(*findings)
    used = [number for number in process.cutters if np.any(numbers == number)]
    which = np.full(len(numbers), -1)
    for index, number in enumerate(used):
        which[numbers == number] = index
    return [process.cutters[number] for number in used], which


def _tips(
    start: Floats, step: Floats, centre: Floats, normal: Floats, angle: Floats, owner: Ints, share: Floats
) -> Floats:
    tips = np.asarray(start[owner] + share[:, None] * step[owner])
    at = np.flatnonzero(angle[owner] > 0)
    if len(at):
        own = owner[at]
        n, s = normal[own], share[at, None]
        turned = rotation_from_vector(s * angle[own, None] * n) @ (start[own] - centre[own])[..., None]
        tips[at] = centre[own] + turned[..., 0] + s * np.einsum("mi,mi->m", step[own], n)[:, None] * n
    return tips


def _axes(
    toolpath: Toolpath, turned: Floats, row: Ints, first: Floats, turn: Floats, frames: MotionFrames, owner: Ints,
    share: Floats,
) -> Floats:  # fmt: skip
    """(M, 3) the spindle axis at the shares of the motions: about one axis, or as the words of rotary axes say."""
    axes = first[owner].copy()
    at = np.flatnonzero(turn[owner].any(axis=1))
    if not len(at):
        return axes
    motion = row[owner[at]]
    axes[at] = np.einsum("mij,mj->mi", rotation_from_vector(share[at, None] * turn[owner[at]]), axes[at])
    words = np.flatnonzero(toolpath.orientation_control.path[motion] == OrientationPath.ROTARY_AXES)
    if len(words):
        abc = toolpath.orientation_control.rotary_at(motion[words], share[at[words]])
        rotation = np.eye(3)[None]
        for axis in (2, 1, 0):
            rotation = rotation @ rotation_from_vector(abc[:, axis, None] * np.eye(3)[axis])
        spindle = np.einsum(
            "mij,mj->mi", turned[motion[words]] @ rotation, frames.spindle_in_tool[motion[words]]
        )
        axes[at[words]] = np.where(np.isfinite(spindle), -spindle, axes[at[words]])
    return axes


def _between(start: Floats, end: Floats) -> Floats:
    """(M, 3) the shortest rotation vectors from the directions ``start`` to ``end`` (M, 3)."""
    across = np.cross(start, end)
    sine = np.linalg.norm(across, axis=1)
    angle = np.arctan2(sine, np.einsum("mi,mi->m", start, end))
    turn = across * (angle / np.maximum(sine, _PARALLEL))[:, None]
    return np.asarray(np.where((sine > _PARALLEL)[:, None], turn, 0.0))


def _lengths(rows: Floats) -> Floats:
    step, normal = rows[:, STEP : STEP + 3], rows[:, NORMAL : NORMAL + 3]
    out = rows[:, TIP_POINT : TIP_POINT + 3] - rows[:, CENTRE : CENTRE + 3]
    out = out - np.einsum("mi,mi->m", out, normal)[:, None] * normal
    rise = np.einsum("mi,mi->m", step, normal)
    curved = np.hypot(rows[:, ANGLE] * np.linalg.norm(out, axis=1), rise)
    return np.asarray(np.where(rows[:, ANGLE] > 0, curved, np.linalg.norm(step, axis=1)))


def _headings(flat: Floats, axis: Floats) -> Floats:
    size = np.linalg.norm(flat, axis=1)
    index = np.where(size > 1e-9, np.arange(len(flat)), -1)
    latest = np.maximum.accumulate(index)
    latest[latest < 0] = index[np.argmax(index >= 0)] if np.any(index >= 0) else -1
    other = np.eye(3)[np.argmin(np.abs(axis), axis=1)]
    last = flat[latest] / np.maximum(size[latest], 1e-12)[:, None]
    return np.asarray(np.where((latest >= 0)[:, None], last, other))
