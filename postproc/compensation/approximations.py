"""From where on the ends of motions are approximated, as it is stated or may be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.toolpath import Role


def approximations(task: CompensationProblem, division: Subdivision, motions: Ints) -> Floats:
    """(K,) [m] from where on the ends of ``motions`` (K,) of a division are approximated, NaN where it is not known:
    as they are written, or before that as inserted motions will be."""
    if division.blend is not None:
        return np.asarray(division.blend[motions])
    source, path = division.source[motions], task.toolpath
    blend = path.approximation[source].copy()
    exact = (division.role[motions] == Role.INTERMEDIATE) & (blend == 0)
    if not path.constraints.exact_stays:
        blend[exact] = path.constraints.inserted_approximation[source[exact]]
    return np.where(division.role[motions] == Role.TRANSITION, np.nan, blend)


Run = tuple[CompensationProblem, Subdivision]
"""A program and its output."""


def with_distance(task: CompensationProblem, division: Subdivision, distance: float) -> Run:
    """Both with the approximation ``distance`` [m] where nothing states one."""
    blend = approximations(task, division, np.arange(len(division)))
    stated = replace(division, blend=np.nan_to_num(blend, nan=distance))
    return _with_approximation(task, distance), stated


def as_stated(task: CompensationProblem, division: Subdivision) -> Run:
    """Both without the approximations of which nothing states the distance."""
    known = np.isfinite(task.toolpath.approximation).all()
    known = known and np.isfinite(approximations(task, division, np.arange(len(division)))).all()
    return (task, division) if known else with_distance(task, division, 0.0)


def stated_alone(task: CompensationProblem) -> CompensationProblem:
    """The program without such approximations, for a division that is not written yet."""
    return _with_approximation(task, 0.0) if np.isnan(task.toolpath.approximation).any() else task


def _with_approximation(task: CompensationProblem, distance: float) -> CompensationProblem:
    path = task.toolpath.with_columns(approximation=np.nan_to_num(task.toolpath.approximation, nan=distance))
    other = replace(task, toolpath=path)
    vars(other)["desired_path"] = task.desired_path  # no approximation changes it
    return other
