"""What cutting in another direction would bring: against the linear model by hand, operation by operation."""

from __future__ import annotations

import numpy as np
import pytest
from place_cases import about, program_of

from postproc.workflows.place import place
from postproc.workflows.place_problem import PlaceRequest
from postproc.workflows.preparation import Request, prepare

LINES = {"SLOT": (18, 24), "OUTSIDE CONTOUR ROUGHING": (27, 34), "OUTSIDE CONTOUR FINISHING": (37, 44)}
"""Operations of the milling sample and the lines between which they cut."""


@pytest.fixture(scope="module")
def turns():
    """Of the milling sample where it lies."""
    return place(PlaceRequest((program_of("milling"),), "", spin=True)).feed


def errors_turned(angle: float):
    """Lines and errors [m] across the feed with feed and force turned by ``angle`` [deg], where each motion ends."""
    task = prepare(Request(program_of("milling"), force="")).task
    rows = np.flatnonzero(task.carries)
    turn = about(np.array([0.0, 0, 1]), np.radians(angle))
    wrench = (task.wrench[rows].reshape(-1, 2, 3) @ turn.T).reshape(-1, 6)
    moved = task.model.linear_deflection(task.track.q[rows], wrench, task.tool[rows])[:, :3]
    tangent = task.desired_path.tangent(rows, np.ones(len(rows))) @ turn.T
    return task.toolpath.line[rows], np.linalg.norm(np.cross(moved, tangent), axis=1)


@pytest.mark.slow
def test_each_operation_and_the_whole_path(turns):
    assert [one.operation for one in turns] == ["", *LINES]
    every = {angle: errors_turned(angle) for angle in range(-90, 90, 15)}
    for one in turns:
        low, high = LINES.get(one.operation, (0, 1000))
        worst = {}
        for angle, (line, error) in every.items():
            worst[angle] = error[(line >= low) & (line <= high)].max()
        assert one.before == pytest.approx(worst[0], rel=1e-6)
        assert one.after == pytest.approx(min(worst.values()), rel=1e-6)
        assert worst[round(np.degrees(one.angle))] == pytest.approx(one.after, rel=1e-6)
        if one.operation:
            assert low <= one.first <= one.last <= high


@pytest.mark.slow
def test_a_program_without_names_has_its_cuts():
    done = place(PlaceRequest((program_of("pocket"),), "", {"x": (1440.0, 1460.0)}, top=1))
    assert [one.operation for one in done.feed] == [""] * 4
    assert sorted((one.first, one.last) for one in done.feed) == [(0, 0), (12, 61), (69, 118), (126, 175)]
    assert done.to_dict()["feed_turns"][0]["first_line"] == 0
