"""The cell file: every key in SI, every mistake with its place; the frames of every motion."""

from pathlib import Path

import numpy as np
import pytest
from motions import toolpath_of

from postproc.base.findings import Finding, Refusal
from postproc.base.geometry import Poses
from postproc.cell import Cell, Tool, find_cell, frames_of, load_cell
from postproc.toolpath import FrameRef, Kind, Toolpath

FULL = """\
robot: kuka_kr270
robot_base: {x: 100, y: 0, z: 50, a: 90, b: 0, c: 0}
tools:
  1: {x: 0, y: 0, z: 200, a: 0, b: 90, c: 0, axis: +x, mass: 35, com: [0, 0, 120]}
  2: {x: 1, y: 2, z: 3, axis: [0, 3, -4]}
bases:
  1: {x: 1200, y: -400, z: 500, a: 0, b: 0, c: 180}
force: 0,360,560@base
correct: absolute
start: [0, -90, 90, 0, 90, 180]
orientation: {a: 0, b: 0, c: 180}
tolerance: 0.05
tolerance_deg: 0.02
max_correction: 8
min_segment: 0.5
max_growth: 3
controller: {absolute_accuracy: true, gravity_compensated: false}
dialect: {integer_words: um}
"""


TOUCHED = "correct: touched_off\ncontroller: {absolute_accuracy: false}\n"


def write(folder: Path, text: str) -> Path:
    path = folder / "cell.yaml"
    path.write_text(text)
    return path


def refused(action) -> list[Finding]:
    with pytest.raises(Refusal) as caught:
        action()
    return list(caught.value.findings)


def toolpath(base, tool, frames, position=None, kind=Kind.LIN) -> Toolpath:
    n = len(base)
    where = np.zeros((n, 3)) if position is None else np.asarray(position, float)
    return toolpath_of(
        kind=np.full(n, kind),
        position=where,
        rotation=np.tile(np.eye(3), (n, 1, 1)),
        axes=np.full((n, 6), np.nan),
        feed=np.full(n, 0.01),
        base=np.asarray(base),
        tool=np.asarray(tool),
        line=np.arange(n) + 1,
        frames=tuple(frames),
    )


def test_every_key_is_read_in_si(tmp_path):
    cell = load_cell(write(tmp_path, FULL))
    assert cell.robot == "kuka_kr270"
    assert np.allclose(cell.robot_base.position, [0.1, 0, 0.05])
    assert np.allclose(cell.robot_base.rotation @ [1, 0, 0], [0, 1, 0])
    assert sorted(cell.tools) == [1, 2]
    tool = cell.tools[1]
    assert np.allclose(tool.pose.position, [0, 0, 0.2])
    assert np.allclose(tool.pose.rotation @ [1, 0, 0], [0, 0, -1])
    assert tool.axis.tolist() == [1, 0, 0]
    assert tool.mass == 35
    assert tool.com is not None
    assert np.allclose(tool.com, [0, 0, 0.12])
    assert np.allclose(cell.tools[2].axis, [0, 0.6, -0.8])
    assert cell.tools[2].mass is None
    assert np.allclose(cell.bases[1].position, [1.2, -0.4, 0.5])
    assert (cell.force, cell.force_line, cell.process) == ("0,360,560@base", 8, None)
    assert cell.correct == "absolute"
    assert cell.start is not None
    assert np.allclose(cell.start, np.array([0, -0.5, 0.5, 0, 0.5, 1]) * np.pi)
    assert cell.orientation is not None
    assert np.allclose(cell.orientation, [0, 0, np.pi])
    assert cell.tolerance == pytest.approx(5e-5)
    assert cell.tolerance_angle == pytest.approx(np.radians(0.02))
    assert (cell.max_correction, cell.min_segment) == (pytest.approx(8e-3), pytest.approx(5e-4))
    assert cell.max_growth == 3
    assert (cell.controller.absolute_accuracy, cell.controller.gravity_compensated) == (True, False)
    assert cell.dialect_options == {"integer_words": "um"}


