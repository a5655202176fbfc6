"""$ORI_TYPE and $CIRC_TYPE: how they are read, and that what is run under them is what is corrected.

What the controller does is worked out here on its own: by a reader of a few lines, with scipy's rotations, and with
MuJoCo's arm.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from motions import motions
from path_cases import circle
from plant import Plant, kr270
from scipy.spatial.transform import Rotation, Slerp

from postproc.base.document import Document
from postproc.base.geometry import Poses, rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.cell import frames_of, load_cell
from postproc.compensation.desired_path import DesiredPath
from postproc.compensation.path_error import PathSegments
from postproc.languages.krl import KrlDialect
from postproc.model import StiffnessModel
from postproc.process import wrenches
from postproc.process.force_turning import Turning
from postproc.robot.axis_track import follow_axes, nominal_flange
from postproc.robot.inverse import inverse
from postproc.robot.orientation_modes import as_run
from postproc.toolpath import ArcFrame, Arcs, Kind, OrientationMode

KRL = KrlDialect()
LIN = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
VAR, CONSTANT, JOINT, UNKNOWN = OrientationMode
BASE, PATH, OTHER = ArcFrame


def read(text: str, data: str = ""):
    texts = ["DEF part()\nBAS(#INITMOV,0)\n" + text + "END\n", f"DEFDAT part\n{data}ENDDAT\n"]
    names = ("part.src", "part.dat")
    documents = [Document(Path(n), t.encode()) for n, t in zip(names, texts, strict=True)]
    return KRL.read(tuple(documents[: 2 if data else 1]))


LDAT = "DECL LDAT L1={VEL 1,ACC 100,APO_DIST 5,ORI_TYP #CONSTANT,CIRC_TYP #PATH}\nDECL LDAT L2={VEL 1,APO_DIST 5}\n"
FDAT = "DECL FDAT F1={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE}\n"


@pytest.mark.parametrize(
    ("text", "orientation", "frame"),
    [
        (LIN, [VAR], [BASE]),
        ("$ORI_TYPE=#CONSTANT\n" + LIN + "$ORI_TYPE = #VAR\n" + LIN, [CONSTANT, VAR], [BASE, BASE]),
        ("$ori_type=#joint ;why\n" + LIN + LIN, [JOINT, JOINT], [BASE, BASE]),
        ("$ORI_TYPE=#CONSTANT\nBAS(#INITMOV,0)\n" + LIN, [VAR], [BASE]),
        ("$CIRC_TYPE=#PATH\n" + LIN + "$CIRC_TYPE=#BASE\n" + LIN, [VAR, VAR], [PATH, BASE]),
        ("$ORI_TYPE=#IGNORE\n" + LIN, [UNKNOWN], [BASE]),
        ("$ORI_TYPE=WAY\n" + LIN, [UNKNOWN], [BASE]),
        ("$CIRC_MODE.AUX_PT.ORI=#IGNORE\n" + LIN, [VAR], [OTHER]),
        ("SLIN {X 1,Y 2,Z 3,A 4,B 5,C 6} WITH $ORI_TYPE=#CONSTANT\n" + LIN, [CONSTANT, VAR], [BASE, BASE]),
        (
            f"SPLINE WITH $ORI_TYPE=#CONSTANT\nS{LIN}S{LIN[:-1]} WITH $ORI_TYPE=#VAR\nENDSPLINE\n{LIN}",
            [CONSTANT, VAR, VAR], [BASE] * 3,
        ),
        ("LDAT_ACT=L1\nFDAT_ACT=F1\nBAS(#CP_PARAMS,1)\n" + LIN, [CONSTANT], [PATH]),
        ("$ORI_TYPE=#JOINT\nLDAT_ACT=L2\nFDAT_ACT=F1\nBAS(#CP_PARAMS,1)\n" + LIN, [JOINT], [BASE]),
        ("LDAT_ACT=L3\nFDAT_ACT=F1\nBAS(#CP_PARAMS,1)\n" + LIN, [UNKNOWN], [OTHER]),
        ("LDAT_ACT=L1\nFDAT_ACT=F1\nBAS(#PTP_PARAMS,1)\n" + LIN, [VAR], [BASE]),
        ("SLIN {X 1,Y 2,Z 3,A 4,B 5,C 6} WITH $ORI_TYPE=SORI_TYP(L1), $CIRC_TYPE=SCIRC_TYP(L1)\n", [CONSTANT], [PATH]),
        ("IF $IN[1] THEN\n$ORI_TYPE=#CONSTANT\nENDIF\n" + LIN, [UNKNOWN], [BASE]),
        ("INT I\nFOR I=1 TO 2\n" + LIN + "$ORI_TYPE=#CONSTANT\nENDFOR\n", [VAR, CONSTANT], [BASE, BASE]),
        (
            "$ORI_TYPE=#CONSTANT\n" + LIN * 70 + "$ORI_TYPE=#VAR\n" + LIN * 70,
            [CONSTANT] * 70 + [VAR] * 70, [BASE] * 140,
        ),
    ],
)  # fmt: skip
def test_what_the_program_sets_is_read(text: str, orientation: list[int], frame: list[int]) -> None:
    path = read(text, LDAT + FDAT).toolpath
    assert path.orientation_control.mode.tolist() == orientation
    assert path.arcs.frame.tolist() == frame


def test_a_program_that_sets_nothing_unusual_forgets_nothing() -> None:
    """What is not known to leave it can only leave it as it is everywhere."""
    text = "IF $IN[1] THEN\nBAS(#INITMOV,0)\n$ORI_TYPE=#VAR\n$CIRC_TYPE = #BASE\nENDIF\n$BASE=BASE_DATA[1]\n"
    path = read(text + "$TOOL=TOOL_DATA[1]\n" + LIN).toolpath
    assert path.orientation_control.mode.tolist() == [VAR]
    assert not path.constraints.refused


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("$ORI_TYPE=#JOINT\n" + LIN, ["KRL031"]),
        ("$ORI_TYPE=#JOINT\nPTP {X 1,Y 2,Z 3,A 4,B 5,C 6}\n", []),
        ("$ORI_TYPE=#JOINT\nSPLINE\nSPL {X 1,Y 2,Z 3,A 4,B 5,C 6}\nENDSPLINE\n", []),
        ("$ORI_TYPE=#JOINT\n" + LIN * 70, ["KRL031"] * 70),
        ("$ORI_TYPE=#IGNORE\nSPLINE\nSPL {X 1,Y 2,Z 3,A 4,B 5,C 6}\nENDSPLINE\n", ["KRL031"]),
        ("$ORI_TYPE=#CONSTANT\n" + LIN, []),
        (LIN + "$CIRC_TYPE=#PATH\nCIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6}\n", []),
        (LIN + "$CIRC_TYPE=#PATHS\nCIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6}\n" + LIN, ["KRL031"]),
        (
            LIN + "$CIRC_TYPE=#PATH\n$ORI_TYPE=#CONSTANT\nCIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6}\n",
            ["KRL031"],
        ),
    ],
)
def test_what_is_not_corrected_is_told(text: str, refused: list[str]) -> None:
    path = read(text).toolpath
    assert [one.code for one in path.constraints.refused.values()] == refused


def test_neither_what_keeps_an_orientation_nor_what_gives_it_is_turned() -> None:
    path = read(LIN + LIN + "$ORI_TYPE=#CONSTANT\n" + LIN + LIN + "$ORI_TYPE=#VAR\n" + LIN).toolpath
    assert path.constraints.orientation_programmed.tolist() == [True, False, False, False, True]


def test_what_leaves_out_angles_behind_an_orientation_that_is_kept() -> None:
    """They are those of the motion before; where its text says others than those that it keeps, they are not known."""
    head = LIN + "$ORI_TYPE=#CONSTANT\n"
    path = read(head + "LIN {X 2,Y 2,Z 3,A 4,B 5,C 6}\nLIN {X 3}\n").toolpath
    assert path.known.all()
    for text in ("LIN {X 2,Y 2,Z 3,A 14,B 5,C 6}\n", "LIN {X 2,Y 2,Z 3,A 14,B 5,C 6}\n" * 70):
        path = read(head + text + "$ORI_TYPE=#VAR\nLIN {X 3}\nLIN {X 3,Y 2,Z 3,A 4,B 5,C 6}\n").toolpath
        assert not path.known[-2]
        assert np.isfinite(path.position[-2]).all()
        assert path.known[-1]
        # the place where it is is known to an arc
        path = read(head + text + "$ORI_TYPE=#VAR\nCIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6}\n").toolpath
        assert path.known[-1]


# what is run


def framed(path, base, tool, robot=None, start=None):
    n = len(path)
    bases = Poses(np.tile(base.rotation, (n, 1, 1)), np.tile(base.position, (n, 1)))
    tools = Poses(np.tile(tool.rotation, (n, 1, 1)), np.tile(tool.position, (n, 1)))
    return as_run(path, bases, tools, robot or kr270(), start, "part.src")


TURNED = Poses(rotation_from_abc(np.radians([30.0, 20.0, 10.0])), np.array([1.5, 0.1, 0.5]))
TILTED = Poses(rotation_from_abc(np.radians([0.0, 30.0, 5.0])), np.array([0.1, 0.0, 0.2]))


def test_an_orientation_is_kept_until_another_is_run() -> None:
    head = "$ORI_TYPE=#VAR\nLIN {X 1,Y 0,Z 0,A 10,B 20,C 30}\n$ORI_TYPE=#CONSTANT\n"
    text = head + "LIN {X 2,Y 0,Z 0,A 90,B 0,C 0}\nLIN {X 3,Y 0,Z 0,A 10.0001,B 20,C 30}\n"
    text += "PTP {X 3,Y 0,Z 0,A 50,B 20,C 30}\nLIN {X 4,Y 0,Z 0,A 0,B 0,C 180}\n"
    path = read(text).toolpath
    run, findings = framed(path, TURNED, TILTED)
    expected = rotation_from_abc(np.radians([[10, 20, 30]] * 3 + [[50, 20, 30]] * 2))
    np.testing.assert_allclose(run.rotation, expected, atol=1e-12)
    np.testing.assert_array_equal(run.programmed_rotation, path.rotation)
    np.testing.assert_array_equal(path.programmed_rotation, path.rotation)
    (finding,) = findings
    assert (finding.code, finding.line) == ("KIN011", 6)
    assert "2 motions" in finding.message


def test_the_flange_keeps_its_orientation_through_a_change_of_base_and_tool() -> None:
    text = "$BASE={X 0,Y 0,Z 0,A 90,B 0,C 0}\nLIN {X 1,Y 0,Z 0,A 10,B 20,C 30}\n$ORI_TYPE=#CONSTANT\n"
    text += (
        "$BASE={X 5,Y 0,Z 0,A 0,B 90,C 0}\n$TOOL={X 0,Y 0,Z 9,A 0,B 0,C 45}\nLIN {X 2,Y 0,Z 0,A 0,B 0,C 0}\n"
    )
    path = read("$TOOL=$NULLFRAME\n" + text).toolpath
    frames = [path.frames[i].pose for pair in zip(path.base, path.tool, strict=True) for i in pair]
    base, tool = (Poses(np.array([f.rotation for f in part]), np.array([f.position for f in part]))
                  for part in (frames[::2], frames[1::2]))  # fmt: skip
    run, _ = as_run(path, base, tool, kr270(), None, "part.src")
    turn = Rotation.from_euler("ZYX", [90, 0, 0], degrees=True)
    flange = turn * Rotation.from_euler("ZYX", [10, 20, 30], degrees=True)
    other = Rotation.from_euler("ZYX", [0, 90, 0], degrees=True).inv() * flange
    other = other * Rotation.from_euler("ZYX", [0, 0, 45], degrees=True)
    np.testing.assert_allclose(run.rotation[1], other.as_matrix(), atol=1e-12)


def test_an_axis_motion_or_the_start_gives_the_orientation_or_nothing_does() -> None:
    q = np.radians([[0.0, -80.0, 110.0, 0.0, 60.0, 20.0]])
    expected = TURNED.rotation.T @ nominal_flange(kr270(), q).rotation[0] @ TILTED.rotation
    constant = "$ORI_TYPE=#CONSTANT\n" + LIN + LIN
    run, _ = framed(read("PTP {A1 0,A2 -80,A3 110,A4 0,A5 60,A6 20}\n" + constant).toolpath, TURNED, TILTED)
    np.testing.assert_allclose(run.rotation[1:], [expected] * 2, atol=1e-12)
    run, _ = framed(read(constant).toolpath, TURNED, TILTED, start=q[0])
    np.testing.assert_allclose(run.rotation, [expected] * 2, atol=1e-12)
    for text in (constant, "PTP XP7\n" + constant):
        run, _ = framed(read(text).toolpath, TURNED, TILTED)
        assert np.isnan(run.rotation[-2:]).all()
        assert [run.constraints.refused[len(run) - k].code for k in (1, 2)] == ["KIN010"] * 2
    plain = read(LIN).toolpath
    assert framed(plain, TURNED, TILTED)[0] is plain


def test_an_arc_turns_what_is_kept_along() -> None:
    text = "LIN {X 0,Y 0,Z 0,A 10,B 20,C 30}\n$ORI_TYPE=#CONSTANT\n$CIRC_TYPE=#PATH\n"
    for _ in range(5):
        text += "CIRC {X 5,Y 5,Z 0},{X 10,Y 0,Z 0,A 0,B 0,C 0}\nLIN {X 12,Y 0,Z 0,A 0,B 0,C 0}\n"
        text += "CIRC {X 12,Y 6,Z 2},{X 12,Y 12,Z 12,A 7,B 0,C 0},CA 45\nLIN {X 0,Y 0,Z 0,A 0,B 0,C 0}\n"
    path = read(text).toolpath
    run, _ = framed(path, TURNED, TILTED)
    kept = Rotation.from_euler("ZYX", [10, 20, 30], degrees=True)
    for row in range(1, len(path)):
        if np.isfinite(path.arcs.sweep[row]):
            kept = Rotation.from_rotvec(path.arcs.sweep[row] * path.arcs.normal[row]) * kept
        np.testing.assert_allclose(run.rotation[row], kept.as_matrix(), atol=1e-12)


@pytest.mark.parametrize(
    "text",
    [
        "$ORI_TYPE=#IGNORE\n" + LIN + "$ORI_TYPE=#CONSTANT\n",
        LIN + "$ORI_TYPE=#CONSTANT\n$CIRC_TYPE=#PATHS\nCIRC {X 5,Y 9,Z 3},{X 7,Y 2,Z 3,A 4,B 5,C 6}\n",
        LIN + "$ORI_TYPE=#CONSTANT\n$CIRC_TYPE=#PATH\nCIRC {X 1,Y 2,Z 4},{X 1,Y 2,Z 5,A 4,B 5,C 6}\n",
    ],
)
def test_behind_an_orientation_that_is_not_known_none_is(text: str) -> None:
    run, _ = framed(read(text + LIN + "$ORI_TYPE=#VAR\n" + LIN).toolpath, TURNED, TILTED)
    assert np.isnan(run.rotation[-2]).all()
    assert run.constraints.refused[len(run) - 2].code == "KIN010"
    assert np.isfinite(run.rotation[-1]).all()


# on the way


SWEEP = 130.0


def part_circle(frame: ArcFrame, turn: float = 40.0):
    """A part of a circle in a base that is turned, and its wanted way."""
    rotation = rotation_from_abc(np.radians([[0.0, 0.0, 180.0], [0.0, 0.0, 180.0], [turn, 10.0, 170.0]]))
    angle = SWEEP * DEG
    end = [0.1 - 0.1 * np.cos(angle), 0.1 * np.sin(angle), 0]
    target = Poses(rotation, np.array([[0.0, 0, 0.1], [0.0, 0, 0], end]))
    none = np.full(3, np.nan)
    path = motions(
        target,
        kind=[Kind.LIN, Kind.LIN, Kind.CIRC],
        arcs=Arcs(
            centre=np.array([none, none, [0.1, 0, 0]]),
            normal=np.array([none, none, [0, 0, -1.0]]),
            sweep=np.array([np.nan, np.nan, angle]),
            frame=np.full(3, frame),
        ),
    )
    n = len(path)
    base = Poses(np.tile(TURNED.rotation, (n, 1, 1)), np.tile(TURNED.position, (n, 1)))
    tool = Poses(np.tile(np.eye(3), (n, 1, 1)), np.tile([0, 0, 0.2], (n, 1)))
    wanted = base @ target
    start = np.radians([0.0, -90.0, 110.0, 0.0, 40.0, 0.0])
    track = follow_axes(kr270(), path, wanted @ tool.inverse(), start, base, tool)
    return path, track, DesiredPath.of(path, wanted, base, tool, kr270(), track)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.9, 1.0])
def test_the_tool_turns_with_the_path(share: float) -> None:
    """In the frame of the path it turns evenly; in a base, beside that, with the tangent."""
    for frame in (BASE, PATH):
        _, _, ways = part_circle(frame)
        found = ways.at(np.array([2]), np.array([share])).rotation[0]
        first = Rotation.from_euler("ZYX", [0, 0, 180], degrees=True)
        last = Rotation.from_euler("ZYX", [40, 10, 170], degrees=True)
        tangents = [Rotation.from_euler("Z", -angle, degrees=True) for angle in (0.0, SWEEP, SWEEP * share)]
        if frame == PATH:
            first, last = (one.inv() * other for one, other in zip(tangents[:2], (first, last), strict=True))
        # scipy turns evenly about an axis in the first one's frame, which is the same rotation
        expected = Slerp([0, 1], Rotation.concatenate([first, last]))(share)
        if frame == PATH:
            expected = tangents[2] * expected
        expected = TURNED.rotation @ expected.as_matrix()
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_a_corrected_arc_turns_the_tool_as_the_wanted_one() -> None:
    _, _, ways = part_circle(PATH)
    row, full = np.array([2]), np.array([0.0, 0.5, 1.0])
    begin, via, end = (ways.at(row, full[[k]]) for k in range(3))
    piece = PathSegments.round(row, full[:1], full[2:], begin, via, end, np.full((1, 3), np.nan))
    for share in (0.1, 0.5, 0.8):
        here = piece.at(np.array([share]), np.array([True]))
        there = ways.at(row, np.array([share]))
        np.testing.assert_allclose(here.rotation, there.rotation, atol=1e-9)
        np.testing.assert_allclose(here.position, there.position, atol=1e-9)
        assert np.abs(piece.at(np.array([share])).rotation - there.rotation).max() > 0.01


@pytest.mark.slow
def test_the_axes_follow_an_arc_that_turns_the_tool() -> None:
    _, track, ways = part_circle(PATH, 0.0)
    q = track.q[1]
    for share in np.linspace(0, 1, 400)[1:]:
        pose = ways.at(np.array([2]), np.array([share])) @ Poses(np.eye(3), np.array([0, 0, 0.2])).inverse()
        q = inverse(kr270().nominal, pose, track.branch[[2]], q[None]).q[0]
    np.testing.assert_allclose(q, track.q[2], atol=1e-6)


@pytest.mark.parametrize("frame", [BASE, PATH])
def test_a_force_along_the_spindle_turns_with_it(tmp_path, frame) -> None:
    """FORCE 0 0 100 @feed pushes back along the spindle, wherever that points on the way."""
    (tmp_path / "cell.yaml").write_text(CELL)
    switch = f"$CIRC_TYPE=#{frame.name}"
    arc = ["LIN {X 0,Y 0,Z 0,A 0,B 30,C 180}", ";FORCE 0 0 100 @feed", "LIN {X 0,Y 50,Z 0,A 0,B 30,C 180}"]
    arc.append("CIRC {X 50,Y 100,Z 0},{X 100,Y 50,Z 0,A -180,B 30,C 180}")
    source = tmp_path / "part.src"
    source.write_text("\n".join([*HEAD, switch, *arc, "END"]))
    path, cell = (
        KRL.read((Document(source, source.read_bytes()),)).toolpath,
        load_cell(tmp_path / "cell.yaml"),
    )
    force = wrenches(source, path, frames_of(cell, path, source), cell, "")
    first = Rotation.from_euler("ZYX", [0, 30, 180], degrees=True).as_matrix()[:, 2]
    last = Rotation.from_euler("ZYX", [-180, 30, 180], degrees=True).as_matrix()[:, 2]
    for share in (0.0, 0.25, 0.5, 1.0):
        spindle = Rotation.from_euler("Z", -180 * share, degrees=True).apply(first)
        if frame == BASE:
            spindle = (1 - share) * first + share * last  # both ends are the same force in the base's axes
        found = force.along(np.array([len(path) - 1]), np.array([share]))[0, :3]
        np.testing.assert_allclose(found, -100 * spindle, atol=1e-9)


def test_a_force_in_the_tool_turns_with_it() -> None:
    path, _, ways = part_circle(PATH)
    base = np.tile(TURNED.rotation, (3, 1, 1))
    frames = Turning(
        np.array([False, False, True]), np.zeros(3, bool), np.array([False, False, True]), None, base,
        path.rotation, lambda rows: path.arcs.turn(rows, base[rows]),
    )  # fmt: skip
    force = np.array([100.0, 20, -50, 1, 2, 3])
    row = np.array([2])

    def in_robot(share: float) -> np.ndarray:
        rotation = ways.at(row, np.array([share])).rotation[0]
        return np.concatenate([rotation @ force[:3], rotation @ force[3:]])

    ends = [in_robot(share)[None] for share in (0.0, 1.0)]
    for share in (0.0, 0.3, 0.5, 1.0):
        np.testing.assert_allclose(frames.along(row, np.array([share]), *ends)[0], in_robot(share), atol=1e-9)


# from the command line, on another engine

CELL = """robot: kuka_kr270
tools:
  1: {x: 120, y: 0, z: 250, a: 0, b: 30, c: 0, axis: +z}
