"""What a search for places needs of a prepared program, and the check of every motion at one place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.cell import Cell
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.problem import CompensationProblem
from postproc.placement.margin_words import margin_words, reach_shortfall, reach_words
from postproc.placement.part_motions import PartMotions
from postproc.placement.singularity import singularity_angle
from postproc.robot.axis_track import branch_matches
from postproc.robot.description import Robot
from postproc.robot.external_axes import TRACK, own_column
from postproc.robot.geometries import SerialArm
from postproc.robot.inverse import inverse
from postproc.robot.makers import maker_of
from postproc.toolpath import Kind
from postproc.workflows.preparation import Prepared

STEP, TURN = 25.0 * MM, 5.0 * DEG
"""Long motions are looked at so closely between their ends."""
MOST_INNER = 400
"""Places inside of one motion at most."""


@dataclass(frozen=True)
class MotionMargins:
    """Of all places that a program leads to: limit (M,), singular (M,) [rad]: distances from the next axis limit and
    the next singularity, -inf out of reach, the rows (M,) they belong to, and the joint values q (M, n) there, 0 out
    of reach; short (M,) [m]: by how much a target is out of reach, NaN where the arm does not show it; wrong (K,): rows
    whose configuration is not the stated one."""

    limit: Floats
    singular: Floats
    rows: Ints
    q: Floats
    short: Floats
    wrong: Ints

    def lack(self, robot: Robot, margins: tuple[float, float]) -> tuple[int, str] | None:
        """The row whose place lacks most of ``margins`` [deg] to limits and singularities, and in words what; None
        where every place keeps them."""
        for values, least in ((self.limit, margins[0]), (self.singular, margins[1])):
            at = int(values.argmin())
            if not values[at] < least * DEG:
                continue
            if np.isfinite(values[at]):
                return int(self.rows[at]), margin_words(robot, self.q[at], float(self.singular[at]), margins)
            at = int(np.where(np.isfinite(values), -1.0, np.nan_to_num(self.short)).argmax())
            return int(self.rows[at]), reach_words(float(self.short[at]))
        return None


def placed_rows(task: CompensationProblem) -> Bools:
    """(N,) motions to a Cartesian target of which the configuration is known."""
    path = task.toolpath
    return np.asarray(path.known & ~path.on_axes & (task.track.branch >= 0))


def motion_margins(task: CompensationProblem) -> MotionMargins:
    """The margins of every motion of a program, at its end and on its path."""
    robot, path, track = task.model.robot, task.toolpath, task.track
    rows = np.flatnonzero(placed_rows(task))
    inner, share = inner_points(task.desired_path, rows)
    ends = np.where(track.reachable[rows, None], track.q[rows], np.nan)
    flange = _flanges(task, inner, share)
    between = inverse(robot.nominal, flange, track.branch[inner], task.q_reference(inner, share)).q
    q, every = np.concatenate([ends, between]), np.concatenate([rows, inner])
    reached = np.isfinite(q).all(axis=1)
    q = np.where(reached[:, None], q, 0.0)
    lost, short = np.flatnonzero(~reached), np.zeros(len(every))
    if len(lost):
        shares = np.concatenate([np.ones(len(rows)), share])[lost]
        short[lost] = reach_shortfall(robot, _flanges(task, every[lost], shares))
    low, high = robot.limits.T
    room = np.minimum(q - low, high - q)
    turns = np.array([joint.kind == "revolute" for joint in robot.joints])
    room[:, ~turns] = np.where(room[:, ~turns] >= -1e-9, np.inf, room[:, ~turns])
    wrong = ~branch_matches(path, track) & placed_rows(task) & (path.kind == Kind.PTP)
    return MotionMargins(
        np.where(reached, room.min(axis=1), -np.inf),
        np.where(reached, singularity_angle(robot, q), -np.inf),
        every,
        q,
        short,
        np.flatnonzero(wrong | (~track.turn_matches & placed_rows(task) & (path.kind == Kind.PTP))),
    )


def _flanges(task: CompensationProblem, rows: Ints, share: Floats) -> Poses:
    """(M) where the flange is wanted at ``share`` (M,) of the paths of the motions ``rows`` (M,), in the robot's own
    base."""
    flange = task.desired_path.at(rows, share) @ task.tool[rows].inverse()
    placed = task.robot_from_path(rows, share)
    return flange if placed is None else placed @ flange


def inner_points(desired_path: DesiredPath, rows: Ints) -> tuple[Ints, Floats]:
    """Places inside of the long ones of the path motions ``rows`` (K,): motion (M,) and share (M,) of its path."""
    some = rows[desired_path.traceable[rows]]
    angle = np.where(np.isfinite(desired_path.angle[some]), desired_path.angle[some], np.pi)
    parts = np.ceil(np.maximum(desired_path.length[some] / STEP, angle / TURN)).astype(np.int64)
    inner = np.clip(parts - 1, 0, MOST_INNER)
    motion = np.repeat(some, inner)
    place = np.arange(len(motion)) - np.repeat(np.cumsum(inner) - inner, inner)
    return motion, (place + 1) / (np.repeat(inner, inner) + 1)


def moved_frames(ready: Prepared, base: int) -> Ints:
    """(F,) frames of the program whose bases move with ``base``.  Raises Refusal PLC003, PLC004."""
    task, path = ready.task, ready.task.toolpath
    cut = np.unique(path.base[task.carries])
    numbers = [path.frames[frame].number for frame in cut]
    for frame, number in zip(cut.tolist(), numbers, strict=True):
        line = int(path.line[np.argmax(task.carries & (path.base == frame))])
        if path.frames[frame].pose is not None or number is None or number not in ready.cell.bases:
            message = "the program states the base of this cut itself, so a cell file does not move it"
            raise Refusal(Finding("PLC003", message, task.file, line))
        if number != base:
            message = f"this cut is in base {number}, and the part that is placed is in base {base}"
            raise Refusal(Finding("PLC004", message, task.file, line))
    return np.asarray(cut)


def build_motions(ready: Prepared, base: int, turned_tools: bool, track: str | None) -> PartMotions:
    """The places that a program leads to.  ``base``: number of the one that moves; ``turned_tools``: the tools of its
    cuts may be turned; ``track``: name of the external axis that may be elsewhere.  Raises Refusal PLC003, PLC004."""
    task, cell, robot = ready.task, ready.cell, ready.robot
    path = task.toolpath
    frames = moved_frames(ready, base)
    ends = np.flatnonzero(placed_rows(task))
    moving_row = np.isin(path.base, frames)
    inner, share = inner_points(task.desired_path, ends)
    # of a motion that starts elsewhere only its end moves with the part: its path is checked at the places found
    rigid = (moving_row & _starts_on_part(task, moving_row))[inner]
    inner, share = inner[rigid], share[rigid]
    rows = np.concatenate([ends, inner])
    shares = np.concatenate([np.ones(len(ends)), share])
    order = np.lexsort((shares, rows))
    rows, shares = rows[order], shares[order]
    at_end = shares == 1.0

    before = Poses(
        np.broadcast_to(cell.robot_base.inverse().rotation, (len(rows), 3, 3)),
        np.broadcast_to(cell.robot_base.inverse().position, (len(rows), 3)),
    )
    wanted = task.desired_path.at(rows, shares)
    wanted.put(np.flatnonzero(at_end), task.wanted[rows[at_end]])
    if task.external is not None:
        before = _before(ready, rows, shares, before)
    placed = task.robot_from_path(rows, shares)
    in_robot = wanted if placed is None else placed @ wanted
    target = before.inverse() @ in_robot

    q = np.array(task.q_reference(rows, shares))
    flange = in_robot @ task.tool[rows].inverse()
    q_inner = inverse(robot.nominal, flange, task.track.branch[rows], np.nan_to_num(q))
    q = np.where(np.isfinite(q), q, np.where(q_inner.reachable[:, None], q_inner.q, 0.0))
    q[~at_end] = np.where(q_inner.reachable[:, None], q_inner.q, q)[~at_end]
    head, anchor, sign = _heads(ready, rows, at_end)
    scored = at_end & task.carries[rows] & moving_row[rows]
    wrench = np.where(scored[:, None], task.wrench[rows], 0.0)
    tangent = np.where(
        scored[:, None], task.desired_path.tangent(rows, np.ones(len(rows))), 0.0
    )  # in the axes of the path
    start = _fixed_starts(task, rows, scored & ~_starts_on_part(task, moving_row)[rows])
    to_world = np.swapaxes(before.rotation, 1, 2)
    if placed is not None:
        to_world = to_world @ placed.rotation
    axis = np.zeros((len(rows), 3))
    if turned_tools:
        axis = _tool_axes(ready, rows, frames)
    joint = robot.external if track is not None and own_column(robot) is not None else None
    now, direction = _track(ready, track)
    return PartMotions(
        program=np.zeros(len(rows), np.int64),
        line=path.line[rows],
        row=rows,
        share=shares,
        target=Poses(np.ascontiguousarray(target.rotation), np.ascontiguousarray(target.position)),
        moves=moving_row[rows],
        tool=task.tool[rows],
        axis=axis,
        before=Poses(np.ascontiguousarray(before.rotation), np.ascontiguousarray(before.position)),
        branch=task.track.branch[rows],
        q=q,
        head=head,
        anchor=anchor,
        sign=sign,
        scored=scored,
        under_force=task.carries[rows],
        force=np.einsum("nij,nj->ni", to_world, wrench[:, :3]),
        moment=np.einsum("nij,nj->ni", to_world, wrench[:, 3:]),
        tangent=np.einsum("nij,nj->ni", to_world, tangent),
        start=start,
        world=np.zeros(len(rows), np.bool_),
        conditions=task.conditions.part(rows),
        origin=np.array(cell.bases[base].position),
        track=direction,
        track_now=now,
        track_joint=joint,
    )


def _starts_on_part(task: CompensationProblem, moves: Bools) -> Bools:
    """(N,) the motion starts at a place that ``moves`` (N,) with the part."""
    path = task.toolpath
    return np.append(False, (moves & path.known)[:-1])


def _fixed_starts(task: CompensationProblem, rows: Ints, fixed: Bools) -> Floats:
    """(R, 3) [m] where the straight ones of ``rows`` (R,) start that are ``fixed`` (R,), in the robot's own base."""
    starts = np.full((len(rows), 3), np.nan)
    some = np.flatnonzero(fixed & (task.toolpath.kind[rows] == Kind.LIN) & task.desired_path.traceable[rows])
    if len(some):
        there = task.desired_path.start[rows[some]]
        placed = task.robot_from_path(rows[some], np.zeros(len(some)))
        starts[some] = there.position if placed is None else (placed @ there).position
    return starts


