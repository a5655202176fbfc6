"""The mirror iteration step by step, on a robot whose tool is off in a way that is known in closed form."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from motions import milling_angles
from plant import kr270, random_tools

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import MAX_ITERATIONS, interpolate_pose, mirror
from postproc.model import NOTHING
from postproc.robot.inverse import branch_of

DONE = 1e-8


class Off:
    """A robot whose tool is ``shift`` (N, 3) [m] and ``turn`` (N, 3) [rad] off, and ``rate`` (N,) of what the command
    is moved more; motions are known again by the last axis' turns.  ``rests`` (N,): it has a stable rest."""

    def __init__(self, count, shift, rate, turn=0.0, seed=2):
        rng = np.random.default_rng(seed)
        self.robot = kr270()
        self.near = milling_angles(count, rng)
        self.tool = random_tools(count, rng)
        self.branch = branch_of(self.robot.nominal, self.near)
        self.wanted = self.robot.nominal_chain.flange(self.near) @ self.tool
        self.shift = np.broadcast_to(shift, (count, 3))
        self.turn = np.broadcast_to(turn, (count, 3))
        self.rate, self.rests = np.broadcast_to(rate, count), np.ones(count, bool)
        self.started, self.asked = [], []

    def equilibrium(self, q, wrench, tool, conditions=NOTHING, start=None, *_, **__):
        rows = wrench[:, 0].astype(int)  # the wrench says which motion it is
        self.asked.append(rows.tolist())
        self.started.append(None if start is None else start[:, 0].tolist())
        command = self.robot.nominal_chain.flange(q) @ tool
        more = self.rate[rows, None] * (command.position - self.wanted.position[rows])
        pose = Poses(
            rotation_from_vector(self.turn[rows]) @ command.rotation,
            command.position + self.shift[rows] + more,
        )
        bent = np.tile(rows[:, None] + 0.5, (1, 6))
        return SimpleNamespace(pose=pose, displacement=bent, converged=self.rests[rows])

    def mirror(self, wanted=None, goal=None, **more):
        count = len(self.near)
        wrench = np.zeros((count, 6))
        wrench[:, 0] = np.arange(count)
        wanted = wanted or self.wanted
        return mirror(
            self, wanted, goal or wanted, LoadCase(self.tool, wrench, NOTHING, self.branch, self.near), **more
        )


def path_of(size, rate, turn):
    """Errors of each iteration, and whether the last one is good enough."""
    errors, angles, last = [], [], np.inf
    for step in range(MAX_ITERATIONS + 1):
        errors.append(size * rate**step)
        angles.append(turn if step == 0 else 0.0)
        both = errors[-1] + angles[-1]
        if errors[-1] <= DONE and angles[-1] <= DONE:
            return errors, angles, True
        if not both < 0.5 * last:
            return errors, angles, False
        last = both
    return errors, angles, False


MOTIONS = [
    # shift [m], rate, turn [rad], iterations, settled at the end
    (1e-3, 0.0, 0.0, 1, True),
    (1e-3, 1e-3, 0.0, 2, True),
    (1e-3, 0.4, 0.0, 13, True),
    (1e-3, 0.49, 0.0, 17, True),
    (1e-3, 0.51, 0.0, 1, False),
    (1e-3, 3.0, 0.0, 1, False),
    (1e-3, 0.6, 1e-2, 2, False),
    (0.05, 0.49, 0.0, 20, False),
    (1e-3, 0.0, 1e-3, 1, True),
    (0.9e-8, 0.9, 0.0, 0, True),
    (1.1e-8, 0.4, 0.0, 1, True),
    (0.0, 0.0, 0.9e-8, 0, True),
    (0.0, 0.0, 1.1e-8, 1, True),
    (0.0, 0.0, 0.0, 0, True),
]


@pytest.mark.parametrize("order", [range(14), range(13, -1, -1), [4], [2], [7, 0], [9, 13]], ids=str)
def test_errors_fall_with_the_rate_until_they_are_small_or_do_not_halve(order):
    """e, r e, r^2 e ...; together as each by itself."""
    chosen = [MOTIONS[k] for k in order]
    shift, rate, turn = (np.array([one[k] for one in chosen]) for k in range(3))
    axis, way = np.array([0.6, 0.0, -0.8]), np.array([0.48, 0.64, 0.6])
    problem = Off(len(chosen), np.outer(shift, way), rate, np.outer(turn, axis))
    done = problem.mirror()
    longest = max(one[3] for one in chosen)
    assert done.history.shape == (longest + 1, len(chosen))
    for k, (size, each, angle, iterations, good) in enumerate(chosen):
        errors, angles, ends = path_of(size, each, angle)
        assert len(errors) - 1 == iterations
        assert ends == good
        assert done.iterations[k] == iterations
        np.testing.assert_allclose(done.history[: iterations + 1, k], errors, atol=1e-12)
        assert np.isnan(done.history[iterations + 1 :, k]).all()
        assert done.error[k] == pytest.approx(errors[-1], abs=1e-12)
        assert done.angle[k] == pytest.approx(angles[-1], abs=1e-12)
        assert (done.converged[k], done.reachable[k], done.settled[k]) == (good, True, True)
        # where it stopped: the sum of what was taken off
        moved = -sum((-1) ** i * errors[i] for i in range(iterations)) * way
        np.testing.assert_allclose(
            done.command.position[k], problem.wanted.position[k] + moved, rtol=0, atol=1e-12
        )
        back = rotation_from_vector((0.0 if iterations == 0 else -angle) * axis)
        np.testing.assert_allclose(done.command.rotation[k], back @ problem.wanted.rotation[k], atol=1e-12)
    flange = problem.robot.nominal_chain.flange(done.q) @ problem.tool
    np.testing.assert_allclose(flange.position, done.command.position, atol=1e-12)


