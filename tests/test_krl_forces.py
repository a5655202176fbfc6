"""FORCE and COMPENSATE comments of KRL where paths part and meet."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import ReadingSettings

LINE = "LIN {{X {},Y 2,Z 3,A 4,B 5,C 6}}\n"
HEAD = "DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"


def read(text: str, **others: str):
    """Lines of motions with the comments in force: "?" where they differ with the path; and the findings."""
    siblings = tuple(Document(Path(f"{name}.src"), body.encode()) for name, body in others.items())
    document = Document(Path("part.src"), text.encode())
    path = DIALECTS["krl"].read((document,), ReadingSettings(siblings=siblings)).toolpath
    refused = {row for row, finding in path.constraints.refused.items() if finding.code == "KRL036"}
    said = [""] * len(path)
    for comment in path.annotations:
        said[comment.row :] = [comment.text] * (len(path) - comment.row)
    return [(line, "?" if row in refused else said[row]) for row, line in enumerate(path.line.tolist())], path


@pytest.mark.parametrize("word", ["FORCE 1 0 0", "COMPENSATE OFF", "force 1,0,0"])
def test_a_comment_that_is_passed_or_not(word):
    text = f"{HEAD}IF $IN[1] THEN\n;{word}\nENDIF\n{LINE.format(1)};FORCE OFF\n;COMPENSATE ON\n{LINE.format(2)}END\n"
    rows, path = read(text)
    assert rows == [(7, "?"), (10, "COMPENSATE ON")]
    assert "differs with the path" in path.constraints.refused[0].message


def test_the_same_comment_on_all_paths_is_in_force():
    branches = "IF $IN[1] THEN\n;FORCE 1 0 0\nELSE\n; force  1 0 0\nENDIF\n"
    assert read(f"{HEAD}{branches}{LINE.format(1)}END\n")[0] == [(9, "force  1 0 0")]


def test_off_in_a_branch_is_what_no_comment_is():
    cut = f"IF $IN[1] THEN\n;FORCE 1 0 0\n{LINE.format(1)};FORCE OFF\nENDIF\n"
    assert read(f"{HEAD}{cut}{LINE.format(2)}END\n")[0] == [(6, "FORCE 1 0 0"), (9, "FORCE OFF")]


def test_a_comment_that_the_path_to_a_motion_goes_past_is_stated_again():
    text = f"{HEAD}IF $IN[1] THEN\n;FORCE 3 0 0\n{LINE.format(3)}RETURN\nENDIF\n{LINE.format(4)}END\n"
    rows, path = read(text)
    assert rows == [(6, "FORCE 3 0 0"), (9, "?")]
    assert "no FORCE comment is in force" in path.constraints.refused[1].message
    text = text.replace(HEAD, f"{HEAD};FORCE 5 0 0\n")
    assert read(text)[0] == [(7, "FORCE 3 0 0"), (10, "FORCE 5 0 0")]


@pytest.mark.parametrize(
    ("sub", "after"),
    [
        ("", "FORCE 1 0 0"), (";FORCE 2 0 0\n", "?"), (";FORCE 2 0 0\n;FORCE 1 0 0\n", "FORCE 1 0 0"),
        ("IF $IN[1] THEN\n;FORCE OFF\nENDIF\n", "?"),
    ],
)  # fmt: skip
def test_a_routine_of_another_module_with_comments(sub, after):
    text = f"{HEAD};FORCE 1 0 0\nother()\n{LINE.format(1)}END\n"
    rows, _ = read(text, other=f"DEF other()\n{sub}END\n")
    assert rows == [(6, after)]


def test_a_comment_that_an_interrupt_may_run():
    text = f"{HEAD}INTERRUPT DECL 3 WHEN $IN[1] DO away()\n;FORCE 1 0 0\n{LINE.format(1)}END\nDEF away()\n"
    assert read(f"{text}END\n")[0] == [(6, "FORCE 1 0 0")]
    assert read(f"{text};FORCE OFF\nEND\n")[0] == [(6, "?")]


def test_a_routine_that_others_call_too():
    """A function is not followed: its motions run with the comments of any caller."""
    start = f"{HEAD};FORCE 1 0 0\nIF f() THEN\nENDIF\nEND\nDEFFCT BOOL f()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n"
    end = f"{LINE.format(1)}RETURN TRUE\nENDFCT\n"
    assert read(start + end)[0] == [(11, "?")]
    assert read(f"{start};FORCE 2 0 0\n{end}")[0] == [(12, "FORCE 2 0 0")]


@pytest.mark.parametrize("condition", ["$IN[1]", "TRUE", "FALSE"])
def test_a_comment_on_the_line_of_a_branch_counts_in_it(condition):
    branches = f"IF {condition} THEN\n{LINE.format(1)}ELSE ;FORCE 2 0 0\n{LINE.format(2)}ENDIF ;FORCE 3 0 0\n"
    rows = dict(read(f"{HEAD};FORCE 1 0 0\n{branches}{LINE.format(3)}END\n")[0])
    assert rows[10] == "FORCE 3 0 0"
    if condition != "FALSE":
        assert rows[6] == "FORCE 1 0 0"
    if condition != "TRUE":
        assert rows[8] == "FORCE 2 0 0"


@pytest.mark.parametrize(
    ("value", "forces"),
    [("1", ["FORCE 1 0 0"]), ("2", ["FORCE 2 0 0"]), ("3", []), ("$ANIN[1]", ["FORCE 1 0 0", "FORCE 2 0 0"])],
)
def test_a_comment_on_the_line_of_a_case_counts_in_it(value, forces):
    cases = f"CASE 1 ;FORCE 1 0 0\n{LINE.format(1)}CASE 2 ;FORCE 2 0 0\nENDSWITCH\n{LINE.format(3)}"
    rows, path = read(f"{HEAD}SWITCH {value}\n{cases}END\n")
    assert [comment.text for comment in path.annotations] == forces
    assert (rows[-1][1] == "?") == (len(forces) == 2)


def test_a_comment_at_a_label_or_an_end_that_only_jumps_lead_to():
    text = f"{HEAD}GOTO on\n{LINE.format(9)}on: ;FORCE 1 0 0\n{LINE.format(1)}END\n"
    assert dict(read(text)[0])[7] == "FORCE 1 0 0"
    text = f"{HEAD}IF $IN[1] THEN\nRETURN\nENDIF ;FORCE 1 0 0\n{LINE.format(1)}END\n"
    assert read(text)[0] == [(7, "FORCE 1 0 0")]


@pytest.mark.parametrize("last", ["FORCE OFF", "FORCE 2 0 0"])
def test_a_comment_at_a_label_is_passed_again_by_jumps_back(last):
    text = f"{HEAD}on: ;FORCE 1 0 0\n{LINE.format(1)};{last}\nIF $IN[1] THEN\nGOTO on\nENDIF\nEND\n"
    assert read(text)[0] == [(5, "FORCE 1 0 0")]
    assert read(text.replace("IF $IN[1] THEN\n", "").replace("ENDIF\n", ""))[0] == [(5, "FORCE 1 0 0")]


@pytest.mark.parametrize("condition", ["$IN[1]", "TRUE", "FALSE"])
def test_a_comment_behind_then_counts_in_that_branch_alone(condition):
    branches = f"IF {condition} THEN ;FORCE 2 0 0\n{LINE.format(1)}ELSE\n{LINE.format(2)}ENDIF\n"
    rows = dict(read(f"{HEAD};FORCE 1 0 0\n{branches}END\n")[0])
    if condition != "FALSE":
        assert rows[6] == "FORCE 2 0 0"
    if condition != "TRUE":
        assert rows[8] == "FORCE 1 0 0"


@pytest.mark.parametrize(
    ("opens", "closes"),
    [
        ("FOR N=1 TO 2", "ENDFOR"), ("FOR N=1 TO $ANIN[1]", "ENDFOR"), ("N=0\nWHILE N<2", "N=N+1\nENDWHILE"),
        ("WHILE $IN[1]", "ENDWHILE"), ("N=0\nREPEAT", "N=N+1\nUNTIL N==2"), ("REPEAT", "UNTIL $IN[1]"),
        ("N=0\nLOOP", "N=N+1\nIF N==2 THEN\nEXIT\nENDIF\nENDLOOP"),
        ("LOOP", "IF $IN[1] THEN\nEXIT\nENDIF\nENDLOOP"),
    ],
)  # fmt: skip
def test_a_comment_on_the_first_line_of_a_loop_counts_in_each_pass(opens, closes):
    loop = f"{opens} ;FORCE 2 0 0\n{LINE.format(1)};FORCE OFF\n{closes} ;FORCE 3 0 0\n{LINE.format(2)}"
    rows, _ = read(f"DEF part()\nINT N\n{HEAD.partition(chr(10))[2]};FORCE 1 0 0\n{loop}END\n")
    assert {force for _, force in rows[:-1]} == {"FORCE 2 0 0"}
    assert rows[-1][1] == "FORCE 3 0 0"


@pytest.mark.parametrize("loop", ["FOR N=2 TO 1\nENDFOR", "WHILE FALSE\nENDWHILE"])
def test_a_comment_on_the_first_line_of_a_loop_that_never_runs(loop):
    first, end = loop.split("\n")
    text = f"{HEAD};FORCE 1 0 0\n{first} ;FORCE 2 0 0\n{LINE.format(1)}{end}\n{LINE.format(2)}END\n"
    assert dict(read(text)[0])[8] == "FORCE 1 0 0"


def test_a_comment_on_the_first_line_of_a_routine_counts_in_it():
    first, rest = HEAD.split("\n", 1)
    text = f"{first} ;FORCE 1 0 0\n{rest}{LINE.format(1)}sub()\n{LINE.format(2)}END\n"
    text += f"DEF sub() ;FORCE 2 0 0\n{LINE.format(3)}END\n"
    forces = {1: "FORCE 1 0 0", 3: "FORCE 2 0 0", 2: "FORCE 2 0 0"}
    lines = {line: n for n in forces for line, words in enumerate(text.split("\n"), 1) if f"{{X {n}" in words}
    assert {lines[line]: force for line, force in read(text)[0]} == forces


def test_a_jump_to_the_second_of_two_labels_does_not_pass_the_comment_of_the_first():
    """Nor where the jump is followed, nor where it may be taken."""
    for condition in ("i<2", "$IN[1]"):
        text = (
            f"{HEAD}DECL INT i\ni=0\na: ;FORCE 1 0 0\nb:\nLIN {{X 1,Y 2,Z 3,A 4,B 5,C 6}}\n;FORCE OFF\n"
            f"i=i+1\nIF {condition} THEN\nGOTO b\nENDIF\n{LINE.format(2)}END\n"
        )
        rows, _ = read(text)
        first, *others = [force for line, force in rows if line == 8]
        assert [first, *others] == (["FORCE 1 0 0", "FORCE OFF"] if condition == "i<2" else ["?"])
