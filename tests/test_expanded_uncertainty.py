"""The doubt of a prediction: linear propagation against drawn robots, what is left out, and how it is told."""

import re
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
import yaml
from conftest import CELL
from motions import milling_angles, motions
from plant import SOFTER, kr270, random_tools, random_wrenches, with_compensator

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, rotation_from_vector
from postproc.cell import load_cell
from postproc.compensation import uncertain_inputs
from postproc.compensation import uncertainty as doubt
from postproc.compensation.correct import correct
from postproc.compensation.input_sensitivities import error_sensitivities, sensitivities
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import predict
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.uncertain_inputs import FORCE, input_uncertainties
from postproc.compensation.uncertainty import EVEN, WORST, evaluate_uncertainty
from postproc.compensation.uncertainty_propagation import (
    covariances,
    expanded_uncertainty,
    length_quantile,
    variance_shares,
)
from postproc.model import NOTHING, StiffnessModel
from postproc.process import Wrenches
from postproc.report.terminal import describe_budget
from postproc.robot.axis_track import follow_axes
from postproc.robot.description import COVERAGE, Value, find_robot

DRAWS = 2000
WITHIN = 4 / np.sqrt(2 * DRAWS)
"""Four standard errors of a standard deviation from so many draws, relative: 6 %."""

TOOL = Poses(rotation_from_vector([0.0, 0.5, 0.0]), np.array([0.12, 0.0, 0.25]))
INTERVALS = [f"joint_compliance.c{i}" for i in range(2, 7)]
INTERVALS += [f"gravity_compensator.{name}" for name in ("K_c", "s0", "L", "a_x", "a_y")]


def paper():
    """The KR 270 with the intervals of its source: none of c1, ten of unstated level."""
    return StiffnessModel.from_robot(kr270())


def restated(model, **intervals):
    """The model with other intervals: parameter -> half width, or None for no interval; stated as of 95 %."""
    terms = []
    for term in model.terms:
        new = {
            name: Value(value, intervals[name], 0.95, "")
            for name, value in term.values.items()
            if name in intervals
        }
        terms.append(replace(term, stated={**term.stated, **new}))
    return replace(model, terms=tuple(terms))


def every(model, share):
    """The model with an interval of ``share`` of its value for each parameter."""
    return restated(
        model, **{name: share * abs(value) for term in model.terms for name, value in term.values.items()}
    )


def valued(model, **values):
    for index, term in enumerate(model.terms):
        for name in set(values) & set(term.values):
            model = model.with_values({(index, name): values[name]})
    return model


def job(model, count=10, process=True, wrench=None, gain=1.0, seed=5):
    """A cut through the space in which a heavy arm mills, ``count`` poses from one end to the other."""
    share = np.linspace(0.0, 1.0, count)[:, None]
    ends = np.radians([[-25.0, -85.0, 100.0, -40.0, 45.0, 20.0], [35.0, -50.0, 75.0, 50.0, 75.0, 100.0]])
    q = ends[0] + share * (ends[1] - ends[0])
    wanted = model.chain.flange(q) @ TOOL
    tool = Poses(np.tile(TOOL.rotation, (count, 1, 1)), np.tile(TOOL.position, (count, 1)))
    path = motions(wanted)
    if wrench is None:
        rng = np.random.default_rng(seed)
        wrench = np.hstack([rng.normal(0.0, 400.0, (count, 3)), rng.normal(0.0, 20.0, (count, 3))])
    return CompensationProblem(
        file="part.src",
        toolpath=path,
        model=model,
        track=follow_axes(model.robot, path, wanted @ TOOL.inverse(), q[0]),
        wanted=wanted,
        base=Poses(np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))),
        tool=tool,
        force=Wrenches(wrench, wrench, np.ones(count, bool), "test", (), np.zeros(len(wrench), bool)),
        conditions=NOTHING,
        process=process,
        gain=gain,
        max_correction=0.05,
        tolerance=2e-5,
        tolerance_angle=2e-4,
    )


