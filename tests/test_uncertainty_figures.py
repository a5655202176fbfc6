"""The doubt of a prediction, figure by figure: what has an interval, how a model is stepped, and what is made of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from plant import SOFTER, with_compensator
from scipy.optimize import brentq
from scipy.stats import chi2
from test_expanded_uncertainty import INTERVALS, TOOL, every, job, paper, restated

from postproc.base.geometry import Poses
from postproc.compensation import uncertainty as doubt
from postproc.compensation.correct import correct
from postproc.compensation.input_sensitivities import sensitivities
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import predict
from postproc.compensation.uncertain_inputs import FORCE, UncertainInput, input_uncertainties
from postproc.compensation.uncertainty import (
    ForceUncertainty,
    Uncertainty,
    evaluate_uncertainty,
    select_motions,
)
from postproc.compensation.uncertainty_propagation import (
    covariances,
    expanded_uncertainty,
    length_quantile,
    variance_shares,
)
from postproc.model import NOTHING
from postproc.robot.description import Value

# what has an interval


def stated_model():
    """Six compliances, each known in another way, and a compensator as in its source."""
    model = paper()
    first = model.terms[0]
    half = 1e-8
    stated = {
        "c1": Value(first.values["c1"], half, 0.95, ""),
        "c2": Value(first.values["c2"], half, None, ""),
        "c3": Value(first.values["c3"], half, 0.99, ""),
        "c4": Value(first.values["c4"], None, None, ""),
        "c6": Value(0.0, None, None, ""),
    }
    values = {**first.values, "c6": 0.0}
    return replace(model, terms=(replace(first, values=values, stated=stated), *model.terms[1:]))


def test_each_figure_is_known_as_the_file_states_it():
    model = stated_model()
    known = input_uncertainties(model)
    names = [f"joint_compliance.c{i}" for i in (1, 2, 3)] + [name for name in INTERVALS if "comp" in name][5:]
    assert [entry.name for entry in known.entries] == names
    assert [entry.deviation for entry in known.entries[:3]] == [
        1e-8 / 1.96,
        1e-8 / 1.96,
        pytest.approx(1e-8 / 2.5758293, rel=1e-7),
    ]
    first = known.entries[1]
    value = model.terms[0].values["c2"]
    assert first == UncertainInput(
        "joint_compliance.c2", 0, "c2", value, first.lower, first.upper, 1e-8 / 1.96
    )
    parameter = next(one for one in model.terms[0].effect.parameters if one.name == "c2")
    assert (first.lower, first.upper) == (parameter.lower, parameter.upper)
    assert {entry.term for entry in known.entries[3:]} == {1}
    assert known.level_unstated == ("joint_compliance.c2", *names[3:])
    # c6 is at its null and not in use
    assert [entry.name for entry in known.without_interval] == ["joint_compliance.c4", "joint_compliance.c5"]
    assert all(entry.deviation is None for entry in known.without_interval)
    np.testing.assert_array_equal(known.covariance, np.diag([e.deviation**2 for e in known.entries]))
    assert known.lower_bound
    assert not input_uncertainties(restated(model, c4=0.0, c5=0.0)).lower_bound


@pytest.mark.parametrize(
    ("share", "forced", "known", "missing"),
    [(None, False, [], []), (None, True, [], [None]), (0.2, False, [0.2 / 1.96], []), (0.0, True, [0.0], [])],
)
def test_the_force_is_the_last_figure(share, forced, known, missing):
    found = input_uncertainties(stated_model(), share, forced)
    for entries, deviations in ((found.entries, known), (found.without_interval, missing)):
        assert [entry for entry in entries if entry.name == FORCE] == [
            UncertainInput("force", -1, "force", 1.0, -np.inf, np.inf, deviation) for deviation in deviations
        ]
        assert all(entry.name != FORCE for entry in entries[: len(entries) - len(deviations)])
    assert found.covariance.shape == (len(found.entries),) * 2
    if known:
        assert found.covariance[-1, -1] == known[0] ** 2
        assert not found.covariance[-1, :-1].any()


def test_what_was_fitted_together_counts_before_the_file():
    """In the order of the model, whatever that of the covariance."""
    names = ("joint_compliance.c4", "joint_compliance.c2", "joint_compliance.c1")
    matrix = np.array([[4.0, 1.0, -2.0], [1.0, 9.0, 3.0], [-2.0, 3.0, 16.0]]) * 1e-18
    known = input_uncertainties(replace(stated_model(), covariance=(names, matrix)), 0.2)
    found = [entry.name for entry in known.entries]
    assert found[:4] == [f"joint_compliance.c{i}" for i in (1, 2, 3, 4)]
    assert [entry.deviation for entry in known.entries[:2]] == pytest.approx([4e-9, 3e-9])
    assert known.entries[3].deviation == pytest.approx(2e-9)
    place = [3, 1, 0]
    np.testing.assert_array_equal(known.covariance[np.ix_(place, place)], matrix)
    rest = np.delete(np.delete(known.covariance, place, 0), place, 1)
    others = [entry.deviation for k, entry in enumerate(known.entries) if k not in place]
    np.testing.assert_allclose(rest, np.diag(others) ** 2)
    assert not known.covariance[2, [0, 1, 3, 4, 5]].any()
    # its level is known, what the file says of c2 is not asked
    assert "joint_compliance.c2" not in known.level_unstated
    assert [entry.name for entry in known.without_interval] == ["joint_compliance.c5"]
    with pytest.raises(
        ValueError, match=r"the covariance contains what the model does not have: \['a\.x', 'b\.y'\]"
    ):
        input_uncertainties(replace(stated_model(), covariance=(("b.y", "a.x"), np.eye(2))))


# steps


@dataclass
class Formula:
    """A model whose tool stands at value**2 along x, three times that of another along y and, under a force, moved by
    the square of it along z; it remembers what it was asked for, and has no rest below ``edge``."""

    values: dict = field(default_factory=lambda: {(0, "a"): 3.0, (1, "b"): -2.0})
    asked: list = field(default_factory=list)
    edge: float = -np.inf

    def with_values(self, values):
        return Formula({**self.values, **values}, self.asked, self.edge)

    def equilibrium(self, q, wrench, tool, conditions=NOTHING, start=None, tolerance=0.0):
        self.asked.append((dict(self.values), wrench.copy(), start))
        a, b = self.values[0, "a"], self.values[1, "b"]
        place = np.stack([a**2 + q[:, 0], 3 * b + 0 * q[:, 0], wrench[:, 2] ** 2], axis=1)
        turn = np.tile(np.eye(3), (len(q), 1, 1))
        return SimpleNamespace(converged=a + q[:, 0] >= self.edge, pose=Poses(turn, place))


A, B = ((0, "a", 3.0), (1, "b", -2.0))
INF = np.inf


def unsure(which, deviation, lower=-INF, upper=INF):
    term, name, value = which
    return UncertainInput(f"x.{name}", term, name, value, lower, upper, deviation)


@pytest.mark.parametrize(
    ("value", "deviation", "step"), [(3.0, 0.5, 0.05), (-2.0, None, 0.02), (3.0, 0.0, 0.0)]
)
def test_a_step_is_a_tenth_of_the_deviation_or_a_hundredth_of_the_value(value, deviation, step):
    assert unsure((0, "a", value), deviation).step == pytest.approx(step, rel=1e-15)


@pytest.mark.parametrize(
    ("entry", "low", "high"),
    [
        (unsure(A, 0.5), 2.95, 3.05),
        (unsure(A, None), 2.97, 3.03),
        (unsure(A, 0.5, lower=2.99), 2.99, 3.05),
        (unsure(A, 0.5, upper=3.01), 2.95, 3.01),
        (unsure(A, 0.5, lower=3.0), 3.0, 3.05),
        (unsure(A, 0.5, lower=3.0, upper=3.0), None, None),
        (unsure(A, 0.0), None, None),
    ],
)
def test_differences_stop_at_the_bounds(entry, low, high):
    model = Formula()
    q, wrench = np.array([[0.0], [0.5]]), np.zeros((2, 6))
    found = sensitivities(model, [entry], q, wrench, TOOL)
    assert found.shape == (2, 3, 1)
    if low is None:
        assert not found.any()
        assert model.asked == []
        return
    assert [values[0, "a"] for values, _, _ in model.asked] == pytest.approx([low, high], rel=1e-15)
    assert {values[1, "b"] for values, _, _ in model.asked} == {-2.0}
    np.testing.assert_allclose(found[:, 0, 0], low + high, rtol=1e-12)
    assert not found[:, 1:].any()


def test_each_figure_has_its_column_and_the_force_is_scaled():
    model, start = Formula(), np.ones((2, 1))
    q, wrench = np.zeros((2, 1)), np.array([[0, 0, 5.0, 0, 0, 0], [0, 0, -2.0, 0, 0, 0]])
    force = UncertainInput(FORCE, -1, FORCE, 1.0, -INF, INF, 0.4)
    found = sensitivities(model, [unsure(B, 0.1), force, unsure(A, 0.1)], q, wrench, TOOL, NOTHING, start)
    expected = np.zeros((2, 3, 3))
    expected[:, 1, 0], expected[:, 2, 1], expected[:, 0, 2] = 3.0, 2 * wrench[:, 2] ** 2, 6.0
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert all(given is start for _, _, given in model.asked)
    scaled = [one for _, one, _ in model.asked if not np.array_equal(one, wrench)]
    np.testing.assert_allclose(scaled, [0.96 * wrench, 1.04 * wrench], rtol=1e-15)
    # no force, no scale of it
    found = sensitivities(Formula(), [force, unsure(A, 0.1)], q, np.zeros((2, 6)), TOOL)
    assert not found[:, :, 0].any()
    np.testing.assert_allclose(found[:, 0, 1], 6.0)


def test_where_a_stepped_model_has_no_rest_nothing_is_known():
    """On either side of the step."""
    q, wrench = np.array([[0.0], [0.02], [0.2]]), np.zeros((3, 6))
    for edge in (3.0, 2.99):
        found = sensitivities(Formula(edge=edge), [unsure(B, 0.1), unsure(A, 0.5)], q, wrench, TOOL)
        assert np.isfinite(found[:, :, 0]).all()
        assert np.isnan(found[:, :, 1]).all(axis=1).tolist() == [True, True, False]


# figures


@pytest.mark.parametrize("freedom", [1.0, 1.25, 1.5, 2.0, 2.5, 3.0])
def test_the_quantiles_of_chi_square(freedom):
    """Of eigenvalues whose sum squared over the sum of their squares is the degrees of freedom."""

    def eigenvalues(last):
        return np.array([1.0, last, 0.0]) if freedom <= 2 else np.array([1.0, 1.0, last])

    def miss(last):
        return eigenvalues(last).sum() ** 2 / (eigenvalues(last) ** 2).sum() - freedom

    values = eigenvalues(brentq(miss, 0.0, 1.0, xtol=1e-15))
    for scale in (1e-16, 1.0):
        spread = np.diag(scale * values)[None]
        exact = np.sqrt(scale * (values**2).sum() / values.sum() * chi2.ppf(0.95, freedom))
        assert length_quantile(spread)[0] == pytest.approx(exact, rel=2e-6)


def test_quantiles_in_between_nothing_and_what_is_not_known():
    for last in (0.05, 0.3, 0.6, 0.9):
        for values in ([1.0, last, 0.0], [1.0, 1.0, last]):
            freedom = sum(values) ** 2 / np.square(values).sum()
            exact = np.sqrt(np.square(values).sum() / sum(values) * chi2.ppf(0.95, freedom))
            assert length_quantile(np.diag(values)[None])[0] == pytest.approx(exact, rel=5e-3)
    spread = np.zeros((3, 3, 3))
    spread[1], spread[2] = np.nan, np.eye(3)
    found = length_quantile(spread)
    assert found[0] == 0.0
    assert np.isnan(found[1])
    assert found[2] == pytest.approx(np.sqrt(chi2.ppf(0.95, 3)), rel=1e-6)


def test_half_widths_along_the_error_or_as_of_a_length():
    spread = np.tile(np.diag([4.0, 1.0, 0.0]) * 1e-10, (6, 1, 1))
    error = np.array([[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [1e-5, 0, 0], [0, 0, 0], [0.6, 0.8, 0]])
    length = length_quantile(spread)[0]
    found = expanded_uncertainty(error, spread)
    np.testing.assert_allclose(
        found,
        [1.96 * 2e-5, 1.96 * 1e-5, 0.0, length, length, 1.96 * np.sqrt(0.36 * 4 + 0.64) * 1e-5],
        rtol=1e-12,
    )
    # rounding may leave a variance a hair below zero: it is none
    spread = np.diag([1e-10, 1e-10, -1e-30])[None]
    assert expanded_uncertainty(np.array([[0.0, 0.0, 1.0]]), spread)[0] == 0.0
    # a length of just the doubt is not clear of it
    spread = np.diag([4.0, 1.0, 0.0])[None]
    edge = length_quantile(spread)[0]
    found = [expanded_uncertainty(np.array([[0.0, k * edge, 0.0]]), spread)[0] for k in (0.999, 1.0, 1.001)]
    assert found == pytest.approx([edge, edge, 1.96])


def test_covariances_and_shares():
    rng = np.random.default_rng(5)
    moves, root = rng.normal(size=(4, 3, 5)), rng.normal(size=(5, 5))
    matrix = root @ root.T
    found = covariances(moves, matrix)
    for k in range(4):
        np.testing.assert_allclose(found[k], moves[k] @ matrix @ moves[k].T)
    part = variance_shares(moves[0], matrix)
    np.testing.assert_allclose(part, np.diag(matrix @ moves[0].T @ moves[0]) / np.trace(found[0]))
    assert part.sum() == pytest.approx(1.0)
    assert variance_shares(np.zeros((3, 2)), np.eye(2)).tolist() == [0.0, 0.0]
    assert variance_shares(np.full((3, 2), np.nan), np.eye(2)).tolist() == [0.0, 0.0]
    assert variance_shares(1e-30 * np.eye(3), np.eye(3)) == pytest.approx([1 / 3] * 3)


# which motions


@pytest.mark.parametrize(
    ("n", "rows"),
    [
        (10, range(10)),
        # of 21: the two worst before (4, 20), the two worst after (11, 12), and six evenly from end to end
        (21, [0, 4, 8, 11, 12, 16, 20]),
    ],
)
def test_of_many_motions_the_worst_and_some_evenly(monkeypatch, n, rows):
    monkeypatch.setattr(doubt, "WORST", 4)
    monkeypatch.setattr(doubt, "EVEN", 6)
    before, after = np.linspace(0.0, 1e-5, n), np.linspace(1e-5, 0.0, n)
    if n > 10:
        before[[4, 20]], after[[11, 12]] = 1.0, 1.0
    found = select_motions(SimpleNamespace(before=before, after=after))
    assert found.tolist() == list(rows)
    # what is not predicted is not among them
    unknown = np.concatenate([[np.nan], before]), np.concatenate([after, [np.inf]])
    found = select_motions(SimpleNamespace(before=unknown[0], after=np.concatenate([[0.0], after])))
    assert found.tolist() == [row + 1 for row in rows]
    found = select_motions(SimpleNamespace(before=np.concatenate([before, [1.0]]), after=unknown[1]))
    assert found.tolist() == list(rows)


def test_a_program_of_as_many_motions_as_are_evaluated_is_evaluated_whole():
    for n, whole in ((doubt.WORST + doubt.EVEN, True), (doubt.WORST + doubt.EVEN + 1, False)):
        result = SimpleNamespace(before=np.linspace(0, 1, n), after=np.zeros(n))
        assert (len(select_motions(result)) == n) == whole
    assert doubt.WORST + doubt.EVEN == 2000


# the force


@pytest.mark.parametrize(
    ("each", "stated", "largest", "scale", "partly", "differs"),
    [
        (None, None, None, [1.0] * 5, False, False),
        (None, 0.3, 0.3, [1.0] * 5, False, False),
        ([0.1] * 5, 0.3, 0.3, [1.0] * 5, False, False),
        ([0.4, 0.2, 0.2, 0.1, 0.4], None, 0.2, [2.0, 1.0, 1.0, 0.5, 2.0], False, True),
        ([np.nan, 0.2, 0.2, 0.2, 0.4], None, 0.2, [0.0, 1.0, 1.0, 1.0, 2.0], False, False),
        ([0.4, np.nan, 0.2, 0.1, 0.4], None, 0.2, [2.0, 0.0, 1.0, 0.5, 2.0], True, True),
        ([0.4, np.nan, np.nan, np.nan, 0.4], None, None, [1.0] * 5, False, False),
        ([0.0] * 5, None, 0.0, [1.0] * 5, False, False),
    ],
)
def test_what_is_known_of_the_force(each, stated, largest, scale, partly, differs):
    """Of five motions the first is not evaluated and the last carries no force."""
    force = SimpleNamespace(ci95=None if each is None else np.array(each))
    task = SimpleNamespace(wrench=np.zeros((5, 6)), force=force, carries=np.arange(5) < 4)
    found = ForceUncertainty.of(task, np.array([1, 2, 3, 4]), stated)
    assert found.largest == largest
    np.testing.assert_allclose(found.scale, scale)
    assert (found.incomplete, found.differs) == (partly, differs)


def test_a_force_that_is_known_in_part_is_named_beside_what_else_is_not():
    task = job(paper(), 6)
    result = correct(task)
    task = replace(task, force=replace(task.force, ci95=np.array([0.2, 0.2, 0.1, np.nan, 0.2, 0.2])))
    told = evaluate_uncertainty(task, result)
    assert sorted(name for name, _ in told.effect_of_10_percent) == [FORCE, "joint_compliance.c1"]
    assert told.force_differs
    assert told.intervals == len(INTERVALS) + 1
    # a tenth of the force is told as such, whatever is known of it elsewhere
    assert dict(told.effect_of_10_percent)[FORCE] == pytest.approx(
        dict(evaluate_uncertainty(job(paper(), 6), result).effect_of_10_percent)[FORCE]
    )


# all of it


@pytest.mark.sample(1)
@pytest.mark.parametrize("process", [True, False])
@pytest.mark.parametrize("each", [None, [0.3, 0.3, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3]])
def test_a_doubt_is_made_of_differences_of_predictions(process, each):
    """Each parameter stepped by its deviation up and down, motion by motion; summed up as independent."""
    model = every(with_compensator(paper(), **SOFTER), 0.02)
    task = job(model, 8, process=process)
    ci = np.full(8, 0.25) if each is None else np.array(each)
    task = replace(task, force=replace(task.force, ci95=ci))
    result = correct(task)
    told = evaluate_uncertainty(task, result)

    def placed(model, command, wrench):
        return predict(
            model, command, LoadCase(task.tool, wrench, NOTHING, task.track.branch, task.track.q)
        ).pose.position

    def held(model, q, wrench):
        return model.equilibrium(q, wrench, task.tool).pose.position

    def motors(command, wrench):
        return predict(
            task.model, command, LoadCase(task.tool, wrench, NOTHING, task.track.branch, task.track.q)
        ).q

    none = np.zeros_like(task.wrench)
    goal = placed(model, task.wanted, none) if process else task.wanted.position
    still = motors(task.wanted, none)
    widths, parts = [], []
    for command in (task.wanted, result.command[:]):
        error = placed(model, command, task.wrench) - goal
        q, moves = motors(command, task.wrench), {}
        for index, term in enumerate(model.terms):
            for name, value in term.values.items():
                sides = []
                for sign in (1, -1):
                    stepped = model.with_values(
                        {(index, name): value + sign * 0.01 * abs(value) * 0.02 / 1.96}
                    )
                    there = held(stepped, q, task.wrench)
                    sides.append(there - held(stepped, still, none) if process else there)
                moves[f"{term.effect.name}.{name}"] = (sides[0] - sides[1]) / 0.02
        more, less = (held(model, q, (1 + sign * 1e-3) * task.wrench) for sign in (1, -1))
        moves[FORCE] = (more - less) / 2e-3 * (ci / 1.96)[:, None]
        stack = np.stack(list(moves.values()), axis=2)
        spread = stack @ np.swapaxes(stack, 1, 2)
        widths.append(expanded_uncertainty(error, spread))
        parts.append({name: np.sum(move**2, axis=1) for name, move in moves.items()})
    worst = int(np.argmax(result.before))
    assert told.rows.tolist() == list(range(8))
    assert told.worst == worst
    # the command's place moves little of a sensitivity: those of the corrected ones stand for both
    np.testing.assert_allclose(told.expanded[:, 0], widths[0], rtol=0.01)
    np.testing.assert_allclose(told.expanded[:, 1], widths[1], rtol=2e-3)
    assert told.before == pytest.approx(widths[0][worst], rel=2e-3)
    # the largest error of all motions at once, of drawn figures
    drawn = np.random.default_rng(1).standard_normal((100_000, stack.shape[2]))
    largest = np.linalg.norm(error + np.einsum("nip,dp->dni", stack, drawn), axis=2).max(axis=1)
    assert told.after == pytest.approx(np.quantile(largest, 0.95), rel=0.01)
    assert told.after > 0.998 * widths[1].max()
    total = sum(values[worst] for values in parts[0].values())
    shares_ = {name: values[worst] / total for name, values in parts[0].items()}
    assert dict(told.budget) == pytest.approx(shares_, rel=5e-3, abs=1e-6)
    values = [share for _, share in told.budget]
    assert values == sorted(values, reverse=True)
    assert told.intervals == len(shares_)
    assert (told.effect_of_10_percent, told.unstable, told.force_differs) == ((), 0, each is not None)


def test_a_doubt_of_nothing():
    told = Uncertainty(np.arange(0), 3, ())
    assert (told.worst, told.budget, told.effect_of_10_percent, told.unstable, told.force_differs) == (
        -1,
        (),
        (),
        0,
        False,
    )
    assert np.isnan([told.before, told.after]).all()
    assert told.expanded.shape == (0, 2)
    assert not told.lower_bound
    assert replace(told, unstable=1).lower_bound
    assert replace(told, effect_of_10_percent=(("a.x", 1.0),)).lower_bound


def test_motions_that_are_left_and_motions_that_err_more_are_doubted_where_they_are():
    """The largest error is not the first: its row is told, and the tenths are those of its motion."""
    task = job(paper(), 7, seed=9)
    result = correct(task)
    told = evaluate_uncertainty(task, result)
    worst = int(np.argmax(result.before))
    assert worst == told.worst == 4
    assert dict(told.effect_of_10_percent)[FORCE] == pytest.approx(0.1 * result.before[4], rel=0.01)
    held = replace(result, before=np.where(np.arange(7) == 4, np.nan, result.before))
    told = evaluate_uncertainty(task, held)
    assert told.worst == int(np.nanargmax(held.before))
    assert told.rows.tolist() == [0, 1, 2, 3, 5, 6]
    assert told.expanded.shape == (6, 2)
