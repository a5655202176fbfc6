"""RAPID: what a routine gets from a call and gives back, and what functions of the controller give for constants.

Truth from ABB's reference manual, worked out by hand.  Optional parameters of which one excludes the others are written
with | between them; Present is TRUE for those that the call gives; what an INOUT parameter is set to is set in the data
of the caller.
"""

from __future__ import annotations

import pytest

from tests.test_rapid_asides import EXTRA, read, row_of

WITH_SWITCHES = """PROC main()
go\\fast,p;
go\\slow,[[7,2,3],[0,0,1,0],{0}];
ENDPROC
PROC go({1})
IF Present(fast) THEN
MoveL q,v500,fine,t;
ELSE
MoveL q,v50,fine,t;
ENDIF
ENDPROC
"""


def place(text: str, words: str) -> list[float] | None:
    """X, Y, Z [mm] of the first motion with these words, rounded; None where it is refused."""
    program = read(text)
    row = row_of(program, words)
    refused = row in program.toolpath.constraints.refused
    return None if refused else [round(x * 1000.0, 6) for x in program.toolpath.position[row].tolist()]


@pytest.mark.parametrize(
    "given", ["\\switch fast|switch slow,robtarget q", "\\ num k | switch fast|switch slow,robtarget q"]
)
def test_one_of_several_optional_parameters(given: str) -> None:
    text = WITH_SWITCHES.format(EXTRA, given)
    assert place(text, "v500") == [1, 2, 3]
    assert place(text, "v50,") == [7, 2, 3]


@pytest.mark.parametrize(
    "given", ["switch fast|switch slow,robtarget q", "\\switch fast|,robtarget q", "robtarget q|num k"]
)
def test_what_excludes_nothing_is_not_understood(given: str) -> None:
    assert "RAP007" in {one.code for one in read(WITH_SWITCHES.format(EXTRA, given)).findings}


def test_a_parameter_that_not_all_calls_give() -> None:
    text = "PROC main()\n{}ENDPROC\nPROC go(\\num k)\n"
    text += "IF Present(k) THEN\nMoveL Offs(p,k,0,0),v50,fine,t;\nENDIF\nENDPROC\n"
    assert place(text.format("go;\ngo\\k:=5;\n"), "Offs") == [6, 2, 3]
    assert place(text.format("go\\k:=4;\ngo\\k:=5;\n"), "Offs") is None
    assert place(text.format("go;\n"), "Offs") is None  # not reached


def test_what_a_call_sets_in_the_data_of_its_caller() -> None:
    main = "PROC main()\nVAR num c:=0;\ncount c,1;\ncount c,2;\nMoveL Offs(p,c,0,0),v50,fine,t;\nENDPROC\n"
    sub = "PROC count(INOUT num o,num by)\no:=o+by;\n{}ENDPROC\n"
    assert place(main + sub.format(""), "Offs") == [4, 2, 3]
    deeper = sub.format("again o;\n") + "PROC again(INOUT num d)\nd:=d*2;\nENDPROC\n"  # (((0+1)*2)+2)*2
    assert place(main + deeper, "Offs") == [9, 2, 3]
    assert place(main + sub.format("IF di1=1 o:=7;\n"), "Offs") is None
    assert place(main + sub.format("ERROR\nRETURN;\n"), "Offs") is None
    twice = main.replace("count c,2", "both c,c")
    assert (
        place(twice + sub.format("") + "PROC both(INOUT num a,INOUT num b)\na:=5;\nENDPROC\n", "Offs") is None
    )


def test_an_element_that_a_call_sets_is_not_known() -> None:
    main = "PROC main()\nVAR num c{2}:=[1,2];\nset c{1};\nMoveL Offs(p,c{1},0,0),v50,fine,t;\nENDPROC\n"
    assert place(main + "PROC set(INOUT num o)\no:=5;\nENDPROC\n", "Offs") is None


NUMBERS = {
    "0x1F": 31,
    "-0x1F": -31,
    "0b101": 5,
    "0o17": 15,
    "0X0a+1": 11,
    "Round(2.4)": 2,
    "Round(-2.6)": -3,
    "Round(2.546\\Dec:=2)": 2.55,
    "Round(7)": 7,
    "Trunc(2.7)": 2,
    "Trunc(2.549\\Dec:=2)": 2.54,
    "Trunc(-3)": -3,
    "Pow(2,3)": 8,
    "Exp(0)": 1,
    "ATan2(1,-1)": 135,
    "ATan2(-1,0)": -90,
    "Round(2.5)": None,
    "Round(0.145\\Dec:=2)": None,
    "Round(2.4\\Dec:=n2)": None,
    "Trunc(-2.7)": None,
    "Trunc(3*0.1/0.1)": None,
    "Pow(-2,0.5)": None,
    "ATan2(0,0)": None,
    "Round(n2)": None,
}


@pytest.mark.parametrize("words", NUMBERS)
def test_the_value_of_a_number(words: str) -> None:
    expected = NUMBERS[words]
    found = place(
        f"PERS num n2:=2;\nPROC main()\nMoveL Offs(p,0,{words},0),v50,fine,t;\nn2:=n2+1;\nENDPROC\n", "Offs"
    )
    assert found == (None if expected is None else [1, 2 + expected, 3])


# A: 90 deg about z, then 10 mm along x of the outer frame: (x, y, z) -> (10 - y, x, z)
POSES = {
    "PoseVect(a,[1,2,3])": [8, 1, 3],
    "PoseVect(PoseInv(a),[8,1,3])": [1, 2, 3],
    "PoseVect(PoseMult(a,a),[1,2,3])": [9, 8, 3],  # (8, 1, 3) -> (10 - 1, 8, 3)
    "PoseVect(PoseMult(PoseInv(a),a),[1,2,3])": [1, 2, 3],
    "PoseVect(b,[1,2,3])": None,
    "PoseVect(a,1)": None,
}


@pytest.mark.parametrize("words", POSES)
def test_the_value_of_a_pose(words: str) -> None:
    data = "CONST pose a:=[[10,0,0],[0.70710678,0,0,0.70710678]];\n"
    data += "PERS pose b:=[[0,0,0],[0,0,0,0]];\nVAR robtarget q;\n"
    text = f"{data}PROC main()\nq:=p;\nq.trans:={words};\nMoveL q,v50,fine,t;\nENDPROC\n"
    assert place(text, "MoveL q") == POSES[words]