def drawn(task, command, names, root, force=0.0, seed=11):
    """(DRAWS, N, 3) [m] errors of robots of which the parameters ``names`` were drawn, once with the controllers sent
    to the wanted poses and once to ``command``.  ``root``: a root of the parameters' covariance; ``force``: standard
    deviation of the force's scale."""
    rng = np.random.default_rng(seed)
    place = {}
    for index, term in enumerate(task.model.terms):
        for name, value in term.values.items():
            place[f"{term.effect.name}.{name}"] = (index, name, value)
    n, track = len(task.wanted), task.track
    still, tool = np.zeros_like(task.wrench), tiled(task.tool, 3)

    def motors(pose):
        return predict(task.model, pose, LoadCase(task.tool, still, NOTHING, track.branch, track.q)).q

    q = np.concatenate([motors(task.wanted), motors(command), motors(task.wanted)])
    near = task.model.equilibrium(q, np.tile(task.wrench, (3, 1)), tool).displacement
    before, after = np.empty((2, DRAWS, n, 3))
    for draw in range(DRAWS):
        model = task.model
        for name, moved in zip(names, root @ rng.normal(size=root.shape[1]), strict=True):
            index, parameter, value = place[name]
            model = model.with_values({(index, parameter): value + moved})
        wrench = (1.0 + force * rng.normal()) * task.wrench
        rest = model.equilibrium(q, np.concatenate([wrench, wrench, still]), tool, NOTHING, near)
        assert rest.converged.all()
        loaded, corrected, unloaded = rest.pose.position.reshape(3, n, 3)
        goal = unloaded if task.process else task.wanted.position
        before[draw], after[draw] = loaded - goal, corrected - goal
    return before, after


def tiled(poses, times):
    return Poses(np.tile(poses.rotation, (times, 1, 1)), np.tile(poses.position, (times, 1)))


def covariance_of(errors):
    """(N, 3, 3) of errors (draws, N, 3)."""
    return np.array([np.cov(errors[:, row].T) for row in range(errors.shape[1])])


def _real(task, model, command, wrench):
    there = predict(model, command, LoadCase(task.tool, wrench, NOTHING, task.track.branch, task.track.q))
    assert there.settled.all()
    return there.pose.position


def deviations(known):
    return np.diag([entry.deviation for entry in known.entries if entry.name != FORCE])


def largest_deviation(spread):
    """Standard deviation in the direction in which it is largest."""
    return np.sqrt(np.linalg.eigvalsh(spread)[:, -1])


def spread_of(task, command, known):
    """The covariance that linear propagation gives, and the error of the model itself."""
    rows = np.arange(len(task.wanted))
    error, moves = error_sensitivities(task, known.entries, rows, command)
    return error, covariances(moves, known.covariance)


# linear propagation against drawn robots


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "process", "force"),
    [
        (paper(), True, 0.0),
        (paper(), True, 0.05),
        (every(with_compensator(paper(), **SOFTER), 0.02), True, 0.0),
        (every(with_compensator(paper(), **SOFTER), 0.02), False, 0.0),
    ],
    ids=["paper", "paper with force", "acting balancer", "acting balancer, absolute"],
)
def test_deflection_and_residual_spread_as_drawn_robots(model, process, force):
    task = job(model, process=process)
    result = correct(task)
    assert result.corrected.all()
    known = input_uncertainties(model, COVERAGE * force if force else None, True)
    names = [entry.name for entry in known.entries if entry.name != FORCE]

    before, after = drawn(task, result.command[:], names, deviations(known), force)
    told = evaluate_uncertainty(task, result, COVERAGE * force if force else None)

    error, spread = spread_of(task, task.wanted, known)
    unit = error / np.linalg.norm(error, axis=1, keepdims=True)
    along = np.sqrt(np.einsum("ni,nij,nj->n", unit, spread, unit))
    seen = np.linalg.norm(before, axis=2).std(axis=0)
    np.testing.assert_allclose(seen, along, rtol=WITHIN)
    np.testing.assert_allclose(expanded_uncertainty(error, spread), 1.96 * along, rtol=1e-12)
    assert told.worst == np.argmax(result.before)
    assert told.before == pytest.approx(1.96 * seen[told.worst], rel=WITHIN)

    error, spread = spread_of(task, result.command[:], known)
    assert np.linalg.norm(error, axis=1).max() < 2e-8
    seen = covariance_of(after)
    np.testing.assert_allclose(largest_deviation(seen), largest_deviation(spread), rtol=WITHIN)
    np.testing.assert_allclose(told.expanded[:, 0], 1.96 * along, rtol=0.02)
    np.testing.assert_allclose(told.expanded[:, 1], expanded_uncertainty(error, spread), rtol=1e-3)
    trace = np.trace(spread, axis1=1, axis2=2)
    assert (np.abs(seen - spread).max(axis=(1, 2)) < 2 * WITHIN * trace).all()
    below = np.quantile(np.linalg.norm(after, axis=2), 0.95, axis=0)
    np.testing.assert_allclose(expanded_uncertainty(error, spread), below, rtol=0.1)
    assert told.after == pytest.approx(below.max(), rel=0.1)


