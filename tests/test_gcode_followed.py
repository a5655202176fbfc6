"""Variables, loops, calls and jumps of G-code that are followed; what the cell states of the start; cycles by name."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from gcode_writing import round_trip
from posted_programs import posted_programs

from postproc.base.document import Document
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.gcode import DIALECTS
from postproc.toolpath import Toolpath
from postproc.toolpath.initial_state import InitialState

DIALECT = {dialect.name: dialect for dialect in DIALECTS}
HEAD = {
    "linuxcnc": "G21 G90 G17 G54 G94\nT1 M6\nG0 X0 Y0 Z0\nF60\n",
    "fanuc": "O1\nG21 G90 G17 G54 G94\nT1 M6\nG0 X0. Y0. Z0.\nF60.\n",
    "sinumerik": "G71 G90 G17 G54 G94\nT1 D1\nG0 X0 Y0 Z0\nF60\n",
}


def read(name: str, text: str, head: str | None = None, **settings: object) -> Program:
    raw = ((HEAD[name] if head is None else head) + text).encode()
    given = ReadingSettings(orientation=np.zeros(3), **settings)  # type: ignore[arg-type]
    return DIALECT[name].read((Document(Path("part.nc"), raw),), given)


def run(name: str, text: str, **settings: object) -> list[str]:
    """The ends of the motions after the head in the order in which they run, a question mark where one is not known,
    a star where it is not corrected."""
    path = read(name, text, **settings).toolpath
    ends = []
    for row in range(1, len(path)):
        position = path.position[row] * 1e3
        known = np.isfinite(position).all()
        end = " ".join(f"{value + 0.0:g}" for value in np.round(position, 6)) if known else "?"
        ends.append(end + "*" * (row in path.constraints.refused))
    return ends


@pytest.mark.parametrize(
    ("name", "text", "ends"),
    [
        # values
        ("linuxcnc", "#1=5\nG1 X#1 Y[#1*2]\n", ["5 10 0"]),
        ("linuxcnc", "#1=5\n#1=6 G1 X#1\nG1 X#1\n", ["5 0 0*", "6 0 0"]),
        ("linuxcnc", "#<a b>=2\nG1 X[#<AB> + SIN[30]]\n", ["2.5 0 0"]),
        ("linuxcnc", "G1 X[1+[2]]\nY-[3]\n", ["3 0 0", "3 -3 0"]),
        ("linuxcnc", "G1 X#1\nY2\nX1\n", ["?*", "?*", "1 2 0"]),
        ("linuxcnc", "/#1=5\nG1 X#1\n", ["?*"]),
        ("linuxcnc", "#1=5\n/#1=6\nG1 X#1\n", ["?*"]),
        ("fanuc", "#1=5.\n#1=6. X#1\n", ["?*"]),
        ("fanuc", "#100=5\nG65 P9000\nG90 G54 G1 X#100 Y0. Z0.\n", ["?*"]),
        ("fanuc", "#100=5\nG1 X#[90+10]\n", ["5 0 0"]),
        ("fanuc", "#100=5\n#[#500]=3\nG1 X#100\n", ["?*"]),
        ("sinumerik", "R1=2 R2=3\nG1 X=R1+R2 Y=IC(R1)\n", ["5 2 0"]),
        ("sinumerik", "DEF REAL _X=2.5, _Y\nG1 X=_X Y=_Y\n", ["2.5 0 0"]),
        ("sinumerik", "DEF INT _N\n_N=2.5\nG1 X=_N\n", ["?*"]),
        ("sinumerik", "R1=1\nID=1 WHENEVER $A_IN[1]==1 DO R1=2\nG1 X=R1\n", ["?*"]),
        # the last digits decide
        ("linuxcnc", "G1 X[FIX[ASIN[-.5]]]\n", ["?*"]),
        ("linuxcnc", "G1 X[FIX[2.5]] Y[FUP[3]] Z[ROUND[2.5]]\n", ["2 3 3"]),
        ("linuxcnc", "G1 X[ROUND[SIN[30]]]\n", ["?*"]),
        ("linuxcnc", "#1=[[0.1+0.2] LE 0.3]\nG1 X#1\n", ["?*"]),
        ("linuxcnc", "#1=[0.3 MOD 0.1]\nG1 X#1\n", ["?*"]),
        ("sinumerik", "R1=TRUNC(2.5)\nR2=TRUNC(0.1*3*10)\nG1 X=R1\nX=R2\n", ["2 0 0", "?*"]),
        # branches
        ("linuxcnc", "#1=1\nO1 IF [#1 EQ 1]\nG1 X1\nO1 ELSE\nG1 X2\nO1 ENDIF\nM2\n", ["1 0 0", "?*"]),
        ("linuxcnc", "O1 IF [#5 EQ 1]\nG1 X1\nO1 ENDIF\nG1 Y3\n", ["?*", "?*"]),
        ("linuxcnc", "#1=1\nO1 IF [#5 EQ 1]\n#1=2\nO1 ENDIF\nG1 X#1\n", ["?*"]),
        ("fanuc", "#1=2\nIF[#1GT1]GOTO9\nG1 X1.\nN9 G1 Y1.\nM30\n", ["0 1 0", "?*"]),
        ("fanuc", "IF[#1GT1]GOTO9\nG1 X1.\nN9 G1 Y1.\nX3.\nM30\n", ["?*", "?*", "3 1 0"]),
        ("fanuc", "#1=2\nIF[#1EQ2]THEN#2=4.\nG1 X#2\n", ["4 0 0"]),
        ("sinumerik", "R1=1\nIF R1==1 GOTOF A1\nG1 X1\nA1: G1 Y1\nM30\n", ["0 1 0", "?*"]),
        # loops
        ("fanuc", "#1=0\nWHILE[#1LT2]DO1\n#1=#1+1\nG1 X#1\nEND1\n", ["1 0 0*", "2 0 0*"]),
        ("linuxcnc", "O1 REPEAT [2]\nG91 G1 X1\nO1 ENDREPEAT\n", ["1 0 0*", "2 0 0*"]),
        ("sinumerik", "FOR R1=1 TO 2\nG1 X=R1\nENDFOR\n", ["1 0 0*", "2 0 0*"]),
        ("sinumerik", "A1:\nG1 X=IC(1)\nA2:\nREPEAT A1 A2 P=2\n", ["1 0 0*", "2 0 0*", "3 0 0*"]),
        ("linuxcnc", "O1 WHILE [1 EQ 1]\nG1 X1\nO1 ENDWHILE\nG1 Y1\n", ["?*", "?*"]),
        # subprograms
        ("linuxcnc", "O1 SUB\nG1 X#1 Y#2\nO1 ENDSUB\nO1 CALL [1]\nO1 CALL [2] [3]\n", ["1 0 0*", "2 3 0*"]),
        ("linuxcnc", "O1 SUB\nG1 X#1\nO1 ENDSUB\n#1=9\nO1 CALL [1]\nG1 Y#1\n", ["1 0 0", "1 9 0"]),
        ("linuxcnc", "O7 SUB\nG1 X#1\nO7 ENDSUB\n#5=7\nO#5 CALL [1]\nO[#5*2] CALL\nG1 Y3\n", ["1 0 0", "?*"]),
        ("linuxcnc", "O7 SUB\nG92 X5\nO7 ENDSUB\nO[6+1] CALL\nG1 X6\n", ["1 0 0"]),
        ("fanuc", "M98 P2 L2\nM30\nO2\nG91 G1 X1.\nM99\n", ["1 0 0*", "2 0 0*"]),
        ("fanuc", "M98 P2\nG1 Y1.\nM30\nO2\nG1 X1.\nM99\n", ["1 0 0", "1 1 0"]),
        ("fanuc", "M98 P3\nG1 Y1.\nM30\nO2\nG1 X1.\nM99\n", ["?*", "?*"]),
        ("fanuc", "/M98 P2\nM30\nO2\nG1 X1.\nM99\n", ["?*"]),
        ("sinumerik", "L5 P2\nM30\n%_N_L5_SPF\nG91 G1 X1\nM17\n", ["1 0 0*", "2 0 0*"]),
        # cycles, offsets, the tool's radius
        ("linuxcnc", "G41 D1 G1 X5 Y1\nX7\nG40 X9\nY2\n", ["?*", "?*", "9 1 0", "9 2 0"]),
        ("sinumerik", "G42 G1 X5 Y1\nX7\nG40\nY2\n", ["?*", "?*", "7 2 0"]),
        ("fanuc", "G55 G0 X1. Y1. Z1.\n/G56\n/G57\nG1 X2.\n", ["1 1 1", "?*"]),
        ("fanuc", "/G55\nG0 X1. Y1. Z1.\n/G56\nG1 X2.\n", ["1 1 1*", "?*"]),
        ("sinumerik", "CYCLE82(30,0,2,-5)\nG1 X1\n", ["1 0 30"]),
        ("sinumerik", "MCALL CYCLE81(R1,0,2,-5)\nX1\nMCALL\nG1 X2 Y2\n", ["?*", "?*"]),
        ("sinumerik", "R1=30\nMCALL CYCLE81(R1,0,2,-5)\nX1\nMCALL\nG1 X2\n", ["1 0 30*", "2 0 30"]),
        # holes on a circle, a pocket, a corner: they state no axis, and end elsewhere or round what is before
        ("fanuc", "G70 I5. J15. L12\nG1 X5.\nY1. Z1.\n", ["?*", "5 1 1"]),
        ("fanuc", "G150 P100 I1. Q1.\nG1 X5. Y1.\n", ["?*"]),
        ("fanuc", "G12 I5.\nG1 X5.\n", ["5 0 0"]),
        ("fanuc", "G98 G81 X9. Y9. Z-1. R1. L0\nG80\nG1 Y5. Z1.\nX1.\n", ["?*", "?*", "1 5 1"]),
        ("sinumerik", "CYCLE800()\nG1 X1 Y1 Z1\n", ["1 1 1"]),
        ("sinumerik", 'CYCLE800(1,"",0,57,0,0,0,0,30,0,0,0,0,1)\nG1 X1 Y1 Z1\n', ["1.36603 1 0.366025"]),
        ("sinumerik", 'CYCLE800(1,"",0,57,0,0,0,0,R1,0,0,0,0,1)\nG1 X1 Y1 Z1\n', ["?*"]),
    ],
)  # fmt: skip
def test_what_runs(name: str, text: str, ends: list[str]) -> None:
    assert run(name, text) == ends


def test_names_that_the_cell_binds() -> None:
    symbols = {"#501": 4.0, "_X_HOME": 3.0}
    assert run("fanuc", "G1 X#501\n", symbols=symbols) == ["4 0 0"]
    assert run("sinumerik", "G1 X=_X_HOME\n", symbols=symbols) == ["3 0 0"]
    found = read("fanuc", "G1 X#501\n")
    assert "bind #501 under symbols:" in found.findings[0].help


PART = "A1:\nG1 X1\nR2=R2+1\nENDLABEL:\nREPEAT A1 P=R1\n"


@pytest.mark.parametrize(
    ("name", "text", "bound"),
    [
        ("sinumerik", PART + "G1 X=R2 Y2 Z3\n", ("R1", "R2")),
        ("sinumerik", "R1=R3\n" + PART + "G1 X=R2 Y2 Z3\n", ("R2", "R3")),
        # R1 comes from elsewhere, and R2 from the loop
        ("sinumerik", "R1=$AA_IM[X]\n" + PART.replace("R2+1", "R1") + "G1 X=R2 Y2 Z3\n", ()),
        ("sinumerik", "L77\n" + PART + "G1 X=R2 Y2 Z3\n", ()),
        ("sinumerik", "R1=$AA_IM[X]\nG1 X=R1\n", ()),
        ("fanuc", "WHILE[#1 LT 5]DO1\nG1 X1.\n#1=#1+1\nEND1\nG1 X#1 Y2. Z3.\n", ("#1",)),
    ],
)
def test_only_names_are_to_be_bound_that_help(name: str, text: str, bound: tuple[str, ...]) -> None:
    """What the program sets itself has that value, whatever the cell states."""
    helps = [finding.help for finding in read(name, text).findings if finding.code == "GCO005"]
    (named,) = [re.search(r"bind (.*) under symbols:", one) for one in helps]
    assert (() if named is None else tuple(sorted(named[1].split(", ")))) == bound
    last = run(name, text, symbols=dict.fromkeys(bound, 2.0))[-1]
    assert ("?" in last) == (not bound)


def test_the_start_that_the_cell_states() -> None:
    text = "G21 G90 G17 G94\nG1 X5 F60\n"
    start = InitialState(tool=3, base=2, words={"X": 1.0, "Y": 2.0, "Z": 3.0})
    path = read("linuxcnc", text, "", initial=start).toolpath
    np.testing.assert_allclose(path.position[0], [5e-3, 2e-3, 3e-3])
    assert [path.frames[index].number for index in (path.base[0], path.tool[0])] == [2, 3]
    advice = [finding.help for finding in read("linuxcnc", text, "").findings if finding.code == "GCO002"]
    assert advice == ["state Y, Z under program_start: in the cell, or write them in the first motion"]


REFERENCE = {"G28": {"B": 0.0, "C": 90.0}, "G30": {"B": 30.0}}


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("G28 B0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1"]),
        ("G91 G28 B0.\nG90 G1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1"]),
        ("G91 G28 B0.\nG0 B0.\nG90 G1 X1. Y1. Z1.\n", ["0 0 0*", "0 0 0", "1 1 1"]),
        # Z goes to the reference point as well, which only rotary axes have in the cell
        ("G28 Z9. B0.\nG1 X1. Y1.\nZ1.\n", ["?*", "?*", "1 1 1"]),
        # 90 and 30 deg are no place of the tool without a TCP mode
        ("G28 C0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1*"]),
        ("G30 B0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1*"]),
        ("G28 A0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1*"]),
        # a further reference point, one that the program stores, an origin that it shifts
        ("G30 P3 B0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1*"]),
        ("G28.1 B0.\nG28 B0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "0 0 0*", "1 1 1*"]),
        ("G92 B10.\nG28 B0.\nG1 X1. Y1. Z1.\n", ["0 0 0*", "1 1 1*"]),
        # whether the block runs is not known
        ("/G28 B0.\nG1 X1. Y1. Z1.\n", ["?*", "1 1 1*"]),
    ],
)
def test_the_reference_point_of_rotary_axes_that_the_cell_states(text: str, ends: list[str]) -> None:
    assert run("fanuc", text, symbols=REFERENCE) == ends


def test_the_tool_that_is_loaded_already_keeps_its_coordinates() -> None:
    """M6 of LinuxCNC changes no length; of other controls it may lead Z elsewhere."""
    start = InitialState(tool=1, base=1, words={"X": 0.0, "Y": 0.0, "Z": 7.0})
    text = "G21 G90 G17 G94 F60\nT1 M6\nG1 X5\nT2 M6\nG1 X6\nT2 M6\nG1 X7\nG1 Z1\nT2 M6\nG1 X8\n"
    for name, known in (("linuxcnc", [7, np.nan, np.nan, 1, 1]), ("fanuc", [np.nan] * 3 + [1, np.nan])):
        path = read(name, text.replace("\n", ".\n") if name == "fanuc" else text, "", initial=start).toolpath
        np.testing.assert_allclose(path.position[:, 2] * 1e3, known)
    unknown = read("linuxcnc", text, "").toolpath
    assert np.isnan(unknown.position[0, 2])


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("G10 L2 P1 X10. Y20. Z30.\n", [10, 20, 30]), ("G10 L2 P1 X10. Y20.\nG10 L2 P1 Z30.\n", [10, 20, 30]),
        ("G10 L2 P2 X1. Y1. Z1.\n", None), ("G10 L2 P1 X10. Y20.\n", ()), ("G91 G10 L2 P1 X1. Y1. Z1.\nG90\n", ()),
        ("G10 L2 P1 X#500 Y20. Z30.\n", ()), ("/G10 L2 P1 X10. Y20. Z30.\n", ()),
    ],
)  # fmt: skip
def test_a_work_offset_that_the_program_states(text: str, place: list[float] | tuple[()] | None) -> None:
    """Where the base is [mm]; None: the cell's; nothing: not known."""
    path = read("fanuc", text + "G0 X1. Y1. Z1.\nG1 X5.\n").toolpath
    if place == ():
        assert path.base[-1] == -1
    else:
        pose = path.frames[path.base[-1]].pose
        assert (None if pose is None else (pose.position * 1e3).round(9).tolist()) == place