bases:
  1: {x: 1500, y: -200, z: 600, a: 0, b: 0, c: 0}
start: [0, -90, 90, 0, 45, 0]
tolerance: 0.02
"""
HEAD = ["DEF part()", "BAS(#INITMOV,0)", "$BASE=BASE_DATA[1]", "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 110,A4 0,A5 40,A6 0}", "$VEL.CP=0.05"]  # fmt: skip
APPROACH = ["LIN {X 0,Y 0,Z 50,A 0,B 0,C 180}", "LIN {X 0,Y 0,Z 0,A 5,B 10,C 170}"]
CUT = [
    "LIN {X 100,Y 0,Z -2,A 40,B 0,C 180} C_DIS",
    "LIN {X 200,Y 0,Z -2,A 0,B -20,C 180} C_DIS",
    "CIRC {X 250,Y 50,Z -2},{X 200,Y 100,Z -2,A 90,B 0,C 180} C_DIS",
    "LIN {X 100,Y 100,Z -2,A 0,B 0,C 150}",
]
TAIL = [";FORCE OFF", "LIN {X 100,Y 100,Z 50,A 0,B 0,C 180}", "END"]
FORCE = [";FORCE -360 50 560 @base"]
KEPT = np.radians([5.0, 10.0, 170.0])


def numbers(line: str) -> np.ndarray:
    """X..C of the last aggregate of a line."""
    words = dict(re.findall(r"([XYZABC]) *(-?[\d.]+)", line.rpartition("{")[2]))
    return np.array([float(words[key]) for key in "XYZABC"])


@pytest.mark.slow
@pytest.mark.parametrize("own", [True, False], ids=["kept from a LIN", "kept from the PTP"])
def test_a_cut_that_keeps_its_orientation_is_corrected_in_its_place(compensate, job, own) -> None:
    """Written turns do nothing: on MuJoCo's arm, with the orientation that is kept, the tool is where it is meant."""
    job.cell(CELL)
    switch = ["$ORI_TYPE=#CONSTANT"]
    lines = [*HEAD, *APPROACH, *switch] if own else [*HEAD, *switch, *APPROACH]
    source = job.write([*lines, *FORCE, *CUT, *TAIL])
    done = compensate(source, "--force", "--json", "-")
    assert done.code in (0, 3), done.err
    assert done.json["corrected"] == len(CUT)
    assert [f["code"] for f in done.json["findings"]].count("KIN011") == 1
    (stays,) = [
        f for f in done.json["findings"] if f["code"] == "COR019"
    ]  # the turn of the deflected tool remains
    off = max(done.json[key]["max"] for key in ("angle_after_deg", "angle_way_after_deg"))
    assert f"rotated by {off:.4f} deg" in stays["message"]
    assert done.code == 3

    robot = kr270()
    plant = Plant.of(StiffnessModel.from_robot(robot))
    tool = Poses(rotation_from_abc(np.radians([0.0, 30.0, 0.0])), np.array([120, 0, 250]) * MM)
    base = Poses(np.eye(3), np.array([1500, -200, 600]) * MM)
    ready = np.radians([0.0, -90.0, 110.0, 0.0, 40.0, 0.0])
    kept = rotation_from_abc(KEPT) if own else nominal_flange(robot, ready[None]).rotation[0] @ tool.rotation
    force = np.array([-360.0, 50, 560, 0, 0, 0])

    def tip(point: np.ndarray, wrench: np.ndarray) -> np.ndarray:
        command = base @ Poses(kept, point * MM) @ tool.inverse()
        q = inverse(
            robot.nominal, Poses(command.rotation[None], command.position[None]), np.array([2]), ready[None]
        )
        return plant.rest(q.q[0], wrench, tool).position

    written = [line for line in job.output.read_text().splitlines() if re.match(r"LIN|CIRC", line)]
    cut = [line for line in written if line.endswith(("C_DIS", "C 150}"))]
    own_lines = [next(line for line in cut if text_angles(line) == text_angles(old)) for old in CUT]
    for old in CUT:  # the last line with its angles is the motion itself
        own_lines[CUT.index(old)] = [line for line in cut if text_angles(line) == text_angles(old)][-1]
    for old, new in zip(CUT, own_lines, strict=True):
        goal = tip(numbers(old)[:3], np.zeros(6))
        before, after = (np.linalg.norm(tip(numbers(line)[:3], force) - goal) for line in (old, new))
        assert before > 0.2 * MM
        assert after < 0.02 * MM


