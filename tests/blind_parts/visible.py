"""How much a hidden effect shows in the very deviations that a learner is given: what one would gain who knew it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.learning.attribution import attribute
from postproc.learning.candidates import candidates
from postproc.learning.causes import CausePrediction, PriorKnowledge
from postproc.learning.measured_part import read_measured_part
from postproc.workflows.learn_points import match

from .cutting import Surface, cut
from .truth import Truth

SIZE = 2.0
"""Of a rival, in its standard deviations."""


@dataclass(frozen=True)
class Visible:
    """Logarithms: ``gain``: how much likelier the deviations are with the true effect, of its true size, than without;
    ``ahead``: than with any other effect alone, of the size that fits it best."""

    gain: float
    ahead: float


def visible(surface: Surface, truth: Truth, program: Path, measured: Path, chosen: np.ndarray) -> Visible:
    """Of deviations r at the points ``chosen`` (J,): d^T K^-1 r - d^T K^-1 d / 2, d: what the plant does more with the
    effect, K: covariance of all else that is possible, at the causes that would be found without it."""
    d = np.subtract(
        *(
            cut(surface, one, one.plant(), program, np.random.default_rng(0))
            for one in (truth, truth.without_hidden())
        )
    )
    job = surface.program
    found = match(surface.request, job, [read_measured_part(measured)], PriorKnowledge())
    prediction = CausePrediction(found.points, job.ready.model, found.causes)
    first = int(measured.read_text().splitlines().index("X,Y,Z,NX,NY,NZ,DEV,FEATURE")) + 2
    d = d[chosen[found.line - first]]
    bare = attribute(prediction, found.deviation - d, found.layout, found.around, search=False)
    explained = bare.explained
    own = explained.whiten(d[bare.kept])
    rest = explained.whiten(explained.rest) + own
    gain = float(own @ rest - 0.5 * own @ own)
    best = 0.0
    noise = float(np.median(found.layout.sigma))
    for other in candidates(prediction, bare.x, found.around, noise):
        if other.name in truth.names():
            continue
        columns = SIZE * explained.whiten(other.columns[bare.kept])
        precision = np.eye(columns.shape[1]) + columns.T @ columns
        pull = columns.T @ rest
        occam = 0.5 * float(np.linalg.slogdet(precision)[1])
        best = max(best, 0.5 * float(pull @ np.linalg.solve(precision, pull)) - occam)
    return Visible(gain, gain - best)
