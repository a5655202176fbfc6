"""The map of a workspace, on paths."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses, rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.model import StiffnessModel
from postproc.output.atomic_write import write_atomically
from postproc.placement.workspace_map import (
    MapLoad,
    WorkspaceGrid,
    WorkspaceMap,
    evaluate_workspace,
    has_compensator,
    with_sign,
)
from postproc.report.mapped import Mapped, map_csv, slices_shown
from postproc.report.report import exit_code, json_bytes
from postproc.robot.branches import BranchBit
from postproc.robot.description import check_programmable, find_robot, load_robot
from postproc.robot.geometries import SerialArm
from postproc.workflows.preparation import Stage, silent

SMALLEST_RANGE, SMALLEST_TOOL = 20.0, 2.0
"""[mm] A map or a tool whose largest coordinate is below it was stated in metres."""


@dataclass(frozen=True)
class MapRequest:
    """A map that the user asked for: per axis of the robot base one value or (from, to), each range in ``points``."""

    robot: str
    ranges_mm: tuple[tuple[float, ...], ...]
    points: int
    tool_mm_deg: tuple[float, ...]
    orientation_deg: tuple[float, ...]
    wrench: tuple[float, ...]
    frame: str
    linear: bool = False
    sign: str | None = None
    ignore_limits: bool = False
    status: int | None = None
    picture: Path | None = None
    page: Path | None = None
    csv: Path | None = None
    json: Path | None = None


def map_workspace(request: MapRequest, stage: Stage = silent) -> Mapped:
    """The deflection over a part of the workspace.  Raises Refusal, and has then written nothing."""
    robot = load_robot(find_robot(request.robot))
    check_programmable(robot)
    model = StiffnessModel.from_robot(robot)
    if request.sign is not None:
        if not has_compensator(model):
            raise Refusal(
                Finding(
                    "MAP001",
                    f"--sign {request.sign} is given, but the model has no gravity_compensator",
                    str(robot.path),
                )
            )
        model = with_sign(model, request.sign)
    free = isinstance(robot.nominal, SerialArm)
    if free and request.status is not None:
        raise Refusal(
            Finding(
                "MAP006", f"--status {request.status} is given, but this arm has no Status", str(robot.path)
            )
        )
    load = _load(request)
    stage("computing")
    survey = evaluate_workspace(model, _grid(request), load)
    signs = {
        str(term.effect.described()["sign"]) for term in model.terms if "sign" in term.effect.described()
    }
    mapped = Mapped(
        survey=survey,
        load=load,
        robot=robot.name,
        digest=robot.digest,
        axes=tuple((joint.name, "mm" if joint.kind == "prismatic" else "deg") for joint in robot.joints),
        effects=tuple(term.effect.name for term in model.terms),
        stated=request.wrench,
        frame=request.frame,
        sign=", ".join(sorted(signs)) or None,
        status=None if free else int(load.branch),
    )
    findings = [
        *_lengths_in_metres(request),
        *_map_findings(survey, mapped.status, request.picture is not None),
        *model.plausibility_findings(),
    ]
    files: dict[Path, bytes] = {}
    if survey.mapped.any():
        stage("drawing")
        if request.csv is not None:
            files[request.csv] = map_csv(mapped)
        if request.picture is not None:
            from postproc.report.picture import picture

            files[request.picture] = picture(mapped, request.picture.suffix[1:].lower())
    reports = {"result (JSON)": request.json, "page": request.page}
    names = [*files, *(path for path in reports.values() if path is not None)]
    mapped = replace(
        mapped,
        findings=tuple(findings),
        outputs=tuple(str(path) for path in names),
        exit=exit_code(findings),
    )
    if request.json is not None:
        files[request.json] = json_bytes(mapped)
    if request.page is not None:
        from postproc.report.page import beside
        from postproc.report.page_results import mapped_page

        also = {"every cell (CSV)": request.csv, "picture": request.picture, "result (JSON)": request.json}
        files[request.page] = mapped_page(mapped, beside(request.page, also))
    write_atomically(files)
    return mapped


def _grid(request: MapRequest) -> WorkspaceGrid:
    axes = []
    for ends in request.ranges_mm:
        low, high = ends[0], ends[-1]
        several = low < high and request.points > 1
        axes.append(np.linspace(low, high, request.points) if several else np.array([(low + high) / 2]))
    return WorkspaceGrid(*(values * MM for values in axes))


def _load(request: MapRequest) -> MapLoad:
    place, turn = np.array(request.tool_mm_deg[:3]) * MM, np.array(request.tool_mm_deg[3:]) * DEG
    orientation = rotation_from_abc(np.array(request.orientation_deg) * DEG)
    wrench = np.array(request.wrench).reshape(2, 3)
    if request.frame == "tool":
        wrench = wrench @ orientation.T
    return MapLoad(
        tool=Poses.from_abc(place, turn),
        orientation=orientation,
        wrench=wrench.ravel(),
        branch=BranchBit.ELBOW if request.status is None else request.status,
        linear=request.linear,
        ignore_limits=request.ignore_limits,
    )


def _lengths_in_metres(request: MapRequest) -> list[Finding]:
    """MAP008 for ranges and a tool that nobody maps in mm."""
    findings = []
    ranges = [abs(value) for ends in request.ranges_mm for value in ends]
    tool = [abs(value) for value in request.tool_mm_deg[:3]]
    for what, values, least in (
        ("--x, --y and --z", ranges, SMALLEST_RANGE),
        ("--tool", tool, SMALLEST_TOOL),
    ):
        if 0.0 < max(values) < least:
            largest = max(values)
            message = f"{what}: the largest coordinate is {largest:g} mm, as if it were in metres"
            findings.append(Finding("MAP008", message, help=f"{largest:g} m is {1e3 * largest:g} mm"))
    return findings


def _map_findings(survey: WorkspaceMap, status: int | None, drawn: bool) -> list[Finding]:
    """The findings on a map as a whole."""
    findings = []
    cells, unsettled = len(survey.q), int(survey.unsettled.sum())
    if status is None:
        findings.append(
            Finding(
                "MAP007",
                "the configuration is not fixed: the arm has no Status, and neighbouring cells may"
                " differ in configuration",
            )
        )
    if not survey.mapped.any():
        beyond = int(survey.in_reach.sum())
        help = f"{beyond} cells exceed only the axis limits: use --ignore-limits" if beyond else ""
        branch = "" if status is None else f" with S {status}"
        findings.append(Finding("MAP002", f"none of {cells} cells can be reached{branch}", help=help))
    elif unsettled:
        findings.append(Finding("MAP003", f"{unsettled} of {cells} cells have no equilibrium"))
    elif not np.nanmax(survey.size) > 0:
        findings.append(Finding("MAP005", "the deflection is zero everywhere"))
    slices = survey.grid.shape[2]
    shown = len(slices_shown(slices))
    if drawn and survey.mapped.any() and min(survey.grid.shape) > 1 and shown < slices:
        findings.append(Finding("MAP004", f"the picture shows {shown} of {slices} slices along z"))
    return findings
