"""What runs, in which order and how often: loops, branches, jumps and calls of KRL."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document
from postproc.base.units import MM
from postproc.languages.dialect import Program
from postproc.languages.krl import KrlDialect

FULL = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"


def program(text: str) -> Program:
    return KrlDialect().read((Document(Path("part.src"), text.encode()),))


def body(text: str, rest: str = "") -> Program:
    return program(
        f"DEF part()\nDECL INT i,j\nDECL REAL r\nBAS(#BASE,1)\nBAS(#TOOL,1)\n{FULL}{text}END\n{rest}"
    )


def xs(found: Program) -> list[float]:
    """X of what was followed, without the first motion."""
    path = found.toolpath
    rows = [row for row in range(1, len(path)) if row not in path.constraints.refused]
    return np.round(path.position[rows, 0] / MM, 9).tolist()


def codes(found: Program) -> list[str]:
    return [finding.code for finding in found.toolpath.constraints.refused.values()]


@pytest.mark.parametrize(
    ("text", "ends"),
    [
        ("FOR i=1 TO 3\nLIN {X i}\nENDFOR\n", [1, 2, 3]),
        ("FOR i=3 TO 1 STEP -1\nLIN {X i}\nENDFOR\n", [3, 2, 1]),
        ("FOR i = 2*3 TO 10 STEP 3\nLIN {X i}\nENDFOR\n", [6, 9]),
        ("FOR i=1 TO 3\nFOR j=i TO 3\nLIN {X 10*i+j}\nENDFOR\nENDFOR\n", [11, 12, 13, 22, 23, 33]),
        ("FOR i=1 TO 5\nIF i==3 THEN\nEXIT\nENDIF\nLIN {X i}\nENDFOR\nLIN {X 9}\n", [1, 2, 9]),
        ("i=0\nWHILE i<2\ni=i+1\nLIN {X i}\nENDWHILE\n", [1, 2]),
        ("i=0\nREPEAT\ni=i+1\nLIN {X i}\nUNTIL i>=2\n", [1, 2]),
        ("i=0\nLOOP\ni=i+1\nIF i>2 THEN\nEXIT\nENDIF\nLIN {X i}\nENDLOOP\n", [1, 2]),
        ("i=2\nIF i==2 THEN\nLIN {X 5}\nELSE\nLIN {X 6}\nENDIF\n", [5]),
        ("i=3\nIF i==2 THEN\nLIN {X 5}\nELSE\nLIN {X 6}\nENDIF\n", [6]),
        ("i=0\nREPEAT\nLIN {X i}\ni=i+1\nUNTIL(TRUE)\n", [0]),
        ("i=0\nREPEAT\ni=i+1\nLIN {X i}\nUNTIL(i>=2)\n", [1, 2]),
        ("i=0\nREPEAT\ni=i+1\nIF i>2 THEN\nEXIT\nENDIF\nLIN {X i}\nUNTIL(FALSE)\n", [1, 2]),
        ("i=0\nWHILE(i<2)\ni=i+1\nLIN {X i}\nENDWHILE\n", [1, 2]),
        ("i=2\nSWITCH(i)\nCASE(2)\nLIN {X 5}\nDEFAULT\nLIN {X 6}\nENDSWITCH\n", [5]),
        ("i=2\nIF(i==2)THEN\nLIN {X 5}\nELSE\nLIN {X 6}\nENDIF\n", [5]),
        ("i=3\nSWITCH i\nCASE 1,2\nLIN {X 5}\nCASE 3\nLIN {X 6}\nDEFAULT\nLIN {X 7}\nENDSWITCH\n", [6]),
        ("i=4\nSWITCH i\nCASE 1,2\nLIN {X 5}\nDEFAULT\nLIN {X 7}\nENDSWITCH\nLIN {X 8}\n", [7, 8]),
        ("i=4\nSWITCH i\nCASE 1\nLIN {X 5}\nENDSWITCH\nLIN {X 8}\n", [8]),
        ("i=0\nup:\ni=i+1\nLIN {X i}\nIF i<3 THEN\nGOTO up\nENDIF\n", [1, 2, 3]),
        ("GOTO on\nLIN {X 5}\non:\nLIN {X 6}\n", [6]),
        ("FOR i=1 TO 9\nLIN {X i}\nIF i==2 THEN\nGOTO out\nENDIF\nENDFOR\nout:\nLIN {X 50}\n", [1, 2, 50]),
        ("RETURN\nLIN {X 5}\n", []),
        ("r=0\nWHILE r<1\nr=r+0.5\nLIN {X r}\nENDWHILE\n", [0.5, 1.0]),
        ("FOR i=1 TO 2\nIF $IN[1] THEN\n$OUT[1]=TRUE\nENDIF\nLIN {X i}\nENDFOR\n", [1, 2]),
    ],
)  # fmt: skip
def test_a_flow_of_constants_is_followed(text: str, ends: list[float]) -> None:
    assert xs(body(text)) == ends


@pytest.mark.parametrize(
    ("text", "rest", "ends"),
    [
        ("sub(5)\nsub(7)\n", "DEF sub(a:IN)\nINT a\nLIN {X a}\nEND\n", [5, 7]),
        ("i=1\nsub(i)\nLIN {X i}\n", "DEF sub(a:OUT)\nINT a\na=a+1\nEND\n", [2]),
        ("i=1\nsub(i)\nLIN {X i}\n", "DEF sub(a)\nINT a\na=a+1\nEND\n", [2]),
        ("i=1\nsub(i)\nLIN {X i}\n", "DEF sub(a:IN)\nINT a\na=a+1\nEND\n", [1]),
        ("i=1\nsub()\nLIN {X i}\n", "DEF sub()\nDECL INT i\ni=9\nEND\n", [1]),
        ("sub(3)\n", "DEF sub(n:IN)\nINT n\nIF n>0 THEN\nLIN {X n}\nsub(n-1)\nENDIF\nEND\n", [3, 2, 1]),
        (
            "FOR i=1 TO 2\nsub(10*i)\nENDFOR\n",
            "DEF sub(a:IN)\nREAL a\nLIN {X a}\nLIN_REL {X 1}\nEND\n",
            [10, 11, 20, 21],
        ),
        (
            "sub(1)\nLIN {X 9}\n",
            "DEF sub(a:IN)\nINT a\nLIN {X 2}\nIF a==1 THEN\nRETURN\nENDIF\nLIN {X 3}\nEND\n",
            [2, 9],
        ),
    ],
)
def test_calls_are_followed(text: str, rest: str, ends: list[float]) -> None:
    assert xs(body(text, rest)) == ends


def test_a_caller_does_not_see_what_is_local_to_a_routine() -> None:
    found = body("sub()\nLIN {X k}\n", "DEF sub()\nDECL INT k\nk=5\nEND\n")
    assert codes(found) == ["KRL002"]


@pytest.mark.parametrize(
    ("text", "rest", "expected"),
    [
        ("LOOP\nLIN {X 5}\nENDLOOP\n", "", []),
        ("LOOP\nLIN {X 5}\nLIN {Y 5}\nENDLOOP\n", "", ["KRL004"]),
        ("WHILE $IN[1]\nLIN {X 5}\nLIN_REL {Z 1}\nENDWHILE\n", "", ["KRL004", "KRL008"]),
        ("IF $IN[1] THEN\nLIN {X 5}\nELSE\nLIN {X 6}\nENDIF\n", "", []),
        ("IF $IN[1] THEN\nLIN {X 5}\nELSE\nLIN {X 6}\nENDIF\nLIN {X 7}\n", "", []),
        ("IF $IN[1] THEN\nLIN {X 5}\nELSE\nLIN {X 6}\nENDIF\nLIN {Y 7}\n", "", ["KRL004"]),
        ("IF $IN[1] THEN\nLIN {X 5}\nELSE\nLIN_REL {Z 6}\nENDIF\n", "", []),
        ("SWITCH i\nCASE 1\nLIN {X 5}\nCASE 2\nLIN {Y 6}\nDEFAULT\nLIN {Z 6}\nENDSWITCH\n", "", []),
        ("IF $IN[1] THEN\nCIRC {X 5,Y 9,Z 3},{X 9}\nELSE\nCIRC {X 5,Y 9,Z 3},{X 9}\nENDIF\n", "", ["KRL009"]),
        ("LOOP\nIF $IN[1] THEN\nEXIT\nENDIF\nLIN {X 5}\nENDLOOP\n", "", []),
        ("WHILE $IN[1]\nLIN {X 5}\nENDWHILE\n", "", []),
        ("i=0\nWHILE i<9\nLIN {X 5}\ni=i+$IN[1]\nENDWHILE\n", "", []),
        ("FOR i=1 TO n\nLIN {X 5}\nENDFOR\n", "", []),
        ("IF $IN[1] THEN\nsub()\nENDIF\n", "DEF sub()\nLIN {X 5}\nEND\n", []),
        ("sub()\nIF $IN[1] THEN\nsub()\nENDIF\n", "DEF sub()\nLIN {X 5}\nEND\n", []),
        ("sub()\n", "DEF sub()\nIF $IN[1] THEN\nRETURN\nENDIF\nLIN {X 5}\nEND\n", []),
        ("INTERRUPT DECL 2 WHEN $IN[1] DO sub()\nsub()\n", "DEF sub()\nLIN {X 5}\nEND\n", ["KRL015"]),
        (
            "INTERRUPT DECL 2 WHEN $IN[1] DO sub()\nr=5\nLIN {X r}\n",
            "DEF sub()\ndeep()\nEND\nDEF deep()\nr=9\nEND\n",
            ["KRL002"],
        ),
        ("IF i==1 THEN\nLIN {X 5}\nENDIF\n", "", []),
        ("i=1\nIF i==2 THEN\nLIN {X 5}\nENDIF\n", "", ["KRL023"]),
        ("i=1\nIF i==2 THEN\nLIN {X 5}\nELSEIF i==1 THEN\nLIN {X 6}\nENDIF\n", "", ["KRL006", "KRL006"]),
        ("again:\nLIN {X 5}\nIF $IN[1] THEN\nGOTO again\nENDIF\n", "", []),
        ("FOR i=1 TO 2\nLIN {X 5}\nIF $IN[1] THEN\nGOTO out\nENDIF\nENDFOR\nout:\n", "", []),
        ("SWITCH i\nCASE 1\nLIN {X 5}\nENDSWITCH\n", "", []),
    ],
)  # fmt: skip
def test_what_inputs_decide_is_known_where_it_is_the_same_on_every_path(
    text: str, rest: str, expected: list[str]
) -> None:
    found = body(text, rest)
    assert codes(found) == expected


@pytest.mark.parametrize("first", ["", "IF $IN[1] THEN\n{}ENDIF\n", "{}"])
@pytest.mark.parametrize("second", ["IF $IN[2] THEN\n{}ENDIF\n", "LOOP\n{}{}ENDLOOP\n", "out()\n"])
def test_a_statement_that_stood_elsewhere_counts_in_its_block_too(first: str, second: str) -> None:
    change = "BAS(#BASE,2)\n"
    text = first.format(change) + "BAS(#BASE,1)\n" + FULL + second.format(change, change) + FULL
    found = body(text, f"DEF out()\n{change}END\n" if "out" in second else "")
    assert codes(found)[-1:] == ["KRL005"] or found.toolpath.base[-1] != found.toolpath.base[0]


def test_rows_of_a_line_that_runs_several_times_are_whole() -> None:
    found = body("FOR i=1 TO 2\nLIN {X i}\nENDFOR\n" + FULL)
    assert list(found.toolpath.constraints.no_insert_before) == [1, 2]
    assert found.toolpath.line.tolist() == [6, 8, 8, 10]


def test_what_is_taken_back_leaves_nothing_behind() -> None:
    text = ";FORCE 0 0 1\ni=0\nWHILE i<5\n;a word\n;FORCE 0 0 2\nLIN {X 5}\n"
    text += "r=1\ni=i+1\nIF i==3 THEN\ni=$IN[1]\nENDIF\nENDWHILE\n"
    found = body(text + "LIN {X 7,Y 0,Z 0,A 0,B 0,C 0}\n")
    assert codes(found) == ["KRL036"]
    assert len(found.toolpath) == 3
    assert [note.row for note in found.toolpath.annotations] == [1, 1]
    assert [note.text for note in found.toolpath.comments] == ["a word"]


def test_motions_that_never_run_come_last() -> None:
    found = body("GOTO on\nLIN {X 5,Y 0,Z 0,A 0,B 0,C 0}\non:\nLIN {X 6}\n")
    assert found.toolpath.line.tolist() == [6, 10, 8]
    assert codes(found) == ["KRL023"]


def test_a_long_flow_is_given_up_and_the_rest_is_read() -> None:
    after = "FOR i=1 TO 2\nLIN {X i}\nENDFOR\n" + FULL
    found = body("FOR i=1 TO 1000000\nLIN {X i}\nENDFOR\n" + FULL + after)
    assert codes(found) == ["KRL002"]
    assert [finding.code for finding in found.findings] == ["KRL024", "KRL002"]
    assert xs(found) == [1, 1, 2, 1]
    found = body("i=0\nREPEAT\ni=i+1\nLIN {X i}\nUNTIL i>9999\n" + after)
    assert codes(found) == ["KRL002", "KRL002"]
    assert "KRL024" in [finding.code for finding in found.findings]


def test_a_long_loop_that_moves_nothing_is_passed_over() -> None:
    found = body("FOR i=1 TO 100000\n$OUT[i]=FALSE\nENDFOR\nLIN {X 5}\n")
    assert xs(found) == [5]
    assert not found.findings


@pytest.mark.slow
def test_what_runs_once_in_calls_is_not_limited() -> None:
    subs = "".join(f"DEF s{k}()\n{FULL * 9}$OUT[1]=TRUE\n{'LIN {X 7}' + chr(10)}END\n" for k in range(3000))
    found = body("".join(f"s{k}()\n" for k in range(3000)), subs)
    assert not found.findings
    assert len(found.toolpath) == 1 + 10 * 3000


def test_a_jump_back_for_ever_is_given_up() -> None:
    found = body("i=1\nback:\ni=i+1\nLIN {X i}\nGOTO back\n")
    assert codes(found) == ["KRL002"]


SIZE = 200_000
HOSTILE = {
    "loops": "FOR I=1 TO 9\n", "branches": "IF A THEN\nP=1\nENDIF\n", "nested": "IF A THEN\n", "labels": "L:\nGOTO L\n",
    "exits": "LOOP\nEXIT\nENDLOOP\n", "calls": "C()\n", "routines": "DEF A()\nA()\nEND\n", "copies": "P=P:P\n",
    "braces": "LIN {" * 400 + "\n", "commas": "LIN ," * 1500 + "\n", "brackets": "LIN A" + "[" * 8000 + "\n",
    "sums": "Q=" + "1+" * 3000 + "1\n", "parentheses": "Q=" + "(" * 4000 + "\n",
    "with": "SLIN P WITH " + "$VEL.CP=1," * 800 + "\n",
    "one line": "LIN {X " + "1" * 100, "blanks": " " * 5000, "cases": "SWITCH 1\nCASE 1\n", "switch": "CASE 1\n",
}  # fmt: skip


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_text_is_read(name: str) -> None:
    piece = HOSTILE[name]
    program("DEF a()\n" + piece * (SIZE // len(piece)))


@pytest.mark.slow
def test_many_variables_and_many_branches() -> None:
    text = "".join(f"V{i}=1\n" for i in range(20_000)) + "IF A THEN\nENDIF\n" * 20_000
    assert not program(f"DEF a()\n{text}END\n").findings


def test_many_jumps_that_may_happen() -> None:
    text = "".join(f"L{i}:\nIF A THEN\nGOTO L{i}\nENDIF\n" for i in range(10_000))
    assert not program(f"DEF a()\n{text}END\n").findings


@settings(deadline=None, max_examples=examples(100))
@given(st.lists(st.sampled_from([
    "FOR i=1 TO 2\n", "ENDFOR\n", "IF i==1 THEN\n", "IF $IN[1] THEN\n", "ELSE\n", "ENDIF\n", "LOOP\n", "EXIT\n",
    "ENDLOOP\n", "i=i+1\n", "i=1\n", "sub(i)\n", "GOTO a\n", "a:\n", "RETURN\n", "LIN {X i}\n", "LIN_REL {Y 1}\n",
    "REPEAT\n",
    "UNTIL i>3\n", "WHILE i<4\n", "ENDWHILE\n", "SWITCH i\n", "CASE 1\n", "DEFAULT\n", "ENDSWITCH\n", FULL,
    "END\nDEF sub(k)\n", "SPLINE\n", "SPL {X 1}\n", "ENDSPLINE\n",
]), max_size=25))  # fmt: skip
def test_any_order_of_blocks_is_read(lines: list[str]) -> None:
    found = body("".join(lines))
    path, text = found.toolpath, found.text
    assert len(path) == len(text.text)
    kinds = {line.split(" ")[0] for line in lines}
    assert len(path) >= 1 + ("SPL" in kinds)
    for row in text.variables:
        assert row < len(path)
    known = np.isfinite(path.position[:, 0])
    assert all(row in path.constraints.refused for row in range(len(path)) if not known[row])


@pytest.mark.parametrize(
    "opens", ["IF x THEN", "FOR I=1 TO 3", "WHILE x", "LOOP", "SWITCH x", "REPEAT", "SPLINE"]
)
def test_a_block_that_the_last_statement_opens_behind_a_return_is_read(opens: str) -> None:
    """As where a file is cut off."""
    text = f"DEF cut_off()\nLIN {{X 1,Y 2,Z 3,A 0,B 0,C 0}}\nIF x THEN\nRETURN\n{opens}"
    document = Document(Path("cut_off.src"), text.encode("latin-1"))
    assert len(KrlDialect().read((document,)).toolpath) == 1


def test_what_two_paths_leave_differently_is_not_inherited_though_the_orientation_stays() -> None:
    """With a constant orientation A, B, C of a partial point do not matter; a Y that is not known does."""

    def branch(other: str) -> dict[int, str]:
        one = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}"
        found = body(
            f"$ORI_TYPE=#CONSTANT\n{one}\nIF $IN[1] THEN\n{one}\nELSE\n{other}\nENDIF\nLIN {{X 5}}\n"
        )
        refused = found.toolpath.constraints.refused
        return {row - len(found.toolpath) + 4: finding.message for row, finding in refused.items()}

    assert "omits Y, A" in branch("LIN {X 1,Y 9,Z 3,A 7,B 5,C 6}")[3]
    assert not branch("LIN {X 1,Y 2,Z 3,A 7,B 5,C 6}")


def test_from_where_a_motion_may_start() -> None:
    line = "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
    path = body(f"{line}IF $IN[1] THEN\n{line}ELSE\n{line}ENDIF\n{line}{line}").toolpath
    last = len(path) - 1
    assert path.predecessors == {last - 3: (last - 4,), last - 2: (last - 4,), last - 1: (last - 3, last - 2)}
    assert path.continues.tolist()[-5:] == [True, False, False, False, True]


@pytest.mark.parametrize("word", ["BAS(#BASE,2)\n", "BAS(#TOOL,2)\n"])
def test_the_same_numbers_in_other_frames_are_no_common_point(word: str) -> None:
    """What two paths reach in different frames is not inherited, whatever the frames are from there on."""

    def last(first: str, second: str) -> tuple[np.ndarray, str]:
        point = "LIN {X 7,Y 8,Z 9,A 4,B 5,C 6}\n"
        path = body(
            f"IF $IN[1] THEN\n{first}{point}ELSE\n{second}{point}ENDIF\nBAS(#BASE,1)\nBAS(#TOOL,1)\nLIN {{X 100}}\n"
        ).toolpath
        refused = path.constraints.refused.get(len(path) - 1)
        return path.position[-1] / MM, "" if refused is None else refused.message

    place, why = last("", "")
    np.testing.assert_allclose(place, [100.0, 8.0, 9.0])
    assert why == ""
    for first, second in ((word, ""), ("", word)):
        place, why = last(first, second)
        assert np.isnan(place).all()
        assert "the position is not known: it varies" in why


def test_the_orientation_after_a_run_of_plain_lines_is_that_of_a_last_ptp() -> None:
    """Under #CONSTANT the LIN before it does not turn the tool to its own angles, and the PTP does."""
    lines = "".join(f"LIN {{X {x},Y 2,Z 3,A {x},B 5,C 6}}\n" for x in range(10, 30))
    last = "PTP {X 50,Y 2,Z 3,A 70,B 5,C 6}\n"
    rest = "$ORI_TYPE=#VAR\nLIN {Y 9}\n"
    known = body("$ORI_TYPE=#CONSTANT\n" + lines + last + rest)
    assert codes(known) == []
    turned = body(lines + last + rest).toolpath
    np.testing.assert_allclose(known.toolpath.rotation[-1], turned.rotation[-1], atol=1e-12)
    assert len(codes(body("$ORI_TYPE=#CONSTANT\n" + lines + rest))) == 1
    line = "LIN {X 60,Y 2,Z 3,A 80,B 5,C 6}\n"
    assert len(codes(body("$ORI_TYPE=#CONSTANT\n" + lines + last + line + rest))) == 1
    assert codes(body("$ORI_TYPE=#CONSTANT\n" + lines + last + line.replace("A 80", "A 70") + rest)) == []