def test_defaults(tmp_path):
    cell = load_cell(write(tmp_path, "robot: r\ntools: {1: {x: 0, y: 0, z: 0}}\nprocess: mill.yaml\n"))
    assert np.array_equal(cell.robot_base.rotation, np.eye(3))
    assert cell.tools[1].axis.tolist() == [0, 0, 1]
    assert (cell.bases, cell.force, cell.process, cell.correct) == ({}, None, "mill.yaml", "process")
    assert cell.start is None
    assert cell.orientation is None
    assert (cell.tolerance, cell.max_correction) == (pytest.approx(2e-5), pytest.approx(1e-2))
    assert cell.tolerance_angle == pytest.approx(np.radians(0.01))
    assert (cell.min_segment, cell.max_growth) == (pytest.approx(1e-3), 2.0)
    assert not cell.controller.absolute_accuracy
    assert cell.dialect_options == {}
    assert (cell.cycle_ms, cell.force_ramp, cell.temperature) == (12.0, None, None)
    assert (cell.force_ci95, cell.force_vector, cell.touch_points) == (None, None, {})
    assert cell.tools[1].diameter is None


def test_what_is_corrected_and_what_the_controller_does(tmp_path):
    text = FULL.replace("correct: absolute", "correct: touched_off").replace(
        "com: [0, 0, 120]", "com: [0, 0, 120], diameter: 12"
    )
    text = text.replace("gravity_compensated: false", "gravity_compensated: false, cycle_ms: 4")
    text += "force_ramp: 6\ntemperature: 24.5\n"
    cell = load_cell(write(tmp_path, text + "touch_points: [[0, 0, 0], [900, 0, 0], [0, 600, 10]]\n"))
    assert cell.correct == "touched_off"
    assert list(cell.touch_points) == [None]
    assert cell.touch_points[None].tolist() == [[0, 0, 0], [0.9, 0, 0], [0, 0.6, 0.01]]
    assert cell.touch_line == 21
    assert not cell.touch_points[None].flags.writeable
    assert (cell.cycle_ms, cell.controller.cycle_ms) == (4.0, 4.0)
    assert cell.force_ramp == pytest.approx(6e-3)
    assert (cell.temperature, cell.temperature_line) == (24.5, 20)
    assert cell.tools[1].diameter == pytest.approx(0.012)
    cell = load_cell(write(tmp_path, text + "touch_points:\n  1: [[5, 0, 0]]\n  3: [[0, 0, 0], [0, 0, 7]]\n"))
    assert {number: len(points) for number, points in cell.touch_points.items()} == {1: 1, 3: 2}


def test_what_is_known_of_the_force(tmp_path):
    def read(value):
        cell = load_cell(write(tmp_path, f"robot: r\nforce_ci95: {value}\n"))
        return cell.force_ci95, cell.force_vector

    assert read(0.2) == (0.2, None)
    scale, vector = read("{scale: 0.2, direction_deg: 10}")
    assert (scale, vector.direction, vector.components) == (0.2, pytest.approx(np.radians(10)), None)
    scale, vector = read("{fx: 20, fy: 0, fz: 5}")
    assert (scale, vector.direction, vector.components.tolist()) == (None, 0.0, [20, 0, 5])
    assert read("{direction_deg: 5}")[0] is None


def test_arrays_are_read_only(tmp_path):
    cell = load_cell(write(tmp_path, FULL))
    for array in (
        cell.start,
        cell.orientation,
        cell.tools[1].axis,
        cell.tools[1].com,
        cell.bases[1].position,
    ):
        assert array is not None
        assert not array.flags.writeable


@pytest.mark.parametrize(
    ("word", "axis"),
    [
        ("+x", [1, 0, 0]),
        ("-x", [-1, 0, 0]),
        ("+y", [0, 1, 0]),
        ("-y", [0, -1, 0]),
        ("-z", [0, 0, -1]),
        ("+Z", [0, 0, 1]),
    ],
)
def test_spindle_axes(tmp_path, word, axis):
    cell = load_cell(write(tmp_path, f"robot: r\ntools: {{1: {{x: 0, y: 0, z: 0, axis: {word}}}}}\n"))
    assert cell.tools[1].axis.tolist() == axis