@pytest.mark.slow
def test_correlated_parameters_spread_as_drawn_robots():
    task = job(paper())
    names = ["joint_compliance.c1", "joint_compliance.c4", "joint_compliance.c5"]
    sizes = np.diag([2e-7, 3e-7, 3e-7])
    relation = np.array([[1.0, -0.8, 0.3], [-0.8, 1.0, 0.1], [0.3, 0.1, 1.0]])
    matrix = sizes @ relation @ sizes
    known = input_uncertainties(replace(task.model, covariance=(names, matrix)))
    assert "joint_compliance.c1" in [entry.name for entry in known.entries]
    assert not known.without_interval
    assert "joint_compliance.c4" not in known.level_unstated
    # only those three: what the file says of the others is taken out
    known = input_uncertainties(
        replace(
            restated(task.model, **dict.fromkeys([n.split(".")[1] for n in INTERVALS], 0.0)),
            covariance=(names, matrix),
        )
    )
    spread = spread_of(task, task.wanted, known)[1]
    seen = covariance_of(drawn(task, task.wanted, names, np.linalg.cholesky(matrix))[0])
    np.testing.assert_allclose(largest_deviation(seen), largest_deviation(spread), rtol=WITHIN)
    part = variance_shares(
        error_sensitivities(task, known.entries, np.array([4]), task.wanted[[4]])[1][0],
        known.covariance,
    )
    assert part.sum() == pytest.approx(1.0, abs=1e-12)


def test_a_covariance_of_an_unknown_parameter_is_refused():
    with pytest.raises(ValueError, match="c9"):
        input_uncertainties(replace(paper(), covariance=(("joint_compliance.c9",), np.eye(1))))


@pytest.mark.parametrize(
    "eigenvalues", [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0.5, 0.1), (1, 0.25, 0), (1, 0.1, 0.1), (4, 1, 0.01)]
)
def test_the_length_quantile_is_that_of_drawn_deviations(eigenvalues):
    rng = np.random.default_rng(3)
    turn = rotation_from_vector([0.3, -1.0, 0.7])
    spread = (turn * eigenvalues) @ turn.T
    lengths = np.linalg.norm(rng.normal(size=(400_000, 3)) * np.sqrt(eigenvalues), axis=1)
    found = length_quantile(spread[None])[0]
    assert found == pytest.approx(np.quantile(lengths, 0.95), rel=0.012)
    assert found >= 1.955 * largest_deviation(spread[None])[0]


# what is known, and what is not


def test_standard_deviations_are_the_half_widths_over_1_96():
    known = input_uncertainties(paper())
    assert [entry.name for entry in known.entries] == INTERVALS
    stated = {f"{t.effect.name}.{name}": value for t in paper().terms for name, value in t.stated.items()}
    for entry in known.entries:
        assert entry.deviation == pytest.approx(stated[entry.name].interval / 1.96, rel=1e-12)
        assert entry.value == stated[entry.name].value
    np.testing.assert_allclose(known.covariance, np.diag([entry.deviation**2 for entry in known.entries]))


def test_unstated_levels_are_marked():
    assert list(input_uncertainties(paper()).level_unstated) == INTERVALS
    assert list(input_uncertainties(restated(paper(), c5=1e-7, L=1e-3)).level_unstated) == [
        name for name in INTERVALS if not name.endswith((".c5", ".L"))
    ]


