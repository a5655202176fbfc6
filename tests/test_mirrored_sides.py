"""What is stated of the side of a cut where the program mirrors its coordinates.

The blank beside the path goes with the mirror, and the spindle turns as before.  So: points are taken through the
mirrors one by one, a place in the material tells on which side the real cut is, and the force is that of a cutter
turned tooth by tooth, in base axes, through the material that is there.
"""

from types import SimpleNamespace

import numpy as np
import pytest

import postproc
from postproc.learning.measured_walls import measured_walls
from postproc.workflows.preparation import Request, prepare

TOOL, WIDTH, DEPTH, TEETH, HELIX = 16.0, 4.0, 4.0, 3, 1
KT, KR, KA, KTE, KRE, KAE = 780.0, 190.0, 210.0, 22.0, 21.0, 1.0
CHIP = 0.1

CELL = """robot: kuka_kr270
tools: {{1: {{x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z, diameter: 16}}}}
bases: {{1: {{x: 1450, y: -100, z: 600, a: 0, b: 0, c: 0}}}}
start: [0, -90, 90, 0, 45, 0]
orientation: {{a: 0, b: {b}, c: {c}}}
{more}
dialect: {{name: {dialect}}}
"""
PROCESS = """defaults:
  diameter: 16
  teeth: 3
  helix: 30
  spindle: 12000
  coefficients: {{ktc: 780, krc: 190, kac: 210, kte: 22, kre: 21, kae: 1}}
operations: [{{tool: 1, axial_depth: 4, radial_width: 4, direction: {direction}}}]
"""


def real_force(feed, into):
    """(3,) [N] mean force in base axes on a cutter under a spindle along -z that turns clockwise seen from above, with
    the ``feed`` (3,) and the material on the side ``into`` (3,)."""
    z = np.array([0.0, 0.0, 1.0])
    angle = (np.arange(20000) + 0.5)[:, None] * 2 * np.pi / 20000
    outwards = np.concatenate([np.sin(angle), np.cos(angle), 0 * angle], axis=1)  # of a tooth, from the axis
    runs = np.cross(outwards, z)  # clockwise
    chip = (CHIP * outwards @ feed)[:, None]
    cuts = (chip > 0) & ((TOOL / 2 * outwards @ into)[:, None] > TOOL / 2 - WIDTH)
    tangential, radial, axial = (c * chip + e for c, e in ((KT, KTE), (KR, KRE), (KA, KAE)))
    # the part pushes back: against the motion of the tooth, and inwards; a right-hand helix pulls down
    return TEETH * DEPTH * (cuts * (-tangential * runs - radial * outwards - HELIX * axial * z)).mean(axis=0)


def mirrored(axes):
    """What a mirror about the planes of ``axes`` makes of a vector."""
    return lambda vector: np.array([-v if name in axes else v for name, v in zip("XYZ", vector, strict=True)])


def program(folder, mirror, dialect="fanuc", way=(-100.0, 0.0), comment="", more="", b=0.0, c=180.0):
    """Two cuts along ``way``, of which the second is mirrored by the block ``mirror``."""
    cut = [
        "G0 X10. Y-4. Z30.",
        "G0 Z-4.",
        *([comment] if comment else []),
        f"G1 X{10 + way[0]:.3f} Y{way[1] - 4:.3f} F3600.",
        *(["(FORCE OFF)"] if comment else []),
        "G0 Z30.",
    ]
    head = ["O1", "G21 G90 G17 G54 G94", "T1 M6", "S12000 M3"]
    if dialect == "sinumerik":
        head = ["G71 G90 G17 G54 G94", "T1 D1", "S12000 M3"]
    folder.mkdir(exist_ok=True)
    path = folder / ("p.nc" if dialect == "fanuc" else "p.mpf")
    path.write_text("\n".join([*head, *cut, *mirror, *cut, "M30"]) + "\n")
    (folder / "cell.yaml").write_text(CELL.format(dialect=dialect, more=more, b=b, c=c))
    return path