@pytest.mark.parametrize(
    ("text", "code", "line", "words"),
    [
        ("tools: {}\n", "YML003", 1, "'robot' is missing"),
        ("robot:\n", "YML003", 1, "robot: has no value"),
        ("robot: ''\n", "YML004", 1, "robot: is empty"),
        ("robot: r\ntool: {}\n", "YML002", 2, "tool: the key is unknown; did you mean 'tools'"),
        ("robot: r\nrobot_base: {x: 0, y: 0}\n", "YML003", 2, "robot_base: the key 'z' is missing"),
        ("robot: r\nrobot_base: {x: 0, y: 0, z: 0, d: 1}\n", "YML002", 2, "robot_base.d: the key is unknown"),
        ("robot: r\nbases:\n  0: {x: 0, y: 0, z: 0}\n", "YML004", 3, "bases.0: is not a number from 1"),
        ("robot: r\nbases:\n  01: {x: 0, y: 0, z: 0}\n", "YML004", 3, "is not a number from 1"),
        ("robot: r\nbases:\n  G54: {x: 0, y: 0, z: 0}\n", "YML004", 3, "is not a number from 1"),
        (
            "robot: r\nbases:\n  1: {x: 0, y: 0, z: 0}\n  1: {x: 0, y: 0, z: 1}\n",
            "YML004",
            4,
            "bases.1 is defined twice",
        ),
        ("robot: r\nbases:\n  1: {x: 0, y: 0, z: 5 mm}\n", "YML004", 3, "'5 mm' is not a number"),
        ("robot: r\nbases:\n  1: {x: 0, y: 0, z: nan}\n", "YML004", 3, "'nan' is not a number"),
        (
            "robot: r\nbases:\n  1: {x: 0, y: 0, z: 0, axis: +z}\n",
            "YML002",
            3,
            "bases.1.axis: the key is unknown",
        ),
        ("robot: r\ntools: [1]\n", "YML004", 2, "keys and values"),
        ("robot: r\ntools: {1: {x: 0, y: 0, z: 0, axis: z}}\n", "YML004", 2, "'z' is not one of +x, -x"),
        ("robot: r\ntools: {1: {x: 0, y: 0, z: 0, axis: [0, 0, 0]}}\n", "YML004", 2, "no direction"),
        ("robot: r\ntools: {1: {x: 0, y: 0, z: 0, axis: [0, 1]}}\n", "YML004", 2, "list of 3 numbers"),
        (
            "robot: r\ntools: {1: {x: 0, y: 0, z: 0, mass: 3}}\n",
            "YML003",
            2,
            "tools.1.mass: is incomplete: 'com' is missing",
        ),
        ("robot: r\ntools: {1: {x: 0, y: 0, z: 0, com: [0, 0, 1]}}\n", "YML003", 2, "'mass' is missing"),
        (
            "robot: r\ntools: {1: {x: 0, y: 0, z: 0, mass: -1, com: [0, 0, 1]}}\n",
            "YML004",
            2,
            "-1 is not within",
        ),
        ("robot: r\nforce: 1,2,3\nprocess: p.yaml\n", "YML004", 3, "excludes 'force'"),
        ("robot: r\nforce: [1, 2, 3]\n", "YML004", 2, "a text and not a list"),
        ("robot: r\nforce: ''\n", "YML004", 2, "force: is empty"),
        ("robot: r\ncorrect: prozess\n", "YML004", 2, "did you mean 'process'"),
        ("robot: r\nstart: [0, 0, 0]\n", "YML004", 2, "list of 6 numbers"),
        ("robot: r\norientation: {x: 0}\n", "YML002", 2, "orientation.x"),
        ("robot: r\ntolerance: 0\n", "YML004", 2, "0 is not above 0"),
        ("robot: r\ntolerance_deg: -1\n", "YML004", 2, "-1 is not above 0"),
        ("robot: r\nmax_correction: 0\n", "YML004", 2, "not above 0"),
        ("robot: r\nmin_segment: 0\n", "YML004", 2, "not above 0"),
        ("robot: r\nmax_growth: 0.9\n", "YML004", 2, "0.9 is not within 1"),
        ("robot: r\ncontroller: {absolute_accuracy: maybe}\n", "YML004", 2, "true or false"),
        ("robot: r\ncontroller: {absolut: true}\n", "YML002", 2, "did you mean 'absolute_accuracy'"),
        ("robot: r\ncontroller: {cycle_ms: 0}\n", "YML004", 2, "cycle_ms: 0 is not within 0.1 .. 100"),
        ("robot: r\ncontroller: {cycle_ms: -12}\n", "YML004", 2, "-12 is not within 0.1 .. 100"),
        ("robot: r\ncontroller: {cycle_ms: 12 ms}\n", "YML004", 2, "'12 ms' is not a number"),
        ("robot: r\nforce_ramp: -3\n", "YML004", 2, "force_ramp: -3 is not within 0"),
        ("robot: r\nforce_ramp: 1e9\n", "YML004", 2, "force_ramp: 1e+09 is not within 0 .. 500"),
        ("robot: r\ntolerance: 1e9\n", "YML004", 2, "tolerance: 1e+09 is not within"),
        ("robot: r\ntolerance_deg: 360\n", "YML004", 2, "tolerance_deg: 360 is not within"),
        ("robot: r\nmax_correction: 1e9\n", "YML004", 2, "max_correction: 1e+09 is not within"),
        ("robot: r\nmin_segment: 1e9\n", "YML004", 2, "min_segment: 1e+09 is not within"),
        ("robot: r\nmax_growth: 1e12\n", "YML004", 2, "max_growth: 1e+12 is not within 1"),
        ("robot: r\ncontroller: {cycle_ms: 1e9}\n", "YML004", 2, "1e+09 is not within 0.1 .. 100"),
        (
            f"robot: r\n{TOUCHED}touch_points: [[0, 0, 0], [1e9, 0, 0]]\n",
            "YML004",
            4,
            "touch_points: 1e+09 mm is not within",
        ),
        ("robot: r\nforce_ci95: {fx: 20, fy: 1e12, fz: 5}\n", "YML004", 2, "fy: 1e+12 is not within 0"),
        ("robot: r\ntools: {1: {x: 0, y: 0, z: 0, diameter: -8}}\n", "YML004", 2, "-8 is not within 0.01"),
        ("robot: r\ntemperature: 297\n", "YML004", 2, "temperature: 297 is not within -10 .. 60"),
        ("robot: r\ntemperature: warm\n", "YML004", 2, "'warm' is not a number"),
        ("robot: r\nforce_ci95: {}\n", "YML003", 2, "force_ci95: states nothing"),
        ("robot: r\nforce_ci95: {direction: 10}\n", "YML002", 2, "did you mean 'direction_deg'"),
        ("robot: r\nforce_ci95: {direction_deg: -1}\n", "YML004", 2, "-1 is not within 0 .. 90"),
        ("robot: r\nforce_ci95: {scale: 20}\n", "YML004", 2, "20 is not within 0 .. 1"),
        ("robot: r\nforce_ci95: {fx: 20, fz: 5}\n", "YML003", 2, "fx: is incomplete: 'fy' is missing"),
        ("robot: r\nforce_ci95: {fx: 20, fy: -1, fz: 5}\n", "YML004", 2, "fy: -1 is not within 0"),
        ("robot: r\ncorrect: absolute\n", "CEL010", 2, "correct: absolute needs to know"),
        (
            "robot: r\ncorrect: absolute\ncontroller: {gravity_compensated: true}\n",
            "CEL010",
            2,
            "needs to know",
        ),
        (
            "robot: r\ntouch_points: [[0, 0, 0]]\ncorrect: touched_off\n",
            "CEL010",
            3,
            "touched_off needs to know",
        ),
        ("robot: r\ntouch_points: [[0, 0, 0]]\n", "YML004", 2, "needs 'correct: touched_off'"),
        (f"robot: r\n{TOUCHED}", "YML003", 2, "touched_off needs 'touch_points'"),
        (f"robot: r\n{TOUCHED}touch_points: 5\n", "YML004", 4, "touch_points: must contain keys and values"),
        (f"robot: r\n{TOUCHED}touch_points: []\n", "YML004", 4, "must be a list of lists of 3 numbers"),
        (f"robot: r\n{TOUCHED}touch_points: {{}}\n", "YML003", 4, "contains no touch point"),
        (f"robot: r\n{TOUCHED}touch_points: [0, 0, 0]\n", "YML004", 4, "entry 1 must be a list of 3 numbers"),
        (f"robot: r\n{TOUCHED}touch_points: [[0, 0]]\n", "YML004", 4, "entry 1 must be a list of 3 numbers"),
        (f"robot: r\n{TOUCHED}touch_points: [[0, 0, x]]\n", "YML004", 4, "'x' is not a number"),
        (f"robot: r\n{TOUCHED}touch_points: {{a: [[0, 0, 0]]}}\n", "YML004", 4, "a: is not a number from 1"),
        (
            f"robot: r\n{TOUCHED}touch_points: [[0, 0, 0], [9, 0, 0], [0, 0.5, 0]]\n",
            "YML004",
            4,
            "points 1 and 3 are the same place",
        ),
        (
            f"robot: r\n{TOUCHED}touch_points: [[0, 0, 0], [450, 2, 0], [900, 0, 0]]\n",
            "YML004",
            4,
            "the 3 points are on one line",
        ),
        (
            f"robot: r\n{TOUCHED}touch_points:\n  1: [[0, 0, 0]]\n  2: [[0, 0, 0], [1, 1, 1], [2, 2, 2], [5, 5, 5]]\n",
            "YML004",
            6,
            "touch_points.2: the 4 points are on one line",
        ),
        ("robot: r\ndialect: {integer_words: inch}\n", "YML004", 2, "not one of mm, um"),
        ("robot: r\ndialect: {rotary_words: table}\n", "YML004", 2, "not one of tip, part, m428"),
        (
            "robot: r\nexternal_axes:\n  E1: {kind: fixed, word: A3}\n",
            "YML004",
            3,
            "no address of a further axis",
        ),
        (
            "robot: r\nexternal_axes:\n  E1: {kind: fixed, word: U}\n  E2: {kind: fixed, word: u}\n",
            "YML004",
            3,
            "U is two axes of the cell",
        ),
    ],
)
def test_mistakes_are_told_with_file_line_and_key(tmp_path, text, code, line, words):
    path = write(tmp_path, text)
    finding = refused(lambda: load_cell(path))[0]
    assert (finding.code, finding.line, finding.file) == (code, line, str(path))
    assert words in finding.message


