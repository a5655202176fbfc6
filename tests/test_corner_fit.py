"""Approximated corners: fitted, left as they were where that is no better, and never silent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import task
from scipy.spatial.transform import Rotation

from postproc.base.geometry import Poses
from postproc.compensation import corner_fit
from postproc.compensation.corner_fit import corners_not_improved, fit_corners
from postproc.compensation.corners import compare_corners, evaluate_corners, rounded_errors
from postproc.compensation.correct import correct
from postproc.compensation.path_comparison import evaluate_transitions
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.ramp_points import NEVER
from postproc.compensation.ramped_forces import add_force_ramps
from postproc.compensation.rounded_path import RoundedOutput, original
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, Subdivision
from postproc.toolpath import EditConstraints, Kind, Role

FREE = Limits(max_growth=100.0, ramp_end=0.5e-3)
ALONG = np.array([100.0, 250.0, 50.0])


def two_sides(
    distance: float, turn: float, second: np.ndarray = ALONG, **words: object
) -> CompensationProblem:
    """Two motions under force that meet under ``turn`` [rad], approximated from ``distance`` [m] on, after one in air;
    the force goes over from ``ALONG`` to ``second`` on 5 mm."""
    corner = np.array([1.6, -0.1, 0.5])
    points = [
        corner - [0.1, 0.0, -0.05],
        corner - [0.1, 0.0, 0.0],
        corner,
        corner + 0.1 * np.array([np.cos(turn), np.sin(turn), 0.0]),
    ]
    wrench = np.zeros((4, 6))
    wrench[2, :3], wrench[3, :3] = ALONG, second
    job = task(
        points,
        [False, False, True, True],
        wrench=wrench,
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN],
        approximation=np.array([0.0, 0.0, distance, distance]),
        **words,
    )
    stepped = replace(job, force=replace(job.force, steps=np.array([False, False, True, True])))
    return add_force_ramps(stepped, 5e-3)


def square(distance: float, **words: object) -> CompensationProblem:
    turned = Rotation.from_rotvec([0.0, 0.0, np.pi / 2]).apply(ALONG)
    return two_sides(distance, np.pi / 2, turned, **words)


def worst(job: CompensationProblem, result: object, division: Subdivision) -> float:
    return float(compare_corners(job, result, division).difference.max())  # type: ignore[arg-type]


def nearest(job: CompensationProblem, division: Subdivision, distance: float, turn: float) -> float:
    """[m] Largest distance of the deflected tool from the rounded original around the corner, by brute force: both
    curves drawn point by point, the force of the place looked for among all of them."""
    commands = division.command[np.arange(len(division))].position
    rotation = division.command[np.arange(len(division))].rotation

    def drawn(points: np.ndarray, count: int) -> np.ndarray:
        """Lines and parabolas through the control points (K, 3), each rounded from ``distance`` on."""
        length = np.linalg.norm(np.diff(points, axis=0), axis=1)
        reach = np.minimum(distance, 0.5 * np.minimum(length[:-1], length[1:]))
        t = np.linspace(0, 1, count)[:, None]
        ways = []
        for k, d in enumerate(reach):
            p, q, r = points[k : k + 3]
            a, b = q - d * (q - p) / length[k], q + d * (r - q) / length[k + 1]
            ways.append((1 - t) ** 2 * a + 2 * t * (1 - t) * q + t**2 * b)
        return np.concatenate(ways)

    corner, side = job.wanted[2].position, np.array([np.cos(turn), np.sin(turn), 0.0])
    s = np.linspace(-12e-3, 12e-3, 12001)
    before, after = s[:, None] * [1.0, 0.0, 0.0], s[:, None] * side
    u = ((s + distance) / (2 * distance))[:, None]
    curve = (1 - u) ** 2 * [-distance, 0, 0] + u**2 * distance * side
    place = corner + np.where(s[:, None] <= -distance, before, np.where(s[:, None] >= distance, after, curve))

    source = division.source
    path = drawn(commands[source >= 1], 41)
    path = path[np.linalg.norm(path - corner, axis=1) < 8e-3]
    row = np.where(s < 0, 2, 3)
    share = np.where(s < 0, 1.0 + s / 0.1, s / 0.1)
    # the deflection hardly depends on where exactly the command is: where it nearly cancels itself
    turned = rotation[np.flatnonzero(source == 2)[-1]]
    some = np.arange(0, len(s), 100)
    at, moved = place[some], np.zeros((len(some), 3))
    for _ in range(2):
        pose = Poses(np.tile(turned, (len(some), 1, 1)), at - moved)
        wrench = job.force.along(row[some], share[some])
        moved = job.simulated(row[some], pose, wrench, share=share[some]).pose.position - pose.position
    shift = np.stack([np.interp(s, s[some], moved[:, k]) for k in range(3)], axis=1)
    # the place that the tool is nearest to, under the force of that place
    largest = 0.0
    for one in path:
        away = one + shift - place
        tangent = np.gradient(place, axis=0)
        gap = (away * tangent).sum(axis=1)
        at = np.flatnonzero((gap[:-1] > 0) & (gap[1:] <= 0))
        if len(at):
            largest = max(largest, float(np.linalg.norm(away[at], axis=1).min()))
    return largest


@pytest.mark.slow
@pytest.mark.parametrize("distance", [0.5e-3, 2e-3])
def test_a_fitted_corner_follows_the_original(distance: float) -> None:
    job = square(distance)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    fitted, division = fit_corners(job, result, plain, FREE)
    before, after = worst(job, result, plain), worst(job, fitted, division)
    assert before > job.tolerance
    assert after < job.tolerance
    # by brute force: the same figures
    assert nearest(job, plain, distance, np.pi / 2) == pytest.approx(before, rel=0.05, abs=1e-6)
    most_after = max(after, float(rounded_errors(job, fitted, division)[1].max()))
    assert nearest(job, division, distance, np.pi / 2) == pytest.approx(most_after, rel=0.05, abs=1e-6)
    moves = evaluate_transitions(job, fitted, division)
    assert (moves.stops, moves.backwards) == (0, 0)
    steps = np.diff(division.share + division.source)
    assert (steps > 0).all()


def test_a_fitted_corner_changes_its_correction_as_fast_as_its_force_asks() -> None:
    """Fitted points lie beside the path that the tool goes: their distances say nothing of it."""
    job = square(0.5e-3)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    fitted, division = fit_corners(job, result, plain, FREE)
    assert division.fits is not None
    assert len(division.fits.point)
    ramp = np.linspace(0.0, 0.05, 201)  # 5 mm of 100
    rows, wanted = np.full(201, 3), job.desired_path.at(np.full(201, 3), ramp)
    goal = job.goal(rows, wanted, ramp)
    command = job.command(rows, wanted, job.force.along(rows, ramp), goal, share=ramp).command.position
    steps = np.linalg.norm(np.diff(command - wanted.position, axis=0), axis=1)
    fastest = steps.max() / (5e-3 / 200)
    assert fastest > 0.1
    moves = evaluate_transitions(job, fitted, division)
    assert moves.rate == pytest.approx(fastest, rel=0.02)


def test_corners_are_fitted_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    """In whatever blocks: a zigzag of several corners has the same points with one of them in a block."""
    sides = np.array([[0.0, 0.1, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]])
    points = [
        np.array([1.5, -0.2, 0.55]),
        *(np.array([1.5, -0.2, 0.5]) + np.cumsum([0.0 * sides[0], *sides], axis=0)),
    ]
    wrench = np.zeros((5, 6))
    wrench[2:, :3] = [Rotation.from_rotvec([0.0, 0.0, k % 2 * np.pi / 2]).apply(ALONG) for k in range(3)]
    on = np.arange(5) >= 2
    job = task(
        points,
        on.tolist(),
        wrench=wrench,
        kind=[Kind.PTP] + [Kind.LIN] * 4,
        approximation=np.where(on, 0.5e-3, 0.0),
    )
    job = add_force_ramps(replace(job, force=replace(job.force, steps=on)), 5e-3)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    together = fit_corners(job, result, plain, FREE)[1]
    monkeypatch.setattr(corner_fit, "BLOCK", 1)
    alone = fit_corners(job, result, plain, FREE)[1]
    assert together.fits is not None
    assert len(np.unique(together.source[together.fits.point])) > 1
    np.testing.assert_array_equal(alone.source, together.source)
    np.testing.assert_allclose(alone.command.position, together.command.position, atol=1e-9)


def test_straight_on_where_the_force_steps_there_is_a_corner() -> None:
    """The program does not turn; its correction does."""
    job = two_sides(0.5e-3, 0.0, 1.5 * ALONG)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    found = compare_corners(job, result, plain)
    assert 2 in found.row.tolist()
    assert found.difference[found.row == 2].max() > job.tolerance
    assert nearest(job, plain, 0.5e-3, 0.0) == pytest.approx(found.difference.max(), rel=0.05)
    assert worst(job, *fit_corners(job, result, plain, FREE)) < job.tolerance


@pytest.mark.parametrize("at", [-0.8, -0.4, 0.4, 0.8])
def test_a_corner_is_evaluated_before_and_after_its_point(at: float) -> None:
    """At a share of the reach: on the motion that ends there, or on the next one."""
    job = square(2e-3)
    division = subdivide(job, correct(job), FREE)
    motion = np.flatnonzero((division.source == 2) & (division.role == Role.ORIGINAL))
    output = RoundedOutput(job, division, motion)
    reach, off, _ = evaluate_corners(output, motion, np.array([at]))
    segment = output.place(motion) + (at > 0)
    away = abs(at) * reach / output.extent[segment]
    expected = output.deviations(segment, away if at > 0 else 1.0 - away).shift
    assert np.linalg.norm(expected) > 1e-7
    np.testing.assert_allclose(off, np.linalg.norm(expected, axis=1), rtol=1e-6)


@pytest.mark.parametrize("at", [-0.7, 0.0, 0.6])
def test_a_deviation_is_across_the_path_where_it_is_taken(at: float) -> None:
    """Under the force of that place the tool is neither ahead of it nor short of it."""
    job = square(2e-3)
    division = subdivide(job, correct(job), FREE)
    motion = np.flatnonzero((division.source == 2) & (division.role == Role.ORIGINAL))
    output = RoundedOutput(job, division, motion)
    segment = output.place(motion) + (at > 0)
    away = abs(at) * output.reach[output.place(motion)] / output.extent[segment]
    share = away if at > 0 else 1.0 - away
    found = output.deviations(segment, share)
    wanted, tangent = original(job, found.row, found.share)
    force = job.force.along(found.row, found.share)
    command = output.commands(output.blend(segment, share))
    real = job.simulated(found.row, command, force, share=found.share, corrected=True)
    shift, _ = job.visible_errors(found.row, real.pose, job.goal(found.row, wanted, found.share))
    assert np.abs(np.sum(shift * tangent, axis=1)).max() < 2e-8  # [m]
    np.testing.assert_allclose(found.shift, shift, atol=2e-8)


def test_an_exact_point_is_no_rounded_corner() -> None:
    """It has neither reach nor error; the corner after it has both, of the position and of the orientation."""
    job = square(2e-3)
    division = subdivide(job, correct(job), FREE)
    motion = np.flatnonzero(division.original & np.isin(division.source, [1, 2]))
    found = np.stack(evaluate_corners(RoundedOutput(job, division, motion), motion))
    assert found.shape == (3, 2)
    assert (found[:, 0] == 0).all()
    assert (found[:, 1] > 0).all()


def test_what_is_inserted_keeps_the_shortest_length() -> None:
    job = square(2e-3)
    limits = replace(FREE, ramp_end=0.8e-3)
    result = correct(job)
    _, division = fit_corners(job, result, subdivide(job, result, limits), limits)
    inner = np.flatnonzero(division.role == Role.INTERMEDIATE)
    assert len(inner) > 1
    place = division.command[np.arange(len(division))].position
    assert np.linalg.norm(place[inner] - place[inner - 1], axis=1).min() > 0.799e-3


@pytest.mark.slow
def test_without_insertions_no_corner_is_worse() -> None:
    job = square(0.5e-3)
    limits = Limits(no_insert=True)
    result = correct(job)
    plain = subdivide(job, result, limits)
    fitted, division = fit_corners(job, result, plain, limits)
    assert len(division) == len(plain)
    assert worst(job, fitted, division) <= worst(job, result, plain)
    locked = replace(
        job, toolpath=replace(job.toolpath, constraints=EditConstraints(no_insert_before={2: "", 3: ""}))
    )
    assert len(fit_corners(locked, result, plain, FREE)[1]) == len(plain)


@pytest.mark.parametrize("why", ["gain", "plain", "unknown", "good"])
def test_a_corner_stays_as_it_was(why: str) -> None:
    job = square(0.5e-3)
    if why == "gain":
        job = replace(job, gain=0.5)
    elif why == "unknown":
        job = replace(job, toolpath=job.toolpath.with_columns(approximation=np.full(4, np.nan)))
    elif why == "good":
        job = replace(job, tolerance=1e-3)
    result = correct(job)
    plain = subdivide(job, result, FREE)
    known = {(int(plain.source[m]), float(plain.share[m])) for m in range(len(plain))}
    fitted, division = fit_corners(
        job, result, plain, FREE, dict.fromkeys(known, NEVER) if why == "plain" else {}
    )
    assert division is plain
    assert fitted is result


def test_a_corner_that_is_written_otherwise_is_known() -> None:
    job = square(0.5e-3)
    result = correct(job)
    fitted, division = fit_corners(job, result, subdivide(job, result, FREE), FREE)
    del fitted
    blend = np.full(len(division), 0.5e-3)
    assert not corners_not_improved(job, replace(division, blend=blend))
    point = division.fits.point  # type: ignore[union-attr]
    command = division.command[np.arange(len(division))].copy()
    command.position[point] += [0.0, 0.0, 0.3e-3]
    assert corners_not_improved(job, replace(division, blend=blend, command=command))
    assert (2, 1.0) in corners_not_improved(job, replace(division, blend=np.full(len(division), np.nan)))
