"""What the simulation of the stock costs: processor time and memory of programs of short motions in a block.

    python -m tests.benchmarks.stock --sizes 1000,4000,16000 [--stock 1,2,4] [--part 100000]
    python -m tests.benchmarks.stock --sizes 3000,10000 --five-axes [--beside] [--lists]
    python -m tests.benchmarks.stock --levels 5

Zigzag in levels of 2 mm of 4 mm between the rows, motions of 1 mm, a cutter of 16 mm; every level ends with a rapid.
``--stock``: the block of the last size made so many times larger in each direction of the plane.  ``--five-axes``: a
ball of 10 mm in rows of 0.5 mm and levels of 0.5 mm, whose spindle swings by 17 deg to either side along its rows; a
level has 41,200 motions, so more motions cut what more rows have cut before.  ``--beside``: all rows in one level, in a
blank as wide as they need.  ``--lists``: no times, but among how many sweeps the stock looks: for the mean entry of a
list, the entries of its cell.  ``--levels``: the processor time of a place of the ball in each of so many levels of a
block of 30 by 12 mm.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import stock_cases
from part_cases import constant, sweeps_of
from stock_cases import BALL, FLAT, block, path_through, run

from postproc.part.deflected_sweeps import deflect
from postproc.part.surface import find_surface
from postproc.part.surface_error import find_errors
from postproc.process.stock.cell_lists import build_stock
from postproc.process.stock.contact import COLUMNS, SweepCutters, contacts
from postproc.process.stock.engagement import laws_of, profiles_of

LENGTH, WIDTH, LEVEL = 200.0, 100.0, 2.0


def program(count: int) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) tip positions [mm], and the kinds (count,) of the motions: 0 rapid, 2 straight."""
    points: list[list[float]] = []
    kinds: list[int] = []
    along = np.arange(-10, LENGTH + 10, 1.0)
    level = 0
    while len(points) < count:
        level += 1
        for index, y in enumerate(np.arange(-4, WIDTH + 4, 4.0)):
            row = along if index % 2 == 0 else along[::-1]
            points += [[x, y, -LEVEL * level] for x in row]
            kinds += [2] * len(row)
        points += [[points[-1][0], points[-1][1], 10.0], [-20.0, -4.0, 10.0]]
        kinds += [0, 0]
    kinds[0] = 0
    return np.array(points[:count]), np.array(kinds[:count])


def ball_program(
    count: int, beside: bool = False, length: float = LENGTH, width: float = WIDTH
) -> tuple[np.ndarray, np.ndarray]:
    """(count, 3) tip positions [mm] and spindle directions (count, 3) of rows in levels, or ``beside`` one another."""
    row = np.arange(-3, length + 3, 1.0)
    many = np.arange(count)
    index, place = many // len(row), many % len(row)
    x = row[np.where(index % 2 == 0, place, len(row) - 1 - place)]
    across = count if beside else 2 * int(width)
    y, level = 0.5 * (index % across), index // across
    z = -0.5 * (level + 1) - 0.3 * np.sin(x / 15) - 0.3
    lean = np.column_stack([0 * x, np.sin(0.3 * np.sin(x / 20)), np.cos(0.3 * np.sin(x / 20))])
    tips = np.column_stack([x, y, z]) + 5.0 * ([0, 0, 1] - lean)
    return tips, lean


def measure(
    count: int, larger: float = 1.0, five: bool = False, beside: bool = False
) -> tuple[float, float, float, int]:
    """Seconds by the clock, of the processor, peak memory [GB] of the process so far, and the motions that cut."""
    points, kinds = program(count)
    tips, axes = ball_program(count, beside)
    path = path_through(tips, axes) if five else path_through(points, kinds=kinds)
    start, clock = time.process_time(), time.perf_counter()
    width = tips[:, 1].max() + 10.0 if beside else WIDTH
    size = [LENGTH * larger, width * larger, 0]
    cut = run(path, block([0, 0, -60], size), BALL if five else FLAT)
    used, passed = time.process_time() - start, time.perf_counter() - clock
    return passed, used, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, int(cut.cuts.sum())


def measure_lists(count: int, beside: bool) -> tuple[float, int, float]:
    """Size of the cells [mm], entries of their lists, and how many the cell of the mean entry has: those before a sweep
    are what a query of it asks of."""
    tips, axes = ball_program(count, beside)
    blank = block([0, 0, -60], [LENGTH, tips[:, 1].max() + 10.0 if beside else WIDTH, 0])
    sweeps, _ = sweeps_of(path_through(tips, axes), blank, BALL)
    stock, _ = build_stock(blank, np.ascontiguousarray(sweeps.rows), np.array([BALL.numbers]))
    entries = np.diff(stock.first).astype(float)
    return stock.grid[0] * 1e3, int(entries.sum()), float((entries**2).sum() / entries.sum())


