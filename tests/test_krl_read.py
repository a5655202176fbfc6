"""What the reader makes of KRL: cases beside their dumps, and laws over variants of them."""

from __future__ import annotations

import os
import re
from operator import attrgetter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document
from postproc.base.findings import CODES, Refusal
from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.languages import detect
from postproc.languages.dialect import Program, ReadingSettings
from postproc.languages.krl import KrlDialect, interpreter
from postproc.languages.krl.lexing import number
from postproc.toolpath import Kind

KRL = KrlDialect()
CASES = Path(__file__).parent / "programs" / "krl"
GOOD = sorted(CASES.glob("*.src"))
BAD = sorted((CASES / "bad").glob("*.src"))
FRAMES = "BAS(#BASE,1)\nBAS(#TOOL,1)\n"
WRITTEN = {"KRL007", "KRL033", "FIL011"}
"""Codes that only a writer gives, or who knows the frames or the folder."""

FULL = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"


def documents(path: Path) -> tuple[Document, ...]:
    return tuple(Document(p, p.read_bytes()) for p in (path, *KRL.companions(path)))


def references(path: Path) -> tuple[Document, ...]:
    """The $config.dat of a case."""
    config = path.with_suffix(".config.dat")
    return (Document(config, config.read_bytes()),) if config.exists() else ()


def case(path: Path) -> Program:
    return KRL.read(documents(path), ReadingSettings(references=references(path)))


def read(text: str | bytes, data: str = "") -> Program:
    raw = text if isinstance(text, bytes) else text.encode("latin-1")
    docs = [Document(Path("part.src"), raw)]
    if data:
        docs.append(Document(Path("part.dat"), f"DEFDAT part\n{data}ENDDAT\n".encode()))
    return KRL.read(tuple(docs))


def body(text: str, data: str = "") -> Program:
    """A program with base and tool set and this text in its DEF."""
    return read(f"DEF part()\n{FRAMES}{text}END\n", data)


def codes(program: Program) -> dict[int, str]:
    return {row: finding.code for row, finding in program.toolpath.constraints.refused.items()}


def told(program: Program) -> list[str]:
    return [finding.code for finding in program.findings]


@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
def test_a_case_reads_as_its_dump(path: Path) -> None:
    assert list(case(path).toolpath.dump()) == path.with_suffix(".dump").read_text().splitlines()


@pytest.mark.parametrize("path", BAD, ids=lambda path: path.stem)
def test_a_bad_case_gives_the_codes_of_its_first_line(path: Path) -> None:
    program = KRL.read(documents(path))
    expected = path.read_text().splitlines()[0].removeprefix("; ").split()
    assert sorted({finding.code for finding in program.findings}) == expected
    for finding in program.findings:
        assert finding.file == str(path)
        assert finding.line > 0
        assert finding.help or CODES[finding.code].explanation


def test_every_code_has_a_case() -> None:
    shown = {code for path in BAD for code in path.read_text().splitlines()[0].removeprefix("; ").split()}
    assert {code for code in CODES if code.startswith("KRL")} - WRITTEN <= shown


VARIANTS = {
    "crlf": lambda raw: raw.replace(b"\n", b"\r\n"),
    "bom": lambda raw: b"\xef\xbb\xbf" + raw,
    "no final newline": lambda raw: raw.rstrip(b"\n"),
    "tabs": lambda raw: raw.replace(b" ", b"\t"),
    "wide": lambda raw: raw.replace(b",", b"  ,  ").replace(b"{", b"{ ").replace(b"}", b" }"),
    "wide assignments": lambda raw: re.sub(rb"(?<![<>=])=(?!=)", b" = ", raw),
    "indented": lambda raw: raw.replace(b"\n", b"\n   "),
    "lower": bytes.lower,
    "upper": bytes.upper,
    "latin-1": lambda raw: raw.replace(b"\n", b" ; gr\xf6\xdfer \xb5m\n"),
    "blank ends": lambda raw: raw.replace(b"\n", b" \t\n"),
}


@pytest.mark.sample(55)
@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("path", GOOD, ids=lambda path: path.stem)
def test_spelling_does_not_change_what_is_read(path: Path, variant: str) -> None:
    change = VARIANTS[variant]
    plain = documents(path)
    varied = tuple(Document(d.path, change(d.raw)) for d in plain)
    said = ReadingSettings(references=references(path))
    assert list(KRL.read(varied, said).toolpath.dump()) == list(KRL.read(plain, said).toolpath.dump())


@pytest.mark.sample(19)
@pytest.mark.parametrize("path", [*GOOD, *BAD], ids=lambda path: path.stem)
def test_the_quick_way_and_the_general_way_are_one(path: Path) -> None:
    same(documents(path))


