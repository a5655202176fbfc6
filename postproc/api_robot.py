"""What the commands on a robot and its measurements do, as functions: ``map``, ``identify``, ``diagnose``, ``plan``."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, TypeAlias

from postproc.report.diagnosed import Diagnosed
from postproc.report.identified import Identified
from postproc.report.mapped import Mapped
from postproc.report.planned import Planned

PathLike: TypeAlias = str | os.PathLike[str]
MapRange: TypeAlias = float | tuple[float, float]


def map(
    robot: str,
    *,
    x: MapRange,
    y: MapRange,
    z: MapRange,
    force: str,
    grid: int = 21,
    tool: Sequence[float] = (0.0, 0.0, 0.0),
    orientation: Sequence[float] = (0.0, 0.0, 180.0),
    linear: bool = False,
    sign: str | None = None,
    ignore_limits: bool = False,
    status: int | None = None,
    picture: PathLike | None = None,
    page: PathLike | None = None,
    csv: PathLike | None = None,
) -> Mapped:
    """The deflection over a plane or a box of the workspace, as ``compensate map`` does.

    x, y, z: one value or (from, to), mm in the robot base; grid: points along each range; force: ``"-360,0,560@base"``
    in N and N m; tool: TCP on the flange, mm and deg; orientation: A, B, C of the tool, deg.  Raises ValueError for
    ranges, forces and tools that are none.

    >>> import postproc
    >>> mapped = postproc.map("kuka_kr270", x=(800, 2200), y=0, z=500, grid=5, force="0,0,-500")
    >>> mapped.cells, sorted(mapped.table())[:3]
    (5, ['A1_deg', 'A2_deg', 'A3_deg'])
    """
    from postproc.process.stated_forces import FRAMES, parse_force
    from postproc.workflows.map import MapRequest, map_workspace

    wrench, frame = parse_force(force)
    if FRAMES[frame] == "feed" or not any(wrench):
        raise ValueError("a map has no feed direction, and a force of zero deflects nothing")
    ranges = tuple(
        (float(one),) if isinstance(one, (int, float)) else tuple(float(end) for end in one)
        for one in (x, y, z)
    )
    if any(len(one) not in (1, 2) or (len(one) == 2 and not one[0] < one[1]) for one in ranges):
        raise ValueError("x, y and z are one value each, or (from, to) with from < to, in mm")
    return map_workspace(
        MapRequest(
            robot=robot,
            ranges_mm=ranges,
            points=grid,
            tool_mm_deg=_numbers(tool, "tool", (3, 6))[:6],
            orientation_deg=_numbers(orientation, "orientation", (3,))[:3],
            wrench=wrench,
            frame=FRAMES[frame],
            linear=linear,
            sign=sign,
            ignore_limits=ignore_limits,
            status=status,
            picture=_path(picture),
            page=_path(page),
            csv=_path(csv),
        )
    )


def identify(
    data: PathLike | Sequence[PathLike],
    effects: str | Sequence[str],
    *,
    robot: str | None = None,
    output: PathLike | None = None,
    tool: Sequence[float] | None = None,
    priors: bool = False,
    robust: bool = False,
    drop_outliers: bool = False,
    validate: Sequence[PathLike] = (),
    folds: int = 5,
    bootstrap: int | None = None,
    page: PathLike | None = None,
    csv: PathLike | None = None,
    strict: bool = False,
) -> Identified:
    """Identify parameters of effects from measurements, as ``compensate identify`` does.

    data: CSV files; effects: names, or ``effect.parameter``; output: the new robot file; tool: mm and deg on the
    flange.
    """
    from postproc.workflows.identify import IdentifyRequest
    from postproc.workflows.identify import identify as run

    return run(
        IdentifyRequest(
            data=_paths(data),
            robot=robot,
            effects=tuple(effects.split(",")) if isinstance(effects, str) else tuple(effects),
            output=_path(output),
            priors=priors,
            robust=robust,
            drop_outliers=drop_outliers,
            validate=_paths(validate),
            folds=folds,
            bootstrap=bootstrap,
            tool_mm_deg=None if tool is None else _numbers(tool, "tool", (3, 6)),
            page=_path(page),
            csv=_path(csv),
            strict=strict,
        )
    )


def diagnose(
    data: PathLike | Sequence[PathLike],
    *,
    robot: str | None = None,
    output: PathLike | None = None,
    next_poses: PathLike | None = None,
    payload: float | None = None,
    pulls: bool = False,
    validate: PathLike | Sequence[PathLike] = (),
    tool: Sequence[float] | None = None,
    page: PathLike | None = None,
    csv: PathLike | None = None,
    strict: bool = False,
) -> Diagnosed:
    """Find and name what the robot file misses, as ``compensate diagnose`` does.

    data: CSV files; output: the new robot file; next_poses: where a plan of poses goes that distinguish explanations;
    payload [kg]: heaviest weight that it may hang; pulls: whether it may pull; validate: readings that are not
    diagnosed.
    """
    from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot

    return diagnose_robot(
        DiagnoseRequest(
            data=_paths(data),
            robot=robot,
            output=_path(output),
            next_poses=_path(next_poses),
            payload_kg=payload,
            pulls=pulls,
            validate=_paths(validate),
            tool_mm_deg=None if tool is None else _numbers(tool, "tool", (3, 6)),
            page=_path(page),
            csv=_path(csv),
            strict=strict,
        )
    )


def plan(
    robot: str,
    effects: str | Sequence[str],
    poses: int,
    output: PathLike,
    *,
    loads: Sequence[float] = (),
    one_load: bool = False,
    tool: Sequence[float] = (0.0, 0.0, 0.0),
    targets: Mapping[str, Sequence[float]] | None = None,
    kind: Literal["deflection", "absolute"] | None = None,
    sigma_mm: float = 0.03,
    discriminate: tuple[str, str] | None = None,
    measured: Sequence[PathLike] = (),
    seed: int = 1,
) -> Planned:
    """The poses and loads worth measuring, as ``compensate plan`` does; writes them to ``output`` (CSV).

    loads [kg] that can be hung at the TCP; tool: mm and deg on the flange; targets: name -> place on the flange, mm;
    sigma_mm: scatter of each measured coordinate.
    """
    from postproc.workflows.plan import plan as run
    from postproc.workflows.plan_setups import PlanRequest

    return run(
        PlanRequest(
            robot=robot,
            effects=tuple(effects.split(",")) if isinstance(effects, str) else tuple(effects),
            poses=poses,
            output=Path(output),
            loads=tuple(float(load) for load in loads),
            one_load=one_load,
            tool_mm_deg=_numbers(tool, "tool", (3, 6)),
            targets=tuple((name, _numbers(at, name, (3,))[:3]) for name, at in (targets or {}).items()),
            kind=kind,
            sigma_mm=sigma_mm,
            discriminate=discriminate,
            measured=_paths(measured),
            seed=seed,
        )
    )


def _numbers(values: Sequence[float], name: str, lengths: tuple[int, ...]) -> tuple[float, ...]:
    """Six numbers, the last ones zero where they are not given."""
    numbers = tuple(float(value) for value in values)
    if len(numbers) not in lengths:
        wanted = " or ".join(str(length) for length in lengths)
        raise ValueError(f"{name} has {len(numbers)} numbers, and needs {wanted}")
    return (*numbers, 0.0, 0.0, 0.0)[:6]


def _paths(paths: PathLike | Sequence[PathLike]) -> tuple[Path, ...]:
    if isinstance(paths, (str, os.PathLike)):
        return (Path(paths),)
    return tuple(Path(path) for path in paths)


def _path(path: PathLike | None) -> Path | None:
    return None if path is None else Path(path)