def test_the_nearest_cell_is_found(tmp_path):
    program = tmp_path / "a" / "b" / "part.src"
    program.parent.mkdir(parents=True)
    (tmp_path / "a" / "b" / "cell.yaml").mkdir()  # a folder of that name is no cell
    outer = write(tmp_path, "robot: r\n")
    assert find_cell(program) == outer
    inner = write(tmp_path / "a", "robot: r\n")
    assert find_cell(program) == inner


def test_no_cell_names_the_folders_and_the_option(tmp_path):
    finding = refused(lambda: find_cell(tmp_path / "none" / "part.src"))[0]
    assert finding.code == "CEL001"
    assert f"{tmp_path / 'none'}, {tmp_path}, " in finding.message
    assert "--cell" in finding.help


DOWN = Poses.from_abc([0, 0, 0.2], [0, 0, np.pi])
HERE = Poses.from_abc([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])


def cell_with(**more) -> Cell:
    tools = {1: Tool(DOWN, np.array([1.0, 0, 0])), 4: Tool(HERE, np.array([0, -1.0, 0]))}
    return Cell(Path("/c/cell.yaml"), "r", tools=tools, bases={1: HERE, 3: DOWN}, **more)


def test_frames_of_every_motion():
    robot_base = Poses.from_abc([0.5, 0, 0.25], [np.pi / 2, 0, 0])
    cell = cell_with(robot_base=robot_base)
    own = Poses.from_abc([7, 8, 9], [0, 0, 0])
    refs = [FrameRef(1, None), FrameRef(0, None), FrameRef(None, own), FrameRef(1, own), FrameRef(4, None)]
    frames = frames_of(cell, toolpath([0, 1, 2, -1, 0], [0, 3, 2, 4, -1], refs), "p.src")

    again = robot_base @ frames.base_in_robot
    assert np.allclose(
        again.position, [HERE.position, [0, 0, 0], own.position, [np.nan] * 3, HERE.position], equal_nan=True
    )
    assert np.allclose(again.rotation[0], HERE.rotation)
    assert np.allclose(
        frames.base_in_robot.position[1], [0, 0.5, -0.25]
    )  # the world's origin, seen from the robot
    tcp = frames.tool_in_flange.position
    assert np.allclose(
        tcp, [DOWN.position, own.position, own.position, HERE.position, [np.nan] * 3], equal_nan=True
    )
    # by number; by number although the program gives the pose; a pose that the cell does not have; by number
    nan = [np.nan] * 3
    assert np.array_equal(
        frames.spindle_in_tool, [[1, 0, 0], [1, 0, 0], nan, [0, -1, 0], nan], equal_nan=True
    )