PROGRAMS = list(posted_programs())


@pytest.mark.sample(12)
@pytest.mark.parametrize(("path", "raw"), PROGRAMS, ids=[path.stem for path, _ in PROGRAMS])
def test_posted_programs_are_written(path: Path, raw: bytes) -> None:
    dialect = next(one for one in DIALECTS if one.claims(path, raw))
    round_trip(dialect, raw, 1)


def test_blocks_of_one_finding_are_in_the_order_of_the_file():
    """A subprogram comes after what is run, and stands before it in the file: the finding covers both lines."""
    program = read("linuxcnc", "O305 SUB\n@15.87\nO305 ENDSUB\nG1 F373.9\n@ 70.63\nM30\n", head="")
    found = next(one for one in program.findings if one.code == "GCO001")
    assert (found.line, found.message.partition("; ")[2]) == (2, "2 blocks, lines 2 to 5")


def test_the_advice_after_a_call_that_is_not_read() -> None:
    """Its line, where the offset is not known since; followed, an empty subprogram leaves all as it is."""

    def offsets(text: str, **siblings: object) -> list[tuple[str, str]]:
        found = read("fanuc", text, **siblings).findings
        return [(one.message, one.help) for one in found if one.code == "GCO014"]

    text = "G65 P8000 X1.\nG1 X1. Y1. Z1.\nX2.\nG54\nG1 X1. Y1. Z1.\nM98 P7\nG1 X1. Y1. Z1.\n"
    said = "the work offset is not known since line {}, which calls code that is not read"
    first, second = offsets(text)
    assert first[0].startswith(said.format(6))
    assert second[0] == said.format(11)
    assert "put the file that line 6 calls beside the program, or one with M99 alone" in first[1]
    empty = tuple(Document(Path(f"O{name}.nc"), f"O{name}\nM99\n".encode()) for name in (8000, 7))
    assert not offsets(text, siblings=empty)
    # another cause than the call
    other = offsets("G65 P8000\nG54\nG1 X1. Y1. Z1.\nG10 L2 P1 X#500\nG1 X1. Y1. Z1.\n")
    assert [message for message, _ in other] == [
        "the work offset is not known, or the program itself writes it"
    ]


