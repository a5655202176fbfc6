"""The sample cut on MuJoCo by a machine that meets its own forces, as posted and as written, against the report."""

import csv
import re
import shutil
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("numba")
pytest.importorskip("mujoco")

from cutting_plant import Arm, Machine
from plant import Plant

import postproc.part.part_error
from postproc.part.coupled_engagement import solve_coupled
from postproc.part.deflected_sweeps import deflect
from postproc.part.displacement import Displacements
from postproc.part.part_error import lever_of, paths_of
from postproc.part.surface_error import find_errors
from postproc.workflows.preparation import Request, prepare
from postproc.workflows.program import compensate

TOOLS = {1: (8.0, 3), 2: (5.0, 2)}  # radius mm, teeth
LINES = {1: 12, 2: 60}


def hard(text):
    """The program as no CAM system posts it: roughed to the floor, and rows of the wave that turn in the stock."""
    lines = text.splitlines()
    floor, wall = lines.index("(FLOOR)"), next(k for k, line in enumerate(lines) if line.startswith("(WALL"))
    lines = [line.replace("Z-7.500", "Z-8.000") for line in lines[:floor] + lines[wall:]]
    wave = lines.index("(WAVE)")
    inside = [
        not (found := re.match(r"G1 X(-?[0-9.]+) Y", line)) or 10 <= float(found[1]) <= 110
        for line in lines[wave:]
    ]
    rows = [line for line, stays in zip(lines[wave:], inside, strict=True) if stays]
    return "\n".join([*lines[:wave], *(line.replace("G0 X-5.", "G0 X10.") for line in rows)]) + "\n"


@pytest.fixture(scope="module", params=["sample", "hard"])
def reported(request, tmp_path_factory, pytestconfig):
    """Which program, its path, the task, and the part as the main job reports it."""
    folder = tmp_path_factory.mktemp("cut")
    shutil.copytree(pytestconfig.rootpath / "robots", folder / "robots")
    shutil.copytree(pytestconfig.rootpath / "samples/kr270_stock", folder / "samples/kr270_stock")
    program = folder / "samples/kr270_stock/part.ngc"
    if request.param == "hard":
        program.write_text(hard(program.read_text()))
    parts, asked, find = [], [], postproc.part.part_error.find_part_error
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            postproc.part.part_error,
            "find_part_error",
            lambda *a, **k: asked.append(a) or parts.append(find(*a, **k)) or parts[-1],
        )
        compensate(Request(program, force=""))
    return program, prepare(Request(program, force="")).task, parts[-1], asked[-1]


def deflections(program):
    """Feature -> the largest deflection of the tool that finishes it, mm, as posted."""
    text = program.read_text().splitlines()
    starts = {
        name: k
        for k, line in enumerate(text, 1)
        for name in ("FLOOR", "WALL", "WAVE")
        if line[1:].startswith(name)
    }
    order = [*sorted(starts.items(), key=lambda one: one[1]), ("", len(text) + 1)]
    with (program.parent / "compensated/part.corrections.csv").open() as file:
        rows = [(int(row["line"]), float(row["error_before_mm"] or 0)) for row in csv.DictReader(file)]
    return {
        name.lower(): max(size for line, size in rows if first < line < last)
        for (name, first), (_, last) in pairwise(order)
    }


def is_finished(program):
    return "(FLOOR)" in program.read_text()


def cut(task, path):
    line, plant = task.toolpath.line, Plant.of(task.model)
    arms = {}
    for tool, number in LINES.items():
        row = int(np.flatnonzero(line == number)[0])
        arms[tool] = Arm(plant, task.tool[np.array([row])][0], task.track.q[row].copy())
    machine = Machine(TOOLS, arms)
    machine.run(path.read_text())
    return machine


def with_force(run, share):
    """The run with coefficients that are ``share`` times as large."""
    edges = {}
    for number, own in run.process.edges.items():
        known = own.material.coefficients
        other = type(known)(
            *(tuple(share * value for value in values) for values in (known.cutting, known.edge))
        )
        edges[number] = replace(own, material=replace(own.material, coefficients=other))
    return replace(run, process=replace(run.process, edges=edges))


def change_by_force(asked, points, normals, share):
    """(K,) mm by which the reported error of the part as written changes at points (K, 3) [m] that the first tool
    leaves, where the force is ``share`` times as large and the correction stays."""
    task, run, division = asked[:3]
    paths, lever = paths_of(run), lever_of(run)
    paths = type(paths)(*(values[paths.which == 0] for values in paths))
    found = []
    for one in (run, with_force(run, share)):
        shown = Displacements(task, run.sweeps.in_stock, division)
        solved = solve_coupled(one, paths, shown, lever)
        pieces, moved = solved.pieces, replace(shown, wrench=solved.along)
        rows, _, _ = deflect(pieces.rows, pieces.motion, pieces.share, lever, moved)
        found.append(find_errors(run.engagement.stock, rows, 2e-3, points, normals).error)
    return 1000 * (found[1] - found[0])


