"""Zeros, lengths and twists that no robot file states, where the stated ones would be implausible without them.

What a zero of 10 mrad does, stated lengths and twists of some millimetres do as well, one against the other.  Of values
that predict the same readings the most plausible are to be reported, whatever the robot file happens to state.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.identification.fit import Fit, fit
from postproc.identification.unknowns import unknowns_of, with_gauge

IMPLAUSIBLE = 4.0
"""Standard deviations of what is plausible from which on a length, a twist or a zero is not believed by itself: by
chance one of 16,000 is there."""

CHEAPER = 0.5
"""Share of the squares of all of these that other values must leave at most."""

SAME_FIT = 4.0
"""Squares, in variances of a reading, by which those may fit the readings worse."""


def take_in_unstated_geometry(fitted: Fit) -> Fit:
    """The fit with zeros, lengths and twists that nothing states beside the stated ones, where these are implausible
    and clearly less so with them, and the readings are fitted as well; else ``fitted``."""
    if not fitted.unknowns or _deviations(fitted).max(initial=0.0) < IMPLAUSIBLE:
        return fitted
    model = fitted.model
    for effect in (LinkGeometry, JointOffset):
        if all(term.effect.name != effect.name for term in model.terms):
            model = model.with_effect(effect(model.robot.joints))
    known = {u.key for u in (*fitted.unknowns, *fitted.asked)}
    new = [
        u
        for index, term in enumerate(model.terms)
        if term.effect.name in (LinkGeometry.name, JointOffset.name)
        for u in unknowns_of(model, index)
        if u.key not in known and u.stated is None
    ]
    if not new:
        return fitted
    campaign, given = fitted.campaign, fitted.point.nuisances
    found = fit(campaign, model, [*fitted.unknowns, *with_gauge(new)], nuisances=given, factor=fitted.factor)
    worse = (_squares(found, fitted) - _squares(fitted, fitted)) / max(fitted.factor, 1e-300)
    before, after = (float(_deviations(one) @ _deviations(one)) for one in (fitted, found))
    if worse > SAME_FIT or after > CHEAPER * before:
        return fitted
    return replace(found, asked=(*fitted.asked, *found.asked[len(fitted.unknowns) :]))


def _deviations(one: Fit) -> Floats:
    """(k,) how far each parameter of geometry is from what is stated, in standard deviations of what is plausible."""
    away = one.point.values(one.unknowns) - np.array([u.value for u in one.unknowns])
    wide = [u.prior if u.gauge and u.prior is not None else np.inf for u in one.unknowns]
    return np.asarray(np.abs(away) / np.array(wide))


def _squares(one: Fit, like: Fit) -> float:
    residual = like.plain_weights(np.nan_to_num(one.point.residual))
    return float(residual @ residual)