FURTHER = "G1 X1 Y2 Z3 Y2=-300.4 U5\nG1 X2 Y2=-290\nG1 X3\nG91 G1 X1 U1\n"


def test_words_of_external_axes_that_the_cell_states() -> None:
    """In place of E1 and E2; what is not stated is refused as before, and so is E1 where another word is it."""
    path = read("sinumerik", FURTHER, external_words={"Y2": 0, "U": 1}).toolpath
    assert not path.constraints.refused
    np.testing.assert_array_equal(path.external[1:4, :2], [[-300.4, 5], [-290, 5], [-290, 5]])
    same = read("sinumerik", FURTHER.replace("Y2=", "E1=").replace("U", "E2=")).toolpath
    np.testing.assert_array_equal(path.external, same.external)
    assert {2, 3} <= path.constraints.no_insert_before.keys() | {3}
    for stated, name in (
        ({"Y2": 0}, "U (line 5)"),
        ({"U": 0}, "Y2 (line 5)"),
        ({}, "U (line 5), Y2 (line 5)"),
    ):
        refused = read("sinumerik", FURTHER, external_words=stated).toolpath.constraints.refused
        assert [found.code for found in refused.values()] == ["GCO026"] * 5
        assert name in refused[1].message
    advice = read("sinumerik", FURTHER).toolpath.constraints.refused[1].advice
    assert "external_axes: {E1: {kind: fixed, word: U}}" in advice
    moved = read("sinumerik", "G1 X1 E1=5\n", external_words={"Y2": 0}).toolpath.constraints.refused
    assert "E1 (line 5)" in moved[1].message


