"""A law of KRL: once a line sets what is not understood, nothing behind it is taken for what was in force before."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from postproc.base.document import Document
from postproc.languages.krl import KrlDialect

TARGET = "LIN {X 1,Y 0,Z 0,A 0,B 0,C 0}\n"
FRAME, NUMBER = "{X 7,Y 0,Z 0,A 0,B 0,C 0}", "2"
OTHER = FRAME.replace("7", "9")
SETTINGS = {
    "base": [("$BASE=@", FRAME, ""), ("MINE=@", FRAME, "$BASE=MINE\n"), ("BAS(#BASE,@)", NUMBER, "")],
    "tool": [("$TOOL=@", FRAME, ""), ("MINE=@", FRAME, "$TOOL=MINE\n"), ("n=@", NUMBER, "BAS(#TOOL,n)\n")],
    "feed": [("$VEL.CP=@", "0.1", ""), ("$VEL=@", "{CP 0.1,ORI1 200,ORI2 200}", "")],
}
"""What is in force -> statements with a value (@), a value that is understood, and how it comes into force."""
UNREAD = ["GRÖSSE", "grösse", "2 2", "elsewhere(1)", "2)", "{X 7,,}", "$IN[1", "¹"]
"""Values that no program of this language has, or whose value the program does not say."""
CASES = [(word, *setting) for word, settings in SETTINGS.items() for setting in settings]


def in_force(text: str) -> dict[str, str]:
    """Base, tool and feed of the last motion of a program, as far as they are known."""
    declared = "DECL FRAME MINE\nDECL INT n\nBAS(#BASE,1)\nBAS(#TOOL,1)\n$VEL.CP=0.5\n"
    document = Document(Path("part.src"), f"DEF part()\n{declared}{text}END\n".encode("latin-1"))
    path = KrlDialect().read((document,)).toolpath
    line = list(path.dump())[-1].partition(" refused")[0].partition(" feed")[0]
    base, _, tool = line.partition("base ")[2].partition(" tool ")
    return {"base": base, "tool": tool, "feed": f"{path.feed[-1]:g}"}


@pytest.mark.parametrize("unread", UNREAD)
@pytest.mark.parametrize(("word", "statement", "value", "then"), CASES)
def test_a_value_that_is_not_understood_leaves_nothing_in_force(
    word: str, statement: str, value: str, then: str, unread: str
) -> None:
    """And one that is understood comes into force, alone."""
    before = in_force(TARGET)
    understood = in_force(TARGET + statement.replace("@", value) + "\n" + then + TARGET)
    assert understood[word] not in (before[word], "?", "nan")
    assert {**understood, word: ""} == {**before, word: ""}
    known = statement.replace("@", value) + "\n" if then else ""
    after = in_force(known + TARGET + statement.replace("@", unread) + "\n" + then + TARGET)
    assert after[word] in ("?", "nan")


@pytest.mark.parametrize("name", ["MÜNE", "GRÖSSE", "grösse"])
@pytest.mark.parametrize(
    "line",
    [
        f"DECL FRAME @={OTHER},MINE={OTHER}",
        f"DECL FRAME MINE={OTHER},@={OTHER}",
        f"DECL @ MINE={OTHER}",
        f"@={OTHER} MINE={OTHER}",
        "@(MINE)",
        "@(1,MINE)",
        "n=@(MINE)",
        "IF @(MINE) THEN\nENDIF",
    ],
)
def test_a_name_that_is_no_krl_leaves_no_other_name_of_its_line_known(line: str, name: str) -> None:
    """Of those that the line assigns, or hands over where they may come back changed."""
    known, used = f"MINE={FRAME}\n", "$BASE=MINE\n" + TARGET
    assert in_force(known + used)["base"] not in ("?", "[1]")
    assert in_force(known + line.replace("@", name) + "\n" + used)["base"] in ("?", "{9 0 0 0 0 0}")
    apart = line.replace("@", name).replace("MINE", "THAT") + "\n"
    assert in_force(known + apart + used)["base"] in ("?", in_force(known + used)["base"])


WORDS = re.findall(
    r"\w+",
    "IF THEN ELSE ENDIF FOR ENDFOR WHILE ENDWHILE REPEAT UNTIL LOOP ENDLOOP SWITCH CASE DEFAULT ENDSWITCH GOTO RETURN "
    "EXIT HALT WAIT PTP LIN CIRC SPLINE ENDSPLINE END DECL CONTINUE INTERRUPT TRIGGER RESUME",
)
"""Key words of the manual of the system's integrator."""


@pytest.mark.parametrize("line", ["@=5", "@.X=5", "DECL INT @", "INT @", "DECL INT n,@"])
def test_a_key_word_is_no_name(line: str) -> None:
    """Who writes it meant another line: the one that is there is found."""
    taken = []
    for word in WORDS:
        text = f"DEF part()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n{line.replace('@', word)}\n{TARGET}END\n"
        found = KrlDialect().read((Document(Path("part.src"), text.encode()),))
        findings = [*found.findings, *found.toolpath.constraints.refused.values()]
        if 4 not in [finding.line for finding in findings]:
            taken.append(word)
    assert taken == []
