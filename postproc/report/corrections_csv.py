"""The report as files: corrections.csv."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.geometry import abc_from_rotation, turn_between, turned
from postproc.base.units import DEG, MM
from postproc.compensation.correct import CorrectionResult, MotionOutcome
from postproc.compensation.problem import CompensationProblem
from postproc.compensation.subdivision import Subdivision
from postproc.report.csv_columns import NumberColumn, TextColumn, csv_parts
from postproc.report.result import Columns
from postproc.toolpath import Kind, Role

_KINDS = [kind.name for kind in Kind]
STATE_NAMES = {
    state: "uncorrected" if state is MotionOutcome.UNCORRECTED else state.name.lower()
    for state in MotionOutcome
}
"""Words of the column ``state``."""


def corrections_csv(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision | None = None,
    path_error: Floats | None = None,
) -> Iterator[bytes]:
    """The parts of a table with one row a motion of the input: wanted pose (programmed base), force, deflection before,
    correction, residual, motions inserted before it, the largest path error between its points (``path_error`` (M,) [m]
    of ``division``), history."""

    def columns(rows: slice) -> list[NumberColumn | TextColumn]:
        return _columns(rows, task, result, division, path_error)

    return csv_parts(columns, len(task.toolpath))


def correction_table(
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision | None = None,
    path_error: Floats | None = None,
) -> Columns:
    """The same table as columns (N,), one row a motion of the input."""
    columns = _columns(slice(0, len(task.toolpath)), task, result, division, path_error)
    return {
        column.name: column.values
        if isinstance(column, NumberColumn)
        else np.array(column.texts)[column.codes]
        for column in columns
    }


def _columns(
    rows: slice,
    task: CompensationProblem,
    result: CorrectionResult,
    division: Subdivision | None,
    path_error: Floats | None,
) -> list[NumberColumn | TextColumn]:
    inserted = [] if division is None or path_error is None else _inserted(rows, division, path_error)
    return [*_motion(rows, task, result), *inserted, *_iterations(rows, result)]


def _motion(
    rows: slice, task: CompensationProblem, result: CorrectionResult
) -> list[NumberColumn | TextColumn]:
    path, position, rotation = task.toolpath, task.toolpath.position[rows], task.toolpath.rotation[rows]
    to_base = task.base.shared(rows).inverse()
    moved = to_base @ result.command[rows]
    shift = (moved.position - position) / MM
    turn = turn_between(np.swapaxes(moved.rotation, -1, -2), np.swapaxes(rotation, -1, -2)) / DEG
    deflection = turned(to_base.rotation, result.deflection[rows]) / MM
    wrench = task.wrench[rows]
    force, moment = (turned(to_base.rotation, part) for part in (wrench[:, :3], wrench[:, 3:]))
    cut = result.cut[rows]
    blocks: list[tuple[str, Floats, int]] = [
        ("x_mm y_mm z_mm", position / MM, 6),
        ("a_deg b_deg c_deg", abc_from_rotation(rotation) / DEG, 6),
        ("fx_n fy_n fz_n", force, 3),
        ("mx_nm my_nm mz_nm", moment, 3),
        ("deflection_x_mm deflection_y_mm deflection_z_mm", deflection, 6),
        ("error_before_mm", result.before[rows, None] / MM, 6),
        ("correction_x_mm correction_y_mm correction_z_mm", shift, 6),
        ("correction_mm", np.linalg.norm(shift, axis=1, keepdims=True), 6),
        ("correction_rx_deg correction_ry_deg correction_rz_deg", turn, 6),
        ("error_after_mm", result.after[rows, None] / MM, 6),
    ]
    return [
        NumberColumn("line", path.line[rows].astype(float)),
        TextColumn("kind", path.kind[rows], _KINDS),
        TextColumn("state", result.state[rows], [STATE_NAMES[state] for state in MotionOutcome]),
        NumberColumn("cut", np.where(cut < 0, np.nan, cut + 1.0)),
        *(
            NumberColumn(name, column, decimals)
            for names, values, decimals in blocks
            for name, column in zip(names.split(), values.T, strict=True)
        ),
    ]


def _inserted(rows: slice, division: Subdivision, path_error: Floats) -> list[NumberColumn | TextColumn]:
    low, high = bisect_left(division.source, rows.start), bisect_left(division.source, rows.stop)
    source, count = division.source[low:high] - rows.start, rows.stop - rows.start
    largest = np.full(count, -np.inf)
    np.fmax.at(largest, source, path_error[low:high] / MM)

    def number(role: Role) -> Floats:
        return np.bincount(source[division.role[low:high] == role], minlength=count).astype(float)

    return [
        NumberColumn("transition_moves", number(Role.TRANSITION)),
        NumberColumn("intermediate_points", number(Role.INTERMEDIATE)),
        NumberColumn("path_error_mm", largest, 6),
    ]


def _iterations(rows: slice, result: CorrectionResult) -> list[NumberColumn | TextColumn]:
    return [
        NumberColumn("iterations", result.iterations[rows].astype(float)),
        *(
            NumberColumn(f"error_{step}_mm", error, 9)
            for step, error in enumerate(result.history[:, rows] / MM)
        ),
    ]
