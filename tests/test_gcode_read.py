"""What the reader makes of G-code: cases beside their dumps, and laws over variants of them."""

import random
import re
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.base.findings import Refusal
from postproc.base.geometry import rotation_from_abc
from postproc.base.units import DEG
from postproc.languages import DIALECTS, detect
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.gcode import general_lines as general
from postproc.languages.gcode.code_tables import FANUC, LINUXCNC
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.words import How, key
from postproc.toolpath import Kind

CASES = Path(__file__).parent / "programs"
GOOD = [path for name in ("linuxcnc", "fanuc") for path in sorted((CASES / name).glob("*.n*c"))]
BAD = [path for name in ("linuxcnc", "fanuc") for path in sorted((CASES / name / "bad").glob("*.n*c"))]
DOWN = np.array([0.0, 0.0, np.pi])
MICRONS = ("increments",)
"""Cases of a control that counts words without a decimal point in micrometres."""


def read(
    text: str | bytes, dialect: str = "linuxcnc", orientation: np.ndarray | None = DOWN, integers: str = "mm"
) -> Program:
    raw = text if isinstance(text, bytes) else text.encode("latin-1")
    settings = ReadingSettings(orientation=orientation, options={"integer_words": integers})
    return DIALECTS[dialect].read((Document(Path("part.nc"), raw),), settings)


def case(path: Path, raw: bytes | None = None) -> Program:
    name = path.parent.name if path.parent.name != "bad" else path.parent.parent.name
    return read(
        path.read_bytes() if raw is None else raw, name, integers="um" if path.stem in MICRONS else "mm"
    )


def body(text: str, dialect: str = "linuxcnc") -> Program:
    """A program that has unit, tool and position."""
    return read("G21 G90 G17 T1\nG0 X0. Y0. Z0.\nF600\n" + text, dialect)


def codes(program: Program) -> dict[int, str]:
    return {row: finding.code for row, finding in program.toolpath.constraints.refused.items()}


def told(program: Program) -> list[str]:
    return sorted(finding.code for finding in program.findings)


def ends(program: Program) -> np.ndarray:
    return program.toolpath.position * 1e3


@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
def test_a_case_reads_as_its_dump(path: Path) -> None:
    assert list(case(path).toolpath.dump()) == path.with_suffix(".dump").read_text().splitlines()


@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
def test_good_cases_are_understood(path: Path) -> None:
    program = case(path)
    allowed = {"GCO003", "GCO004", "GCO020", "GCO021"}
    allowed |= {"GCO002", "GCO028"} if path.stem == "extruder" else set()
    assert set(told(program)) <= allowed


@pytest.mark.parametrize("path", BAD, ids=lambda path: path.stem)
def test_bad_cases_tell_what_their_first_line_says(path: Path) -> None:
    first = path.read_text().splitlines()[0].strip("()").split()
    assert sorted(set(told(case(path)))) == sorted(first)


def test_there_are_cases_enough() -> None:
    assert len(GOOD) + len(BAD) >= 40


def without_lines(program: Program) -> list[str]:
    return [line.split(" ", 1)[1] for line in program.toolpath.dump()]


VARIANTS = {
    "lower case": lambda raw: re.sub(rb"(?m)^[^(;\r\n]+", lambda found: found[0].lower(), raw),
    "line endings": lambda raw: raw.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n"),
    "blank lines": lambda raw: raw.replace(b"\n", b"\n \t\n\n"),
    "blanks": lambda raw: re.sub(rb"(?m)^(?!\s*(?:M117|[%;:O(/]))[^(;\r\n]+", spread, raw),
    "no blanks": lambda raw: re.sub(
        rb"(?m)^(?!M117)[^(;\r\n]+", lambda found: found[0].replace(b" ", b""), raw
    ),
    "comments": lambda raw: re.sub(rb"(?m)^(?=[GgXYZ])", b"(X1 Y2)", raw),
    "numbers": lambda raw: re.sub(rb"(?m)^(?=[GgXYZ])", b"N0012 ", raw),
    "byte order mark": lambda raw: b"\xef\xbb\xbf" + raw,
    "no last newline": lambda raw: raw.rstrip(b"\r\n"),
}