def _before(ready: Prepared, rows: Ints, shares: Floats, world: Poses) -> Poses:
    """$WORLD in the robot's own base, of a program with external axes: what ``cell.bases`` are moved by."""
    external, path = ready.task.external, ready.task.toolpath
    assert external is not None
    placed = external.robot_from_path(rows, shares)
    if placed is not None:
        return placed @ world
    moved = [external.base_moved(frame) @ world[0] for frame in path.frames]
    return Poses(
        np.array([pose.rotation for pose in moved])[path.base[rows]],
        np.array([pose.position for pose in moved])[path.base[rows]],
    )


def _heads(ready: Prepared, rows: Ints, at_end: Bools) -> tuple[Ints, Floats, Ints]:
    """Of the places of ``rows`` (R,): head (R,), anchor (R, n) and sign (R, n), as of ``PartMotions``."""
    task, robot = ready.task, ready.robot
    path, count = task.toolpath, len(robot.joints)
    anchor, sign = np.full((len(rows), count), np.nan), np.zeros((len(rows), count), np.int64)
    start = ready.cell.start
    if isinstance(robot.nominal, SerialArm):
        return np.arange(len(rows)), task.track.q[rows], sign
    signs = maker_of(path.configuration).negative_axes(path.configuration)
    stated = (signs >= 0) & (path.kind == Kind.PTP)
    resets = stated | path.on_axes | path.paths_meet
    resets[0] = True
    group = np.cumsum(resets)
    first = np.append(True, group[rows[1:]] != group[rows[:-1]])
    # of a motion the end is the head: the places inside of it come before
    heads = np.flatnonzero(first)
    while (late := ~at_end[heads]).any():
        heads = heads + late
    head = heads[np.cumsum(first) - 1]
    row = rows[heads]
    by_turn = np.flatnonzero(stated[row])
    bits = (signs[row[by_turn], None] >> np.arange(6)) & 1
    sign[heads[by_turn], -6:] = np.where(bits == 1, -1, 1)
    on_axes = np.flatnonzero(path.on_axes)
    last = np.searchsorted(on_axes, row) - 1
    known = np.flatnonzero(last >= 0)
    if start is not None:
        anchor[heads] = robot.joint_values(start[None])[0]
    anchor[heads[known]] = task.track.q[on_axes[last[known]]]
    return head, anchor, sign


