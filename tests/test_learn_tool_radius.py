"""A tool of another radius, learnt from a part: the next program moves every wall that it can, and says what it cannot.

The part is what a cutter that is 0.05 mm larger in radius leaves under the predicted deflection; nothing of it is taken
from what learns.
"""

import hashlib
import re
from types import SimpleNamespace

import numpy as np
import pytest

import postproc
from postproc.base.geometry import Poses
from postproc.learning.measured_walls import measured_walls
from postproc.learning.promise import Promise
from postproc.learning.surface_displacement import SurfaceDisplacement

RADIUS, LARGER, DEPTH = 8.0, 0.05, 10.0
CELL = """robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z, diameter: 16}
bases:
  1: {x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
orientation: {a: 0, b: 0, c: 180}
tolerance: 0.02
dialect: {name: linuxcnc}
"""


def passes(folder, centres, more=""):
    """A program with a pass along +x at each y of ``centres``, and the predicted deflection (x, y) -> (3,) [mm]."""
    lines = ["%", "G21 G90 G17 G54", "T1 M6", "S12000 M3", "G0 X-20. Y30. Z40."]
    for y in centres:
        lines += ["(FORCE OFF)", f"G0 X0. Y{y} Z40.", f"G1 Z-{DEPTH} F3000", "(FORCE -30 60 -20 @base)"]
        lines += [f"G1 X{x}. Y{y} Z-{DEPTH} F2400" for x in range(10, 101, 10)]
        lines += ["(FORCE OFF)", "G0 Z40."]
    (folder / "cell.yaml").write_text(CELL + more)
    program = folder / "p.ngc"
    program.write_text("\n".join([*lines, "M30", "%", ""]))
    table = postproc.predict(program, force=True).table()
    moved = {
        (round(float(x)), round(float(y), 3)): np.array([float(d) for d in deflection])
        for x, y, kind, *deflection in zip(
            *(table[name] for name in ("x_mm", "y_mm", "kind", *(f"deflection_{k}_mm" for k in "xyz"))),
            strict=True,
        )
        if kind == "LIN" and np.isfinite(deflection[0])
    }
    return program, moved


def learned(folder, centres, walls, more=""):
    """The result for ``walls`` [(y of the tool, normal along y)], and the RMS [mm] that the next program leaves."""
    program, moved = passes(folder, centres, more)
    rng = np.random.default_rng(1)
    rows = []
    for (x, y), d in moved.items():
        for centre, normal in walls:
            if abs(y - centre) < 1e-6:
                error = normal * d[1] - LARGER
                rows += [(x - 0.01, y - normal * RADIUS, z, 0, normal, 0, error) for z in (-3.0, -8.0)]
        rows.append((x, y, -DEPTH, 0, 0, 1, d[2]))
    measured = np.array(rows)
    measured[:, 6] += 0.003 * rng.standard_normal(len(measured))
    largest = measured[np.argmax(np.abs(measured[:, 6]))]
    digest = hashlib.sha256(program.read_bytes()).hexdigest()
    head = ["# positive: material_left", "# alignment: datum", "# cut_with: original", f"# sha256: {digest}"]
    side = "material_left" if largest[6] > 0 else "material_missing"
    head += ["# sigma_mm: 0.003", "# checked: {:.4f} {:.4f} {:.4f} {}".format(*largest[:3], side)]
    text = [",".join(f"{value:.5f}" for value in row) for row in measured]
    part = folder / "part1.csv"
    part.write_text("\n".join([*head, "X,Y,Z,NX,NY,NZ,DEV", *text, ""]))
    result = postproc.learn(program, part, force=True, output=folder / "next")
    words = re.findall(r"G1 X(\S+) Y(\S+) Z", (folder / "next" / "p.ngc").read_text())
    commanded = np.array(words, dtype=float)
    rest = []
    for (x, y), d in moved.items():
        near = commanded[np.argmin(np.hypot(commanded[:, 0] - x + d[0], commanded[:, 1] - y + d[1]))]
        rest += [n * (near[1] - y + d[1]) - LARGER for centre, n in walls if abs(y - centre) < 1e-6]
    return result, float(np.sqrt(np.mean(np.square(rest))))


@pytest.mark.parametrize("more", ["", "tool_errors: {1: {radius: 0.02, walls: {others: right}}}\n"])
def test_walls_on_both_sides_of_the_feed_are_moved_each_to_its_own(tmp_path, more):
    """Two passes along +x, one with the wall at its right and one at its left, are one operation; what the cell states
    of one side is wrong for the other."""
    result, rest = learned(tmp_path, (8.0, 52.0), ((8.0, 1), (52.0, -1)), more)
    assert rest < 0.1 * LARGER
    assert "LRN024" not in {finding.code for finding in result.findings}
    lines = (tmp_path / "next" / "p.tool_errors.yaml").read_text()
    assert "no one side is right" in lines
    assert "no wall was measured" not in lines


