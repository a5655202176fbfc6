"""Programs in a stock for tests: tip positions in mm, one cutter each, run without any file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from motions import toolpath_of

pytest.importorskip("numba")

from postproc.base.geometry import Poses
from postproc.cell import MotionFrames
from postproc.process.materials import Material
from postproc.process.milling_forces import Coefficients
from postproc.process.stock.blank import box_blank, corners_of
from postproc.process.stock.cutters import Cutter
from postproc.process.stock.engagement import engage
from postproc.process.stock.motion_sweeps import find_sweeps
from postproc.process.stock.stock_section import Edges, StockProcess
from postproc.toolpath import Arcs, FrameRef, Kind

MM = 1e-3
KNOWN = Coefficients((700e6, 170e6, 200e6), (27e3, 26e3, 1e3))
ALLOY = Material("test", KNOWN, 0.2, "test", "")
SPEED = 2 * np.pi * 200.0  # rad/s: 12000 1/min
FEED = 0.06  # m/s: with 3 teeth 0.1 mm per tooth
CHIP = 0.1 * MM
FLAT = Cutter(1, "flat", 8 * MM, length=40 * MM, teeth=3, helix=np.pi / 6)
BALL = Cutter(1, "ball", 5 * MM, length=30 * MM, corner=5 * MM, teeth=3, helix=np.pi / 6)
BULL = Cutter(1, "bull", 8 * MM, length=30 * MM, corner=2 * MM, teeth=3, helix=np.pi / 6)
CONE = Cutter(1, "cone", 8 * MM, length=30 * MM, taper=np.pi / 6, tip=1 * MM, teeth=3, helix=np.pi / 6)


GOALS: list[tuple[str, str, float, float]] = []
"""What ``within_goal`` has seen: case, figure, how far off, goal."""


def within_goal(case, figure, off, goal):
    """How far a figure of a case with a known truth is off, against its goal; ``goal_cases`` prints the table."""
    GOALS.append((case, figure, float(off), goal))
    assert off < goal, (case, figure)


def force_off(force, truth):
    """%, of the size of the true force."""
    return 100 * float(np.linalg.norm(force - truth) / np.linalg.norm(truth))


def block(low, high):
    """A box, corners in mm."""
    return box_blank(np.array(low, float) * MM, np.array(high, float) * MM)


def path_through(points, axes=None, kinds=None, arcs=None, tools=None, feed=FEED):
    """A toolpath through tip positions (mm); axes: spindle directions from the tip back, else +z."""
    points = np.array(points, float) * MM
    n = len(points)
    axes = np.broadcast_to([0.0, 0, 1], (n, 3)) if axes is None else np.array(axes, float)
    rotation = np.array([_upright(axis) for axis in axes])
    return toolpath_of(
        kind=np.array([Kind.PTP] + [Kind.LIN] * (n - 1) if kinds is None else kinds),
        position=points,
        rotation=rotation,
        axes=np.full((n, 6), np.nan),
        feed=np.broadcast_to(np.asarray(feed, float), (n,)),
        base=np.zeros(n, int),
        tool=np.zeros(n, int) if tools is None else np.array(tools) - 1,
        line=np.arange(1, n + 1),
        frames=tuple(FrameRef(number, None) for number in range(1, 4)),
        arcs=Arcs() if arcs is None else arcs,
    )


def _upright(axis):
    """A rotation whose z is ``axis``, which turns as little as can be."""
    z = axis / np.linalg.norm(axis)
    cross = np.cross([0, 0, 1], z)
    k = np.array([[0, -cross[2], cross[1]], [cross[2], 0, -cross[0]], [-cross[1], cross[0], 0]])
    return np.eye(3) + k + k @ k / (1 + z[2])


def run(path, blank, *cutters, rapid=np.inf, before=None, edges=None):
    """The engagement of a toolpath; the spindle axis is -z of the tool."""
    sweeps, edges = sweeps_of(path, blank, *cutters, rapid=rapid, edges=edges)
    return engage(blank, sweeps, path, edges, before)


def sweeps_of(path, blank, *cutters, rapid=np.inf, edges=None):
    """The sweeps of a toolpath, and what the forces of its tools need."""
    n = len(path)
    one = Poses(np.broadcast_to(np.eye(3), (n, 3, 3)), np.zeros((n, 3)))
    frames = MotionFrames(one, one, np.broadcast_to([0.0, 0, -1], (n, 3)))
    cutters = {index + 1: replace(cutter, number=index + 1) for index, cutter in enumerate(cutters)}
    edges = {number: Edges(SPEED, ALLOY) for number in cutters} if edges is None else edges
    process = StockProcess(
        None, "box", np.zeros((1, 1)), 2, None, 1.0, None, 1, cutters, edges, rapid
    )  # fmt: skip
    low, high = corners_of(blank)
    place = Poses(np.eye(3)[None], np.zeros((1, 3)))
    return find_sweeps(path, frames, process, low, high, "test", place), edges