def test_frames_that_all_motions_share_are_the_same():
    refs = [FrameRef(1, None), FrameRef(4, None)]
    one = frames_of(cell_with(), toolpath([0] * 3, [1] * 3, refs), "p.src")
    assert one.base_in_robot.rotation.shape == (3, 3, 3)
    assert np.array_equal(one.base_in_robot.position, [HERE.position] * 3)
    assert np.array_equal(one.spindle_in_tool, [[0, -1, 0]] * 3)
    assert len(frames_of(cell_with(), toolpath([], [], refs), "p.src").spindle_in_tool) == 0


@pytest.mark.parametrize(
    ("shift_mm", "turn_deg", "number", "known"),
    [
        (0.009, 0, None, True),
        (0.011, 0, None, False),
        (0, 0.009, None, True),
        (0, 0.011, None, False),
        (0, 0, 2, False),
    ],
)
def test_a_literal_tool_finds_its_axis_by_its_pose(shift_mm, turn_deg, number, known):
    pose = DOWN @ Poses.from_abc([shift_mm * 1e-3, 0, 0], [0, 0, np.radians(turn_deg)])
    refs = [FrameRef(1, None), FrameRef(number, pose)]
    frames = frames_of(cell_with(), toolpath([0], [1], refs), "p.src")
    assert np.array_equal(frames.spindle_in_tool[0], [1, 0, 0] if known else [np.nan] * 3, equal_nan=True)