def test_the_advice_for_the_tool_that_may_be_loaded_at_the_start() -> None:
    def advice(**initial: object) -> list[str]:
        text = "G21 G90 G17 G94 F60\nT4 M6\nG1 X1 Y5\nT5 M6\nG1 X6\n"
        found = read("linuxcnc", text, "", initial=InitialState(**initial)).findings  # type: ignore[arg-type]
        return [finding.help for finding in found if finding.code == "GCO002"]

    first = (
        "if tool 4 is loaded where the program starts, state it in the cell: program_start: {tool: 4}; or write Z in"
        " the first motion after the change"
    )
    assert advice() == [first]
    assert advice(tool=4) == [
        "state Z under program_start: in the cell, or write them in the first motion",
        "",
    ]
    assert advice(tool=4, words={"Z": 1.0}) == [""]
    assert advice(tool=3, words={"Z": 1.0}) == [first]


def test_the_advice_for_a_reference_point_that_is_not_stated() -> None:
    def advice(text: str) -> list[str]:
        return [finding.help for finding in read("fanuc", text).findings if finding.code == "GCO013"]

    before = "state B under program_start: in the cell, or write B before it"
    reached = "state where G28 leads rotary axes in the cell: symbols: {G28: {B: 0}}"
    assert advice("G28 B0.\nG1 X1. Y1. Z1.\n") == [before, reached]
    assert advice("G28 Z0.\nG30 B0. C0.\nG1 X1. Y1. Z1.\n")[1:] == [
        "state where G30 leads rotary axes in the cell: symbols: {G30: {B: 0, C: 0}}"
    ]
    turned = advice("G1 X1. Y1. Z1. B5.\n")[1]
    assert turned.startswith(
        "state in the cell what A, B, C do: dialect: {rotary_words: part} if they turn the part"
    )


