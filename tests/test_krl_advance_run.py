"""Where the advance run stops, the controller does not approximate, whatever the motion states."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import CELL

from postproc.base.document import Document
from postproc.languages.dialect import Program
from postproc.languages.krl import KrlDialect

KRL = KrlDialect()
HEAD = "DEF part()\nDECL INT I\nDECL BOOL B1\n$BASE=BASE_DATA[1]\n$TOOL=TOOL_DATA[1]\n$VEL.CP=0.05\n$APO.CDIS=2\nI=1\n"
LINE = "LIN {{X {0}, Y 0, Z 0, A 0, B 0, C 180}} C_DIS\n"
ROUTINES = "DEF SUCTION()\n$OUT[7]=TRUE\nEND\nDEF COUNTS()\n$VEL.CP=0.02\nEND\n"


def read(text: str, after: str = ROUTINES) -> Program:
    return KRL.read((Document(Path("part.src"), f"{HEAD}{text}END\n{after}".encode()),))


def blends(text: str, after: str = ROUTINES) -> list[float]:
    """[mm] of each motion."""
    return [round(1000 * one, 6) for one in read(text, after).toolpath.approximation.tolist()]


def between(text: str) -> str:
    return LINE.format(0) + LINE.format(10) + text + "\n" + LINE.format(20) + LINE.format(30)


STOPS = [
    "WAIT SEC 0",
    "WAIT FOR $IN[3]",
    "HALT",
    "$OUT[7]=TRUE",
    "$ANOUT[1]=0.5",
    "B1=$IN[2]",
    "PULSE($OUT[3],TRUE,0.1)",
    "P=$POS_ACT",
    "IF $IN[1] THEN\nI=2\nENDIF",
    "IF $IN[1] AND (I==1) THEN\nI=2\nELSE\nI=3\nENDIF",
    "SWITCH $ANIN[1]\nCASE 1\nI=2\nENDSWITCH",
    "SUCTION()",
    "CONTINUE\nI=2\n$OUT[7]=TRUE",
    "B1=TRUE\n$OUT[7]=TRUE",
    "BAS(#VEL_CP,0.02)\n$OUT[7]=TRUE",
    "IF I==1 THEN\n$OUT[7]=TRUE\nENDIF",
]
FLOWS = [
    "I=2",
    "$VEL.CP=0.02",
    "$APO.CDIS=2",
    "$BASE=BASE_DATA[1]",
    "$ORI_TYPE=#VAR",
    "BAS(#VEL_CP,0.02)",
    "$BWDSTART=FALSE\nLDAT_ACT=LCPDAT2\nFDAT_ACT=FP2",
    "; only a comment",
    ";FOLD x\n;ENDFOLD",
    "COUNTS()",
    "FOR I=1 TO 3\nB1=TRUE\nENDFOR",
    "IF I==1 THEN\nB1=TRUE\nENDIF",
    "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE",
    "TRIGGER WHEN DISTANCE=0 DELAY=0 DO PULSE($OUT[1],TRUE,0.1)",
    "INTERRUPT DECL 3 WHEN $IN[2]==TRUE DO COUNTS()",
    "INTERRUPT ON 3",
    "GLOBAL INTERRUPT DECL 4 WHEN $IN[2]==TRUE DO SUCTION()",
    "CONTINUE\n$OUT[7]=TRUE",
    "CONTINUE\n; the nozzle\n$OUT[7]=TRUE",
    "CONTINUE\nB1=$IN[2]",
    "$OUT_C[7]=TRUE",
    "R=SIN(30)+I",
]
UNKNOWN = [
    "NOZZLE=TRUE",
    "B1=NOZZLE",
    "UNREAD()",
    "CWRITE($FCT_CALL,STAT,MODE,I)",
    "$SOMETHING=1",
    "CONTINUE\nWAIT FOR $IN[3]",
    "IF B1 THEN\n$OUT[7]=TRUE\nENDIF",
    "WHILE B1\n$OUT[7]=TRUE\nENDWHILE",
]


@pytest.mark.parametrize("text", STOPS)
def test_a_statement_that_stops_the_advance_run(text):
    assert blends("DECL POS P\n" + between(text)) == [2, 0, 2, 2]
    assert [finding.code for finding in read(between(text)).findings].count("KRL035") == 1


@pytest.mark.parametrize("text", FLOWS)
def test_a_statement_that_does_not(text):
    assert blends("DECL REAL R\n" + between(text)) == [2, 2, 2, 2]
    assert "KRL035" not in [finding.code for finding in read("DECL REAL R\n" + between(text)).findings]


@pytest.mark.parametrize("text", UNKNOWN)
def test_a_statement_of_which_it_is_not_known(text):
    found = blends(between(text))
    assert np.isnan(found[1])
    assert found[0] == found[2] == found[3] == 2
    (one,) = [finding for finding in read(between(text)).findings if finding.code == "KRL035"]
    assert "may stop" in one.message


def test_a_motion_that_is_exact_anyway_is_not_told():
    text = between("WAIT SEC 1").replace("C_DIS", "")
    assert blends(text) == [0, 0, 0, 0]
    assert "KRL035" not in [finding.code for finding in read(text).findings]


def test_a_stop_before_the_first_motion_and_after_the_last():
    assert blends("WAIT SEC 1\n" + between("I=2")) == [2, 2, 2, 2]
    assert blends(between("I=2") + "WAIT SEC 1\n") == [2, 2, 2, 0]


def test_a_stop_before_an_end_in_a_loop_that_is_given_up():
    """Its rows are taken out again, and so is what ended after them."""
    end = "IF I==40 THEN\nIF $IN[1] THEN\nRETURN\nENDIF\nENDIF\n"
    found = blends(f"WHILE I<90\n{LINE.format(0)}{LINE.format(1)}I=I+1\nWAIT SEC 1\n{end}ENDWHILE\n")
    assert found[0] == 2
    assert len(found) == 2
    assert np.isnan(found[1])


def test_no_motion_is_planned_ahead():
    assert blends("$ADVANCE=0\n" + between("I=2")) == [0, 0, 0, 0]
    assert blends("$ADVANCE=1\n" + between("I=2")) == [2, 2, 2, 2]
    assert np.isnan(blends("$ADVANCE=$OV_PRO\n" + between("I=2"))).all()
    assert blends("$ADVANCE=0\n" + LINE.format(0) + "$ADVANCE=3\n" + LINE.format(5))[1] == 2
    assert blends("$ADVANCE=0\nBAS(#INITMOV,0)\n$APO.CDIS=2\n" + between("I=2")) == [2, 2, 2, 2]


def test_paths_that_meet():
    one, two, three = (LINE.format(10 * k) for k in range(3))
    branch = f"{one}IF B1 THEN\n{two}WAIT SEC 1\nELSE\n{three}ENDIF\n" + LINE.format(50)
    first, *inner, last = blends(branch)
    assert first == last == 2
    assert np.isnan(inner).all()
    inside = f"{one}IF B1 THEN\nWAIT SEC 1\n{two}ELSE\n{three}ENDIF\n"
    assert np.isnan(blends(inside)[0])
    loop = f"LOOP\n{one}{two}WAIT SEC 1\nENDLOOP\n"
    first, last = blends(loop)
    assert first == 2
    assert last == 0 or np.isnan(last)


def test_a_routine_of_which_nobody_knows_who_calls_it():
    """A later caller may wait, or not."""
    after = (
        "GLOBAL DEF OTHER()\n$APO.CDIS=2\n"
        + LINE.format(5)
        + LINE.format(6)
        + "WAIT SEC 1\n"
        + LINE.format(7)
        + "END\n"
    )
    *inner, last = blends("", after)
    assert inner == [2, 0]
    assert np.isnan(last)


def test_a_routine_that_is_called_where_calls_are_not_followed():
    """What it gets is a component of a frame in force; the caller waits behind it."""
    routines = f"DEF BETWEEN()\nINNER($BASE.Z)\nWAIT SEC 1\nEND\nDEF INNER(W:OUT)\n$APO.CDIS=2\n{LINE.format(5)}END\n"
    _, at_last = blends(f"{LINE.format(0)}BETWEEN()\n", routines)
    assert np.isnan(at_last) or at_last == 0


@pytest.mark.slow
@pytest.mark.parametrize("text", ["WAIT SEC 0.5", "$OUT[3]=TRUE"])
def test_the_output_is_that_of_exact_motions(tmp_path, compensate, text):
    """The corner is not rounded, so nothing is moved for its rounding: the numbers are those of a program without
    C_DIS there.  Where the path flows they are others."""
    (tmp_path / "cell.yaml").write_text(CELL)
    frame = "A 0, B 0, C 180}"
    path = [
        "LIN {X 0, Y 0, Z 100, " + frame,
        "LIN {X 0, Y 0, Z 0, " + frame,
        ";FORCE 200 -300 -400 @feed",
        "LIN {X 60, Y 0, Z 0, " + frame + " C_DIS",
        "%s",
        "LIN {X 60, Y 60, Z 0, " + frame + " C_DIS",
        "LIN {X 120, Y 60, Z 0, " + frame,
        ";FORCE OFF",
        "LIN {X 120, Y 60, Z 100, " + frame,
    ]
    numbers = []
    for between, exact in ((text, False), (text, True), ("; flows", False)):
        lines = [*HEAD.splitlines(), *path, "END"]
        lines = [line.replace("%s", between) for line in lines]
        if exact:
            lines = [line.removesuffix(" C_DIS") if "X 60, Y 0," in line else line for line in lines]
        program = tmp_path / "part.src"
        program.write_text("\n".join(lines) + "\n")
        done = compensate(program, "--force", "-o", tmp_path / "out.src", "-q")
        assert done.code in (0, 3), done.err
        written = (tmp_path / "out.src").read_text()
        numbers.append(
            [line.removesuffix(" C_DIS") for line in written.splitlines() if line.startswith("LIN")]
        )
    assert numbers[0] == numbers[1]
    assert numbers[0] != numbers[2]


def test_what_is_inserted_into_a_motion_is_approximated_as_the_program_states() -> None:
    """With C_DIS, from $APO.CDIS on: in bulk or alone, of lines and arcs, of motions that end exactly as well."""
    text = "$APO.CDIS=2\n" + LINE.format(0).replace(" C_DIS", "") + "$APO.CDIS=0.5\n" + LINE.format(10) * 3
    text += "LIN {X 40,Y 0,Z 5}\nLIN {X 40,Y 1,Z 5,A 0,B 0,C 180}\n"
    stated = read(text).toolpath.constraints.inserted_approximation
    assert stated == pytest.approx([0.002, *[0.0005] * (len(stated) - 1)])
    assert len(stated) == 6
    stopped = read("$APO.CDIS=2\n$ADVANCE=0\n" + LINE.format(0)).toolpath.constraints.inserted_approximation
    assert stopped == pytest.approx([0.0])
