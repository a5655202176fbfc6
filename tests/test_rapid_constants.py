"""What is no constant of a RAPID program, though one run of its text gives one value."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.base.document import Document
from postproc.languages import DIALECTS

POINT = "[[1,2,n1],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
MOVE = f"MoveL {POINT},v50,fine,t1;"
HEAD = (
    "MODULE part\nPERS tooldata t1:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];\n"
    "VAR num n1:=2;\nPERS num kept:=3;\nVAR bool a:=FALSE;\nVAR bool b:=FALSE;\nVAR num x:=0.1;\n"
)


def refused(main: str, rest: str = "") -> list[bool]:
    """Of the motions in the order in which they run first, whether they are not corrected."""
    text = f"{HEAD}PROC main()\n{main}\nENDPROC\n{rest}\nENDMODULE\n"
    program = DIALECTS["rapid"].read((Document(Path("part.mod"), text.encode()),))
    return [row in program.toolpath.constraints.refused for row in range(len(program.toolpath))]


UNKNOWN = {
    "a trap that calls": (f"n1:=2;\n{MOVE}", "TRAP t\ntouch;\nENDTRAP\nPROC touch()\nn1:=n1+1;\nENDPROC"),
    "a trap that displaces": (MOVE, "TRAP t\nPDispSet d;\nENDTRAP"),
    "what an earlier run left": (f"n1:=kept;\n{MOVE}\nkept:=4;\nkept:=3;", ""),
    "a displacement of an earlier run": (f"{MOVE}\nPDispSet d;", ""),
    "another start of main": (f"{MOVE}\nn1:=5;\nIF di1=1 ExitCycle;\nn1:=2;", ""),
    "a second name": ("n1:=2;\nsub n1;", f"PROC sub(INOUT num o)\no:=5;\n{MOVE}\nENDPROC"),
    "two parameters": (
        "n1:=2;\nsub n1,n1;",
        f"PROC sub(INOUT num o,INOUT num p)\no:=5;\n{MOVE.replace('n1', 'p')}\nENDPROC",
    ),
    "a function that assigns": (
        f"VAR num n1:=1;\nkept:=f();\nsub;\nn1:=n1;\n{MOVE.replace('n1', '7')}",
        f"FUNC num f()\nn1:=n1+1;\nRETURN 1;\nENDFUNC\nPROC sub()\n{MOVE}\nENDPROC",
    ),
    "AND after NOT": (f"IF NOT a AND b n1:=5;\n{MOVE}", ""),
    "rounding": (f"n1:=2;\nIF x*3=0.3 n1:=5;\n{MOVE}", ""),
    "a procedure by its name": (f'n1:=2;\nCallByVar "sub",1;\n{MOVE}', "PROC sub1()\nn1:=7;\nENDPROC"),
    "data by its name": (f'SetDataVal "n1",kept;\n{MOVE}', ""),
    "an error": (f"sub;\n{MOVE}", "PROC sub()\nn1:=1;\nWaitDI d,1;\nn1:=2;\nERROR\nRETURN;\nENDPROC"),
}


@pytest.mark.parametrize("name", UNKNOWN)
def test_it_is_not_claimed(name: str) -> None:
    assert refused(*UNKNOWN[name])[0]


@pytest.mark.parametrize("displaces", ["PDispOn\\Rot,p1,t1", "PDispOn\\ExeP:=p1,p1,t1\\WObj:=w1"])
def test_what_displaces_motions_changes_none_of_its_arguments(displaces: str) -> None:
    data = f"VAR robtarget p1:={POINT.replace('n1', '3')};\nPROC touch()\nPDispOff;\nENDPROC"
    assert refused(f"{displaces};\n{MOVE}\nPDispOff;\ntouch;\nn1:=2;\n{MOVE}", data) == [True, False]


def test_what_is_a_constant_is_claimed() -> None:
    assert refused(f"n1:=2;\nIF NOT (a AND b) n1:=5;\n{MOVE}\nIF NOT n1=2 n1:=6;\n{MOVE}") == [False, False]
