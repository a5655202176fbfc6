"""The written program on another engine: MuJoCo bends the arm, and the tool is on the path that was wanted."""

from __future__ import annotations

import numpy as np
import pytest
from plant import Plant

from postproc.cell import frames_of, load_cell
from postproc.dialects import detect
from postproc.document import Document
from postproc.forces import wrenches
from postproc.geometry import Poses, on_arc, rotation_from_vector, vector_from_rotation
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import inverse
from postproc.toolpath import Kind
from postproc.units import MM

PROGRAM = [
    "DEF part()",
    "BAS(#INITMOV,0)",
    "$BASE=BASE_DATA[1]",
    "$TOOL=TOOL_DATA[1]",
    "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}",
    "$VEL.CP=0.05",
    "LIN {X 0,Y -100,Z 50,A 0,B 0,C 180}",
    "LIN {X 0,Y -100,Z 0,A 0,B 0,C 180}",
    ";FORCE -300 150 100 @feed",
    "LIN {X 0,Y 500,Z 0,A 0,B 0,C 180}",
    "LIN {X 300,Y 500,Z 0,A 0,B 0,C 180}",
    "CIRC {X 450,Y 350,Z 0,A 0,B 0,C 180},{X 300,Y 200,Z 0,A 0,B 0,C 180}",
    "LIN {X 100,Y 200,Z 0,A 20,B 0,C 180}",
    ";FORCE OFF",
    "LIN {X 100,Y 200,Z 50,A 20,B 0,C 180}",
    "END",
]
SAMPLES = 9


def read(path):
    raw = path.read_bytes()
    return detect(path, raw).read((Document(path, raw),)).toolpath


def along(path, row, share):
    """Programmed pose in the base, at a share of a motion: straight or round, turned evenly about one axis."""
    one, two = path.target_in_base[row - 1], path.target_in_base[row]
    turn = vector_from_rotation(one.rotation.T @ two.rotation)
    place = one.position + share * (two.position - one.position)
    if path.kind[row] == Kind.CIRC:
        arc = (path.centre[row], path.normal[row], path.sweep[row])
        place = on_arc(*(np.array([v]) for v in (one.position, two.position, *arc)), np.array([share]))[0]
    return Poses(one.rotation @ rotation_from_vector(share * turn), place)


def test_the_tool_is_on_the_path_all_along(compensate, job):
    source = job.write(PROGRAM)
    assert compensate(source, "--force", "-q").code == 0
    cell = load_cell(job.folder / "cell.yaml")
    robot = load_robot(find_robot(cell.robot))
    plant = Plant.of(StiffnessModel.from_robot(robot))
    original, written = read(source), read(job.output)
    assert len(written) > len(original)
    frames = frames_of(cell, original, source)
    force = wrenches(source, original, frames, cell, "")
    base, tool = frames.base_in_robot[1], frames.tool_in_flange[1]

    # the wanted path, finely, with the force at each place
    rows = np.flatnonzero(force.carries)
    fine = np.linspace(0, 1, 2001)
    owner, share = np.repeat(rows, len(fine)), np.tile(fine, len(rows))
    wanted = (
        base
        @ Poses(
            np.eye(3), np.array([along(original, r, s).position for r, s in zip(owner, share, strict=True)])
        )
    ).position
    wrench = force.along(owner, share)

    worst, last = 0.0, 0
    first, stop = rows[0], len(written) - 1  # the last motion leads away without force
    assert (
        np.linalg.norm(written.position[first] - original.position[first - 1]) < 5 * MM
    )  # the link to the begin
    near = np.radians([0.0, -90.0, 110.0, 0.0, 40.0, 0.0])
    status = np.array([2])
    for row in range(first + 1, stop):
        if np.linalg.norm(written.position[row] - written.position[row - 1]) < 5 * MM:
            last = int(np.flatnonzero(owner == owner[last])[-1]) + 1
            continue  # the link of a corner
        for t in np.linspace(0, 1, SAMPLES):
            command = base @ along(written, row, t)
            q = inverse(
                robot.nominal,
                Poses(command.rotation[None], command.position[None]) @ tool.inverse(),
                status,
                near[None],
            ).q[0]
            # the force at the place of the path where the tool comes, which is found along with it
            at = last
            for _ in range(3):
                there = plant.rest(q, wrench[at], tool).position
                window = slice(last, min(last + 700, len(wanted)))
                at = last + int(np.argmin(np.linalg.norm(wanted[window] - there, axis=1)))
            last = at
            nearby = wanted[max(at - 1, 0) : at + 2]
            step = nearby[-1] - nearby[0]
            off = there - wanted[at]
            off = off - (off @ step) / max(step @ step, 1e-18) * step
            worst = max(worst, float(np.linalg.norm(off)))
    assert last == len(wanted) - 1
    assert worst <= cell.tolerance
    assert worst == pytest.approx(0.0, abs=0.02 * MM)
