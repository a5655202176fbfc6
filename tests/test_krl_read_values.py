"""What KRL's values mean: expressions, ways of arcs, relative targets, roundings, comments, other files."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document
from postproc.base.geometry import Poses, abc_from_rotation, rotation_from_abc
from postproc.base.units import DEG, MM
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.krl import KrlDialect
from postproc.languages.krl.expressions import evaluate
from postproc.languages.krl.spatial import angles, arc, product, rotation
from postproc.languages.krl.target import KrlTarget, UnknownValue
from postproc.toolpath import Kind

FULL = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"


def body(text: str, data: str = "", config: str = "") -> Program:
    docs = [Document(Path("part.src"), f"DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n{text}END\n".encode())]
    if data:
        docs.append(Document(Path("part.dat"), f"DEFDAT part\n{data}ENDDAT\n".encode()))
    given = (Document(Path("$config.dat"), config.encode()),) if config else ()
    return KrlDialect().read(tuple(docs), ReadingSettings(references=given))


def codes(program: Program) -> dict[int, str]:
    return {row: finding.code for row, finding in program.toolpath.constraints.refused.items()}


NAMES = {b"N": 7, b"R": 2.5, b"DEEP": True, b"MODE": b"#FAST"}


@pytest.mark.parametrize(
    ("text", "decided"),
    [("0.1+0.2<=0.3", None), ("0.1+0.2==0.3", None), ("SIN(30)<0.5", None), ("R==2.5", True), ("R<2.5001", True),
     ("30000000.0<30000000.5", None), ("3000000<3000001", True), ("SIN(30)<0.51", True)],
)  # fmt: skip
def test_the_last_digits_of_a_real_decide_nothing(text: str, decided: bool | None) -> None:
    found = evaluate(text.encode(), lambda name, path: NAMES.get(name))
    assert isinstance(found, UnknownValue) if decided is None else found is decided


@pytest.mark.parametrize(
    ("value", "x"),
    [("2.5", 3.0), ("2.4999", 2.0), ("SIN(30)*5", None), ("SIN(30)*4", 2.0)],
)
def test_the_last_digits_of_a_real_round_nothing(value: str, x: float | None) -> None:
    path = body(f"DECL INT k\nk={value}\nLIN {{X k,Y 2,Z 3,A 4,B 5,C 6}}\n").toolpath
    assert path.position[0, 0] == pytest.approx(x * MM) if x is not None else np.isnan(path.position[0, 0])


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1+2*3", 7), ("(1+2)*3", 9), ("7/2", 3), ("-7/2", -3), ("7/2.", 3.5), ("2*R-n", -2.0),
        ("-R", -2.5), ("- - 3", 3), ("'HFF'+1", 256), ("1E1", 10.0), ("1.5e-1*2", 0.3),
        ("SIN(30)", 0.5), ("cos ( 60 )", 0.5), ("ATAN2(1,-1)", 135.0), ("SQRT(2)*SQRT(2)", 2.0),
        ("ABS(-3)", 3), ("ACOS(0)", 90.0), ("TAN(45)", 1.0),
        ("N==7", True), ("N<>7", False), ("(N>=7) AND NOT (R>3)", True), ("DEEP EXOR TRUE", False),
        ("(N==1) OR (N==7)", True), ("mode==#fast", True), ("MODE==#SLOW", False),
        ("6 B_AND 3", 2), ("6 B_OR 1", 7), ("6 B_EXOR 3", 5), ("B_NOT 0", -1), ('"a"=="a"', True),
    ],
)  # fmt: skip
def test_expressions(text: str, value: object) -> None:
    found = evaluate(text.encode(), lambda name, path: NAMES.get(name))
    assert type(found) is type(value)
    assert found == (pytest.approx(value) if isinstance(value, float) else value)


@pytest.mark.parametrize(
    "text",
    ["1/0", "SQRT(-1)", "N AND 1", "1+", "+", "(1", "1)", "X", "F(1)", "1 2", "#A<#B", "DEEP+1", "NOT 1", "R:R",
     "{X 1}:{X 1}", "N[N.", "(" * 2000, "1=2", "SIN(1,2)", "'HG'", "TRUE==1", "{X 1"],
)  # fmt: skip
def test_what_has_no_value_is_unclear(text: str) -> None:
    assert isinstance(evaluate(text.encode(), lambda name, path: NAMES.get(name)), UnknownValue)


six = st.tuples(*[st.floats(-500, 500)] * 3, *[st.floats(-180, 180)] * 3)


@settings(deadline=None, max_examples=examples(40))
@given(six, st.tuples(*[st.floats(-500, 500)] * 3))
def test_a_frame_that_is_shifted_keeps_its_angles_to_the_last_bit(
    first: tuple[float, ...], shift: tuple[float, ...]
) -> None:
    """Also those beyond 180 deg, and A and C where B is 90 deg, which the rotation does not determine."""
    for angles_ in (first[3:], (first[3] + 360.0, *first[4:]), (first[3], 90.0, first[5])):
        assert product((*first[:3], *angles_), (*shift, 0.0, 0.0, 0.0))[3:] == angles_  # type: ignore[arg-type]


@settings(deadline=None, max_examples=examples(60))
@given(six, six)
def test_the_product_of_frames_is_that_of_their_poses(
    first: tuple[float, ...], second: tuple[float, ...]
) -> None:
    one = Poses.from_abc(np.array(first[:3]), np.array(first[3:]) * DEG)
    two = Poses.from_abc(np.array(second[:3]), np.array(second[3:]) * DEG)
    found = product(first, second)  # type: ignore[arg-type]
    np.testing.assert_allclose(found[:3], (one @ two).position, atol=1e-9)
    np.testing.assert_allclose(rotation_from_abc(np.array(found[3:]) * DEG), (one @ two).rotation, atol=1e-9)


def test_single_angles_are_those_of_batches() -> None:
    for abc in ((10.0, 20.0, 30.0), (-170.0, 90.0, 5.0), (0.0, -90.0, 33.0), (180.0, 0.0, 180.0)):
        r = rotation(*abc)
        np.testing.assert_allclose(r, rotation_from_abc(np.array(abc) * DEG), atol=1e-15)
        np.testing.assert_allclose(np.array(angles(r)) * DEG, abc_from_rotation(np.array(r)), atol=1e-9)


@settings(deadline=None, max_examples=examples(80))
@given(
    st.floats(0.5, 300),
    st.floats(5, 170),
    st.floats(175, 355),
    six,
    st.floats(-700, 700).filter(lambda a: abs(a) > 1),
)
def test_an_arc_passes_its_points_and_turns_by_its_angle(
    radius: float, through: float, end: float, frame: tuple[float, ...], angle: float
) -> None:
    place = Poses.from_abc(np.array(frame[:3]), np.array(frame[3:]) * DEG)

    def at(turn: float) -> tuple[float, float, float]:
        t = math.radians(turn)
        x, y, z = place.rotation @ [radius * math.cos(t), radius * math.sin(t), 0.0] + place.position
        return (x, y, z)

    found = arc(at(0), at(through), at(end), None)
    assert found is not None
    np.testing.assert_allclose(found.centre, place.position, atol=1e-6 * radius + 1e-7)
    np.testing.assert_allclose(found.normal, place.rotation[:, 2], atol=1e-6)
    assert found.sweep == pytest.approx(end, abs=1e-4)
    turned = arc(at(0), at(through), at(end), angle)
    assert turned is not None
    np.testing.assert_allclose(turned.end, at(angle), atol=1e-5 * radius + 1e-6)
    assert turned.sweep == pytest.approx(abs(angle))
    np.testing.assert_allclose(turned.normal, np.sign(angle) * place.rotation[:, 2], atol=1e-6)


def test_an_arc_of_the_program_is_in_metres_and_radians() -> None:
    path = body("LIN {X 100,Y 0,Z 50,A 0,B 0,C 0}\nCIRC {X 0,Y 100},{X -100,Y 0}\n").toolpath
    np.testing.assert_allclose(path.arcs.centre[1], [0, 0, 0.05], atol=1e-12)
    np.testing.assert_allclose(path.arcs.normal[1], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(path.arcs.sweep[1], math.pi)
    assert np.isnan(path.arcs.sweep[0])
    assert path.known.tolist() == [True, True]


def test_an_arc_behind_one_with_an_angle_begins_where_that_ends() -> None:
    path = body(
        "LIN {X 10,Y 0,Z 0,A 0,B 0,C 0}\nCIRC {X 0,Y 10},{X -10,Y 0},CA 90\nCIRC {X -10,Y 0},{X 0,Y -10}\n"
    ).toolpath
    np.testing.assert_allclose(path.position[1] / MM, [0, 10, 0], atol=1e-9)
    np.testing.assert_allclose(path.arcs.sweep[2], math.pi, atol=1e-9)


def test_places_of_an_arc() -> None:
    program = body("LIN {X 10,Y 0,Z 0,A 0,B 0,C 0}\nCIRC {Y 10,X 0},{X -10,Y 0}, CA 90.5 C_DIS ;way\n")
    raw, row = program.documents[0].raw, 1
    found = program.text.arcs[row]
    assert [raw[a:b] for a, b in zip(found.start, found.stop, strict=True)] == [b"0", b"10", b""]
    assert raw[found.operand.start : found.operand.stop] == b"{Y 10,X 0}"
    assert raw[found.angle.start : found.angle.stop] == b"90.5"
    word, operand, behind, end = program.text.motion[row].tolist()
    assert raw[word:end] == b"CIRC {Y 10,X 0},{X -10,Y 0}, CA 90.5 C_DIS"
    assert raw[operand:behind] == b"{X -10,Y 0}"
    assert program.text.inherits[row] == 0b111100


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("LIN_REL {X 10}", [110, 200, 300]),
        ("LIN_REL {X 10} #BASE", [110, 200, 300]),
        ("LIN_REL {X 10} #TOOL", [100, 210, 300]),
        ("LIN_REL {Z 10,A 0} #TOOL C_DIS", [100, 200, 310]),
        ("SPTP_REL {Y -5}", [100, 195, 300]),
    ],
)
def test_relative_targets(text: str, ends: list[float]) -> None:
    program = body(f"LIN {{X 100,Y 200,Z 300,A 90,B 0,C 0}}\n{text}\nLIN {{Z 0}}\n")
    path = program.toolpath
    np.testing.assert_allclose(path.position[1] / MM, ends, atol=1e-9)
    np.testing.assert_allclose(path.position[2] / MM, [*ends[:2], 0], atol=1e-9)
    relative = program.text.relative[1]
    raw = program.documents[0].raw
    assert raw[relative.word.start : relative.word.stop].endswith(b"_REL")
    assert relative.in_tool == ("#TOOL" in text)
    if relative.reference is not None:
        assert raw[relative.reference.start : relative.reference.stop] in (b"#BASE", b"#TOOL")


@pytest.mark.parametrize(
    "text", ["LIN_REL {X 10} #WORLD", "CIRC_REL {X 10,Y 10},{X 20} #WORLD", "LIN_REL {X .}"]
)
def test_behind_a_relative_motion_that_is_not_understood_nothing_is_taken_over(text: str) -> None:
    path = body(f"LIN {{X 100,Y 200,Z 300,A 90,B 0,C 0}}\n{text}\nLIN {{Z 0}}\nLIN_REL {{Z 1}}\n").toolpath
    assert [finding.code for finding in path.constraints.refused.values()][1:] == ["KRL004", "KRL008"]
    assert not np.isfinite(path.position[1:, 0]).any()
    assert set(path.constraints.locked) >= {0}


@pytest.mark.parametrize(
    ("setting", "word", "blend"),
    [
        ("$APO.CDIS=7.5", "C_DIS", 7.5), ("$APO.CDIS=7.5", "C_DIS C_DIS", 7.5), ("$APO.CDIS=7.5", "c_vel", None),
        ("$APO.CDIS=7.5", "C_DIS C_ORI", None), ("$APO.CDIS=7.5", "", 0.0), ("$APO={CPTP 50,CDIS 2}", "C_DIS", 2.0),
        ("BAS(#INITMOV,0)\nBAS(#BASE,1)", "C_DIS", 3.0), ("$ADVANCE=3", "C_DIS", None),
        ("$APO.CDIS=near", "C_DIS", None),
        ("LDAT_ACT={VEL 2,APO_DIST 12}\nBAS(#CP_DAT)", "C_DIS", 12.0),
        ("$APO.CDIS=4\nIF $IN[1] THEN\n$APO.CDIS=1\nENDIF", "C_DIS", None),
        ("$APO.CDIS=4\nIF $IN[1] THEN\n$VEL.CP=1\nENDIF", "C_DIS", 4.0),
    ],
)  # fmt: skip
def test_roundings(setting: str, word: str, blend: float | None) -> None:
    text = FULL.replace("\n", f" {word}\n")
    for lines in (1, 12):  # alone, and as a run
        path = body(f"{setting}\n{lines * text}").toolpath
        np.testing.assert_equal(path.approximation[-1], np.nan if blend is None else blend * MM)


def test_a_spline_is_passed_exactly_and_left_whole() -> None:
    program = body(FULL + "SPLINE\nSPL {X 5}\nSLIN {X 9}\nENDSPLINE C_SPL\n" + FULL)
    path = program.toolpath
    assert [Kind(k).name for k in path.kind] == ["LIN", "SPL", "LIN", "LIN"]
    np.testing.assert_equal(path.approximation, [0, 0, np.nan, 0])
    assert list(path.constraints.no_insert_before) == [1, 2]


def test_what_stands_behind_a_trigger_is_whole() -> None:
    program = body(FULL + "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE\n;a word\n" + FULL + FULL)
    assert list(program.toolpath.constraints.no_insert_before) == [1]


FORM = (
    ";FOLD LIN P1 Vel=1 m/s Tool[1] Base[{n}];%{{PE}}\nFDAT_ACT={{TOOL_NO 1,BASE_NO {n},IPO_FRAME #BASE}}\n"
    "BAS(#CP_PARAMS,{v})\n{m};ENDFOLD\n"
)


def test_an_inline_form_is_whole_where_it_sets_other_frames() -> None:
    text = "".join(FORM.format(n=n, v=v, m=FULL) for n, v in ((1, 0.5), (1, 0.2), (2, 0.2), (2, 0.2)))
    program = body(text + FULL)
    assert list(program.toolpath.constraints.no_insert_before) == [2]


def test_comments_on_lines_of_their_own_are_kept_once() -> None:
    text = (
        "; first\n;FOLD milling\nFOR i=1 TO 2\n;inside\n"
        + FULL
        + "ENDFOR\n"
        + FULL.replace("\n", " ;behind\n")
    )
    found = body(text + ";FORCE 0 0 1\n;last\n").toolpath
    assert [(note.row, note.text, note.line) for note in found.comments] == [
        (0, "first", 4), (0, "FOLD milling", 5), (0, "inside", 7), (3, "last", 12),
    ]  # fmt: skip
    assert [note.row for note in found.annotations] == [3]


CONFIG = """DEFDAT $CONFIG PUBLIC
DECL GLOBAL E6POS XAWAY={X 1,Y 1,Z 1,A 0,B 0,C 0,S 2,T 3}
DECL REAL DEF_VEL_CP=2.0
DECL REAL level=5.0
DECL FRAME BASE_DATA[2]
BASE_DATA[1]={X 5,Y 5,Z 5,A 0,B 0,C 0}
ENDDAT
"""


def test_points_of_another_file_are_known_and_never_edited() -> None:
    program = body("LIN XAWAY\n", config=CONFIG)
    assert not program.toolpath.constraints.refused
    assert program.text.locked[0]
    assert (program.text.start[0] == -1).all()
    assert program.text.variables[0].words == b"S 2,T 3"
    assert program.toolpath.frames[0].pose is None  # what BASE_DATA holds is the cell's to say


def test_a_number_of_another_file_may_change() -> None:
    assert codes(body("LIN {X level,Y 0,Z 0,A 0,B 0,C 0}\n", config=CONFIG)) == {0: "KRL002"}


def test_the_modules_own_point_goes_before_that_of_another_file() -> None:
    program = body("LIN XAWAY\n", "DECL E6POS XAWAY={X 9,Y 9,Z 9,A 0,B 0,C 0}\n", CONFIG)
    np.testing.assert_allclose(program.toolpath.position[0] / MM, [9, 9, 9])
    assert program.text.home[0] == 1


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("x=50\nLIN {X x,Y 0,Z 0,A 0,B 0,C 0}\n", {0: "KRL002"}),
        ("DECL REAL x\nx=50\nLIN {X x,Y 0,Z 0,A 0,B 0,C 0}\n", {}),
        ("DECL REAL x\nx=50\nother(x)\nLIN {X x,Y 0,Z 0,A 0,B 0,C 0}\n", {0: "KRL002"}),
        ("DECL REAL x\nx=$POS_ACT.X\nLIN {X x,Y 0,Z 0,A 0,B 0,C 0}\n", {0: "KRL002"}),
        (
            "DECL REAL x\nINTERRUPT DECL 5 WHEN $IN[1] DO x=9\nx=1\nLIN {X x,Y 0,Z 0,A 0,B 0,C 0}\n",
            {0: "KRL002"},
        ),
        ("DECL FRAME P\nP.X=1\nLIN P\n", {0: "KRL002"}),
        ("P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP.X=$IN[1]\nLIN P\nP.X=4\nLIN P\n", {0: "KRL002"}),
        ("LIN 5\n", {0: "KRL001"}),
        ("DECL INT n\nn=5\nLIN n\n", {0: "KRL001"}),
        (FULL + "LIN {X 3} ELSE\n", {1: "KRL001"}),
        ("SLIN {X 1,Y 2,Z 3,A 4,B 5,C 6} WITH $BASE=EK(A,B,C)\n" + FULL, {0: "KRL011"}),
        ("SLIN {X 1,Y 2,Z 3,A 4,B 5,C 6} WITH $BASE=away\n" + FULL, {0: "KRL012"}),
    ],
)
def test_what_is_known(text: str, code: dict[int, str]) -> None:
    assert codes(body(text)) == code


@pytest.mark.parametrize(
    ("text", "data", "words", "kind"),
    [
        (
            "LIN P1\n",
            "DECL E6POS P1={X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 'B11',E1 0.0,E2 1.50}\n",
            b"S 2,T 3,E1 0.0,E2 1.50",
            b"E6POS",
        ),
        ("LIN P1\n", "FRAME P1={X 1,Y 2,Z 3,A 4,B 5,C 6}\n", b"", b"FRAME"),
        ("DECL POS P1\nP1={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP1.S=4\nLIN P1\n", "", b"S 4", b"POS"),
    ],
)
def test_what_an_own_point_takes_over(text: str, data: str, words: bytes, kind: bytes) -> None:
    program = body(text, data)
    variable = program.text.variables[0]
    assert (variable.name, variable.words, variable.type) == (b"P1", words, kind)
    if data:
        assert variable.declared is not None
        span = variable.declared
        assert program.documents[span.file].raw[span.start : span.stop] == data.rstrip().encode()
    _, operand, behind, end = program.text.motion[0].tolist()
    assert program.documents[0].raw[operand:behind] == b"P1"
    assert behind == end


def test_a_component_that_is_assigned_has_its_own_place() -> None:
    program = body("XP1.Z=8\nLIN XP1\n", "DECL FRAME XP1={X 1,Y 2,Z 3,A 4,B 5,C 6}\n")
    assert program.text.file[0].tolist() == [1, 1, 0, 1, 1, 1]
    assert program.documents[0].raw[program.text.start[0, 2] : program.text.stop[0, 2]] == b"8"
    np.testing.assert_allclose(program.toolpath.position[0] / MM, [1, 2, 8])


def test_a_target_of_the_text_is_a_value() -> None:
    assert isinstance(evaluate(b"{X 1,Y 2}", lambda name, path: None), KrlTarget)


RECORDS = (
    "DECL E6POS XP1={X 1,Y 2,Z 3,A 0,B 0,C 0}\nDECL FDAT FP1={TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE}\n"
    "DECL LDAT LP1={VEL 0.5,APO_DIST 10.0}\n"
)


@pytest.mark.parametrize(
    "change", ["", "FP1.BASE_NO=4\n", "FP1.TOOL_NO=N\n", "FP1=FP2\n", "FP1.IPO_FRAME=#TCP\n"]
)
def test_an_fdat_that_the_program_changes_is_not_what_its_file_states(change: str) -> None:
    program = body(f"{change}FDAT_ACT=FP1\nBAS(#FRAMES)\nLIN XP1\n", RECORDS)
    assert codes(program) == ({0: "KRL005"} if change else {})


@pytest.mark.parametrize("change", ["", "LP1.VEL=1.5\nLP1.APO_DIST=20\n", "LP1={VEL 1.5,APO_DIST 20}\n"])
@pytest.mark.parametrize("use", ["LDAT_ACT=LP1\nBAS(#CP_PARAMS)", "$VEL.CP=SVEL_CP(0,0,LP1)\n$APO=SAPO(LP1)"])
def test_an_ldat_that_the_program_changes_is_not_what_its_file_states(change: str, use: str) -> None:
    path = body(f"FDAT_ACT=FP1\nBAS(#FRAMES)\n{change}{use}\nLIN XP1 C_DIS\n", RECORDS).toolpath
    assert np.isfinite([path.feed[0], path.approximation[0]]).all() == (not change)


@pytest.mark.parametrize(
    ("value", "known"), [("2147483647", True), ("2147483647+1", False), ("50000*50000", False)]
)
def test_an_int_that_overflows_has_no_value(value: str, known: bool) -> None:
    assert isinstance(evaluate(value.encode(), lambda name, path: None), UnknownValue) == (not known)


@pytest.mark.parametrize(("declared", "known"), [("DECL POS P\n", True), ("", False)])
def test_what_an_aggregate_omits_may_have_a_value_in_a_variable_of_another_file(
    declared: str, known: bool
) -> None:
    path = body(f"{declared}{FULL}P={{X 7}}\nLIN P\n").toolpath
    assert np.isfinite(path.position[1]).all() == known
