"""How motions are parted before their points are fitted, of tools that yield in proportion to the force: how much a
controller rounds off what is inserted into arcs, in closed form, and the points beside the ends of ramps, in loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from spring_cases import AT, MM, corrected, spring

from postproc.compensation.divisible_motions import ROOM, DivisibleMotions
from postproc.compensation.knots import split_at_knots
from postproc.compensation.subdivision import Limits
from postproc.process.force_ramps import Ramps
from postproc.toolpath import Arcs, Kind

FREE = Limits(max_growth=100.0, ramp_end=0.5 * MM)


def arcs(chance: np.random.Generator, radius: float, blend: np.ndarray, beside: np.ndarray, stays: bool):  # type: ignore[no-untyped-def]
    """A line to a circle and two arcs of it, [m]; nothing yields."""
    angles = np.array([0.0, 0.0, 0.0, chance.uniform(0.5, 2.0), 0.0])
    angles[4] = angles[3] + chance.uniform(0.5, 2.0)
    points = radius * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    points[0] += [20 * MM, 0.0, 20 * MM]
    points[1] += [20 * MM, 0.0, 0.0]
    none = np.full(3, np.nan)
    job = spring(
        points,
        [False, False, True, True, True],
        None,
        (100.0, 0.0, 0.0),
        kind=[Kind.PTP, Kind.LIN, Kind.LIN, Kind.CIRC, Kind.CIRC],
        approximation=blend,
        arcs=Arcs(
            centre=np.array([none, none, none, AT, AT]),
            normal=np.array([none, none, none, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
            sweep=np.append(np.full(3, np.nan), np.diff(angles[2:])),
        ),
    )
    constraints = replace(job.toolpath.constraints, inserted_approximation=beside, exact_stays=stays)
    return replace(job, toolpath=replace(job.toolpath, constraints=constraints))


@pytest.mark.parametrize("seed", range(12))
def test_what_is_inserted_into_arcs_is_rounded_off_by_so_much(seed):
    """d^2 / (8 r), from d before each inserted point on, half of a segment at most; none where nothing is inserted,
    the end of a motion is approximated itself, or exact ends stay exact."""
    chance = np.random.default_rng(seed)
    radius = chance.uniform(20.0, 200.0) * MM
    blend = chance.choice([0.0, 0.0, 0.0, 1.0], 5) * MM
    beside = chance.uniform(0.5, 12.0, 5) * MM
    stays = seed % 6 == 5
    job = arcs(chance, radius, blend, beside, stays)
    motions = DivisibleMotions(job, corrected(job, np.zeros((5, 3))), FREE)
    # each motion in one to three parts
    parts = chance.integers(1, 4, len(motions.rows))
    motions.owner = np.repeat(np.arange(len(parts)), parts).astype(np.int32)
    bounds = [np.concatenate([[0.0], np.sort(chance.uniform(0.1, 0.9, k - 1)), [1.0]]) for k in parts]
    motions.low = np.concatenate([one[:-1] for one in bounds])
    motions.high = np.concatenate([one[1:] for one in bounds])
    motions.least = motions.least_segments()
    count = chance.integers(1, 4, len(motions.owner))
    chosen = np.arange(len(motions.owner))
    found = motions.largest_errors(chosen, count)
    for k in chosen:
        row = int(motions.rows[motions.owner[k]])
        whole = motions.low[k] == 0.0 and motions.high[k] == 1.0 and count[k] == 1
        if job.toolpath.kind[row] != Kind.CIRC or whole or stays or blend[row] > 0 or blend[row - 1] > 0:
            assert found[k] < 1e-6, (seed, k)
            continue
        segment = job.desired_path.sweep[row] * radius * (motions.high[k] - motions.low[k]) / count[k]
        reach = min(beside[row], 0.5 * segment)
        assert found[k] == pytest.approx(reach**2 / (8 * radius) / job.tolerance / ROOM, rel=1e-6), (seed, k)


def ramped(chance):  # type: ignore[no-untyped-def]
    """Three lines under a force that changes along ramps: up to three from the start of each, of one length each."""
    size = chance.choice([4.0, 7.0, 12.0, 50.0], 3) * chance.uniform(1.0, 1.6, 3) * MM
    x = np.concatenate([[0.0, 0.0], np.cumsum(size)])
    points = np.stack([x, 0 * x, np.append(20 * MM, np.zeros(4))], axis=1)
    blend = chance.choice([0.0, 0.5, 1.0, 4.0, np.nan], 5, p=[0.2, 0.2, 0.2, 0.2, 0.2]) * MM
    compliance = np.diag([1e-7, 9e-6, 1e-6])
    job = spring(points, [False, False, True, True, True], compliance, (0, 300.0, 50.0), approximation=blend)
    ends = []
    for row in (2, 3, 4):
        length = size[row - 2]
        near_end = length - chance.choice([0.7, 1.3, 2.1, 9.0]) * MM
        some = [near_end, near_end - chance.choice([0.6, 1.1, 1.7, 7.0]) * MM,
                chance.choice([0.7, 1.3, 2.1, 9.0]) * MM]  # fmt: skip
        ends += [
            (row, at) for at in sorted(chance.choice(some, chance.integers(0, 4), replace=False)) if at > 0
        ]
    row = np.array([one[0] for one in ends], int)
    step = np.zeros((len(ends), 6))
    step[:, 1] = chance.choice([5.0, 60.0, -300.0], len(ends))
    none = np.zeros(len(ends), bool)
    ramps = Ramps(row, np.zeros(len(ends)), job.desired_path.length[row],
                  np.array([one[1] for one in ends]), step, step, none, none, row, np.ones(len(ends)),
                  none)  # fmt: skip
    path = replace(
        job.toolpath, constraints=replace(job.toolpath.constraints, exact_stays=bool(chance.random() < 0.5))
    )
    return replace(job, toolpath=path, force=replace(job.force, ramps=ramps if len(ends) else None)), blend


@pytest.mark.parametrize("first", range(0, 120, 30))
def test_points_where_ramps_end_and_those_beside_them_in_loops(first):
    """A point beside it, as near as may be, keeps short what the controller rounds off, after it or else before it,
    where corners of the program and the points beside others have room."""
    many = 0
    for seed in range(first, first + 30):
        chance = np.random.default_rng(seed)
        job, blend = ramped(chance)
        shifts = np.array([shift(job, row, 1.0) for row in range(5)])
        motions = DivisibleMotions(job, corrected(job, shifts), FREE)
        before = [motions.low.tolist(), motions.high.tolist()]
        split_at_knots(motions)
        expected: dict[int, list[float]] = {}
        for row in (2, 3, 4):
            length, spacing = job.desired_path.length[row], 0.5 * MM
            ramps = job.force.ramps
            own = np.zeros(0, bool) if ramps is None else ramps.row == row
            ends = [] if ramps is None else sorted(set(ramps.length[own] / length))
            if own.sum() == 1 and ramps.start[own] <= 0 and not ramps.before[own]:
                ends = [max(ends[0], spacing / length)]  # nothing but its first motion can be off
            knots = []
            for at in ends:
                room = spacing <= at * length + 1e-12 and at * length <= length - spacing + 1e-9
                if room and (not knots or (at - knots[-1]) * length >= spacing):
                    knots.append(at)
            if not knots or not motions.split_error[motions.rows.tolist().index(row)] > 0:
                continue
            found = list(knots)
            for k, at in enumerate(knots):
                last, start = k + 1 == len(knots), k == 0
                after = ((1.0 if last else knots[k + 1]) - at) * length
                ahead = (at - (0.0 if start else knots[k - 1])) * length
                stated = 0.0 if np.isnan(blend[row]) else blend[row]
                if blend[row] == 0:
                    stated = 0.0 if job.toolpath.constraints.exact_stays else np.inf
                reach = min(stated, 0.5 * min(ahead, after))
                turn = sum(w * shift(job, row, at + side * spacing / length)
                           for w, side in ((1, -1), (-2, 0), (1, 1)))  # fmt: skip
                off = 0.25 * reach * np.linalg.norm(turn) / spacing
                if off <= 0.5 * job.tolerance or reach <= 0.5 * spacing:
                    continue
                corners = 2 * np.nan_to_num(blend[row]), 2 * np.nan_to_num(blend[row - 1])
                if after >= spacing + (max(spacing, corners[0]) if last else spacing):
                    found.append(at + spacing / length)
                elif ahead >= spacing + (max(spacing, corners[1]) if start else 2 * spacing):
                    found.append(at - spacing / length)
            many += len(found) - len(knots)
            expected[row] = sorted(found)
        if not expected:
            assert [motions.low.tolist(), motions.high.tolist()] == before
        for place, row in enumerate(motions.rows.tolist()):
            mine = motions.owner == place
            bounds = [0.0, *expected.get(row, []), 1.0]
            np.testing.assert_allclose(motions.low[mine], bounds[:-1], atol=1e-12, err_msg=str((seed, row)))
            np.testing.assert_allclose(motions.high[mine], bounds[1:], atol=1e-12, err_msg=str((seed, row)))
    assert many > 8


def shift(job, row: int, share: float) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Of the command where the tool is on its path, against the force there."""
    return -job.COMPLIANCE @ job.force.along(np.array([row]), np.array([share]))[0, :3]
