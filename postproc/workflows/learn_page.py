"""The page of a learnt part, with the shape on which its points lie."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.report.learned import Learned
from postproc.report.learned_picture import PartShape
from postproc.workflows.learn_points import CutProgram, Matched

if TYPE_CHECKING:
    from postproc.process.stock.simulation import StockRun

FACES, STEPS = 12_000, 4
"""Points of the surface, about; points of the path of a motion."""

MOST = 4000
"""Cutting motions whose paths are drawn, evenly chosen."""


def page_of(
    learned: Learned, job: CutProgram, matched: Matched, page: Path, links: Mapping[str, Path | None]
) -> bytes:
    """The bytes of ``page``."""
    from postproc.report.learned_page import learned_page
    from postproc.report.page import beside

    return learned_page(learned, part_shape(job, matched), beside(page, links))


def part_shape(job: CutProgram, matched: Matched) -> PartShape:
    """The surface of the part where a stock is stated, else the paths of the tip, in the axes of the base."""
    task, rows = job.ready.task, job.motions.rows
    base = task.base[matched.points.row[:1]]
    run = task.force.stock
    if run is not None:
        from postproc.part.surface import find_surface  # numba: only where there is a stock
        from postproc.process.stock.simulation import StockRun

        assert isinstance(run, StockRun)
        surface = find_surface(run.engagement.stock, FACES)
        return PartShape(np.zeros((0, 3)), _in_base(job, run, surface.vertices, base), surface.faces)
    if len(rows) > MOST:
        rows = rows[np.linspace(0, len(rows) - 1, MOST).round().astype(np.int64)]
    share = np.tile(np.linspace(0.0, 1.0, STEPS), len(rows))
    place = task.desired_path.at(np.repeat(rows, STEPS), share).position
    in_base = ((place - base.position) @ base.rotation[0]).reshape(len(rows), STEPS, 3)
    gap = np.full((len(rows), 1, 3), np.nan)
    return PartShape(
        np.concatenate([in_base, gap], axis=1).reshape(-1, 3), np.zeros((0, 3)), np.zeros((0, 3), int)
    )


def _in_base(job: CutProgram, run: StockRun, vertices: Floats, base: Poses) -> Floats:
    """(V, 3) [m] vertices (V, 3) in the axes of the stock as seen from ``base`` (1); the tip at the end of a sweep is
    known in both."""
    from postproc.part.deflected_sweeps import tips_of

    task, motion = job.ready.task, run.sweeps.motion[:1]
    end = run.sweeps.share[:1, 1]
    in_stock = tips_of(run.sweeps.rows[:1], np.ones(1))[0]
    in_robot = task.desired_path.at(motion, end).position[0]
    turn = task.base[motion].rotation[0] @ run.sweeps.in_stock[motion[0]].T
    there = in_robot + (vertices - in_stock) @ turn.T
    return np.asarray((there - base.position) @ base.rotation[0])
