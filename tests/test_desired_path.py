"""The wanted ways: where they begin, how long they are, and where one is at a share of each; pieces of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from motions import motions
from plant import kr270
from scipy.spatial.transform import Rotation, Slerp

import postproc.base.batches
from postproc.base.geometry import Poses, rotation_from_abc, rotation_from_vector
from postproc.compensation.desired_path import DesiredPath, interpolate_poses, start_poses
from postproc.compensation.path_error import PathSegments
from postproc.robot.axis_track import AxisTrack
from postproc.toolpath import Arcs, Kind

BASE = Poses(rotation_from_abc([0.4, -0.3, 1.1]), np.array([1.2, -0.3, 0.4]))
TOOLS = (
    Poses(np.eye(3), np.array([0.0, 0.0, 0.2])),
    Poses(rotation_from_vector([0.2, 0.5, -0.1]), np.array([0.05, 0.1, 0.3])),
)
NAN = np.nan
K = Kind


def tiled(pose, count):
    return Poses(np.tile(pose.rotation, (count, 1, 1)), np.tile(pose.position, (count, 1)))


def every(kinds, tools=None, axes=None, lost=(), turnless=(), arcs=None, seed=3, steps=0.1):
    """Ways of motions to random targets in a turned base.  ``axes``: row -> joint values, known even where the target
    is not; ``lost``: rows without a target, ``turnless``: without an orientation; ``arcs``: row -> centre, normal,
    sweep in the base."""
    rng, n, robot = np.random.default_rng(seed), len(kinds), kr270()
    position = rng.normal(0.0, steps, (n, 3))
    rotation = rotation_from_vector(rng.normal(0.0, 0.5, (n, 3)))
    centre, normal, sweep = np.full((n, 3), NAN), np.full((n, 3), NAN), np.full(n, NAN)
    for row, arc in (arcs or {}).items():
        centre[row], normal[row], sweep[row] = arc[:3]
        away = position[row - 1] - centre[row]
        centre[row] += normal[row] * (away @ normal[row])  # at the height of the begin
        radius = position[row - 1] - centre[row]
        position[row] = centre[row] + rotation_from_vector(sweep[row] * normal[row]) @ radius
        position[row] += arc[3] * normal[row]
    position[list(lost)], rotation[list(lost)], rotation[list(turnless)] = NAN, NAN, NAN
    target = Poses(rotation, position)
    path = motions(target, np.array(kinds), arcs=Arcs(centre, normal, sweep))
    chosen = np.zeros(n, int) if tools is None else np.array(tools)
    path = path.with_columns(tool=chosen)
    tool = Poses(*(np.stack([getattr(TOOLS[t], name) for t in chosen]) for name in ("rotation", "position")))
    q = np.full((n, 6), NAN)
    for row, values in (axes or {}).items():
        q[row] = values
    yes = np.ones(n, bool)
    track = AxisTrack(q, np.full(n, 2), yes, yes, yes)
    base = tiled(BASE, n)
    wanted = base @ target
    return DesiredPath.of(path, wanted, base, tool, robot, track), wanted, tool, track


AXES = np.radians([10.0, -70.0, 95.0, 15.0, 50.0, 30.0])
PROGRAM = {
    "kinds": [
        K.LIN,
        K.LIN,
        K.PTP,
        K.LIN,
        K.AXIS,
        K.LIN,
        K.OTHER,
        K.LIN,
        K.LIN,
        K.LIN,
        K.LIN,
        K.AXIS,
        K.PTP,
        K.LIN,
    ],
    "axes": {4: AXES},
    "lost": [4, 6, 11],
    "turnless": [9],
    "tools": [0, 0, 0, 1, 1, 0, 0, 1, 1, 1, 1, 1, 0, 0],
}
KNOWN = [0, 1, 0, 1, 0, 1, 0, 0, 1, 0, 0, 0, 0, 1]
"""The first begins nowhere; behind the unknown target of row 6 nothing begins, nor behind the turn that is not known
of row 9; behind known axes a way begins where they bring the tool."""


@pytest.mark.parametrize("rows", [1, 3, 1 << 13])
def test_a_way_is_known_from_a_known_place_to_a_known_place(monkeypatch, rows):
    monkeypatch.setattr(postproc.base.batches, "ROWS", rows)
    ways, wanted, tool, _ = every(**PROGRAM)
    assert ways.traceable.tolist() == [bool(known) for known in KNOWN]
    begin = ways.start[:]
    for row in np.flatnonzero(ways.traceable):
        if row == 5:
            start = kr270().nominal_chain.flange(AXES[None])[0] @ tool[row]
        else:
            start = wanted[row - 1] @ tool[row - 1].inverse() @ tool[row]
        np.testing.assert_allclose(begin.position[row], start.position, atol=1e-14)
        np.testing.assert_allclose(begin.rotation[row], start.rotation, atol=1e-14)
        assert ways.length[row] == pytest.approx(np.linalg.norm(wanted.position[row] - start.position))
    assert not ways.length[~ways.traceable].any()
    assert not ways.arc.any()


@pytest.mark.parametrize("kind", list(Kind))
def test_only_of_lines_and_arcs_the_way_is_known(kind):
    arcs = {1: ARCS["a quarter"]} if kind == Kind.CIRC else {}
    ways = every([K.LIN, kind, K.LIN], arcs=arcs)[0]
    assert ways.traceable.tolist() == [False, kind in (Kind.LIN, Kind.CIRC), True]


def test_where_the_motion_before_is_not_known_a_motion_begins_nowhere():
    _, wanted, tool, track = every(**PROGRAM)
    path = every(**PROGRAM)[0].path
    begin = start_poses(wanted, path, tool, kr270(), track)
    assert len(begin) == len(path)
    lost = [0, 7, 12]
    assert np.isnan(begin[lost].position).all()
    assert np.isnan(begin[lost].rotation).all()
    assert np.isfinite(np.delete(begin[:].position, lost, axis=0)).all()
    assert np.isnan(begin[[10]].rotation).all()
    # asked for alone or in another order, each is where it is
    order = np.array([5, 3, 13, 1])
    np.testing.assert_array_equal(begin[order].position, begin[:].position[order])
    # the axes of the first motion do not make it begin there
    first = replace(track, q=np.tile(AXES, (len(path), 1)))
    unknown = path.with_columns(tool=np.full(len(path), -1))
    assert np.isnan(start_poses(wanted, unknown, tool, kr270(), first)[[0]].position).all()
    # axes of which some are not known bring the tool nowhere
    q = np.array(track.q)
    q[4, 2] = NAN
    assert np.isnan(start_poses(wanted, path, tool, kr270(), replace(track, q=q))[[5]].position).all()


UP, TILTED = np.array([0.0, 0.0, 1.0]), np.array([0.36, 0.48, 0.8])
ARCS = {
    "a quarter": (np.array([0.1, 0.0, 0.05]), UP, np.pi / 2, 0.0),
    "most of a circle": (np.array([0.3, -0.2, 0.0]), -UP, 5.0, 0.0),
    "a whole one": (np.array([0.0, 0.4, 0.3]), TILTED, 2 * np.pi, 0.0),
    "a helix": (np.array([0.1, 0.1, 0.1]), TILTED, 4.0, 0.07),
    "a helix that sinks": (np.array([0.1, 0.1, 0.1]), TILTED, 7.5, -0.07),
}


@pytest.mark.parametrize("arc", ARCS)
def test_an_arc_leads_round_its_centre_and_along_its_normal(arc):
    ways, wanted, _, _ = every([K.LIN, K.LIN, K.CIRC, K.LIN], arcs={2: ARCS[arc]})
    normal, sweep, rise = ARCS[arc][1:]
    centre = ways.path.arcs.centre[2]
    assert ways.traceable.tolist() == [False, True, True, True]
    assert ways.arc.tolist() == [False, False, True, False]
    there = BASE @ Poses(np.eye(3), centre)
    found = ways.circles(np.array([2]))
    np.testing.assert_allclose(found[0][0], there.position, atol=1e-14)
    np.testing.assert_allclose(found[1][0], BASE.rotation @ normal, atol=1e-14)
    assert found[2].tolist() == [sweep]
    axis = BASE.rotation @ normal
    radius = np.linalg.norm(wanted.position[1] - there.position)
    assert ways.length[2] == pytest.approx(np.hypot(radius * sweep, rise), rel=1e-12)
    share = np.linspace(0.0, 1.0, 2001)
    rows = np.full(2001, 2)
    points = ways.at(rows, share)
    np.testing.assert_allclose(points.position[[0, -1]], wanted.position[[1, 2]], atol=1e-13)
    out = points.position - there.position
    np.testing.assert_allclose(out @ axis, share * rise, atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(out - np.outer(out @ axis, axis), axis=1), radius, atol=1e-13)
    steps = np.diff(points.position, axis=0)
    assert np.linalg.norm(steps, axis=1).sum() == pytest.approx(ways.length[2], rel=1e-5)
    middle = ways.tangent(rows[1:], share[1:] - 0.5 / 2000)
    np.testing.assert_allclose(np.linalg.norm(middle, axis=1), 1.0, atol=1e-12)
    assert np.sum(middle * steps, axis=1).min() > 0.99999 * np.linalg.norm(steps, axis=1).min()


def test_ways_of_lines_and_arcs_among_each_other():
    """Each is where it is alone; orientations turn evenly, as scipy has it."""
    ways, wanted, _, _ = every(
        [K.LIN, K.LIN, K.CIRC, K.LIN, K.CIRC, K.LIN], arcs={2: ARCS["a helix"], 4: ARCS["a quarter"]}
    )
    rows, share = np.array([4, 1, 2, 5, 3, 2]), np.array([0.3, 0.25, 0.0, 1.0, 0.9, 0.75])
    found, tangent = ways.at(rows, share), ways.tangent(rows, share)
    for k, (row, part) in enumerate(zip(rows, share, strict=True)):
        alone = ways.at(rows[k : k + 1], share[k : k + 1])
        np.testing.assert_array_equal(found.position[k], alone.position[0])
        np.testing.assert_array_equal(tangent[k], ways.tangent(rows[k : k + 1], share[k : k + 1])[0])
        turns = Rotation.from_matrix(wanted.rotation[row - 1 : row + 1])
        np.testing.assert_allclose(found.rotation[k], Slerp([0, 1], turns)(part).as_matrix(), atol=1e-12)
        if row in (1, 3, 5):
            way = wanted.position[row] - wanted.position[row - 1]
            np.testing.assert_allclose(found.position[k], wanted.position[row - 1] + part * way, atol=1e-14)
            np.testing.assert_allclose(tangent[k], way / np.linalg.norm(way), atol=1e-14)


@pytest.mark.parametrize(("length", "leads"), [(0.0, 0.0), (0.9e-7, 0.0), (1.1e-7, 1.0), (1.0, 1.0)])
def test_a_motion_that_leads_nowhere_has_no_tangent(length, leads):
    ways, wanted, _, _ = every([K.LIN, K.LIN])
    end = wanted.position.copy()
    end[1] = end[0] + length * np.array([0.6, 0.0, -0.8])
    ways = replace(ways, end=Poses(wanted.rotation, end))
    np.testing.assert_allclose(
        ways.tangent(np.array([1]), np.array([0.5]))[0], leads * np.array([0.6, 0.0, -0.8]), atol=1e-8
    )


def test_between_two_poses_the_share_of_each_counts():
    rng = np.random.default_rng(7)
    one, other = (
        Poses(rotation_from_vector(rng.normal(0.0, 0.6, (4, 3))), rng.normal(size=(4, 3))) for _ in range(2)
    )
    share = np.array([0.0, 0.25, 0.5, 1.0])
    found = interpolate_poses(one, other, share)
    np.testing.assert_allclose(
        found.position, one.position + share[:, None] * (other.position - one.position)
    )
    for k in range(4):
        turn = Slerp([0, 1], Rotation.from_matrix([one.rotation[k], other.rotation[k]]))(share[k])
        np.testing.assert_allclose(found.rotation[k], turn.as_matrix(), atol=1e-12)


# pieces


def posed(*points):
    return Poses(np.tile(np.eye(3), (len(points), 1, 1)), np.array(points, float))


def test_pieces_through_three_points_lie_in_their_plane_or_turn_about_the_normal_that_is_given():
    """A half circle about -y through three points; the same points about z, seen from above on a circle and rising;
    three points on a line, which make none."""
    begin = posed([1, 0, 0], [1, 0, 0], [0, 0, 0], [1, 0, 0.2])
    via = posed([0, 0, 1], [0, 1, 0.3], [1, 0, 0], [0, 1, 0.3])
    end = posed([-1, 0, 0], [-1, 0, 0.5], [2, 0, 0], [-1, 0, 0.5])
    normal = np.array([[NAN] * 3, [0, 0, 1.0], [NAN] * 3, [0, 0, -1.0]])
    rows, first, last = np.arange(4), np.full(4, 0.1), np.full(4, 0.6)
    arcs = PathSegments.round(rows, first, last, begin, via, end, normal)
    assert len(arcs) == 4
    np.testing.assert_allclose(arcs.centre[:2], [[0, 0, 0], [0, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(arcs.normal[:2], [[0, -1, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(arcs.sweep[:2], np.pi)
    for values in (arcs.centre, arcs.normal, arcs.sweep):
        assert np.isnan(values[2:]).all()  # the last ones run the other way round
    middle = arcs[np.arange(2)].at(np.full(2, 0.5)).position
    np.testing.assert_allclose(middle, [[0, 0, 1], [0, 1, 0.25]], atol=1e-12)
    quarter = arcs[np.array([1, 0])].at(np.array([0.25, 0.75])).position
    half = np.sqrt(0.5)
    np.testing.assert_allclose(quarter, [[half, half, 0.125], [-half, 0, half]], atol=1e-12)


def test_pieces_that_are_chosen_are_the_same_pieces():
    rng = np.random.default_rng(8)
    begin, end = (
        Poses(rotation_from_vector(rng.normal(size=(5, 3))), rng.normal(size=(5, 3))) for _ in range(2)
    )
    pieces = PathSegments.straight(
        np.arange(5) + 7, np.linspace(0, 0.4, 5), np.linspace(0.5, 0.9, 5), begin, end
    )
    assert np.isnan(pieces.sweep).all()
    pieces = replace(
        pieces,
        centre=rng.normal(size=(5, 3)),
        normal=np.tile(UP, (5, 1)),
        sweep=np.array([1.0, NAN, 2.0, NAN, 3.0]),
    )
    order = np.array([3, 0, 4])
    part = pieces[order]
    assert len(part) == 3
    for name in ("rows", "first", "last", "centre", "normal", "sweep"):
        np.testing.assert_array_equal(getattr(part, name), getattr(pieces, name)[order])
    share = np.array([0.2, 0.4, 0.6, 0.8, 1.0])
    for name in ("rotation", "position"):
        np.testing.assert_array_equal(
            getattr(part.at(share[order]), name), getattr(pieces.at(share), name)[order]
        )
    straight = begin.position + share[:, None] * (end.position - begin.position)
    found = pieces.at(share).position
    np.testing.assert_allclose(found[[1, 3]], straight[[1, 3]], atol=1e-12)
    np.testing.assert_allclose(found[4], end.position[4], atol=1e-12)
    assert np.linalg.norm((found - straight)[[0, 2]], axis=1).min() > 0.01