def test_only_those_that_are_not_done_go_on():
    """With the displacements that they had before."""
    rates = np.array([0.08, 0.0, 0.08, 0.0, 0.3])
    problem = Off(5, [1e-4, 0.0, 0.0], rates)
    assert problem.mirror().iterations.tolist() == [4, 1, 4, 1, 8]
    every = [0, 1, 2, 3, 4]
    assert problem.asked == [every] * 2 + [[0, 2, 4]] * 3 + [[4]] * 4
    bent = [[row + 0.5 for row in rows] for rows in problem.asked]
    assert problem.started == [None, *bent[1:]]


def test_what_is_out_of_reach_or_has_no_rest_goes_nowhere():
    problem = Off(5, [1e-4, 0.0, 0.0], 0.08)
    problem.rests = np.array([True, False, True, True, False])
    position = problem.wanted.position.copy()
    position[[2, 4]] += [9.0, 0.0, 0.0]
    wanted = Poses(problem.wanted.rotation, position)
    done = problem.mirror(wanted)
    assert done.reachable.tolist() == [True, True, False, True, False]
    assert done.settled.tolist() == [
        True,
        False,
        True,
        True,
        True,
    ]  # nothing is known where it does not come to
    assert done.converged.tolist() == [True, False, False, True, False]
    assert done.iterations.tolist() == [4, 0, 0, 4, 0]
    for row in (1, 2, 4):
        np.testing.assert_array_equal(done.command.position[row], position[row])
        np.testing.assert_array_equal(done.command.rotation[row], wanted.rotation[row])


def test_a_goal_beside_the_wanted_pose_is_where_the_tool_comes_to():
    problem = Off(3, [1e-4, 2e-4, 0.0], 0.0, [1e-3, 0.0, 2e-3])
    turn, shift = rotation_from_vector([0.0, 2e-3, 0.0]), np.array([0.0, 0.0, 5e-4])
    goal = Poses(turn @ problem.wanted.rotation, problem.wanted.position + shift)
    done = problem.mirror(goal=goal)
    assert done.converged.all()
    np.testing.assert_allclose(
        done.command.position, problem.wanted.position + shift - problem.shift, atol=1e-9
    )
    off = rotation_from_vector(problem.turn)
    np.testing.assert_allclose(off @ done.command.rotation, goal.rotation, atol=2e-8)


def test_of_an_orientation_only_what_can_be_corrected_is():
    """All of it, nothing, or what is across an axis; the rest is not judged either."""
    across = np.eye(3) - np.outer([0.0, 0.6, 0.8], [0.0, 0.6, 0.8])
    turns = np.array([np.eye(3), np.zeros((3, 3)), across])
    turn = np.array([1e-3, 2e-3, -1e-3])
    problem = Off(3, [1e-4, 0.0, 0.0], 0.0, turn)
    done = problem.mirror(orientation_projection=turns)
    assert done.converged.all()
    for k in range(3):
        expected = rotation_from_vector(-turns[k] @ turn) @ problem.wanted.rotation[k]
        np.testing.assert_allclose(done.command.rotation[k], expected, atol=5e-6)
    np.testing.assert_array_equal(done.command.rotation[1], problem.wanted.rotation[1])
    assert done.angle.max() < 1e-8
    # rows that go on later have their own
    problem = Off(3, [1e-4, 0.0, 0.0], np.array([0.0, 0.3, 0.3]), turn)
    done = problem.mirror(orientation_projection=turns)
    np.testing.assert_array_equal(done.command.rotation[1], problem.wanted.rotation[1])
    assert done.iterations.tolist() == [1, 8, 8]


def test_a_begin_is_where_the_first_prediction_is_made():
    problem = Off(3, [1e-4, 0.0, 0.0], 0.0)
    position = problem.wanted.position - problem.shift
    position[1] += [0.0, 3e-4, 0.0]
    begin = Poses(problem.wanted.rotation.copy(), position.copy())
    bent = np.tile(np.array([[7.0], [8.0], [9.0]]), (1, 6))
    done = problem.mirror(guess=(begin, bent))
    assert done.iterations.tolist() == [0, 1, 0]
    np.testing.assert_allclose(done.history[0], [0.0, 3e-4, 0.0], atol=1e-12)
    np.testing.assert_array_equal(begin.position, position)  # it is not changed
    assert problem.started == [[7.0, 8.0, 9.0], [1.5]]
    assert done.converged.all()


def test_nothing_to_correct_is_corrected():
    done = Off(0, [0.0, 0.0, 0.0], 0.0).mirror()
    assert len(done.command) == 0
    assert done.history.shape == (1, 0)


def test_the_share_of_all_is_all():
    rng = np.random.default_rng(6)
    one, other = (
        Poses(rotation_from_vector(rng.normal(size=(3, 3))), rng.normal(size=(3, 3))) for _ in range(2)
    )
    assert interpolate_pose(one, other, 1.0) is other
    each = interpolate_pose(one, other, np.array([[0.0], [1.0], [0.5]]))
    np.testing.assert_allclose(each.position[0], one.position[0])
    np.testing.assert_allclose(each.position[1], other.position[1])
    np.testing.assert_allclose(each.rotation[1], other.rotation[1], atol=1e-12)
    np.testing.assert_allclose(each.position[2], 0.5 * (one.position[2] + other.position[2]))
    half = interpolate_pose(one, other, 0.5)
    np.testing.assert_allclose(half.position[2], each.position[2])
    np.testing.assert_allclose(half.rotation[2], each.rotation[2])