@pytest.mark.parametrize(
    ("model", "force_ci95", "missing"),
    [
        (paper(), None, {FORCE, "joint_compliance.c1"}),
        (paper(), 0.2, {"joint_compliance.c1"}),
        (restated(paper(), c1=1e-7), 0.2, set()),
        (restated(paper(), c1=0.0), 0.0, set()),
        (restated(paper(), c1=1e-7), None, {FORCE}),
        (restated(paper(), c1=1e-7, c3=None), 0.2, {"joint_compliance.c3"}),
        (valued(paper(), c1=0.0), 0.2, set()),  # at null: not in use
        (valued(paper(), h=0.1), 0.2, {"joint_compliance.c1", "gravity_compensator.h"}),
    ],
)
def test_a_lower_bound_exactly_where_a_figure_in_use_has_no_interval(model, force_ci95, missing):
    task = job(model, 4)
    told = evaluate_uncertainty(task, correct(task), force_ci95)
    assert {name for name, _ in told.effect_of_10_percent} == missing
    assert told.lower_bound == bool(missing)


def test_a_parameter_is_in_use_where_it_is_not_at_its_null():
    """Whatever number its null is."""
    model = paper()
    first = model.terms[0]
    effect = copy(first.effect)
    effect.parameters = tuple(replace(p, null=first.values[p.name]) for p in effect.parameters)
    unused = replace(model, terms=(replace(first, effect=effect), *model.terms[1:]))
    assert [entry.name for entry in input_uncertainties(model).without_interval] == ["joint_compliance.c1"]
    assert not input_uncertainties(unused).without_interval


def test_a_tenth_of_what_has_no_interval():
    """The deflection that a tenth more of c1, and of the force, would add."""
    task = job(paper(), 6)
    result = correct(task)
    told = evaluate_uncertainty(task, result)
    tenths = dict(told.effect_of_10_percent)
    row = np.array([told.worst])
    softer = _real(
        task,
        task.model.with_values({(0, "c1"): 1.1 * task.model.terms[0].values["c1"]}),
        task.wanted,
        task.wrench,
    )
    more = np.linalg.norm(softer - _real(task, task.model, task.wanted, task.wrench), axis=1)
    assert tenths["joint_compliance.c1"] == pytest.approx(more[row][0], rel=0.01)
    assert tenths[FORCE] == pytest.approx(0.1 * result.before.max(), rel=0.01)
    assert [length for _, length in told.effect_of_10_percent] == sorted(tenths.values(), reverse=True)


def test_two_effects_of_one_name_are_told_apart():
    model = paper()
    twice = replace(model, terms=(*model.terms, model.terms[1]))
    names = [entry.name for entry in input_uncertainties(twice).entries]
    assert len(set(names)) == len(names) == 15
    assert "gravity_compensator#2.K_c" in names


def test_no_interval_at_all_is_not_zero():
    model = restated(paper(), **dict.fromkeys([name.split(".")[1] for name in INTERVALS], None))
    task = job(model, 4)
    told = evaluate_uncertainty(task, correct(task))
    assert np.isnan(told.before)
    assert np.isnan(told.after)
    assert told.budget == ()
    assert told.lower_bound


def test_intervals_of_zero_give_zero():
    task = job(every(paper(), 0.0), 4)
    told = evaluate_uncertainty(task, correct(task), 0.0)
    assert (told.before, told.after, told.budget, told.lower_bound) == (0.0, 0.0, (), False)
    assert not told.expanded.any()


def test_nothing_predicted_nothing_doubted():
    task = replace(job(paper(), 4), force=Wrenches.zero(4))
    told = evaluate_uncertainty(task, correct(task), 0.2)
    assert (told.worst, len(told.rows)) == (-1, 0)
    assert np.isnan(told.before)
    assert [name for name, _ in told.effect_of_10_percent] == ["joint_compliance.c1"]


# blame


