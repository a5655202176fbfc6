"""Where parts should lie: ``python -m tests.benchmarks.placement [NAME ...]`` prints what places bring, and the checks.

grid: an exhaustive grid over all five freedoms, scored by other code, and the search's result over its best; MuJoCo:
the largest error across the feed of the independent engine over the predicted one, at the present and at the best
place; draws: stiffness of every joint +-20 % and force direction +-20 deg, drawn together: by how much the best place
for the draw is better than the place that was chosen (regret), by the stated force and by the mean over directions.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from place_cases import SAMPLES, Brute, program_of, ranges_around
from plant import Plant

import postproc.codes  # noqa: F401  findings of all rooms can be made
from postproc.placement.force_turns import turned_forces
from postproc.placement.score_places import score_places
from postproc.placement.search_places import start_places
from postproc.workflows.place import place
from postproc.workflows.place_problem import PlaceRequest, place_problem, prepared_at
from postproc.workflows.preparation import Prepared
from tests.benchmarks.machine import heading

GRIDS = {1000: (4, 4, 4, 4, 4), 10_000: (6, 6, 6, 7, 7), 100_000: (9, 9, 9, 12, 12)}
PLACES, AROUND = 150, 12
SEED = 3


def asked(name: str, **more: object) -> PlaceRequest:
    return PlaceRequest((program_of(name),), "", ranges_around(name), **more)  # type: ignore[arg-type]


def on_mujoco(ready: Prepared, most: int = 200) -> float:
    """[m] the largest error across the feed, of at most so many motions under force evenly along the program, and of
    the one with the largest predicted one."""
    task, plant = ready.task, Plant.of(ready.task.model, links=())
    rows = np.flatnonzero(task.carries)
    moved = task.model.linear_deflection(task.track.q[rows], task.wrench[rows], task.tool[0])[:, :3]
    tangent = task.desired_path.tangent(rows, np.ones(len(rows)))
    worst = np.argsort(-np.linalg.norm(np.cross(moved, tangent), axis=1))[:20]
    some = np.union1d(worst, np.unique(np.linspace(0, len(rows) - 1, most).round().astype(int)))
    largest = 0.0
    for at in some.tolist():
        row = rows[at]
        q, tool = task.track.q[row], task.tool[row]
        step = plant.rest(q, task.wrench[row], tool).position - plant.rest(q, np.zeros(6), tool).position
        largest = max(largest, float(np.linalg.norm(np.cross(step, tangent[at]))))
    return largest


def regrets(
    name: str, chosen: list[np.ndarray], others: np.ndarray, draws: int
) -> tuple[np.ndarray, np.ndarray]:
    """(len(chosen), draws) the error across the feed [m] and the regret of each place under each draw, over the
    feasible ones of many places: all over the room, and around ``others`` (Q, 6).  Places between them may be better:
    the real regret is no less."""
    problem = place_problem(asked(name))
    few = np.unique(np.linspace(0, len(problem.motions) - 1, 60).round().astype(int))
    few = problem.motions.with_heads(np.union1d(few, np.flatnonzero(problem.motions.scored)))
    part, scoring = problem.motions.take(few), problem.scoring.take(few)
    room, rng = problem.room, np.random.default_rng(SEED)
    rough = score_places(problem.model, part, room, scoring, start_places(room))
    extent = np.array(room.upper - room.lower)
    sizes = np.repeat([0.003, 0.01, 0.03], AROUND)[:, None] * extent
    near = np.concatenate([rng.normal(one, sizes) for one in others])
    near = np.clip(near, room.lower, room.upper)
    fine = score_places(problem.model, part, room, scoring, near)
    inside = near[fine.violation == 0]
    pool = np.concatenate([np.array(chosen), others, rough.places[rough.order()[:PLACES]], inside])
    found = []
    for _ in range(draws):
        values = {}
        for index, term in enumerate(problem.model.terms):
            if term.effect.name == "joint_compliance":
                values = {(index, key): one * rng.uniform(0.8, 1.2) for key, one in term.values.items()}
        angle, sense = np.radians(20.0) * np.sqrt(rng.uniform()), int(rng.integers(360))
        force = turned_forces(scoring.forces[0], angle, 360)[sense]
        drawn = replace(scoring, forces=force[None])
        scores = score_places(problem.model.with_values(values), part, problem.room, drawn, pool)
        value = scores.value
        found.append((value[: len(chosen)], value[: len(chosen)] / value.min() - 1.0))
    errors, shares = zip(*found, strict=True)
    return np.array(errors).T, np.array(shares).T


def run(name: str, grid: int, draws: int) -> None:
    begin, cpu = time.perf_counter(), time.process_time()
    done = place(asked(name))
    wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
    largest = place(asked(name, objective="max"))
    print(f"{name}: {wall:.1f} s, of processors {cpu:.1f} s; {done.looked} placements", flush=True)
    for word, one, key in (("across the feed", done, "across"), ("with --objective max", largest, "max")):
        now, best = one.present.figure(key) * 1e3, one.best.figure(key) * 1e3
        print(f"  {word}: {now:.3f} -> {best:.3f} mm, {one.reduction:.1%} less", flush=True)
    problem = place_problem(asked(name))
    here, there = problem.prepared[0], prepared_at(problem.moved, done.best.place, problem.request)[0]
    figures = done.present.across.max, done.best.across.max
    ratio = [on_mujoco(one) / figure for one, figure in zip((here, there), figures, strict=True)]
    print(f"  MuJoCo over predicted: {ratio[0]:.4f} at present, {ratio[1]:.4f} at the best place", flush=True)
    if grid:
        least, count = Brute(program_of(name)).best_of_grid(ranges_around(name), GRIDS[grid])
        for key, one in (("across", done), ("max", largest)):
            best = least[key]
            ratio_to = one.best.figure(key) / best
            print(
                f"  grid of {count}, {key}: {best * 1e3:.3f} mm; search over grid {ratio_to:.3f}", flush=True
            )
    if draws:
        wide = place(asked(name, direction=20.0))
        others = np.array([one.place for one in (*done.places, *wide.places)])
        found = regrets(name, [done.best.place, wide.best.place], others, draws)
        for word, error, each in zip(("stated force", "mean over directions"), *found, strict=True):
            figures = f"median {np.median(each):.1%}, worst {each.max():.1%}"
            error_text = f"error {error.mean() * 1e3:.4f} mm in the mean, {error.max() * 1e3:.4f} at worst"
            print(f"  {draws} draws, chosen by {word}: regret at least {figures}; {error_text}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=[*SAMPLES], metavar="NAME", help="[panel pocket milling]")
    parser.add_argument("--grid", type=int, default=0, choices=[0, *GRIDS], help="places of the grid [none]")
    parser.add_argument("--draws", type=int, default=0, help="draws of stiffness and direction [none]")
    given = parser.parse_args()
    print(heading())
    for name in given.names:
        run(name, given.grid, given.draws)


if __name__ == "__main__":
    main()