def spread(found: re.Match[bytes]) -> bytes:
    """Blanks between letters and numbers and inside of numbers, as LinuxCNC and Fanuc allow."""
    return re.sub(rb"(?<=[A-Za-z0-9.])(?=[-+.0-9])", b" ", found[0])


@pytest.mark.sample(20)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
def test_spelling_says_nothing(path: Path, variant: str) -> None:
    raw = path.read_bytes()
    assert without_lines(case(path, VARIANTS[variant](raw))) == without_lines(case(path))


@pytest.mark.parametrize("path", [*GOOD, *BAD], ids=lambda path: path.stem)
def test_both_lexers_read_the_same(path: Path) -> None:
    """Every line that goes the quick way reads the same on the general one."""
    raw = path.read_bytes()
    text = lex(raw, LINUXCNC)
    words = text.words
    noted = {note.block for note in text.notes}
    for block in range(len(text.blocks)):
        start, stop = int(text.blocks.start[block]), int(text.blocks.stop[block])
        line = re.sub(rb"\([^)]*\)?|;.*", lambda found: b" " * len(found[0]), raw[start:stop])
        if block in noted or text.blocks.deleted[block] or b"\xef" in line or b"M117" in line:
            continue
        rows = np.flatnonzero(words.block == block)
        mine = [
            tuple(map(float, row))
            for row in zip(
                words.at[rows].tolist(), words.key[rows].tolist(), words.start[rows].tolist(),
                words.stop[rows].tolist(), words.value[rows].tolist(), words.how[rows].tolist(), strict=True,
            )
        ]  # fmt: skip
        theirs = [
            (at + start, key, -1 if begin < 0 else begin + start, stop + start, value, how)
            for at, key, begin, stop, value, how in general.line(line).words
        ]
        assert str([tuple(map(float, word)) for word in theirs]) == str(mine)


@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
def test_places_are_where_the_numbers_stand(path: Path) -> None:
    """Of every absolute word: base = frame @ (number as it stands in the text, times its unit)."""
    program = case(path)
    raw, toolpath = path.read_bytes(), program.toolpath
    places = program.text.part(0, len(toolpath))
    for axis, letter in enumerate("XYZ"):
        words = places.column(letter)
        for row in np.flatnonzero(
            (words >= 0) & ~places.incremental & np.isfinite(toolpath.position[:, axis])
        ):
            if int(row) in toolpath.constraints.refused:
                continue
            word = words[row]
            literal = raw[places.text.words.start[word] : places.text.words.stop[word]]
            integer = places.text.words.how[word] == How.INTEGER
            value = float(literal.replace(b" ", b"")) * (places.increment if integer else places.scale)[row]
            shift = places.frames.position[places.frame[row]]
            assert value + shift[axis] == pytest.approx(toolpath.position[row, axis], abs=1e-12)
            assert chr(raw[places.text.words.at[word]]).upper() == letter
            assert places.insert[row] >= places.text.words.stop[word]


def test_incremental_words_are_differences() -> None:
    rng = random.Random(3)
    steps = [[rng.randint(-900, 900) / 100 for _ in range(3)] for _ in range(200)]
    at = np.cumsum([[1.0, 2.0, 3.0], *steps], axis=0)
    begin = "T1 G21 G90\nG0 X1 Y2 Z3\nG1 F100\n"
    plain = read(begin + "".join(f"X{x:.2f} Y{y:.2f} Z{z:.2f}\n" for x, y, z in at[1:]))
    moved = read(begin + "G91\n" + "".join(f"X{x:.2f} Y{y:.2f} Z{z:.2f}\n" for x, y, z in steps))
    np.testing.assert_allclose(ends(plain), ends(moved), atol=1e-9)
    np.testing.assert_allclose(ends(moved), at, atol=1e-9)


