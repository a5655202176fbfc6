"""What an earlier program left is gouged by a tool that is pushed into it: it counts to the part of the later one."""

import numpy as np
import pytest

pytest.importorskip("numba")

from test_engage_command import CELL

import postproc.part.part_error
from postproc.api import compensate
from postproc.part.part_figures import ErrorFigures
from postproc.robot.description import find_robot
from postproc.workflows.engage import EngageRequest, engage

HEAD = "%\nG21 G90 G17 G54\nT1 M6\nS12000 M3\nG0 X-20. Y4. Z30.\n"
TOOL = (
    "tools:\n  1: {shape: flat, diameter: 16, length: 40, teeth: 3, helix: 30, spindle: 12000,\n"
    "      coefficients: {ktc: 300, krc: 100, kac: 900, kte: 2, kre: 2, kae: 2}}\n"
)
"""An axial force that is larger than the others: it pushes the tool along its axis, into the floor."""


def rows(*places):
    lines = [f"G0 X-12. Y{places[0]}.", "G1 Z-8. F6000"]
    for k, y in enumerate(places):
        lines += [f"G1 Y{y}. F6000", f"G1 X{-12 if k % 2 else 132}. F2400"]
    return HEAD + "\n".join([*lines, "G0 Z30.", "M30", "%", ""])


def test_a_floor_that_was_there_is_gouged_as_deep_as_the_one_beside_it(tmp_path, monkeypatch):
    (tmp_path / "cell.yaml").write_text(CELL.format(robot=find_robot("kuka_kr270")))
    (tmp_path / "milling.yaml").write_text("stock: {box: [[0, 0, -30], [120, 80, 0]]}\n" + TOOL)
    (tmp_path / "one.ngc").write_text(rows(4, 14, 24))
    engage(EngageRequest(tmp_path / "one.ngc", stock_out=tmp_path / "one.stock"))
    (tmp_path / "milling.yaml").write_text("stock: {from: one.stock}\n" + TOOL)
    (tmp_path / "two.ngc").write_text(rows(20, 28))
    found, find = [], postproc.part.part_error.find_part_error

    def kept(*args, **keys):
        found.append(find(*args, **keys))
        return found[-1]

    monkeypatch.setattr(postproc.part.part_error, "find_part_error", kept)
    compensate(tmp_path / "two.ngc", force=True, output=tmp_path / "out.ngc")
    part = found[-1]
    points, normals = part.surface.points[part.own] / 1e-3, part.surface.normals[part.own]
    across = (points[:, 0] > 20) & (points[:, 0] < 100)
    floor = across & (normals[:, 2] > 0.999) & (points[:, 2] < -7.9)
    new, old = (
        floor & (points[:, 1] > low) & (points[:, 1] < high) for low, high in ((32.5, 35.5), (28, 31.5))
    )
    assert min(new.sum(), old.sum()) > 100
    before = part.before.error / 1e-3
    assert np.median(before[new]) < -0.04
    assert np.median(before[old]) == pytest.approx(np.median(before[new]), abs=0.004)
    # the tool of the second program is all that is displaced: elsewhere the floor is as it was
    assert points[floor, 1].min() > 19.9
    assert np.abs(part.after.error[old]).max() < 0.01e-3


def test_figures_of_a_part_without_error_have_no_minus():
    figures = ErrorFigures.of(np.zeros(3), np.ones(3), 1e-5)
    assert [f"{value:.1f}" for value in (figures.gouge_max, figures.excess_max)] == ["0.0", "0.0"]