def test_a_slot_as_wide_as_the_tool_keeps_its_radius_and_the_promise_says_so(tmp_path):
    result, rest = learned(tmp_path, (8.0,), ((8.0, 1), (8.0, -1)))
    assert rest > 0.9 * LARGER
    assert "LRN024" in {finding.code for finding in result.findings}
    assert result.exit == 3
    assert result.promise.after > 0.7e-3 * LARGER


def lines_of(rows, share, spindle, normal):
    return SimpleNamespace(
        row=np.array(rows),
        share=np.array(share, float),
        spindle=np.tile(spindle, (len(rows), 1)),
        normal=np.array(normal, float),
    )


def walls(points, carries=(True,) * 6, straight=(1,)):
    """Of six motions of 10 mm along +x with tool 1 in one operation."""
    path = SimpleNamespace(
        tangent=lambda rows, share: np.tile([1.0, 0.0, 0.0], (len(rows), 1)), length=np.full(6, 0.01)
    )
    names = SimpleNamespace(names=("OP",), which=np.zeros(6, int))
    one = np.ones(6, int)
    return measured_walls(points, path, names, one, straight, one, np.array(carries))


DOWN = [0.0, 0.0, -1.0]
RIGHT, LEFT, BETWEEN = [0, 1, 0], [0, -1, 0], [0, np.sqrt(0.5), np.sqrt(0.5)]


def test_motions_take_the_side_of_the_nearest_points_of_their_cut():
    found = walls(lines_of([0, 4], [0.5, 0.5], DOWN, [RIGHT, LEFT]))
    assert found.both == {"OP"}
    assert not found.sides
    assert found.motion_side.tolist() in ([1, 1, 1, -1, -1, -1], [1, 1, -1, -1, -1, -1])
    found = walls(lines_of([0, 4], [0.5, 0.5], DOWN, [RIGHT, LEFT]), (True, True, True, False, True, True))
    assert found.motion_side.tolist() == [1, 1, 1, 0, -1, -1]
    found = walls(lines_of([0, 0], [0.2, 0.8], DOWN, [RIGHT, LEFT]), (True, True, False, True, True, True))
    assert found.motion_side.tolist() == [0] * 6, (
        "one motion with both sides has none, a cut without points neither"
    )


def test_surfaces_that_lean_have_no_side_but_for_a_taper():
    points = lines_of([0, 1, 2], [0.5] * 3, DOWN, [RIGHT, RIGHT, BETWEEN])
    assert walls(points).leaning == {"OP"}
    assert not walls(points).sides
    assert walls(points, straight=()).sides == {"OP": 1}


def test_a_flat_end_moves_surfaces_that_lean_by_their_share_across_the_spindle():
    """Both flanks of a ridge along x, measured in one operation."""
    lean = np.linspace(0.3, 1.2, 10)
    normal = np.concatenate(
        [np.column_stack([0 * lean, side * np.sin(lean), np.cos(lean)]) for side in (1, -1)]
    )
    count = len(normal)
    tip = np.column_stack([np.linspace(0, 0.5, count), np.repeat([0.05, -0.05], 10), np.zeros(count)])
    points = SimpleNamespace(
        row=np.arange(count), normal=normal, spindle=np.tile(DOWN, (count, 1)), point=tip, to_contact=0 * tip
    )
    one = np.ones(count, int)
    acts = np.arange(count) != 3
    poses = Poses(np.tile(np.eye(3), (count, 1, 1)), tip)
    moved = SurfaceDisplacement({1: 2e-5}, (), one, 0 * one, acts, points).at(np.arange(count), poses)
    deeper = np.sum(moved * normal, axis=1)
    np.testing.assert_allclose(deeper[acts], -2e-5 * np.hypot(*normal[acts, :2].T), atol=2e-6)
    assert not moved[3].any()


@pytest.mark.parametrize("shift", [0.0, 4e-5])
def test_an_error_that_stays_is_part_of_the_promise_but_not_what_the_alignment_takes(shift):
    stays = np.tile([3e-5, -3e-5], 20) + shift
    free = np.ones((40, 1))
    got = Promise(1e-4, 4e-5, 2e-5, 8e-5).with_remaining(stays, free)
    assert got.after == pytest.approx(5e-5)
    assert got.lower < got.after < got.upper
    assert got.upper > 8e-5