def _tool_axes(ready: Prepared, rows: Ints, frames: Ints) -> Floats:
    """(R, 3) axes about which the tools of the cuts are turned, zero for other tools.  Raises Refusal PLC003."""
    task, path = ready.task, ready.task.toolpath
    axes = np.zeros((len(path.frames) + 1, 3))
    for frame in np.unique(path.tool[task.carries]).tolist():
        number = path.frames[frame].number
        if path.frames[frame].pose is not None or number is None or number not in ready.cell.tools:
            line = int(path.line[np.argmax(task.carries & (path.tool == frame))])
            message = "the program states the tool of this cut itself, so a cell file does not turn it"
            raise Refusal(Finding("PLC003", message, task.file, line, help="omit --tool-turn and --spin"))
        axes[frame] = ready.cell.tools[number].axis
    return np.asarray(axes[path.tool[rows]])


def _track(ready: Prepared, name: str | None) -> tuple[float, Floats]:
    """Where the track is now [m], and by how much a metre of it moves $WORLD in the robot's own base (3,)."""
    if name is None:
        return 0.0, np.zeros(3)
    robot, cell = ready.robot, ready.cell
    column = own_column(robot)
    if column is not None and robot.external is not None:
        now = 0.0 if cell.start is None else float(cell.start_stated[robot.external]) * MM  # type: ignore[index]
        return now, np.zeros(3)
    axis = next(axis for axis in cell.external_axes if axis.name == name)
    now = 0.0 if axis.start is None else axis.start * MM
    return now, -np.asarray(cell.robot_base.inverse().rotation @ axis.direction)


