"""Derivatives of solved states: by parameters, and of the generalized forces by coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import Poses
from postproc.effects import ChainState, ComplianceLaw, Conditions, Effect, Load, Offset, Values
from postproc.model.mechanics import Mechanics
from postproc.model.solve import CHUNK


def compute_sensitivity(
    model: Mechanics,
    q: Floats,
    wrench: Floats,
    tool: Poses,
    conditions: Conditions,
    displacement: Floats,
    spans: Mapping[tuple[int, str], tuple[float, float]],
) -> Floats:
    """(N, m, P) at ``q`` (N, n) [rad, m] under ``wrench`` (N, 6) [N, N m], ``displacement`` (N, m) [rad, m]: see
    ``StiffnessModel.sensitivity``."""
    state = model.state(q, wrench, tool, conditions, displacement)
    force, _ = model.forces(state)
    _, gives = model.displacement(state, force)
    own = np.empty((*displacement.shape, len(spans)))
    every = np.arange(model.chain.size)
    by_rest: Floats | None = None
    for k, ((term, name), ends) in enumerate(spans.items()):
        effect, values = model.terms[term].effect, model.terms[term].values
        low, high = (_alone(model, effect, {**values, name: value}, state, force) for value in ends)
        moved = ((high - low) / (ends[1] - ends[0])).T
        if isinstance(effect, Load):
            moved = gives.T * moved
        elif isinstance(effect, Offset) and any(load.by_rest for load, _ in model.loads):
            if by_rest is None:
                by_rest = gives.T[:, :, None] * compute_curvature(model, state, tool, every, True, force)
            moved = moved + (by_rest @ moved[:, :, None])[:, :, 0]
        own[:, :, k] = moved
    # what is neither compliant nor moved by a parameter stays where it is
    free = np.flatnonzero(gives.any(axis=1) | own.any(axis=(0, 2)))
    curvature = compute_curvature(model, state, tool, free, force=force)
    inner = np.eye(len(free)) - (gives.T[:, :, None] * curvature)[:, free]
    own[:, free] = np.linalg.solve(inner, own[:, free])
    return own


def _alone(model: Mechanics, effect: Effect, values: Values, state: ChainState, force: Floats) -> Floats:
    """(m, N) what one effect adds: a force, an offset, or a displacement under ``force``."""
    contribution, slope = np.zeros_like(force), np.zeros_like(force)
    if isinstance(effect, Load):
        effect.add_force(values, state, contribution, slope)
    elif isinstance(effect, Offset):
        effect.add_offset(values, model.chain, state.motors, state.conditions, contribution)
    elif isinstance(effect, ComplianceLaw):
        effect.add_displacement(values, state, force, contribution, slope)
    return contribution


def compute_curvature(
    model: Mechanics,
    state: ChainState,
    tool: Poses,
    columns: Ints,
    of_rest: bool = False,
    force: Floats | None = None,
) -> Floats:
    """H (N, m, k): derivative of the generalized forces by the coordinates ``columns`` (k,), or by the coordinates
    without load where those stay; central differences, many at once.  With the ``force`` (m, N) [N m, N] at ``state``
    the differences are forward ones, of half the work: a part in a million of H."""
    size, count, step = model.chain.size, state.motors.shape[1], 1e-6
    sides = 2 if force is None else 1
    h = np.empty((count, size, len(columns)))
    at_once = max(1, CHUNK // max(1, sides * count))
    for start in range(0, len(columns), at_once):
        part = columns[start : start + at_once]
        rows = np.tile(np.arange(count), sides * len(part))
        many = state.part(rows)
        moved = (many.rest if of_rest else many.coordinates).reshape(size, len(part), sides, count)
        moved[part, np.arange(len(part)), 0] += step
        if force is None:
            moved[part, np.arange(len(part)), 1] -= step
        at = tool if tool.position.ndim == 1 else tool[rows]
        swept = model.chain.evaluate(many.coordinates, at, many.conditions.spindle)
        there = model.forces(replace(many, swept=swept))[0].reshape(size, len(part), sides, count)
        slope = (there[:, :, 0] - (there[:, :, 1] if force is None else force[:, None])) / (sides * step)
        h[:, :, start : start + len(part)] = np.moveaxis(slope, 2, 0)
    return h