def cuts(ready):
    """Rows of the cuts as they are programmed, and mirrored."""
    one, other = np.flatnonzero(ready.program.toolpath.kind == 2)
    return one, other


MIRRORS = [
    ("fanuc", ["G51.1 Y40."], "Y"),
    ("fanuc", ["G51.1 X5."], "X"),
    ("fanuc", ["G51.1 X5. Y40."], "XY"),
    ("fanuc", ["G51.1 Z10."], "Z"),
    ("fanuc", ["G51.1 X5. Z10."], "XZ"),
    ("fanuc", ["G51.1 X5.", "G51.1 Y40.", "G50.1 X0."], "Y"),
    ("sinumerik", ["MIRROR Y0"], "Y"),
    ("sinumerik", ["TRANS X10", "AMIRROR X0"], "X"),
    ("sinumerik", ["MIRROR X0", "AMIRROR Y0"], "XY"),
    ("sinumerik", ["MIRROR X0", "AMIRROR X0"], ""),
    ("sinumerik", ["MIRROR Y0", "ASCALE X0.5 Y0.5"], "Y"),
    ("sinumerik", ["MIRROR Z0"], "Z"),
]


@pytest.mark.parametrize("direction", ["down", "up"])
@pytest.mark.parametrize(("dialect", "mirror", "axes"), MIRRORS)
def test_a_stated_direction_is_that_of_the_programmed_side(tmp_path, dialect, mirror, axes, direction):
    """Climb milling of a mirrored side is conventional milling, and the other way round."""
    more = "process: milling.yaml\nforce_ci95: 0.1"
    path = program(tmp_path, mirror, dialect, (-80.0, 60.0), more=more)
    (tmp_path / "milling.yaml").write_text(PROCESS.format(direction=direction))
    ready = prepare(Request(path, force=""))
    feed = np.array([-0.8, 0.6, 0.0])
    # a tooth that leaves through no chip runs with it: climbing, the material is right of the feed, seen from above
    right = np.cross(feed, [0.0, 0.0, 1.0])
    into = right if direction == "down" else -right
    one, other = cuts(ready)
    np.testing.assert_allclose(ready.task.force.values[one, :3], real_force(feed, into), rtol=2e-3, atol=0.2)
    image = mirrored(axes)
    wanted = real_force(image(feed), image(into))
    np.testing.assert_allclose(ready.task.force.values[other, :3], wanted, rtol=2e-3, atol=0.2)
    assert ("(mirrored)" in " ".join(one.message for one in ready.findings)) == (axes in ("X", "Y", "XZ"))


