"""Forces that are stated or logged, against those by the stock that the cell names: whether they contradict them,
and by how much a log without compensation differs from the forces of the compensated robot."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import lengths
from postproc.cell import frames_of
from postproc.process import wrenches
from postproc.process.stock.stated_stock import has_stock
from postproc.process.wrenches import Wrenches
from postproc.toolpath import Kind
from postproc.workflows.preparation import Prepared

PLACES = (0.25, 0.5, 0.75)
"""Shares of each motion at which both are compared."""

MOST_APART, MOST_TIMES = 60.0, 3.0
"""[deg] and times: coefficients of a table are off by half, and turn the force by some tens of degrees."""


def stated_force_findings(ready: Prepared) -> tuple[Finding, ...]:
    """What the stock that the cell names says of forces that come from elsewhere: FRC032, the bias of those of a log;
    FRC040 where they point elsewhere, or are several times as large or small."""
    task = ready.task
    if not task.force.any:
        return ()
    nominal = _nominal(ready)
    findings = () if isinstance(nominal, str) else _contradiction(ready, nominal)
    if not task.force.measured:
        return findings
    message = (
        f"the forces of {task.force.source} are used as they are; if they were logged without compensation,"
    )
    bias = f"their bias is not known{nominal}" if isinstance(nominal, str) else _bias(ready, nominal)
    help = "if the run was not compensated, log the forces of the compensated program and use these"
    return (*findings, Finding("FRC032", f"{message} {bias}", task.file, help=help))


def _nominal(ready: Prepared) -> Wrenches | str:
    """The forces by the stock that the cell names, or why they are not known."""
    cell, task = ready.cell, ready.task
    process = None if cell.process is None else cell.path.parent / cell.process
    if process is None or not has_stock(process):
        return ", because the cell names no process file with a stock"
    if importlib.util.find_spec("numba") is None:
        return ", because numba is not installed"
    frames = frames_of(cell, task.toolpath, Path(task.file), task.external)
    try:
        return wrenches(Path(task.file), task.toolpath, frames, cell, str(process.resolve()))
    except Refusal as refusal:
        return f": {refusal.findings[0].message}"


def _contradiction(ready: Prepared, nominal: Wrenches) -> tuple[Finding, ...]:
    """FRC040: over the length of all cuts the stated forces are compared with those by the stock."""
    from postproc.process.stock.simulation import StockRun

    task, run = ready.task, nominal.stock
    assert isinstance(run, StockRun)
    cuts = np.flatnonzero(run.engagement.cuts)
    length = np.bincount(run.sweeps.motion, run.sweeps.length, len(task.toolpath))[cuts]
    squares = np.zeros(3)
    for share in PLACES:
        at = np.full(len(cuts), share)
        stated, by_stock = (one.along(cuts, at)[:, :3] for one in (task.force, nominal))
        squares += [
            float((length * np.sum(one * other, axis=1)).sum())
            for one, other in ((stated, stated), (stated, by_stock), (by_stock, by_stock))
        ]
    if not squares[0] or not squares[2]:
        return ()
    away = np.degrees(np.arccos(np.clip(squares[1] / np.sqrt(squares[0] * squares[2]), -1.0, 1.0)))
    size = np.sqrt(squares[0] / squares[2])
    named = f"those by the stock of {run.process.path.name}"
    if away > MOST_APART:
        what = f"they point {away:.0f} deg away in the mean of all cuts"
    elif not 1.0 / MOST_TIMES < size < MOST_TIMES:
        what = f"they are {size:.2g} times as large"
    else:
        return ()
    line = int(task.toolpath.line[cuts[0]])
    return (
        Finding("FRC040", f"the forces of {task.force.source} differ from {named}: {what}", task.file, line),
    )


def _bias(ready: Prepared, nominal: Wrenches) -> str:
    """In words, by how much forces logged without compensation differ from those of the nominal engagement."""
    from postproc.part.coupled_engagement import solve_coupled
    from postproc.part.displacement import Displacements
    from postproc.part.part_error import lever_of, paths_of
    from postproc.process.stock.simulation import StockRun

    task, run = ready.task, nominal.stock
    assert isinstance(run, StockRun)
    displaced = Displacements(replace(task, force=nominal), run.sweeps.in_stock)
    solved = solve_coupled(run, paths_of(run), displaced, lever_of(run))
    if isinstance(solved, str):
        return f"their bias is not known, because {solved}"
    stated = lengths(run.engagement.mean[:, :3])
    there = lengths(_means(solved.key, solved.wrench[:, :3], len(stated)))
    length = np.bincount(run.sweeps.motion, run.sweeps.length, len(stated))
    # on an arc the mean force turns with the feed
    cuts = np.flatnonzero(run.engagement.cuts & (task.toolpath.kind == Kind.LIN) & (stated > 0))
    if not len(cuts):
        return "their bias is not known, because no straight motion cuts"
    share = there[cuts] / stated[cuts] - 1.0
    low, high = int(np.argmin(share)), int(np.argmax(share))
    line = task.toolpath.line[cuts]
    total = (there * length)[cuts].sum() / (stated * length)[cuts].sum() - 1.0
    return (
        f"they differ, by the stock of {run.process.path.name}, from those of the compensated robot by"
        f" {100 * total:+.1f} % in the mean, from {100 * share[low]:+.0f} % (line {line[low]})"
        f" to {100 * share[high]:+.0f} % (line {line[high]})"
    )


def _means(key: Floats, values: Floats, count: int) -> Floats:
    """(N, C) means of ``values`` (K, C) along N motions; key (K,): twice the motion plus the share of its path."""
    motion = (key // 2).astype(np.int64)
    inside = np.flatnonzero(motion[1:] == motion[:-1])
    width = key[inside + 1] - key[inside]
    middle = 0.5 * (values[inside] + values[inside + 1]) * width[:, None]
    return np.stack([np.bincount(motion[inside], part, count) for part in middle.T], axis=1)
