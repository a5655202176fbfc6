"""``python -m tests.drawn_robots [--draws 500]``: in how many of the robots drawn from the stated intervals the largest
error after the correction is within its bound.

Of each model, programs of 12 motions at poses and forces drawn at random are corrected once, for the robot of the file;
then that many robots, with parameters and a scale of the force drawn from the intervals, run what was written.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

import test_expanded_uncertainty
from plant import SOFTER, with_compensator
from test_expanded_uncertainty import deviations, drawn, every, job, paper

from postproc.compensation.correct import correct
from postproc.compensation.uncertain_inputs import FORCE, input_uncertainties
from postproc.compensation.uncertainty import evaluate_uncertainty
from postproc.robot.description import COVERAGE

MODELS = {
    "intervals of the paper": (paper(), True, 0.0),
    "all 10 %, force 20 %": (every(paper(), 0.1), True, 0.2 / COVERAGE),
    "acting balancer, absolute": (every(with_compensator(paper(), **SOFTER), 0.02), False, 0.0),
}
PROGRAMS = (6, 7, 8, 9)


def within(model, process, force, seed):
    """Whether each drawn robot's largest error is within the bound; the bound, and what 95 % of the robots are below
    [m]."""
    task = job(model, 12, process=process, seed=seed)
    result = correct(task)
    ci95 = COVERAGE * force if force else None
    known = input_uncertainties(model, ci95, True)
    names = [entry.name for entry in known.entries if entry.name != FORCE]
    errors = drawn(task, result.command[:], names, deviations(known), force, 100 + seed)[1]
    largest = np.linalg.norm(errors, axis=2).max(axis=1)
    bound = result.after.max() + evaluate_uncertainty(task, result, ci95).after
    return largest <= bound, bound, np.quantile(largest, 0.95)


def interval(count, total):
    """The 95 % interval of a share (E. B. Wilson, 1927, doi 10.1080/01621459.1927.10502953)."""
    share, z = count / total, 1.96
    middle = share + z * z / (2 * total)
    half = z * np.sqrt(share * (1 - share) / total + z * z / (4 * total * total))
    return (middle - half) / (1 + z * z / total), (middle + half) / (1 + z * z / total)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=500)
    draws = parser.parse_args().draws
    test_expanded_uncertainty.DRAWS = draws
    held, total = 0, 0
    print(f"{'':28} program  bound um  95 % below  within the bound")
    for name, (model, process, force) in MODELS.items():
        for seed in PROGRAMS:
            inside, bound, quantile = within(model, process, force, seed)
            low, high = interval(int(inside.sum()), draws)
            print(
                f"{name:28} {seed:7} {1e6 * bound:9.2f} {1e6 * quantile:11.2f} "
                f"  {100 * inside.mean():.1f} %  ({100 * low:.1f} .. {100 * high:.1f})",
                flush=True,
            )
            held, total = held + int(inside.sum()), total + draws
    low, high = interval(held, total)
    print(f"{total} robots: {100 * held / total:.1f} %  ({100 * low:.1f} .. {100 * high:.1f})")
    return int(not (0.94 <= held / total <= 0.96))


if __name__ == "__main__":
    sys.exit(main())
