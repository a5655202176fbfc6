"""What a diagnosis could not test, in words."""

from __future__ import annotations

from collections.abc import Iterator

from postproc.effects import EFFECTS, ComplianceLaw
from postproc.identification.fit import Fit
from postproc.identification.sanity_checks import LOADED
from postproc.report.diagnosed import USUAL, Diagnosed
from postproc.report.formatting import listed
from postproc.report.formatting import millimetres as _mm


def conditional(result: Diagnosed) -> Iterator[str]:
    if result.verdict.conditional:
        yield (
            f"This verdict assumes that readings scatter as much as the residuals, {_mm(result.scatter)} mm RMS:"
            " neither SIGMA nor repeated readings state it, and an effect of that size would be mistaken for scatter."
        )


def not_tested(result: Diagnosed) -> Iterator[str]:
    """The effects that were not tested, or only at large size, and which readings would show them."""
    for names, start in (
        (result.verdict.not_testable, "Not tested:"),
        (result.hardly_tested, f"Tested only at {USUAL:.0f} times their usual size or more:"),
    ):
        advised: dict[str, list[str]] = {}
        for name in names:
            advised.setdefault(evidence_words(name, result.final), []).append(name)
        if advised:
            yield f"{start} {'; '.join(f'{listed(of)} (shown by {what})' for what, of in advised.items())}."


def evidence_words(name: str, fitted: Fit) -> str:
    """What would show an effect that readings and model of a fit do not."""
    effect, campaign = EFFECTS[name], fitted.campaign
    readings = campaign.readings
    if name == "thermal_growth" and readings.temperature is None and readings.time is None:
        return "a column TEMP or T while the robot warms up"
    if effect.family in ("geometric", "weight") and readings.deflection:
        return "absolute positions"
    if name == "tool_offset" and not campaign.place_known.all():
        return "targets with stated positions"
    if name == "tool_compliance" and not campaign.at_tip:
        return "readings at the tip of the tool: targets on the flange do not move with the spindle"
    if effect.family == "weight" and not any(isinstance(t.effect, ComplianceLaw) for t in fitted.model.terms):
        return "a robot file with joint compliance"
    if effect.family in LOADED and not readings.wrench.any():
        return "readings with and without a weight"
    if effect.by_direction:
        return "poses reached from both sides"
    return "other poses or loads, `compensate plan`"
