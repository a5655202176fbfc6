"""Process files: read, joined to a program, and what they refuse."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_forces import DOWN, FRAMES, cell_of, codes, path_of, refused, run
from test_milling import ALLOY, MM, cut_of

from postproc.base.geometry import Poses, rotation_from_abc
from postproc.process.milling_forces import Coefficients, mean_force
from postproc.process.operation_names import name_operations
from postproc.process.operations import join
from postproc.process.process_file import read_process
from postproc.toolpath import Annotation, FrameRef, Kind
from postproc.workflows.cell_tool_errors import tool_numbers

OPERATION = """
  - {by}
    diameter: 16
    teeth: 3
    helix: 30
    axial_depth: 5
    radial_width: 8
    direction: down
    spindle: 12000
    material: EN AW-7075-T6
"""


def process(folder: Path, text: str, name: str = "milling.yaml") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def operations(folder: Path, *by: str) -> str:
    return str(process(folder, "# cuts\noperations:" + "".join(OPERATION.format(by=each) for each in by)))


def program(comments=(), feed=0.06, notes=(), **more):
    """PTP, three cuts along +x, PTP, two cuts along +y; lines 10 to 16."""
    points = [[0, 0, 0], [0.1, 0, 0], [0.2, 0, 0], [0.3, 0, 0], [0, 0, 0], [0, 0.1, 0], [0, 0.2, 0]]
    kinds = [Kind.PTP] + [Kind.LIN] * 3 + [Kind.PTP] + [Kind.LIN] * 2
    path = path_of(points, kinds, notes=notes, **more)
    comments = tuple(Annotation(row, text, 9 + row) for row, text in comments)
    return path.with_columns(feed=np.broadcast_to(feed, (7,)), comments=comments)


# mean force at 0.06 m/s: 12000 / 60 * 3 = 600 teeth a second, 0.1 mm per tooth
WANTED = mean_force(cut_of(), np.array([0.1 * MM]))[0]


def test_the_mean_force_of_each_motion_in_the_feed_frame(tmp_path):
    result = run(program([(1, "OP 1: Pocket A roughing")]), operations(tmp_path, "name: POCKET A ROUGHING"))
    along_x, along_y = WANTED, [-WANTED[1], WANTED[0], WANTED[2]]
    assert np.allclose(result.values[1:4, :3], along_x)
    assert np.allclose(result.values[5:, :3], along_y)
    assert result.carries.tolist() == [False, True, True, True, False, True, True]
    assert result.steps.tolist() == [False, True, False, False, False, True, False]
    assert np.allclose(result.ci95[result.carries], (1319.41 - 600.46) / 2 / 767.01)
    assert np.all(result.peak[result.carries] > np.linalg.norm(WANTED))
    assert np.isnan(result.ci95[0])
    (told,) = result.findings
    assert (told.code, told.severity, told.line) == ("FRC015", "info", 3)
    assert (
        "5 motions in lines 11 to 16 have a feed per tooth of 0.1 mm, the mean force is 62.5, 293.6, -55.6 N @feed"
        in told.message
    )
    assert "EN AW-7075-T6, +- 47 %" in told.message


def test_the_feed_of_each_motion_counts(tmp_path):
    feed = np.array([0.1, 0.06, 0.03, 0.06, np.nan, 0.06, 0.06])
    result = run(program(feed=feed), operations(tmp_path, "lines: [10, 16]"))
    ends = mean_force(cut_of(), np.array([0.1, 0.05]) * MM)
    assert np.allclose(result.values[3, :3], ends[0])
    assert np.allclose(
        result.values[2, :3], 0.5 * (ends[0] + ends[1])
    )  # shared between a slow and a fast motion


def test_joined_by_tool_number_and_lines(tmp_path):
    frames = (*FRAMES, FrameRef(2, None))
    cell = cell_of(tools={1: cell_of().tools[1], 2: cell_of().tools[1]})
    path = program(frames=frames, tool=[1, 1, 1, 1, 2, 2, 2])
    result = run(path, operations(tmp_path, "tool: 2"), cell)
    assert result.carries.tolist() == [False] * 5 + [True, True]
    assert codes(result) == ["FRC007", "FRC015"]
    assert (
        "3 motions belong to no operation and count as air; the first is in line 11"
        in result.findings[0].message
    )
    result = run(path, operations(tmp_path, "lines: [12, 13]", "tool: 2"), cell)
    assert result.carries.tolist() == [False, False, True, True, False, True, True]


def test_lines_count_before_names_and_names_before_tools(tmp_path):
    text = """
defaults: {diameter: 16, helix: 30, axial_depth: 5, direction: slot, spindle: 12000, material: 6082-T6}
operations:
  - {tool: 1, teeth: 2}
  - {name: FINISH, teeth: 3}
  - {lines: [13, 13], teeth: 4}
