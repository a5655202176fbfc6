"""A robot file in words: geometry, limits, effects with intervals and sources."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from rich.console import Console
from rich.table import Table
from rich.text import Text

from postproc.model import StiffnessModel
from postproc.robot.description import Value
from postproc.units import DEG, MM


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
    """All that the file of one robot says."""
    (model,) = models
    robot = model.robot
    console.print(Text(f"{robot.name}: {robot.maker_name}", style="bold"))
    console.print(Text(robot.about), Text(""))
    lengths = "  ".join(f"{name} {value / MM:g}" for name, value in asdict(robot.arm).items())
    console.print(Text(f"links [mm]  {lengths}\n  {robot.geometry_source}"))
    limits = "  ".join(f"{j.name} {j.lower / DEG:g}..{j.upper / DEG:g}" for j in robot.joints)
    console.print(Text(f"limits [deg]  {limits}\n  {robot.limits_source}\n"))
    for term in model.terms:
        options = ", ".join(f"{key} {value}" for key, value in term.effect.described().items())
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


def robot_json(model: StiffnessModel) -> dict[str, object]:
    """The same for scripts, SI units."""
    robot = model.robot
    return {
        "name": robot.name,
        "maker_name": robot.maker_name,
        "file": str(robot.path),
        "digest": robot.digest,
        "geometry": {"kuka_m": asdict(robot.arm), "source": robot.geometry_source},
        "limits_deg": {j.name: [j.lower / DEG, j.upper / DEG] for j in robot.joints},
        "effects": {
            term.effect.name: {
                **term.effect.described(),
                "parameters": {
                    parameter.name: {**asdict(term.stated[parameter.name]), "unit": parameter.unit}
                    for parameter in term.effect.parameters
                    if parameter.name in term.stated
                },
            }
            for term in model.terms
        },
    }


def _interval(value: Value) -> str:
    if value.interval is None:
        return "not known"
    level = "level unstated" if value.level is None else f"{value.level:.0%}"
    return f"+- {value.interval:.2g} ({level})"
