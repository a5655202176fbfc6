"""The wrench between the end points: along lines and arcs, and where it steps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_forces import DOWN, PTP_THEN, cell_of, path_of, run
from tiers import examples

from postproc.base.geometry import Poses, rotation_from_abc, rotation_from_vector
from postproc.base.units import DEG
from postproc.toolpath import Arcs, Kind


def arc_path(
    sweep, radius=0.1, normal=(0, 0, 1), rotations=None, before=None, rise=0.0, notes=(), first=(1, 0, 0)
):
    """PTP to the begin of an arc about the origin, a line to it where ``before`` is given, and the arc."""
    normal = np.array(normal, float) / np.linalg.norm(normal)
    start = radius * np.array(first, float)
    end = rotation_from_vector(sweep * normal) @ start + rise * normal
    points = [start, end] if before is None else [before, start, end]
    kinds = [Kind.PTP] + [Kind.LIN] * (len(points) - 2) + [Kind.CIRC]
    path = path_of(points, kinds, rotations, notes)
    n = len(points)
    centre, axis, sweeps = np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)
    centre[-1], axis[-1], sweeps[-1] = 0, normal, sweep
    return replace(path, arcs=Arcs(centre, axis, sweeps))


def at(result, row, *fractions):
    return result.along(np.full(len(fractions), row), np.array(fractions, float))


def test_on_a_line_the_wrench_is_linear():
    points = [[0.1 * i, 0, 0] for i in range(4)]
    notes = [(1, "FORCE 10 0 4 1 2 3", 1), (2, "FORCE 14 0 4 1 2 3", 2)]
    result = run(path_of(points, PTP_THEN[:4], notes=notes), "")
    found = at(result, 2, 0, 0.25, 1)
    assert np.allclose(found[:, 0], [12, 12.5, 14])
    assert np.allclose(found[:, 1:], [0, 4, 1, 2, 3])
    rows = np.array([0, 1, 3])
    assert np.allclose(result.along(rows, np.zeros(3)), result.start[:][rows])
    assert np.allclose(result.along(rows, np.ones(3)), result.values[rows])


@pytest.mark.parametrize("sweep", [30, 90, 180, 270, 360])
@pytest.mark.parametrize("side", [1, -1])
def test_on_an_arc_the_feed_frame_turns_with_the_tangent(sweep, side):
    result = run(arc_path(sweep * DEG, normal=(0, 0, side)), "10,20,30,1,2,3@feed")
    for fraction in (0, 0.3, 0.5, 1):
        angle = side * fraction * sweep * DEG
        x = side * np.array([-np.sin(angle), np.cos(angle), 0])
        y = np.cross([0, 0, 1], x)
        force, moment = 10 * x + 20 * y + [0, 0, 30], x + 2 * y + [0, 0, 3]
        assert np.allclose(at(result, 1, fraction)[0], [*force, *moment])
    assert result.steps.tolist() == [False, True]


def test_a_line_that_runs_on_into_an_arc_is_no_step():
    path = arc_path(90 * DEG, before=[0.1, -0.2, 0])
    result = run(path, "10,0,0@feed")
    assert result.steps.tolist() == [False, True, False]
    assert np.allclose(result.values[1, :3], [0, 10, 0])
    assert np.allclose(result.values[2, :3], [-10, 0, 0])
    # by its chord the arc would turn by 45 deg; a line along its radius does turn by 90
    result = run(arc_path(90 * DEG, before=[0.3, 0, 0]), "10,0,0@feed")
    assert result.steps.tolist() == [False, True, True]
    assert np.allclose(result.start[:][2, :3], [0, 10, 0])


def test_what_a_vertex_shares_fades_along_the_arc_in_its_own_frame():
    """A line comes in 20 deg off the tangent: both share the mean at the vertex, the arc's own force is at its end."""
    a = 20 * DEG
    before = np.array([0.1, 0, 0]) - 0.2 * np.array([-np.sin(a), np.cos(a), 0])
    result = run(arc_path(180 * DEG, before=before), "10,0,0@feed")
    shared = 5 * np.array([-np.sin(a), np.cos(a) + 1, 0])
    assert np.allclose(result.start[:][2, :3], shared)
    half = rotation_from_vector([0, 0, np.pi / 2]) @ (0.5 * shared + 0.5 * np.array([0, 10, 0]))
    assert np.allclose(at(result, 2, 0.5)[0, :3], half)


