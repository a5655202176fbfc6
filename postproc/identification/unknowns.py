"""Which parameters a fit looks for, and what is known of them before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from postproc.base.findings import Finding, Refusal, nearest
from postproc.effects import EFFECTS, Effect, Parameter
from postproc.effects.base_offset import BaseOffset
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.effects.tool_offset import ToolOffset
from postproc.model import StiffnessModel
from postproc.robot.description import Value

PLAUSIBLE = {
    JointOffset.name: {"m": 5e-3, "rad": 5e-3},
    LinkGeometry.name: {"m": 5e-4, "rad": 5e-4},
    ToolOffset.name: {"m": 1e-3, "rad": 5e-3},
    BaseOffset.name: {"m": 5e-3, "rad": 5e-3},
}
"""Effect and unit -> standard deviation of what geometry is off by: a drive is mastered by hand, an axis is bored by a
machine, a tool is touched off at a tip and a base at a few points.  Of values that predict the same readings, the
smallest in these units are the most plausible."""


@dataclass(frozen=True)
class Unknown:
    """A parameter to be found: ``name`` as effect.parameter; ``term``: its effect in the model; ``value`` (SI) to start
    with; ``stated``: what the robot file states of it; ``prior``: its standard deviation there, where that counts as a
    reading of ``value``; ``fixed``: a dimension that is taken as stated; ``gauge``: nothing is stated, and the prior
    only chooses among values that predict the same."""

    name: str
    term: int
    parameter: Parameter
    value: float
    stated: Value | None = None
    prior: float | None = None
    fixed: bool = False
    gauge: bool = False

    @property
    def key(self) -> tuple[int, str]:
        return self.term, self.parameter.name

    @property
    def plausible(self) -> float | None:
        """[SI] Standard deviation of what it is off by where it is of geometry; None of other effects."""
        effect = self.name.partition(".")[0].partition(" ")[0]
        return PLAUSIBLE.get(effect, {}).get(self.parameter.unit)


@dataclass(frozen=True)
class FitRequest:
    """``model``: with all the effects asked for; ``unknowns``; ``fixed``: names of dimensions of hardware that no
    interval is stated of, taken as stated."""

    model: StiffnessModel
    unknowns: tuple[Unknown, ...]
    fixed: tuple[str, ...]


def asked_for(model: StiffnessModel, words: Sequence[str], priors: bool = False) -> FitRequest:
    """The unknowns that ``words`` name: effects, or single parameters as effect.parameter.

    An effect that the model does not have is added at its null, with the dimensions of a mechanism of its kind where
    the robot file has one.  Dimensions of hardware, unless named by themselves, are taken from the robot file: with an
    interval as a prior, without one as stated.  ``priors``: every stated interval counts as a prior.

    Raises Refusal IDN001 for a name that is not known.
    """
    unknowns: dict[str, Unknown] = {}
    fixed: dict[str, None] = {}
    for word in words:
        effect, _, single = word.partition(".")
        if effect not in EFFECTS:
            raise _unknown_name(f"{effect!r} is not an effect{nearest(effect, EFFECTS)}", ", ".join(EFFECTS))
        if all(term.effect.name != effect for term in model.terms):
            model = with_mechanism(model, EFFECTS[effect])
        terms = [index for index, term in enumerate(model.terms) if term.effect.name == effect]
        known = [p.name for index in terms for p in model.terms[index].effect.parameters]
        if single and single not in known:
            raise _unknown_name(
                f"{effect} has no parameter {single!r}{nearest(single, known)}", ", ".join(known)
            )
        for index in terms:
            for unknown in unknowns_of(model, index, priors):
                if single in ("", unknown.parameter.name):
                    if unknown.fixed and not single:
                        fixed[unknown.name] = None
                    else:
                        unknowns[unknown.name] = unknown
    return FitRequest(model, tuple(unknowns.values()), tuple(fixed))


def unknowns_of(model: StiffnessModel, term: int, priors: bool = False) -> tuple[Unknown, ...]:
    """All parameters of the ``term``-th effect as unknowns.

    Dimensions of hardware count with their interval as a prior; without one they are fixed, unless nothing at all is
    known of the effect's hardware.  ``priors``: every stated interval counts as a prior.
    """
    of, label = model.terms[term], model.label(term)
    built = any(parameter.hardware and parameter.name in of.stated for parameter in of.effect.parameters)
    unknowns = []
    for parameter in of.effect.parameters:
        stated = of.stated.get(parameter.name)
        prior = None
        if stated is not None and stated.interval and (priors or parameter.hardware):
            prior = stated.deviation
        fixed = parameter.hardware and built and prior is None
        value = of.values[parameter.name]
        unknowns.append(Unknown(f"{label}.{parameter.name}", term, parameter, value, stated, prior, fixed))
    return tuple(unknowns)


def with_gauge(unknowns: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """The unknowns; those of geometry, which are redundant, with a prior as wide as is plausible where none is
    stated."""
    return tuple(
        replace(u, value=u.parameter.null if u.stated is None else u.stated.value, prior=wide, gauge=True)
        if u.prior is None and (wide := u.plausible) is not None
        else u
        for u in unknowns
    )


def with_mechanism(model: StiffnessModel, kind: type[Effect]) -> StiffnessModel:
    """The model with one more effect at its null; what the robot file's mechanism of that kind states is in it."""
    for mechanism in model.robot.mechanisms:
        if mechanism.kind == kind.name:
            stated = {
                key: Value(float(quantity.values[0]), None, None, quantity.source or mechanism.source)
                for key, quantity in mechanism.quantities.items()
                if quantity.values.size == 1
            }
            effect = kind.of_mechanism(
                model.robot.joints, mechanism.joint, {key: value.value for key, value in stated.items()}
            )
            own = {p.name: stated[p.name] for p in effect.parameters if p.name in stated}
            return model.with_effect(effect, own)
    return model.with_effect(kind(model.robot.joints))


def _unknown_name(message: str, known: str) -> Refusal:
    return Refusal(Finding("IDN001", message, help=f"these are known: {known}"))
