"""What the cell asks to have corrected: the model for it, what touching off a base saw, and what is excluded."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, vector_from_rotation
from postproc.base.units import DEG, MM
from postproc.cell import Cell
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.touched_off import TouchedOff
from postproc.effects import ComplianceLaw, Offset
from postproc.effects.thermal_growth import ThermalGrowth
from postproc.model import EffectInstance, StiffnessModel
from postproc.toolpath import Kind, Toolpath
from postproc.workflows.tool_weights import weight_findings

GROUPS = {"geometric": "geometry", "weight": "weights", "gear": "lost motion", "elastic": "static torques"}
"""Family of an effect -> what people call what it does to a robot without load."""

TEMPERATURE = "temperature"

SIDE_BY_WEIGHTS = "the side of a gap that weights choose"
"""What lost motion is without a machining force, beside the direction of motion, which is corrected."""


def corrected_model(full: StiffnessModel, cell: Cell) -> StiffnessModel:
    """The model without what the controller corrects by itself.

    A controller that is absolutely accurate is so at the temperature of its calibration: thermal growth stays.
    """
    if cell.correct == "process":
        return full
    own = {term.effect.name for term in full.terms if _corrected_by_controller(term, cell)}
    return full.without_effects(effects=own)


def _corrected_by_controller(term: EffectInstance, cell: Cell) -> bool:
    family, controller = term.effect.family, cell.controller
    if family == "geometric" and not isinstance(term.effect, ThermalGrowth):
        return controller.absolute_accuracy
    return family == "weight" and controller.gravity_compensated


def temperature_rise(model: StiffnessModel, cell: Cell) -> float | None:
    """[K] by which the robot is warmer than at its calibration; None where that is not asked for.

    Raises Refusal CEL011 where the robot file does not state at which temperature it was calibrated.
    """
    if cell.correct == "process" or cell.temperature is None:
        return None
    for term in model.terms:
        effect = term.effect
        if isinstance(effect, ThermalGrowth) and effect.variable == "temperature":
            if effect.reference is None:
                raise Refusal(
                    Finding(
                        "CEL011",
                        "thermal_growth does not state the temperature of its calibration, so"
                        f" `temperature: {cell.temperature:g}` of the cell has no reference",
                        str(model.robot.path),
                        term.line,
                        help="add it to the effect: options: {reference: 20} (degC)",
                    )
                )
            return cell.temperature - effect.reference
    return None


# touching off


def touch_off(task: CompensationProblem, cell: Cell) -> tuple[TouchedOff, list[Finding]]:
    """What touching the cell's points sees of the bases of a program, and the findings on it.

    The points of a base are touched without load, with the tool, orientation and configuration of the first cutting
    motion in it (the first path motion, where none cuts).  Raises Refusal CEL012 where it is not clear which base was
    touched off or where external axes of the cell were meanwhile, or a point cannot be touched.
    """
    path, track = task.toolpath, task.track
    if task.external is not None and task.external.constant is None:
        raise _refused(
            cell,
            "external axes move in this program: it is not clear where they stood when its bases were touched off",
            "cut with external axes that do not move, or use correct: process",
        )
    usable = path.known & ~path.on_axes & (track.branch >= 0) & track.reachable
    motions = usable & np.isin(path.kind, (Kind.LIN, Kind.CIRC, Kind.SPL))
    points = _points_by_frame(task, cell, np.unique(path.base[motions]).tolist())
    of_frame = []
    for index in points:
        here = motions & (path.base == index)
        cutting = here & task.carries
        of_frame.append(int(np.argmax(cutting if cutting.any() else here)))
    counts = [len(own) for own in points.values()]
    frame, row = np.repeat(list(points), counts), np.repeat(of_frame, counts)
    place = np.concatenate(list(points.values()))
    rotation = path.target_in_base[row].rotation
    wanted = task.base[row] @ Poses(rotation, place)
    touched = TouchedOff.of(
        task.model, track, task.conditions, frame, row, wanted, task.tool[row], len(path.frames)
    )
    _check_touched(task, cell, touched, place)
    return touched, [_touched_finding(task, touched, index) for index in points]


def _points_by_frame(task: CompensationProblem, cell: Cell, used: Sequence[int]) -> dict[int, Floats]:
    """Frame of the program -> (K, 3) [m] points at which it was touched off."""
    path = task.toolpath
    numbers = {frame: path.frames[frame].number for frame in used}
    if not used:
        raise _refused(
            cell, "no base can be touched off: the program has no path motion that the robot can follow"
        )
    if None in cell.touch_points:
        # a base whose definition changes is still one base; bases without a number are each their own
        bases = {frame if number is None else (number,) for frame, number in numbers.items()}
        if len(bases) > 1:
            raise _refused(
                cell,
                f"the program uses {_bases(numbers.values())}: it is not clear which of them is touched off",
                "name the bases: touch_points: {1: [[x, y, z], ...], 2: [[x, y, z], ...]}",
            )
        return dict.fromkeys(used, cell.touch_points[None])
    cut = path.base[task.carries & np.isin(path.base, used)]
    for frame in np.unique(cut).tolist():
        if numbers[frame] is None or numbers[frame] not in cell.touch_points:
            line = int(path.line[np.argmax(task.carries & (path.base == frame))])
            raise _refused(
                cell,
                f"{_bases([numbers[frame]])} has no touch points, and the program cuts in it (line {line})",
                "every base in which a program cuts needs its own points",
            )
    points = {frame: cell.touch_points[n] for frame, n in numbers.items() if n in cell.touch_points}
    if not points:
        raise _refused(cell, f"the program uses {_bases(numbers.values())}, none of which has touch points")
    return points


def _bases(numbers: Iterable[int | None]) -> str:
    stated = sorted({number for number in numbers if number is not None})
    words = ["base " + ", ".join(map(str, stated))] if stated else []
    if None in numbers:
        words.append("a base without a number")
    return " and ".join(words)


def _check_touched(task: CompensationProblem, cell: Cell, touched: TouchedOff, place: Floats) -> None:
    low, high = task.model.robot.limits.T
    q = touched.real.q
    within = ((q >= low - 1e-9) & (q <= high + 1e-9)).all(axis=1)
    for good, problem in (
        (touched.real.reachable, "is out of reach"),
        (within, "is beyond the limits of an axis"),
        (touched.real.settled, "has no equilibrium"),
    ):
        if not good.all():
            bad = int(np.argmin(good))
            x, y, z = place[bad] / MM
            line = task.toolpath.line[touched.row[bad]]
            raise _refused(
                cell,
                f"the touch point {x:g}, {y:g}, {z:g} {problem} with the tool and orientation of line {line}",
                "touch points are places in the base, in mm",
            )


def _refused(cell: Cell, message: str, help: str = "") -> Refusal:
    return Refusal(Finding("CEL012", f"touch_points: {message}", str(cell.path), cell.touch_line, help=help))


def _touched_finding(task: CompensationProblem, touched: TouchedOff, frame: int) -> Finding:
    path, own = task.toolpath, touched.frame == frame
    row = int(touched.row[own][0])
    shift = (touched.motion[frame] @ touched.wanted[own]).position - touched.wanted.position[own]
    turn = float(np.linalg.norm(vector_from_rotation(touched.motion.rotation[frame])))
    count, number = int(own.sum()), path.frames[frame].number
    tool = path.frames[path.tool[row]].number
    note = "" if task.external is None or task.external.joint is None else ", with the external axis as there"
    message = (
        f"base {'' if number is None else f'{number} '}is touched off at {count} point{'' if count == 1 else 's'}"
        f" with {'the tool' if tool is None else f'tool {tool}'} and orientation of this line{note}, without load: it"
        f" contains {np.linalg.norm(shift.mean(axis=0)) / MM:.3f} mm"
    )
    if count > 1:
        message += (
            f" and {turn / DEG:.4f} deg of the robot's errors; {touched.residual()[own].max() / MM:.3f} mm"
        )
        message += " at the points remain"
    else:
        message += " of the robot's errors"
    return Finding("COR032", message, task.file, int(path.line[row]))


# what is excluded


def mode_findings(full: StiffnessModel, cell: Cell, program: Toolpath, file: str) -> list[Finding]:
    """The effects of the robot file ``full`` that are not corrected, and why; weights that the tools of the ``program``
    have and no effect counts."""
    acting = [term for term in full.terms if _acts_unloaded(term, cell)]
    if cell.correct == "process":
        return _excluded_by_process(full, acting, cell, file)
    findings = []
    by_controller = [term for term in acting if _corrected_by_controller(term, cell)]
    if by_controller:
        message = f"the controller corrects these, as the cell states: {_in_groups(by_controller)}"
        findings.append(Finding("COR030", message, file))
    thermal = [t for t in acting if isinstance(t.effect, ThermalGrowth)]
    by_temperature = [t for t in thermal if t.effect.form()["variable"] == "temperature"]
    path, line = str(cell.path), cell.temperature_line
    if cell.temperature is not None and not by_temperature:
        message = (
            "temperature: the robot file has no thermal_growth by temperature, so the growth is not corrected"
        )
        findings.append(Finding("COR031", message, path, line))
    if cell.temperature is None and by_temperature:
        message = "thermal_growth of the robot file is not corrected: the cell states no temperature"
        findings.append(Finding("COR031", message, path, help="add temperature: 24 (degC, of the robot)"))
    if len(thermal) > len(by_temperature):
        message = "thermal_growth by time is not corrected: the time of a run is not known"
        findings.append(Finding("COR031", message, path))
    return findings + weight_findings(full, cell, program, file)


def _excluded_by_process(
    full: StiffnessModel, acting: Sequence[EffectInstance], cell: Cell, file: str
) -> list[Finding]:
    # an offset by direction alone has no middle that would stay: it is corrected
    words = _in_groups(
        [term for term in acting if not (term.effect.by_direction and isinstance(term.effect, Offset))]
    )
    words = words.replace(GROUPS["gear"], SIDE_BY_WEIGHTS)
    if full.robot.nominal is not full.robot.arm:
        words += (", " if words else "") + "geometry that differs from the controller's"
    findings = []
    if words:
        findings.append(
            Finding(
                "COR030",
                f"correct: process does not correct errors of the robot without force: {words}",
                file,
                help="a touched-off base contains them near the touched places; use correct: touched_off or"
                " absolute to correct them",
            )
        )
    if cell.temperature is not None:
        message = "temperature: is not used with correct: process"
        findings.append(Finding("COR030", message, str(cell.path), cell.temperature_line))
    return findings


def _acts_unloaded(term: EffectInstance, cell: Cell) -> bool:
    """Whether an effect moves the tool without a force on it."""
    effect = term.effect
    elastic = effect.family == "elastic" and isinstance(effect, ComplianceLaw)
    if effect.zero_without_load or elastic or effect.family == "sensor":
        return False
    if effect.name == "payload" and any(tool.mass for tool in cell.tools.values()):
        return True
    return any(term.values[parameter.name] != parameter.null for parameter in effect.parameters)


def _in_groups(terms: Sequence[EffectInstance]) -> str:
    """``geometry (joint_offset, link_geometry), weights (link_gravity)``"""
    grouped: dict[str, list[str]] = {}
    for term in terms:
        thermal = isinstance(term.effect, ThermalGrowth)
        group = TEMPERATURE if thermal else GROUPS[term.effect.family]
        grouped.setdefault(group, []).append(term.effect.name)
    return ", ".join(f"{group} ({', '.join(dict.fromkeys(names))})" for group, names in grouped.items())