"""
    path = program([(2, "FINISH")])
    result = run(path, str(process(tmp_path, text)))
    found = [f.message for f in result.findings if f.code == "FRC015"]
    assert [message.split(" have a feed")[0] for message in found] == [
        "operation tool 1: 1 motions in lines 11 to 11",
        "operation 'FINISH': 3 motions in lines 12 to 16",
        "operation lines 13 to 13: 1 motions in lines 13 to 13",
    ]
    assert np.all(np.isnan(result.ci95))  # one publication of this alloy


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("op 1", [1, 2, 3, 5, 6]),
        ("; --- OP   1 --- D16", [1, 2, 3, 5, 6]),
        ("OP 10", None),
        ("TOP 1", None),
        ("OP", None),
    ],
)
def test_a_name_stands_as_whole_words(tmp_path, text, rows):
    spec = operations(tmp_path, "name: Op 1")
    if rows is None:
        (finding,) = refused(program([(1, text)]), spec)
        assert (finding.code, finding.line) == ("FRC011", 3)
        assert f"the program has the comments '{text}'" in finding.help
    else:
        assert np.flatnonzero(run(program([(1, text)]), spec).carries).tolist() == rows


def test_of_two_names_the_longer_counts_and_it_holds_to_the_next(tmp_path):
    spec = operations(tmp_path, "name: POCKET", "name: POCKET WALL", "name: FACE")
    result = run(program([(1, "POCKET WALL 3"), (5, "POCKET 3")]), spec)
    messages = {f.code: f.message for f in result.findings}
    assert messages["FRC012"] == "operation 'FACE' has no motion in part.src"
    told = [f.message for f in result.findings if f.code == "FRC015"]
    assert told[0].startswith("operation 'POCKET': 2 motions in lines 15 to 16")
    assert told[1].startswith("operation 'POCKET WALL': 3 motions in lines 11 to 13")


def test_a_name_ends_with_the_tool(tmp_path):
    """Behind a change of tool only a new name, or the tool itself, says what is cut."""
    read = read_process(
        process(tmp_path, "operations:" + OPERATION.format(by="name: FACE") + OPERATION.format(by="tool: 7"))
    )
    path = program([(1, "FACE")], tool=[1, 1, 1, 1, 2, 2, 2], frames=(*FRAMES, FrameRef(7, None, 5)))
    assert join(read, path).tolist() == [-1, 0, 0, 0, 1, 1, 1]
    back = program([(1, "FACE")], tool=[1, 1, 1, 1, 2, 1, 1], frames=(*FRAMES, FrameRef(7, None, 5)))
    assert join(read, back).tolist() == [-1, 0, 0, 0, 1, -1, -1]


def test_a_tool_frame_in_an_entry_is_the_tool_of_that_entry(tmp_path):
    """$TOOL=TOOL_DATA[7]:{...}: another point of the same tool, which cuts what tool 7 cuts."""
    read = read_process(process(tmp_path, "operations:" + OPERATION.format(by="tool: 7")))
    frame = FrameRef(None, None, 5, in_entry=(7, Poses.identity()))
    path = program([], tool=[1, 1, 1, 1, 2, 2, 2], frames=(*FRAMES, frame))
    assert join(read, path).tolist() == [-1, -1, -1, -1, 0, 0, 0]
    assert tool_numbers(path).tolist() == [1, 1, 1, 1, 7, 7, 7]
    assert name_operations(path).names == ("tool 1", "tool 7")


def test_a_cut_behind_a_comment_without_a_name_is_told(tmp_path):
    spec = operations(tmp_path, "name: POCKET A")
    result = run(program([(0, "POCKET A"), (4, "POCKET B")]), spec)
    (told,) = [f for f in result.findings if f.code == "FRC018"]
    assert (told.severity, told.line) == ("info", 13)
    assert "1 cuts start" in told.message
    assert "'POCKET B'" in told.message
    # a comment inside a cut begins none, and one of several may name the operation
    for comments in (
        [(0, "POCKET A"), (2, "half way")],
        [(0, "POCKET A"), (4, "deeper"), (5, "POCKET A again")],
    ):
        assert codes(run(program(comments), spec)) == ["FRC015"]


def test_a_program_of_another_process(tmp_path):
    spec = operations(tmp_path, "name: POCKET", "tool: 7")
    (finding,) = refused(program(), spec)
    assert finding.code == "FRC011"
    assert (
        "no operation of milling.yaml has a motion in part.src; lines 10 to 16 contain motions"
        in finding.message
    )
    assert finding.help == "the program has no comments that could match a name"
    (finding,) = refused(program(), operations(tmp_path, "tool: 7"))
    assert finding.help == "the program uses the tools 1"


def test_an_unknown_feed_is_refused_with_its_line(tmp_path):
    feed = np.array([0.1, 0.06, np.nan, 0.06, np.nan, 0.06, 0])
    (finding,) = refused(program(feed=feed), operations(tmp_path, "lines: [1, 99]"))
    assert (finding.code, finding.file, finding.line) == ("FRC013", "part.src", 12)
    assert "the feed of 2 motions of operation lines 1 to 99 (milling.yaml:3)" in finding.message


def test_rapid_and_force_off_and_plunges_are_air(tmp_path):
    feed = np.array([0.1, 0.06, 0.3, 0.06, 0.1, 0.06, 0.06])
    spec = operations(tmp_path, "lines: [1, 99]\n    rapid: 0.3")
    result = run(program(feed=feed, notes=[(6, "FORCE OFF", 9)]), spec)
    assert np.flatnonzero(result.carries).tolist() == [1, 3, 5]
    path = program(feed=feed)
    points = path.position.copy()
    points[6] = points[5] + [0, 0, -0.02]
    result = run(path.with_columns(position=points), spec)
    assert np.flatnonzero(result.carries).tolist() == [1, 3, 5]
    (told,) = [f for f in result.findings if f.code == "FRC014"]
    assert (told.line, told.severity) == (16, "info")


def test_a_plunge_is_one_along_the_spindle_wherever_that_points(tmp_path):
    lying = rotation_from_abc([0, np.pi / 2, 0]) @ DOWN  # the spindle along x, in which the first cut goes
    result = run(program(rotations=[lying] * 7), operations(tmp_path, "lines: [1, 99]"))
    assert np.flatnonzero(result.carries).tolist() == [5, 6]


def test_an_approach_from_an_axis_position_is_air(tmp_path):
    points = [[np.nan] * 3, [0, 0, 0.05], [0, 0, 0], [0.1, 0, 0]]
    path = path_of(points, [Kind.AXIS, Kind.LIN, Kind.LIN, Kind.LIN])
    result = run(path, operations(tmp_path, "lines: [1, 99]"))
    assert result.carries.tolist() == [False, False, False, True]
    (told,) = [f for f in result.findings if f.code == "FRC014"]
    assert told.message == "1 motions along the spindle and 1 from axis positions have no computed force"


def test_a_fast_move_that_counts_as_cutting_is_told(tmp_path):
    feed = np.array([0.1, 0.06, 0.06, 0.25, 0.1, 0.06, 0.06])
    result = run(program(feed=feed), operations(tmp_path, "lines: [1, 99]"))
    (told,) = [f for f in result.findings if f.code == "FRC017"]
    assert (told.severity, told.line) == ("warning", 13)
    assert "up to 0.417 mm per tooth" in told.message
    assert "rapid: 0.25" in told.help


def test_own_coefficients_and_a_direction(tmp_path):
    text = """
