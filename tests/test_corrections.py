"""The table of corrections: a row a motion, with the figures of the result, in however many blocks it is made."""

from __future__ import annotations

import csv
import io
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from conftest import CELL, JUMPED_LINES

from postproc.base.geometry import abc_from_rotation, rotation_from_vector
from postproc.compensation.correct import MotionOutcome, correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.report import corrections_csv as files
from postproc.report.corrections_csv import corrections_csv
from postproc.report.csv_columns import csv_parts
from postproc.toolpath import Kind, Role
from postproc.workflows.preparation import Request, prepare


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A task in a turned base, its correction, divided, and an error on the way of each motion of the output."""
    folder = tmp_path_factory.mktemp("corrections")
    base = "  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}"
    assert base in CELL
    cell = CELL.replace(base, base.replace("a: 0", "a: 25").replace("c: 0", "c: 3"))
    (folder / "cell.yaml").write_text(cell.replace("tolerance: 0.02", "tolerance: 0.0005"))
    (folder / "part.src").write_text("\n".join(JUMPED_LINES) + "\n")
    task = prepare(Request(folder / "part.src", force="")).task
    result = correct(task)
    division = subdivide(task, result, Limits(min_segment=1e-3, max_growth=50.0))
    way = np.random.default_rng(5).random(len(division)) * 1e-5
    way[::3] = np.nan
    return task, result, division, way


def rows_of(parts) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(b"".join(parts).decode())))


@pytest.mark.parametrize("rows", [1, 5, 1000])
def test_it_is_the_same_in_blocks_of_any_size(done, rows, monkeypatch):
    whole = b"".join(corrections_csv(*done))
    monkeypatch.setattr(files, "csv_parts", partial(csv_parts, rows=rows))
    assert b"".join(corrections_csv(*done)) == whole


def test_a_row_tells_where_the_motion_is_what_bends_it_and_what_corrects_it(done):
    task, result, _, _ = done
    table, path = rows_of(corrections_csv(task, result)), task.toolpath
    assert len(table) == len(path)
    assert (result.state == MotionOutcome.CORRECTED).sum() == 5

    def values(row, names):
        return np.array([float(row[name] or "nan") for name in names.split()])

    for k, row in enumerate(table):
        assert row["line"] == str(path.line[k])
        assert (row["kind"], row["state"]) == (
            Kind(path.kind[k]).name,
            MotionOutcome(result.state[k]).name.lower(),
        )
        assert row["cut"] == ("" if result.cut[k] < 0 else str(result.cut[k] + 1))
        back = task.base[k].rotation.T
        near = partial(np.testing.assert_allclose, rtol=0, atol=5.1e-7, equal_nan=True)
        near(values(row, "x_mm y_mm z_mm"), path.position[k] * 1e3)
        near(values(row, "a_deg b_deg c_deg"), np.degrees(abc_from_rotation(path.rotation[k])))
        near(
            values(row, "deflection_x_mm deflection_y_mm deflection_z_mm"), back @ result.deflection[k] * 1e3
        )
        near(values(row, "error_before_mm error_after_mm"), [result.before[k] * 1e3, result.after[k] * 1e3])
        force = [back @ task.wrench[k, :3], back @ task.wrench[k, 3:]]
        near(values(row, "fx_n fy_n fz_n mx_nm my_nm mz_nm"), np.concatenate(force), atol=5.1e-4)
        if not row["x_mm"]:
            assert not row["correction_x_mm"]
            continue
        shift = values(row, "correction_x_mm correction_y_mm correction_z_mm")
        near(shift, back @ result.correction[k] * 1e3)
        near(values(row, "correction_mm"), [np.linalg.norm(result.correction[k]) * 1e3])
        # turned by it in place, the wanted orientation is the command's
        turn = np.radians(values(row, "correction_rx_deg correction_ry_deg correction_rz_deg"))
        command = result.command[[k]].rotation[0]
        near(task.wanted[[k]].rotation[0] @ rotation_from_vector(turn), command, atol=5e-8)
        assert int(row["iterations"]) == result.iterations[k]
        for step, error in enumerate(result.history[:, k]):
            near(values(row, f"error_{step}_mm"), [error * 1e3], atol=5.1e-10)


def test_a_row_counts_what_was_inserted_and_tells_the_largest_error_on_the_way(done):
    task, result, division, way = done
    table = rows_of(corrections_csv(task, result, division, way))
    assert {Role.ORIGINAL, Role.TRANSITION, Role.INTERMEDIATE} == set(division.role)
    assert division.inserted > 5
    for k, row in enumerate(table):
        own = division.source == k
        assert int(row["transition_moves"]) == (own & (division.role == Role.TRANSITION)).sum()
        assert int(row["intermediate_points"]) == (own & (division.role == Role.INTERMEDIATE)).sum()
        known = own & np.isfinite(way)
        largest = f"{way[known].max() * 1e3:.6f}" if known.any() else ""
        assert row["path_error_mm"] == largest


def test_what_is_not_finite_is_empty(done):
    task, result, _, _ = done
    lost = replace(result, after=np.full(len(result.after), np.inf))
    assert {row["error_after_mm"] for row in rows_of(corrections_csv(task, lost))} == {""}
