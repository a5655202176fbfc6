"""What the reader makes of Fanuc TP: cases beside their dumps, and laws over variants of them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from case_files import TP_CASES, refusals

from postproc.base.units import MM
from postproc.languages import detect
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.tp.position_data import COMMON_POINT, read_positions
from postproc.toolpath.initial_state import InitialState

CASES = TP_CASES
NAN = float("nan")
TP = CASES.dialect
POINT = """P[{n}]{{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X = {x:9.3f}  mm,	Y =     2.000  mm,	Z =     3.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
}};
"""


read, codes = CASES.read, refusals


def body(*statements: str, points: int = 9) -> Program:
    """A program of statements as they are after their line numbers."""
    lines = "".join(f"{n:4d}:{one} ;\n" for n, one in enumerate(statements, 1))
    data = "".join(POINT.format(n=n, x=10.0 * n) for n in range(1, points + 1))
    return read(f"/PROG PART\n/ATTR\nLINE_COUNT\t= {len(statements)};\n/MN\n{lines}/POS\n{data}/END\n")


VARIANTS = {
    "crlf": lambda raw: raw.replace(b"\n", b"\r\n"),
    "bom": lambda raw: b"\xef\xbb\xbf" + raw,
    "no final newline": lambda raw: raw.rstrip(b"\n"),
    "tabs": lambda raw: raw.replace(b" ", b"\t"),
    "wide": lambda raw: re.sub(rb"([,={}])(?![^\[\n]*\])", rb" \1 ", raw),
    "lower case": lambda raw: raw.lower(),
    "indented": lambda raw: raw.replace(b"\n", b"\n   "),
}


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("path", CASES.good, ids=lambda path: path.stem)
def test_spelling_does_not_matter(path: Path, name: str) -> None:
    raw = path.read_bytes()
    assert list(read(VARIANTS[name](raw)).toolpath.dump()) == list(read(raw).toolpath.dump())


@pytest.mark.parametrize("path", [*CASES.good, *CASES.bad], ids=lambda path: path.stem)
def test_points_are_taken_as_the_general_rules_take_them(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    raw = path.read_bytes()
    quick = read_positions(raw, 0, len(raw))
    monkeypatch.setattr("postproc.languages.tp.position_data.COMMON_POINT", re.compile(rb"(?!)"))
    assert read_positions(raw, 0, len(raw)) == quick


def test_common_points_are_taken_at_once() -> None:
    text = POINT.format(n=1, x=10.0).encode()
    assert COMMON_POINT.match(text, text.index(b"{") + 1) is not None


APPENDED = (" foo", ",foo", "+1", "[1]", " @", " 5", "Offset", " FINE", ":", "J")
MOTIONS = (
    "L P[2] 50mm/sec CNT100 ACC80",
    "J P[2] 50% FINE",
    "C P[2] P[3] 50mm/sec FINE",
    "L P[2] R[1]mm/sec CR5 PTH",
)


@pytest.mark.parametrize("word", APPENDED)
@pytest.mark.parametrize("statement", MOTIONS)
def test_a_word_more_is_another_reading_or_a_finding(statement: str, word: str) -> None:
    """No token is dropped: at every place of a statement a further one is seen."""
    frames = ("UFRAME_NUM=1", "UTOOL_NUM=1", "L P[1] 50mm/sec FINE")
    plain = body(*frames, statement)
    assert plain.text.moves[1] is not None
    for at in [found.end() for found in re.finditer(r"[\w\]%]+", statement)]:
        program = body(*frames, statement[:at] + word + statement[at:])
        same = list(program.toolpath.dump()) == list(plain.toolpath.dump())
        same = same and program.text.moves[1] == plain.text.moves[1]
        assert program.findings != plain.findings or not same, statement[:at] + word + statement[at:]


WORDS = (
    "UFRAME_NUM=1",
    "R[1]=R[2]+1",
    "JMP LBL[1]",
    "IF R[1]=1,JMP LBL[1]",
    "CALL OTHER",
    "END",
    "WAIT R[1]",
)


@pytest.mark.parametrize("statement", WORDS)
def test_a_statement_with_a_word_more_is_not_read_as_without(statement: str) -> None:
    plain = body("UTOOL_NUM=1", "LBL[1]", statement)
    assert "FTP001" not in {finding.code for finding in plain.findings}
    for word in (" foo", "foo", " 5 6"):
        program = body("UTOOL_NUM=1", "LBL[1]", statement + word)
        if statement.startswith(("WAIT", "R[1]", "UFRAME")) or statement + word == "CALL OTHERfoo":
            continue  # a value that is not known, another name
        assert "FTP001" in {finding.code for finding in program.findings}, statement + word


def test_corners_and_stops() -> None:
    path = read((CASES.folder / "corners.ls").read_bytes()).toolpath
    nan = np.nan
    assert path.approximation / MM == pytest.approx([0, nan, nan, nan, 10, 0], nan_ok=True)
    assert path.stops.tolist() == [True, False, False, False, False, True]


@pytest.mark.parametrize(
    ("between", "corner"),
    [
        ((), 5), (("DO[1]=ON",), 5), (("!note",), 5), (("R[1]=2",), 5), (("WAIT   .50(sec)",), 0),
        (("WAIT 2(sec)",), 0), (("PAUSE",), 0), (("WAIT .00(sec)",), NAN), (("WAIT DI[1]=ON",), NAN),
        (("WAIT R[3]",), NAN),
        (("WAIT DI[1]=ON TIMEOUT,LBL[1]", "LBL[1]"), NAN), (("IF DI[1]=ON,WAIT 1(sec)",), NAN),
    ],
)  # fmt: skip
def test_a_motion_before_which_the_program_waits_is_exact(between: tuple[str, ...], corner: float) -> None:
    motions = [f"L P[{number}] 50mm/sec CR5" for number in range(1, 5)]
    path = body("UFRAME_NUM=1", "UTOOL_NUM=1", *motions[:2], *between, *motions[2:]).toolpath
    assert path.approximation / MM == pytest.approx([5, corner, 5, 5], nan_ok=True)
    assert path.stops.tolist() == [False, corner == 0, False, False]


def test_forces_are_those_of_the_comments_that_were_passed_last() -> None:
    path = read((CASES.folder / "remarks.ls").read_bytes()).toolpath
    assert [(note.row, note.text) for note in path.annotations] == [
        (0, "FORCE 0 100 50 @feed"), (1, "force off"), (2, "COMPENSATE OFF"),
    ]  # fmt: skip
    assert [note.text for note in path.comments] == ["plain ; words", "L P[5] 50mm/sec FINE"]


def test_a_comment_in_force_below_another_one_is_repeated() -> None:
    path = read((CASES.folder / "remarks_jumped.ls").read_bytes()).toolpath
    assert [(note.row, note.text) for note in path.annotations] == [(0, "FORCE 0 100 50")]
    program = body(
        "UFRAME_NUM=1", "UTOOL_NUM=1", "!FORCE 1 2 3", "JMP LBL[1]", "LBL[2]", "L P[1] 50mm/sec FINE", "END",
        "LBL[1]", "!FORCE OFF", "L P[2] 50mm/sec FINE", "!FORCE 7 8 9", "JMP LBL[2]",
    )  # fmt: skip
    notes = [(note.row, note.text) for note in program.toolpath.annotations]
    assert notes == [(0, "FORCE 1 2 3"), (0, "FORCE 7 8 9"), (1, "FORCE OFF"), (2, "FORCE 7 8 9")]


def test_off_in_a_branch_is_what_no_comment_is() -> None:
    program = body(
        "UFRAME_NUM=1", "UTOOL_NUM=1", "IF DI[1]=ON,JMP LBL[1]", "!FORCE 1 2 3", "L P[1] 50mm/sec FINE", "!FORCE OFF",
        "LBL[1]", "L P[2] 50mm/sec FINE",
    )  # fmt: skip
    assert not program.toolpath.constraints.refused
    notes = [(note.row, note.text) for note in program.toolpath.annotations]
    assert notes == [(0, "FORCE 1 2 3"), (1, "FORCE OFF")]


def test_the_place_of_a_motion_in_the_flow() -> None:
    path = read((CASES.folder / "jumps.ls").read_bytes()).toolpath
    assert path.continues.tolist() == [True, False, False, False]
    assert dict(path.predecessors) == {1: (0, 1), 2: (-2,), 3: (1,)}


def test_what_is_inserted_before() -> None:
    options = read((CASES.folder / "options.ls").read_bytes()).toolpath
    assert sorted(options.constraints.no_insert_before) == [3, 4, 5, 6, 7, 8]
    turned = read((CASES.folder / "configurations.ls").read_bytes()).toolpath
    assert sorted(turned.constraints.no_insert_before) == [1, 2, 4]


def test_frames_in_force_before_the_first_statement_are_those_of_the_cell() -> None:
    raw = (CASES.folder / "frames_of_points.ls").read_bytes()
    assert {finding.code for finding in read(raw).findings} == {"FTP017"}
    known = read(raw, ReadingSettings(initial=InitialState(tool=1, base=1)))
    assert codes(known) == {1: "FTP005"}
    assert "UFRAME" in known.toolpath.constraints.refused[1].message


def test_what_reads_the_position_locks_the_motion_before() -> None:
    program = body("UFRAME_NUM=1", "UTOOL_NUM=1", "L P[1] 50mm/sec FINE", "PR[1]=LPOS")
    assert {row: why.code for row, why in program.toolpath.constraints.locked.items()} == {0: "FTP002"}


def test_a_refused_arc_locks_its_start() -> None:
    program = body("UFRAME_NUM=1", "UTOOL_NUM=1", "L P[1] 50mm/sec FINE", "C P[2] PR[3] 50mm/sec FINE")
    assert list(program.toolpath.constraints.locked) == [0]
    run = read((CASES.folder / "bad" / "arc_run_off.ls").read_bytes()).toolpath
    assert sorted(run.constraints.refused) == [2, 3, 4, 5, 6]
    assert list(run.constraints.locked) == [1]


def test_w_p_r_turn_about_the_fixed_axes_x_y_z() -> None:
    rotation = read((CASES.folder / "rotations.ls").read_bytes()).toolpath.rotation
    assert rotation[0] @ [0, 1, 0] == pytest.approx([0, 0, 1])
    assert rotation[1] @ [0, 0, 1] == pytest.approx([1, 0, 0])
    assert rotation[2] @ [1, 0, 0] == pytest.approx([0, 1, 0])
    parts = []
    for angle, (i, j) in zip(np.radians([-170, -30, 45]), [(1, 2), (2, 0), (0, 1)], strict=True):
        part = np.eye(3)
        part[i, i] = part[j, j] = np.cos(angle)
        part[j, i], part[i, j] = np.sin(angle), -np.sin(angle)
        parts.append(part)
    assert rotation[3] == pytest.approx(parts[2] @ parts[1] @ parts[0])


def test_programs_in_other_languages_are_not_claimed() -> None:
    for name in ("krl/arcs.src", "fanuc/program.nc", "rapid/arc.mod"):
        path = CASES.folder.parent / name
        assert detect(path, path.read_bytes()) is not TP


def test_the_sample_can_be_made_again_and_is_understood() -> None:
    folder = CASES.folder.parents[2] / "samples" / "m900ib_pocket"
    made = subprocess.run([sys.executable, folder / "make_pocket.py"], check=True, capture_output=True)
    raw = (folder / "pocket.ls").read_bytes()
    assert made.stdout.splitlines() == raw.splitlines()
    program = read(raw)
    assert len(program.toolpath) == 25
    assert not program.findings
