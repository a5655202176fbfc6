"""Which collision shapes a placement is checked by, and the check of whole programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import yaml

from postproc.base.arrays import Floats, Ints
from postproc.base.findings import Finding, Refusal
from postproc.base.units import DEG
from postproc.placement.collisions import (
    CollisionShapes,
    between_postures,
    first_collision,
    read_collision_shapes,
)
from postproc.report.placement import CheckedShapes
from postproc.robot.description import Robot
from postproc.robot.geometries import SerialArm
from postproc.toolpath import Kind
from postproc.workflows.place_motions import motion_margins
from postproc.workflows.preparation import Prepared

STEP = 2 * DEG
"""Between two postures of a point-to-point motion that are looked at."""


def collision_shapes(stated: Path | None, ready: Prepared) -> CollisionShapes | Finding | None:
    """Those of the URDF that is ``stated``, else of the robot file's own; a Finding states why there are none, None
    where no URDF is known.  Raises Refusal PLC018 for one that is stated and cannot be used."""
    path = stated or _own_urdf(ready.robot)
    if path is None:
        return None
    found = read_collision_shapes(path, ready.robot, ready.cell.start)
    if stated is not None and isinstance(found, Finding):
        raise Refusal(Finding("PLC020", found.message, found.file))
    return found


def _own_urdf(robot: Robot) -> Path | None:
    """The URDF that the robot file names."""
    if not isinstance(robot.nominal, SerialArm) or robot.nominal.kind != "urdf":
        return None
    stated = yaml.safe_load(robot.raw)
    section = stated.get("controller", stated["geometry"])
    return robot.path.parent / str(section["urdf"]["file"])


def collision_of(shapes: CollisionShapes, ready: Prepared) -> Finding | None:
    """PLC002 for the first motion in which two links overlap: at its end, on its path, or between the postures of a
    point-to-point motion."""
    q, rows = _postures(ready)
    found = first_collision(shapes, q)
    if found is None:
        return None
    at, (one, other) = found
    line = int(ready.task.toolpath.line[rows[at]])
    return Finding("PLC002", f"in this motion {one} collides with {other}", ready.task.file, line)


def _postures(ready: Prepared) -> tuple[Floats, Ints]:
    """(M, n) joint values that a program goes through, and the rows (M,) of the motions, in their order."""
    task, path = ready.task, ready.task.toolpath
    margins = motion_margins(task)
    reached = np.isfinite(margins.limit)
    ends = np.asarray(task.track.q)
    known = np.isfinite(ends).all(axis=1)
    jumps = np.flatnonzero(np.isin(path.kind, (Kind.PTP, Kind.AXIS)) & known)
    before = np.full_like(ends, np.nan)
    before[1:] = ends[:-1]
    if ready.cell.start is not None and len(ends):
        before[0] = ready.cell.start
    before[~path.continues] = np.nan
    starts = jumps[np.isfinite(before[jumps]).all(axis=1)]
    inner, motion = between_postures(before[starts], ends[starts], STEP)
    rows = np.concatenate([margins.rows[reached], jumps, starts[motion]])
    q = np.concatenate([margins.q[reached], ends[jumps], inner])
    order = np.argsort(rows, kind="stable")
    return q[order], rows[order]


def shape_findings(shapes: CollisionShapes | Finding | None, prepared: Sequence[Prepared]) -> list[Finding]:
    """What a result says of its collision check: that there was none, that pairs were left out, that the programs
    collide at the present place."""
    file = prepared[0].task.file
    if not isinstance(shapes, CollisionShapes):
        return [*([] if shapes is None else [shapes]), Finding("PLC001", "collisions are not checked", file)]
    found = []
    if shapes.ignored:
        pairs = ", ".join(f"{one} and {other}" for one, other in shapes.ignored)
        message = f"these bodies touch before the program starts, and are not checked: {pairs}"
        found.append(Finding("PLC018", message, shapes.file))
    for ready in prepared:
        if (hit := collision_of(shapes, ready)) is not None:
            what = hit.message.removeprefix("in this motion ")
            message = f"at the present place this motion does not pass: {what}"
            found.append(Finding("PLC019", message, hit.file, hit.line))
    return found


def checked_shapes(shapes: CollisionShapes | Finding | None) -> CheckedShapes | None:
    """What collisions were checked by, for the result."""
    if not isinstance(shapes, CollisionShapes):
        return None
    return CheckedShapes(shapes.file, shapes.moving, shapes.fixed, shapes.ignored)
