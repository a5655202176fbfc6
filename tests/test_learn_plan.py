"""The points worth measuring: the plan against exhaustive search, and against points drawn by chance."""

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from postproc.cli.main import main
from postproc.learning.covariance import Layout
from postproc.learning.plan_points import FIELD, plan_points

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "kr270_second_part"


class Linear:
    """Errors that are a matrix times the causes."""

    causes = (None,) * 3
    deviations = np.ones(3)

    def __init__(self, matrix):
        self.matrix = matrix

    def columns(self, _x):
        return self.matrix


def problem(count, rng):
    normal = rng.normal(size=(count, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    place = rng.uniform(0, 0.5, (count, 3))
    layout = Layout(place, normal, np.full(count, 1e-5), np.zeros((count, 0)), np.zeros(count, int))
    return Linear(rng.normal(0, 1e-4, (count, 3))), layout


def remaining(linear, layout, chosen):
    """RMS [m] of the errors of all points after ``chosen`` are read, by the formula of a conditional normal."""
    prior = linear.matrix @ linear.matrix.T + layout.field(FIELD)
    rows = np.array(chosen)
    seen = prior[np.ix_(rows, rows)] + np.diag(layout.sigma[rows] ** 2)
    left = prior - prior[:, rows] @ np.linalg.solve(seen, prior[rows])
    return float(np.sqrt(np.mean(np.diag(left))))


def test_the_first_point_is_the_best_of_all_and_the_figure_is_that_of_the_conditional_normal():
    linear, layout = problem(14, np.random.default_rng(0))
    plan = plan_points(linear, layout, 3)
    alone = [remaining(linear, layout, [i]) for i in range(14)]
    assert plan.chosen[0] == np.argmin(alone)
    assert plan.after == pytest.approx(remaining(linear, layout, plan.chosen), rel=1e-9)
    best = min(remaining(linear, layout, three) for three in combinations(range(14), 3))
    assert plan.after < 1.2 * best  # greedy


def test_planned_points_tell_more_than_any_of_many_drawn_by_chance():
    rng = np.random.default_rng(1)
    linear, layout = problem(60, rng)
    plan = plan_points(linear, layout, 8)
    drawn = [remaining(linear, layout, rng.choice(60, 8, replace=False)) for _ in range(200)]
    assert plan.after < min(drawn)
    assert len(set(plan.chosen.tolist())) == 8


@pytest.mark.slow
def test_the_command_writes_a_file_to_fill(tmp_path):
    rows = [line for line in (SAMPLE / "part1.csv").read_text().splitlines() if not line.startswith("#")]
    offered, measure = tmp_path / "points.csv", tmp_path / "measure.csv"
    offered.write_text("\n".join(",".join([*row.split(",")[:6], row.split(",")[7]]) for row in rows) + "\n")
    words = ["learn", str(SAMPLE / "part.src"), str(offered), "--plan", "12", "--csv", str(measure)]
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    lines = measure.read_text().splitlines()
    assert len(lines) == 6 + 1 + 12
    given = np.array([row.split(",")[:3] for row in rows[1:]], float)
    chosen = np.array([line.split(",")[:3] for line in lines[7:]], float)
    assert np.abs(chosen[:, None] - given[None]).max(axis=2).min(axis=1).max() < 2e-5
    assert CliRunner().invoke(main, words).exit_code == 0  # an empty one is replaced
    filled = "\n".join([*lines[:7], lines[7].replace(",,", ",0.012,"), *lines[8:]]) + "\n"
    measure.write_text(filled)
    again = CliRunner().invoke(main, words)
    assert (again.exit_code, "FIL017" in again.output) == (1, True)
    assert measure.read_text() == filled
    measure.write_text("\n".join(lines) + "\n")
    unfilled = CliRunner().invoke(main, ["learn", str(SAMPLE / "part.src"), str(measure)])
    assert unfilled.exit_code == 1
    assert "LRN001" in unfilled.output
