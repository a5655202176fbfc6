"""The package from Python: what the commands do, as functions.

Paths are relative to the working folder.  What is wrong with a file raises ``Refusal``; its ``findings`` say code,
place, what is, and what to do; nothing was written then.  Lengths of a ``Report`` are in metres; ``as_json()`` gives
what ``--json`` gives, in mm.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from postproc.api_place import Force, PathLike, as_path, assign, place, stated_force
from postproc.api_robot import diagnose, identify, map, plan
from postproc.base.findings import Finding, Refusal
from postproc.base.units import MM
from postproc.learning.deviation_signs import SIGNS
from postproc.report.assignment import PartAssignment
from postproc.report.batched import Batched
from postproc.report.checked import Checked
from postproc.report.diagnosed import Diagnosed
from postproc.report.engaged import Engaged
from postproc.report.identified import Identified
from postproc.report.learned import Learned
from postproc.report.mapped import Mapped
from postproc.report.placement import Placement
from postproc.report.planned import Planned
from postproc.report.report import Report
from postproc.report.verified import Verified
from postproc.workflows import listing, program
from postproc.workflows.option_names import SHARED_POINTS, accept_former_names
from postproc.workflows.preparation import Request

__all__ = [
    "Batched",
    "Checked",
    "Diagnosed",
    "Engaged",
    "Finding",
    "Identified",
    "Learned",
    "Mapped",
    "PartAssignment",
    "Placement",
    "Planned",
    "Refusal",
    "Report",
    "Verified",
    "assign",
    "batch",
    "check",
    "compensate",
    "diagnose",
    "engage",
    "identify",
    "learn",
    "map",
    "place",
    "plan",
    "predict",
    "verify",
]


@accept_former_names
def compensate(
    path: PathLike,
    *,
    force: Force = False,
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

    force: True for the forces that belong to the program, or ``"0,360,560@base"`` (N, N m), or three or six numbers
    as ``(0, 360, 560)`` in axes of the base, or a CSV; cell: instead of the nearest ``cell.yaml``; robot: name or
    file, instead of the cell's; gain: share of the correction, 0 .. 1; output: file or folder of the result
    [``compensated/<same name>``]; report: folder of the reports [beside it]; config_dat: the controller's
    ``$config.dat``; tare: subtract the mean of a force CSV in air from its readings; no_insert: insert no motions;
    shared_points: what happens to a named point that several motions use; strict: treat warnings as errors; dry_run:
    write nothing; allow_compensated: accept a program that is compensated already.

    >>> import postproc
    >>> report = postproc.compensate("samples/kr270_taught/taught.src", force=True, output="out/taught.src")
    >>> report.exit, report.uncorrected
    (0, 0)
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
            force=stated_force(force),
            cell=as_path(cell),
            robot=robot,
            gain=_share(gain),
            output=as_path(output),
            report=as_path(report),
            config_dat=as_path(config_dat),
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
    force: Force = False,
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
            force=stated_force(force),
            cell=as_path(cell),
            robot=robot,
            report=as_path(report),
            config_dat=as_path(config_dat),
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
    return listing.check(Path(path), as_path(cell), as_path(config_dat))


def verify(
    original: PathLike,
    compensated: PathLike,
    *,
    force: Force = False,
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
        force=stated_force(force),
        tare=tare,
        cell=as_path(cell),
        robot=robot,
        strict=strict,
        config_dat=as_path(config_dat),
    )
    return run(request, Path(compensated), step_mm * MM)


def engage(
    path: PathLike,
    *,
    process: PathLike | None = None,
    cell: PathLike | None = None,
    robot: str | None = None,
    csv: PathLike | None = None,
    stock_out: PathLike | None = None,
    config_dat: PathLike | None = None,
    strict: bool = False,
) -> Engaged:
    """What a program cuts of its stock, as ``compensate engage`` does.

    process: a process file with ``stock:`` and ``tools:`` [the cell's]; stock_out: what is left of the blank.
    """
    from postproc.workflows.engage import EngageRequest
    from postproc.workflows.engage import engage as run

    return run(
        EngageRequest(
            program=Path(path),
            process=as_path(process),
            cell=as_path(cell),
            robot=robot,
            config_dat=as_path(config_dat),
            csv=as_path(csv),
            stock_out=as_path(stock_out),
            strict=strict,
        )
    )


def learn(
    path: PathLike,
    measured: PathLike | Sequence[PathLike],
    *,
    force: Force = True,
    cell: PathLike | None = None,
    robot: str | None = None,
    gain: float = 1.0,
    history: PathLike | None = None,
    new_history: bool = False,
    positive: Literal["", "material_left", "material_missing"] = "",
    known_force: float | None = None,
    push: PathLike | None = None,
    output: PathLike | None = None,
    csv: PathLike | None = None,
    page: PathLike | None = None,
    config_dat: PathLike | None = None,
    strict: bool = False,
    dry_run: bool = False,
) -> Learned:
    """Learn from measured parts of a program, as ``compensate learn`` does.

    path: the original program; measured: CSVs of deviations; known_force: half width of the 95 % interval of all forces
    as a share; push: readings of a push test; gain: share of what was learnt that is applied; history: record of the
    parts of earlier runs, beside the cell without; new_history: whatever that holds; positive: what a positive DEV is,
    stated again where the points do not show it; output: folder of the next program, robot file and force factors; csv:
    one row a point; page: the result as HTML.
    """
    from postproc.workflows.learn import LearnRequest
    from postproc.workflows.learn import learn as run

    several = [measured] if isinstance(measured, (str, os.PathLike)) else list(measured)
    main = Request(
        program=Path(path),
        force=stated_force(force),
        cell=as_path(cell),
        robot=robot,
        config_dat=as_path(config_dat),
        strict=strict,
    )
    return run(
        LearnRequest(
            main,
            tuple(Path(one) for one in several),
            gain=_share(gain),
            history=as_path(history),
            new_history=new_history,
            positive=_sign(positive),
            known_force=known_force,
            push=as_path(push),
            output=as_path(output),
            csv=as_path(csv),
            page=as_path(page),
            strict=strict,
            dry_run=dry_run,
        )
    )


def batch(
    jobs: PathLike | Sequence[PathLike],
    *,
    force: Force | None = None,
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
    from postproc.batching.batch import BatchRequest, run_batch

    words = (jobs,) if isinstance(jobs, (str, os.PathLike)) else tuple(jobs)
    options = {
        "force": None if force is None else stated_force(force),
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
            output=as_path(output),
            workers=workers,
            dask=dask,
            fail_fast=fail_fast,
            rerun=rerun,
            allow_outside=allow_outside,
        )
    )


def _share(gain: float) -> float:
    if not isinstance(gain, (int, float)) or not 0.0 <= gain <= 1.0:
        raise ValueError(f"gain must be a share of the correction, 0 .. 1, and is {gain!r}")
    return gain


def _sign(positive: str) -> str:
    if positive not in ("", *SIGNS):
        raise ValueError(f"positive is one of {', '.join(SIGNS)}, not {positive!r}")
    return positive


def _shared_points(choice: str) -> str:
    if choice not in SHARED_POINTS:
        raise ValueError(f"shared_points is one of {', '.join(SHARED_POINTS)}, not {choice!r}")
    return choice
