"""What the simulation of the stock costs: processor time and memory of programs of short motions in a block.

    python -m tests.benchmarks.stock --sizes 1000,4000,16000 [--stock 1,2,4]

Zigzag in levels of 2 mm of 4 mm between the rows, motions of 1 mm, a cutter of 16 mm; every level ends with a rapid.
``--stock``: the block of the last size made so many times larger in each direction of the plane.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from stock_cases import FLAT, block, path_through, run

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


def measure(count: int, larger: float = 1.0) -> tuple[float, float, int]:
    """Processor seconds, peak memory [GB] of the process so far, and the motions that cut."""
    points, kinds = program(count)
    start = time.process_time()
    size = [LENGTH * larger, WIDTH * larger, 0]
    cut = run(path_through(points, kinds=kinds), block([0, 0, -60], size), FLAT)
    used = time.process_time() - start
    return used, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, int(cut.cuts.sum())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--sizes", default="1000,4000,16000")
    parser.add_argument("--stock", default="1")
    given = parser.parse_args()
    measure(50)  # compiles
    sizes = [int(word) for word in given.sizes.split(",")]
    rows = [(size, 1.0) for size in sizes]
    rows += [(sizes[-1], float(word)) for word in given.stock.split(",") if float(word) != 1.0]
    print("motions  stock  cut     CPU s  us a motion  GB")
    for size, larger in rows:
        used, memory, cut = measure(size, larger)
        print(
            f"{size:7}  {larger:5g}  {cut:6}  {used:5.2f}  {used / size * 1e6:11.0f}  {memory:.2f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