def measure_levels(levels: int, places: int = 100) -> list[float]:
    """Processor time [us] of a place in each level, of as many in its middle rows."""
    length, width = 30.0, 12.0
    of_level = int(length + 6) * 2 * int(width)
    path = path_through(*ball_program(levels * of_level, False, length, width))
    blank = block([0, 0, -60], [length, width, 0])
    sweeps, edges = stock_cases.sweeps_of(path, blank, BALL)
    stock, live = build_stock(blank, np.ascontiguousarray(sweeps.rows), np.array([BALL.numbers]))
    cutting = SweepCutters(profiles_of(sweeps.cutters), laws_of(sweeps, path, edges), live, sweeps.heading)
    random, times = np.random.default_rng(1), []
    contacts(stock, cutting, np.zeros(1, int), np.full(1, 0.5), np.zeros((1, COLUMNS)))  # compiles
    for level in range(levels):
        rows = level * of_level + np.arange(of_level // 3, of_level * 5 // 6)
        sweep, found = np.sort(random.choice(rows, places, replace=False)), np.zeros((places, COLUMNS))
        start = time.process_time()
        contacts(stock, cutting, sweep, np.full(places, 0.5), found)
        times.append((time.process_time() - start) / places * 1e6)
    return times


def measure_part(count: int, points: int) -> tuple[float, ...]:
    """Motions, points, those of the program, processor seconds of surface, deflected sweeps and errors, memory [GB]."""
    sweeps, stock = sweeps_of(
        path_through(*program(count)[:1], kinds=program(count)[1]),
        block([0, 0, -60], [LENGTH, WIDTH, 0]),
        FLAT,
    )
    times = [time.process_time()]
    surface = find_surface(stock, points)
    times.append(time.process_time())
    shift = constant((3e-5, -2e-5, 1e-5), (1e-4, 2e-4, 0.0))
    rows, _, _ = deflect(sweeps.rows, sweeps.motion, sweeps.share, 0.05, shift)
    times.append(time.process_time())
    own = surface.sweep >= 0
    find_errors(stock, rows, 1e-4, surface.points[own], surface.normals[own])
    times.append(time.process_time())
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return count, len(own), int(own.sum()), *np.diff(times).tolist(), memory


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sizes", default="1000,4000,16000")
    parser.add_argument("--stock", default="1")
    parser.add_argument("--part", type=int, default=0, help="measure the part instead, at so many points")
    parser.add_argument("--five-axes", action="store_true")
    parser.add_argument("--beside", action="store_true")
    parser.add_argument("--lists", action="store_true")
    parser.add_argument("--levels", type=int, default=0)
    given = parser.parse_args()
    if given.levels:
        print("level  us a place")
        for level, used in enumerate(measure_levels(given.levels)):
            print(f"{level + 1:5}  {used:10.0f}")
        return
    if given.lists:
        print("motions  cells mm  entries   of its cell")
        for word in given.sizes.split(","):
            size, entries, mean = measure_lists(int(word), given.beside)
            print(f"{int(word):7}  {size:8.3f}  {entries:8}  {mean:11.1f}", flush=True)
        return
    if given.part:
        measure_part(50, 1000)
        print("motions  points   own    CPU s surface  deflected  errors  GB")
        for word in given.sizes.split(","):
            print(
                "{:7}  {:6}  {:5}  {:13.2f}  {:9.2f}  {:6.2f}  {:.2f}".format(
                    *measure_part(int(word), given.part)
                )
            )
        return
    measure(50, five=given.five_axes)  # compiles
    sizes = [int(word) for word in given.sizes.split(",")]
    rows = [(size, 1.0) for size in sizes]
    rows += [(sizes[-1], float(word)) for word in given.stock.split(",") if float(word) != 1.0]
    print("motions  stock  cut          s   CPU s  us a motion  GB")
    for size, larger in rows:
        passed, used, memory, cut = measure(size, larger, given.five_axes, given.beside)
        print(
            f"{size:7}  {larger:5g}  {cut:6}  {passed:6.2f}  {used:6.2f}  {used / size * 1e6:11.0f}  {memory:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