@pytest.mark.parametrize("frame", ["base", "world"])
def test_other_frames_stay_on_an_arc(frame):
    result = run(arc_path(120 * DEG), f"10,20,30,1,2,3@{frame}")
    assert np.allclose(at(result, 1, 0, 0.4, 1), [[10, 20, 30, 1, 2, 3]] * 3)


def test_the_tool_frame_turns_with_the_tool():
    still = run(arc_path(120 * DEG), "10,0,0@tool")
    assert np.allclose(at(still, 1, 0, 0.5, 1)[:, :3], [10, 0, 0])
    quarter = rotation_from_abc([np.pi / 2, 0, 0]) @ DOWN
    result = run(arc_path(90 * DEG, rotations=[DOWN, quarter]), "10,0,0@tool")
    s = np.sqrt(0.5)
    assert np.allclose(at(result, 1, 0, 0.5, 1)[:, :3], 10 * np.array([[1, 0, 0], [s, s, 0], [0, 1, 0]]))


def test_a_helix_goes_down_on_its_way():
    """Only the feed across the spindle counts: x stays level."""
    result = run(arc_path(2 * np.pi, rise=-0.05), "10,0,30@feed")
    assert np.allclose(at(result, 1, 0, 0.25, 1)[:, :3], [[0, 10, 30], [-10, 0, 30], [0, 10, 30]])


def test_an_upright_arc_keeps_x_where_its_tangent_is_along_the_spindle():
    # in the plane x-z, from the right over the top to the left: it begins straight up
    result = run(arc_path(np.pi, normal=(0, -1, 0)), "10,0,30@feed")
    assert np.allclose(at(result, 1, 0, 0.5, 0.999, 1)[:, :3], [[-10, 0, 30]] * 4)
    # half of it runs against x, the other half along
    path = arc_path(np.pi, normal=(0, -1, 0), first=(0, 0, 1))
    result = run(path, "10,0,30@feed")
    assert np.allclose(at(result, 1, 0, 0.3, 0.7, 1)[:, 0], [-10, -10, 10, 10])


@settings(max_examples=examples(60), deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["feed", "tool", "base", "world"]))
def test_between_the_ends_nothing_jumps_and_the_size_stays(seed, frame):
    rng = np.random.default_rng(seed)
    tilt = rng.normal(scale=0.1, size=(2, 3))
    path = arc_path(
        rng.uniform(0.2, 6), rotations=rotation_from_abc(tilt) @ DOWN, rise=rng.normal(scale=0.02)
    )
    base = Poses.from_abc(rng.normal(size=3), rng.normal(size=3))
    result = run(path, f"10,20,30,1,2,3@{frame}", cell_of(bases={1: base}))
    share = np.linspace(0, 1, 201)
    found = at(result, 1, *share)
    assert np.allclose(found[[0, -1]], [result.start[:][1], result.values[1]], atol=1e-9)
    assert np.max(np.linalg.norm(np.diff(found, axis=0), axis=1)) < 3.0
    if frame != "base":
        assert np.allclose(np.linalg.norm(found[:, :3], axis=1), np.sqrt(1400))


def test_the_way_of_a_full_circle_is_its_length():
    """A full circle ends where it begins; it still has a direction, and is no turn on the spot."""
    result = run(arc_path(2 * np.pi), "10,0,0@feed")
    assert result.findings == ()
    assert np.allclose(at(result, 1, 0, 0.5, 1)[:, :3], [[0, 10, 0], [0, -10, 0], [0, 10, 0]])


def test_no_force_is_none_anywhere():
    result = run(arc_path(1.0), None)
    assert np.all(at(result, 1, 0, 0.5, 1) == 0)
    assert not result.steps.any()


def test_lines_and_arcs_may_be_asked_for_together():
    result = run(arc_path(90 * DEG, before=[0.1, -0.2, 0]), "10,20,30@feed")
    rows, fraction = np.array([1, 2, 1, 2, 2]), np.array([0.5, 0.5, 1.0, 1.0, 0.0])
    alone = [at(result, row, share)[0] for row, share in zip(rows, fraction, strict=True)]
    assert np.allclose(result.along(rows, fraction), alone)
    assert np.allclose(alone[1][:3], np.sqrt(0.5) * np.array([-30, -10, 0]) + [0, 0, 30])
