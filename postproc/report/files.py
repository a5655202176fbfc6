"""The report as files: corrections.csv."""

from __future__ import annotations

import numpy as np

from postproc.arrays import Floats
from postproc.compensation.correct import Result, State
from postproc.compensation.division import Division
from postproc.compensation.task import Task
from postproc.geometry import abc_from_rotation, vector_from_rotation
from postproc.report.columns import Numbers, Words, csv_bytes
from postproc.toolpath import Kind, Role
from postproc.units import DEG, MM


def corrections_csv(
    task: Task, result: Result, division: Division | None = None, way: Floats | None = None
) -> bytes:
    """One row a motion of the input: wanted pose (programmed base), force, deflection before, correction, residual,
    what was inserted before it, the largest error on its way (``way`` (M,) [m] of ``division``), history."""
    path = task.toolpath
    to_base = task.base.inverse()
    moved = to_base @ result.command[:]
    shift = (moved.position - path.position) / MM
    turned = vector_from_rotation(np.swapaxes(path.rotation, -1, -2) @ moved.rotation) / DEG
    bent = (to_base.rotation @ result.deflection[..., None])[..., 0] / MM
    force = (to_base.rotation @ task.wrench[:, :3, None])[..., 0]
    moment = (to_base.rotation @ task.wrench[:, 3:, None])[..., 0]
    blocks: list[tuple[str, Floats, int]] = [
        ("x_mm y_mm z_mm", path.position / MM, 6),
        ("a_deg b_deg c_deg", abc_from_rotation(path.rotation) / DEG, 6),
        ("fx_n fy_n fz_n", force, 3),
        ("mx_nm my_nm mz_nm", moment, 3),
        ("deflection_x_mm deflection_y_mm deflection_z_mm", bent, 6),
        ("error_before_mm", result.before[:, None] / MM, 6),
        ("correction_x_mm correction_y_mm correction_z_mm", shift, 6),
        ("correction_mm", np.linalg.norm(shift, axis=1, keepdims=True), 6),
        ("correction_rx_deg correction_ry_deg correction_rz_deg", turned, 6),
        ("error_after_mm", result.after[:, None] / MM, 6),
    ]
    columns: list[Numbers | Words] = [
        Numbers("line", path.line.astype(float)),
        Words("kind", path.kind, [kind.name for kind in Kind]),
        Words("state", result.state, [state.name.lower() for state in State]),
        Numbers("cut", np.where(result.cut < 0, np.nan, result.cut + 1.0)),
    ]
    for names, values, decimals in blocks:
        for name, column in zip(names.split(), values.T, strict=True):
            columns.append(Numbers(name, column, decimals))
    if division is not None and way is not None:
        for name, role in (("links", Role.LINK), ("points", Role.PIECE)):
            count = np.bincount(division.source[division.role == role], minlength=len(path))
            columns.append(Numbers(name, count.astype(float)))
        on_way = np.full(len(path), -1.0)
        np.maximum.at(on_way, division.source, np.nan_to_num(way / MM, nan=-1.0))
        columns.append(Numbers("error_way_mm", np.where(on_way < 0, np.nan, on_way), 6))
    columns.append(Numbers("iterations", result.iterations.astype(float)))
    for step, column in enumerate(result.history / MM):
        columns.append(Numbers(f"error_{step}_mm", column, 9))
    return csv_bytes(columns)
