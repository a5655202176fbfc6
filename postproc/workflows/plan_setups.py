"""What a plan can choose from, as its options state it: poses, loads, targets, view."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.effects import ComplianceLaw
from postproc.experiments.candidate_setups import CandidateSetups, usable_limits
from postproc.identification.unknowns import Unknown
from postproc.measurements.header_comments import in_metres
from postproc.model import StiffnessModel
from postproc.robot.description import Robot
from postproc.robot.geometries import Joint

CONE = 60.0
"""[deg] Within which a reflector is visible, where nothing states it."""

TRACKER_METRES = 50.0
"""[mm] A tracker nearer to the origin of the base would stand in the robot: its place was written in metres."""

SAME_LIMIT = 1e-9
"""[rad, m] By which a stated limit may be beyond the robot's by rounding."""

HEAVIEST = 3000.0
"""[kg] No robot carries more."""


@dataclass(frozen=True)
class PlanRequest:
    """What the user asked for; mm, deg, kg.

    targets: name and place; limits: joint and range; box: three ranges, infinite where open; kind: deflection or
    absolute, None: as the effects ask for; criterion: minimax, d or test, None: test where there is a program; wanted:
    texts.  program: with its ``force`` (as of the main job) and ``cell``, what the test poses are taken from.
    """

    robot: str
    effects: tuple[str, ...]
    poses: int
    output: Path
    loads: tuple[float, ...] = ()
    one_load: bool = False
    tool_mm_deg: tuple[float, ...] = (0.0,) * 6
    targets: tuple[tuple[str, tuple[float, ...]], ...] = ()
    rough_targets: bool = False
    kind: str | None = None
    sigma_mm: float = 0.03
    criterion: str | None = None
    wanted: tuple[str, ...] = ()
    program: Path | None = None
    force: str = ""
    cell: Path | None = None
    tracker_mm: tuple[float, ...] | None = None
    cone_deg: float = CONE
    box_mm: tuple[tuple[float, float], ...] = ((-np.inf, np.inf), (-np.inf, np.inf), (0.0, np.inf))
    limits: tuple[tuple[str, tuple[float, float]], ...] = ()
    spacing_deg: float = 5.0
    measured: tuple[Path, ...] = ()
    discriminate: tuple[str, str] | None = None
    seed: int = 1
    json: Path | None = None
    page: Path | None = None


def candidate_setups(
    request: PlanRequest, robot: Robot, model: StiffnessModel, unknowns: Sequence[Unknown]
) -> CandidateSetups:
    """What the user can set up, in SI.  Raises Refusal PLN001, PLN005, PLN006."""
    names = [joint.name for joint in robot.joints]
    limits = {}
    for name, ends in request.limits:
        joint = next((joint for joint in robot.joints if joint.name.casefold() == name.casefold()), None)
        if joint is None:
            message = f"--limits: {name!r} is not a joint of {robot.name}{nearest(name, names)}"
            raise Refusal(
                Finding("PLN006", message, str(robot.path), help="the joints are " + ", ".join(names))
            )
        limits[joint.name] = _narrower(robot, joint, ends)
    tool = Poses.from_abc(np.array(request.tool_mm_deg[:3]) * MM, np.array(request.tool_mm_deg[3:]) * DEG)
    places = (
        np.array([place for _, place in request.targets]) * MM if request.targets else tool.position[None]
    )
    deflection = request.kind == "deflection" if request.kind else _by_load(model, unknowns)
    loads = sorted(set(request.loads) - ({0.0} if deflection else set()))
    if loads and loads[-1] > HEAVIEST:
        message = f"no robot carries a load of {loads[-1]:g} kg; is it in grams?"
        raise Refusal(Finding("PLN006", message, str(robot.path), help="loads are in kg"))
    if loads and robot.rated_payload is not None and loads[-1] > robot.rated_payload:
        message = f"a load of {loads[-1]:g} kg is above the rated payload of {robot.rated_payload:g} kg of {robot.name}"
        help = "use smaller loads, or correct rated_payload in the robot file"
        raise Refusal(Finding("PLN006", message, str(robot.path), help=help))
    if deflection and not loads:
        raise Refusal(
            Finding(
                "PLN005",
                "deflections are the loaded minus the unloaded place, and no load is given",
                help="use --loads 100,200 (weights in kg at the TCP), or measure places: --kind absolute",
            )
        )
    return CandidateSetups(
        tool=tool,
        targets=tuple(name for name, _ in request.targets),
        places=places,
        rough=request.rough_targets,
        loads=np.array(loads or [0.0]),
        each_load=not request.one_load,
        deflection=deflection,
        sigma=request.sigma_mm * MM,
        limits=usable_limits(robot, limits),
        box=np.array(request.box_mm) * MM,
        tracker=None if request.tracker_mm is None else np.array(request.tracker_mm) * MM,
        cone=request.cone_deg * DEG,
        spacing=request.spacing_deg * DEG,
    )


def _by_load(model: StiffnessModel, unknowns: Sequence[Unknown]) -> bool:
    """Whether a load is what shows any of the effects asked for."""
    effects = [model.terms[unknown.term].effect for unknown in unknowns]
    return any(isinstance(e, ComplianceLaw) or e.family in ("elastic", "sensor") for e in effects)


def _narrower(robot: Robot, joint: Joint, ends: tuple[float, float]) -> tuple[float, float]:
    """A stated range [rad, m].  Raises Refusal PLN006 where it goes beyond the limits of the robot."""
    unit, word = (DEG, "deg") if joint.kind == "revolute" else (MM, "mm")
    low, high = ends[0] * unit, ends[1] * unit
    apart = high < joint.lower or low > joint.upper  # no range remains
    beyond = np.isfinite(low) and low < joint.lower - SAME_LIMIT
    beyond |= np.isfinite(high) and high > joint.upper + SAME_LIMIT
    if beyond and not apart:
        message = (
            f"--limits: the range {joint.name}={ends[0]:g}:{ends[1]:g} is beyond the limits"
            f" {joint.lower / unit:g} .. {joint.upper / unit:g} {word} of {robot.name}"
        )
        help = "state a narrower range; an end may be open, as in A2=:-20"
        raise Refusal(Finding("PLN006", message, str(robot.path), help=help))
    return low, high


def implausible_lengths(request: PlanRequest, robot: Robot) -> list[Finding]:
    """Places that are so near to their origin that they were written in metres: MEA014."""
    file = str(robot.path)
    findings = in_metres("--tool", request.tool_mm_deg[:3], file)
    for name, place in request.targets:
        findings += in_metres(f"--target {name}", place, file)
    if request.tracker_mm is not None:
        findings += in_metres("--tracker", request.tracker_mm, file, least=TRACKER_METRES)
    return findings