def text_angles(line: str) -> str:
    return line.rpartition("{")[2].partition("A ")[2].partition("}")[0]


@pytest.mark.slow
def test_under_var_the_same_cut_is_turned(compensate, job) -> None:
    """What the test above would miss if $ORI_TYPE were not looked at."""
    job.cell(CELL)
    source = job.write([*HEAD, *APPROACH, *FORCE, *CUT, *TAIL])
    assert compensate(source, "--force", "-q").code in (0, 3)
    written = job.output.read_text()
    assert not all(text_angles(line) in written for line in CUT)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("switch", "corrected"),
    [("$ORI_TYPE=#JOINT", 0), ("$CIRC_TYPE=#PATH", 4), ("$ORI_TYPE=#VAR", 4), ("$ORI_TYPE=#IGNORE", 0)],
)
def test_what_is_corrected_under_each(compensate, job, switch, corrected) -> None:
    job.cell(CELL)
    turned = [line.replace("A 90,B 0,C 180", "A -20,B 0,C 180") for line in CUT]
    source = job.write([*HEAD, *APPROACH, switch, *FORCE, *turned, *TAIL])
    done = compensate(source, "--force", "--json", "-")
    assert done.code in (0, 3), done.err
    assert done.json["corrected"] == corrected
    told = {f["code"] for f in done.json["findings"]}
    assert bool({"KRL031", "KIN010"} & set(told)) == (corrected == 0)


def test_ways_without_an_unusual_turn_are_as_they_were() -> None:
    task = circle()
    rows, share = np.array([1, 2, 3]), np.array([0.3, 0.6, 0.9])
    assert not task.toolpath.arcs.turns_along.any()
    assert np.array_equal(task.toolpath.arcs.turn(rows, np.eye(3)), np.zeros((3, 3)))
    assert np.isfinite(task.desired_path.at(rows, share).rotation).all()
    assert DEG > 0
