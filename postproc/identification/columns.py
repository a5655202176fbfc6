"""Sensitivities of a campaign: what each unknown moves in each reading."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from postproc.arrays import Floats
from postproc.geometry import vector_from_rotation
from postproc.identification.campaign import Campaign, Nuisances, Seen
from postproc.identification.unknowns import Unknown
from postproc.model import StiffnessModel

STEP = 0.01
"""Step of the differences, in sizes of the parameter (or values, where those are larger)."""


REST = 1e-10
"""[rad, m] Last step of the equilibria that are subtracted: a thousandth of a per cent of what a step moves."""


def columns(
    campaign: Campaign, model: StiffnessModel, unknowns: Sequence[Unknown], seen: Seen, given: Nuisances
) -> Floats:
    """(R, 3 or 6, P) change of what is expected [m, rad] with each unknown, per ``scale`` of its parameter.

    Central differences of the solved equilibrium, which stop at a parameter's bounds; NaN where a stepped model has no
    rest.
    """
    found = np.zeros((len(campaign), 6 if campaign.posed else 3, len(unknowns)))
    for column, unknown in enumerate(unknowns):
        parameter, value = unknown.parameter, model.terms[unknown.term].values[unknown.parameter.name]
        step = STEP * max(parameter.scale, abs(value))
        low, high = max(value - step, parameter.lower), min(value + step, parameter.upper)
        ends = [
            campaign.expected(
                campaign.seen(model.changed({unknown.key: end}), seen.displacement, REST), given
            )
            for end in (low, high)
        ]
        per = parameter.scale / (high - low)
        found[:, :3, column] = (ends[1][0] - ends[0][0]) * per
        if ends[0][1] is not None and ends[1][1] is not None:
            turn = vector_from_rotation(ends[1][1] @ np.swapaxes(ends[0][1], 1, 2))
            found[:, 3:, column] = turn * per
    return found
