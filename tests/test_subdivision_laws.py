"""Divisions as a whole: which motions there are, where each ends, what is inserted and why some can not be."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cache

import numpy as np
import pytest
from path_cases import FORCE, circle, commands, corner, in_even_pieces, line
from path_cases import task as at_points
from test_mirror import CARRIES
from test_mirror import task as joints_task

from postproc.base.geometry import Poses, arc_through, rotation_from_vector
from postproc.compensation.correct import correct
from postproc.compensation.divisible_motions import ROOM, DivisibleMotions
from postproc.compensation.mirror import pose_error
from postproc.compensation.path_error import path_errors
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.refinement import allocate
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits, subdivided_motions
from postproc.toolpath import Arcs, EditConstraints, Kind, Role

FREE = Limits(max_growth=100.0)
OWN, PIECE, LINK = Role.ORIGINAL, Role.INTERMEDIATE, Role.TRANSITION


def divided(job, limits=FREE):
    result = correct(job)
    return result, subdivide(job, result, limits)


def planar(job):
    arcs = replace(job.toolpath.arcs, plane_free=np.zeros(len(job.toolpath), bool))
    return replace(job, toolpath=replace(job.toolpath, arcs=arcs))


def mixed(**words):
    """A line, an arc that rises, a line in air, an arc in air, and a cut again."""
    n = 8
    points = np.array(
        [
            [1.5, -0.3, 0.6], [1.5, -0.3, 0.5], [1.5, 0.1, 0.5], [1.7, 0.3, 0.55], [1.7, 0.3, 0.6], [1.6, 0.2, 0.6],
            [1.6, 0.1, 0.5], [1.6, 0.0, 0.6],
        ]
    )  # fmt: skip
    kinds = [Kind.LIN, Kind.PTP, Kind.LIN, Kind.CIRC, Kind.LIN, Kind.CIRC, Kind.LIN, Kind.LIN]
    centre, normal, sweep = np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)
    centre[3], normal[3], sweep[3] = [1.7, 0.1, 0.5], [0, 0, -1.0], 0.5 * np.pi
    centre[5], normal[5], sweep[5] = [1.65, 0.25, 0.6], [0, 0, 1.0], np.pi
    carries = np.isin(np.arange(n), [2, 3, 6])
    return at_points(points, carries, kinds, arcs=Arcs(centre, normal, sweep), **words)


JOBS = {
    "line": lambda **words: line(**words),
    "line without points": lambda **words: line(tolerance=1.0, **words),
    "corner": lambda **words: corner(**words),
    "circle": lambda **words: circle(**words),
    "circle in its plane": lambda **words: planar(circle(sweep=4.0, rise=0.05, **words)),
    "mixed": lambda **words: mixed(tolerance=5e-6, **words),
    "mixed in planes": lambda **words: planar(mixed(tolerance=5e-6, **words)),
    "air as well": lambda **words: replace(mixed(**words), process=False),
}


@cache
def as_needed(job):
    """A task, its correction, and that divided as it needs."""
    task = JOBS[job]()
    return (task, *divided(task))


@pytest.mark.sample(8)
@pytest.mark.parametrize("job", JOBS)
@pytest.mark.parametrize(
    "limits", [FREE, Limits(max_growth=1.5), Limits(no_insert=True)], ids=["free", "few", "none"]
)
def test_a_division_has_links_pieces_and_own_motions_where_they_belong(job, limits):
    task, result, division = as_needed(job)
    if limits is not FREE:
        division = subdivide(task, result, limits)
    n = len(task.toolpath)
    assert (np.diff(division.source) >= 0).all()
    assert set(division.source.tolist()) == set(range(n))
    assert division.inserted == len(division) - n
    whole = result.command[:]
    for row in range(n):
        group = np.flatnonzero(division.source == row)
        roles = division.role[group].tolist()
        linked = roles[0] == LINK
        count = len(group) - linked
        assert roles == [LINK] * linked + [PIECE] * (count - 1) + [OWN]
        np.testing.assert_allclose(
            division.share[group], [0.0] * linked + [(k + 1) / count for k in range(count)], rtol=1e-15
        )
        corrected = bool(result.corrected[row])
        moved = [True] * linked + [corrected] * count
        assert division.moved[group].tolist() == moved
        end = division.command[group[-1:]]
        np.testing.assert_array_equal(end.position[0], whole.position[row])
        np.testing.assert_array_equal(end.rotation[0], whole.rotation[row])
        if linked:
            begin = division.command[group[:1]]
            there = (
                commands(task, np.array([row]), np.zeros(1)) if corrected else task.desired_path.start[[row]]
            )
            for one, other in zip(pose_error(begin, there), (1e-8, 1e-8), strict=True):
                assert np.linalg.norm(one) < other
        if count > 1:
            assert corrected
            inner = group[linked:-1]
            there = commands(task, np.full(count - 1, row), division.share[inner])
            for one in pose_error(division.command[inner], there):
                assert np.linalg.norm(one, axis=1).max() < 1e-8
        # arcs stay arcs, through the place where the tool has to be in the middle of each
        arc = corrected and task.toolpath.kind[row] == Kind.CIRC
        curved = group[linked:]
        assert np.isfinite(division.sweep[curved]).tolist() == [arc] * count
        assert np.isnan(division.sweep[group[:linked]]).all()
        for name in ("centre", "normal"):
            assert (np.isfinite(getattr(division, name)).all(axis=1) == np.isfinite(division.sweep)).all()
        if arc:
            pieces = subdivided_motions(task, division, curved)
            middle = 0.5 * (pieces.first + pieces.last)
            via = commands(task, np.full(count, row), middle).position
            points = pieces.start.position, via, pieces.end.position
            if task.toolpath.arcs.plane_free[row]:
                for name, values in zip(("centre", "normal", "sweep"), arc_through(*points), strict=True):
                    np.testing.assert_allclose(getattr(division, name)[curved], values, atol=1e-7)
            else:
                normal = np.broadcast_to(task.desired_path.circles(np.array([row]))[1], (count, 3))
                np.testing.assert_array_equal(division.normal[curved], normal)
                out = [point - division.centre[curved] for point in points]
                out = [one - np.sum(one * normal, axis=1)[:, None] * normal for one in out]
                radius = [np.linalg.norm(one, axis=1) for one in out]
                np.testing.assert_allclose(radius[1], radius[0], atol=1e-9)
                np.testing.assert_allclose(radius[2], radius[0], atol=1e-9)
    assert not division.not_refined


@pytest.mark.parametrize("job", JOBS)
def test_as_many_pieces_as_the_tolerance_asks_for_and_no_more(job):
    task, result, division = as_needed(job)
    ways = np.flatnonzero(result.corrected & task.desired_path.traceable & task.carries)
    assert len(ways)
    for row in ways.tolist():  # others may begin with a step, which points do not mend
        count = int(np.sum((division.source == row) & (division.role != LINK)))
        least = (
            2
            if task.toolpath.kind[row] == Kind.CIRC and task.desired_path.sweep[row] > np.radians(300)
            else 1
        )
        for pieces, fits in ((count, True), (count - 1, False)):
            if pieces < least:
                continue
            off, angle = path_errors(task, in_even_pieces(task, division, row, pieces))
            parts = max(off.max() / task.tolerance, angle.max() / task.tolerance_angle)
            assert (parts <= ROOM) == fits


# links


def steps(task):
    """(N,) by how much the correction of each motion steps where it begins, in parts of the tolerance; and the error of
    its way in one piece from where the motion before it ends."""
    n = len(task.toolpath)
    result, division = divided(task, Limits(no_insert=True))
    size, left = np.zeros(n), np.zeros(n)
    for row in range(2, n):
        here = np.array([row])
        shift, turn = task.pose_errors(here, commands(task, here, np.zeros(1)), result.command[here - 1])
        size[row] = max(np.linalg.norm(shift) / task.tolerance, np.linalg.norm(turn) / task.tolerance_angle)
        off, angle = path_errors(task, subdivided_motions(task, division, here))
        left[row] = max(off[0] / task.tolerance, angle[0] / task.tolerance_angle)
    return size, left


@cache
def step_of(by, length):
    """A task with one step, and that step and what is left without a link in tolerances of one metre or radian."""
    task = line(length=length, tolerance=1.0 if by == "place" else 1e9)
    task = replace(task, tolerance_angle=1e9 if by == "place" else 1.0)
    size, left = steps(task)
    return task, size[2], left[2]


@pytest.mark.parametrize("part", [0.05, 0.09, 0.11, 0.5, 0.89, 0.91, 3.0])
@pytest.mark.parametrize("by", ["place", "angle"])
@pytest.mark.parametrize("length", [0.02, 0.8])
def test_a_link_where_the_correction_steps_by_more_than_its_part_of_the_tolerance(part, by, length):
    """Nine tenths; from a tenth on where the way would otherwise not fit into one piece."""
    task, size, left = step_of(by, length)
    name = "tolerance" if by == "place" else "tolerance_angle"
    expected = bool(part > ROOM or (part > 0.1 and left * part / size > ROOM))
    division = divided(replace(task, **{name: size / part}))[1]
    assert division.source[division.transitions].tolist() == [2] * expected


@pytest.mark.parametrize("part", [0.05, 0.11, 0.3, 0.6, 0.89])
def test_a_small_step_gets_a_link_where_the_way_behind_it_does_not_fit(part):
    """Here the force grows on the way: it errs by far more than it steps.  Where less than a tenth of the tolerance is
    stepped over, points alone have to do."""
    task = replace(line(start=0.02 * FORCE, tolerance=1.0), tolerance_angle=1e9)
    size, left = (values[2] for values in steps(task))
    assert left > 3 * size
    division = divided(replace(task, tolerance=size / part))[1]
    expected = part > 0.1 and left * part / size > ROOM
    assert division.source[division.transitions].tolist() == [2] * bool(expected)


def test_links_lead_only_to_motions_that_carry_force_and_are_corrected():
    """An absolute correction steps where the force begins and ends; behind it, in air, no link is made."""
    task = replace(line(), process=False)
    result, division = divided(task)
    assert result.corrected[1:].all()
    assert division.source[division.transitions].tolist() == [2]
    assert steps(task)[0][3] > 1.0


def test_an_arc_that_stays_begins_where_it_was_programmed():
    """With a link to there; where none may be inserted the motion before it is held."""
    task = again(circle(sweep=1.0), kind=[Kind.PTP, Kind.LIN, Kind.CIRC, Kind.LIN])
    carries = np.array([False, True, False, False])
    wrench = np.where(carries[:, None], FORCE, 0.0)
    task = replace(task, force=replace(task.force, carries=carries, values=wrench, start=wrench))
    division = divided(task)[1]
    assert division.source[division.transitions].tolist() == [1, 2]
    assert not division.not_refined
    said = "an uncorrected arc starts where this motion ends"
    for job, limits in (
        (task, Limits(no_insert=True)),
        (not_before(task, {2: "a TRIGGER"}), FREE),
    ):
        division = divided(job, limits)[1]
        assert [
            (row, one.code, one.message, one.file, one.line) for row, one in division.not_refined.items()
        ] == [(1, "COR013", said, "part.src", 11)]
        assert 2 not in division.source[division.transitions]
    # behind a motion that is not corrected, or by less than a nanometre, it begins where it is
    still = replace(task, force=replace(task.force, values=1e-9 * wrench, start=1e-9 * wrench))
    assert divided(still)[1].inserted == 0
    none = replace(task, force=replace(task.force, carries=~carries & carries))
    assert divided(none)[1].inserted == 0


def again(task, **words):
    return replace(task, toolpath=task.toolpath.with_columns(**words))


def not_before(task, why):
    """``task`` where no motion can be inserted before some; ``why``: row -> reason."""
    return again(task, constraints=EditConstraints(no_insert_before=why))


# what may be inserted


def test_a_long_way_that_goes_on_without_a_step_is_divided_only_where_it_may_be():
    points = [[1.6, -0.5, 0.6], [1.6, -0.5, 0.5], [1.6, -0.4, 0.5], [1.6, 0.4, 0.5], [1.6, 0.4, 0.6]]
    task = at_points(points, [False, False, True, True, False])
    result, division = divided(task)
    assert np.sum(division.source == 3) > 1
    assert 3 not in division.source[division.transitions]
    assert subdivide(task, result, Limits(no_insert=True)).inserted == 0
    assert np.sum(subdivide(not_before(task, {3: "a loop"}), result, FREE).source == 3) == 1


@pytest.mark.parametrize(
    ("least", "count"),
    [(0.81, 1), (0.8001, 1), (0.7999, 1), (0.41, 1), (0.3999, 2), (0.201, 3), (0.1999, 4), (5.0, 1)],
)
def test_no_piece_is_shorter_than_the_shortest_that_may_be(least, count):
    task = line(tolerance=1e-8)
    division = divided(task, Limits(min_segment=least, max_growth=50.0))[1]
    assert int(np.sum((division.source == 2) & ~division.transitions)) == count
    assert not division.findings


@pytest.mark.parametrize(
    ("growth", "most"), [(1.0, 0), (1.25, 1), (1.49, 1), (1.5, 2), (2.0, 4), (5.0, 16), (0.5, 0)]
)
def test_what_would_have_to_be_inserted_is_told(growth, most):
    """Of a tolerance that no number of pieces keeps: all that the limits leave."""
    task = line(tolerance=1e-9)
    division = divided(task, Limits(max_growth=growth))[1]
    wanted = 1 + max(1, int(4 * growth))
    (told,) = division.findings
    assert (told.code, told.file, told.line) == ("COR014", "part.src", 12)
    assert told.message == (
        f"{wanted} motions are needed, max_growth ({growth:g}) allows {most}: 1 motions get fewer than"
        " they need; the largest error is here"
    )
    assert told.help == "raise max_growth or tolerance in the cell"
    assert division.inserted == most
    if most:
        assert division.role[division.source == 2].tolist() == [LINK, *[PIECE] * (most - 1), OWN]


def test_the_motion_that_errs_most_is_the_one_that_is_told():
    """Of two cuts the longer one, whichever comes first; a step without its link counts as well."""
    for longer in (0, 1):
        lengths = (0.8, 0.3) if longer == 0 else (0.3, 0.8)
        points = []
        for k, length in enumerate(lengths):
            x = 1.5 + 0.1 * k
            points += [
                [x, -length / 2, 0.6],
                [x, -length / 2, 0.5],
                [x, length / 2, 0.5],
                [x, length / 2, 0.6],
            ]
        task = at_points(points, [False, False, True, False] * 2, tolerance=3e-6)
        result = correct(task)
        whole = subdivide(task, result, FREE)
        wanted = whole.inserted
        spare = wanted - 2
        some = subdivide(task, result, Limits(max_growth=(8 + spare + 0.5) / 8))
        assert some.inserted == spare
        (told,) = some.findings
        assert told.message.startswith(f"{wanted} motions are needed,")
        assert f" allows {spare}: 1 motions get" in told.message
        # links first, then those of the longer one: the other one is short of points
        assert told.line == (16 if longer == 0 else 12)
        none = subdivide(task, result, Limits(max_growth=1.0))
        assert ": 2 motions get" in none.findings[0].message
        assert none.findings[0].line in (12, 16)
        assert none.inserted == 0


@pytest.mark.parametrize("spare", range(9))
def test_the_largest_need_is_served_first(spare):
    wanted, need = np.array([2, 0, 3, 1, 2]), np.array([0.5, 9.0, 2.0, 2.0, 0.1])
    given = allocate(wanted, need, spare)
    left, expected = spare, [0] * 5
    for place in (1, 2, 3, 0, 4):
        expected[place] = min(left, int(wanted[place]))
        left -= expected[place]
    assert given.tolist() == expected


@pytest.mark.parametrize(
    ("degrees", "pieces"), [(299.9, 1), (300.1, 2), (360.0, 2), (360.1, 3), (540.0, 3), (541.0, 4)]
)
def test_an_arc_of_nearly_a_full_turn_has_two_pieces_at_least(degrees, pieces):
    """From 300 degrees on; where it can not be divided it is held, where nothing may be inserted it stays."""
    rise = 0.1 if degrees > 360 else 0.0
    loose = planar(circle(sweep=np.radians(degrees), rise=rise, tolerance=1.0))
    loose = replace(loose, tolerance_angle=1.0)
    result, division = divided(loose)
    assert int(np.sum((division.source == 2) & ~division.transitions)) == pieces
    held = subdivide(not_before(loose, {2: "a loop"}), result, FREE).not_refined
    said = "an arc of nearly a full turn cannot be divided here"
    expected = [(2, "COR013", said, "part.src", 12)] if pieces > 1 else []
    assert [(row, one.code, one.message, one.file, one.line) for row, one in held.items()] == expected
    assert not subdivide(loose, result, Limits(no_insert=True)).not_refined


def test_what_the_limits_leave_is_on_top_of_the_pieces_that_there_have_to_be():
    (told,) = divided(circle(tolerance=1e-9), Limits(max_growth=1.5))[1].findings
    assert told.message.startswith("7 motions are needed, max_growth (1.5) allows 1:")


@pytest.mark.parametrize("job", ["line", "corner", "circle"])
def test_what_just_fits_is_not_told(job):
    task, result, whole = as_needed(job)
    n = len(task.toolpath)
    just = subdivide(task, result, Limits(max_growth=len(whole) / n))
    assert not just.findings
    np.testing.assert_array_equal(just.source, whole.source)
    less = subdivide(task, result, Limits(max_growth=(len(whole) - 1) / n))
    assert [one.code for one in less.findings] == ["COR014"]
    assert len(less) == len(whole) - 1


@pytest.mark.parametrize(("first", "line_"), [(3, 12), (2, 13)])
def test_of_links_that_of_the_largest_step_comes_first(first, line_):
    """The other motion is the one that is told."""
    task = corner()
    if first == 2:  # hardly another force behind the corner
        values = task.force.values.copy()
        values[3] = 1.3 * values[2]
        task = replace(task, force=replace(task.force, values=values, start=values))
    size = steps(task)[0]
    assert min(size[2:4]) > 1.0
    assert (size[2] > size[3]) == (first == 2)
    one = divided(task, Limits(max_growth=1.2))[1]
    assert one.source[one.transitions].tolist() == [first]
    assert one.findings[0].line == line_


def test_a_link_back_to_an_arc_that_stays_is_made_before_all_others():
    task = again(circle(sweep=1.0, tolerance=1.0), kind=[Kind.PTP, Kind.LIN, Kind.CIRC, Kind.LIN])
    carries = np.array([False, True, False, False])
    wrench = np.where(carries[:, None], FORCE, 0.0)
    task = replace(
        task, force=replace(task.force, carries=carries, values=wrench, start=wrench), tolerance=1e-5
    )
    free = divided(task)[1]
    assert free.source[free.transitions].tolist() == [1, 2]
    points = free.inserted - 2
    division = divided(task, Limits(max_growth=1.25))[1]
    assert division.source[division.transitions].tolist() == [2]
    assert division.inserted == 1
    assert division.findings[0].message.startswith(
        f"{1 + points} motions are needed, max_growth (1.25) allows 0: 1 motions"
    )
    more = divided(task, Limits(max_growth=1.5))[1]
    assert more.source[more.transitions].tolist() == [1, 2]
    assert more.inserted == 2


# what can not be


@dataclass(frozen=True)
class Walled(CompensationProblem):
    """A task whose tool comes nowhere beyond ``wall`` [m] along y, and has no rest, or does not settle, as ``flag``
    says."""

    wall: float = np.inf
    flag: str = "reachable"
    sense: float = 1.0
    note: list = field(default_factory=list)

    def command(self, rows, wanted, *given, **more):
        done = super().command(rows, wanted, *given, **more)
        bad = self.sense * wanted.position[:, 1] > self.wall
        return replace(done, **{self.flag: getattr(done, self.flag) & ~bad})


@pytest.mark.parametrize("flag", ["reachable", "settled", "converged"])
@pytest.mark.parametrize(
    ("sense", "where"), [(1.0, "between its points"), (-1.0, "where this motion starts")]
)
def test_a_way_that_leads_out_of_reach_is_held(flag, sense, where):
    """The ends are in reach: what is inserted is not."""
    task = line(tolerance=2e-6)
    result = correct(task)
    wall = 0.3999 if sense < 0 else 0.05
    walled = Walled(
        **{one.name: getattr(task, one.name) for one in fields(CompensationProblem)},
        wall=wall,
        flag=flag,
        sense=sense,
    )
    held = subdivide(walled, result, FREE).not_refined
    assert [(row, one.code, one.message, one.file, one.line) for row, one in held.items()] == [
        (2, "COR009", f"{where} the corrected pose is out of reach", "part.src", 12)
    ]


@dataclass(frozen=True)
class Flat(CompensationProblem):
    """A task whose commands lie on one line, along y."""

    def command(self, rows, wanted, *given, **more):
        done = super().command(rows, wanted, *given, **more)
        position = done.command.position.copy()
        position[:, [0, 2]] = 1.6, 0.5
        return replace(done, command=Poses(done.command.rotation, position))


@pytest.mark.parametrize("in_plane", [False, True])
def test_an_arc_of_points_that_lie_on_no_circle_is_held(in_plane):
    job = replace(circle(sweep=1.0), max_correction=1.0)
    job = planar(job) if in_plane else job
    flat = Flat(**{one.name: getattr(job, one.name) for one in fields(CompensationProblem)})
    division = subdivide(flat, correct(flat), Limits(min_segment=1.0))
    assert division.role.tolist() == [OWN, OWN, LINK, OWN, OWN]
    said = "the corrected points of this arc are not on a circle"
    assert [
        (row, one.code, one.message, one.file, one.line) for row, one in division.not_refined.items()
    ] == [(2, "COR013", said, "part.src", 12)]


@dataclass(frozen=True)
class Short(CompensationProblem):
    """A robot that does not reach where the last cut begins, nor the middle of any."""

    def command(self, rows, wanted, *given, **more):
        done = super().command(rows, wanted, *given, **more)
        share = more.get("share")
        if share is None:
            return done
        begins = (share == 0.0) & (rows == np.flatnonzero(self.carries)[-1])
        return replace(done, reachable=done.reachable & ~begins & ~((share > 0.0) & (share < 1.0)))


def test_what_is_held_is_told_in_the_order_of_the_program_and_once():
    """The last cut, which is found first, leads out of reach where it begins and again on its way."""
    points = [[x, y, z] for x in (1.5, 1.6) for y, z in ((-0.4, 0.6), (-0.4, 0.5), (0.4, 0.5), (0.4, 0.6))]
    job = at_points(points, [False, False, True, False] * 2, tolerance=3e-6)
    short = Short(**{one.name: getattr(job, one.name) for one in fields(CompensationProblem)})
    held = subdivide(short, correct(short), FREE).not_refined
    assert [(row, one.code, one.message, one.line) for row, one in held.items()] == [
        (2, "COR009", "between its points the corrected pose is out of reach", 12),
        (6, "COR009", "where this motion starts the corrected pose is out of reach", 16),
    ]


# a share of the correction


@pytest.mark.parametrize("job", JOBS)
def test_a_share_of_a_correction_is_that_share_of_every_motion(job):
    gain = 0.25
    task, _, whole = as_needed(job)
    part = divided(replace(task, gain=gain))[1]
    for name in ("source", "role", "share", "moved"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name))
    known = task.desired_path.traceable[whole.source]
    end = task.wanted[whole.source]
    way = task.desired_path.at(whole.source[known], whole.share[known])
    end.put(np.flatnonzero(known), way)
    shift, turn = pose_error(whole.command[:], end)
    half, bent = pose_error(part.command[:], end)
    moved = whole.moved
    np.testing.assert_allclose(half[moved], gain * shift[moved], atol=1e-9)
    np.testing.assert_allclose(bent[moved], gain * turn[moved], atol=1e-9)
    np.testing.assert_array_equal(part.command[:].position[~moved], whole.command[:].position[~moved])
    arcs = np.flatnonzero(np.isfinite(whole.sweep))
    assert np.isfinite(part.sweep).nonzero()[0].tolist() == arcs.tolist()
    if not len(arcs):
        return
    # in the middle of each arc the command lies so far from the wanted way as well
    away = []
    for division in (whole, part):
        pieces = subdivided_motions(task, division, arcs)
        wanted = task.desired_path.at(pieces.rows, 0.5 * (pieces.first + pieces.last)).position
        away.append(pieces.at(np.full(len(arcs), 0.5)).position - wanted)
    radial = np.linalg.norm(away[1] - gain * away[0], axis=1)
    assert radial.max() < 0.05 * np.linalg.norm(away[0], axis=1).max()


def test_a_share_may_be_small_enough_where_the_whole_is_not():
    """The points of a first cut are those of the last one, which the cell does not allow yet."""
    task = line()
    size = np.linalg.norm(correct(task).correction, axis=1).max()
    whole = divided(task)[1]
    part = divided(replace(task, gain=0.5, max_correction=0.6 * size))[1]
    np.testing.assert_array_equal(part.source, whole.source)
    own = np.flatnonzero(part.original)
    away = part.command.position[own] - task.wanted.position
    np.testing.assert_allclose(away, 0.5 * (whole.command.position[own] - task.wanted.position), atol=1e-9)


def test_motions_whose_way_is_not_known_are_scaled_where_they_end():
    """The first of a program, PTP motions, and what comes behind an unknown place."""
    kinds = [Kind.LIN, Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN, Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN]
    whole, part = (joints_task(process=False, kind=kinds, gain=gain) for gain in (1.0, 0.5))
    full, division = (divided(task, Limits(no_insert=True))[1] for task in (whole, part))
    assert division.moved.all()
    shift, turn = pose_error(full.command[:], whole.wanted)
    half, bent = pose_error(division.command[:], whole.wanted)
    np.testing.assert_allclose(half, 0.5 * shift, atol=1e-9)
    np.testing.assert_allclose(bent, 0.5 * turn, atol=1e-9)
    assert np.linalg.norm(shift, axis=1)[CARRIES].min() > 1e-4


# as the controller makes them


def test_motions_begin_where_those_before_them_end():
    task = mixed(tolerance=5e-6)
    division = divided(task)[1]
    motions = np.flatnonzero(division.source > 0)
    pieces = subdivided_motions(task, division, motions)
    end = division.command[:]
    np.testing.assert_allclose(pieces.start.position, end.position[motions - 1], atol=1e-14)
    np.testing.assert_allclose(pieces.start.rotation, end.rotation[motions - 1], atol=1e-14)
    np.testing.assert_array_equal(pieces.end.position, end.position[motions])
    np.testing.assert_array_equal(pieces.rows, division.source[motions])
    same = division.source[motions] == division.source[motions - 1]
    np.testing.assert_array_equal(pieces.first, np.where(same, division.share[motions - 1], 0.0))
    np.testing.assert_array_equal(pieces.last, division.share[motions])
    for name in ("centre", "normal", "sweep"):
        np.testing.assert_array_equal(getattr(pieces, name), getattr(division, name)[motions])
    # in any order, and the first of all, which begins nowhere
    order = np.array([5, 0, 3])
    some = subdivided_motions(task, division, order)
    np.testing.assert_array_equal(some.end.position, end.position[order])
    assert np.isnan(some.start.position[1]).all()
    assert some.first[1] == 0.0
    np.testing.assert_allclose(some.start.position[[0, 2]], end.position[[4, 2]], atol=1e-14)


def test_behind_another_tool_a_motion_begins_with_its_own():
    task = line()
    longer = Poses(rotation_from_vector([0.1, 0.2, 0.3]), np.array([0.05, -0.02, 0.4]))
    tool = task.tool.copy()
    tool.put(slice(2, 4), longer)
    path = task.toolpath.with_columns(tool=np.array([0, 0, 1, 1]))
    task = replace(task, tool=tool, toolpath=path)
    result = correct(line())
    division = subdivide(line(), result, Limits(no_insert=True))
    begin = subdivided_motions(task, division, np.array([2])).start
    there = division.command[[1]] @ tool[1].inverse() @ longer
    np.testing.assert_allclose(begin.position, there.position, atol=1e-12)
    np.testing.assert_allclose(begin.rotation, there.rotation, atol=1e-12)


def test_an_arc_is_rounded_off_only_where_points_are_inserted():
    """The controller rounds off what is inserted into it; its exact ends it does not."""
    found = []
    for reach in (np.nan, 0.5):
        constraints = EditConstraints(inserted_approximation=np.full(4, reach))
        job = circle(approximation=np.zeros(4), constraints=constraints)
        motions = DivisibleMotions(job, correct(job), Limits(max_growth=100.0))
        chosen = np.arange(len(motions.owner))
        assert len(chosen) == 1
        found.append([motions.largest_errors(chosen, np.full(len(chosen), count))[0] for count in (1, 4)])
    (alone, divided), (exact, rounded) = found
    assert exact == alone
    assert rounded > divided + 1.0
