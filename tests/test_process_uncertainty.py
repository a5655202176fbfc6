"""What a process knows of its forces, carried into the doubt of the prediction, operation by operation."""

from dataclasses import replace

import numpy as np
import pytest
from test_expanded_uncertainty import job, paper, restated

from postproc.compensation.correct import correct
from postproc.compensation.uncertain_inputs import FORCE
from postproc.compensation.uncertainty import evaluate_uncertainty
from postproc.report.terminal import describe_budget


def with_shares(task, ci95):
    return replace(task, force=replace(task.force, ci95=np.asarray(ci95, float)))


def known(**intervals):
    return restated(paper(), c1=1e-7, **intervals)


def test_the_same_share_in_all_motions_is_one_share():
    task = job(known(), 8)
    result = correct(task)
    one, each = (
        evaluate_uncertainty(task, result, 0.3),
        evaluate_uncertainty(with_shares(task, [0.3] * 8), result),
    )
    assert (each.before, each.after) == (pytest.approx(one.before), pytest.approx(one.after))
    assert np.allclose(each.expanded, one.expanded)
    assert each.effect_of_10_percent == one.effect_of_10_percent == ()
    assert not each.force_differs
    assert "force, one scale for all motions" in describe_budget(each)


def test_every_operation_has_its_own_share():
    task = job(known(), 8)
    result = correct(task)
    told = evaluate_uncertainty(with_shares(task, [0.5] * 4 + [0.1] * 4), result)
    rough, fine = (evaluate_uncertainty(task, result, share).expanded for share in (0.5, 0.1))
    assert np.allclose(told.expanded[:4], rough[:4])
    assert np.allclose(told.expanded[4:], fine[4:])
    assert told.force_differs
    share = 0.5 if told.worst < 4 else 0.1
    assert told.before == pytest.approx(evaluate_uncertainty(task, result, share).before)
    assert "force, one scale per operation" in describe_budget(told)


def test_the_cell_counts_before_the_process():
    task = job(known(), 5)
    result = correct(task)
    told = evaluate_uncertainty(with_shares(task, [0.5] * 5), result, 0.1)
    assert told.before == pytest.approx(evaluate_uncertainty(task, result, 0.1).before)


def test_an_operation_without_an_interval_makes_a_lower_bound():
    task = job(known(), 8)
    result = correct(task)
    told = evaluate_uncertainty(with_shares(task, [0.5] * 4 + [np.nan] * 4), result)
    assert told.lower_bound
    assert [name for name, _ in told.effect_of_10_percent] == [FORCE]
    assert np.allclose(told.expanded[:4], evaluate_uncertainty(task, result, 0.5).expanded[:4])
    assert np.allclose(told.expanded[4:], evaluate_uncertainty(task, result, 0.0).expanded[4:])
    nothing = evaluate_uncertainty(with_shares(task, [np.nan] * 8), result)
    assert [name for name, _ in nothing.effect_of_10_percent] == [FORCE]


def test_air_needs_no_interval():
    task = job(known(), 6)
    wrench = task.force.values.copy()
    wrench[3] = 0
    carries = np.arange(6) != 3
    task = replace(task, force=replace(task.force, values=wrench, start=wrench, carries=carries))
    told = evaluate_uncertainty(with_shares(task, np.where(carries, 0.3, np.nan)), correct(task))
    assert told.effect_of_10_percent == ()
    assert not told.force_differs
