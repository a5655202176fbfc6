"""The package from Python: what the commands do, as functions.

Paths are relative to the working folder.  What is wrong with a file raises ``Refusal``; its ``findings`` say code,
place, what is, and what to do; nothing was written then.  Lengths of a ``Report`` are in metres; ``as_json()`` gives
what ``--json`` gives, in mm.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal, TypeAlias

from postproc.findings import Finding, Refusal
from postproc.report.checked import Checked
from postproc.report.report import Report
from postproc.workflows import listing, program
from postproc.workflows.preparation import Request

PathLike: TypeAlias = str | os.PathLike[str]

__all__ = ["Checked", "Finding", "Refusal", "Report", "check", "compensate", "predict"]


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
    force_offset: bool = False,
    keep_points: bool = False,
    own_points: Literal["inline", "dat", "refuse"] = "inline",
    strict: bool = False,
    dry_run: bool = False,
    again: bool = False,
) -> Report:
    """Compensate a program for the deflection of the robot, as ``compensate PROGRAM`` does.

    force: True for the forces that belong to the program, or ``"0,360,560@base"`` (N, N m), or a CSV; cell: instead of
    the nearest ``cell.yaml``; robot: name or file, instead of the cell's; gain: share of the correction, 0 .. 1;
    output: file or folder of the result [``compensated/<same name>``]; report: folder of the reports [beside it];
    config_dat: the controller's ``$config.dat``; force_offset: take the mean of a force CSV in air off its readings;
    keep_points: insert no motion; own_points: what a named point that serves several motions becomes; strict: warnings
    are errors; dry_run: write nothing; again: although it is compensated already.

    >>> import postproc
    >>> report = postproc.compensate("samples/kr270_taught/taught.src", force=True, output="out/taught.src")
    >>> report.exit, report.left
    (0, 0)
    >>> report.after.max < 0.02e-3 < report.before.max
    True
    >>> any(path.endswith("taught.src") for path in report.outputs)
    True

    What can not be done says why:

    >>> try:
    ...     postproc.compensate("samples/kr270_taught/taught.src", force="0,360")
    ... except postproc.Refusal as refusal:
    ...     print(refusal.findings[0].code, refusal.findings[0].message)
    FRC002 --force 0,360: 2 numbers where 3 or 6 are needed
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
            force_offset=force_offset,
            keep_points=keep_points,
            own_points=own_points,
            strict=strict,
            dry_run=dry_run,
            again=again,
        )
    )


def predict(
    path: PathLike,
    *,
    force: bool | str = False,
    cell: PathLike | None = None,
    robot: str | None = None,
    report: PathLike | None = None,
    config_dat: PathLike | None = None,
    force_offset: bool = False,
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
            force_offset=force_offset,
            strict=strict,
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


def _force(force: bool | str) -> str | None:
    """As ``Request`` has it."""
    if isinstance(force, str):
        if not force.strip():
            raise ValueError("force is empty; True takes the forces that belong to the program")
        return force
    return "" if force else None


def _path(path: PathLike | None) -> Path | None:
    return None if path is None else Path(path)


def _share(gain: float) -> float:
    if not 0.0 <= gain <= 1.0:
        raise ValueError(f"gain is a share of the correction, 0 .. 1, not {gain!r}")
    return gain
