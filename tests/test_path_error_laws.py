"""What is off inside of a piece of a way: where it is looked at, what of it counts, and where nothing can be said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from path_cases import circle, line
from test_mirror import full

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.compensation.path_error import PathSegments, path_errors

MIDDLE, THREE = (0.5,), (0.25, 0.5, 0.75)


def straight(job, lengths, turns, begin=0.1, push=(0.0, 0.0, 0.0)):
    """Pieces of the 800 mm cut of ``job``, ``lengths`` [m] long, turned by ``turns`` [rad] on their way; moved."""
    n = len(lengths)
    rows, first = np.full(n, 2), np.full(n, begin)
    last = first + np.asarray(lengths) / 0.8
    start, end = job.desired_path.at(rows, first), job.desired_path.at(rows, last)
    turn = rotation_from_vector(np.outer(turns, [0.6, 0.0, 0.8]))
    start = Poses(start.rotation, start.position + push)
    return PathSegments.straight(rows, first, last, start, Poses(turn @ end.rotation, end.position + push))


def off(job, pieces, k, shares, left=0.0):
    """Largest distance and angle of piece ``k`` at the shares, one after the other."""
    one, found = pieces[np.array([k])], []
    for share in shares:
        along = one.first + share * (one.last - one.first)
        wrench, wanted = job.force.along(one.rows, along), job.desired_path.at(one.rows, along)
        goal = job.goal(one.rows, wanted)
        real = job.simulated(one.rows, one.at(np.array([share])), wrench)
        if not (real.reachable[0] and real.settled[0]):
            return np.inf, np.inf
        shift, turn = (values[0] for values in job.pose_errors(one.rows, real.pose, goal))
        bent = job.pose_errors(one.rows, job.simulated(one.rows, wanted, wrench).pose, goal)
        shift, turn = shift - left * bent[0][0], turn - left * bent[1][0]
        way = job.desired_path.tangent(one.rows, along)[0]
        found.append((np.linalg.norm(shift - (shift @ way) * way), np.linalg.norm(turn)))
    return tuple(max(values) for values in zip(*found, strict=True))


def agrees(job, pieces, shares, left=0.0, from_begin=None):
    """``shares``: of each piece, where it is looked at."""
    found = path_errors(job, pieces, from_begin, left)
    expected = np.array([off(job, pieces, k, at, left) for k, at in enumerate(shares)])
    np.testing.assert_allclose(found[0], expected[:, 0], atol=1e-9)
    np.testing.assert_allclose(found[1], expected[:, 1], atol=1e-9)


def test_pieces_of_30_mm_that_turn_by_3_degrees_are_looked_at_in_the_middle():
    """Longer ones, and those that turn further, are so in three places; those that do both as well."""
    job = line()
    lengths = [0.0299, 0.0301, 0.01, 0.01, 0.2, 0.0]
    turns = np.radians([0.0, 0.0, 2.99, 3.01, 40.0, 2.0])
    pieces = straight(job, lengths, turns, push=(1e-4, 0.0, 0.0))
    shares = [MIDDLE, THREE, MIDDLE, THREE, THREE, MIDDLE]
    agrees(job, pieces, shares)
    for k, shares_ in enumerate(shares[:5]):  # the places tell apart
        values = [off(job, pieces, k, at) for at in (MIDDLE, THREE)]
        assert abs(values[0][0] - values[1][0]) + abs(values[0][1] - values[1][1]) > 1e-8, shares_
    for k in range(6):
        alone = np.array([k])
        np.testing.assert_allclose(
            path_errors(job, pieces[alone])[0], off(job, pieces, k, shares[k])[0], atol=1e-9
        )


@pytest.mark.parametrize("rows", [[0, 1, 2], [0, 2], [1], []])
def test_some_pieces_are_looked_at_where_they_begin_as_well(rows):
    job = line()
    pieces = straight(job, [0.01, 0.2, 0.02], np.radians([2.0, -30.0, 0.0]), push=(1e-4, 0.0, 2e-4))
    pieces = replace(
        pieces, start=Poses(pieces.start.rotation, pieces.start.position + np.array([3e-4, 0, 0]))
    )
    mask = np.isin(np.arange(3), rows)
    shares = [(0.0, *at) if chosen else at for at, chosen in zip((MIDDLE, THREE, MIDDLE), mask, strict=True)]
    agrees(job, pieces, shares, from_begin=mask)


@pytest.mark.parametrize("left", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("process", [True, False])
def test_a_share_of_the_error_that_is_meant_to_stay_is_none(left, process):
    job = replace(line(), process=process)
    agrees(
        job, straight(job, [0.01, 0.2], np.radians([0.1, 2.0]), push=(1e-3, 0.0, 0.0)), [MIDDLE, THREE], left
    )
    # on the wanted way itself, all of it is meant to stay
    wanted = straight(job, [0.01, 0.2], [0.0, 0.0])
    still = path_errors(job, wanted, uncorrected_share=left)
    bare = path_errors(job, wanted)
    for part, whole in zip(still, bare, strict=True):
        np.testing.assert_allclose(part, (1 - left) * whole, atol=1e-9)
        assert (whole > 1e-6).all()


def test_arcs_are_looked_at_in_three_places_but_short_ones():
    """Of 1 rad: 5 percent are 2.9 deg, below the widest that is looked at in the middle, 6 percent are above it."""
    job = circle(sweep=1.0)
    rows, first, last = np.array([2, 2, 2]), np.array([0.2, 0.2, 0.5]), np.array([0.25, 0.26, 0.9])
    begin, via, end = (job.desired_path.at(rows, share) for share in (first, 0.5 * (first + last), last))
    none = np.full((3, 3), np.nan)
    pieces = PathSegments.round(rows, first, last, begin, via, end, none)
    agrees(job, pieces, [MIDDLE, THREE, THREE])


def test_what_is_off_is_infinite_where_the_robot_can_not_be():
    """Out of reach, in one of its places or in all; or without a rest there."""
    job = line()
    pieces = straight(job, [0.01, 0.2, 0.2], [0.0, 0.0, 0.0])
    end = pieces.end.position.copy()
    end[0] += [5.0, 0.0, 0.0]
    end[1] += [1.5, 0.0, 0.0]  # in reach where it begins
    pieces = replace(pieces, end=Poses(pieces.end.rotation, end))
    found = path_errors(job, pieces)
    assert np.isinf(found[0]).tolist() == np.isinf(found[1]).tolist() == [True, True, False]
    soft = replace(job, model=full(K_c=3e9))
    pieces = straight(soft, [0.01, 0.01], [0.0, 0.0])
    here = soft.simulated(pieces.rows, pieces.at(np.full(2, 0.5)), np.tile(job.wrench[2], (2, 1)))
    assert here.reachable.all()
    found = path_errors(soft, pieces)
    assert (
        np.isinf(found[0]).tolist() == np.isinf(found[1]).tolist() == (~here.settled).tolist() == [True, True]
    )
