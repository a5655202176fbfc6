"""Laws of rounded paths: what a stiff tool is off is the distance of two drawn curves; a tool that yields in proportion
to the force has closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree
from spring_cases import AT, MM, drawn, output, spring, with_ramp

from postproc.compensation.corners import evaluate_corners
from postproc.compensation.path_error import PathSegments, path_errors_at
from postproc.compensation.rounded_path import RoundedOutput, deviations, extents, original, original_reach

ZIGZAG = (
    np.array([[-30, -10, 0], [-20, 0, 0], [0, 0, 0], [3, 12, 0], [18, 15, 6], [25, 2, 0], [50, 0, 0]]) * MM
)
INSERTED = [(3, 0.4, [0.05 * MM, 0.02 * MM, 0.0], 2e-3), (3, 0.7, [0.03 * MM, -0.04 * MM, 0.0], -1e-3),
            (5, 0.5, [0.0, 0.06 * MM, 0.05 * MM], 0.0)]  # fmt: skip


def zigzag(reach: float):
    """A path of lines that a stiff tool follows, and an output some hundredths of a millimetre beside it."""
    n = len(ZIGZAG)
    approximation = np.full(n, reach * MM) * np.linspace(0.8, 1.2, n)
    approximation[4] = 0.0  # passed exactly
    job = spring(ZIGZAG, [False] + [True] * (n - 1), approximation=approximation)
    rng = np.random.default_rng(7)
    shifts = rng.uniform(-0.08, 0.08, (n, 3)) * MM
    turns = rng.uniform(-2e-3, 2e-3, n)
    return job, output(job, shifts, INSERTED, turns), approximation


def curves(job, division, approximation):
    """Both drawn, with the turn about z as the fourth number, and the lines to which their places belong."""
    from postproc.base.geometry import turn_between

    count = len(division)
    command = division.command[np.arange(count)]
    turn = turn_between(np.tile(job.wanted[np.array([0])].rotation, (count, 1, 1)), command.rotation)[:, 2]
    points = np.column_stack([command.position, turn])
    # what is inserted is rounded off as far as the end of its motion, before an exact end not known: half of the motion
    blend = approximation[division.source]
    blend = np.where((division.share < 1.0) & (blend == 0), np.inf, blend)
    return drawn(np.column_stack([AT + ZIGZAG, np.zeros(len(ZIGZAG))]), approximation), drawn(points, blend)


def distances(base, places):
    """(S,) [m] of places (S, 3) from the lines through ``base`` (B, 3)."""
    _, nearest = cKDTree(base).query(places)
    found = np.full(len(places), np.inf)
    for shift in (-2, -1, 0, 1):
        low = np.clip(nearest + shift, 0, len(base) - 2)
        step = base[low + 1] - base[low]
        size = np.maximum(np.sum(step * step, axis=1), 1e-30)
        part = np.clip(np.sum((places - base[low]) * step, axis=1) / size, 0.0, 1.0)
        found = np.minimum(found, np.linalg.norm(base[low] + part[:, None] * step - places, axis=1))
    return found


@pytest.mark.parametrize("reach", [0.3, 2.0, 50.0])
def test_what_a_stiff_tool_is_off_is_the_distance_of_the_drawn_paths(reach):
    """Of every motion, from the middle of the parabola at its start to that at its end."""
    job, division, approximation = zigzag(reach)
    (base, _), (path, line) = curves(job, division, approximation)
    away = distances(base[:, :3], path[:, :3])
    motions = np.arange(2, len(division))
    off, angle = RoundedOutput(job, division, motions).largest(motions)
    for k, motion in enumerate(motions):
        own = line == motion - 1
        # beside the exact point the nearest place leaps; at the end of the path none is square to it
        plain = motion not in (6, 7, len(division) - 1)
        assert off[k] == pytest.approx(away[own].max(), rel=5e-3 if plain else 0.02)
        assert angle[k] == pytest.approx(np.abs(path[own, 3]).max(), rel=0.01, abs=1e-7)
    # some alone are as off as all together
    some = motions[[1, 4, 5]]
    alone = RoundedOutput(job, division, some).largest(some)
    np.testing.assert_allclose(alone[0], off[[1, 4, 5]], rtol=1e-6)
    np.testing.assert_allclose(alone[1], angle[[1, 4, 5]], rtol=1e-6)


@pytest.mark.parametrize("reach", [0.3, 2.0, 50.0])
def test_the_controller_is_sent_along_the_drawn_path(reach):
    """At all shares of all motions, parabolas included; and the middle of a corner is reached from both sides."""
    job, division, approximation = zigzag(reach)
    _, (path, line) = curves(job, division, approximation)
    motions = np.arange(1, len(division))
    out = RoundedOutput(job, division, motions)
    assert out.motions.tolist() == motions.tolist()
    np.testing.assert_allclose(
        out.extent, np.linalg.norm(np.diff(division.command.position, axis=0), axis=1), rtol=1e-12
    )
    for k, motion in enumerate(motions):
        share = np.linspace(0.0, 1.0, 101)
        at = np.full(101, k)
        found = out.commands(out.blend(at, share)).position
        own = path[line == motion - 1, :3]
        assert distances(own, found).max() < 2e-8
        # and all of its part of the path is passed
        assert distances(found, own).max() < 3e-5
        straight = np.abs(share - 0.5).argmin()
        line_middle = 0.5 * (division.command.position[motion - 1] + division.command.position[motion])
        if max(out.reach[k], out.reach[k - 1] if k else 0.0) < 0.49 * out.extent[k]:
            np.testing.assert_allclose(found[straight], line_middle, atol=1e-12)
    ends = out.commands(out.blend(np.arange(len(motions) - 1), np.ones(len(motions) - 1))).position
    starts = out.commands(out.blend(np.arange(1, len(motions)), np.zeros(len(motions) - 1))).position
    np.testing.assert_allclose(ends, starts, atol=1e-12)
    # the middle of a parabola lies d / 4 of the turn of its sides away from the point
    unit = np.diff(division.command.position, axis=0) / out.extent[:, None]
    middle = division.command.position[1:-1] + 0.25 * out.reach[:-1, None] * (unit[1:] - unit[:-1])
    np.testing.assert_allclose(ends, middle, atol=1e-12)


def test_parabolas_join_motions_that_go_on_with_the_same_tool():
    """No farther than half of either motion; none where the next motion starts elsewhere, or with another tool."""
    n = len(ZIGZAG)
    length = np.linalg.norm(np.diff(ZIGZAG, axis=0), axis=1)  # of the motions 1 .. 6
    half = 0.5 * np.minimum(length[:-1], length[1:])
    for continues, tool, joined in (
        (np.ones(n, bool), np.ones(n), [True] * 5),
        (np.arange(n) != 4, np.ones(n), [True, True, False, True, True]),
        (np.ones(n, bool), np.where(np.arange(n) < 3, 1, 2), [True, False, True, True, True]),
        (np.ones(n, bool), np.where(np.arange(n) < 3, 2, 1), [True, False, True, True, True]),
    ):
        job = spring(
            ZIGZAG, [False] + [True] * (n - 1), approximation=np.full(n, 6.0 * MM), continues=continues
        )
        path = job.toolpath.with_columns(tool=tool)
        path = path.with_columns(frames=path.frames * 2)
        from dataclasses import replace

        job = replace(job, toolpath=path)
        expected = np.where(joined, np.minimum(6.0 * MM, half), 0.0)
        known = job.desired_path.traceable[1:-1] & job.desired_path.traceable[2:]
        expected = np.where(known, expected, 0.0)
        found = original_reach(job, np.arange(1, n - 1))
        np.testing.assert_allclose(found, expected, rtol=1e-9)
        assert (original_reach(job, np.array([-1, n - 1])) == 0).all()
        out = RoundedOutput(job, output(job, np.zeros((n, 3))), np.arange(1, n))
        reach = out.reach[np.isin(out.motions, np.arange(1, n - 1))]
        np.testing.assert_allclose(reach, expected[np.isin(np.arange(1, n - 1), out.motions)], rtol=1e-9)


def test_what_nothing_states_is_taken_for_the_largest_parabola():
    n = len(ZIGZAG)
    approximation = np.full(n, np.nan)
    job = spring(ZIGZAG, [False] + [True] * (n - 1), approximation=approximation)
    out = RoundedOutput(job, output(job, np.zeros((n, 3))), np.arange(1, n))
    length = np.linalg.norm(np.diff(ZIGZAG, axis=0), axis=1)
    np.testing.assert_allclose(out.reach[:-1], 0.5 * np.minimum(length[:-1], length[1:]), rtol=1e-9)
    assert out.reach[-1] == 0


@pytest.mark.parametrize("reach", [0.3, 2.0, 50.0])
def test_the_original_and_its_tangent_are_the_drawn_path(reach):
    job, _, approximation = zigzag(reach)
    base, line = drawn(AT + ZIGZAG, approximation, count=2001)
    tree = cKDTree(base)
    for row in range(1, len(ZIGZAG)):
        share = np.linspace(0.001, 0.999, 57)
        poses, tangent = original(job, np.full(57, row), share)
        distance, nearest = tree.query(poses.position)
        assert distance.max() < 0.01 * MM
        ahead = base[np.minimum(nearest + 1, len(base) - 1)] - base[np.maximum(nearest - 1, 0)]
        size = np.linalg.norm(ahead, axis=1)
        cosine = np.sum(ahead * tangent, axis=1) / np.maximum(size, 1e-12)
        inner = size > 1e-9
        assert np.median(cosine[inner]) > 1.0 - 1e-6
        assert cosine[inner].min() > 0.8 if reach < 1 else cosine[inner].min() > 0.99
        np.testing.assert_allclose(np.linalg.norm(tangent, axis=1), 1.0, atol=1e-12)
    del line


def test_a_place_is_found_from_the_motions_beside_it():
    """Looked for from the neighbouring motion, the nearest place of the path is the same."""
    job, _, _ = zigzag(0.3)
    on = job.desired_path.at(np.array([3, 3, 5]), np.array([0.05, 0.5, 0.9]))
    aside = np.cross(job.desired_path.tangent(np.array([3, 3, 5]), np.full(3, 0.5)), [0.0, 0.6, 0.8])
    on.position[:] += 0.02 * MM * aside / np.linalg.norm(aside, axis=1)[:, None]
    found = deviations(job, on, np.array([2, 3, 6]), np.array([0.99, 0.45, 0.02]))
    np.testing.assert_array_equal(found.row, [3, 3, 5])
    np.testing.assert_allclose(found.share, [0.05, 0.5, 0.9], atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(found.shift, axis=1), 0.02 * MM, rtol=1e-6)
    # where a cut is entered or left it is an error to be ahead as well
    at = np.array([3, 3])
    ahead = job.desired_path.at(at, np.array([0.5, 0.5]))
    ahead.position[:] += 0.03 * MM * job.desired_path.tangent(at, np.array([0.5, 0.5]))
    free = deviations(job, ahead, at, np.array([0.5, 0.5]), np.array([True, False]))
    np.testing.assert_allclose(np.linalg.norm(free.shift, axis=1), [0.03 * MM, 0.0], atol=1e-9)


def test_where_a_program_ends_in_its_cut_it_is_no_error_to_be_ahead():
    job = spring(LINE, [False, True, True, True], approximation=np.full(4, 1.0 * MM))
    shifts = np.zeros((4, 3))
    shifts[3, 0] = 0.03 * MM
    ended = RoundedOutput(job, output(job, shifts), np.arange(4))
    found = ended.deviations(ended.place(np.array([3])), np.ones(1))
    np.testing.assert_allclose(found.shift, 0.0, atol=1e-9)


@pytest.mark.parametrize("distance", [0.0, 0.4, 3.0])
def test_where_a_cut_is_entered_or_left_without_a_stop_it_is_an_error_to_be_ahead(distance):
    """There the part shows it, as in a corner; with a stop, and inside of the cut, nothing marks it."""
    points = np.array([[-60, 0, 0], [-50, 0, 0], [0, 0, 0], [70, 0, 0], [100, 0, 0]]) * MM
    job = spring(points, [False, False, True, True, False], approximation=np.full(5, distance * MM))
    shifts = np.zeros((5, 3))
    shifts[:, 0] = np.array([0, 0.03, 0.02, -0.04, 0.01]) * MM
    run = RoundedOutput(job, output(job, shifts), np.arange(5))
    found = run.deviations(run.place(np.array([2, 2, 3, 3])), np.array([0.0, 1.0, 0.0, 1.0]))
    along = np.array([0.03, 0, 0, -0.04]) * MM * (distance > 0)
    np.testing.assert_allclose(found.shift, along[:, None] * [1.0, 0, 0], atol=1e-9)


LINE = np.array([[-60, 0, 0], [-50, 0, 0], [0, 0, 0], [100, 0, 0]]) * MM


@pytest.mark.parametrize("along", [-2e-5, 0.0, 3e-5])
@pytest.mark.parametrize("place", [1.0, 3.5, 6.0, 20.0])
def test_a_tool_that_yields_has_the_force_of_the_place_where_it_is(along, place):
    """Sent to x, it is at s = x + a f(s) with the force f(s) of that place, which changes evenly over 5 mm: s is known,
    and across the path it is off by b f(s)."""
    across, before, step = 1e-6, 20.0, 60.0
    compliance = np.zeros((3, 3))
    compliance[0, 0], compliance[1, 0] = along, across
    force = np.zeros((4, 3))
    force[1:3, 0], force[3, 0] = before, before + step
    for approximation in (np.zeros(4), np.full(4, np.nan)):
        job = spring(LINE, [False, True, True, True], compliance, force, approximation=approximation)
        job = with_ramp(job, [3], [[step, 0, 0]], [5 * MM])
        x = place * MM
        s = (x + along * before) / (1 - along * step / (5 * MM))
        if s >= 5 * MM:
            s = x + along * (before + step)
        here = before + step * min(s / (5 * MM), 1.0)
        command = job.desired_path.at(np.array([3]), np.array([x / 0.1]))
        found = deviations(job, command, np.array([3]), np.array([x / 0.1]))
        assert found.row[0] == 3
        assert found.share[0] * 0.1 == pytest.approx(s, abs=3e-8)
        np.testing.assert_allclose(found.shift[0], [0.0, across * here, 0.0], atol=1e-9)
        if np.isnan(approximation).all():  # the same without a rounded path
            rows, share = np.array([3]), np.array([x / 0.1])
            start, end = job.desired_path.at(rows, share - 0.02), job.desired_path.at(rows, share + 0.02)
            if place < 2.5:
                continue
            piece = PathSegments.straight(rows, share - 0.02, share + 0.02, start, end)
            off, _ = path_errors_at(job, piece, share)
            assert off[0] == pytest.approx(across * here, abs=1e-9)


@pytest.mark.parametrize("ramp", [3.7, 5.0, 11.3])
def test_the_largest_error_is_where_the_force_turns(ramp):
    """The output goes straight over a ramp of the force: what is off is a triangle with its tip where the ramp ends."""
    across, step = 2e-6, 60.0
    compliance = np.zeros((3, 3))
    compliance[1, 0] = across
    force = np.zeros((4, 3))
    force[3, 0] = step
    job = spring(LINE, [False, True, True, True], compliance, force, approximation=np.zeros(4))
    job = with_ramp(job, [3], [[step, 0, 0]], [ramp * MM])
    shifts = np.zeros((4, 3))
    shifts[3, 1] = -across * step
    division = output(job, shifts)
    out = RoundedOutput(job, division, np.array([3]))
    tip = across * step * (1.0 - ramp / 100.0)
    off, angle = out.largest(np.array([3]))
    assert off[0] == pytest.approx(tip, rel=2e-5)
    assert angle[0] == pytest.approx(0.0, abs=1e-9)
    # nearer than samples alone: at any sample the ramp's end is missed
    shares = np.array([[0.0, 0.3 * ramp / 100, 0.7 * ramp / 100, 1.4 * ramp / 100, 0.5]])
    at = np.broadcast_to(out.place(np.array([3])), shares.shape)
    assert out.peaks(at, shares)[0][0] == pytest.approx(tip, rel=2e-5)
    # without a closer look what the samples see
    plain = out.peaks(at, shares, closer=0)[0][0]
    seen = [abs(-across * step * s + across * step * min(100 * s / ramp, 1.0)) for s in shares[0]]
    assert plain == pytest.approx(max(seen), rel=1e-6)
    turns = out.turns
    assert [3.0, pytest.approx(ramp / 100)] in turns.tolist()


def test_how_long_lines_arcs_and_helices_are():
    rows, none = np.array([0, 0, 0]), np.zeros(3)
    rotation = np.tile(np.eye(3), (3, 1, 1))
    from postproc.base.geometry import Poses

    start = Poses(rotation, np.array([[1.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]))
    end = Poses(rotation, np.array([[4.0, 4.0, 0], [0, 1.0, 0], [0, 2.0, 3.0]]))
    centre, normal = np.zeros((3, 3)), np.tile([0.0, 0.0, 1.0], (3, 1))
    sweep = np.array([np.nan, np.pi / 2, np.pi / 2])
    segments = PathSegments(rows, none, none + 1, start, end, centre, normal, sweep)
    np.testing.assert_allclose(extents(segments), [5.0, np.pi / 2, np.hypot(np.pi, 3.0)])


@pytest.mark.parametrize("distance", [0.5, 3.0])
def test_a_corner_that_is_moved_is_off_by_so_much_in_its_middle(distance):
    """A stiff tool, all points moved by one shift: beside the corner it is off by its part across either line, in the
    middle by that across the bisector."""
    points = np.array([[-40, -10, 0], [-40, 0, 0], [0, 0, 0], [0, 40, 0], [0, 50, 0]]) * MM
    job = spring(points, [False, True, True, True, True], approximation=np.full(5, distance * MM))
    shift = np.array([2.0, 1.0, 1.5]) * 1e-6
    division = output(job, np.tile(shift, (5, 1)))
    out = RoundedOutput(job, division, np.array([2]))
    reach, off, angle = evaluate_corners(out, np.array([2]))
    assert reach[0] == pytest.approx(distance * MM)
    across = [np.linalg.norm(np.delete(shift, 0)), np.linalg.norm(np.delete(shift, 1))]
    toward = np.array([1.0, 1.0, 0.0]) / np.sqrt(2)
    middle = np.linalg.norm(shift - (shift @ toward) * toward)
    for samples, expected in (([-1.0], across[0]), ([1.0], across[1]), ([0.0], middle)):
        assert evaluate_corners(out, np.array([2]), np.array(samples))[1][0] == pytest.approx(
            expected, rel=2e-3
        )
    assert off[0] == pytest.approx(max(across), rel=2e-3)
    assert angle[0] < 1e-9
