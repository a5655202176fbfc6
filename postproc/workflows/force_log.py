"""By how much forces that were logged without compensation differ from those of the compensated robot."""

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
from postproc.toolpath import Kind
from postproc.workflows.preparation import Prepared


def logged_force_findings(ready: Prepared) -> tuple[Finding, ...]:
    """FRC032 where the forces are those of a log, with their bias where the cell states a stock."""
    task = ready.task
    if not task.force.measured:
        return ()
    message = (
        f"the forces of {task.force.source} are used as they are; if they were logged without compensation,"
    )
    bias = _bias(ready)
    help = "if the run was not compensated, log the forces of the compensated program and use these"
    return (Finding("FRC032", f"{message} {bias}", task.file, help=help),)


def _bias(ready: Prepared) -> str:
    cell, task = ready.cell, ready.task
    process = None if cell.process is None else cell.path.parent / cell.process
    if process is None or not has_stock(process):
        return "their bias is not known, because the cell names no process file with a stock"
    if importlib.util.find_spec("numba") is None:
        return "their bias is not known, because numba is not installed"
    from postproc.part.coupled_engagement import solve_coupled
    from postproc.part.displacement import Displacements
    from postproc.part.part_error import lever_of, paths_of
    from postproc.process.stock.simulation import StockRun

    frames = frames_of(cell, task.toolpath, Path(task.file), task.external)
    try:
        nominal = wrenches(Path(task.file), task.toolpath, frames, cell, str(process.resolve()))
    except Refusal as refusal:
        return f"their bias is not known: {refusal.findings[0].message}"
    run = nominal.stock
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
        f"they differ, by the stock of {process.name}, from those of the compensated robot by {100 * total:+.1f} % in"
        f" the mean, from {100 * share[low]:+.0f} % (line {line[low]})"
        f" to {100 * share[high]:+.0f} % (line {line[high]})"
    )


def _means(key: Floats, values: Floats, count: int) -> Floats:
    """(N, C) means of ``values`` (K, C) along N motions; key (K,): twice the motion plus the share of its path."""
    motion = (key // 2).astype(np.int64)
    inside = np.flatnonzero(motion[1:] == motion[:-1])
    width = key[inside + 1] - key[inside]
    middle = 0.5 * (values[inside] + values[inside + 1]) * width[:, None]
    return np.stack([np.bincount(motion[inside], part, count) for part in middle.T], axis=1)