ROTARY = "G0 X0. Y0. Z9. B90. C30.\nG1 Z-1. F100.\nX10. B91.\nG2 X20. I5.\nG81 X5. Z-2. R3.\nG80\nG93 G1 X0. C0. F5.\n"


def _columns(path: Toolpath) -> list[np.ndarray]:
    return [path.position, path.rotation, path.base, path.tool, path.arcs.centre, path.arcs.sweep, path.kind]


@pytest.mark.parametrize("name", ["linuxcnc", "fanuc"])
def test_rotary_words_that_turn_the_part_leave_the_tool_where_it_is(name: str) -> None:
    """As the cell states it; the tool is where the same program without the words has it, the part is not."""
    turning = read(name, ROTARY, options={"rotary_words": "part"}).toolpath
    alone = read(name, re.sub(r" [BC]\d+\.", "", ROTARY)).toolpath
    for one, other in zip(_columns(turning), _columns(alone), strict=True):
        np.testing.assert_array_equal(one, other)
    one, other = (
        {row: found.code for row, found in path.constraints.refused.items()} for path in (turning, alone)
    )
    assert one == other
    assert len(one) < 3
    assert not turning.constraints.orientation_programmed.any()
    # F is that of the axes too where they move, but the time of a block is not
    moved = np.flatnonzero(np.isnan(turning.feed) & ~np.isnan(alone.feed)).tolist()
    assert [turning.line[row] for row in moved] == [len(HEAD[name].splitlines()) + 3]