def test_inches_are_inches() -> None:
    metric = read(
        "T1 G21\nG0 X25.4 Y50.8 Z0\nG1 X50.8 F254\nG2 X76.2 Y25.4 I0 J-25.4\nG3 X0 Y0 R127\n"
    ).toolpath
    inch = read("T1 G20\nG0 X1 Y2 Z0\nG1 X2 F10\nG2 X3 Y1 I0 J-1\nG3 X0 Y0 R5\n").toolpath
    for name in ("position", "arcs.centre", "arcs.sweep", "feed"):
        column = attrgetter(name)
        np.testing.assert_allclose(column(inch), column(metric), atol=1e-12, err_msg=name)


def test_the_planes_are_alike() -> None:
    """X -> Y -> Z -> X and I -> J -> K -> I take G17 to G19 and G19 to G18."""
    text = "G0 X1 Y2 Z3\n{} G2 X11 Y2 Z4 I5 J0\nG3 X1 Y12 R40\nG3 I3 J4 Z9 P2\nG2 X4 R-30\n"
    turn = str.maketrans("XYZIJK", "YZXJKI")
    head = "T1 G21 F100\n"
    one = read(head + text.format("G17")).toolpath
    two = read(head + text.translate(turn).format("G19")).toolpath
    three = read(head + text.translate(turn).translate(turn).format("G18")).toolpath
    for turned, steps in ((two, 1), (three, 2)):
        assert not turned.constraints.refused
        np.testing.assert_allclose(np.roll(one.position, steps, axis=1), turned.position, atol=1e-12)
        np.testing.assert_allclose(np.roll(one.arcs.centre, steps, axis=1), turned.arcs.centre, atol=1e-12)
        np.testing.assert_allclose(np.roll(one.arcs.normal, steps, axis=1), turned.arcs.normal, atol=1e-12)
        np.testing.assert_allclose(one.arcs.sweep, turned.arcs.sweep, atol=1e-12)


def test_an_arc_by_its_radius_is_that_by_its_centre() -> None:
    for code, size, i, j in (("G2", 5, 3, -4), ("G3", 5, 3, 4), ("G2", -5, 3, 4), ("G3", -5, 3, -4)):
        one = body(f"{code} X6 Y0 R{size}\n").toolpath
        two = body(f"{code} X6 Y0 I{i} J{j}\n").toolpath
        np.testing.assert_allclose(one.arcs.centre[1], two.arcs.centre[1], atol=1e-12)
        assert one.arcs.sweep[1] == pytest.approx(two.arcs.sweep[1])
        assert (one.arcs.sweep[1] > np.pi) == (size < 0)


def test_words_without_a_point_count_increments_where_the_cell_says_so() -> None:
    text = "T1 G21 G90\nG0 X1000 Y1000. Z-1\nG1 X0 F100\n"
    np.testing.assert_allclose(ends(read(text, "fanuc", integers="um"))[0], [1, 1000, -0.001])
    np.testing.assert_allclose(ends(read(text, "fanuc"))[0], [1000, 1000, -1])
    other = read(text, "linuxcnc", integers="um")
    np.testing.assert_allclose(ends(other)[0], [1000, 1000, -1])
    assert told(other) == ["GCO022"]
    inch = read(text.replace("G21", "G20"), "fanuc", integers="um")
    np.testing.assert_allclose(ends(inch)[0], [2.54, 25400, -0.00254])


def test_rotary_axes_turn_the_tool_under_tcp() -> None:
    program = body("G0 A0. B0. C0.\nG43.4 H1\nG1 X1. Y1. Z1. A10. B20. C30.\n", "fanuc")
    path = program.toolpath
    about = [rotation_from_abc(np.array(angles) * DEG) for angles in ([30, 0, 0], [0, 20, 0], [0, 0, 10])]
    np.testing.assert_allclose(
        path.rotation[2], about[0] @ about[1] @ about[2] @ rotation_from_abc(DOWN), atol=1e-12
    )
    assert path.constraints.orientation_programmed.tolist()[2]
    assert np.isnan(read("T1 G21 G0 X0 Y0 Z0\n", orientation=None).toolpath.rotation).all()


