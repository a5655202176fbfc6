"""Where tracker and targets are, as a fit found them, with intervals."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import abc_from_rotation
from postproc.base.units import DEG, MM
from postproc.identification.fit import Fit
from postproc.identification.least_squares import prior_rows, prior_weight


class Placed(NamedTuple):
    """``name`` of a session or target; position (3,) [mm] and angles (3,) [deg] A, B, C of the robot base in the
    tracker's frame, or of the target on the flange or, ``on_base``, in the robot base (angles None); ci95 (3,) [mm],
    angles_ci95 (3,) [deg]: 95 % intervals."""

    name: str
    position: Floats
    ci95: Floats
    angles: Floats | None
    angles_ci95: Floats | None
    on_base: bool = False


def stations(fitted: Fit) -> tuple[Placed, ...]:
    """The robot base in the tracker's frame of each session; () where places are in the robot's frame."""
    campaign, given = fitted.campaign, fitted.point.nuisances
    if not campaign.tracked:
        return ()
    wide = _intervals(fitted)
    places = []
    for k, name in enumerate(campaign.readings.sessions):
        rotation = given.frames.rotation[k]
        shift, turn = wide[6 * k : 6 * k + 3], wide[6 * k + 3 : 6 * k + 6]
        places.append(
            Placed(
                name, given.frames.position[k] / MM, shift / MM, abc_from_rotation(rotation) / DEG, turn / DEG
            )
        )
    return tuple(places)


def targets(fitted: Fit) -> tuple[Placed, ...]:
    """The targets whose place is not stated."""
    campaign, given = fitted.campaign, fitted.point.nuisances
    wide, names, places = _intervals(fitted), campaign.nuisance_names, []
    for k, name in enumerate(campaign.targets):
        label = f"target{f' {name}' if name else ''}.x"
        if campaign.place_known[k] or label not in names:
            continue
        at = names.index(label)
        there = given.places[k]
        if not campaign.on_base[k]:
            there = campaign.tool.rotation @ there + campaign.tool.position
        places.append(Placed(name, there / MM, wide[at : at + 3] / MM, None, None, bool(campaign.on_base[k])))
    return tuple(places)


def tracker_scale(fitted: Fit) -> tuple[float, float] | None:
    """Scale of lengths that the tracker reads over the robot's, less 1, and its 95 % interval; None where it is no
    unknown."""
    if not fitted.campaign.scaled:
        return None
    return fitted.point.nuisances.scale, float(_intervals(fitted)[-1])


def _intervals(fitted: Fit) -> Floats:
    """(U,) [m, rad, 1] 95 % intervals of tracker and targets, in the axes that they are moved in."""
    own, nuisance = fitted.point.required_columns
    columns, others = (np.nan_to_num(fitted.weights(part)) for part in (own, nuisance))
    weight = prior_weight(fitted.factor)
    known = fitted.campaign.nuisance_prior(fitted.point.nuisances)[0] * weight
    prior = prior_rows(fitted.unknowns) * weight
    p, u = columns.shape[1], others.shape[1]
    matrix = np.block(
        [
            [others, columns],
            [known, np.zeros((len(known), p))],
            [np.zeros((len(prior), u)), prior],
        ]
    )
    length = np.linalg.norm(matrix, axis=0)
    length[length == 0] = 1.0
    covariance = np.linalg.pinv((matrix / length).T @ (matrix / length), rcond=1e-12, hermitian=True)
    deviation = np.sqrt(np.clip(np.diag(covariance), 0.0, None) * fitted.factor) / length
    return np.asarray(fitted.quantile * deviation[:u])
