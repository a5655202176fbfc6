"""``tool_errors`` of a cell: what is read, where the goal of a correction goes, and what effects without a name add."""

from dataclasses import replace

import numpy as np
import pytest
from blind_parts.shop import write_shop

import postproc
from postproc.base.findings import Refusal
from postproc.cell import load_cell
from postproc.learning.candidates import MissingEffect
from postproc.learning.considered import considered_covariance
from postproc.learning.covariance import Explanation, Layout, SmoothField
from postproc.workflows.preparation import Request, prepare

WALLS = 'walls: {"wall a": right, others: left}'


def with_errors(folder, words: str):
    program = write_shop(folder / "shop", pockets="AB")
    cell = program.parent / "cell.yaml"
    cell.write_text(cell.read_text() + f"tool_errors:\n  1: {{{words}}}\n")
    return program


def test_a_cell_states_them_in_mm(tmp_path):
    program = with_errors(tmp_path, f"radius: 0.02, radius_ci95: 0.01, length: -0.05, {WALLS}")
    one = load_cell(program.parent / "cell.yaml").tool_errors[1]
    assert (one.radius, one.radius_ci95, one.length, one.length_ci95) == (2e-5, 1e-5, -5e-5, None)
    assert [one.side(name) for name in ("WALL A", "WALL B")] == [1, -1]


@pytest.mark.parametrize(
    "words",
    [
        "radius: 0.02mm",
        "radius: 9",
        "length: -6",
        "radius_ci95: 0.01",
        "radius: 0.1, radius_ci95: -0.1",
        'walls: {"wall a": right}',
        "radius: 0.1, walls: {others: inside}",
        'radius: 0.1, walls: {"wall a": right, "WALL  A": left}',
        "radius: 0.1, diameter: 16",
        "radius: .nan",
    ],
)
def test_what_is_wrong_is_refused(tmp_path, words):
    with pytest.raises(Refusal) as caught:
        load_cell(with_errors(tmp_path, words).parent / "cell.yaml")
    assert caught.value.findings[0].code.startswith("YML")


def straight(task, way):
    """Rows of motions that cut along ``way`` in the axes of the base."""
    place = task.toolpath.position
    step = np.diff(place, axis=0, prepend=place[:1])
    along = step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), 1e-9)
    return np.flatnonzero(task.carries & (along @ way > 0.999))


def test_the_goal_lies_off_the_wall_and_above_the_floor(tmp_path):
    """A tool that is 0.03 mm thicker and 0.05 mm longer, spindle down: where the wall is right of a feed along x, the
    goal is 0.03 mm to the left, along +y, and 0.05 mm higher; where it is left, 0.03 mm along -y."""
    program = with_errors(tmp_path, f"radius: 0.03, length: 0.05, {WALLS}")
    ready = prepare(Request(program, force=""))
    task = ready.task
    rows = straight(task, np.array([1.0, 0.0, 0.0]))
    wanted = task.wanted[rows]
    moved = task.goal(rows, wanted).position - replace(task, known_error=None).goal(rows, wanted).position
    in_base = 1e3 * moved @ task.base[rows[:1]].rotation[0]
    where = task.toolpath.position[rows]
    wall_a = (np.abs(where[:, 1] - 0.058) < 1e-6) & (where[:, 0] < 0.22)
    floor_b = where[:, 0] > 0.31
    assert wall_a.sum() > 5
    assert floor_b.sum() > 5
    # along the feed it goes to where it is off the next wall as well
    off_a, off_b = in_base[wall_a, 1:], in_base[floor_b, 1:]
    np.testing.assert_allclose(off_a, np.tile([0.03, 0.05], (wall_a.sum(), 1)), atol=1e-9)
    np.testing.assert_allclose(off_b, np.tile([-0.03, 0.05], (floor_b.sum(), 1)), atol=1e-9)