def test_blame_is_sorted_and_sums_to_one():
    task = job(paper(), 6)
    for force in (None, 0.1):
        told = evaluate_uncertainty(task, correct(task), force)
        values = [share for _, share in told.budget]
        assert sum(values) == pytest.approx(1.0, abs=1e-12)
        assert values == sorted(values, reverse=True)
        assert min(values) >= 0
        assert {name for name, _ in told.budget} == {*INTERVALS, *([FORCE] if force else [])}


def test_blame_is_the_variance_that_goes_with_the_interval():
    task = job(paper(), 6)
    result = correct(task)
    told = evaluate_uncertainty(task, result)
    rows = np.array([told.worst])
    known = input_uncertainties(task.model)
    whole = np.trace(spread_of(task, task.wanted, known)[1][told.worst])
    for name, share in told.budget:
        short = name.split(".")[1]
        known = input_uncertainties(restated(task.model, **{short: 0.0}))
        rest = np.trace(
            covariances(
                error_sensitivities(task, known.entries, rows, task.wanted[rows])[1], known.covariance
            )[0]
        )
        assert share == pytest.approx(1 - rest / whole, abs=1e-9)


# the force


def test_the_force_is_one_scale():
    """Of a linear robot, 20 % of the force are 20 % of the deflection, before as after."""
    model = every(paper(), 0.0)
    task = job(model)
    result = correct(task)
    told = evaluate_uncertainty(task, result, 0.2)
    assert told.before == pytest.approx(0.2 * result.before.max(), rel=0.01)
    assert told.after == pytest.approx(0.2 * result.before.max(), rel=0.01)
    assert told.budget[0] == (FORCE, pytest.approx(1.0))
    half = evaluate_uncertainty(replace(task, gain=0.5), correct(replace(task, gain=0.5)), 0.2)
    assert half.after == pytest.approx(told.after, rel=0.01)


def test_force_does_not_move_the_unloaded_robot():
    model = every(with_compensator(paper(), **SOFTER), 0.0)
    process, absolute = (job(model, 5, process=way) for way in (True, False))
    one, other = (evaluate_uncertainty(task, correct(task), 0.2) for task in (process, absolute))
    assert one.expanded[:, 1] == pytest.approx(other.expanded[:, 1], rel=1e-2)


def test_a_sag_that_the_base_contains_is_not_in_doubt():
    """The static torque of an acting balancer bends the robot with and without force: only its change counts."""
    model = restated(every(with_compensator(paper(), **SOFTER), 0.0), s0=0.02)
    process, absolute = (job(model, 6, process=way) for way in (True, False))
    one, other = (evaluate_uncertainty(task, correct(task), 0.0) for task in (process, absolute))
    assert 0 < one.after < 0.05 * other.after


# how it is computed


@pytest.mark.parametrize("step", [0.005, 0.02, 0.5])
def test_the_step_does_not_matter(monkeypatch, step):
    rng = np.random.default_rng(8)
    model, q = paper(), milling_angles(50, rng)
    wrench, tool = random_wrenches(50, rng), random_tools(50, rng)
    entries = input_uncertainties(model, 0.2).entries

    def moves():
        found = sensitivities(model, entries, q, wrench, tool)
        return found * [entry.deviation for entry in entries]

    usual = moves()
    monkeypatch.setattr(uncertain_inputs, "STEP", step)
    size = np.abs(usual).max(axis=(0, 1))
    assert (size > 0).all()
    assert (np.abs(moves() - usual).max(axis=(0, 1)) < 2e-3 * size + 1e-12).all()


def test_steps_stop_at_the_bounds():
    """An interval far wider than the value: a compliance is not made negative."""
    model = valued(restated(paper(), c3=1e-5), c3=1e-8)
    entry = next(e for e in input_uncertainties(model).entries if e.name.endswith("c3"))
    assert entry.value < entry.step
    asked = []

    class Watched(StiffnessModel):
        def with_values(self, values):
            asked.extend(values.values())
            return super().with_values(values)

    task = job(model, 4)
    watched = Watched(model.robot, model.terms)
    found = sensitivities(watched, [entry], task.track.q, task.wrench, task.tool)
    assert min(asked) == 0.0
    fine = sensitivities(model, [replace(entry, deviation=1e-8)], task.track.q, task.wrench, task.tool)
    np.testing.assert_allclose(found, fine, rtol=0.05, atol=1e-3 * np.abs(fine).max())


