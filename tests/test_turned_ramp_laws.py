"""Ramps of forces whose frame turns along the path: against a scalar walk along it, with frames drawn at random."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.process import Wrenches
from postproc.process.force_ramps import Ramps
from postproc.process.force_turning import Turning

NONE, TOOL, FEED = 0, 1, 2


@dataclass
class DrawnFeedFrames:
    """Frames of N motions, rows of matrices, at both ends (N, 2, 3, 3); evenly turned from one to the other between."""

    ends: np.ndarray

    def end(self, rows, side):
        return self.ends[rows, side]

    def along(self, rows, share):
        return np.array([self.at(row, t) for row, t in zip(rows, share, strict=True)]).reshape(-1, 3, 3)

    def at(self, row, t):
        start, end = Rotation.from_matrix(self.ends[row])
        return (Rotation.from_rotvec(t * (end * start.inv()).as_rotvec()) * start).as_matrix()


class DrawnPath:
    """Motions of random lengths with forces in three kinds of frames, some on arcs, and steps at some of them."""

    def __init__(self, seed: int, n: int = 30) -> None:
        rng = self.rng = np.random.default_rng(seed)
        self.n = n
        self.extent = rng.uniform(0.1, 2.0, n)
        self.carries = rng.random(n) > 0.1
        self.carries[0] = False
        self.kind = np.repeat(rng.choice([NONE, TOOL, TOOL, FEED, FEED], n), rng.integers(1, 9, n))[:n]
        self.kind[~self.carries] = NONE
        self.arc = (self.kind != NONE) & (rng.random(n) > 0.5)
        inner = np.flatnonzero(self.carries[1:] & self.carries[:-1]) + 1
        self.rows = np.sort(rng.choice(inner, 9, replace=False))
        self.length = rng.uniform(0.3, 5.0, 9)
        self.early = rng.choice([0.0, 0.0, 0.4, 1.0], 9)
        self.base = Rotation.random(n, random_state=seed).as_matrix()
        self.tool = Rotation.random(n, random_state=seed + 1).as_matrix()
        self.feed = DrawnFeedFrames(
            Rotation.random(2 * n, random_state=seed + 2).as_matrix().reshape(n, 2, 3, 3)
        )
        self.bend = 0.4 * rng.normal(size=(n, 3)) * self.arc[:, None]
        steps = np.isin(np.arange(n), self.rows)
        values, start = rng.normal(size=(2, n, 6)) * self.carries[:, None]
        start[~steps] = np.vstack([np.zeros(6), values[:-1]])[~steps]
        self.breaks = steps | ~self.carries | np.append(True, self.kind[1:] != self.kind[:-1])
        self.force = Wrenches(values, start, self.carries, "test", (), steps, self.turning())

    def turning(self) -> Turning:
        turns, feed = self.kind != NONE, self.kind == FEED
        return Turning(self.arc, feed, turns, self.feed, self.base, self.tool, lambda rows: self.bend[rows])

    def ramped(self) -> Wrenches:
        return self.force.ramped(self.rows, self.length, self.extent, self.early)

    def axes(self, m, t):
        """(3, 3) the frame of a motion at a share of it; its axes are the rows."""
        if self.kind[m] == FEED:
            return self.feed.at(m, t)
        start, end = (Rotation.from_matrix(self.base[k] @ self.tool[k]) for k in (m - 1, m))
        arc = Rotation.from_rotvec(self.bend[m])
        besides = (arc.inv() * end * start.inv()).as_rotvec()
        turned = Rotation.from_rotvec(t * self.bend[m]) * Rotation.from_rotvec(t * besides) * start
        return turned.as_matrix().T

    def wrench(self, m, t):
        """(6,) without ramps."""
        ends = self.force.start[np.array([m])][0], self.force.values[m]
        return self.between(m, t, *ends) if self.arc[m] else (1 - t) * ends[0] + t * ends[1]

    def between(self, m, t, start, end):
        """Linear in the frame that turns."""
        inside = (1 - t) * start.reshape(2, 3) @ self.axes(m, 0.0).T
        inside = inside + t * end.reshape(2, 3) @ self.axes(m, 1.0).T
        return (inside @ self.axes(m, t)).ravel()

    def part(self, k, before, m, t):
        """(6,) what remains of step k at the share t of motion m, on its ramp after or before its vertex."""
        v, long = int(self.rows[k]), self.length[k]
        share = self.early[k] if before else 1.0 - self.early[k]
        step = share * (self.force.start[self.rows][k] - self.force.values[v - 1])
        low, high = (m, v - 1) if before else (v, m)
        if low > high or not self.carries[low : high + 1].all():
            return np.zeros(6)
        walked = self.extent[m + 1 : v].sum() if before else self.extent[v:m].sum()

        def remains(s):
            return max(0.0, 1.0 - (walked + (1.0 - s if before else s) * self.extent[m]) / long)

        first = v - 1 if before else v
        if self.kind[first] == NONE:
            return remains(t) * step
        own = step.reshape(2, 3) @ self.axes(first, float(before)).T
        begin = first  # the motions around the vertex's in whose frame the step turns
        while not self.breaks[begin]:
            begin -= 1
        end = first
        while end + 1 < self.n and not self.breaks[end + 1]:
            end += 1

        def turned(motion, s):
            beside = motion + (1 if s else -1)
            at = [(motion, s), (beside, 1.0 - s)] if begin <= beside <= end else [(motion, s)]
            return np.mean([(own @ self.axes(*one)).ravel() for one in at], axis=0)

        if not begin <= m <= end:  # it stays as it came to the next break
            return remains(t) * (turned(begin, 0.0) if before else turned(end, 1.0))
        if self.arc[m]:
            return remains(t) * self.between(m, t, turned(m, 0.0), turned(m, 1.0))
        near, far = (1.0, 0.0) if before else (0.0, 1.0)
        if remains(far) == 0.0:
            return remains(t) * turned(m, near)
        return (1 - t) * remains(0.0) * turned(m, 0.0) + t * remains(1.0) * turned(m, 1.0)

    def expected(self, m, t):
        found = self.wrench(m, t)
        for k in range(len(self.rows)):
            found = found + self.part(k, True, m, t) - self.part(k, False, m, t)
        return found


def places(path: DrawnPath, count: int = 120):
    rows, share = path.rng.integers(1, path.n, count), path.rng.random(count)
    share[:40] = path.rng.integers(0, 2, 40)
    return rows, share


@pytest.mark.parametrize("seed", range(6))
def test_what_remains_of_a_step_turns_with_the_frame_that_the_force_is_stated_in(seed):
    path = DrawnPath(seed)
    rows, share = places(path)
    expected = [path.expected(m, t) for m, t in zip(rows, share, strict=True)]
    np.testing.assert_allclose(path.ramped().along(rows, share), expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("profile_first", [False, True])
def test_profiles_add_up_with_steps_that_turn(seed, profile_first):
    path = DrawnPath(seed)
    some = np.flatnonzero(path.carries)
    inner = path.rng.normal(size=(len(some), 6))
    rest = np.stack([0 * inner, inner, 0 * inner], axis=1).reshape(-1, 6)
    at = np.tile([0.0, 0.6, 1.0], len(some))
    profile = Ramps.profile(np.repeat(some, 3), at, rest, path.extent)
    if profile_first:
        both = replace(path.force, ramps=profile)
        both = both.ramped(path.rows, path.length, path.extent, path.early)
    else:
        steps = path.ramped()
        both = replace(steps, ramps=steps.ramps.joined(profile))
    rows, share = places(path)
    expected = np.array([path.expected(m, t) for m, t in zip(rows, share, strict=True)])
    bend = np.interp(share, [0.0, 0.6, 1.0], [0.0, 1.0, 0.0])
    mine = np.zeros((path.n, 6))
    mine[some] = inner
    np.testing.assert_allclose(both.along(rows, share), expected + bend[:, None] * mine[rows], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_step_in_a_frame_that_is_not_known_stays_as_it_is(seed):
    path = DrawnPath(seed)
    path.kind[:] = FEED
    path.arc &= False
    path.feed.ends[:] = np.nan
    unknown = replace(path.force, turning=path.turning())
    bare = replace(path.force, turning=None)
    rows, share = places(path)
    found = [one.ramped(path.rows, path.length, path.extent, path.early) for one in (unknown, bare)]
    np.testing.assert_array_equal(*(one.ramps.at(rows, share) for one in found))


def test_a_frame_is_continued_by_motions_of_its_kind_alone():
    path = DrawnPath(0, 40)
    path.kind[1:10] = [NONE, TOOL, FEED, TOOL, NONE, FEED, NONE, FEED, FEED]
    np.testing.assert_array_equal(
        path.turning().breaks(), [k == 0 or path.kind[k] != path.kind[k - 1] for k in range(40)]
    )


@pytest.mark.parametrize("seed", range(4))
def test_ramps_end_where_the_path_is_as_long_as_they_are(seed):
    """In a cut as long as that, before a step or after it."""
    path = DrawnPath(seed)
    expected = []
    for row, length, early in zip(path.rows, path.length, path.early, strict=True):
        walked = 0.0
        for m in range(row, path.n):
            if early == 1.0 or not path.carries[m] or walked > length:
                break
            if walked + path.extent[m] > length:
                expected.append((m, (length - walked) / path.extent[m]))
            walked += path.extent[m]
        walked = 0.0
        for m in range(row - 1, -1, -1):
            if early == 0.0 or not path.carries[m] or walked > length:
                break
            if walked + path.extent[m] > length:
                expected.append((m, 1.0 - (length - walked) / path.extent[m]))
            walked += path.extent[m]
    np.testing.assert_allclose(np.transpose(path.ramped().ramps.ends()), sorted(expected), atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_ramp_that_leads_to_its_step_mirrors_one_that_starts_there(seed):
    """On the path that is read backwards, the change is the other one."""
    path = DrawnPath(seed)
    step = path.rng.normal(size=(len(path.rows), 6))
    lead = Ramps.leading(path.rows, step, path.length, path.extent, path.carries)
    back = Ramps.of(
        path.n - path.rows[::-1], -step[::-1], path.length[::-1], path.extent[::-1], path.carries[::-1]
    )
    assert (np.diff(lead.row) >= 0).all()
    np.testing.assert_array_equal(np.unique(lead.vertex), path.rows)
    rows, share = places(path)
    np.testing.assert_allclose(lead.at(rows, share), back.at(path.n - 1 - rows, 1.0 - share), atol=1e-12)