def test_two_tools_of_one_pose_with_two_axes_leave_it_unknown():
    cell = cell_with()
    cell.tools[9] = Tool(DOWN, np.array([0, 0, 1.0]))
    frames = frames_of(cell, toolpath([0], [1], [FrameRef(1, None), FrameRef(None, DOWN)]), "p.src")
    assert np.all(np.isnan(frames.spindle_in_tool))


def test_missing_frames_are_all_told():
    refs = [FrameRef(2, None, 11), FrameRef(7, None, 12), FrameRef(2, None, 20)]
    findings = refused(lambda: frames_of(cell_with(), toolpath([0, 2], [1, 1], refs), "p.src"))
    assert [(f.code, f.file, f.line) for f in findings] == [("CEL002", "p.src", 11), ("CEL002", "p.src", 12)]
    assert "base 2 " in findings[0].message
    assert "/c/cell.yaml has bases 1, 3" in findings[0].message
    assert "tool 7 " in findings[1].message
    assert "has tools 1, 4" in findings[1].message
    bare = Cell(Path("cell.yaml"), "r")
    assert "has no bases" in refused(lambda: frames_of(bare, toolpath([0], [1], refs), "p.src"))[0].message


def test_missing_frames_of_unknown_targets_are_no_error():
    refs = [FrameRef(2, None, 11), FrameRef(1, None, 12)]
    path = toolpath([0, 1], [1, 1], refs, position=[[np.nan] * 3, [0, 0, 0]])
    frames = frames_of(cell_with(), path, "p.src")
    assert np.all(np.isnan(frames.base_in_robot.rotation[0]))
    assert np.all(np.isfinite(frames.base_in_robot.rotation[1]))