def test_one_motion_as_in_the_batch():
    task = job(paper(), 7)
    known = input_uncertainties(task.model, 0.1, True)
    together = spread_of(task, task.wanted, known)[1]
    for row in range(7):
        rows = np.array([row])
        alone = covariances(
            error_sensitivities(task, known.entries, rows, task.wanted[rows])[1], known.covariance
        )
        np.testing.assert_allclose(alone[0], together[row], rtol=1e-6, atol=1e-20)


def test_motions_without_a_rest_are_counted():
    """A spring near the edge of what the joint holds: within its interval the arm may have no stable rest."""
    model = paper()
    task = job(model, 3)
    result = correct(task)

    class Weak(StiffnessModel):
        def equilibrium(self, q, *words):
            rest = super().equilibrium(q, *words)
            return replace(rest, converged=rest.converged & ~(q[:, 0] == task.track.q[0, 0]))

    told = evaluate_uncertainty(
        replace(task, model=Weak(model.robot, model.terms)), replace(result, command=task.wanted)
    )
    assert told.unstable == 1
    assert told.lower_bound
    assert np.isfinite(told.after)


@pytest.mark.slow
def test_a_long_program_costs_what_2000_motions_cost(monkeypatch):
    task = job(every(paper(), 0.02), 20_000)
    result = correct(task)
    seen = []
    real = StiffnessModel.equilibrium

    def counted(self, q, *words, **more):
        seen.append(len(q))
        return real(self, q, *words, **more)

    monkeypatch.setattr(StiffnessModel, "equilibrium", counted)
    told = evaluate_uncertainty(task, result, 0.1)
    assert max(seen) <= WORST + EVEN
    assert EVEN <= len(told.rows) <= WORST + EVEN
    assert len(np.unique(told.rows)) == len(told.rows)
    assert np.argmax(result.before) in told.rows
    assert np.argmax(result.after) in told.rows
    assert {0, 19_999} <= set(told.rows.tolist())
    assert np.diff(told.rows).max() < 20
    monkeypatch.setattr(doubt, "EVEN", 20_000)
    whole = evaluate_uncertainty(task, result, 0.1)
    assert len(whole.rows) == 20_000
    assert told.before == whole.before
    assert told.after == pytest.approx(whole.after, rel=0.01)
    assert told.budget == whole.budget


def test_a_cut_that_is_left_keeps_its_error_and_its_doubt():
    task = job(every(paper(), 0.05), 6)
    task = replace(task, track=replace(task.track, within=np.arange(6) != 3))
    result = correct(task)
    assert not result.corrected.any()
    told = evaluate_uncertainty(task, result, 0.1)
    assert told.after == pytest.approx(told.before, rel=0.05)


# the cell


def test_force_ci95_of_the_cell(tmp_path):
    path = tmp_path / "cell.yaml"
    for text, share in (("", None), ("force_ci95: 0.2\n", 0.2), ("force_ci95: 0\n", 0.0)):
        path.write_text(CELL + text)
        assert load_cell(path).force_ci95 == share


@pytest.mark.parametrize("value", ["20", "-0.1", "1.5", "20%", "much", "[0.1, 0.2]", "true", ".nan"])
def test_wrong_force_ci95_is_refused(tmp_path, value):
    path = tmp_path / "cell.yaml"
    path.write_text(CELL + f"force_ci95: {value}\n")
    with pytest.raises(Refusal) as refusal:
        load_cell(path)
    assert refusal.value.findings[0].line == CELL.count("\n") + 1
    assert "force_ci95" in refusal.value.findings[0].message


# how it is told


def own_robot(job, change):
    """Gives the job's cell a KR 270 of its own, every stated parameter changed by ``change(name, parameter)``."""
    text = yaml.safe_load(find_robot("kuka_kr270").read_text())
    for effect in text["effects"]:
        for name, parameter in effect["parameters"].items():
            for key in ("value", "ci"):
                if key in parameter:
                    parameter[key] = float(parameter[key])
            change(name, parameter)
    (job.folder / "own.yaml").write_text(yaml.safe_dump(text))
    job.cell(CELL.replace("kuka_kr270", "own.yaml"))