def same(docs: tuple[Document, ...]) -> None:
    quick, general = interpreter.read(docs, fast=True), interpreter.read(docs, fast=False)
    bare = interpreter.read(docs, places=False)
    assert list(quick.toolpath.dump()) == list(general.toolpath.dump())
    for name in (
        "position",
        "rotation",
        "axes",
        "feed",
        "base",
        "tool",
        "line",
        "approximation",
        "arcs.sweep",
    ):
        column = attrgetter(name)
        np.testing.assert_array_equal(column(quick.toolpath), column(general.toolpath))
        np.testing.assert_array_equal(column(quick.toolpath), column(bare.toolpath))
    for name in ("status", "turn"):
        for other in (general, bare):
            stated = other.toolpath.configuration[name]
            np.testing.assert_array_equal(quick.toolpath.configuration[name], stated)
    for name in ("start", "stop", "file", "insert", "home", "motion", "inherits", "text"):
        np.testing.assert_array_equal(getattr(quick.text, name), getattr(general.text, name))
    assert bare.text is None
    for other in (general, bare):
        assert quick.toolpath.constraints.no_insert_before == other.toolpath.constraints.no_insert_before
        assert quick.findings == other.findings
        assert quick.toolpath.constraints.refused == other.toolpath.constraints.refused
        assert quick.toolpath.constraints.locked == other.toolpath.constraints.locked


COMMENTED = "LIN {X 1.5,Y -2.,Z +3,A 4,B 5.0,C 6} C_DIS ; layer 3, 'a' 1.5-\n"
COMMON = "LIN {X 1.5,Y -2.,Z +3,A 4,B 5.0,C 6,S 2,T 35,E1 0.0} C_DIS\n"


@settings(deadline=None, max_examples=examples(300))
@given(
    st.lists(st.tuples(st.integers(0, len(COMMON)), st.sampled_from(" \t,{}+-.'12AEXST;:Bb#\r")), max_size=3)
)
def test_the_two_ways_agree_on_lines_that_are_nearly_common(changes: list[tuple[int, str]]) -> None:
    text = COMMON
    for at, letter in changes:
        text = text[:at] + letter + text[at:]
    run = 10 * COMMON + text + 9 * COMMENTED
    same((Document(Path("part.src"), f"DEF part()\n{FRAMES}$APO.CDIS=7.5\n{FULL}{run}END\n".encode()),))


@settings(deadline=None, max_examples=examples(150))
@given(st.binary(max_size=300))
def test_any_bytes_are_read_without_a_crash(raw: bytes) -> None:
    program = KRL.read((Document(Path("part.src"), raw), Document(Path("part.dat"), raw[::-1])))
    assert len(program.text.file) == len(program.toolpath)


@settings(deadline=None, max_examples=examples(150))
@given(
    st.sampled_from([*GOOD, *BAD]),
    st.lists(
        st.tuples(st.integers(0, 2000), st.integers(0, 60), st.binary(max_size=6)), min_size=1, max_size=6
    ),
    st.randoms(use_true_random=False),
)
def test_mutated_programs_are_read_without_a_crash(path: Path, cuts, random) -> None:  # type: ignore[no-untyped-def]
    docs = []
    for document in documents(path):
        lines = document.raw.splitlines(keepends=True)
        if random.random() < 0.5:
            random.shuffle(lines)
        raw = b"".join(lines)
        for at, length, text in cuts:
            at %= len(raw) + 1
            raw = raw[:at] + text + raw[at + length :]
        docs.append(Document(document.path, raw))
    same(tuple(docs))


@pytest.mark.parametrize(
    ("literal", "value"),
    [
        (b"12", 12.0), (b"12.", 12.0), (b"-0.5", -0.5), (b"+50", 50.0), (b"- 30", -30.0), (b".5", 0.5),
        (b"1.2E-05", 1.2e-5), (b"1e3", 1000.0), (b"'B0110'", 6.0), (b"'HfF'", 255.0), (b"'b1'", 1.0),
        (b"safe", None), (b"-safe", None), (b"", None), (b"-", None), (b"1 2", None), (b"1e999", None),
        (b"'B2'", None), (b"ROW*100", None), (b"1_0", None), (b"nan", None), (b"--1", None),
    ],
)  # fmt: skip
def test_numbers(literal: bytes, value: float | None) -> None:
    assert number(literal) == value