def test_three_axes_take_the_orientation_that_the_cell_says() -> None:
    path = body("G1 X1\n").toolpath
    np.testing.assert_allclose(path.rotation, np.broadcast_to(rotation_from_abc(DOWN), (2, 3, 3)))
    assert not path.constraints.orientation_programmed.any()


@pytest.mark.parametrize(
    ("text", "blend"),
    [
        ("G61 G1 X1\n", 0.0),
        ("G64 P0.05 G1 X1\n", 5e-5),
        ("G64 G1 X1\n", np.nan),
        ("G64 P1\nG61.1\nG1 X1\n", 0.0),
    ],
)
def test_how_far_the_path_may_be_left(text: str, blend: float) -> None:
    np.testing.assert_allclose(body(text).toolpath.approximation[-1], blend)


@pytest.mark.parametrize(
    ("between", "blend"),
    [
        ("", 0.05), ("(comment)", 0.05), ("F300", 0.05), ("S900", 0.05), ("G55", 0.05), ("G4 P0.5", 0.0), ("M0", 0.0),
        ("M1", 0.0), ("G4 P0.5\nM8", 0.0), ("M8", np.nan), ("M8\nF500", np.nan), ("T2", np.nan),
    ],
)  # fmt: skip
def test_the_path_is_not_left_where_the_control_stops(between: str, blend: float) -> None:
    path = body(f"G64 P0.05\nG1 X1 F200\nG1 Y1\n{between}\nG1 X2\nG1 Y2\n").toolpath
    np.testing.assert_allclose(path.approximation[-4:] * 1000, [0.05, blend, 0.05, 0.05])


def test_a_stop_in_the_block_of_a_motion_is_at_its_end() -> None:
    path = body("G64 P0.05\nG1 X1 F200\nG1 Y1 M0\nG1 X2\nG1 Y2 M9\nG1 X3\n").toolpath
    np.testing.assert_allclose(path.approximation[-5:] * 1000, [0.05, 0, np.nan, np.nan, 0.05])


@pytest.mark.parametrize(
    ("text", "tool"),
    [
        ("T3 M6\n", 3), ("T3\nM6\nT4\n", 3), ("T3 M6\nT4\nM6\n", 4), ("T5\n", 5), ("", 1), ("T0\n", 1),
        ("T#1 M6\n", None), ("T2 M6\nT0 M6\n", None),
    ],
)  # fmt: skip
def test_which_tool_is_loaded(text: str, tool: int | None) -> None:
    path = read(f"G21\n{text}G1 X0 Y0 Z0 F100\n").toolpath
    assert (path.frames[path.tool[0]].number if path.tool[0] >= 0 else None) == tool


@pytest.mark.parametrize(
    ("text", "base"),
    [("", 1), ("G54", 1), ("G59", 6), ("G59.1", 7), ("G59.9", 15), ("G54.1 P3", 103), ("G154 P20", 120)],
)
def test_which_base_is_in_force(text: str, base: int) -> None:
    path = read(f"T1 G21 {text}\nG1 X0. Y0. Z0. F100.\n", "fanuc").toolpath
    assert path.frames[path.base[0]].number == base


def test_comments_speak_from_their_line_on() -> None:
    text = "(FORCE 0 0 5)\nG1 X1\n; compensate  off\nG1 X2 (Force OFF)\n(forced)\n(note)\nG1 X3\nN9 (FORCE 1 2 3)\n"
    path = body(text).toolpath
    assert [(a.row, a.text, a.line) for a in path.annotations] == [
        (1, "FORCE 0 0 5", 4), (2, "compensate  off", 6), (2, "Force OFF", 7), (4, "FORCE 1 2 3", 11),
    ]  # fmt: skip
    assert [(a.row, a.text) for a in path.comments] == [(3, "forced"), (3, "note")]


@pytest.mark.parametrize(
    ("text", "at"),
    [
        ("G0 X1\n", 0), ("%\nG0 X1\n", 2), ("%\nO12 (NAME)\nG0 X1\n", 13), (":12\nG0\n", 4), ("\n%\n\nO1\nG0\n", 7),
        ("O<a> sub\nG0 X1\n", 0), ("(a)\n%\nG0\n", 0),
    ],
)  # fmt: skip
def test_where_the_mark_goes(text: str, at: int) -> None:
    assert read(text).marker_at.start == at


