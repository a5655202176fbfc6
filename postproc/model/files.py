"""The terms of a model from the effects of a robot file, and the covariance that it states."""

from __future__ import annotations

from collections.abc import Container, Iterator

import numpy as np

from postproc.base.arrays import Floats, frozen
from postproc.base.findings import nearest
from postproc.effects import EFFECTS
from postproc.model.mechanics import EffectInstance, Mechanics
from postproc.robot.description import Robot, Value, parameter_value


def read_terms(robot: Robot) -> tuple[EffectInstance, ...]:
    """The effects of a robot file with their values.  Raises Refusal with file, line and key."""
    terms: list[EffectInstance] = []
    for entry in robot.effects:
        section = entry.section
        if entry.name not in EFFECTS:
            raise section.error(
                "YML004",
                f"{entry.name!r} is not an effect{nearest(entry.name, EFFECTS)}",
                "effect",
                "the known effects are " + ", ".join(EFFECTS),
            )
        section.only("effect", "options", "parameters")
        effect = EFFECTS[entry.name].from_options(section.section("options", {}), robot.joints)
        for term in terms:
            if (term.effect.name, term.effect.form()) == (effect.name, effect.form()):
                raise section.error("YML004", f"the same effect is defined in line {term.line}", "effect")
        given = section.section("parameters", {})
        given.only(*(parameter.name for parameter in effect.parameters))
        stated, values = {}, {}
        for parameter in effect.parameters:
            values[parameter.name] = parameter.null
            if parameter.name not in given:
                continue
            value = parameter_value(given.section(parameter.name), parameter.unit)
            if not parameter.lower <= value.value <= parameter.upper:
                raise given.error(
                    "YML004",
                    f"{value.value:g} {parameter.unit} is not within"
                    f" {parameter.lower:g} .. {parameter.upper:g} {parameter.unit}",
                    parameter.name,
                )
            stated[parameter.name], values[parameter.name] = value, value.value
        terms.append(EffectInstance(effect, values, stated, section.line))
    return tuple(terms)


def label_parameters(model: Mechanics) -> Iterator[tuple[str, Value | None]]:
    """Each parameter as label.name, and what the robot file states of it."""
    for index, term in enumerate(model.terms):
        for parameter in term.effect.parameters:
            yield f"{model.label(index)}.{parameter.name}", term.stated.get(parameter.name)


def read_covariance(model: Mechanics) -> tuple[tuple[str, ...], Floats] | None:
    """D R D (k, k), with the names (k,), of the file's correlations R and standard deviations D; of what has a 95 %
    interval there still."""
    names, relation = model.robot.correlation
    stated = {name: value.deviation for name, value in label_parameters(model) if value and value.level}
    deviation = np.array([stated.get(name) or 0.0 for name in names])
    return select_covariance((names, relation * np.outer(deviation, deviation)), stated)


def select_covariance(
    covariance: tuple[tuple[str, ...], Floats] | None, selected: Container[str]
) -> tuple[tuple[str, ...], Floats] | None:
    """The part (j, j) of a ``covariance``, names (k,) and matrix (k, k), of the names ``selected``; None of none."""
    names, matrix = covariance or ((), np.zeros((0, 0)))
    rows = [i for i, name in enumerate(names) if name in selected]
    return (tuple(names[i] for i in rows), frozen(matrix[np.ix_(rows, rows)])) if rows else None
