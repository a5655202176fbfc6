"""What is around the part in the view of the page: robot, cutters, forces' places and the path of the tool."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses, turned
from postproc.base.units import MM
from postproc.compensation.problem import CompensationProblem
from postproc.part.deflected_sweeps import axes_of
from postproc.process.stock.cutters import CUTTING, HOLDER, SHANK, Cutter
from postproc.process.stock.simulation import StockRun
from postproc.robot.description import Robot

PATH_BYTES = 2_500_000
"""Of the packed path at most; a longer one is thinned out."""

_ARC_POINTS, _EACH = 200_000, (1, 15)  # points inside of arcs in all, of each arc
_NONE = 255  # no cutter
_SHOWN_EDGES, _SHOWN_HOLDER = 3.0, 0.04  # diameters of edges without a length; m of a holder


def part_scene(task: CompensationProblem, rows: Ints) -> dict[str, Any]:
    """What ``robot.js`` and ``part.js`` draw beside the part, for motions ``rows`` (K,).

    joints, flange: the chain (see ``robot_chain``); joint_values (K, n) [rad, mm] at the ends of the motions; robot:
    its base in the axes of the stock, or ``robots`` (K, 12) of each motion where external axes move it; frame: path
    axes in those of the stock; axes (K, 3): from the tip to the holder, in 32,767ths; cutter (K,): index into
    ``cutters``, 255 for none; path: see ``_packed_path``.  Poses are rows of 3 x 4 numbers, lengths in mm.
    """
    run = task.force.stock
    assert isinstance(run, StockRun)
    to_stock = run.sweeps.stock[0].inverse()
    axes, cutter = _tools(run, rows)
    placed = task.robot_from_path(rows)
    scene: dict[str, Any] = {
        **robot_chain(task.model.robot),
        "joint_values": _text(_shown_values(task.model.robot, task.q_reference(rows)), "<f4"),
        "robot": _rows(to_stock),
        "frame": _rows(to_stock),
        "axes": _text(np.round(np.nan_to_num(axes) * 32767), "<i2"),
        "cutter": _text(cutter, "<u1"),
        "cutters": [_profile(one) for one in run.sweeps.cutters],
        "numbers": [one.number for one in run.sweeps.cutters],
        "path": _packed_path(task, to_stock),
    }
    if placed is not None:
        base = to_stock @ placed.inverse()
        where = np.concatenate([base.rotation, base.position[:, :, None] / MM], axis=2)
        scene["robots"] = _text(where.reshape(-1, 12), "<f4")
    return scene


def robot_chain(robot: Robot) -> dict[str, Any]:
    """joints: each with its ``placement`` on the joint before at value zero, whether it ``turns``, and of which columns
    of the joint values its own is the sum, as pairs of column and ratio; flange: its pose on the last joint."""
    column = {joint.name: index for index, joint in enumerate(robot.joints)}
    joints = []
    for joint in robot.joints:
        for passive in joint.passive:
            follows = [[column[name], ratio] for name, ratio in passive.follows]
            joints.append((passive.placement, passive.kind, follows))
        joints.append((joint.placement, joint.kind, [[column[joint.name], 1.0]]))
    return {
        "joints": [
            {"placement": _rows(placement), "turns": kind == "revolute", "follows": follows}
            for placement, kind, follows in joints
        ],
        "flange": _rows(robot.flange),
        "columns": len(robot.joints),
    }


def _shown_values(robot: Robot, q: Floats) -> Floats:
    """(K, n) [rad, mm] of joint values (K, n) [rad, m]."""
    units = np.array([1.0 if joint.kind == "revolute" else MM for joint in robot.joints])
    return np.asarray(q / units)


def _rows(pose: Poses) -> list[float]:
    """A pose as rows of 3 x 4 numbers [mm]."""
    whole = np.concatenate([pose.rotation, pose.position[:, None] / MM], axis=1)
    return [float(value) for value in np.round(whole.reshape(12), 9)]


def _text(values: Any, form: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=form).tobytes()).decode("ascii")


def _tools(run: StockRun, rows: Ints) -> tuple[Floats, Ints]:
    """Axes (K, 3) of the tool at the ends of motions ``rows`` (K,), and their cutters (K,); of a motion that is not
    simulated those of the last one before it, of the first ones those of the next."""
    sweeps = run.sweeps
    last = np.zeros(len(run.toolpath), np.int64) - 1
    last[sweeps.motion] = np.arange(len(sweeps.motion))
    known = np.maximum.accumulate(last)
    known[known < 0] = known[np.argmax(known >= 0)]
    at = known[rows]
    return axes_of(sweeps.rows[at], np.ones(len(at))), np.where(at >= 0, sweeps.which[at], _NONE)


def _profile(cutter: Cutter) -> list[list[float]]:
    """[part, height, radius] [mm] from the tip up: CUTTING, SHANK, HOLDER; what has no stated end is drawn with one."""
    start = None if cutter.holder is None else cutter.holder[1]
    edges = cutter.length or start or _SHOWN_EDGES * 2 * cutter.radius
    top = start or 1.5 * edges
    limits = {CUTTING: edges, SHANK: top, HOLDER: top + _SHOWN_HOLDER}
    points: list[list[float]] = []
    for part, arc, a, b, c, d, _, _ in cutter.profile().tolist():
        if arc:
            turn = np.linspace(0, np.pi / 2, 9)
            places = np.stack([b - c * np.cos(turn), a + c * np.sin(turn)], axis=1)
        else:
            places = np.array([[b, a], [d, c]])
        places[:, 0] = np.minimum(places[:, 0], limits[int(part)])
        points += [[int(part), round(z / MM, 4), round(r / MM, 4)] for z, r in places.tolist()]
    return points


def _packed_path(task: CompensationProblem, to_stock: Poses) -> dict[str, Any]:
    """The path of the tip in the axes of the stock, arcs by points inside of them: ``low`` and ``size`` (3,) [mm] of
    its box, ``count`` points of ``all``, and ``data``: for x, y and z the low and then the high bytes of the steps
    from point to point in 65,535ths of the box, modulo 65,536, deflated."""
    points = _path_points(task)
    points = turned(to_stock.rotation, points) + to_stock.position
    points = points[np.isfinite(points).all(axis=1)] / MM
    if not len(points):
        points = np.zeros((1, 3))
    low = points.min(axis=0)
    size = np.maximum(points.max(axis=0) - low, 1e-6)
    every, whole = 1, len(points)
    while True:
        some = points[::every]
        grid = np.round((some - low) / size * 65535).astype(np.int64)
        steps = (np.diff(grid, axis=0, prepend=0) & 0xFFFF).astype("<u2")
        planes = np.concatenate([part for axis in steps.T for part in (axis & 0xFF, axis >> 8)])
        packed = zlib.compress(planes.astype(np.uint8).tobytes(), 6)
        if len(packed) <= PATH_BYTES or len(some) < 2:
            break
        every = max(every + 1, int(every * len(packed) / PATH_BYTES))
    return {
        "low": np.round(low, 4).tolist(),
        "size": np.round(size, 6).tolist(),
        "count": len(some),
        "all": whole,
        "data": base64.b64encode(packed).decode("ascii"),
    }


def _path_points(task: CompensationProblem) -> Floats:
    """(P, 3) [m] the ends of all motions and points inside of the arcs, in the order of the program, path axes."""
    n = len(task.toolpath)
    ends = np.concatenate([np.empty((0, 3)), *(task.wanted[block].position for block in _blocks(n))])
    arcs = np.flatnonzero(task.desired_path.traceable & task.desired_path.arc)
    if not len(arcs):
        return ends
    each = int(np.clip(_ARC_POINTS // len(arcs), *_EACH))
    shares = np.arange(1, each + 1) / (each + 1)
    inside = [
        task.desired_path.at(np.repeat(part, each), np.tile(shares, len(part))).position
        for part in (arcs[block] for block in _blocks(len(arcs)))
    ]
    order = np.concatenate([np.arange(n), (np.repeat(arcs, each) - 1) + np.tile(shares, len(arcs))])
    return np.concatenate([ends, *inside])[np.argsort(order, kind="stable")]


def _blocks(count: int, size: int = 20_000) -> list[Ints]:
    return [np.arange(first, min(first + size, count)) for first in range(0, count, size)]