def test_a_marked_program_shows_its_mark() -> None:
    dialect = DIALECTS["fanuc"]
    raw = b"%\r\nO1\r\nG21 T1\r\nG0 X1. Y1. Z1.\r\n%\r\n"
    document = Document(Path("part.nc"), raw)
    program = dialect.read((document,))
    assert program.marker is None
    edit = dialect.marked(program, "1.0 robot (a)")
    written = raw[: edit.span.start] + edit.text + raw[edit.span.stop :]
    assert written == raw.replace(b"O1\r\n", b"O1\r\n(COMPENSATED by compensate 1.0 robot [a])\r\n")
    again = dialect.read((Document(Path("part.nc"), written),))
    assert again.marker is not None
    np.testing.assert_allclose(again.toolpath.position, program.toolpath.position)
    edit = dialect.marked(again, "1.1")
    assert written[edit.span.start : edit.span.stop] == b"(COMPENSATED by compensate 1.0 robot [a])"


@pytest.mark.parametrize(
    ("text", "pins"),
    [
        ("G1 X5\nG1 X#1\n", [1]),
        ("G1 X5\nG1 X#1 Y0 Z0\n", []),
        ("G1 X5\nG41 G1 X1 Y1 Z1\n", []),
        ("G1 X5\nG41 G1 X1 Y1\n", [1]),
        ("G1 X5\nG91 G28 Z0\n", []),
        ("G1 X5\nG92 X0\nG1 X1\n", [1]),
        ("G1 X5\nG92.1\nG1 X1\n", []),
        ("G1 X5\nM98 P1\n", [1]),
        ("G1 X5\nM8\nwhat\n", [1]),
        ("G1 X5\nG1 X6\n", []),
        ("G1 X5\nG1 X[#5420+1] Y0 Z0\n", [1]),
        ("G1 X5\n#1=#<_x>\nG1 X6\n", [1]),
        ("G1 X5\n#1=#54201\nG1 X6\n", []),
        ("G1 X5\nG41 G2 X1 Y1 Z0 I1\n", [1]),
    ],
)
def test_ends_that_others_build_on_are_pinned(text: str, pins: list[int]) -> None:
    assert list(body(text).toolpath.constraints.locked) == pins


@pytest.mark.parametrize(
    ("text", "whole"),
    [
        ("G1 X5 F100\n", False), ("G1 X5 M8\n", True), ("G1 X5 S1000\n", True), ("G1 X5 E2\n", True),
        ("G43 H1 G1 X5\n", True), ("N10 G17 G90 G1 X5\n", False), ("G93 G1 X5 F2\n", True),
        ("G2 X5 I1 J2 P1\n", False), ("G64 P0.1 G1 X5\n", True), ("G54 G1 X5\n", True),
        ("T2 G1 X5\n", True),
    ],
)  # fmt: skip
def test_blocks_that_say_more_than_the_motion_are_whole(text: str, whole: bool) -> None:
    assert bool(body(text).toolpath.constraints.no_insert_before) == whole


def test_nothing_goes_before_a_block_that_a_jump_leads_to() -> None:
    text = "IF[#101GT3]GOTO60\nG1 X4 F100\nN60 G1 X6 Y0 Z0\nN70 X7\n"
    path = body(text, "fanuc").toolpath
    assert list(path.constraints.no_insert_before) == [len(path) - 2]
    text = "GOTOF PAST\nG1 X4 F100\nPAST: G1 X6 Y0 Z0\nX7\n"
    path = body(text, "sinumerik").toolpath
    # The block that is passed comes last.
    assert list(path.constraints.no_insert_before) == [len(path) - 3, len(path) - 1]
    assert path.line[-1] == path.line[-3] - 1