def compare(machine, part, side):
    """Feature -> the errors of the report and of the machine there, mm."""
    points, normals = part.surface.points[part.own] * 1000, part.surface.normals[part.own]
    true, features = machine.errors(points, normals)
    found = {name: (1000 * side.error[at], true[at]) for name, at in features.items()}
    for name, (error, here) in found.items():
        apart = np.percentile(np.abs(error - here), [50, 90, 99, 100]) * 1000
        print(
            f"{name}: report {error.min():.4f} to {error.max():.4f} mm, machine {here.min():.4f} to {here.max():.4f};"
            f" apart by {apart.round(1)} um at 50, 90, 99, 100 %"
        )
    return found


@pytest.mark.slow
def test_the_part_as_posted_is_the_one_that_the_machine_cuts(reported):
    """Engagement and deflection of 2.4 mm: the wall within 1 % (1.2 where it is roughed at two depths), the floor and
    the wave 4 um but at rims.

    The machine cuts with the chip of the tool's own speed, the report with that of the feed: they differ where the tool
    enters and leaves, and its displacement changes along the feed."""
    program, task, part, _ = reported
    machine = cut(task, program)
    assert machine.largest == pytest.approx(part.figures.as_posted.force, rel=0.01)
    found = compare(machine, part, part.before)
    error, true = found["wall"]
    assert np.abs(true).max() > 2
    finished = is_finished(program)
    assert np.percentile(np.abs(error - true), [75, 90]) == pytest.approx(
        [0, 0], abs=(0.012 if finished else 0.01) * np.abs(true).max()
    )
    error, true = found["floor"]
    assert np.abs(true).max() > (0.009 if finished else 0.09)
    assert np.percentile(np.abs(error - true), [75, 95]) == pytest.approx([0, 0], abs=5e-3)
    error, true = found["wave"]
    assert np.abs(true).max() > 0.3
    assert np.percentile(np.abs(error - true), [50, 90]) == pytest.approx([0, 0], abs=4e-3)


@pytest.mark.slow
def test_the_part_as_written_is_the_one_that_the_machine_cuts(reported):
    """Within some um, but at the rims of the wave, and all of it within the tolerance.  Where a path turns at once in
    the stock the tool turns over some tenths of a millimetre, and leaves no more than is reported."""
    program, task, part, asked = reported
    machine = cut(task, program.parent / "compensated/part.ngc")
    assert machine.worst < 0.1
    found = compare(machine, part, part.after)
    for name, most in (("wall", 4e-3), ("floor", 2e-3), ("wave", 4e-3)):
        error, true = found[name]
        assert np.percentile(np.abs(error - true), 90) < most, name
        assert np.median(np.abs(error - true)) < 3e-3, name
    # where the tool enters and leaves the correction follows
    for name in ("wall", "floor"):
        assert np.abs(found[name][1]).max() < 0.03, name
    # also where the tool leaves a slot, and its own direction and force have no equilibrium
    error, true = found["floor"]
    assert np.percentile(np.abs(error - true), 99) < 0.02
    error, true = found["wave"]
    if is_finished(program):
        large = deflections(program)
        for name, share in (("wall", 0.005), ("floor", 0.005), ("wave", 0.02)):
            apart = float(np.abs(found[name][0] - found[name][1]).max())
            allowed = 2e-3 + share * large[name]  # 2 um, and what the goal of the force is worth
            print(f"{name}: largest deflection {large[name]:.3f} mm; apart by {1e3 * apart:.1f} um,", end=" ")
            print(f"{1e3 * allowed:.1f} with the goal of the force")
        assert np.percentile(np.abs(error - true), 99) < 8e-3
        for name in ("wall", "floor"):
            assert np.percentile(np.abs(found[name][0] - found[name][1]), 90) < 2e-3, name
        # where the second level of the roughing touches the wall of the first or does not, half a per cent of the force
        # decides over micrometres, and over where along the wall
        points, normals = part.surface.points[part.own], part.surface.normals[part.own]
        wall = machine.errors(points * 1000, normals)[1]["wall"]
        change = np.max(
            [np.abs(change_by_force(asked, points[wall], normals[wall], share)) for share in (0.995, 1.005)],
            axis=0,
        )
        along = 1000 * points[wall][:, 0]
        near = np.abs(along[:, None] - along) < 2.0
        allowed = 2e-3 + np.where(near, change, 0.0).max(axis=1)
        apart = np.abs(found["wall"][0] - found["wall"][1])
        sizes = (np.percentile(change, [50, 90, 99, 100]) * 1000).round(1)
        beyond = 1000 * (apart - allowed).max() + 2
        print(
            f"wall: 0.5 % of the force changes it by {sizes} um; apart by at most {beyond:.1f} um beyond that"
        )
        assert np.all(apart < allowed)
        for name, most in (("wall", 6e-3), ("floor", 1e-3), ("wave", 12e-3)):
            assert np.abs(found[name]).max() < 1e3 * task.tolerance, name
            assert np.abs(found[name][0] - found[name][1]).max() < most, name
        return
    assert true.min() > -0.05
    assert 0.1 < true.max() < error.max() < 1.4 * true.max()
    assert np.percentile(np.abs(error - true), 99) < 0.025
