"""The uncertainty of the force's direction and components, of touched-off bases, and the bound of the largest error."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from plant import SOFTER, with_compensator
from scipy.spatial.transform import Rotation
from test_expanded_uncertainty import (
    WITHIN,
    covariance_of,
    deviations,
    drawn,
    every,
    job,
    paper,
    restated,
    spread_of,
    valued,
)

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.units import DEG
from postproc.cell import ForceVectorInterval
from postproc.compensation.correct import correct
from postproc.compensation.input_sensitivities import error_sensitivities, sensitivities
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import predict
from postproc.compensation.touched_off import TouchedOff, rigid_motion
from postproc.compensation.uncertain_inputs import (
    COMPONENTS,
    DIRECTION,
    FORCE,
    TURNS,
    UncertainInput,
    input_uncertainties,
)
from postproc.compensation.uncertainty import Uncertainty, evaluate_uncertainty
from postproc.compensation.uncertainty_propagation import (
    covariances,
    expanded_uncertainty,
    expanded_uncertainty_of_largest,
)
from postproc.model import NOTHING
from postproc.report.program_verdict import verdict_sentence
from postproc.report.report import Report, Spread
from postproc.robot.description import COVERAGE

DIRECTED = ForceVectorInterval(direction=10 * DEG)
ADDED = ForceVectorInterval(components=np.array([20.0, 5.0, 40.0]))


def turned_base(task):
    """The task with a programmed base whose axes are not those of the robot."""
    n = len(task.wanted)
    return replace(
        task,
        base=Poses(np.tile(rotation_from_vector([0.4, -0.7, 1.1]), (n, 1, 1)), task.base.position),
    )


def loaded(task, command, wrench):
    q = predict(
        task.model, command, LoadCase(task.tool, wrench, NOTHING, task.track.branch, task.track.q)
    ).q  # the motors do not depend on the force
    return task.model.equilibrium(q, wrench, task.tool).pose.position


# direction and components


@pytest.mark.slow
def test_direction_moves_the_tool_as_forces_that_are_drawn_about_the_stated_one():
    task = turned_base(job(every(paper(), 0.0)))
    result = correct(task)
    known = input_uncertainties(task.model, None, True, DIRECTED)
    assert [e.name for e in known.entries if e.deviation] == [DIRECTION, DIRECTION]
    spread = spread_of(task, result.command[:], known)[1]
    rng, errors = np.random.default_rng(2), []
    force = task.wrench[:, :3]
    unit = force / np.linalg.norm(force, axis=1, keepdims=True)
    for _ in range(2000):
        turn = rng.normal(size=force.shape) * 10 * DEG / 1.96
        turn -= np.sum(turn * unit, axis=1, keepdims=True) * unit  # across each force, isotropic
        wrench = np.hstack([Rotation.from_rotvec(turn).apply(force.copy()), task.wrench[:, 3:]])
        errors.append(loaded(task, result.command[:], wrench))
    seen = covariance_of(np.array(errors))
    trace = np.trace(spread, axis1=1, axis2=2)
    np.testing.assert_allclose(np.trace(seen, axis1=1, axis2=2), trace, rtol=2 * WITHIN)
    assert (np.abs(seen - spread).max(axis=(1, 2)) < 2 * WITHIN * trace).all()


def test_components_are_forces_along_the_axes_of_the_programmed_base():
    task = turned_base(job(every(paper(), 0.0)))
    task = replace(
        task,
        force=replace(task.force, values=np.where(np.arange(10)[:, None] == 4, 0.0, task.wrench)),
    )
    result = correct(task)
    known = input_uncertainties(task.model, None, True, ADDED)
    assert [e.name for e in known.entries if e.deviation] == list(COMPONENTS)
    assert FORCE not in [entry.name for entry in known.without_interval]
    _, moves = error_sensitivities(task, known.entries, np.arange(10), result.command[:])
    for k in range(3):
        more = task.wrench.copy()
        more[:, :3] += task.base.rotation[:, :, k]
        step = loaded(task, result.command[:], more) - loaded(task, result.command[:], task.wrench)
        step[4] = 0.0  # where nothing touches the tool no force is added
        np.testing.assert_allclose(moves[:, :, len(moves[0, 0]) - 3 + k], step, rtol=2e-3, atol=1e-9)


def test_turns_of_a_force_change_it_across_itself():
    """One turn lifts the force, the other swings it sideways: what they add to it is read from what they move."""
    rng = np.random.default_rng(3)
    force = np.vstack([rng.normal(size=(5, 3)), [[0, 0, 3.0], [0, 0, -3.0], [0, 0, 0]]])
    task, count = job(paper(), len(force)), len(force)
    wrench = np.concatenate([100.0 * force, np.zeros((count, 3))], axis=1)
    figures = [UncertainInput(name, -1, name, 0.0, -np.inf, np.inf, 0.01) for name in (*TURNS, *COMPONENTS)]
    axes = np.tile(np.eye(3), (count, 1, 1))
    moves = sensitivities(task.model, figures, task.track.q, wrench, task.tool, axes=axes)
    assert not moves[7].any()  # no force, nothing to turn
    added = np.linalg.solve(moves[:7, :, 2:], moves[:7, :, :2]) / 100.0  # (7, 3, 2) [N/rad]
    lifts, swings = added[:, :, 0], added[:, :, 1]
    size = np.linalg.norm(force[:7], axis=1)
    for change in (lifts, swings):
        np.testing.assert_allclose(np.linalg.norm(change, axis=1), size, rtol=1e-3)
        np.testing.assert_allclose(np.sum(change * force[:7], axis=1), 0.0, atol=1e-3 * size.max() ** 2)
    np.testing.assert_allclose(np.sum(lifts * swings, axis=1), 0.0, atol=1e-3 * size.max() ** 2)
    np.testing.assert_allclose(swings[:5, 2], 0.0, atol=1e-3 * size.max())
    assert (lifts[:5, 2] > 0).all()


def test_direction_counts_once_in_the_budget_beside_the_scale():
    task = job(every(paper(), 0.01), 6)
    result = correct(task)
    told = evaluate_uncertainty(task, result, 0.2, DIRECTED)
    names = [name for name, _ in told.budget]
    assert names.count(DIRECTION) == 1
    assert sum(share for _, share in told.budget) == pytest.approx(1.0)
    alone = evaluate_uncertainty(task, result, 0.2)
    assert told.after > alone.after
    # before, a turn of the force moves the tool mostly across its error, the scale along it
    assert told.before < 1.5 * alone.before
    assert evaluate_uncertainty(task, result, 0.2, ForceVectorInterval()).after == alone.after
    # only the direction is stated: of the scale nothing is known
    told = evaluate_uncertainty(task, result, None, DIRECTED)
    assert [name for name, _ in told.effect_of_10_percent] == [FORCE]


def test_ten_degrees_leave_what_ten_degrees_do():
    """A force that is 10 deg off moves the tool by about sin(10 deg) of the deflection."""
    task = job(every(paper(), 0.0), 10)
    result = correct(task)
    told = evaluate_uncertainty(task, result, 0.0, DIRECTED)
    assert 0.1 < told.after / result.before.max() < 0.5


# the bound of the largest error


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "process", "force"),
    [
        (paper(), True, 0.0),
        (every(paper(), 0.1), True, 0.2 / 1.96),
        (every(with_compensator(paper(), **SOFTER), 0.02), False, 0.0),
    ],
    ids=["paper", "every 10 % with force", "acting balancer, absolute"],
)
def test_the_bound_holds_for_95_of_100_robots(monkeypatch, model, process, force):
    """500 robots, drawn from the stated intervals and solved anew: 95 % of them, within three standard errors."""
    import test_expanded_uncertainty

    monkeypatch.setattr(test_expanded_uncertainty, "DRAWS", 500)
    task = job(model, 12, process=process, seed=6)
    result = correct(task)
    ci95 = COVERAGE * force if force else None
    known = input_uncertainties(model, ci95, True)
    names = [entry.name for entry in known.entries if entry.name != FORCE]
    _, after = drawn(task, result.command[:], names, deviations(known), force)
    told = evaluate_uncertainty(task, result, ci95)
    share = np.mean(np.linalg.norm(after, axis=2).max(axis=1) <= result.after.max() + told.after)
    assert abs(share - 0.95) < 3 * np.sqrt(0.95 * 0.05 / 500)


def test_the_largest_of_many_motions_exceeds_the_bound_of_one():
    """Motions that have nothing to do with each other: the largest of M lengths, exactly."""
    count, nothing = 20, np.zeros((20, 3))
    moves = np.zeros((count, 3, count))
    moves[np.arange(count), 0, np.arange(count)] = 1e-4
    found = expanded_uncertainty_of_largest(nothing, moves, np.eye(count))
    # P(all |z| <= b) = 0.95
    from scipy.stats import norm

    exact = 1e-4 * norm.ppf(0.5 + 0.5 * 0.95 ** (1 / count))
    assert found == pytest.approx(exact, rel=0.015)
    one = expanded_uncertainty(nothing, covariances(moves, np.eye(count))).max()
    assert found > 1.5 * one


def test_one_figure_alone_gives_its_own_quantile():
    rng = np.random.default_rng(4)
    moves = rng.normal(size=(50, 3, 1)) * 1e-4
    size = np.linalg.norm(moves[:, :, 0], axis=1).max()
    found = expanded_uncertainty_of_largest(np.zeros((50, 3)), moves, np.array([[4.0]]))
    assert found == pytest.approx(1.96 * 2 * size, rel=2e-3)
    # of an error that stands clear of it: along its direction, to both sides
    error = np.zeros((50, 3))
    error[7] = 100 * moves[7, :, 0]
    own = np.linalg.norm(moves[7])
    assert expanded_uncertainty_of_largest(error, moves, np.array([[4.0]])) == pytest.approx(
        1.96 * 2 * own, rel=2e-3
    )
    assert expanded_uncertainty_of_largest(error, 0 * moves, np.array([[4.0]])) == 0.0


def test_correlated_figures_count_as_such():
    """Two figures that cancel each other do nothing."""
    moves = np.ones((3, 3, 2)) * 1e-4
    against, along = (np.array([[1.0, r], [r, 1.0]]) for r in (-1.0, 1.0))
    assert expanded_uncertainty_of_largest(np.zeros((3, 3)), moves, against) == pytest.approx(0.0, abs=1e-11)
    found = expanded_uncertainty_of_largest(np.zeros((3, 3)), moves, along)
    assert found == pytest.approx(1.96 * 2 * np.sqrt(3) * 1e-4, rel=2e-3)


# touched-off bases


def touched(task, points):
    """The task with its base touched off at ``points`` (K, 3) [m], robot base axes."""
    row = np.zeros(len(points), int)
    wanted = Poses(task.wanted.rotation[row], points)
    tool = task.tool[row]
    seen = TouchedOff.of(task.model, task.track, task.conditions, 0 * row, row, wanted, tool, 2)
    return replace(task, process=False, touched_off=seen)


@pytest.mark.sample(1)
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_a_touched_off_base_moves_with_the_robot_that_touched_it(count):
    """A robot with other parameters touches the points elsewhere, and with them stands the part."""
    model = every(with_compensator(paper(), **SOFTER), 0.05)
    task = job(model, 6)
    middle = task.wanted.position.mean(axis=0)
    task = touched(task, middle + np.random.default_rng(count).uniform(-0.4, 0.4, (count, 3)))
    result = correct(task)
    known = input_uncertainties(model, 0.1, True)
    error, moves = error_sensitivities(task, known.entries, np.arange(6), result.command[:])
    assert np.linalg.norm(error, axis=1).max() < 2e-8

    def seen(model, scale=1.0):
        q = predict(
            task.model,
            result.command[:],
            LoadCase(task.tool, task.wrench, NOTHING, task.track.branch, task.track.q),
        ).q
        tool = model.equilibrium(q, scale * task.wrench, task.tool).pose.position
        points = task.touched_off
        there = model.equilibrium(points.real.q, np.zeros((count, 6)), points.tool).pose.position
        part = rigid_motion(points.wanted.position, there) @ task.wanted
        return tool - part.position

    for column, entry in enumerate(known.entries):
        step = 0.2 * entry.deviation
        if not step:
            continue
        if entry.name == FORCE:
            moved = (seen(model, 1 + step) - seen(model, 1 - step)) / (2 * step)
        else:
            name = entry.name.split(".")[1]
            ends = [seen(valued(model, **{name: entry.value + sign * step})) for sign in (1, -1)]
            moved = (ends[0] - ends[1]) / (2 * step)
        size = np.abs(moved).max()
        np.testing.assert_allclose(moves[:, :, column], moved, rtol=0.02, atol=0.005 * size)


def test_a_base_that_was_touched_off_is_surer_than_one_that_was_not():
    model = restated(every(with_compensator(paper(), **SOFTER), 0.0), s0=0.02)  # a static torque
    task = job(model, 6)
    middle = task.wanted.position.mean(axis=0)
    task = touched(task, middle + np.array([[-0.4, 0, 0], [0.4, 0, 0.1], [0, 0.5, 0], [0, -0.3, 0.2]]))
    told = evaluate_uncertainty(task, correct(task), 0.0)
    outside = replace(task, touched_off=None)
    assert told.after < 0.5 * evaluate_uncertainty(outside, correct(outside), 0.0).after


def test_air_in_a_base_that_was_not_touched_stays():
    model = with_compensator(paper(), **SOFTER)
    task = job(model, 4)
    task = touched(task, task.wanted.position[:1])
    other = task.toolpath.with_columns(base=np.array([0, 1, 0, 1]))
    task = replace(task, toolpath=other)
    rows = np.arange(4)
    still = predict(
        model, task.wanted, LoadCase(task.tool, np.zeros((4, 6)), NOTHING, task.track.branch, task.track.q)
    ).pose
    goal = task.goal(rows, task.wanted)
    np.testing.assert_allclose(goal.position[1::2], still.position[1::2], atol=1e-9)
    np.testing.assert_allclose(
        goal.position[::2], task.wanted.position[::2] + task.touched_off.motion.position[0], atol=1e-12
    )
    np.testing.assert_allclose(still.position[0], goal.position[0], atol=1e-9)  # the point itself
    assert np.linalg.norm(goal.position[2] - still.position[2]) > 1e-5


# verdict


def report(after, width=0.0, before=1e-3, **change):
    """A report with an error ``after`` and the half ``width`` of its interval [m]."""
    keys = {
        "after": None if after is None else Spread(after, after, after),
        "path_error": Spread(np.nan, np.nan, np.nan),
        "corrected": 3,
        "findings": (),
        "tolerance": 2e-5,
        "uncertainty": Uncertainty(
            np.arange(3), 2, (), 0, before, width, budget=(("a.x", 0.7), (FORCE, 0.3))
        ),
    }
    fields = dict.fromkeys(Report.__dataclass_fields__, None)
    return Report(**{**fields, **keys, **change})


MISSING = (("b.y", 3e-4), (FORCE, 2e-4), ("b.z", 1e-6))


@pytest.mark.parametrize(
    ("made", "word", "sentence"),
    [
        (report(None), None, ""),
        (report(1e-6, corrected=0), "not_corrected", "not corrected"),
        (
            report(1e-6, 1e-5),
            "within_tolerance",
            "within tolerance: error 0.0010 mm and uncertainty 0.010 mm, tolerance 0.02 mm",
        ),
        (
            report(1e-6, 1.5e-3),
            "uncertain",
            "corrected, but uncertainty 1.5 mm exceeds the tolerance 0.02 mm: measure a.x or the force",
        ),
        (
            report(1.5e-5, 1e-5),
            "uncertain",
            "corrected, but error 0.015 mm and uncertainty 0.010 mm together exceed the tolerance 0.02 mm: measure"
            " a.x or the force",
        ),
        (report(2.1e-5), "needs_review", "needs review: error 0.021 mm exceeds the tolerance 0.02 mm"),
        (
            report(1e-6, path_error=Spread(4e-5, 0, 0)),
            "needs_review",
            "needs review: error 0.040 mm exceeds the tolerance 0.02 mm",
        ),
        (
            report(1e-6, findings=(SimpleNamespace(severity="info"), SimpleNamespace(severity="warning"))),
            "needs_review",
            "needs review: 1 finding",
        ),
        (
            report(
                1e-6,
                uncertainty=Uncertainty(np.arange(3), 2, (), 0, 1e-4, 1e-5, effect_of_10_percent=MISSING),
            ),
            "uncertain",
            "corrected, but the uncertainty is not known: measure b.y or the force",
        ),
        (
            report(1e-6, uncertainty=Uncertainty(np.arange(3), 0, (), 0, effect_of_10_percent=MISSING[1:])),
            "uncertain",
            "corrected, but the uncertainty is not known: measure the force",
        ),
    ],
)
def test_the_verdict_compares_error_and_uncertainty_with_the_tolerance(made, word, sentence):
    assert made.verdict == word
    assert verdict_sentence(made) == sentence


def test_what_is_worth_measuring():
    blame = ((DIRECTION, 0.5), (FORCE, 0.3), ("a.x", 0.2))
    stated = Uncertainty(np.arange(1), 3, (), 0, 1e-3, 1e-3, budget=blame)

    def sentence(**change):
        return verdict_sentence(report(1e-6, uncertainty=replace(stated, **change)))

    exceeds = "exceeds the tolerance 0.02 mm: measure the force or a.x"
    assert sentence() == f"corrected, but uncertainty 1.0 mm {exceeds}"
    # what has no interval does less than what is stated
    small = (("b.y", 1e-6),)
    assert not replace(stated, effect_of_10_percent=small).unknown
    assert sentence(effect_of_10_percent=small) == f"corrected, but uncertainty at least 1.0 mm {exceeds}"
    assert sentence(effect_of_10_percent=small, after=1e-5) == (
        "corrected, but the uncertainty, at least 0.010 mm, is not known in full: measure b.y"
    )
    assert replace(stated, effect_of_10_percent=(("b.y", 2e-3),)).unknown
