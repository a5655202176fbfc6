"""Motions that a correction leaves shorter than the controller runs without slowing down."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import MM, output, spring

from postproc.compensation.path_comparison import short_motions

CYCLE = 0.024  # 1.2 mm at 50 mm/s
LINE = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]])


def job():
    return spring(LINE, np.array([False, True, True]))


@pytest.mark.parametrize(
    ("shift", "short"),
    [
        (0.0, []),  # 2 mm apart on the path
        (-0.8, []),  # 1.2 mm
        (-0.95, [3]),  # 1.05 mm: less than nine tenths of 1.2 mm
        (-1.9, [3]),
        (-3.1, []),  # 1.1 mm, backwards
    ],
)
def test_points_apart_on_the_path_may_be_together_in_space(shift, short):
    one = job()
    points = [(2, 0.40, np.zeros(3), 0.0), (2, 0.42, np.array([shift * MM, 0.0, 0.0]), 0.0)]
    made = output(one, np.zeros((3, 3)), points)
    assert list(short_motions(one, made, CYCLE)) == short


def test_what_the_program_itself_states_is_not_reported():
    near = LINE.copy()
    near[2] = near[1] + [0.5 * MM, 0.0, 0.0]
    one = spring(near, np.array([False, True, True]))
    assert not len(short_motions(one, output(one, np.zeros((3, 3))), CYCLE))


def test_the_rest_of_a_divided_motion_counts():
    one = job()
    made = output(one, np.zeros((3, 3)), [(2, 0.995, np.zeros(3), 0.0)])
    assert list(short_motions(one, made, CYCLE)) == [3]


def test_without_a_known_feed_nothing_is_reported():
    one = job()
    path = one.toolpath
    one = replace(one, toolpath=replace(path, speeds=replace(path.speeds, feed=np.full(3, np.nan))))
    made = output(one, np.zeros((3, 3)), [(2, 0.995, np.zeros(3), 0.0)])
    assert not len(short_motions(one, made, CYCLE))
