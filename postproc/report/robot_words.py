"""A robot file in words: geometry, limits, effects with intervals and sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.base.arrays import Floats
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.model import StiffnessModel
from postproc.report.result_keys import complete_result
from postproc.robot.description import Robot, Value
from postproc.robot.external_axes import own_column
from postproc.robot.geometries import KukaLengths, KukaVariant
from postproc.robot.provenance import Identification

_GAP_WORDS = {
    "before_rms_mm": "before",
    "after_rms_mm": "after",
    "noise_mm": "noise",
    "held_out_before_rms_mm": "held out: before",
    "held_out_after_rms_mm": "held out: after",
}


def list_robots(console: Console, models: Sequence[StiffnessModel]) -> None:
    """One line a robot."""
    table = Table(box=None, pad_edge=False)
    for head in ("name", "maker's name", "effects"):
        table.add_column(head)
    for model in models:
        effects = ", ".join(term.effect.name for term in model.terms) or "none: geometry only"
        table.add_row(Text(model.robot.name), Text(model.robot.maker_name), Text(effects))
    console.print(table)


def show_robot(console: Console, models: Sequence[StiffnessModel]) -> None:
    """All that the file of one robot states."""
    (model,) = models
    robot = model.robot
    console.print(Text(f"{robot.name}: {robot.maker_name}", style="bold"))
    console.print(Text(robot.about), Text(""))
    console.print(Text(f"{_geometry_words(robot)}\n  {robot.geometry_source}"))
    if robot.nominal is not robot.arm and robot.nominal != robot.arm:
        console.print(Text("the controller uses another geometry"))
    console.print(Text(f"{_limits_words(robot)}\n  {robot.limits_source}"))
    if robot.external is not None:
        name = robot.joints[robot.external].name
        stated = own_column(robot) is not None
        where = (
            "as the program states it, before that as `start`" if stated else "stays at its value of `start`"
        )
        console.print(Text(f"external  {name}: {where}"))
    if robot.masses:
        masses = "  ".join(f"{mass.joint} {mass.mass:g}" for mass in robot.masses)
        console.print(Text(f"masses [kg]  {masses}\n  {robot.masses_source}"))
    for mechanism in robot.mechanisms:
        at = f" at {mechanism.joint}" if mechanism.joint else ""
        console.print(Text(f"mechanism  {mechanism.name} ({mechanism.kind}){at}\n  {mechanism.source}"))
    for run in robot.identified:
        console.print(Text(_identified_words(run)))
    console.print()
    for term in model.terms:
        options = ", ".join(f"{key} {_option(value)}" for key, value in term.effect.described().items())
        table = Table(
            title=f"{term.effect.name}{f' ({options})' if options else ''}",
            title_justify="left",
            box=None,
            pad_edge=False,
        )
        for head in ("parameter", "value", "interval", "unit", "source"):
            table.add_column(head, no_wrap=head != "source")
        units = {parameter.name: parameter.unit for parameter in term.effect.parameters}
        for name, value in term.stated.items():
            table.add_row(name, f"{value.value:.6g}", _interval(value), units[name], Text(value.source))
        console.print(table)
        console.print()


def robots_json(models: Sequence[StiffnessModel]) -> dict[str, object]:
    """The machine-readable result; the keys are public.  SI units."""
    return complete_result("robots", {"robots": [_robot(model) for model in models], "exit": 0})


def _robot(model: StiffnessModel) -> dict[str, object]:
    robot = model.robot
    return {
        "name": robot.name,
        "maker_name": robot.maker_name,
        "file": str(robot.path),
        "digest": robot.digest,
        "geometry": {**_geometry_json(robot), "source": robot.geometry_source},
        "limits_deg": {j.name: [j.lower / DEG, j.upper / DEG] for j in robot.joints if j.kind == "revolute"},
        "limits_mm": {j.name: [j.lower / MM, j.upper / MM] for j in robot.joints if j.kind == "prismatic"},
        "external": None if robot.external is None else robot.joints[robot.external].name,
        "mechanisms": [
            {
                "name": mechanism.name,
                "kind": mechanism.kind,
                "joint": mechanism.joint,
                "source": mechanism.source,
                "quantities": {
                    name: {"values": quantity.values.tolist(), "unit": quantity.unit}
                    for name, quantity in mechanism.quantities.items()
                },
            }
            for mechanism in robot.mechanisms
        ],
        "identified": [
            {
                "command": run.command,
                "version": run.version,
                "date": run.date,
                "data": [{"file": name, "sha256": digest} for name, digest in run.data],
                "robot_digest": run.robot_digest,
                "effects": list(run.effects),
                "poses": run.poses,
                "readings": run.readings,
                "gap": dict(run.gap),
                "correlation": {"parameters": list(run.names), "rows": run.correlation.tolist()},
            }
            for run in robot.identified
        ],
        "effects": {
            model.label(index): {
                **term.effect.described(),
                "parameters": {
                    parameter.name: {**asdict(term.stated[parameter.name]), "unit": parameter.unit}
                    for parameter in term.effect.parameters
                    if parameter.name in term.stated
                },
            }
            for index, term in enumerate(model.terms)
        },
    }


def _identified_words(run: Identification) -> str:
    """When, from what, what, and what came of it."""
    data = ", ".join(f"{name} (sha256 {digest[:12]})" for name, digest in run.data) or "no file"
    gap = "  ".join(f"{_GAP_WORDS[key]} {value:.3g}" for key, value in run.gap.items())
    return (
        f"identified  {run.date} by {run.command} {run.version}: {', '.join(run.effects) or 'nothing'}\n"
        f"  {run.readings} readings at {run.poses} poses, {data}\n"
        f"  gap [mm, 3-D rms]  {gap or 'not stated'}"
    )


def _lengths(robot: Robot) -> KukaLengths | None:
    if isinstance(robot.arm, KukaLengths):
        return robot.arm
    return robot.arm.lengths if isinstance(robot.arm, KukaVariant) else None


def _geometry_words(robot: Robot) -> str:
    """Link lengths, or where each joint lies and points with all values at zero."""
    lengths = _lengths(robot)
    if lengths is not None:
        words = "  ".join(f"{name} {value / MM:g}" for name, value in asdict(lengths).items())
        rail = getattr(robot.arm, "rail", None)
        on = "" if rail is None else f"  on a linear axis along {_vector(rail)}"
        return f"links [mm]  {words}{on}"
    lines = [f"geometry  {robot.arm.kind}; at zero [mm, axes of the base]"]
    at = Poses.identity()
    for joint in robot.joints:
        at = at @ joint.placement
        verb = "rotates about" if joint.kind == "revolute" else "moves along"
        lines.append(f"  {joint.name} at {_vector(at.position / MM)} {verb} {_vector(at.rotation[:, 2])}")
    tip = at @ robot.flange
    return "\n".join([*lines, f"  flange at {_vector(tip.position / MM)}, z {_vector(tip.rotation[:, 2])}"])


def _geometry_json(robot: Robot) -> dict[str, object]:
    lengths = _lengths(robot)
    axes = [
        {"name": axis.name, "kind": axis.kind, "sign": axis.sign, "offset": axis.offset}
        for axis in robot.axes
    ]
    geometry: dict[str, object] = {"kind": robot.arm.kind, "axes": axes}
    return geometry if lengths is None else {**geometry, "kuka_m": asdict(lengths)}


def _limits_words(robot: Robot) -> str:
    words = []
    for joint in robot.joints:
        unit, word = (DEG, "") if joint.kind == "revolute" else (MM, " mm")
        words.append(f"{joint.name} {joint.lower / unit:g}..{joint.upper / unit:g}{word}")
    return "limits [deg]  " + "  ".join(words)


def _option(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _vector(values: Floats) -> str:
    return "(" + ", ".join(f"{value + 0.0:.6g}" for value in np.round(values, 6)) + ")"


def _interval(value: Value) -> str:
    if value.interval is None:
        return "not known"
    level = "level unstated" if value.level is None else f"{value.level:.0%}"
    return f"+- {value.interval:.2g} ({level})"
