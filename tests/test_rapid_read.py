"""What the reader makes of RAPID: cases beside their dumps, and laws over variants of them."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from case_files import RAPID_CASES, refusals

from postproc.base.geometry import rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.languages import detect
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.rapid.parsing import ModuleParser
from postproc.languages.rapid.quaternions import quaternion_from_rotation, rotation_from_quaternion

CASES = RAPID_CASES
RAPID = CASES.dialect
TARGET = "[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"


read, codes = CASES.read, refusals


def body(text: str, data: str = "") -> Program:
    tool = "PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];\n"
    return read(f"MODULE part\n{tool}{data}PROC main()\n{text}ENDPROC\nENDMODULE\n")


VARIANTS = {
    "crlf": lambda raw: raw.replace(b"\n", b"\r\n"),
    "bom": lambda raw: b"\xef\xbb\xbf" + raw,
    "no final newline": lambda raw: raw.rstrip(b"\n"),
    "tabs": lambda raw: raw.replace(b" ", b"\t"),
    "wide": lambda raw: re.sub(rb"(?<!:)([,\[\]])", rb" \1 ", raw),
    "upper case": lambda raw: raw.upper(),
    "indented": lambda raw: raw.replace(b"\n", b"\n   "),
    "other comments": lambda raw: re.sub(rb";\n", b"; ! said\n", raw),
}


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("path", CASES.good, ids=lambda path: path.stem)
def test_spelling_does_not_matter(path: Path, name: str) -> None:
    raw = path.read_bytes()
    if name == "tabs" and b"%%%" in raw:
        pytest.skip("the header is no statement")
    varied = [re.sub(r"\bnan\b", "NAN", line) for line in read(VARIANTS[name](raw)).toolpath.dump()]
    assert varied == list(read(raw).toolpath.dump())


@pytest.mark.parametrize("path", [*CASES.good, *CASES.bad], ids=lambda path: path.stem)
def test_lists_of_numbers_are_taken_as_the_general_rules_take_them(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    raw = path.read_bytes()
    fast = ModuleParser(raw, fast=False).file()
    monkeypatch.setattr("postproc.languages.rapid.expression_syntax.NUMBER_LIST", re.compile(rb"(?!)"))
    assert ModuleParser(raw, fast=False).file() == fast


APPENDED = (" foo", ",foo", "\\Foo", "+1", "[1]", " @", "{1}", ".x", " 5", "\\Foo:=3")


@pytest.mark.parametrize("word", APPENDED)
@pytest.mark.parametrize(
    "statement", [f"MoveL {TARGET},v100,z1,t", "MoveAbsJ [[0,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v5,z1,t"]
)
def test_a_word_more_is_another_reading_or_a_finding(statement: str, word: str) -> None:
    """No token is dropped: at every place of a statement a further one is seen."""
    plain = body(statement + ";\n")
    assert not plain.findings
    places = [found.end() for found in re.finditer(r"[\w\]]+", statement)]
    for at in places:
        if statement[:at].endswith("9E9") and word == "+1":
            continue  # an axis that is not there either
        program = body(statement[:at] + word + statement[at:] + ";\n")
        same = list(program.toolpath.dump()) == list(plain.toolpath.dump()) and np.array_equal(
            program.toolpath.approximation, plain.toolpath.approximation, equal_nan=True
        )
        assert program.findings or not same, statement[:at] + word


def test_off_in_a_branch_is_what_no_comment_is() -> None:
    text = (CASES.folder / "bad" / "force_differs.mod").read_text()
    cut = "IF DInput(d)=1 THEN\n! FORCE 0 9 0\ncut;\n! force  off\nENDIF\n"
    found = read(text.replace("! FORCE 0 9 0\ncut;\n! FORCE OFF\n", cut).encode()).toolpath
    assert [(note.row, note.text) for note in found.annotations] == [(0, "FORCE 0 9 0"), (1, "force  off")]
    codes = {finding.code for finding in found.constraints.refused.values()}
    assert "RAP006" in codes  # of the call under FORCE 0 9 0 and of the one without


def test_zones_and_stops() -> None:
    path = read((CASES.folder / "zones.mod").read_bytes()).toolpath
    assert path.approximation / MM == pytest.approx([0, 0.3, 200, 3, 4, 0, 0, np.nan], nan_ok=True)
    assert path.stops.tolist() == [True, False, False, False, False, True, True, False]


def test_forces_are_those_of_the_comments_that_were_passed_last() -> None:
    path = read((CASES.folder / "remarks.mod").read_bytes()).toolpath
    assert [(note.row, note.text) for note in path.annotations] == [
        (0, "FORCE 0 100 50 @feed"), (1, "force off"), (2, "COMPENSATE OFF"),
    ]  # fmt: skip
    assert [note.text for note in path.comments] == ["plain ! words", "!!"]


def test_the_place_of_a_motion_in_the_flow() -> None:
    path = read((CASES.folder / "jumps.mod").read_bytes()).toolpath
    assert path.continues.tolist()[:3] == [False, False, False]
    assert dict(path.predecessors) == {0: (-1, 1), 1: (0,), 2: (0,)}
    straight = read((CASES.folder / "arrays.mod").read_bytes()).toolpath
    assert straight.continues.all()


def test_what_is_inserted_before() -> None:
    forms = read((CASES.folder / "forms.mod").read_bytes()).toolpath
    assert sorted(forms.constraints.no_insert_before) == [0, 2, 3, 5]
    lines = read((CASES.folder / "several_lines.mod").read_bytes()).toolpath
    assert sorted(lines.constraints.no_insert_before) == [0, 1, 2]


def test_conf_decides_where_motions_may_be_inserted() -> None:
    other = TARGET.replace("[0,0,0,0]", "[0,1,0,0]")
    moves = f"MoveL {TARGET},v100,z1,t;\nMoveL {other},v100,z1,t;\n"
    assert list(body(moves).toolpath.constraints.no_insert_before) == [0, 1]
    assert not body("ConfL\\Off;\n" + moves).toolpath.constraints.no_insert_before
    assert list(
        body("IF di1=1 THEN\nConfL\\Off;\nENDIF\n" + moves).toolpath.constraints.no_insert_before
    ) == [0, 1]


def test_the_cell_binds_tools_and_work_objects_that_the_file_does_not_declare() -> None:
    text = f"MODULE m\nPROC main()\nMoveL {TARGET},v100,z1,tSp\\WObj:=wP;\nENDPROC\nENDMODULE\n"
    assert codes(read(text)) == {0: "RAP005"}
    pose = dict(zip("XYZABC", (1.0, 2.0, 3.0, 10.0, 20.0, 30.0), strict=True))
    program = read(text, ReadingSettings(symbols={"TSP": 7.0, "WP": pose}))
    path = program.toolpath
    assert not codes(program)
    assert (path.frames[path.tool[0]].number, path.frames[path.tool[0]].pose) == (7, None)
    base = path.frames[path.base[0]].pose
    assert base is not None
    assert base.position == pytest.approx([1e-3, 2e-3, 3e-3])
    assert base.rotation == pytest.approx(rotation_from_abc(np.array([10, 20, 30]) * DEG))
    declared = text.replace(
        "PROC main", "PERS tooldata tSp:=[TRUE,[[0,0,9],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\nPROC main"
    )
    own = read(declared, ReadingSettings(symbols={"TSP": 7.0, "WP": pose})).toolpath
    assert own.frames[own.tool[0]].number is None
    assert codes(read(text, ReadingSettings(symbols={"TSP": 7.5, "WP": 1.0}))) == {0: "RAP005"}


def test_what_reads_the_position_locks_the_motion_before() -> None:
    program = body(f"MoveL {TARGET},v100,z1,t;\np:=CRobT();\n", "VAR robtarget p;\n")
    assert {row: why.code for row, why in program.toolpath.constraints.locked.items()} == {0: "RAP002"}


def test_a_refused_arc_locks_its_start() -> None:
    program = body(f"MoveL {TARGET},v100,z1,t;\nMoveC {TARGET},pOther,v100,z1,t;\n")
    assert list(program.toolpath.constraints.locked) == [0]


def test_a_flow_that_is_too_long_corrects_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = "".join(f"PROC r{n}()\n" + f"r{n + 1};\n" * 12 + "ENDPROC\n" for n in range(9))
    text = f"MODULE m\nPROC main()\nr0;\nENDPROC\n{calls}PROC r9()\nMoveL {TARGET},v100,z1,tool0;\nENDPROC\nENDMODULE\n"
    monkeypatch.setattr("postproc.languages.rapid.step_budget.MOST_STEPS", 2000)
    program = read(text)
    assert "RAP017" in {finding.code for finding in program.findings}
    assert len(codes(program)) == len(program.toolpath) == 1


@pytest.mark.parametrize("seed", range(3))
def test_quaternions_and_rotations(seed: int) -> None:
    random = np.random.default_rng(seed)
    quaternion = random.normal(size=(200, 4))
    quaternion[:4] = np.eye(4)
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    rotation = rotation_from_quaternion(quaternion)
    assert rotation @ np.swapaxes(rotation, 1, 2) == pytest.approx(np.broadcast_to(np.eye(3), (200, 3, 3)))
    assert np.linalg.det(rotation) == pytest.approx(np.ones(200))
    assert quaternion_from_rotation(rotation, quaternion) == pytest.approx(quaternion)
    half = random.normal(size=3) * 0.5
    size = np.linalg.norm(half)
    one = np.concatenate([[np.cos(size)], np.sin(size) * half / size])
    axis = rotation_from_quaternion(one[None])[0] @ (half / size)
    assert axis == pytest.approx(half / size)
    assert np.isnan(rotation_from_quaternion(np.array([[1.0, 0.2, 0, 0]]))).all()


def test_programs_in_other_languages_are_not_claimed() -> None:
    for name in ("krl/arcs.src", "fanuc/program.nc"):
        path = CASES.folder.parent / name
        assert detect(path, path.read_bytes()) is not RAPID


def test_the_sample_can_be_made_again_and_is_understood() -> None:
    folder = CASES.folder.parents[2] / "samples" / "irb6700_pocket"
    made = subprocess.run([sys.executable, folder / "make_pocket.py"], check=True, capture_output=True)
    raw = (folder / "pocket.mod").read_bytes()
    assert made.stdout.splitlines() == raw.splitlines()
    program = read(raw, ReadingSettings(symbols={"TSPINDLE": 1.0}))
    assert len(program.toolpath) == 25
    assert not program.findings


LINES = [f"MoveL [[{x},2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z5,t;\n" for x in range(4)]


@pytest.mark.parametrize(
    ("between", "zone"),
    [
        ("", 5), ("SetDO out1,1;", 5), ("i:=1;", 5), ("! a remark", 5), ("AccSet 50,50;", 5), ("quick;", 5),
        ("WaitTime 0.5;", 0), ("WaitTime \\InPos,0;", 0), ("Stop;", 0), ("WaitRob \\InPos;", 0), ("slow;", 0),
        ("WaitTime 0;", np.nan), ("WaitDI in1,1;", np.nan), ("unread;", np.nan), ("WaitTime how_long;", np.nan),
        ("IF ready WaitTime 1;", np.nan), ("IF ready THEN\nSetDO out1,1;\nENDIF", 5),
    ],
)  # fmt: skip
def test_a_motion_before_which_the_program_waits_is_not_planned_ahead(between: str, zone: float) -> None:
    text = "".join(LINES[:2]) + between + "\n" + "".join(LINES[2:])
    tool = "PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];\nVAR num i;\n"
    routines = "PROC slow()\nWaitTime 1;\nENDPROC\nPROC quick()\nSetDO out1,1;\nENDPROC\n"
    path = read(f"MODULE part\n{tool}PROC main()\n{text}ENDPROC\n{routines}ENDMODULE\n").toolpath
    np.testing.assert_allclose(path.approximation * 1000, [5, zone, 5, 5])
    assert path.stops.tolist() == [False, zone == 0, False, False]