@pytest.mark.parametrize(("dialect", "mirror", "axes"), MIRRORS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_stated_wall_is_that_of_the_programmed_side(tmp_path, dialect, mirror, axes, side):
    """The goal lies off the material by what the tool is too thick."""
    more = f"tool_errors: {{1: {{radius: 0.1, walls: {{others: {side}}}}}}}"
    path = program(tmp_path, mirror, dialect, (-80.0, 60.0), more=more)
    ready = prepare(Request(path, force="0,0,-20@base"))
    into = np.cross([-0.8, 0.6, 0.0], [0.0, 0.0, 1.0 if side == "right" else -1.0])
    rows = np.array(cuts(ready))
    moved = 1e3 * ready.task.known_error.at(rows, ready.task.wanted[rows])
    np.testing.assert_allclose(moved, 0.1 * np.array([into, mirrored(axes)(into)]), atol=1e-6)


def warnings(ready, code):
    return [one for one in ready.findings if one.code == code and one.severity == "warning"]


FORCES = ["(FORCE 61 115 -22 @feed)", "(FORCE 61 0 -22 0 0 1 @feed)", "(FORCE 61 0 -22 1 0 0 @feed)"]


@pytest.mark.parametrize("comment", FORCES)
def test_a_stated_force_across_a_mirrored_feed_needs_review(tmp_path, comment):
    path = program(tmp_path, ["G51.1 Y40."], comment=comment)
    (found,) = warnings(prepare(Request(path, force="")), "FRC037")
    lines = [k for k, line in enumerate(path.read_text().splitlines(), 1) if line.startswith("G1 ")]
    assert f"(line {lines[1]})" in found.message
    assert postproc.compensate(path, force=True, dry_run=True).exit == 3


@pytest.mark.parametrize("comment", ["(FORCE 61 0 -22 0 1 0 @feed)", "(FORCE 61 115 -22 @base)"])
def test_a_force_that_no_mirror_reverses_is_clear(tmp_path, comment):
    path = program(tmp_path, ["G51.1 Y40."], comment=comment)
    assert not warnings(prepare(Request(path, force="")), "FRC037")


@pytest.mark.parametrize("mirror", [["G51.1 X5. Y40."], ["G51.1 Z10."], ["G51.1 X5.", "G50.1 X0."]])
def test_a_force_on_the_programmed_side_is_clear(tmp_path, mirror):
    path = program(tmp_path, mirror, comment=FORCES[0])
    assert not warnings(prepare(Request(path, force="")), "FRC037")


def test_every_statement_in_the_feed_frame_counts(tmp_path):
    path = program(tmp_path / "cell", ["G51.1 Y40."], more="force: 61,115,-22@feed")
    assert warnings(prepare(Request(path, force="")), "FRC037")
    path = program(tmp_path / "option", ["G51.1 Y40."])
    assert warnings(prepare(Request(path, force="61,115,-22@feed")), "FRC037")
    lines = [k for k, line in enumerate(path.read_text().splitlines(), 1) if line.startswith("G1 ")]
    rows = "".join(f"{line},61,115,-22,feed\n" for line in lines)
    path.with_name("p.force.csv").write_text("line,fx,fy,fz,frame\n" + rows)
    assert warnings(prepare(Request(path, force="")), "FRC037")


@pytest.mark.parametrize("tilt", [{"c": 150.0}, {"c": 140.0}])
def test_a_tool_oblique_to_the_mirror_leaves_the_side_open(tmp_path, tilt):
    """Inclined towards Y, and mirrored there, it has no known side; mirrored across its inclination it has."""
    more = "process: milling.yaml"
    for axis, known in (("Y", False), ("X", True)):
        path = program(tmp_path / axis, [f"G51.1 {axis}5."], more=more, **tilt)
        (path.parent / "milling.yaml").write_text(PROCESS.format(direction="down"))
        ready = prepare(Request(path, force=""))
        one, other = cuts(ready)
        assert ready.task.force.carries[one]
        assert ready.task.force.carries[other] == known
        assert bool(warnings(ready, "FRC036")) == (not known)
        errors = "tool_errors: {1: {radius: 0.1, walls: {others: left}}}"
        path = program(tmp_path / axis, [f"G51.1 {axis}5."], more=errors, **tilt)
        ready = prepare(Request(path, force="0,0,-20@base"))
        assert bool(warnings(ready, "FRC036")) == (not known)
        moved = ready.task.known_error.at(np.array(cuts(ready)), ready.task.wanted[np.array(cuts(ready))])
        assert (np.linalg.norm(moved, axis=1) > 0).tolist() == [True, known]


def test_a_learnt_side_of_walls_is_that_of_the_programmed_side():
    """Feeds along x, the second one mirrored in Y: its wall lies at the other side, and is the same in the program."""
    rows = np.array([0, 1])
    points = SimpleNamespace(
        row=rows,
        share=np.ones(2),
        spindle=np.tile([0.0, 0.0, -1.0], (2, 1)),
        normal=np.array([[0.0, 1.0, 0.0], [0.0, -1.0, 0.0]]),  # out of the material at y < 0, and mirrored
    )
    path = SimpleNamespace(tangent=lambda rows, share: np.tile([1.0, 0.0, 0.0], (len(rows), 1)))
    operations = SimpleNamespace(names=("OP",), which=np.zeros(2, int))
    ones = np.ones(2, int)
    found = measured_walls(points, path, operations, ones, (), np.array([1, -1]), ones > 0)
    assert found.sides == {"OP": 1}  # right of a feed along x, seen from above, is y < 0