def test_nothing_goes_before_a_block_that_a_subprogram_returns_to() -> None:
    lines = ["O1", "G21 G90 G17 G54 T1", "G0 X0. Y0. Z0.", "M98 P200", "G54 G90 G1 X4. Y0. Z0. F100"]
    lines += ["N60 G1 X6. Y0. Z0.", "N70 X7.", "M30", "O200", "G1 X1.", "M99 P{}", ""]
    path = read("\n".join(lines).format(60), "fanuc").toolpath
    whole = {int(path.line[row]): why for row, why in path.constraints.no_insert_before.items()}
    assert whole[6] == "a jump leads to its block"
    path = read("\n".join(lines).format(""), "fanuc").toolpath
    assert 6 not in path.line[list(path.constraints.no_insert_before)]


def test_a_call_leaves_nothing_known_but_the_unit() -> None:
    program = body(
        "G20\nM98 P5\nX1.\nG0 G90 X1. Y1. Z1.\nG54 G0 X1. Y1. Z1.\nG3 X2. I.5 J0.\nG17 G3 X2. I.5 J0.\n",
        "fanuc",
    )
    assert codes(program) == {1: "GCO018", 2: "GCO003", 4: "GCO012"}
    np.testing.assert_allclose(ends(program)[3], [25.4] * 3)


def test_refusals_name_line_and_column() -> None:
    program = body("  N7 G1 X#1\n")
    finding = program.toolpath.constraints.refused[1]
    assert (finding.code, finding.line, finding.column) == ("GCO005", 4, 3)
    assert 0 not in program.toolpath.constraints.refused
    assert 1 in program.toolpath.constraints.refused
    with pytest.raises(KeyError):
        program.toolpath.constraints.refused[0]


def test_equal_refusals_are_told_once() -> None:
    program = body(100 * "G41 D1 G1 X1 Y1\n")
    assert len(program.toolpath.constraints.refused) == 100
    assert told(program) == ["GCO009"]
    assert "100 motions, lines 4 to 103" in program.findings[0].message


@pytest.mark.parametrize(
    ("name", "text", "dialect"),
    [
        ("a.ngc", "G21\nG0 X1\n", "linuxcnc"),
        ("a.txt", "N10 G1 X5 Y5\n", "linuxcnc"),
        ("a.nc", "%\nO0001 (A)\nG0 X1.\n", "fanuc"),
        ("a.nc", ":1234\nG0 X1.\n", "fanuc"),
        ("a.nc", "G21\nG43.4 H1\nG0 X1.\n", "fanuc"),
        ("a.ngc", "o100 sub\nG0 X1\no100 endsub\nM2\n", "linuxcnc"),
        ("a.tap", "X1Y1\n", "linuxcnc"),
        ("a.gcode", "; G1 X5\nG28\nG1 Z5 F5000\n", "linuxcnc"),
        (
            "a.src",
            "DEF a()\nPTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n",
            "krl",
        ),
        ("a.nc", "DEF a()\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n", "krl"),
        ("a.src", "N1 G90\nN2 G1 X1 Y2\n", "linuxcnc"),
    ],
)
def test_the_dialect_is_found(name: str, text: str, dialect: str) -> None:
    assert detect(Path(name), text.encode()).name == dialect


@pytest.mark.parametrize("text", ["hello world\n", "x = 5\ny = 7\n", "{}", "a,b\n1,2\n"])
def test_what_is_no_program_is_not_claimed(text: str) -> None:
    with pytest.raises(Refusal):
        detect(Path("file.txt"), text.encode())