def exact(_name, parameter):
    """One per cent of everything, of level 95 %."""
    parameter.pop("ci", None), parameter.pop("ci_level", None)
    parameter["ci95"] = 0.01 * abs(parameter["value"])


def silent(_name, parameter):
    parameter.pop("ci", None), parameter.pop("ci_level", None)


def row_of(text, head):
    """The rest of the first line of ``text`` that begins with ``head``."""
    return next(line[len(head) :].strip() for line in text.splitlines() if line.startswith(head))


def test_json_and_words_of_the_papers_robot(compensate, job):
    report = compensate(job.program, "--force", "--json", "-").json
    found = report["uncertainty"]
    assert found["lower_bound"] is True
    assert set(found["without_interval"]) == {"joint_compliance.c1", "force"}
    assert found["without_interval"] == list(found["effect_of_10_percent_mm"])
    assert found["level_unstated"] == INTERVALS
    assert found["budget"][0]["parameter"].startswith("joint_compliance.c")
    assert sum(entry["share"] for entry in found["budget"]) == pytest.approx(1.0, abs=1e-5)
    before, after = report["error_before_mm"], report["error_after_mm"]
    assert 0.001 < before["ci95"] < 0.1 * before["max"]
    assert after["ci95"] > 0.001
    words = compensate(job.program, "--force").out
    # what has no interval dominates: no figure is given that the intervals alone would make too small
    assert row_of(words, "error before").startswith(f"max {before['max']:.4f} mm, rms ")
    assert row_of(words, "error after").startswith(f"max {after['max']:.4f} mm, rms ")
    assert re.match(
        r"not known: joint_compliance\.c1 has no interval \(10 % of it: 0\.\d+ mm\),"
        r" nor has the force \(10 % of it: 0\.\d+ mm\)$",
        row_of(words, "uncertainty"),
    )
    alone = row_of(words, "              the stated intervals alone: ")
    assert re.match(r"0\.0\d+ mm \(95 %\), mostly joint_compliance\.c\d \(\d+ %\)[,;] ", alone)
    assert alone.endswith("; levels of 10 intervals are not stated")
    assert "or more" not in words
    assert report["verdict"] == "uncertain"
    assert row_of(words, "verdict").startswith("corrected, but the uncertainty is not known: measure ")
    assert (found["known"], found["bound_after_mm"]) == (False, None)


def test_with_every_interval_stated_nothing_is_at_least(compensate, job):
    own_robot(job, exact)
    job.cell(CELL.replace("kuka_kr270", "own.yaml") + "force_ci95: 0.2\n")
    report = compensate(job.program, "--force", "--json", "-").json
    assert report["uncertainty"]["lower_bound"] is False
    assert report["uncertainty"]["without_interval"] == report["uncertainty"]["level_unstated"] == []
    assert report["uncertainty"]["budget"][0]["parameter"] == "force"
    before = report["error_before_mm"]
    assert before["ci95"] == pytest.approx(0.2 * before["max"], rel=0.02)
    assert report["error_after_mm"]["ci95"] == pytest.approx(before["ci95"], rel=0.02)
    words = compensate(job.program, "--force").out
    interval = f"{before['ci95']:.2f}"
    assert f"mm +- {interval} (95 %), rms" in row_of(words, "error before")
    assert "or more" not in words
    assert "at least" not in words
    assert row_of(words, "uncertainty").startswith("mostly force, one scale for all motions (")
    assert "not stated" not in row_of(words, "uncertainty")
    after = report["error_after_mm"]
    assert report["uncertainty"]["known"] is True
    assert report["uncertainty"]["bound_after_mm"] == pytest.approx(after["max"] + after["ci95"], abs=2e-7)
    assert report["verdict"] == "uncertain"
    assert row_of(words, "verdict") == (
        f"corrected, but uncertainty {after['ci95']:.2f} mm exceeds the tolerance 0.02 mm: measure the force"
    )