@pytest.mark.parametrize("name", ["linuxcnc", "fanuc"])
def test_rotary_words_at_the_tip_are_those_of_a_tcp_mode(name: str) -> None:
    stated = read(name, ROTARY, options={"rotary_words": "tip"}).toolpath
    coded = read(name, "G43.4 H1\n" + ROTARY).toolpath
    for one, other in zip(_columns(stated), _columns(coded), strict=True):
        np.testing.assert_array_equal(one, other)
    assert stated.constraints.orientation_programmed.any()
    refused = read(name, ROTARY).toolpath.constraints.refused
    assert len(refused) >= 4
    # other kinematics in between: what the words mean is not known
    switched = read(name, ROTARY + "M429\n", options={"rotary_words": "tip"}).toolpath.constraints.refused
    assert list(switched) == list(refused)


@pytest.mark.parametrize(
    ("text", "known"),
    [
        ("M428\n{}", True), ("M428\n{}M429\n", True), ("{}M428\n", False), ("M428\nM429\n{}", False),
        ("M428\nM430\n{}", False), ("/M428\n{}", False), ("{}", False),
    ],
)  # fmt: skip
def test_codes_that_switch_the_kinematics(text: str, known: bool) -> None:
    """M428 and M429 of LinuxCNC's configurations with five axes, where the cell states that they are that."""
    path = read("linuxcnc", text.format(ROTARY), options={"rotary_words": "m428"}).toolpath
    tip = read("linuxcnc", ROTARY, options={"rotary_words": "tip"}).toolpath
    plain = read("linuxcnc", ROTARY).toolpath
    for one, other in zip(_columns(path), _columns(tip if known else plain), strict=True):
        np.testing.assert_array_equal(one[1:], other[1:])
    if not known and "M428" in text:
        assert any("rotary_words: m428" in one.advice for one in path.constraints.refused.values())


