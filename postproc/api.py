"""The package from Python: what the commands do, as functions.

Paths are relative to the working folder.  What is wrong with a file raises ``Refusal``; its ``findings`` say code,
place, what is, and what to do; nothing was written then.  Lengths of a ``Report`` are in metres; ``as_json()`` gives
what ``--json`` gives, in mm.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, TypeAlias

from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.report.batched import Batched
from postproc.report.checked import Checked
from postproc.report.diagnosed import Diagnosed
from postproc.report.identified import Identified
from postproc.report.mapped import Mapped
from postproc.report.planned import Planned
from postproc.report.report import Report
from postproc.report.verified import Verified
from postproc.workflows import listing, program
from postproc.workflows.option_names import SHARED_POINTS, accept_former_names
from postproc.workflows.preparation import Request

PathLike: TypeAlias = str | os.PathLike[str]
MapRange: TypeAlias = float | tuple[float, float]

__all__ = [
    "Batched",
    "Checked",
    "Diagnosed",
    "Finding",
    "Identified",
    "Mapped",
    "Planned",
    "Refusal",
    "Report",
    "Verified",
    "batch",
    "check",
    "compensate",
    "diagnose",
    "identify",
    "map",
    "plan",
    "predict",
    "verify",
]


@accept_former_names
def compensate(
    path: PathLike,
    *,
    force: bool | str = False,
    cell: PathLike | None = None,
    robot: str | None = None,
    gain: float = 1.0,
    output: PathLike | None = None,
    report: PathLike | None = None,
    config_dat: PathLike | None = None,
    tare: bool = False,
    no_insert: bool = False,
    shared_points: Literal["copy-inline", "copy-dat", "keep"] = "copy-inline",
    strict: bool = False,
    dry_run: bool = False,
    allow_compensated: bool = False,
) -> Report:
    """Compensate a program for the deflection of the robot, as ``compensate PROGRAM`` does.

    force: True for the forces that belong to the program, or ``"0,360,560@base"`` (N, N m), or a CSV; cell: instead of
    the nearest ``cell.yaml``; robot: name or file, instead of the cell's; gain: share of the correction, 0 .. 1;
    output: file or folder of the result [``compensated/<same name>``]; report: folder of the reports [beside it];
    config_dat: the controller's ``$config.dat``; tare: subtract the mean of a force CSV in air from its readings;
    no_insert: insert no motions; shared_points: what happens to a named point that several motions use; strict: treat
    warnings as errors; dry_run: write nothing; allow_compensated: accept a program that is compensated already.

    >>> import postproc
    >>> report = postproc.compensate("samples/kr270_taught/taught.src", force=True, output="out/taught.src")
    >>> report.exit, report.uncorrected  # 3: its corners are approximated by more than the tolerance
    (3, 0)
    >>> report.after.max < 0.02e-3 < report.before.max
    True
    >>> any(path.endswith("taught.src") for path in report.outputs)
    True

    What cannot be done states why:

    >>> try:
    ...     postproc.compensate("samples/kr270_taught/taught.src", force="0,360")
    ... except postproc.Refusal as refusal:
    ...     print(refusal.findings[0].code, refusal.findings[0].message)
    FRC002 --force 0,360: 2 numbers are given where 3 or 6 are needed
    """
    return program.compensate(
        Request(
            program=Path(path),
            force=_force(force),
            cell=_path(cell),
            robot=robot,
            gain=_share(gain),
            output=_path(output),
            report=_path(report),
            config_dat=_path(config_dat),
            tare=tare,
            no_insert=no_insert,
            shared_points=_shared_points(shared_points),
            strict=strict,
            dry_run=dry_run,
            allow_compensated=allow_compensated,
            keep_table=True,
        )
    )


@accept_former_names
def predict(
    path: PathLike,
    *,
    force: bool | str = False,
    cell: PathLike | None = None,
    robot: str | None = None,
    report: PathLike | None = None,
    config_dat: PathLike | None = None,
    tare: bool = False,
    strict: bool = False,
) -> Report:
    """The deflection at every pose of a program, as ``compensate predict`` does; files only in the folder ``report``.

    >>> import postproc
    >>> report = postproc.predict("samples/kr270_taught/taught.src", force="0,360,560@base")
    >>> report.corrected, report.before.max > 0.1e-3
    (0, True)
    """
    return program.predict(
        Request(
            program=Path(path),
            force=_force(force),
            cell=_path(cell),
            robot=robot,
            report=_path(report),
            config_dat=_path(config_dat),
            tare=tare,
            strict=strict,
            keep_table=True,
        )
    )


def check(path: PathLike, *, cell: PathLike | None = None, config_dat: PathLike | None = None) -> Checked:
    """Read a program only: its motions (``toolpath``) and what is not understood (``findings``).

    >>> import postproc
    >>> checked = postproc.check("samples/kr270_taught/taught.src")
    >>> len(checked.toolpath), checked.exit
    (26, 0)
    """
    return listing.check(Path(path), _path(cell), _path(config_dat))


def verify(
    original: PathLike,
    compensated: PathLike,
    *,
    force: bool | str = False,
    cell: PathLike | None = None,
    robot: str | None = None,
    step_mm: float = 4.0,
    config_dat: PathLike | None = None,
    tare: bool = False,
    strict: bool = False,
) -> Verified:
    """Simulate both programs along their paths, as ``compensate verify`` does; step_mm: of the first samples.

    >>> import postproc
    >>> sample = "samples/kr270_taught/taught.src"
    >>> postproc.verify(sample, sample, force=True).original.error.max > 0.1e-3
    True
    """
    from postproc.workflows.verify import verify as run

    request = Request(
        program=Path(original),
        force=_force(force),
        tare=tare,
        cell=_path(cell),
        robot=robot,
        strict=strict,
        config_dat=_path(config_dat),
    )
    return run(request, Path(compensated), step_mm * MM)


def batch(
    jobs: PathLike | Sequence[PathLike],
    *,
    force: bool | str | None = None,
    cell: PathLike | None = None,
    robot: str | None = None,
    gain: float | None = None,
    output: PathLike | None = None,
    workers: int | None = None,
    dask: str | None = None,
    strict: bool = False,
    dry_run: bool = False,
    rerun: bool = False,
    fail_fast: bool = False,
    allow_compensated: bool = False,
    allow_outside: bool = False,
) -> Batched:
    """Compensate many programs, as ``compensate batch`` does.

    jobs: a job file, or folders, files and patterns; force, cell, robot, gain: as of ``compensate``, None leaves them
    to the job file; output: folder of the results; workers: processes [all cores]; dask: address of a scheduler;
    rerun: also what is done and unchanged.
    """
    from postproc.batch.batch import BatchRequest, run_batch

    words = (jobs,) if isinstance(jobs, (str, os.PathLike)) else tuple(jobs)
    options = {
        "force": None if force is None else _force(force),
        "robot": robot,
        "cell": None if cell is None else Path(os.path.abspath(cell)),
        "gain": None if gain is None else _share(gain),
        "strict": strict or None,
        "dry_run": dry_run or None,
        "allow_compensated": allow_compensated or None,
    }
    return run_batch(
        BatchRequest(
            words=tuple(os.fspath(word) for word in words),
            options={key: value for key, value in options.items() if value is not None},
            output=_path(output),
            workers=workers,
            dask=dask,
            fail_fast=fail_fast,
            rerun=rerun,
            allow_outside=allow_outside,
        )
    )


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
    in N and N m; tool: TCP on the flange, mm and deg; orientation: A, B, C of the tool, deg.

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
    tool: Sequence[float] | None = None,
    page: PathLike | None = None,
    csv: PathLike | None = None,
    strict: bool = False,
) -> Diagnosed:
    """Find and name what the robot file misses, as ``compensate diagnose`` does.

    data: CSV files; output: the new robot file; next_poses: where a plan of poses goes that distinguish explanations.
    """
    from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot

    return diagnose_robot(
        DiagnoseRequest(
            data=_paths(data),
            robot=robot,
            output=_path(output),
            next_poses=_path(next_poses),
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
    from postproc.workflows.plan import PlanRequest
    from postproc.workflows.plan import plan as run

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


def _force(force: bool | str) -> str | None:
    """As ``Request`` has it."""
    if isinstance(force, str):
        if not force.strip():
            raise ValueError("force is empty; use True for the forces that belong to the program")
        return force
    return "" if force else None


def _path(path: PathLike | None) -> Path | None:
    return None if path is None else Path(path)


def _share(gain: float) -> float:
    if not 0.0 <= gain <= 1.0:
        raise ValueError(f"gain must be a share of the correction, 0 .. 1, and is {gain!r}")
    return gain


def _shared_points(choice: str) -> str:
    if choice not in SHARED_POINTS:
        raise ValueError(f"shared_points is one of {', '.join(SHARED_POINTS)}, not {choice!r}")
    return choice
