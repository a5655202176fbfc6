"""What an effect is, in words."""

from __future__ import annotations

from postproc.diagnosis.candidates import Candidate
from postproc.diagnosis.decoys import AlternativeForm

NOUNS = {
    "joint_compliance": "compliance of {joints}: the gear deflects in proportion to the torque",
    "tool_compliance": "compliance of the tool: cutter, holder and spindle deflect",
    "gravity_compensator": "a gravity compensator across {joints}: a spring whose torque follows the angle",
    "link_gravity": "the arm's own weight beyond {joints}: it deflects the arm",
    "gravity_sag": "sag of {joints} under the arm's own weight: weight times compliance, of which neither is known",
    "payload": "a weight on the flange: it deflects the arm",
    "base_compliance": "compliance of the foundation: the whole robot tilts under load",
    "link_compliance": "compliance of {joints} across the axis: bearings and links tilt under load",
    "joint_stiffening": "stiffening of {joints}: the gear grows stiffer with load",
    "backlash": "backlash in {joints}: the gear has play",
    "hysteresis": "hysteresis of {joints}: friction stops the joint before its target, on the side of approach",
    "transmission_error": "a transmission error of {joints}: the gear ratio varies with the angle",
    "joint_offset": "a wrong zero of {joints}",
    "link_geometry": "wrong geometry at {joints}: the axes differ from the stated link geometry",
    "joint_coupling": "a coupling in the wrist: other motors also rotate {joints}",
    "tool_offset": "a tool offset: tool or target differ from the stated position",
    "base_offset": "a base offset: the robot differs from the stated position",
    "thermal_growth": "thermal growth of the links before {joints}: they lengthen as the robot warms up",
    "force_sensor": "an error of the stated forces: in their scale or their zero",
}
"""What an effect is, to those who do not know its name."""


def in_words(candidate: Candidate) -> str:
    """What a candidate is, and its label: ``backlash in A3 (backlash on A3)``."""
    effect = candidate.effect
    if isinstance(effect, AlternativeForm):
        return f"{effect.about} {candidate.joint}".strip() + f" ({candidate.label})"
    last = candidate.up_to_joint
    joints = candidate.joint or (f"the joints up to {last}" if last else "the joints")
    return f"{NOUNS[candidate.name].split(':')[0].format(joints=joints)} ({candidate.label})"


def variable_words(name: str) -> str:
    """What a residual depends on: ``the torque of A2`` of ``A2 over its torque``."""
    joint, over, quantity = name.partition(" over its ")
    if not over:
        return "the order of the readings" if name == "order" else f"the {name}"
    return f"the side from which {joint} comes" if quantity == "approach" else f"the {quantity} of {joint}"