def test_a_tcp_mode_means_the_same_where_rotary_words_turn_the_part() -> None:
    text = "G0 B0.\nG43.4 H1\nG1 X5. Y1. Z2. B20.\nG49\n"
    part, plain = (
        read("fanuc", text, options=options).toolpath for options in ({"rotary_words": "part"}, {})
    )
    np.testing.assert_array_equal(part.rotation[-1], plain.rotation[-1])


@pytest.mark.parametrize("name", ["sinumerik", "fanuc"])
def test_a_jump_to_a_block_number_that_no_block_has_leads_nowhere(name: str) -> None:
    """GOTOC goes on; any other one is an alarm, so that what is after it runs only where the jump does not."""
    body = "G1 X1. Y0. Z0.\n{}\nX2.\nN60 Y3.\nM30\n"
    plain = run(name, body.format("G4 F1" if name == "sinumerik" else "G4 X1."))
    condition = "IF $A_IN[1]==1 " if name == "sinumerik" else "IF [#1001 EQ 1] "
    jumps = ["GOTO N900" if name == "sinumerik" else "GOTO 900"]
    jumps += ["GOTOF N900", "GOTOB N0900", "GOTOC N900"] if name == "sinumerik" else []
    for jump in jumps:
        assert run(name, body.format(condition + jump)) == plain, jump
        assert (run(name, body.format(jump)) == plain) == (jump == "GOTOC N900"), jump
    assert run(name, body.format(condition + jumps[0].replace("900", "60"))) != plain


def test_a_jump_to_a_name_that_is_no_label_may_be_one_to_what_a_variable_names() -> None:
    body = "G1 X1 Y0 Z0\nIF $A_IN[1]==1 {}\nX2\nTHERE: Y3\nM30\n"
    assert run("sinumerik", body.format("GOTOC THERE")) == run("sinumerik", body.format("GOTOF THERE"))
    assert all("*" in end or "?" in end for end in run("sinumerik", body.format("GOTOC ELSEWHERE")))


def test_a_jump_to_a_computed_block_number_is_not_missed() -> None:
    body = "R1=900\nG1 X1 Y0 Z0\nIF $A_IN[1]==1 GOTOF N900\nX2\nN=R1 Y3\nM30\n"
    assert any("*" in end or "?" in end for end in run("sinumerik", body))