def track_of(ready: Prepared, stated: Bools) -> tuple[str, float, float] | None:
    """Name and limits [m] of the linear track that the cell, and not the program, puts in its place; None without one.
    ``stated`` (N, 6): where the text states the external axes.  Raises Refusal PLC003 where it states this one."""
    robot, cell = ready.robot, ready.cell
    found: tuple[str, float, float] | None = None
    column = own_column(robot)
    if column is not None and robot.external is not None:
        joint = robot.joints[robot.external]
        if joint.kind == "prismatic" and cell.start is not None:
            found = joint.name, float(joint.lower), float(joint.upper)
    for axis in cell.external_axes:
        if axis.kind == TRACK and found is None:
            found, column = (axis.name, axis.lower * MM, axis.upper * MM), axis.column
    if found is None:
        return None
    if stated[:, column].any():
        message = f"the program states {found[0]} itself, so a cell file does not move it"
        raise Refusal(Finding("PLC003", message, ready.task.file, help="omit --track"))
    return found


def base_of_cuts(ready: Prepared) -> int:
    """Number of the base in which a program cuts first.  Raises Refusal PLC003, PLC005."""
    task, path = ready.task, ready.task.toolpath
    if not task.model.is_compliant:
        message = f"{ready.robot.name} has no compliance: no force deflects it, so every place is as good as any other"
        help = "state its compliances in the robot file, or identify them from measurements (compensate identify)"
        raise Refusal(Finding("PLC005", message, str(ready.robot.path), help=help))
    rows = np.flatnonzero(task.carries & placed_rows(task))
    if not len(rows):
        message = "no motion carries a force that deflects the tool, so every place is as good as any other"
        raise Refusal(Finding("PLC005", message, task.file))
    frame = path.frames[path.base[rows[0]]]
    if frame.pose is not None or frame.number is None or frame.number not in ready.cell.bases:
        message = "the program states the base of this cut itself, so a cell file does not move it"
        raise Refusal(Finding("PLC003", message, task.file, int(path.line[rows[0]])))
    return int(frame.number)


def cell_of_all(cells: list[Cell]) -> Cell:
    """The one cell of all programs.  Raises Refusal PLC004."""
    for cell in cells[1:]:
        if cell.path.resolve() != cells[0].path.resolve():
            message = f"its cell is {cell.path}, and that of the first program is {cells[0].path}"
            raise Refusal(Finding("PLC004", message, str(cell.path), help="name one cell with --cell"))
    return cells[0]
