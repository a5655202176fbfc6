"""Sensitivities of a campaign: what each unknown moves in each reading."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.identification.campaign import Campaign, Nuisances, PredictedReadings
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

STEP = 0.01
"""Step of the differences, in sizes of the parameter (or values, where those are larger)."""


def columns(
    campaign: Campaign,
    model: StiffnessModel,
    unknowns: Sequence[Unknown],
    predicted: PredictedReadings,
    nuisances: Nuisances,
) -> Floats:
    """(R, 3 or 6, P) change of what is expected [m, rad] with each unknown, per ``scale`` of its parameter.

    The derivative of the equilibrium by the implicit function; that of an effect by its parameter is a central
    difference, which stops at the parameter's bounds.  NaN where the model has no rest.
    """
    spans = {}
    for unknown in unknowns:
        parameter, value = unknown.parameter, model.terms[unknown.term].values[unknown.parameter.name]
        step = STEP * max(parameter.scale, abs(value))
        spans[unknown.key] = max(value - step, parameter.lower), min(value + step, parameter.upper)
    moved = model.sensitivity(
        campaign.q, campaign.wrench, campaign.tool, campaign.conditions, predicted.displacement, spans
    )
    moved *= np.array([unknown.parameter.scale for unknown in unknowns])
    return campaign.columns(model, predicted, nuisances, moved)
