"""The experiment from planning to the compensated cut, and its tables."""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import binomtest

from . import compensated, rig
from .identified import Found, Trial, found, pooled_coverage

DESIGNS = 20
"""Random designs, and designs by wrong robot files."""

CUTS = 40

BY_FILES = 3
"""Campaigns that are also made on the way of the command, by files."""

COVERED, SHARE = (0.94, 0.96), 0.985
"""What is asked for: of the intervals, and of the deflection."""

UNITS = {"c": (1e-6, "1e-6 rad/(N m)"), "K": (1e6, "1e6 N/m"), "s": (1e-3, "mm")}

ROW = "{:4} {:>9} {:>9} {:>8} {:>12} {:>11} {:>8} {:>15} {:>8}  {}"

HEAD = ("", "true", "mean", "+-", "95 % int.", "of Table 1", "covered", "", "found", "")


def trials() -> Iterator[tuple[Trial, float]]:
    """What is tried, and the ratio to Table 1's intervals that is asked for (infinite: shown beside the others)."""
    true, rng = rig.truth(), np.random.default_rng(15)
    fifteen = (rig.read_off(rig.planned(true, 15)),)
    thirty = (rig.read_off(rig.planned(true, 30)),)
    two = (rig.read_off(rig.planned(true, 15, rig.TWO_WEIGHTS), rig.TWO_WEIGHTS),)
    files = [rig.model_of(rig.wrong_file(rng)) for _ in range(DESIGNS)]
    wrong = tuple(rig.read_off(rig.planned(file, 15)) for file in files)
    chance = tuple(rig.read_off(rig.at_random(15, rng)) for _ in range(DESIGNS))
    yield Trial("15 planned configurations, 265 kg", fifteen), 0.8
    yield Trial("30 planned configurations, 265 kg", thirty), 0.55
    yield Trial("15 planned configurations x 2 loads, 250 and 280 kg", two), 0.55
    within = "15 planned, attachment points known to Table 1's intervals only"
    yield Trial(within, fifteen, rig.WITHIN, points=True), 0.8
    yield Trial(f"15 planned by wrong robot files, {DESIGNS} designs", wrong), np.inf
    yield Trial(f"15 random configurations, {DESIGNS} designs", chance), np.inf


def told(trial: Trial, done: Found, wanted: float) -> bool:
    """Prints what a trial found; whether it is what is asked for."""
    true, table = (np.array(list(of.values())) for of in (rig.values_of(rig.truth()), rig.TABLE_1))
    wide = 100 * np.where(np.isnan(done.ci95), np.inf, done.ci95) / true
    middle, campaigns = np.median(wide, axis=0), len(wide)
    print(f"\n{trial.name}: {campaigns} campaigns, {done.seconds:.2f} s each")
    print(ROW.format(*HEAD))
    for i, name in enumerate(rig.TABLE_1):
        scale, unit = UNITS[name[0]]
        value = done.value[np.isfinite(done.value[:, i]), i] / scale
        count, inside = len(value), int(np.nansum(done.covers[:, i]))
        low, high = binomtest(inside, count).proportion_ci(method="wilson")
        cells = (
            f"{true[i] / scale:.4f}",
            f"{value.mean():.4f}",
            f"{value.std() / np.sqrt(count):.1g}",
            f"{middle[i]:.2f} %",
            f"{middle[i] / table[i]:.3f}",
            f"{100 * inside / count:.1f} %",
            f"({100 * low:.1f} .. {100 * high:.1f})",
            f"{100 * count / campaigns:.1f} %",
        )
        print(ROW.format(name, *cells, unit))
    total, half = pooled_coverage(done)
    worst = np.median((wide / table).max(axis=1))
    print(
        f"worst of Table 1 in the median {worst:.3f}; covered {100 * total:.2f} +- {100 * half:.2f} %",
        flush=True,
    )
    if np.isinf(wanted):
        return True
    reached = {
        "all seven found in every campaign": bool(np.isfinite(done.value).all()),
        f"every interval <= {wanted} of Table 1's": bool((middle <= wanted * table).all()),
        "94 .. 96 % covered": COVERED[0] <= total <= COVERED[1],
    }
    print("; ".join(f"{what}: {'yes' if good else 'NO'}" for what, good in reached.items()), flush=True)
    return all(reached.values())


def compensation(trial: Trial, campaigns: int, seed: int) -> bool:
    """Prints what compensations with identified files are worth on the plant; whether it is what is asked for."""
    plant, good = rig.plant(), True
    print(f"\nShare of the deflection that is compensated: {CUTS} cuts on the plant, {campaigns} campaigns")
    for past, what in ((True, "forces that put no torque on A1"), (False, "forces of any direction")):
        cut = compensated.cuts(CUTS, seed, past)
        begun = compensated.errors(plant, cut.q, cut)
        ways = {
            "identified": compensated.found_model,
            "identified without a compensator": compensated.joints_only,
            "by the robot file before": compensated.begun_with,
        }
        print(f"  {what}; c1 stays the file's; {1e3 * np.median(begun):.2f} mm in the median")
        for name, way in ways.items():
            shares = [
                100 * compensated.share(plant, way(trial, seed, k), cut, begun) for k in range(campaigns)
            ]
            print(
                f"    {name:34} {np.median(shares):6.2f} %  ({min(shares):.2f} .. {max(shares):.2f})",
                flush=True,
            )
            good &= name != "identified" or bool(np.median(shares) >= 100 * SHARE)
        with TemporaryDirectory() as folder:
            models = [
                compensated.by_files(trial, seed, k, Path(folder)) for k in range(min(BY_FILES, campaigns))
            ]
        shares = [100 * compensated.share(plant, model, cut, begun) for model in models]
        print(f"    {'identified, by way of files':34} {', '.join(f'{share:.2f} %' for share in shares)}")
        good &= min(shares) >= 100 * SHARE
    print(f">= {100 * SHARE:g} %: {'yes' if good else 'NO'}")
    return good


def _stage(text: str) -> None:
    """A line that the next one takes the place of."""
    print(f"\r{text} ", end="", file=sys.stderr, flush=True)


def main(argv: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.campaign", description=__doc__)
    parser.add_argument("--campaigns", type=int, default=1000, help="of each design [1000]")
    parser.add_argument(
        "--compensated", type=int, default=50, help="campaigns that cuts are compensated with [50]"
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=min(2, os.cpu_count() or 1), help="processes [2]")
    given = parser.parse_args(argv)
    begun = time.monotonic()
    tried = list(trials())
    print(f"planned and read off in {time.monotonic() - begun:.0f} s", flush=True)
    good = True
    for number, (trial, wanted) in enumerate(tried):
        done = found(trial, given.campaigns, 100 * given.seed + number, given.jobs, _stage)
        good &= told(trial, done, wanted)
    good &= compensation(tried[0][0], given.compensated, given.seed)
    print(f"\n{'all reached' if good else 'NOT all reached'}, {time.monotonic() - begun:.0f} s")
    return 0 if good else 1
