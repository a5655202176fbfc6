"""Weights of tools that are stated, and do not act."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Bools
from postproc.base.findings import Finding
from postproc.base.units import MM
from postproc.cell import Cell
from postproc.cell.description import Tool
from postproc.model import StiffnessModel
from postproc.toolpath import FrameRef, Kind, StatedLoad, Toolpath

PLACEHOLDER = 0.01
"""[kg] What is stated for a tool that has no load yet is not more."""
ROUNDED, SHARE = 0.1, 0.02
"""[kg], share: two statements of one mass differ by no more, as each is weighed or typed."""


def weight_findings(full: StiffnessModel, cell: Cell, path: Toolpath, file: str) -> list[Finding]:
    """COR033 for each tool of the path motions whose weight is stated and not counted, or stated otherwise than in the
    cell, and for each load that the program states while it runs, unless the controller corrects weights; ``full``:
    with all effects of the robot file."""
    if cell.controller.gravity_compensated:
        return []
    moves = np.isin(path.kind, (Kind.LIN, Kind.CIRC, Kind.SPL)) & (path.tool >= 0)
    findings: dict[str, Finding] = {}
    for load in path.stated_loads:
        while_running = _at_run_time(load, cell, path, moves, file)
        if while_running is not None:
            findings.setdefault(while_running.message.partition(": ")[2], while_running)
    for index in np.unique(path.tool[moves]).tolist():
        frame = path.frames[index]
        tool = cell.tools.get(frame.entry or 0)
        found = (
            _not_known(frame, tool, cell, file)
            if tool is None or tool.mass is None
            else _without_effect(f"tool {frame.entry}", tool.mass, full)
            or _other_mass(frame, tool.mass, cell, file)
        )
        if found is not None:
            findings.setdefault(found.message, found)
    return list(findings.values())


def _not_known(frame: FrameRef, tool: Tool | None, cell: Cell, file: str) -> Finding | None:
    """Of a tool for which the cell states no mass."""
    mass, *centre = frame.load or (0.0, 0.0, 0.0, 0.0)
    name = "the tool" if frame.entry is None else f"tool {frame.entry}"
    if mass > PLACEHOLDER:
        message = f"{mass:g} kg of {name} in the program or its data are not used: the cell states no mass"
        com = ", ".join(f"{value / MM:g}" for value in centre)
        help = f"add the tool to {cell.path}, with the pose of the program and mass: {mass:g}, com: [{com}]"
        return Finding("COR033", message, file, frame.line, help=help)
    weighed = [number for number, one in cell.tools.items() if one.mass]
    if tool is not None or frame.number == 0 or not weighed:
        return None
    tools = ", ".join(map(str, sorted(weighed)))
    message = (
        f"{name} that is set here has the pose of no tool of the cell, or of several: it counts as weightless"
    )
    help = f"state its pose and mass in {cell.path}, whose tools {tools} have a mass"
    return Finding("COR033", message, file, frame.line, help=help)


def _other_mass(frame: FrameRef, mass: float, cell: Cell, file: str) -> Finding | None:
    """Of a tool whose ``mass`` [kg] in the cell is another one than that in the program or its data."""
    stated = 0.0 if frame.load is None else frame.load[0]
    if stated <= PLACEHOLDER or _is_same(stated, mass):
        return None
    name = f"tool {frame.entry}"
    message = (
        f"the program or its data state {stated:g} kg for {name}: the cell states {mass:g} kg, which is used"
    )
    help = f"correct the mass in {cell.path}, or the load data of the controller"
    return Finding("COR033", message, file, frame.line, help=help)


def _at_run_time(load: StatedLoad, cell: Cell, path: Toolpath, moves: Bools, file: str) -> Finding | None:
    """Of a load that the program states while it runs; ``moves`` (N,): path motions.  The tools that it is compared
    with are those of the motions up to the next such statement in the text, or all where there are none."""
    later = [one.line for one in path.stated_loads if one.line > load.line]
    after = moves & (path.line >= load.line) & (path.line <= min(later, default=np.inf))
    used = np.unique(path.tool[after if after.any() else moves]).tolist()
    entries = {path.frames[index].entry for index in used}
    if not used or (load.from_entry and entries == {load.entry} and load.entry not in _changed(path)):
        return None
    counted = sorted({_mass_of(cell, entry) for entry in entries})
    if load.mass is not None and (
        load.mass <= PLACEHOLDER if load.gripped else len(counted) == 1 and _is_same(load.mass, counted[0])
    ):
        return None
    shown = f"{counted[0]:g}" + (f" to {counted[-1]:g}" if len(counted) > 1 else "")
    stated = "a load whose mass is not known" if load.mass is None else f"a load of {load.mass:g} kg"
    besides = " besides the tool" if load.gripped else ""
    message = (
        f"line {load.line}: {load.text!r} states {stated}{besides}; the cell states {shown} kg, which is used"
    )
    help = (
        f"state in {cell.path} the mass of all that the robot carries on these motions; motions with another load"
        " need a program and a cell of their own"
    )
    return Finding("COR033", message, file, load.line, help=help)


def _changed(path: Toolpath) -> set[int | None]:
    """Numbers of the tools whose own load the program changes."""
    return {one.entry for one in path.stated_loads if not one.from_entry}


def _mass_of(cell: Cell, entry: int | None) -> float:
    tool = cell.tools.get(entry or 0)
    return 0.0 if tool is None or tool.mass is None else tool.mass


def _is_same(one: float, other: float) -> bool:
    return abs(one - other) <= max(ROUNDED, SHARE * other)


def _without_effect(name: str, mass: float, full: StiffnessModel) -> Finding | None:
    """Of a tool with ``mass`` [kg]."""
    path = str(full.robot.path)
    if mass > 0 and not any(term.effect.name == "payload" for term in full.terms):
        message = f"the mass of {name}, {mass:g} kg, has no effect: the robot file has no payload"
        help = (
            "add the effect: {effect: payload, parameters: {mass: {value: 0, unit: kg, ci95: 1, source: cell}}}; the"
            " mass of the cell is added to it"
        )
        return Finding("COR033", message, path, help=help)
    if mass > 0 and not full.is_compliant:
        message = f"the mass of {name}, {mass:g} kg, has no effect: the robot file has no compliance"
        return Finding("COR033", message, path, help="add a joint_compliance to its effects")
    return None
