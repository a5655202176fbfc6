"""Cuts over the pole of two rotary axes on MuJoCo: the tool is where, and as much off, as the report says."""

from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import CELL
from plant import Plant
from test_poles import axis, between, blocks, leaning, program

from postproc.base.geometry import Poses, rotation_from_abc
from postproc.base.units import MM
from postproc.cell import frames_of, load_cell
from postproc.model import StiffnessModel
from postproc.process import wrenches
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import branch_of, inverse
from postproc.workflows.preparation import read_program

SAMPLES = 8


def pose(one, two, share, base, tool_at_zero):
    """Pose of words that run linearly, and its tool axis in the base."""
    words = one.words + share * (two.words - one.words)
    rotation = rotation_from_abc(np.radians(words[::-1])) @ tool_at_zero
    return base @ Poses(rotation, (one.place + share * (two.place - one.place)) * MM), axis(words)


def on_plant(source, output, cell_path):
    """(S, 3) of samples along the written cut: the tool's angle [deg] and distance [mm] from those of the robot without
    force at the same place of the original, and the programmed lean [deg]."""
    cell = load_cell(cell_path)
    robot = load_robot(find_robot(cell.robot))
    plant = Plant.of(StiffnessModel.from_robot(robot))
    path = read_program(source, cell)[1].toolpath
    frames = frames_of(cell, path, source)
    force = wrenches(source, path, frames, cell, "")
    base, tool = frames.base_in_robot[1], frames.tool_in_flange[1]
    zero = rotation_from_abc(cell.orientation)
    spindle = zero.T @ np.array([0.0, 0.0, 1.0])
    before, after = blocks(source.read_text()), blocks(output.read_text())
    rows = [i for i, block in enumerate(before) if block.under_force]
    owner, share = np.repeat(rows, 1501), np.tile(np.linspace(0, 1, 1501), len(rows))
    wanted = np.array(
        [pose(before[r - 1], before[r], s, base, zero)[0].position for r, s in zip(owner, share, strict=True)]
    )
    wrench = force.along(owner, share)
    status = branch_of(robot.nominal, np.radians(cell.start)[None])

    def axes(at, near):
        flange = Poses(at.rotation[None], at.position[None]) @ tool.inverse()
        return inverse(robot.nominal, flange, status, near[None]).q[0]

    cut = [i for i, block in enumerate(after) if block.under_force]
    start = cut[0]
    begin = before[rows[0] - 1].place
    if (
        np.linalg.norm(after[start].place - begin) < 8.0
        and np.linalg.norm(after[start - 1].place - begin) < 1e-6
    ):
        start += 1  # a transition leads to where the cut begins
    q, last, found = np.radians(cell.start), 0, []
    for i in range(start, cut[-1] + 1):
        for s in np.linspace(0, 1, SAMPLES):
            q = axes(pose(after[i - 1], after[i], s, base, zero)[0], q)
            at, shift = last, np.zeros(3)
            for _ in range(3):
                there = plant.rest(q, wrench[at], tool)
                window = wanted[last : last + 900] + shift
                at = last + int(np.argmin(np.linalg.norm(window - there.position, axis=1)))
                here, direction = pose(before[owner[at] - 1], before[owner[at]], share[at], base, zero)
                free = plant.rest(axes(here, q), np.zeros(6), tool)
                shift = free.position - wanted[at]
            last = at
            along = wanted[min(at + 1, len(wanted) - 1)] - wanted[at - 1]
            off = there.position - free.position
            off = off - (off @ along) / (along @ along) * along
            lean = between(direction, np.array([0.0, 0.0, 1.0]))
            found.append(
                (between(there.rotation @ spindle, free.rotation @ spindle), np.linalg.norm(off) / MM, lean)
            )
    assert last == len(wanted) - 1
    return np.array(found)


@pytest.mark.slow
@pytest.mark.parametrize(("pair", "lean"), [("BC", 2), ("AC", 8), ("AB", 4)])
def test_what_is_reported_is_what_another_engine_finds(compensate, job, pair, lean):
    job.cell(CELL + "orientation: {a: 0, b: 0, c: 180}\nmax_growth: 20\ndialect: {name: fanuc}\n")
    points = [
        f"X0 Y0 {leaning(pair, 0, 3)}",
        f"X60 Y0 {leaning(pair, lean, 3)}",
        f"X120 Y20 {leaning(pair, lean, -2)}",
        f"X200 Y20 {leaning(pair, 0, -2)}",
    ]
    source = job.write(program("fanuc", points), "\n", "part.nc")
    report = compensate(source, "--force", "--json", "-").json
    angle, off, leans = on_plant(source, job.folder / "compensated" / "part.nc", job.folder / "cell.yaml").T
    told = max(report["angle_after_deg"]["max"], report["path_error_deg"]["max"])
    assert angle.max() == pytest.approx(told, abs=0.002), json.dumps(report["findings"])
    assert off.max() <= report["path_error_mm"]["max"] + 0.001 <= 0.021
    assert angle[leans > 1.0].max() <= 0.01
    if pair == "AB":  # upright is no pole of these
        assert angle.max() <= 0.01