operations:
  - lines: [1, 99]
    diameter: 16
    teeth: 3
    helix: 30
    axial_depth: 5
    radial_width: 8
    direction: up
    spindle: 12000
    coefficients: {ktc: 1000, krc: 300, kac: 100, kte: 20, kre: 10, kae: 1, source: dynamometer}
    ci95: 0.1
"""
    coefficients = Coefficients((1e9, 3e8, 1e8), (2e4, 1e4, 1e3))
    result = run(program(), str(process(tmp_path, text)))
    wanted = mean_force(cut_of("up", coefficients=coefficients), np.array([0.1 * MM]))[0]
    assert np.allclose(result.values[1, :3], wanted)
    assert np.allclose(result.ci95[result.carries], 0.1)
    assert result.source.endswith("milling.yaml")
    no_axial = text.replace(" kac: 100,", "").replace(", kae: 1", "")
    result = run(program(), str(process(tmp_path, no_axial)))
    assert abs(result.values[1, 2]) < 1e-9
    assert "FRC016" in codes(result)


def test_the_process_of_the_cell_is_the_last_source(tmp_path):
    operations(tmp_path, "lines: [1, 99]")
    cell = cell_of(path=tmp_path / "cell.yaml", process="milling.yaml")
    assert run(program(), "", cell).source == "cell: milling.yaml"
    noted = program(notes=[(0, "FORCE 1 0 0", 3)])
    assert run(noted, "", cell).source == "FORCE comments"


GOOD = OPERATION.format(by="lines: [1, 99]")


@pytest.mark.parametrize(
    ("old", "new", "code", "line", "words", "help"),
    [
        ("radial_width: 8", "radial_width: 16.5", "YML004", 8, "16.5 mm is wider than the cutter", ""),
        ("radial_width: 8", "radial_width: 0", "YML004", 8, "0 is not within 0.0001 .. 1000", ""),
        ("teeth: 3", "teeth: 0", "YML004", 5, "teeth: 0 is not a whole number from 1", ""),
        ("teeth: 3", "teeth: 2.5", "YML004", 5, "2.5 is not a whole number", ""),
        ("    spindle: 12000\n", "", "YML003", 3, "the key 'spindle' is missing", ""),
        ("spindle: 12000", "spindle: 0", "YML004", 10, "0 is not within 1 .. 1e+06", ""),
        (
            "spindle: 12000",
            "spindle: 12000 rpm",
            "YML004",
            10,
            "'12000 rpm' is not a number",
            "without the unit",
        ),
        ("EN AW-7075-T6", "EN AW-7057-T6", "YML004", 11, "did you mean 'EN AW-7075-T6'", "EN AW-6082-T6"),
        ("EN AW-7075-T6", "granite", "YML004", 11, "'granite' is not known", "coefficients: {ktc: ..."),
        ("    material: EN AW-7075-T6\n", "", "YML003", 3, "the key 'material' is missing", "EN AW-6061-T6"),
        ("direction: down", "direction: dwon", "YML004", 9, "did you mean 'down'", ""),
        ("direction: down", "direction: slot", "YML004", 8, "8 mm is not a slot", "up or down"),
        ("helix: 30", "helix: 95", "YML004", 6, "95 is not within -75 .. 75", ""),
        ("diameter: 16", "diameter: -16", "YML004", 4, "-16 is not within 0.01 .. 1000", ""),
        ("diameter: 16", "diamter: 16", "YML002", 4, "did you mean 'diameter'", "radial_width"),
        ("axial_depth: 5", "axial_depth: nan", "YML004", 7, "'nan' is not a number", ""),
        ("lines: [1, 99]", "lines: [9, 1]", "YML004", 3, "9 to 1 is not a range of lines", ""),
        ("lines: [1, 99]", "tool: 0", "YML004", 3, "0 is not a whole number", ""),
        ("lines: [1, 99]", "name: ' '", "YML004", 3, "is empty", ""),
        ("lines: [1, 99]", "tool: 1\n    name: A", "YML004", 4, "excludes 'tool'", "one of: name"),
        (
            "lines: [1, 99]\n    diameter",
            "diameter",
            "YML003",
            3,
            "does not state which motions belong to it",
            "one of: name",
        ),
    ],
)
def test_mistakes_are_told_with_their_line(tmp_path, old, new, code, line, words, help):
    text = ("# cuts\noperations:" + GOOD).replace(old, new)
    assert old in GOOD
    path = process(tmp_path, text)
    (finding,) = refused(program(), str(path))
    assert (finding.code, finding.file, finding.line) == (code, str(path), line)
    assert words in finding.message
    assert help in finding.help


@pytest.mark.parametrize(
    ("by", "words"),
    [
        (("name: A", "name: a"), "'a' is defined twice, first in line 3"),
        (("tool: 3", "tool: 3"), "tool 3 has an operation already, in line 3"),
        (("lines: [1, 20]", "lines: [20, 30]"), "lines 20 to 30 overlap those of the operation in line 3"),
    ],
)
def test_operations_that_claim_the_same_motions(tmp_path, by, words):
    (finding,) = refused(program(), operations(tmp_path, *by))
    assert (finding.code, finding.line) == ("YML004", 13)
    assert words in finding.message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("defaults: {teeth: 3}\n", "the key 'operations' is missing"),
        ("operations: []\n", "contains no operation"),
        ("operation: []\n", "did you mean 'operations'"),
        ("operations: 3\n", "must be a list"),
        ("defaults: {name: A}\noperations: []\n", "the key is unknown"),
    ],
)
def test_files_that_are_no_process(tmp_path, text, words):
    (finding,) = refused(program(), str(process(tmp_path, text)))
    assert words in finding.message


def test_what_the_defaults_state_is_told_there(tmp_path):
    text = """
defaults: {diameter: 16, teeth: 3, helix: 30, axial_depth: 5, direction: down, radial_width: 20,
           spindle: 12000, material: EN AW-7075-T6}
operations:
  - lines: [1, 99]
"""
    (finding,) = refused(program(), str(process(tmp_path, text)))
    assert (finding.code, finding.line) == ("YML004", 2)
    (operation,) = read_process(process(tmp_path, text.replace("20,", "8,")))
    assert replace(operation.cut, coefficients=ALLOY) == cut_of()
    assert np.allclose(operation.cut.coefficients.cutting, ALLOY.cutting)
    assert operation.speed == pytest.approx(2 * np.pi * 200)