def test_a_robot_without_any_interval_says_so(compensate, job):
    own_robot(job, silent)
    report = compensate(job.program, "--force", "--json", "-").json
    assert report["error_before_mm"]["ci95"] is None
    assert report["error_after_mm"]["ci95"] is None
    assert report["uncertainty"]["budget"] == []
    assert len(report["uncertainty"]["without_interval"]) == 12
    words = compensate(job.program, "--force").out
    assert "+-" not in words
    assert row_of(words, "uncertainty") == "not known: no input has an interval"
    assert report["verdict"] == "uncertain"
    assert " and 8 more have no interval (10 % of each: " in words


def test_one_interval_of_unstated_level(compensate, job):
    own_robot(job, lambda name, parameter: silent(name, parameter) if name != "c5" else None)
    words = compensate(job.program, "--force").out
    assert row_of(words, "              the stated intervals alone: ").endswith(
        " mm (95 %), mostly joint_compliance.c5 (100 %); the level of 1 interval is not stated"
    )


def test_intervals_of_zero_are_told_as_zero(compensate, job):
    def zero(name, parameter):
        exact(name, parameter)
        parameter["ci95"] = 0.0

    own_robot(job, zero)
    words = compensate(job.program, "--force").out
    assert "+-" not in words
    assert row_of(words, "uncertainty").startswith("not known: the force has no interval (10 % of it: ")
    assert "the stated intervals alone: 0 mm (95 %), no contribution of the intervals" in words
    job.cell((job.folder / "cell.yaml").read_text() + "force_ci95: 0\n")
    words = compensate(job.program, "--force").out
    assert " mm +- 0 (95 %)" in row_of(words, "error before")
    assert row_of(words, "uncertainty") == "no contribution of the intervals"
    assert row_of(words, "verdict").startswith("within tolerance: error 0.")


@pytest.mark.parametrize(
    ("blame", "words"),
    [
        ({"a.x": 0.97, "a.y": 0.03}, "mostly a.x (97 %)"),
        ({"a.x": 0.6, "a.y": 0.3, "b.x": 0.08, "b.y": 0.02}, "mostly a.x (60 %), y (30 %), b.x (8 %)"),
        ({"a.x": 0.5, "b.x": 0.48, "a.y": 0.02}, "mostly a.x (50 %), b.x (48 %)"),
        ({"a.x": 0.8, "force": 0.2}, "mostly a.x (80 %), force, one scale for all motions (20 %)"),
    ],
)
def test_blame_in_words_names_what_makes_up_the_doubt(blame, words):
    assert (
        describe_budget(doubt.Uncertainty(np.arange(1), len(blame), (), 0, budget=tuple(blame.items())))
        == words
    )


def test_prediction_alone_has_the_same_doubt(compensate, job):
    main = compensate(job.program, "--force", "--json", "-").json
    alone = compensate("predict", job.program, "--force", "--json", "-").json
    assert alone["error_before_mm"] == main["error_before_mm"]
    for key in ("budget", "effect_of_10_percent_mm", "level_unstated", "no_equilibrium", "before_mm"):
        assert alone["uncertainty"][key] == main["uncertainty"][key]
    assert alone["error_after_mm"] is None
    assert alone["verdict"] is None


def test_without_force_there_is_nothing_to_doubt(compensate, job):
    report = compensate(job.program, "--force=0,0,0", "--json", "-").json
    assert report["error_before_mm"]["ci95"] is None
    assert report["uncertainty"]["budget"] == []
    words = compensate(job.program, "--force=0,0,0").out
    assert "+-" not in words
    assert "uncertainty" not in words
    assert row_of(words, "verdict") == "not corrected"


def test_half_a_correction_leaves_half_an_error_with_the_whole_doubt(compensate, job):
    full = compensate(job.program, "--force", "--json", "-").json
    half = compensate(job.program, "--force", "--gain", "0.5", "--json", "-").json
    assert half["error_after_mm"]["max"] > 0.4 * full["error_before_mm"]["max"]
    assert half["error_after_mm"]["ci95"] == pytest.approx(full["error_before_mm"]["ci95"], rel=0.05)