def test_units_and_the_order_of_the_angles() -> None:
    path = body("LIN {X 1000,Y 0,Z -2.5,A 90,B 0,C 90}\n").toolpath
    np.testing.assert_allclose(path.position[0], [1.0, 0.0, -0.0025])
    # Rz(90) Ry(0) Rx(90): tool x along y, tool y along z, tool z along x.
    np.testing.assert_allclose(path.rotation[0], [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)


def test_an_axis_motion_is_in_radians_and_has_no_position() -> None:
    path = body("PTP {A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}\n").toolpath
    assert path.kind[0] == Kind.AXIS
    np.testing.assert_allclose(path.axes[0], np.array([0, -90, 90, 0, 45, 0]) * DEG)
    assert np.isnan(path.position[0]).all()
    assert not path.constraints.refused


def test_places_are_those_of_the_literals() -> None:
    program = body("LIN {C 6,Z - 30,A 4,X 'B11',B 5,Y 1.2E-05,E1 7}\n")
    raw, places = program.documents[0].raw, program.text
    found = [raw[a:b] for a, b in zip(places.start[0], places.stop[0], strict=True)]
    assert found == [b"'B11'", b"1.2E-05", b"- 30", b"4", b"5", b"6"]
    assert raw[places.insert[0] :].startswith(b",E1 7}")


def test_points_of_the_dat_have_their_places_there() -> None:
    program = body("LIN XP1\n", "DECL E6POS XP1={X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 35}\n")
    assert program.text.file[0].tolist() == [1] * 6
    assert program.text.home[0] == 1
    assert program.documents[1].raw[program.text.start[0, 2] : program.text.stop[0, 2]] == b"3"
    assert program.toolpath.configuration["status"][0] == 2
    assert not program.findings


def test_missing_components_come_from_the_point_before() -> None:
    path = body(FULL + "LIN {Y 20}\nLIN {C 60,S 1}\n").toolpath
    np.testing.assert_allclose(path.position / MM, [[1, 2, 3], [1, 20, 3], [1, 20, 3]])
    assert not path.constraints.refused


@pytest.mark.parametrize(
    ("between", "code"),
    [
        ("PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\nLIN {A 5}\n", "KRL004"),
        ("PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\n$TOOL=TOOL_DATA[2]\n", "KRL017"),
        ("LIN_REL {A 5}\n", "KRL004"),
        ("LIN unknown\n", "KRL004"),
        ("CIRC {X 1,Y 1,Z 1},{X 2,Y 2,Z 2,A 0,B 0,C 0},CA more\n", "KRL004"),
        ("OTHER_PROGRAM()\n", "KRL004"),
        ("IF $IN[1] THEN\nLIN {X 5}\nENDIF\n", "KRL004"),
        ("BAS(#BASE,2)\n", "KRL017"),
        ("$TOOL.X=5\n", "KRL017"),
    ],
)
def test_a_partial_point_without_a_known_point_before_is_refused(between: str, code: str) -> None:
    program = body(FULL + between + "LIN {Y 20}\n")
    last = len(program.toolpath) - 1
    assert codes(program)[last] == code


@pytest.mark.parametrize(
    "between",
    [
        "PTP $AXIS_ACT\n", "LIN $POS_ACT\n", "BAS(#BASE,1)\n", "USERSPOT(#INIT)\n", "WAIT SEC 0.5\n",
        "IF $IN[1] THEN\nHALT\nENDIF\n", "$OUT[1]=TRUE\n", ";LIN {X 9}\n", "GOTO away\nunused:\n",
        "$VEL.CP=0.1\n", "CIRC {X 1,Y 1,Z 1},{X 1,Y 2,Z 3,A 4,B 5,C 6}\n",
    ],
)  # fmt: skip
def test_what_does_not_move_the_robot_leaves_the_point_known(between: str) -> None:
    program = body(FULL + between + "LIN {Y 20}\n")
    last = len(program.toolpath) - 1
    assert last not in program.toolpath.constraints.refused
    np.testing.assert_allclose(program.toolpath.position[last] / MM, [1, 20, 3])


@pytest.mark.parametrize(
    ("later", "pinned"),
    [
        ("LIN_REL {Z 100}\n", []),
        ("LIN_REL {A 10}\n", [1]),
        ("LIN {X 1,Y safe}\n", [1]),
        ("LIN $POS_ACT:{Z 1}\n", [1]),
        ("BAS(#TOOL,2)\nLIN {X 5}\n", [1]),
        ("LOOP\nLIN {X 5}\nENDLOOP\n", []),
        ("LOOP\nLIN {X 5}\nLIN {Y 7}\nENDLOOP\n", [1, 3]),
        ("LOOP\nLIN_REL {X 5}\nENDLOOP\n", [1]),
        ("LOOP\nCIRC {X 5},{X 9,Y 9}\nENDLOOP\n", [1]),
        ("GOTO on\n" + FULL + "on:\nLIN {X 5}\n", []),
        ("IF a THEN\nGOTO on\nENDIF\n" + FULL + "on:\nLIN {X 5}\n", []),
        ("IF a THEN\nLIN {Y 9}\nENDIF\nLIN {X 5}\n", [1, 2]),
        ("IF a THEN\n" + FULL + "ENDIF\nLIN {X 5}\n", []),
        ("SWITCH a\nCASE 1\n" + FULL + "CASE 2\nLIN_REL {X 1}\nENDSWITCH\n", []),
        ("LIN placed(1)\n", [1]),
        ("sub()\nEND\nDEF sub()\nPTP_REL {A1 5}\n", [1]),
        ("sub()\nEND\nDEF sub()\nLIN_REL {X 5}\n", []),
        ("LOOP\nsub()\nENDLOOP\nEND\nDEF sub()\nLIN_REL {X 5}\n", [1]),
        ("here=$POS_ACT\n", [1]),
        (FULL, []),
        ("LIN unknown\n", []),
    ],
)
def test_a_point_that_a_refused_motion_builds_on_is_pinned(later: str, pinned: list[int]) -> None:
    program = body(FULL + FULL + later)
    assert [
        row for row in program.toolpath.constraints.locked if row not in program.toolpath.constraints.refused
    ] == pinned


@pytest.mark.parametrize(
    ("code", "setting"),
    [
        ("base [4]", "$BASE = BASE_DATA[4]"),
        ("base [4]", "bas ( #base , 4 )"),
        ("base {0 0 0 0 0 0}", "BAS(#BASE,0)"),
        ("base {0 0 0 0 0 0}", "$BASE=$NULLFRAME"),
        ("base {0 0 0 0 0 0}", "BAS(#INITMOV,0)"),
        ("base {7 0 0 0 0 90}", "$BASE={X 7,Y 0,Z 0,A 0,B 0,C 90}"),
        ("base {7 0 9 0 0 90}", "$BASE={X 7,Y 0,Z 0,A 0,B 0,C 90}\n$BASE.Z=9"),
        ("base {7 0 0 0 0 0}", "BASE_DATA[4]={X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=BASE_DATA[4]"),
        ("base {7 0 8 0 0 0}", "BASE_DATA[4]={X 7,Y 0,Z 0,A 0,B 0,C 0}\nBASE_DATA[4].Z=8\nBAS(#BASE,4)"),
        ("base {7 0 0 0 0 0}", "DECL FRAME F\nF={X 7,Y 0,Z 0,A 0,B 0,C 0}\n$BASE=F"),
        ("base [5]", "FDAT_ACT={TOOL_NO 1,BASE_NO 5,IPO_FRAME #BASE}\nBAS(#FRAMES)"),
        ("base ?", "$BASE={X 7}"),
        ("base ?", "$BASE=F:{X 1,Y 0,Z 0,A 0,B 0,C 0}"),
        ("base ?", "BAS(#BASE,n)"),
        ("base ?", "BASE_DATA[4]=F\nBAS(#BASE,4)"),
        ("base [1]{0 0 0 0 0 0}.X=5", "$BASE.X=5"),
        ("base ?", "BAS(#EX_BASE,1)"),
        ("base ?", "IF $IN[1] THEN\n$BASE=BASE_DATA[2]\nENDIF"),
        ("base ?", "FDAT_ACT=FP7\nBAS(#FRAMES)"),
    ],
)
def test_bases(code: str, setting: str) -> None:
    program = body(setting + "\n" + FULL)
    assert f" {code} tool" in next(program.toolpath.dump())
    assert (0 in program.toolpath.constraints.refused) == code.endswith("?")


def test_a_base_number_that_the_program_sets_keeps_its_number() -> None:
    frames = body("BASE_DATA[4]={X 7,Y 0,Z 0,A 0,B 0,C 0}\nBAS(#BASE,4)\n" + FULL).toolpath.frames
    assert [frame.number for frame in frames] == [1, 4]
    assert frames[1].pose is not None
    np.testing.assert_allclose(frames[1].pose.position, [0.007, 0, 0])


def test_equal_frames_are_one_and_unused_ones_are_none() -> None:
    program = body("BAS(#BASE,9)\n" + 2 * ("BAS(#BASE,1)\n" + FULL + "$BASE=$WORLD\n" + FULL))
    assert [frame.number for frame in program.toolpath.frames] == [1, 0]
    assert program.toolpath.base.tolist() == [0, 1, 0, 1]


@pytest.mark.parametrize(
    ("setting", "feed"),
    [
        ("$VEL.CP=0.25\n", 0.25), ("$VEL={CP 0.5,ORI1 200}\n", 0.5), ("BAS(#VEL_CP,0.3)\n", 0.3),
        ("$VEL.CP=fast\n", None), ("$VEL.ORI1=3\n", None), ("BAS(#INITMOV,0)\n", None),
        ("$VEL.CP=0.25\n$VEL.ORI1=3\n", 0.25), ("$VEL.CP=0.2\nIF x THEN\n$VEL.CP=0.1\nENDIF\n", None),
    ],
)  # fmt: skip
def test_feed(setting: str, feed: float | None) -> None:
    program = body(setting + FULL)
    np.testing.assert_equal(program.toolpath.feed[0], np.nan if feed is None else feed)


POINTS = "DECL E6POS XP1={X 1,Y 2,Z 3,A 4,B 5,C 6}\nDECL E6POS XP2={X 1,Y 2,Z 3,A 4,B 5,C 6}\n"


@pytest.mark.parametrize(
    ("text", "data"),
    [
        ('LIN XP1\nH50("a;b",XP1)\n', POINTS),
        ("LIN XP1\nIF XP1.X>5 THEN\nENDIF\n", POINTS),
        ("LIN XP1\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO log(XP1.X+1)\n", POINTS),
        ("LIN XP1\nLIN XP1:{X 0,Y 0,Z 5,A 0,B 0,C 0}\n", POINTS),
        ("LIN XP1\nhere=XP1\n", POINTS),
        ("LIN XP1\n", POINTS.replace("DECL", "DECL GLOBAL")),
        ("P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN P\nWHILE x\nP={X 1,Y 2,Z 3,A 4,B 5,C 6}\nENDWHILE\nLIN P\n", ""),
    ],
)
def test_a_point_that_other_code_reads_is_understood_and_its_literals_are_locked(
    text: str, data: str
) -> None:
    program = body(text, data)
    assert 0 not in program.toolpath.constraints.refused
    assert program.text.locked[0]
    assert program.text.variables[0].name in (b"XP1", b"P")


@pytest.mark.parametrize(
    ("text", "data", "groups"),
    [
        ("LIN XP1\nLIN XP2\nLIN XP1\n", POINTS, [0, 1, 0]),
        ("LIN XP1\nEND\nDEF sub()\nLIN XP1\n", POINTS, [0, 0]),
        ("P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN P\nP.S=2\nLIN P\n", "", [0, 0]),
        ("P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN P\nP.Z=4\nLIN P\nP.X=4\nLIN P\n", "", [0, 0, 0]),
        (3 * "P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN P\n", "", [0, 1, 2]),
        ("FOR i=1 TO 2\n" + FULL + "ENDFOR\n" + FULL, "", [0, 0, 2]),
        ("FOR i=1 TO 2\n" + 9 * FULL + "ENDFOR\n", "", [*range(9), *range(9)]),
        (FULL + FULL, "", [0, 1]),
    ],
)
def test_rows_that_share_a_literal_have_one_number(text: str, data: str, groups: list[int]) -> None:
    assert body(text, data).text.text.tolist() == groups


def test_an_auxiliary_point_that_is_a_target_too_is_seen() -> None:
    program = body(FULL + "LIN XP1\nLIN {X 5,Y 5}\nCIRC XP1,XP2\n", POINTS.replace("X 1", "X 9", 1))
    assert program.text.arcs[3].text == 1
    assert program.text.arcs[3].home == 1
    raw = program.documents[1].raw
    arc = program.text.arcs[3]
    assert [raw[a:b] for a, b in zip(arc.start, arc.stop, strict=True)] == [b"9", b"2", b"3"]


def test_a_point_of_the_dat_that_the_program_assigns_is_not_known_before() -> None:
    program = body("LIN XP1\nXP1={X 1,Y 1,Z 1,A 0,B 0,C 0}\nLIN XP1\n", POINTS)
    assert codes(program) == {0: "KRL002"}


@pytest.mark.parametrize(
    ("text", "data"),
    [
        ("LIN XP1 C_DIS\nLIN XP2\n", POINTS),
        ('; XP1\nmsg="XP1"\n$H_POS=XP1\nLIN XP1\n', POINTS),
        ("DECL FRAME P\n" + 3 * "P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP.E1=0\nLIN P C_DIS\n", ""),
        ("P[1]={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP[2]={X 1,Y 2,Z 3,A 4,B 5,C 6}\nLIN P[1]\nLIN P[ 2 ]\n", ""),
        ("PTP XHOME\nPTP XHOME\n", "DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n"),
    ],
)
def test_a_point_of_one_motion_alone_is_not_locked(text: str, data: str) -> None:
    program = body(text, data)
    assert not program.toolpath.constraints.refused
    assert not program.text.locked


def test_motions_in_blocks_are_known_where_their_targets_are() -> None:
    program = body("LOOP\nIF a THEN\n" + FULL + "ELSE\n" + FULL + "ENDIF\nENDLOOP\n" + FULL)
    assert codes(program) == {2: "KRL023"}
    assert np.isfinite(program.toolpath.position).all()
    assert not program.toolpath.continues.any()


def test_what_a_loop_sets_later_is_not_known_at_its_begin() -> None:
    program = body("LOOP\n" + FULL + "BAS(#TOOL,2)\nENDLOOP\n")
    assert program.toolpath.tool[0] == -1


def test_each_branch_begins_with_the_state_before_the_block() -> None:
    text = "SWITCH a\nCASE 1\nBAS(#TOOL,2)\n" + FULL + "CASE 2\n" + FULL + "ENDSWITCH\n"
    program = body(text)
    assert [program.toolpath.frames[i].number for i in program.toolpath.tool] == [2, 1]


def test_a_called_subprogram_changes_what_it_sets() -> None:
    sub = "END\nDEF inner()\nBAS(#TOOL,3)\nEND\nDEF outer()\ninner()\n"
    program = body("outer()\n" + FULL + sub)
    assert program.toolpath.frames[program.toolpath.tool[0]].number == 3
    unsure = body("IF $IN[1] THEN\nouter()\nENDIF\n" + FULL + sub)
    assert codes(unsure) == {0: "KRL005"}
    assert (
        body("outer()\n" + FULL + sub.replace("BAS(#TOOL,3)", "$OUT[1]=TRUE")).toolpath.constraints.refused
        == {}
    )


def test_a_routine_of_the_file_goes_before_one_of_a_package_with_its_name() -> None:
    program = body(FULL + "H50()\nLIN {X 5}\nEND\nDEF H50()\nLIN {Z 9}\n")
    np.testing.assert_allclose(program.toolpath.position[2] / MM, [5, 2, 9])


def test_lines_of_any_length_are_read_in_time() -> None:
    blank = " " * 300_000
    for line in (
        f"LIN {{X {blank} 5",
        f"P{blank}Q{blank}[",
        f"DECL{blank}FRAME{blank}",
        f"{blank}X" * 3,
        '"' * 300_000,
    ):
        program = body(line + "\n" + FULL)
        assert program.toolpath.line[-1] == 5


def test_functions_in_expressions_are_calls() -> None:
    function = "END\nDEFFCT INT setter(n:IN)\nBAS(#BASE,n)\nRETURN 1\nENDFCT\nDEF last()\n"
    for line in (
        "r = setter(2)",
        "IF setter(2) == 1 THEN\nENDIF",
        "WAIT FOR (setter(2) == 1)",
        "calc(setter(2))",
    ):
        assert codes(body(line + "\n" + FULL + function)) == {0: "KRL005"}, line
    for line in ("r=probe()", "WHILE busy(1) AND (a==1)\nENDWHILE", "REPEAT\nUNTIL done(1)"):
        program = body(FULL + line + "\nLIN {X 5}\n")
        assert codes(program) == {1: "KRL004"}, line
        assert "KRL010" in told(program)
        assert list(program.toolpath.constraints.locked) == [0]


def test_functions_of_krl_itself_move_nothing() -> None:
    lines = 'r=ABS(-1)+STRLEN("probe(1)")\nIF (a==1) AND NOT (b==2) THEN\nENDIF\nWAIT FOR ($IN[1])\nWAIT SEC (1)\n'
    assert told(body(FULL + lines + "LIN {X 5}\n")) == []


def test_relative_motions_are_what_they_are_named() -> None:
    text = "LIN_REL {X 5}\nSPTP_REL {A1 5}\nCIRC_REL {X 1},{X 2}\nSPLINE\nSLIN_REL {X 1}\nENDSPLINE\n"
    assert [Kind(k).name for k in body(text).toolpath.kind] == ["LIN", "PTP", "CIRC", "LIN"]


@pytest.mark.parametrize(
    ("text", "moves"),
    [
        (FULL.replace("}", ",E1 1.0}") + FULL.replace("}", ",E1 1}"), False),
        (FULL.replace("}", ",E1 1.0}") + FULL + FULL.replace("}", ",E1 1.5}"), True),
        ("PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0,E2 1}\n" + FULL.replace("}", ",E2 wide}"), True),
        ("P={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP.E1=1\nLIN P\nP={X 1,Y 2,Z 3,A 4,B 5,C 6}\nP.E1=2\nLIN P\n", True),
    ],
)
def test_external_axes_that_move_are_told(text: str, moves: bool) -> None:
    assert told(body(text)) == (["KRL022"] if moves else [])


def test_a_frame_of_the_dat_that_the_program_changes_is_not_known() -> None:
    data = "DEFDAT part\nDECL FRAME B1={X 1,Y 2,Z 3,A 0,B 0,C 0}\nENDDAT\n"
    assert body("$BASE=B1\n" + FULL, data).toolpath.constraints.refused == {}
    assert codes(body("$BASE=B1\n" + FULL + "B1.Z=B1.Z+10\n", data)) == {0: "KRL005"}


def test_an_unread_routine_is_told_once() -> None:
    program = body("A_TOOL(1)\n" + FULL + "a_tool (2)\nBAS(#VEL_PTP,5)\nH50(GRP,1,1,GAbrir)\nSR_END()\n")
    assert told(program) == ["KRL010"]


def test_equal_refusals_are_told_once_and_stand_at_every_row() -> None:
    program = body("LIN_REL {X 5}\n" + 200 * "LIN {X 1,Y 2,Z 3}\n")
    assert len(program.toolpath.constraints.refused) == 201
    assert told(program) == ["KRL008", "KRL004"]
    assert "200 motions, lines 5 to 204" in program.findings[1].message
    assert {finding.line for finding in program.toolpath.constraints.refused.values()} == set(range(4, 205))


def test_components_left_out_after_an_axis_motion_are_left_to_it() -> None:
    program = body("PTP {A1 0,A2 0,A3 0,A4 0,A5 0,A6 0}\nLIN {Z 450}\nLIN {X 1,Y 2}\nLIN {A 1,B 2,C 3}\n")
    path = program.toolpath
    assert not path.constraints.refused
    assert path.partial_targets.inherits_from_row.tolist() == [-1, 0, 0, -1]
    np.testing.assert_allclose(
        path.partial_targets.coordinates[1] * 1e3, [np.nan, np.nan, 450, *[np.nan] * 3]
    )
    np.testing.assert_allclose(path.partial_targets.coordinates[2] * 1e3, [1, 2, 450, *[np.nan] * 3])
    assert path.known.tolist() == [False, False, False, True]
    there = Poses.from_abc(np.tile([7.0, 8.0, 9.0], (4, 1)), np.tile([0.1, 0.2, 0.3], (4, 1)))
    full = path.completed(there)
    np.testing.assert_allclose(full.position[1:3], [[7, 8, 0.45], [0.001, 0.002, 0.45]])
    np.testing.assert_allclose(full.rotation[2], there.rotation[2], atol=1e-12)
    assert full.known.tolist() == [False, True, True, True]
    assert "X ? Y ? Z 450 A ? B ? C ? from line 4" in list(path.dump())[1]


@pytest.mark.parametrize("name", ["$ROBROOT", "$WORLD"])
def test_a_program_that_places_the_robot_is_not_corrected_from_there_on(name: str) -> None:
    program = body(FULL + name.lower() + " = {X 0,Y 0,Z 500,A 0,B 0,C 0}\n$BASE=BASE_DATA[1]\n" + 2 * FULL)
    assert [finding.code for finding in program.toolpath.constraints.refused.values()] == ["KRL005", "KRL005"]
    assert sorted(program.toolpath.constraints.refused) == [1, 2]
    assert "set in line 5" in program.findings[0].message


def test_annotations_hold_from_their_row_on() -> None:
    text = ";FORCE 0 0 5\n" + FULL + "; compensate  off\n"
    text += (
        FULL.replace("\n", " ;Force OFF \n") + ";ENFORCE\n;FORCED\n;FOLD FORCE\n" + FULL + ";FORCE 1 2 3\n"
    )
    annotations = body(text).toolpath.annotations
    assert [(a.row, a.text) for a in annotations] == [
        (0, "FORCE 0 0 5"), (1, "compensate  off"), (1, "Force OFF"), (3, "FORCE 1 2 3"),
    ]  # fmt: skip
    assert [a.line for a in annotations] == [4, 6, 7, 12]


def test_findings_name_line_and_column_of_the_motion() -> None:
    finding = body("   LIN_REL {Z 5}\n").findings[0]
    assert (finding.file, finding.line, finding.column) == ("part.src", 4, 4)


@pytest.mark.parametrize("name", ["part.src", "part.SRC", "part.txt"])
def test_krl_is_detected(name: str) -> None:
    assert detect(Path(name), b"DEF part ( )\nEND\n").name == "krl"


def test_what_is_no_program_is_not_claimed() -> None:
    for raw in (b"", b"hello\n", b"G1 X5\n", b"N10 DEF REAL X\n", b"\x00\xff"):
        assert not KRL.claims(Path("part.txt"), raw)
        with pytest.raises(Refusal):
            detect(Path("part.unknown"), raw[:2] if raw.startswith(b"\x00") else b"hello\n")


def test_the_dat_beside_is_found_in_any_case(tmp_path: Path) -> None:
    for name in ("Part.src", "PART.DAT", "part2.dat", "Part.csv"):
        (tmp_path / name).write_bytes(b"")
    assert [path.name for path in KRL.companions(tmp_path / "Part.src")] == ["PART.DAT"]
    (tmp_path / "Part.dat").write_bytes(b"")
    assert [path.name for path in KRL.companions(tmp_path / "Part.src")] == ["Part.dat"]
    assert KRL.companions(tmp_path / "nowhere" / "x.src") == []


@pytest.mark.skipif("POSTPROC_PROGRAMS" not in os.environ, reason="POSTPROC_PROGRAMS names no folder")
def test_programs_of_a_folder_read_the_same_on_both_ways() -> None:
    paths = [p for p in Path(os.environ["POSTPROC_PROGRAMS"]).rglob("*") if p.suffix.lower() == ".src"]
    assert paths
    for path in paths:
        same(documents(path))


def test_a_folder_that_can_not_be_listed_is_told(tmp_path, monkeypatch):
    """A .dat that is not seen would be left behind, old, beside a new .src."""

    def fails(_path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", fails)
    with pytest.raises(Refusal, match="FIL001"):
        KRL.companions(tmp_path / "part.src")


# letters that KRL does not have

NEXT = "LIN {Z 9}\nLIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
"""What takes its other components from the point before, and what does not."""

LOOK_ALIKE = [
    "L\u0406N {X 9}", "\uff2c\uff29\uff2e {X 9}", "L\u200bIN {X 9}", "\u202eLIN {X 9}", "LIN\u00a0{X 9}",
    "\u0420TP XP1", "PTP XP1\u0430", "LIN {X 9\u00a0}", "LIN {X 9} \u0421_DIS", "LIN {X \uff19}", "\u0416",
]  # fmt: skip
MORE = [
    "$B\u0410SE={X 1,Y 0,Z 0,A 0,B 0,C 0}",
    "B\u0410S(#BASE,2)",
    "XP1\u0430={X 9}",
    "GOTO \u0430",
    "GOTO \u00f6l",
]


@pytest.mark.parametrize("coding", ["utf-8", "utf-16-be"])
@pytest.mark.parametrize("line", LOOK_ALIKE)
def test_what_may_hide_a_motion_is_one_that_is_not_understood(line, coding):
    """And the position behind it is as unknown as behind any such motion."""
    hidden = line.encode()
    if coding != "utf-8":  # single bytes of any code page
        hidden = re.sub(rb"[\x80-\xff]+", b"\xb2", hidden)
    found = read(f"DEF part()\n{FRAMES}{FULL}".encode() + hidden + f"\n{NEXT}END\n".encode())
    told = {row: finding.code for row, finding in found.toolpath.constraints.refused.items()}
    assert len(found.toolpath) == 4
    assert told == {1: "KRL002" if line.startswith("LIN {") and line[-1] == "}" else "KRL001", 2: "KRL004"}


@pytest.mark.parametrize(
    "line", [line.encode() for line in MORE] + [b"$B\xc0SE=XP1", b"XP1\xb2=XP2", b"XP1\xe0=XP2"]
)
def test_what_may_set_anything_leaves_nothing_known(line):
    zero = "{X 0,Y 0,Z 0,A 0,B 0,C 0}"
    then = f"\n{FULL}$BASE={zero}\n$TOOL={zero}\n{FULL}END\n"
    found = read(f"DEF part()\n{FRAMES}{FULL}".encode() + line + then.encode())
    told = {row: finding.code for row, finding in found.toolpath.constraints.refused.items()}
    assert told == {1: "KRL001", 2: "KRL005"}
    assert "KRL025" in [finding.code for finding in found.findings]


@pytest.mark.parametrize("coding", ["utf-8", "latin-1"])
@pytest.mark.parametrize(
    ("line", "lost"),
    [
        ("Zähler=Zähler+1", False), ("Größe.X=5", False), ("Öl[3]=TRUE", False), ("DECL INT Überlauf", False),
        ("WAIT FOR größe", False), ("R=größe", False), ("REAL größe", False), ("$OUT[1]=schließen", False),
        ("Öffnen()", True), ("Z=Öffnen()", True), ("Zähler=Fahren(1)", True), ("schließen(XP1)", True),
    ],
)  # fmt: skip
def test_umlauts_in_names(line, lost, coding):
    """Told once; an assignment leaves the position, a call of what was not read does not, as with any name."""
    text = f"DEF part()\n{FRAMES}{FULL}{line}\n{line}\n{NEXT}END\n"
    found = read(text.encode(coding))
    told = [finding.code for finding in found.findings]
    assert told.count("KRL025") == 1
    assert len(found.toolpath) == 3
    assert {row: finding.code for row, finding in found.toolpath.constraints.refused.items()} == (
        {1: "KRL004"} if lost else {}
    )


@pytest.mark.parametrize("line", ["R=größe", "R=1\u0430", "R=\uff11", "R=XP1.X+ä", "$BASE.X=1\u00a0"])
def test_what_such_a_statement_sets_is_not_known(line):
    data = "DECL REAL R=7\n"
    found = read(f"DEF part()\n{FRAMES}{line}\nLIN {{X R,Y 2,Z 3,A 4,B 5,C 6}}\nEND\n".encode(), data)
    assert {finding.code for finding in found.toolpath.constraints.refused.values()} <= {"KRL002", "KRL005"}
    assert len(found.toolpath.constraints.refused) == 1


@pytest.mark.parametrize("line", ['Text[]="größe"', "; größe", '$MSG[]="Zähler" ; Öl'])
def test_strings_and_comments_may_hold_any_letter(line):
    found = read(f"DEF part()\n{FRAMES}{FULL}{line}\n{NEXT}END\n".encode("latin-1"))
    assert not found.toolpath.constraints.refused
    assert "KRL025" not in [finding.code for finding in found.findings]


def test_a_block_knows_what_may_hide_in_it():
    part = "LIN {Z 9}\n"
    for line, then, code in (
        ("L\u0406N XP1", part, "KRL004"), ("L\u0406N XP1", FULL, ""), ("$B\u0410SE=X", FULL, "KRL005"),
        ("Zähler=1", part, ""), ("Öffnen()", part, "KRL004"),
    ):  # fmt: skip
        found = read(f"DEF part()\n{FRAMES}{FULL}IF $IN[1] THEN\n{line}\nENDIF\n{then}END\n".encode())
        last = found.toolpath.constraints.refused.get(len(found.toolpath) - 1)
        assert (last.code if last else "") == code
