"""The report as files: corrections.csv and a unified diff."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Sequence

import numpy as np

from postproc.arrays import Floats
from postproc.compensation.correct import Result, State
from postproc.compensation.division import Division
from postproc.compensation.task import Task
from postproc.document import Document, Edit, Span, apply, in_order
from postproc.geometry import abc_from_rotation, vector_from_rotation
from postproc.toolpath import Kind, Role
from postproc.units import DEG, MM

CONTEXT = 3
"""Lines shown around a change in the diff, as diff -u does."""


def corrections_csv(
    task: Task, result: Result, division: Division | None = None, way: Floats | None = None
) -> bytes:
    """One row a motion of the input: wanted pose (programmed base), force, deflection before, correction, residual,
    what was inserted before it, the largest error on its way (``way`` (M,) [m] of ``division``), history."""
    path = task.toolpath
    to_base = task.base.inverse()
    moved = to_base @ result.command
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
    heads = ["line", "kind", "state", "cut"]
    columns: list[list[str]] = [
        [str(value) for value in path.line],
        [Kind(value).name for value in path.kind],
        [State(value).name.lower() for value in result.state],
        ["" if value < 0 else str(value + 1) for value in result.cut],
    ]
    for names, values, decimals in blocks:
        for name, column in zip(names.split(), values.T, strict=True):
            heads.append(name)
            columns.append(_texts(column, decimals))
    if division is not None and way is not None:
        counts = [
            np.bincount(division.source[division.role == role], minlength=len(path))
            for role in (Role.LINK, Role.PIECE)
        ]
        on_way = np.full(len(path), -1.0)
        np.maximum.at(on_way, division.source, np.nan_to_num(way / MM, nan=-1.0))
        heads += ["links", "points", "error_way_mm"]
        columns += [[str(value) for value in count] for count in counts]
        columns.append(_texts(np.where(on_way < 0, np.nan, on_way), 6))
    heads.append("iterations")
    columns.append([str(value) for value in result.iterations])
    for step, column in enumerate(result.history / MM):
        heads.append(f"error_{step}_mm")
        columns.append(_texts(column, 9))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(heads)
    writer.writerows(zip(*columns, strict=True))
    return stream.getvalue().encode("ascii")


def _texts(values: Floats, decimals: int) -> list[str]:
    """Fixed decimals, empty for what is not known, no minus zero."""
    rounded = np.round(values, decimals) + 0.0
    return ["" if value != value else f"{value:.{decimals}f}" for value in rounded.tolist()]


def unified_diff(document: Document, name: str, edits: Sequence[Edit]) -> bytes:
    """The change of one document in diff -u form, from its edits (lines keep their bytes, CR included)."""
    blocks = _changed_lines(document, edits)
    if not blocks:
        return b""
    out = [b"--- %s\n+++ %s\n" % (os.fsencode(document.path.name), os.fsencode(name))]
    hunks: list[list[tuple[int, int, list[Edit]]]] = []
    for block in blocks:
        if hunks and block[0] - hunks[-1][-1][1] <= 2 * CONTEXT:
            hunks[-1].append(block)
        else:
            hunks.append([block])
    last = len(document.line_starts) - (1 if document.line_starts[-1] == len(document.raw) else 0)
    growth = 0
    for hunk in hunks:
        begin, end = max(1, hunk[0][0] - CONTEXT), min(last, hunk[-1][1] + CONTEXT)
        body, added, at = [], 0, begin
        for first, final, inside in hunk:
            body += [b" " + line for line in _lines(document, at, first - 1)]
            old, new = _lines(document, first, final), _edited(document, first, final, inside)
            body += [b"-" + line for line in old] + [b"+" + line for line in new]
            added += len(new) - len(old)
            at = final + 1
        body += [b" " + line for line in _lines(document, at, end)]
        count = end - begin + 1
        out.append(b"@@ -%d,%d +%d,%d @@\n" % (begin, count, begin + growth, count + added))
        growth += added
        out += [line if line.endswith(b"\n") else line + b"\n\\ No newline at end of file\n" for line in body]
    return b"".join(out)


def _changed_lines(document: Document, edits: Sequence[Edit]) -> list[tuple[int, int, list[Edit]]]:
    """(first line, last line, edits) of every stretch that edits touch; an inserted whole line has last < first."""
    blocks: list[tuple[int, int, list[Edit]]] = []
    for edit in in_order(edits):
        first, column = document.place(edit.span.start)
        final = document.place(max(edit.span.start, edit.span.stop - 1))[0]
        if edit.span.start == edit.span.stop and column == 1 and edit.text.endswith(b"\n"):
            blocks.append((first, first - 1, [edit]))
        elif blocks and blocks[-1][1] >= first:
            blocks[-1] = (blocks[-1][0], max(final, blocks[-1][1]), [*blocks[-1][2], edit])
        else:
            blocks.append((first, final, [edit]))
    return blocks


def _edited(document: Document, first: int, final: int, edits: Sequence[Edit]) -> list[bytes]:
    """Lines ``first .. final`` with their edits in."""
    start = document.line_starts[first - 1]
    stop = document.line_starts[final] if final < len(document.line_starts) else len(document.raw)
    stop = max(start, stop)
    part = Document(document.path, document.raw[start:stop])
    here = [Edit(Span(0, e.span.start - start, e.span.stop - start), e.text) for e in edits]
    return io.BytesIO(apply(part, here)).readlines()


def _lines(document: Document, first: int, final: int) -> list[bytes]:
    bounds = [*document.line_starts[first - 1 : final + 1], len(document.raw)]
    return [document.raw[bounds[i] : bounds[i + 1]] for i in range(final - first + 1)]