def test_an_operation_may_cut_no_wall(tmp_path):
    """It is stated, so nothing is reported, and its floor is where it is without a radius."""
    walls = 'walls: {"wall a": right, "wall b": left, "floor a": none, "floor b": none}'
    ready = prepare(Request(with_errors(tmp_path, f"radius: 0.03, {walls}"), force=""))
    assert "CEL013" not in [one.code for one in ready.findings]
    task = ready.task
    rows = np.flatnonzero(task.carries)
    floor = rows[
        task.known_error.operations.which[rows] == task.known_error.operations.names.index("FLOOR A")
    ]
    size = np.linalg.norm(task.known_error.at(floor, task.wanted[floor]), axis=1)
    assert np.count_nonzero(size > 1e-9) <= 2  # where it meets a wall


def test_walls_on_no_side_are_reported_and_not_corrected(tmp_path):
    program = with_errors(tmp_path, 'radius: 0.03, walls: {"wall a": right}')
    ready = prepare(Request(program, force=""))
    found = [one for one in ready.findings if one.code == "CEL013"]
    assert len(found) == 1
    assert "FLOOR A, FLOOR B, WALL B" in found[0].message
    rows = np.flatnonzero(ready.task.carries)
    moved = ready.task.known_error.at(rows, ready.task.wanted[rows])
    size = np.linalg.norm(moved, axis=1)
    assert set(np.round(size, 9)) == {0.0, 3e-5, np.round(3e-5 * 2**0.5, 9)}  # in corners off both walls


@pytest.mark.slow
def test_the_program_moves_off_the_wall_by_what_the_tool_is_too_large(tmp_path):
    """Corrections of two programs, with and without 0.2 mm of radius: along x with the wall on the right they differ by
    0.2 mm along +y, where the force is the same."""
    tables = []
    for name, words in (("without", "radius: 0.0"), ("with", "radius: 0.2, walls: {others: right}")):
        program = with_errors(tmp_path / name, words)
        tables.append(postproc.compensate(program, force=True, dry_run=True).table())
    rows = straight(prepare(Request(program, force="")).task, np.array([1.0, 0.0, 0.0]))[1:]
    one, other = ({axis: table[f"correction_{axis}_mm"][rows] for axis in "xyz"} for table in tables)
    assert np.median(other["y"] - one["y"]) == pytest.approx(0.2, abs=0.01)
    assert np.abs(np.median(other["x"] - one["x"])) < 0.01
    assert np.abs(np.median(other["z"] - one["z"])) < 0.01


@pytest.mark.slow
def test_intervals_consider_what_has_no_name():
    """Gaps that are there in every second draw: the standardised errors of the causes have the variance 1, and far
    more where the gaps are not considered."""
    rng = np.random.default_rng(11)
    count, draws = 40, 1500
    normal = np.tile([0.0, 0.0, 1.0], (count, 1))
    place = rng.uniform(0, 0.3, (count, 3))
    layout = Layout(place, normal, np.full(count, 1e-5), np.zeros((count, 0)), np.zeros(count, int))
    causes = 2e-5 * rng.normal(size=(count, 3))
    gaps = 0.6 * causes[:, :2] + 0.5e-5 * rng.normal(size=(count, 2))
    offered = [MissingEffect(f"backlash of A{i + 1}", (), None, gaps[:, i : i + 1], True) for i in range(2)]
    squares = {"considered": [], "bare": []}
    for _ in range(draws):
        u, v = rng.normal(size=3), rng.normal(size=2) * (rng.random() < 0.5)
        rest = causes @ u + gaps @ v + rng.normal(0, 1e-5, count)
        explained = Explanation(layout, SmoothField(), rest, causes, np.zeros(count))
        mean, bare = explained.causes()
        more = considered_covariance(explained, offered, np.arange(count))
        for name, covariance in (("bare", bare), ("considered", bare + more)):
            squares[name].append((mean - u) ** 2 / np.diag(covariance))
    assert np.mean(squares["considered"]) == pytest.approx(1.0, abs=0.15)
    assert np.mean(squares["bare"]) > 2
