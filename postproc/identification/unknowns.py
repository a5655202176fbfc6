"""Which parameters a fit looks for, and what is known of them before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from postproc.effects import EFFECTS, Parameter
from postproc.findings import Finding, Refusal, nearest
from postproc.model import StiffnessModel
from postproc.robot.description import Value


@dataclass(frozen=True)
class Unknown:
    """A parameter to be found: ``name`` as effect.parameter; ``term``: its effect in the model; ``value`` (SI) to begin
    with; ``stated``: what the robot file says of it; ``prior``: its standard deviation there, where that counts as a
    reading of ``value``."""

    name: str
    term: int
    parameter: Parameter
    value: float
    stated: Value | None = None
    prior: float | None = None

    @property
    def key(self) -> tuple[int, str]:
        return self.term, self.parameter.name


@dataclass(frozen=True)
class Asked:
    """``model``: with all the effects asked for; ``unknowns``; ``held``: names of dimensions of hardware that no
    interval is stated of, taken as they stand."""

    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    held: tuple[str, ...]


def asked_for(model: StiffnessModel, words: Sequence[str], priors: bool = False) -> Asked:
    """The unknowns that ``words`` name: effects, or single parameters as effect.parameter.

    An effect that the model does not have is added at its null, with the dimensions of a mechanism of its kind where
    the robot file has one.  Dimensions of hardware, unless named by themselves, are taken from the robot file: with an
    interval as a prior, without one as they stand.  ``priors``: every stated interval counts as a prior.

    Raises Refusal IDN001 for a name that is not known.
    """
    unknowns: list[Unknown] = []
    held: list[str] = []
    for word in words:
        effect, _, single = word.partition(".")
        if effect not in EFFECTS:
            raise _unknown_name(f"{effect!r} is no effect{nearest(effect, EFFECTS)}", ", ".join(EFFECTS))
        if all(term.effect.name != effect for term in model.terms):
            model = _with_effect(model, effect)
        found = False
        for index, term in enumerate(model.terms):
            if term.effect.name != effect:
                continue
            label = model.label(index)
            for parameter in term.effect.parameters:
                if single not in ("", parameter.name):
                    continue
                found = True
                name = f"{label}.{parameter.name}"
                if any(unknown.name == name for unknown in unknowns):
                    continue
                stated = term.stated.get(parameter.name)
                prior = None
                if stated is not None and stated.interval and (priors or parameter.hardware):
                    prior = stated.deviation
                if parameter.hardware and prior is None and not single:
                    held.append(name)
                    continue
                unknowns.append(Unknown(name, index, parameter, term.values[parameter.name], stated, prior))
        if not found:
            known = [
                p.name for term in model.terms if term.effect.name == effect for p in term.effect.parameters
            ]
            raise _unknown_name(
                f"{effect} has no parameter {single!r}{nearest(single, known)}", ", ".join(known)
            )
    return Asked(model, tuple(unknowns), tuple(held))


def _unknown_name(message: str, known: str) -> Refusal:
    return Refusal(Finding("IDN001", message, help=f"known: {known}"))


def _with_effect(model: StiffnessModel, name: str) -> StiffnessModel:
    effect = EFFECTS[name](model.robot.joints)
    known = {parameter.name: parameter for parameter in effect.parameters}
    values, stated = {}, {}
    for mechanism in model.robot.mechanisms:
        if mechanism.kind == name:
            for key, quantity in mechanism.quantities.items():
                if key in known and quantity.unit == known[key].unit and quantity.values.size == 1:
                    values[key] = float(quantity.values[0])
                    stated[key] = Value(values[key], None, None, quantity.source or mechanism.source)
    model = model.added(effect, values)
    return replace(model, terms=(*model.terms[:-1], replace(model.terms[-1], stated=stated)))