@pytest.mark.slow
def test_any_bytes_are_read() -> None:
    """Random, cut and mutated programs: no crash, spans inside, every motion with a place or a reason."""
    rng = random.Random(11)
    sources = [path.read_bytes() for path in [*GOOD, *BAD]]
    alphabet = b"GXYZIJKRFMNOSTABC0123456789.-+ \n\r%/()#[]=*:;<>,'\"\x80\xff\t"
    for run in range(400):
        raw = bytearray(rng.choice(sources))
        for _ in range(rng.randint(1, 12)):
            at = rng.randrange(len(raw) + 1)
            raw[at : at + rng.randint(0, 6)] = bytes(rng.choice(alphabet) for _ in range(rng.randint(0, 6)))
        if run % 4 == 0:
            raw = bytearray(rng.choice(alphabet) for _ in range(rng.randint(0, 300)))
        program = read(bytes(raw), ("linuxcnc", "fanuc")[run % 2])
        path = program.toolpath
        words = program.text.part(0, len(path)).text.words
        assert (words.stop <= len(raw)).all()
        assert (words.start >= -1).all()
        assert (np.diff(words.at) > 0).all()
        known = np.isfinite(path.position).all(axis=1) & (path.base >= 0) & (path.tool >= 0)
        assert all(known[row] or row in path.constraints.refused for row in range(len(path)))
        assert len(list(path.dump())) == len(path)


@pytest.mark.parametrize(
    "text", ["", "\n", "%", "(", ";", "G", "-", "\xef\xbb\xbf", "%\n%\n", "#", "[", "o", "/"]
)
def test_nothing_is_read_as_nothing(text: str) -> None:
    for dialect in ("linuxcnc", "fanuc"):
        assert len(read(text, dialect).toolpath) == 0


def test_what_stands_outside_of_the_tape_is_no_program() -> None:
    program = read("G20 T9 M6 FORCE\n%\nG0 X1 Y2 Z3\n%\nG1 X9 Y9 Z9\nG20\n")
    np.testing.assert_allclose(ends(program), [[1, 2, 3]])
    assert told(program) == ["GCO020", "GCO021"]
    np.testing.assert_allclose(ends(read("T1 G21 G0 X1 Y2 Z3\n%\nG1 X9\n")), [[1, 2, 3]])


def test_long_lines_are_read() -> None:
    for piece in ("X1", "[", "#", "1", "-", "G1 ", "(", "X[", "O", " ", "A=", "N1"):
        read(piece * 60_000 + "\nG1 X1\n")


def test_keys_of_words() -> None:
    words = lex(b"G1 X=5 A3=-.5 z+7\n", LINUXCNC).words
    assert words.key.tolist() == [key("G"), key("X"), key("A", 3), key("Z")]
    assert words.value.tolist() == [1, 5, -0.5, 7]
    assert lex(b"X12.\n", FANUC).words.how.tolist() == [How.NUMBER]


@pytest.mark.parametrize(
    ("text", "motions"),
    [
        ("G4 X1.5", 0), ("G4 P1.", 0), ("G4 P1. X5.", 1), ("G4 X1. Y1.", 1), ("G10 L2 P2 X1. Y2.", 0), ("G92 X1.", 0),
        ("G52 X1.", 0), ("G65 P1 X5.", 0), ("G68 X0. Y0. R5.", 0), ("G51 X1. P2.", 0), ("G50 X5.", 0), ("G28", 1),
        ("G28 X0.", 1), ("G53", 0), ("G53 X1.", 1), ("M206 X5.", 0), ("F5.", 0), ("M8", 0), ("X5.", 1), ("G60 X5.", 1),
        ("G1", 0), ("G2 I5. J0.", 1), ("I5.", 0), ("G2 I5.\nI5. J0.", 2), ("G54 X5.", 1), ("G43 Z5. H1", 1),
        ("G66 P1 X5.", 0),
    ],
)  # fmt: skip
def test_which_blocks_are_motions(text: str, motions: int) -> None:
    for dialect in ("linuxcnc", "fanuc"):
        assert len(body(text + "\n", dialect).toolpath) == 1 + motions


