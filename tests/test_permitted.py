"""What edits of a program may touch, and what they may not, by the bytes alone."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.base.document import Document, Edit, Edits, Span
from postproc.base.findings import Refusal
from postproc.languages import DIALECTS
from postproc.languages.permitted import refuse_other

KRL = b"""\xef\xbb\xbfDEF part()
;FOLD INI
BAS(#INITMOV,0)
PT.X = 5.0
LIN {X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 180.0,E1 7.0} C_DIS ; to X 5
LIN P1 C_DIS
LIN_REL {X 10.0} #BASE
CIRC {X 1,Y 2,Z 3},{X 4,Y 5,Z 6}, CA 90
$OUT[1]=TRUE
END
"""
DAT = b"""DEFDAT part
DECL E6POS P1={X 50.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 180.0}
ENDDAT"""
BLOCKS = b"""%
(PART X 5)
G21 G90 G17
N10 T1 M6 S500
G1 X1 Y2.5 Z-3 F100
X10Y20 (to X5) M8
G3 X5 Y5 R20. ; X5
G1 X=AC(4) Y = IC( 6.5 ) A3=0.5
G1 X[#1+5] M3
G3 X1 Y2 CR=7
"""
MAC = BLOCKS.replace(b"\n", b"\r")


def program(raw: bytes, dialect: str, companion: bytes = b""):
    documents = (
        Document(Path("part.src"), raw),
        *([Document(Path("part.dat"), companion)] if companion else []),
    )
    return DIALECTS[dialect].read(documents)


def judged(raw: bytes, dialect: str, *edits: Edit, companion: bytes = b"") -> None:
    refuse_other(program(raw, dialect, companion), Edits.joined(edits), DIALECTS[dialect].letters)


def changed(raw: bytes, line: bytes, old: bytes, new: bytes, file: int = 0) -> Edit:
    """``old`` in a line that begins so, and ``new`` in its place."""
    at = raw.index(old, raw.index(line))
    return Edit(Span(file, at, at + len(old)), new)


def behind(raw: bytes, text: bytes, new: bytes, file: int = 0) -> Edit:
    at = raw.index(text) + len(text)
    return Edit(Span(file, at, at), new)


GOOD = {
    "a number": changed(KRL, b"LIN {X", b"1.0", b"-1.234"),
    "the last one": changed(KRL, b"LIN {X", b"180.0", b"179.9e-1"),
    "a component": changed(KRL, b"PT.X", b"5.0", b"5.1"),
    "a blank with it": changed(KRL, b"LIN {X", b"2.0", b" 2.1"),
    "CA": changed(KRL, b"CIRC", b"90", b"91.5"),
    "a point of its own": changed(KRL, b"LIN P1", b"P1", b"{X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 2}"),
    "another point": changed(KRL, b"LIN P1", b"P1", b"P1_1"),
    "no difference": changed(KRL, b"LIN_REL", b"LIN_REL", b"LIN"),
    "its reference": changed(KRL, b"LIN_REL", b" #BASE", b""),
    "components more": behind(KRL, b"{X 10.0", b",Y 1.0,Z 2.0"),
    "a line more": behind(KRL, b"PT.X = 5.0\n", b"LIN {X 1.0} C_DIS\nLIN {X 2.0}\r\n"),
}
BAD = {
    "beside a number": changed(KRL, b"LIN {X", b" 1.0,", b" 1.1,;"),
    "an external axis": changed(KRL, b"LIN {X", b"7.0", b"8.0"),
    "a number of a call": changed(KRL, b"BAS", b"0", b"1"),
    "a call": changed(KRL, b"BAS", b"BAS(#INITMOV,0)", b""),
    "an output": changed(KRL, b"$OUT", b"TRUE", b"FALSE"),
    "a channel": changed(KRL, b"$OUT", b"1", b"2"),
    "a comment": changed(KRL, b";FOLD", b"INI", b"X"),
    "a number of a comment": changed(KRL, b"LIN {X", b"; to X 5", b"; to X 6"),
    "only its digit": Edit(Span(0, KRL.index(b"; to X 5") + 7, KRL.index(b"; to X 5") + 8), b"6"),
    "the begin of a comment": changed(KRL, b"LIN {X", b"; to", b"to"),
    "the end of a line": changed(KRL, b"LIN P1", b"\n", b" "),
    "half a line more": behind(KRL, b"LIN P1", b"\nLIN P2"),
    "a line in a line": behind(KRL, b"LIN P", b"2\n"),
    "a line elsewhere": behind(KRL, b";FOLD INI\n", b"LIN {X 1.0}\n"),
    "a remark more": behind(KRL, b"PT.X = 5.0\n", b"; x\n"),
    "a text": changed(KRL, b"LIN P1", b"P1", b'"P1"'),
    "the byte order mark": Edit(Span(0, 0, 3), b""),
    "a strange byte": changed(KRL, b"LIN P1", b"P1", b"P\xb91"),
}
DECLARED = {
    "a number": (True, changed(DAT, b"DECL", b"50.0", b"50.25", 1)),
    "a point": (True, behind(DAT, b"180.0}\n", b"DECL E6POS P2={X 1}\n", 1)),
    "at the end": (True, behind(DAT, b"ENDDAT", b"\nDECL E6POS P2={X 1}", 1)),
    "its name": (False, changed(DAT, b"DECL", b"P1", b"P2", 1)),
    "its type": (False, changed(DAT, b"DECL", b"E6POS", b"POS", 1)),
    "half a line": (False, behind(DAT, b"DECL", b"\nDECL", 1)),
}
IN_BLOCKS = {
    "a number": (True, changed(BLOCKS, b"G1 X1", b"2.5", b"2.75")),
    "with its sign": (True, changed(BLOCKS, b"G1 X1", b"-3", b"3.5")),
    "without blanks": (True, changed(BLOCKS, b"X10Y20", b"20", b"21")),
    "behind an address": (True, behind(BLOCKS, b"X10Y20", b" Z-3.1")),
    "the code of the motion": (True, behind(BLOCKS, b"F100\n", b"G1 ")),
    "a centre for a radius": (True, changed(BLOCKS, b"G3", b"R20.", b"I1.0 J-2.0")),
    "absolute": (True, changed(BLOCKS, b"G1 X=", b"4", b"4.5")),
    "an increment": (True, changed(BLOCKS, b"G1 X=", b"6.5", b"6.6")),
    "a vector": (True, changed(BLOCKS, b"G1 X=", b"0.5", b"0.501")),
    "a radius": (True, changed(BLOCKS, b"G3 X1", b"7", b"7.1")),
    "a block more": (True, behind(BLOCKS, b"F100\n", b"G1 X5 Y2 F100\n")),
    "coolant": (False, changed(BLOCKS, b"X10Y20", b"8", b"9")),
    "no coolant": (False, changed(BLOCKS, b"X10Y20", b"M8", b"")),
    "a spindle": (False, changed(BLOCKS, b"N10", b"500", b"900")),
    "a tool": (False, changed(BLOCKS, b"N10", b"1", b"2")),
    "a feed": (False, changed(BLOCKS, b"G1 X1", b"100", b"900")),
    "a unit": (False, changed(BLOCKS, b"G21", b"21", b"20")),
    "a code": (False, changed(BLOCKS, b"G1 X1", b"1", b"0")),
    "a halt": (False, behind(BLOCKS, b"F100\n", b"M0\n")),
    "a halt with a motion": (False, behind(BLOCKS, b"F100\n", b"G1 X5 M0\n")),
    "words of it": (False, behind(BLOCKS, b"X10Y20", b" S900")),
    "a comment": (False, changed(BLOCKS, b"(PART", b"5", b"6")),
    "a comment of a block": (False, changed(BLOCKS, b"X10Y20", b"5", b"6")),
    "a comment behind": (False, Edit(Span(0, BLOCKS.index(b"; X5") + 3, BLOCKS.index(b"; X5") + 4), b"6")),
}


@pytest.mark.parametrize("name", GOOD)
def test_numbers_targets_and_lines_of_motions_may_change(name):
    judged(KRL, "krl", GOOD[name], companion=DAT)


@pytest.mark.parametrize("name", BAD)
def test_nothing_else_may(name):
    with pytest.raises(Refusal) as refusal:
        judged(KRL, "krl", BAD[name], companion=DAT)
    (finding,) = refusal.value.findings
    line = KRL[: BAD[name].span.start].count(b"\n") + 1
    assert (finding.code, finding.file, finding.line) == ("FIL008", "part.src", line)


@pytest.mark.parametrize("name", DECLARED)
def test_a_companion_keeps_its_names(name):
    good, edit = DECLARED[name]
    if good:
        judged(KRL, "krl", edit, companion=DAT)
    else:
        with pytest.raises(Refusal, match=r"part\.dat"):
            judged(KRL, "krl", edit, companion=DAT)


@pytest.mark.parametrize("raw", [BLOCKS, MAC], ids=["LF", "CR"])
@pytest.mark.parametrize("name", IN_BLOCKS)
def test_blocks_keep_what_is_no_coordinate(name, raw):
    good, edit = IN_BLOCKS[name]
    dialect = "sinumerik" if b"=" in BLOCKS[edit.span.start - 8 : edit.span.start] else "linuxcnc"
    if good:
        judged(raw, dialect, edit)
    else:
        with pytest.raises(Refusal):
            judged(raw, dialect, edit)


LINUXCNC = b"""G21 G90 G17 G94
#<w>=3
G1 X1 Y[#<w>*2] F[#<w>*100]
G1 X2 Y#<w>
G1 X[SIN[30]*4] Y-ATAN[1]/[#<w>] M8
G1 X3 (note #<w>) Y4
"""
SINUMERIK = b"""G90 G71 G17 G94
DEF REAL WE=3
G1 X1 Y=WE*2 FB=WE*100
G1 X=SIN(30)*4 Y=WE M8
G1 X=AC(WE MOD 2) Y=WE+2*(WE-1)
"""
EXPRESSIONS = {
    "an expression": (True, LINUXCNC, changed(LINUXCNC, b"G1 X1", b"[#<w>*2]", b"6.1")),
    "a named parameter": (True, LINUXCNC, changed(LINUXCNC, b"G1 X2", b"#<w>", b"3.1")),
    "functions": (True, LINUXCNC, changed(LINUXCNC, b"G1 X[SIN", b"[SIN[30]*4]", b"2.1")),
    "a function of two": (True, LINUXCNC, changed(LINUXCNC, b"G1 X[SIN", b"-ATAN[1]/[#<w>]", b"2.1")),
    "a block with its feed": (True, LINUXCNC, behind(LINUXCNC, b"=3\n", b"G1 X0.5 Y1 F[#<w>*100]\n")),
    "a feed": (False, LINUXCNC, changed(LINUXCNC, b"G1 X1", b"[#<w>*100]", b"6.1")),
    "the coolant with it": (False, LINUXCNC, changed(LINUXCNC, b"G1 X[SIN", b"-ATAN[1]/[#<w>] M8", b"2.1")),
    "half of it": (False, LINUXCNC, changed(LINUXCNC, b"G1 X[SIN", b"[SIN[30]", b"2.1")),
    "a word with it": (False, LINUXCNC, changed(LINUXCNC, b"G1 X1", b"1 Y[#<w>*2]", b"2.1")),
    "a comment with it": (False, LINUXCNC, changed(LINUXCNC, b"G1 X3", b"3 (note #<w>)", b"2.1")),
    "in a comment": (False, LINUXCNC, changed(LINUXCNC, b"G1 X3", b"#<w>", b"2.1")),
    "a block with more": (False, LINUXCNC, behind(LINUXCNC, b"=3\n", b"G1 X0.5 F[#<w>*100] M[#<w>]\n")),
    "a block with a comment": (False, LINUXCNC, behind(LINUXCNC, b"=3\n", b"G1 X0.5 F[#<w>(x)]\n")),
    "an assignment": (False, LINUXCNC, behind(LINUXCNC, b"=3\n", b"G1 X0.5 #<w>=5\n")),
    "a sum": (True, SINUMERIK, changed(SINUMERIK, b"G1 X=AC", b"WE+2*(WE-1)", b"7.1")),
    "an absolute one": (True, SINUMERIK, changed(SINUMERIK, b"G1 X=AC", b"WE MOD 2", b"1.1")),
    "a function of it": (True, SINUMERIK, changed(SINUMERIK, b"G1 X=SIN", b"SIN(30)*4", b"2.1")),
    "a variable": (True, SINUMERIK, changed(SINUMERIK, b"G1 X=SIN", b"WE", b"2.1")),
    "a block with a feed": (True, SINUMERIK, behind(SINUMERIK, b"REAL WE=3\n", b"G1 X=0.5 F=WE*3\n")),
    "two words": (False, SINUMERIK, changed(SINUMERIK, b"G1 X=SIN", b"SIN(30)*4 Y=WE", b"2.1")),
    "its coolant": (False, SINUMERIK, changed(SINUMERIK, b"G1 X=SIN", b"WE M8", b"2.1")),
    "a feed of a block": (False, SINUMERIK, changed(SINUMERIK, b"G1 X1", b"WE*100", b"7.1")),
    "a block with its name": (False, SINUMERIK, behind(SINUMERIK, b"REAL WE=3\n", b"G1 X=0.5 WE=3\n")),
    "a call": (False, SINUMERIK, behind(SINUMERIK, b"REAL WE=3\n", b"G1 X=0.5 LOAD(3)\n")),
}


@pytest.mark.parametrize("name", EXPRESSIONS)
def test_expressions_of_coordinates_have_names_of_their_own(name):
    good, raw, edit = EXPRESSIONS[name]
    dialect = "linuxcnc" if raw is LINUXCNC else "sinumerik"
    if good:
        judged(raw, dialect, edit)
    else:
        with pytest.raises(Refusal):
            judged(raw, dialect, edit)


@pytest.mark.slow
def test_one_wrong_edit_among_many_is_found():
    """In whichever block of edits it is, and the first of several is told."""
    lines = b"".join(
        b"LIN {X %d.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,E1 %d}\n" % (k, k % 10) for k in range(40_000)
    )
    raw = b"DEF part()\n" + lines + b"END\n"
    made, edits, at = program(raw, "krl"), [], 0
    while (at := raw.find(b"Y 2.0", at) + 2) > 1:
        edits.append(Edit(Span(0, at, at + 3), b"2.25"))
    letters = DIALECTS["krl"].letters
    refuse_other(made, Edits.joined(edits), letters)
    for wrong in (1, 39_000):
        at = raw.index(b"E1", raw.index(b"{X %d.0" % wrong)) + 3
        more = [Edit(Span(0, at, at + 1), b"7"), Edit(Span(0, len(raw) - 4, len(raw) - 1), b"")]
        with pytest.raises(Refusal) as refusal:
            refuse_other(made, Edits.joined([*edits, *more]), letters)
        assert refusal.value.findings[0].line == wrong + 2
