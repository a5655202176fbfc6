"""``compensate learn --plan``: the points of a part that are worth measuring, as a CSV to fill."""

from __future__ import annotations

import csv
import hashlib
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.read_files import read_text_file
from postproc.base.units import MM
from postproc.learning.causes import CausePrediction
from postproc.learning.measured_part import FREEDOMS, MeasuredPart, read_planned_points
from postproc.learning.plan_points import plan_points
from postproc.output.atomic_write import write_atomically
from postproc.output.filled_tables import refuse_filled
from postproc.workflows.learn import LearnRequest, known_before
from postproc.workflows.learn_points import match, read_job
from postproc.workflows.preparation import Stage, silent

SIGMA = 0.01 * MM
"""Scatter of a probe for which points are chosen."""

MOST = 2000
"""Points to choose from."""


@dataclass(frozen=True)
class LearnPlan:
    """``points`` of ``offered`` are chosen; RMS [mm] of the errors that the surface may have, before and after;
    ``path``: of the file."""

    points: int
    offered: int
    before_mm: float
    after_mm: float
    path: Path


def plan(request: LearnRequest, count: int, stage: Stage = silent) -> LearnPlan:
    """Chooses ``count`` of the points of the one file of ``request``, and writes them.  Raises Refusal."""
    source = request.measured[0]
    path = request.csv or source.with_name(f"{request.main.program.stem}.measure.csv")
    refuse_filled(path, ["DEV"])
    stage("reading")
    if len(request.measured) > 1:
        message = "--plan chooses from the points of one file"
        raise Refusal(Finding("LRN001", message, str(request.measured[1])))
    point, normal, feature = read_planned_points(source)
    if len(point) > MOST:
        message = f"the file has {len(point)} points, and --plan chooses from {MOST} at most"
        raise Refusal(Finding("LRN001", message, str(source), help="remove neighbours"))
    program = request.main.program
    digest = hashlib.sha256(read_text_file(program)).hexdigest()
    size = len(point)
    empty = ("",) * size
    zero, none = np.zeros(size), np.zeros(size, np.int64)
    part = MeasuredPart(
        source, digest, point, normal, zero, np.full(size, SIGMA), feature, empty, none, none, zero * np.nan,
        np.arange(size) + 2, FREEDOMS, "", digest, False, None, (),
    )  # fmt: skip
    job = read_job(request.main)
    stage("matching points to motions")
    matched = match(request.main, job, [part], known_before(request, job))
    stage("choosing points")
    prediction = CausePrediction(matched.points, job.ready.model, matched.causes)
    chosen = plan_points(prediction, matched.layout, count)
    rows = matched.line[chosen.chosen] - 2
    job.ready.inputs.refuse_outputs([path], [source])
    table = _file(point[rows], normal[rows], [feature[i] for i in rows.tolist()])
    write_atomically({path: table}, still=lambda: refuse_filled(path, ["DEV"]))
    return LearnPlan(len(rows), size, chosen.before / MM, chosen.after / MM, path)


def _file(point: np.ndarray, normal: np.ndarray, feature: list[str]) -> bytes:
    """The file to fill: DEV is empty, and so is what only the shop knows."""
    stream = io.StringIO()
    stream.write("# positive:\n# checked:\n# alignment:\n# cut_with:\n# sha256:\n# sigma_mm:\n")
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["X", "Y", "Z", "NX", "NY", "NZ", "DEV", "FEATURE"])
    for place, out, name in zip((point / MM).tolist(), normal.tolist(), feature, strict=True):
        writer.writerow([*(f"{one:.5f}" for one in place), *(f"{one:.6f}" for one in out), "", name])
    return stream.getvalue().encode()
