"""Where the force turns inside a corner, the place of the path to which the tool belongs is found."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from judge.cases import lead_in, steps_of_force

from postproc.compensation.corner_fit import fit_corners
from postproc.compensation.correct import correct
from postproc.compensation.place_search import PlacesBeside
from postproc.compensation.rounded_path import RoundedOutput
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.workflows.preparation import Request, prepare

MM = 1e-3
LIMITS = Limits(cycle=0.012, ramp_end=0.3 * MM, least=200)


def test_a_place_is_found_beside_a_bend_and_across_rows() -> None:
    """Of two rows of 10 and 5 mm: one tool is nearest to the second, beside a bend; of the other one side is known."""
    length = np.array([10.0, 5.0]) * MM
    nearest, row, share = 12.0 * MM, np.array([0, 0]), np.array([0.9, 0.5])

    def gap(at: np.ndarray) -> np.ndarray:
        return np.where(at < nearest, 0.05, 3.0) * (nearest - at)

    beside = PlacesBeside(2)
    beside.put(np.array([0, 1]), row, share, gap(np.array([9.0, 5.0]) * MM))
    beside.put(np.array([0]), np.array([1]), np.array([0.8]), gap(np.array([14.0 * MM])))
    asked = []

    def ahead(tools: np.ndarray) -> np.ndarray:
        asked.append(tools.tolist())
        return gap(np.where(row[tools] == 1, 10.0 * MM, 0.0) + share[tools] * length[row[tools]])

    beside.search(np.array([0, 1]), length, row, share, ahead, 1e-9)
    assert {number for tools in asked for number in tools} == {0}
    assert (row[0], share[0]) == (1, pytest.approx(0.4, abs=1e-5))
    assert (row[1], share[1]) == (0, 0.5)


def test_a_place_beside_a_leap_is_not_asked_for_again() -> None:
    """Where the force sets in at once, no place is nearest: the search went on 30 times where it stood."""
    length, leap = np.array([10.0]) * MM, 4.0 * MM
    row, share = np.array([0]), np.array([0.2])
    asked = []

    def gap(at: np.ndarray) -> np.ndarray:
        return np.where(at < leap, 1.6, -0.3) * MM

    def ahead(tools: np.ndarray) -> np.ndarray:
        asked.append(share[0])
        return gap(share[tools] * length[0])

    beside = PlacesBeside(1)
    beside.put(np.array([0]), row, share, gap(np.array([2.0 * MM])))
    beside.put(np.array([0]), row, np.array([0.4]), gap(np.array([leap])))
    beside.search(np.array([0]), length, row, share, ahead, 1e-9)
    assert share[0] == pytest.approx(0.4, abs=1e-9)
    assert len(asked) < 20


@pytest.fixture(scope="module", params=["lead-in", "steps"])
def fitted(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory):
    folder: Path = tmp_path_factory.mktemp("fitted")
    program = (lead_in(25, 15) if request.param == "lead-in" else steps_of_force())(folder)
    task = prepare(Request(program, force="")).task
    result = correct(task)
    return task, *fit_corners(task, result, subdivide(task, result, LIMITS), LIMITS)


@pytest.mark.slow
def test_places_rise_where_the_force_turns(fitted) -> None:
    """Secants led from one side of the turn to the other, and back by 0.04 mm: 0.0203 mm were reported for 0.0229."""
    task, _, division = fitted
    motions = np.flatnonzero(task.carries[division.source])
    output = RoundedOutput(task, division, motions)
    begins = np.append(0.0, np.cumsum(task.desired_path.length))
    last = -np.inf
    for at in output.place(motions).tolist():
        share = np.linspace(0.0, 1.0, 201)
        found = output.deviations(np.full(len(share), at), share)
        place = begins[found.row] + found.share * task.desired_path.length[found.row]
        rising = np.append(last, place)
        assert np.diff(rising)[1:].min() > -1e-7
        last = place[-1]
