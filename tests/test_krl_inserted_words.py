"""A word that is put into a statement of KRL changes the reading or gives a finding: none is ever dropped.

Every word of a list at every place of statements of each kind; where it makes no difference it says what holds anyway.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from test_gcode_inserted_words import signature

from postproc.base.document import Document
from postproc.languages.krl import interpreter

FULL = "{X 1,Y 2,Z 3,A 4,B 5,C 6}"
HEAD = (
    "DEF part()\nDECL INT n,m\nDECL REAL r\nDECL FRAME f\nDECL BOOL b\n"
    "INTERRUPT DECL 7 WHEN $IN[7]==TRUE DO isr()\nBAS(#BASE,1)\nBAS(#TOOL,1)\n$VEL.CP=0.1\n$APO.CDIS=3\n"
    f"n=2\nm=3\nr=1.5\nb=TRUE\nf={FULL}\nPTP {{A1 0,A2 -90,A3 90,A4 0,A5 45,A6 0}}\n"
    "LIN {X 10,Y 20,Z 30,A 40,B 50,C 60}\n"
)
TAIL = (
    "\nLIN {X 11} C_DIS\nLIN {Y n,Z m}\nCIRC {X 5,Y 9},{X 3,Y 2} C_DIS\nLIN f\nf.X=n*r\nLIN f\n"
    f"IF b THEN\nLIN_REL {{Z 5}} #TOOL\nENDIF\nLIN {FULL}\nEND\n"
    "DEF sub(v:IN)\nINT v\n$BASE=BASE_DATA[4]\nEND\nDEF isr()\nEND\n"
)
"""What follows shows what a statement leaves in force."""
MOTIONS = (
    "LIN {X 1,Y 2}", f"LIN {FULL} C_DIS", "PTP {A1 5}", "PTP {X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 3} C_PTP", "LIN f",
    "LIN f:{X 1,Y 5,Z 5,A 5,B 5,C 5}", "LIN_REL {X 5} #BASE", "CIRC {X 5,Y 9},{X 3,Y 2},CA 200",
    "SLIN f WITH $VEL.CP=0.2",
)  # fmt: skip
OTHERS = (
    "n=5", "r=n*2", "b=n>2", "f.X=5", f"f={FULL}", "$BASE=BASE_DATA[2]", f"$TOOL={FULL}", "$VEL.CP=0.3",
    "$VEL={CP 0.3,ORI1 200}", "$APO.CDIS=4", "$ORI_TYPE=#JOINT", "BAS(#BASE,2)", "BAS(#VEL_CP,0.4)",
    "BAS(#INITMOV,0)", "sub(3)", "GOTO lab\nlab:", "IF n==2 THEN\nm=4\nENDIF", "IF n==3 THEN\nm=4\nELSE\nm=5\nENDIF",
    "SWITCH n\nCASE 2,3\nm=4\nDEFAULT\nm=5\nENDSWITCH", "FOR m=1 TO 2\nLIN f\nENDFOR",
    "FOR m=1 TO 3 STEP 2\nLIN f\nENDFOR", "WHILE n<3\nn=n+1\nENDWHILE", "REPEAT\nn=n+1\nUNTIL n>3",
    "LOOP\nEXIT\nENDLOOP", "SPLINE\nSPL {X 5}\nENDSPLINE", "WAIT SEC 0.5", "WAIT FOR $IN[1]", "HALT", "CONTINUE",
    "$OUT[1]=TRUE", "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[1]=TRUE", "INTERRUPT ON 7", f"BASE_DATA[2]={FULL}",
    "DECL INT k", "BASE_DATA[2].X=5\n$BASE=BASE_DATA[2]",
)  # fmt: skip
WORDS = (
    "X", "5", "8.25", "n", "f", "b", "P9", "C_DIS", "#BASE", "#TOOL", "#JOINT", "$BASE", "$VEL.CP", "LIN", "PTP",
    "CIRC", "BAS", "IF", "THEN", "ELSE", "ENDIF", "FOR", "TO", "STEP", "WHILE", "GOTO", "lab", "EXIT", "RETURN", "END",
    "DEF", "DECL", "INT", "WITH", "CA", "WAIT", "DO", "TRUE", "AND", "=", "==", "-", ":", ",", "(", ")", "[", "]",
    "{", "}", '"a"', "'B1'", "zzz", "n=7", "$BASE=BASE_DATA[3]",
)  # fmt: skip
_TOKEN = re.compile(r"[A-Za-z_$][A-Za-z0-9_$]*|\d+(?:\.\d+)?|[^\sA-Za-z0-9]|\n")


def places(block: str) -> list[int]:
    """Between any two words."""
    return sorted({0, len(block), *(end for found in _TOKEN.finditer(block) for end in found.span())})


def says_the_same(block: str, word: str, at: int) -> bool:
    """Whether the word is legal there and says what holds anyway, or what no motion shows."""
    before, rest = block[:at].rstrip(" "), block[at:].lstrip(" ")
    if word == "-":  # the sign of a number that no motion has
        return block not in MOTIONS
    if word == ",":  # a parameter that is left out
        return "(" in block or "[" in block
    if word == "INT":
        return re.match(r"\w+=", rest) is not None  # the variable is declared there
    if word == "=":
        return before.endswith("CA")
    return word == "C_DIS" and "C_DIS" in block  # several approximations may follow


CASES = [
    (block, f"{block[:at]} {word} {block[at:]}")
    for block in (*MOTIONS, *OTHERS)
    for word in WORDS
    for at in places(block)
    if not says_the_same(block, word, at)
]


def read(text: str) -> list[str]:
    return signature(interpreter.read((Document(Path("part.src"), f"{HEAD}{text}{TAIL}".encode()),)))


def dropped(cases: list[tuple[str, str]]) -> list[str]:
    """Statements with a word that makes no difference."""
    plain = {block: read(block) for block in {block for block, _ in cases}}
    return [text for block, text in cases if read(text) == plain[block]]


def test_no_word_is_dropped() -> None:
    assert dropped(CASES[::301]) == []


@pytest.mark.slow
def test_no_word_is_dropped_anywhere() -> None:
    """In more than 2,000 of the statements; the remainder of the places is another one each time the lists change."""
    cases = CASES[::12]
    assert len(cases) > 2000
    assert dropped(cases) == []


def test_a_with_that_sets_nothing_is_not_dropped() -> None:
    cases = [
        (f"LIN {FULL} C_DIS", f"LIN {FULL} WITH C_DIS"),
        (f"SLIN {FULL} C_SPL", f"SLIN {FULL}  WITH  C_SPL"),
    ]
    assert dropped(cases) == []


def test_a_word_that_is_dropped_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """The comparison itself: a reader that overlooks words is found."""
    plain = interpreter.read

    def overlooking(documents: tuple[Document, ...]) -> object:
        (document,) = documents
        return plain((Document(document.path, document.raw.replace(b" 0.7", b"")),))

    monkeypatch.setattr(interpreter, "read", overlooking)
    assert dropped([("WAIT SEC 0.5", "WAIT SEC 0.5 0.7")]) == ["WAIT SEC 0.5 0.7"]
