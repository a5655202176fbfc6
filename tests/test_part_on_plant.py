"""A wall cut on MuJoCo: the bytes of a program as posted, its tool swept by plain arithmetic, against the reported
part."""

import re
import shutil

import numpy as np
import pytest

pytest.importorskip("numba")
pytest.importorskip("mujoco")

from plant import Plant

from postproc.base.geometry import vector_from_rotation
from postproc.part.part_error import find_part_error
from postproc.workflows.preparation import Request, prepare

BASE = np.array([1.450, -0.100, 0.600])
DOWN = np.diag([1.0, -1.0, -1.0])  # A 0, B 0, C 180
RADIUS, WALL = 8.0, 32.5
PASSES = (14, 22, 31, 36)  # lines that lead past the wall


def targets(text):
    """(K, 4) line and X Y Z after every line of a program in absolute mm."""
    at, rows = {"X": np.nan, "Y": np.nan, "Z": np.nan}, []
    for number, line in enumerate(text.splitlines(), 1):
        words = re.findall(r"([XYZ])\s*(-?[0-9.]+)", re.sub(r"\(.*?\)", "", line))
        at.update({letter: float(value) for letter, value in words})
        rows.append([number, at["X"], at["Y"], at["Z"]])
    return np.array(rows)


def motors_at(plant, guess, tip, tool):
    """Motor angles that bring the tool of the unloaded plant to ``tip`` [m] with the orientation DOWN, by Newton."""
    q = guess.copy()
    for _ in range(8):

        def off(angles):
            rest = plant.rest(angles, np.zeros(6), tool)
            turn = vector_from_rotation((DOWN @ rest.rotation.T)[None])[0]
            return np.concatenate([tip - rest.position, turn])

        here = off(q)
        if np.abs(here).max() < 1e-9:
            return q
        slopes = np.array([(off(q + 1e-6 * step) - here) / 1e-6 for step in np.eye(6)]).T
        q = q - np.linalg.solve(slopes, here)
    raise AssertionError("the plant's arm does not reach the point")


def cut_wall(plant, task, row, ends, nominal, count=25):
    """Tips (C, 3) [mm] and axes (C, 3) in the base along a straight motion under the force of ``row``."""
    tool = task.tool[np.array([row])][0]
    tips, axes = [], []
    for share in np.linspace(0, 1, count):
        tip = ends[0] + share * (ends[1] - ends[0])
        along = float(np.clip((tip[0] - nominal[0]) / (nominal[1] - nominal[0]), 0, 1))
        wrench = task.force.along(np.array([row]), np.array([along]))[0]
        q = motors_at(plant, task.track.q[row], BASE + tip / 1000, tool)
        rest = plant.rest(q, wrench, tool)
        tips.append((rest.position - BASE) * 1000)
        axes.append(-rest.rotation[:, 2])
    return np.array(tips), np.array(axes)


def wall_at(x, z, sweeps):
    """Y of the wall at (x, z): the furthest that any pose of the tool of ``sweeps`` reaches there."""
    furthest = -np.inf
    for tips, axes in sweeps:
        fine = np.linspace(0, len(tips) - 1, 4001)
        tip, axis = (
            np.column_stack([np.interp(fine, np.arange(len(tips)), part[:, k]) for k in range(3)])
            for part in (tips, axes)
        )
        rise = (z - tip[:, 2]) / axis[:, 2]
        middle = tip[:, :2] + rise[:, None] * axis[:, :2]
        inside = (np.abs(x - middle[:, 0]) < RADIUS) & (rise > 0)
        # the circle of a leaning cylinder is an ellipse, longer by less than 1e-6 of itself
        reach = middle[inside, 1] + np.sqrt(RADIUS**2 - (x - middle[inside, 0]) ** 2)
        furthest = max(furthest, reach.max(initial=-np.inf))
    return furthest


@pytest.mark.slow
def test_the_wall_that_mujoco_cuts_is_the_reported_one(tmp_path, pytestconfig):
    """Within 0.2 um, under the forces of the task; more than 0.5 mm off."""
    shutil.copytree(pytestconfig.rootpath / "robots", tmp_path / "robots")
    shutil.copytree(pytestconfig.rootpath / "samples/kr270_stock", tmp_path / "samples/kr270_stock")
    program = tmp_path / "samples/kr270_stock/part.ngc"
    task = prepare(Request(program, force="")).task
    plant = Plant.of(task.model)
    line = task.toolpath.line
    posted = targets(program.read_text())
    row_of = {number: int(np.flatnonzero(line == number)[0]) for number in PASSES}

    sweeps = []
    for number in PASSES:
        ends = posted[[number - 2, number - 1], 1:]
        sweeps.append(cut_wall(plant, task, row_of[number], ends, ends[:, 0]))
    part = find_part_error(task, task.force.stock, None, as_nominal="the plant has the forces of the task")
    points, error = part.surface.points[part.own] * 1000, part.before.error * 1000
    compare(points, error, sweeps)


def compare(points, error, sweeps):
    """Every tenth point of the wall: what the report says, and the plant's; some more than 0.5 mm off."""
    wall = (np.abs(points[:, 1] - WALL) < 0.01) & (points[:, 0] > 15) & (points[:, 0] < 95)
    wall &= (points[:, 2] > -7.2) & (points[:, 2] < -0.8)
    chosen = np.flatnonzero(wall)[::10]
    assert len(chosen) > 30
    true = np.array([WALL - wall_at(points[i, 0], points[i, 2], sweeps) for i in chosen])
    assert np.abs(true).max() > 0.5
    # the report's error is above zero where material remains: the wall's material is beyond Y 32.5
    assert np.abs(error[chosen] - true).max() < 2e-4, (error[chosen], true)
