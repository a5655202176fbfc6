"""Engagement and displacement solved together, against the closed form of a wall under a spring, and where a path turns
at once."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("numba")

from scipy.optimize import brentq
from stock_cases import CHIP, FLAT, KNOWN, MM, Poses, block, path_through, run, sweeps_of

from postproc.part.coupled_engagement import Paths, solve_coupled
from postproc.part.deflected_sweeps import axes_of
from postproc.process.milling_forces import Engagement, engagement, mean_force
from postproc.toolpath import Kind

DEPTH, WIDTH = 5.0, 0.5
LEVER = 40 * MM


class Springs:
    """A robot whose tool yields by ``compliance`` (3, 3) [m/N] times the force, everywhere the same."""

    division = None

    def __init__(self, count, compliance):
        self.compliance, self.traceable = compliance, np.ones(count, bool)
        nothing = SimpleNamespace(along=lambda motion, share: np.zeros((len(motion), 6)))
        self.task = SimpleNamespace(force=nothing)

    def to_stock(self, motion):
        return np.broadcast_to(np.eye(3), (len(motion), 3, 3))

    def predicted(self, motion, share, wrench):
        one = self.to_stock(motion)
        real = SimpleNamespace(
            pose=Poses(one, wrench[:, :3] @ self.compliance.T),
            reachable=np.ones(len(motion), bool),
            settled=np.ones(len(motion), bool),
        )
        return real, Poses(one, np.zeros((len(motion), 3)))


def solve(path, blank, compliance, *cutters):
    """The solution of all motions of a toolpath."""
    sweeps, edges = sweeps_of(path, blank, *cutters)
    cut = run(path, blank, *cutters)
    process = SimpleNamespace(edges=edges)
    stock = SimpleNamespace(
        sweeps=sweeps, engagement=cut, toolpath=path, process=process, before=None, blank=blank
    )
    number = np.flatnonzero(sweeps.rows[:, 21] > 0)
    paths = Paths(
        sweeps.rows[number], sweeps.motion[number], sweeps.share[number], sweeps.which[number], number
    )
    return solve_coupled(stock, paths, Springs(len(path), compliance), LEVER)


def side_force(width, direction):
    """[N] The force on the tool away from a wall of which it takes ``width`` [mm], by the closed form of a shoulder."""
    if width <= 0:
        return 0.0
    entry, out = engagement(direction, width * MM, 2 * FLAT.radius)
    cut = Engagement(2 * FLAT.radius, FLAT.teeth, FLAT.helix, DEPTH * MM, entry, out, KNOWN)
    fy = mean_force(cut, np.array([CHIP]))[0, 1]
    return float(fy if direction == "down" else -fy)


def wall(passes, direction):
    """Passes along the same line beside a wall, back through the air; the rows of the passes."""
    y = 60 + 8 - WIDTH
    ends = [[30, y, -DEPTH], [60, y, -DEPTH]]
    first, last = ends if direction == "down" else ends[::-1]
    points, kinds = [], []
    for _ in range(passes):
        points += [first, last]
        kinds += [Kind.PTP, Kind.LIN]
    return path_through(points, kinds=kinds), np.arange(1, 2 * passes, 2)


@pytest.mark.parametrize("direction", ["down", "up"])
@pytest.mark.parametrize("compliance", [0.3, 1.0, 3.0])
def test_a_wall_under_a_spring_and_its_spring_passes(direction, compliance):
    """Each pass cuts what the displaced one before it left: d = F(left - d) / k, to 1 um."""
    path, rows = wall(3, direction)
    c = compliance * 1e-6
    found = solve(path, block([0, -60, -40], [90, 60, 0]), np.diag([0.0, c, 0.0]), FLAT)
    left = 0.0
    for row in rows:
        # the wall is where the tool passed, short by what it yields; the next pass finds that in addition
        to_cut = WIDTH if row == 1 else left
        yields = brentq(lambda d, a=to_cut: c / MM * side_force(a - d, direction) - d, -0.5, to_cut)
        force = found.along(np.array([row]), np.array([0.6]))[0]
        assert c / MM * force[1] == pytest.approx(yields, abs=1e-3)
        assert row > 1 or yields > 0.005
        left = yields
    assert found.residual < 1e-6


def test_where_the_path_turns_at_once_the_tool_turns_as_it_yields():
    """A slot that turns by 90 deg: the force goes on as it is, and turns within some times the displacement.

    The springs are the same in all directions: far from the corner both forces are the same to the feed."""
    path = path_through(
        [[30, 0, -DEPTH], [50, 0, -DEPTH], [50, 20, -DEPTH]], kinds=[Kind.PTP, Kind.LIN, Kind.LIN]
    )
    found = solve(path, block([0, -60, -40], [90, 60, 0]), np.diag([1e-6, 1e-6, 0.0]), FLAT)
    before = found.along(np.array([1]), np.array([1.0]))[0, :2]
    at = np.array([0.0, 0.1, 0.4, 2.0, 10.0])
    after = found.along(np.full(len(at), 2), at / 20)[:, :2]
    cosine = after @ before / np.linalg.norm(before) / np.linalg.norm(after, axis=1)
    turned = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert np.linalg.norm(before) / MM * 1e-6 > 0.05
    assert turned[0] == pytest.approx(0, abs=1e-3)
    assert turned[1] < 70
    assert (np.diff(turned[:4]) > 0).all()
    assert after[-1] == pytest.approx([-before[1], before[0]], rel=0.02)
    assert not len(found.unsettled)


@pytest.mark.parametrize("turn", [0.5, 12.0])
def test_pieces_of_a_motion_that_turns_the_tool_turn_with_it(turn):
    """Each goes on where the one before ends, and the spindle is where the motion has it."""
    ends = np.radians([0.0, turn])
    axes = np.stack([np.zeros(2), np.sin(ends), np.cos(ends)], axis=1)
    path = path_through([[-15, 20, -8], [70, 20, -8]], axes=axes)
    found = solve(path, block([0, 0, -20], [60, 50, 0]), np.zeros((3, 3)), FLAT)
    rows, share = found.pieces.rows, found.pieces.share
    assert len(rows) > 10
    for side in (0, 1):
        angle = np.radians(turn * share[:, side])
        axis = np.stack([np.zeros(len(rows)), np.sin(angle), np.cos(angle)], axis=1)
        assert axes_of(rows, np.full(len(rows), float(side))) == pytest.approx(axis, abs=1e-9)


@pytest.mark.parametrize("compliance", [1e-13, 1e-9, 3e-9])
def test_a_robot_that_hardly_yields_meets_the_nominal_force(compliance):
    """What it is displaced by is settled at once, whatever the force is taken for; the force is the one that is met."""
    path = path_through([[-12, 25, -5], [72, 25, -5]])
    blank = block([0, 0, -20], [60, 50, 0])
    nominal = np.linalg.norm(run(path, blank, FLAT).largest[:, :3], axis=1).max()
    found = solve(path, blank, compliance * np.eye(3), FLAT)
    assert nominal > 100
    assert found.largest == pytest.approx(nominal, rel=2e-3)
    assert np.linalg.norm(found.along(np.array([1]), np.array([0.5]))[0, :3]) == pytest.approx(
        nominal, rel=2e-3
    )
