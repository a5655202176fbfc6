"""How much of what was missing a diagnosis has found: on poses that were not measured, against an oracle that knows
which effect it is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from postproc.diagnosis import search
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.registration import registered
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

from . import measured
from .arm import model_of
from .cases import Run
from .design import poses
from .oracle import joined, own_unknowns, unknowns_in

POSES = 20


def left_over(run: Run) -> Callable[[StiffnessModel], float]:
    """[m] root mean square that a model leaves at poses that were not measured; tracker and targets found anew."""
    rng = np.random.default_rng([run.case.number, run.case.seed, 3])
    design = _elsewhere(run, rng)
    value = measured.observed(run.scene, design)
    seen = Campaign(measured.readings(design, value, run.sigma))

    def left(model: StiffnessModel) -> float:
        at = seen.predicted(model)
        given = registered(seen, at, np.ones(len(seen), bool))
        return float(np.sqrt(np.mean(seen.residual(at, given) ** 2)))

    return left


def closed(run: Run, found: StiffnessModel) -> float:
    """Share of what an oracle closes of the gap, root mean square: its own readings fitted without what is hidden, and
    with it.  ``found``: the model that the diagnosis has written."""
    left, filed = left_over(run), model_of(run.robot)
    before = left(fit(Campaign(run.readings), filed, search.model_unknowns(filed)).model)
    return (before - left(found)) / (before - left(knowing(run)))


def fresh(run: Run, found: StiffnessModel) -> list[float]:
    """What the model ``found`` leaves at fresh poses, over what the robot file as it was leaves there; and the same of
    who knows which effects are there: no fit of these readings is expected to leave less."""
    left = left_over(run)
    old = left(model_of(run.robot))
    return [left(found) / old, left(knowing(run)) / old]


def knowing(run: Run) -> StiffnessModel:
    """The model fitted to the readings of a run by who knows which effects are there; what the readings can not give
    keeps its true value."""
    model = model_of(run.robot)
    for hidden, _ in run.hidden:
        model = joined(model, hidden.made)
    model, free = at_truth(run, model), list[Unknown]()
    for hidden, _ in run.hidden:
        free += unknowns_in(hidden, model)
    return fit(Campaign(run.readings), model, [*own_unknowns(model), *free]).model


def at_truth(run: Run, model: StiffnessModel) -> StiffnessModel:
    """The model with the true values of all that it has."""
    names = {f"{t.effect.name}.{p}": (i, p) for i, t in enumerate(model.terms) for p in t.values}
    return model.with_values({names[name]: value for name, value in run.true().items() if name in names})


def _elsewhere(run: Run, rng: np.random.Generator):
    """The campaign at other poses, reflectors known."""
    old = run.design
    q = poses(model_of(run.robot), POSES, old.tool, rng, run.ranges)
    rows = np.sort(rng.integers(0, len(old.q), POSES))
    parts = [None if x is None else x[rows] for x in (old.time, old.temperature)]
    return replace(old, q=q, wrench=old.wrench[rows], time=parts[0], temperature=parts[1], stated=True)
