"""Many campaigns, each with its own noise and begun from its own wrong robot file; and what they found."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, replace

import numpy as np

from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, fit
from postproc.identification.unknowns import asked_for
from postproc.measurements import Readings

from . import rig

PART = 25
"""Campaigns that a process takes at a time."""

Stage = Callable[[str], None]


def silent(_stage: str) -> None:
    """Nobody watches."""


@dataclass(frozen=True)
class Trial:
    """``readings`` without noise, of one or several designs that are used in turn; ``words``: what is asked for;
    ``points``: the file's attachment points are as far off as it says, else they are the plant's."""

    name: str
    readings: tuple[Readings, ...]
    words: tuple[str, ...] = rig.KNOWN
    points: bool = False


@dataclass(frozen=True)
class Found:
    """value, ci95 (C, 7) [SI] of Table 1's parameters by each campaign, NaN where one was left out; seconds a fit."""

    value: np.ndarray
    ci95: np.ndarray
    seconds: float

    @property
    def covers(self) -> np.ndarray:
        """(C, 7) whether the interval holds the true value; NaN where there is none."""
        true = np.array(list(rig.values_of(rig.truth()).values()))
        return np.where(np.isnan(self.ci95), np.nan, np.abs(self.value - true) <= self.ci95)


def noisy(trial: Trial, seed: int, campaign: int) -> tuple[Readings, bytes]:
    """The readings of a campaign, and the robot file that it begins with."""
    rng = np.random.default_rng([seed, campaign])
    raw = rig.wrong_file(rng, trial.points)
    exact = trial.readings[campaign % len(trial.readings)]
    return replace(exact, value=exact.value + rig.SIGMA * rng.normal(size=exact.value.shape)), raw


def fitted(trial: Trial, seed: int, campaign: int) -> Fit:
    readings, raw = noisy(trial, seed, campaign)
    asked = asked_for(rig.model_of(raw), trial.words)
    return fit(Campaign(readings), asked.model, asked.unknowns)


def found(trial: Trial, campaigns: int, seed: int, jobs: int = 1, stage: Stage = silent) -> Found:
    """What ``campaigns`` find, in so many processes."""
    parts = [range(start, min(start + PART, campaigns)) for start in range(0, campaigns, PART)]
    repeated = ([trial] * len(parts), [seed] * len(parts), parts)
    done = []
    with ProcessPoolExecutor(jobs) if jobs > 1 else nullcontext() as pool:
        for part in (pool.map if pool else map)(_some, *repeated):
            done.append(part)
            stage(f"{trial.name}: {min(PART * len(done), campaigns)} of {campaigns}")
    value, ci95, seconds = (np.concatenate(columns) for columns in zip(*done, strict=True))
    return Found(value, ci95, float(seconds.mean()))


def _some(trial: Trial, seed: int, campaigns: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    value, ci95 = np.full((2, len(campaigns), len(rig.TABLE_1)), np.nan)
    seconds = np.empty(len(campaigns))
    for row, campaign in enumerate(campaigns):
        begun = time.perf_counter()
        done = fitted(trial, seed, campaign)
        seconds[row] = time.perf_counter() - begun
        for estimate in done.estimates:
            name = estimate.unknown.parameter.name
            if name in rig.TABLE_1:
                column = list(rig.TABLE_1).index(name)
                value[row, column], ci95[row, column] = estimate.value, estimate.ci95
    return value, ci95, seconds


def pooled_coverage(found: Found) -> tuple[float, float]:
    """Share of all intervals that hold the true value, and half its 95 % interval; campaigns count as independent, not
    the parameters within one."""
    covers = found.covers
    total = np.nansum(covers) / np.isfinite(covers).sum()
    off = np.nansum(covers - total, axis=1)
    return float(total), float(1.96 * np.sqrt((off**2).sum()) / np.isfinite(covers).sum())
