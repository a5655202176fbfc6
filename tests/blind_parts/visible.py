"""How much a hidden effect can show: the gain that a learner would have who knew it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from plant import Hardware

from postproc.learning.causes import CausePrediction, PriorKnowledge
from postproc.learning.covariance import SmoothField
from postproc.learning.measured_part import read_measured_part
from postproc.workflows.learn_points import match

from .cutting import Surface, cut
from .truth import Truth


def visible_gain(surface: Surface, truth: Truth, program: Path, measured: Path, chosen: np.ndarray) -> float:
    """ln of how much likelier the deviations of the points ``chosen`` (J,) are on average with the true effect than
    without: d^T K^-1 d / 2, d: what the plant does more with it, K: covariance of all that else is possible.

    Below ln 100 nobody can name the effect from these points."""
    bare = replace(truth, hidden=(), hardware=Hardware(), corner=0.0)
    d = np.subtract(
        *(cut(surface, one, one.plant(), program, np.random.default_rng(0)) for one in (truth, bare))
    )
    job = surface.program
    found = match(surface.request, job, [read_measured_part(measured)], PriorKnowledge())
    prediction = CausePrediction(found.points, job.ready.model, found.causes)
    columns = prediction.columns(0 * prediction.deviations)
    by_force = columns[:, [cause.name for cause in found.causes].index("force")]
    scaled = columns * prediction.deviations
    whole = found.layout.covariance(SmoothField(), by_force) + scaled @ scaled.T
    first = int(measured.read_text().splitlines().index("X,Y,Z,NX,NY,NZ,DEV,FEATURE")) + 2
    own = d[chosen[found.line - first]]
    return float(0.5 * own @ np.linalg.solve(whole, own))
