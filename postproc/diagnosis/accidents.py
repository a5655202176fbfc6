"""Readings so far off that they would decide: accidents, which are left out, or what the arm does."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import comb

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.identification.campaign import Campaign
from postproc.identification.fit import Fit, lengths, spread_of
from postproc.identification.outliers import Outlier, outliers

WILD, FEW = 10.0, 0.05
"""Standard deviations from which on a reading is an accident, and the share of all that may be."""

CHANCE = 0.001
"""Probability that accidents fall among the largest loads on any joint by chance."""


def far_readings(final: Fit) -> tuple[Outlier, ...]:
    """Readings that no fit with this scatter would leave so far off, worst first."""
    length = lengths(final.point.residual, final.plain_weights)
    if length.max(initial=0.0) < 0.5 * WILD * spread_of(length, final.noise.known):
        return ()
    detected, _ = outliers(final, np.ones(len(length), bool))
    return tuple(one for one in detected if one.sigmas > WILD)


def are_accidents(campaign: Campaign, far_off: Sequence[Outlier]) -> bool:
    """Whether readings ``far_off`` are as few as accidents are: one strikes one reading, or one pose; where several
    poses are off as a whole, the arm was there."""
    return len(far_off) <= FEW * len(campaign) and len(poses_off(campaign, far_off)) <= 1


def gross_errors(final: Fit) -> tuple[Outlier, ...]:
    """Readings so far off that they would decide; none where there are so many that they are no accidents."""
    far_off = far_readings(final)
    return far_off if are_accidents(final.campaign, far_off) else ()


def poses_off(campaign: Campaign, several: Sequence[Outlier]) -> Ints:
    """Numbers (K,) of poses at which more than one reading is off: of one a beam may be broken, but where others say
    the same the arm stood elsewhere."""
    pose = campaign.pose[[one.row for one in several]]
    return np.flatnonzero(np.bincount(pose, minlength=1) > 1)


def loaded_joint(final: Fit, several: Sequence[Outlier]) -> str:
    """Name of the joint on which the loads of ``several`` readings are the largest of all, more than chance makes of
    accidents; "" without one.

    Where k of n states are struck by chance, all of them are among the m largest in C(m, k) of C(n, k) cases.
    """
    campaign = final.campaign
    states, first = np.unique(campaign.at, return_index=True)
    struck = np.isin(states, campaign.at[[one.row for one in several]])
    k, tried = int(struck.sum()), list(_loads(final))
    for joint, load in tried:
        size = load[first]
        among = int((size >= size[struck].min(initial=np.inf)).sum())
        if k and comb(among, k) * len(tried) < CHANCE * comb(len(states), k):
            return joint
    return ""


def _loads(final: Fit) -> Iterator[tuple[str, Floats]]:
    """Name of each joint, and how large the moment of each reading's wrench is about its axis and across it (R,)."""
    campaign, chain = final.campaign, final.model.chain
    readings = campaign.readings
    swept = chain.evaluate(chain.placed(readings.q), campaign.tool)
    force = readings.wrench.T[:3]
    for joint, row in zip(final.model.robot.joints, chain.motor_rows, strict=True):
        moment = readings.wrench.T[3:] + np.cross(swept.position - swept.origins[row], force, axis=0)
        about = (swept.axes[row] * moment).sum(axis=0)
        yield joint.name, np.abs(about)
        yield joint.name, np.linalg.norm(moment - swept.axes[row] * about, axis=0)