def test_what_rapids_are() -> None:
    kinds = body("G1 X1\nG0 X2\nG2 X3 I.5\nG81 Z-1 R1\n").toolpath.kind
    assert [Kind(kind).name for kind in kinds] == ["PTP", "LIN", "PTP", "CIRC", "LIN"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("number", ["9" * 400, "99999999999999999999", "-3", ""])
def test_an_offset_that_no_control_has_is_not_known(number: str) -> None:
    program = read(f"G21 G90 G17 T1 M6\nG54.1 P{number}\nG0 X0. Y0. Z0.\nG1 X1. F100\n", "fanuc")
    assert set(codes(program)) >= {1}


HOLDS, LOST, FOREIGN = ("", 1), ("GCO014", -1), ("GCO010", 1)
BLOCKS_OF_113 = [
    ("G110", LOST), ("G111", LOST), ("G113", LOST), ("G129", LOST), ("G13.1", HOLDS), ("G113 G54", HOLDS),
    ("G112", FOREIGN), ("G112\nG113", HOLDS), ("G12.1\nG1 X5.\nG113", HOLDS), ("G112\nG113\nG113", LOST),
    ("G112\nG49\nG113", HOLDS), ("G112\nG13.1\nG113", LOST), ("G113\nG112", ("GCO010", -1)), ("G113\nG54", HOLDS),
    ("/G112\nG113", ("GCO010", -1)), ("/G113", LOST), ("G113\nG112\nG113", LOST),
]  # fmt: skip
"""A block, and what is told of the motion behind it and of its base."""


@pytest.mark.parametrize(("text", "result"), BLOCKS_OF_113)
def test_g113_is_an_offset_where_no_polar_mode_is_in_force(text: str, result: tuple[str, int]) -> None:
    """Then the base of the motions behind it is not known, as behind G110."""
    program = body(f"G54 G1 X1.\n{text}\nG1 X2.\nX3. Y0. Z0.\n", "fanuc")
    code, base = result
    path = program.toolpath
    assert codes(program).get(len(path) - 1, "") == code
    assert (path.frames[path.base[-1]].number if path.base[-1] >= 0 else -1) == base
    assert codes(program).get(1) is None


def test_u_v_w_at_0_move_nothing_before_one_that_is_not() -> None:
    head = "G21 G90 G17 T1\nG0 X0 Y0 Z5 W0\nG1 X10 F100 U0.\n"
    path = read(head + "G1 X20 U1\nX30 Y0 Z5 U0\n").toolpath
    assert [*path.constraints.refused] == [2, 3]
    assert {finding.code for finding in path.constraints.refused.values()} == {"GCO016"}


@pytest.mark.parametrize("level", ["L1", "L10", "L11"])
def test_a_length_that_is_written_holds_from_the_next_g43(level: str) -> None:
    text = f"G43 H1\nG0 Z10.\nG10 {level} P1 Z5.\nG1 X1.\nG43 H1\nX2.\nZ3.\nX4.\n"
    height = ends(body(text))[-4:, 2]
    assert np.isnan(height[1])
    assert height[[0, 2, 3]].tolist() == [10.0, 3.0, 3.0]
    assert np.isnan(ends(body("G43 H1\nG0 Z10.\nG10 L10 P1 R5.\nG1 X1.\n", "fanuc"))[-1, 2])
    assert ends(body("G43 H1\nG0 Z10.\nG10 L2 P2 Z5.\nG43 H1\nG1 X1.\n"))[-1, 2] == 10.0


def test_rigid_tapping_leaves_the_tool_where_it_was() -> None:
    program = body("G33.1 Z-3. K1.\nG1 X6.\nG1 X7. Y0. Z1.\n")
    assert np.isnan(ends(program)[-2, 2])
    assert ends(program)[-1].tolist() == [7.0, 0.0, 1.0]


def test_what_may_be_a_cycle_ends_nowhere_along_its_axis() -> None:
    text = "G81 X1. R2. Z-1.\n/G1\nX-2. Y-3. Z3.\n"
    assert np.isnan(ends(body(text))[-1, 2])
    assert ends(body(text.replace("G81 X1. R2. Z-1.", "G0 X1.")))[-1].tolist() == [-2.0, -3.0, 3.0]


@pytest.mark.parametrize("before", ["G33.1 Z50. K1.\n", "G1 Z50.\nG10 L2 P0 Z5.\n"])
def test_a_cycle_goes_back_to_no_level_that_is_not_the_tools(before: str) -> None:
    assert np.isnan(ends(body(f"{before}G1 Y6.\nG98 G73 X2. R9. Z-3. Q1.\nG0 X1. Y1.\n"))[-1, 2])
