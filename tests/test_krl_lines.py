"""Lines, values and points of KRL by themselves: what each function of the reader makes of a piece of code."""

from __future__ import annotations

import gc
import math
import random
from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages.krl import KrlDialect, lexing
from postproc.languages.krl.expressions import DEEPEST, component, evaluate, index_text
from postproc.languages.krl.lexing import (
    LONGEST,
    Assignment,
    Call,
    Declared,
    Head,
    Statement,
    declaration,
    identifiers,
    keyed,
    lines,
    module_name,
    number,
    split_comment,
    statement,
    value_end,
)
from postproc.languages.krl.operands import take_apart
from postproc.languages.krl.spatial import angles, arc, product, rotation
from postproc.languages.krl.statement_effects import EVERYTHING, bas, effects_of, functions_of, read_by
from postproc.languages.krl.target import KrlTarget, UnknownValue, fields, parse, shown
from postproc.languages.krl.variables import Variables

UNREADABLE = EVERYTHING - {"advance", "apart"}


def stated(text: bytes) -> Statement:
    found = statement(text, 7, 0, len(text))
    assert found is not None
    return found


# lines and statements


@pytest.mark.parametrize(
    ("name", "index", "key"),
    [
        (b"P", None, b"P"), (b"P", b"2", b"P[2]"), (b"P", b" 1 ,\t2", b"P[1,2]"), (b"P", b"n", None),
        (b"P", b"", None), (b"P", b"1+1", None), (b"P", b",", None),
    ],
)  # fmt: skip
def test_elements_with_constant_indices_have_keys(
    name: bytes, index: bytes | None, key: bytes | None
) -> None:
    assert keyed(name, index) == key


@pytest.mark.parametrize(
    ("line", "code", "comment"),
    [
        (b"LIN P", b"LIN P", b""), (b";x", b"", b";x"), (b"A=1 ;x;y", b"A=1 ", b";x;y"),
        (b'A="a;b" ; "c"', b'A="a;b" ', b'; "c"'), (b'A="a;b', b'A="a;b', b""), (b'A=1;"', b"A=1", b';"'),
        (b'A="a" B=";" ;c', b'A="a" B=";" ', b";c"),
    ],
)  # fmt: skip
def test_comments(line: bytes, code: bytes, comment: bytes) -> None:
    assert split_comment(line) == (code, comment)


def test_names_that_code_mentions() -> None:
    assert identifiers(b"a=#B+$c[i].x*'HFF' \"d\" # e 1f _g") == {b"A", b"$C", b"I", b"X", b"E", b"_G"}
    assert identifiers(b"n" * 101 + b"=m") == {b"N" * 101, b"M"}


@pytest.mark.parametrize(
    ("literal", "value"),
    [
        (b"'B" + b"1" * 37 + b"'", 2.0**37 - 1), (b"'B" + b"1" * 38 + b"'", None), (b"'H1f'", 31.0),
        (b"' h 1F '", 31.0), (b"+ 5", 5.0), (b"-\t5.5e+2", -550.0), (b"1e12345", None), (b"5 ", None),
        (b"1e-00005", None), (b"1e-0005", 1e-5), (b".", None), (b"'H'", None), (b"'B1", None),
    ],
)  # fmt: skip
def test_numbers_at_their_limits(literal: bytes, value: float | None) -> None:
    assert number(literal) == value


@pytest.mark.parametrize(
    ("raw", "expected"),
    [
        (b"", [(1, 0, 0)]), (b"a", [(1, 0, 1)]), (b"a\n", [(1, 0, 2)]),
        (b"a\r\n\nb", [(1, 0, 3), (2, 3, 4), (3, 4, 5)]),
        (b"\xef\xbb\xbfa\nb\n", [(1, 3, 5), (2, 5, 7)]), (b"\xef\xbb\xbf", [(1, 3, 3)]), (b"\n", [(1, 0, 1)]),
    ],
)  # fmt: skip
def test_lines_of_a_file(raw: bytes, expected: list[tuple[int, int, int]]) -> None:
    assert list(lines(Document(Path("a"), raw))) == expected


@pytest.mark.parametrize(
    ("line", "kind", "word", "said"),
    [
        (b"lin_rel {Z 5}", "motion", b"LIN_REL", None),
        (b"for i=1 TO 2", "open", b"FOR", None), (b"IF x THEN", "open", b"IF", None),
        (b"PTP_SPLINE", "open", b"PTP_SPLINE", None), (b"ENDLOOP", "close", b"ENDLOOP", None),
        (b"UNTIL x", "close", b"UNTIL", None), (b"ELSE", "branch", b"ELSE", None),
        (b"CASE 1,2", "branch", b"CASE", None),
        (b"DEF a ( )", "def", b"DEF", Head(b"A", ())), (b"DEF a", "def", b"DEF", Head(b"A", ())),
        (b"GLOBAL DEF a(b:IN,c:OUT , d)", "def", b"GLOBAL",
         Head(b"A", ((b"B", False), (b"C", True), (b"D", True)))),
        (b"DEFFCT REAL[3] f(x :in ,1)", "def", b"DEFFCT", Head(b"F", ((b"X", False),))),
        (b"DEF a b", "other", b"DEF", None), (b"END", "end", b"END", None), (b"ENDFCT (x)", "end", b"ENDFCT", None),
        (b"GOTO  on ", "goto", b"GOTO", b"ON"), (b"GOTO 5", "other", b"GOTO", None),
        (b"exit", "exit", b"EXIT", None), (b"RETURN x", "return", b"RETURN", None),
        (b"WAIT SEC 1", "system", b"WAIT", None), (b"HALT", "system", b"HALT", None),
        (b"GLOBAL INTERRUPT DECL 3 WHEN x DO y()", "other", b"GLOBAL", None),
        (b"x = 5", "assignment", b"X", Assignment(b"X", None, b"", b"5", 4)),
        (b"P[ 2 ].f . x=-5 ", "assignment", b"P", Assignment(b"P", b" 2 ", b"F.X", b"-5", 13)),
        (b"P[k[1],2]=5", "assignment", b"P", Assignment(b"P", b"k[1],2", b"", b"5", 10)),
        (b"P.list[3].x=y", "assignment", b"P", Assignment(b"P", None, b"LIST[3].X", b"y", 12)),
        (b"x==5", "other", b"X", None),
        (b"$out[1]=TRUE", "assignment", b"$OUT", Assignment(b"$OUT", b"1", b"", b"TRUE", 8)),
        (b"go(1,(2))", "call", b"GO", Call(b"GO", b"1,(2)")), (b"go (", "other", b"GO", None),
        (b"on :", "label", b"ON", b"ON"), (b"5", "other", b"", None), (b"REAL", "other", b"REAL", None),
        (b"INT a", "declaration", b"INT", Declared(b"INT", False, ((b"A", b"", 5),))),
        (b"REAL=5", "assignment", b"REAL", Assignment(b"REAL", None, b"", b"5", 5)),
        (b"Z\xe4hler=1", "umlaut_name", b"Z", Assignment(b"Z_HLER", None, b"", b"1", 7)),
        (b"\xd6ffnen(1)", "umlaut_name", b"", Call(b"_FFNEN", b"1")),
        (b"GOTO \xf6l", "unreadable", b"GOTO", None), (b"a\xf6", "unreadable", b"A", None),
        (b"x\xe5=1", "unreadable", b"X", None),
        (b'x="\xe5"', "assignment", b"X", Assignment(b"X", None, b"", b'"\xe5"', 2)),
    ],
)  # fmt: skip
def test_statements(line: bytes, kind: str, word: bytes, said: object) -> None:
    found = stated(line)
    assert (found.kind, found.word, found.strings, found.line, found.at) == (kind, word, said, 7, 0)


def test_a_statement_stands_behind_its_blanks() -> None:
    raw = b"x\n \t LIN P ;c \r\n"
    found = statement(raw, 2, 2, len(raw))
    assert found == Statement("motion", b"LIN", b"LIN P", 2, 5, None, b";c ")
    assert statement(b" ; c\n", 1, 0, 5) == Statement("comment", b"", b"", 1, 1, None, b"; c")
    assert statement(b" \t\n", 1, 0, 3) is None
    assert statement(b"&ACCESS x\n", 1, 0, 10) == Statement("header", b"&", b"&ACCESS x", 1, 0)
    unreadable = statement(b"1\xe5" + b" " * 5 + b";\xe5", 1, 0, 9)
    assert unreadable is not None
    assert (unreadable.kind, unreadable.code) == ("unreadable", b"1\xe5")


def test_lines_that_are_too_long_are_none_of_krl() -> None:
    for count, kind in (LONGEST, "assignment"), (LONGEST + 1, "other"):
        assert stated(b"x=" + b"1" * (count - 2)).kind == kind
    assert stated(b"LIN " + b"1" * LONGEST).kind == "motion"
    for count, kind in (LONGEST, "umlaut_name"), (LONGEST + 1, "unreadable"):
        assert stated(b"\xe4=" + b"1" * (count - 2)).kind == kind


def test_a_routine_has_at_most_fifty_parameters_that_are_read() -> None:
    said = stated(b"DEF a(" + b",".join(b"p%d:IN" % i for i in range(60)) + b")").strings
    assert isinstance(said, Head)
    assert said.parameters == tuple((b"P%d" % i, False) for i in range(50))


@pytest.mark.parametrize(
    ("code", "kind", "is_global", "items"),
    [
        (b"DECL INT a", b"INT", False, ((b"A", b"", 110),)),
        (b"GLOBAL DECL INT a", b"INT", True, ((b"A", b"", 117),)),
        (b"DECL GLOBAL CONST INT a=5", b"INT", True, ((b"A", b"5", 124),)),
        (b"INT a=1 , b[3] ,c= 2", b"INT", False, ((b"A", b"1", 106), (b"B", b"", 115), (b"C", b"2", 119))),
        (b"DECL POS P[2]={X 1,Y {Z 2}} , Q", b"POS", False, ((b"P[2]", b"{X 1,Y {Z 2}}", 114), (b"Q", b"", 131))),
        (b"DECL POS P[n]={X 1}", b"POS", False, ((None, b"{X 1}", 114),)),
        (b"INT a b", b"INT", False, ((b"A", b"", 106),)),
        (b"INT a,5", b"INT", False, ((b"A", b"", 105),)),
        (b"CHAR t[]=\"a,b\",u", b"CHAR", False, ((None, b"\"a,b\"", 109), (b"U", b"", 116))),
    ],
)  # fmt: skip
def test_declarations(
    code: bytes, kind: bytes, is_global: bool, items: tuple[tuple[bytes | None, bytes, int], ...]
) -> None:
    assert declaration(code, 100) == Declared(kind, is_global, items, b"CONST" in code)


@pytest.mark.parametrize("code", [b"CONST INT a=5", b"DECL CONST INT a=5", b"GLOBAL CONST REAL a=5.5"])
def test_a_constant_is_declared_with_and_without_decl(code: bytes) -> None:
    assert stated(code).kind == "declaration"


@pytest.mark.parametrize("code", [b"DECL INTERRUPT x", b"DECL DECL x", b"INT", b"INT 5", b"INT  ", b"x=5"])
def test_what_is_no_declaration(code: bytes) -> None:
    assert declaration(code, 0) is None


@pytest.mark.parametrize(
    ("code", "start", "end"),
    [
        (b"1,2", 0, 1), (b"1", 0, 1), (b"{X 1,Y 2},3", 0, 9), (b"f(1,[2,3]),4", 0, 10), (b'"a,b",c', 0, 5),
        (b"1,2,3", 2, 3), (b"a},b", 0, 2), (b"{a,b", 0, 4), (b'"a', 0, 2), (b"", 0, 0),
    ],
)  # fmt: skip
def test_a_value_ends_at_the_comma_outside_of_all_braces(code: bytes, start: int, end: int) -> None:
    assert value_end(code, start) == end


@pytest.mark.parametrize(
    ("raw", "word", "name"),
    [
        (b"DEF part ( )\n", b"DEF", b"part"), (b"&ACCESS\n  global def Part(a:IN)\nDEF b()\n", b"DEF", b"Part"),
        (b"\xef\xbb\xbfDEF part ;c\n", b"DEF", b"part"), (b"DEF part\r\n", b"DEF", b"part"),
        (b"DEF a b\n", b"DEF", None),
        (b"DEFDAT part PUBLIC\n", b"DEFDAT", b"part"), (b"DEFDAT part PUBLIC\n", b"DEF", None),
        (b"x DEF a()\n", b"DEF", None),
    ],
)  # fmt: skip
def test_the_name_of_a_module(raw: bytes, word: bytes, name: bytes | None) -> None:
    found = module_name(raw, word)
    assert (None if found is None else raw[slice(*found)]) == name


# expressions

NAMES: dict[tuple[bytes, bytes], object] = {
    (b"N", b""): 7, (b"R", b""): 2.5, (b"YES", b""): True, (b"K", b"[7]"): 3, (b"K", b"[7,3]"): 4, (b"S", b".A.X"): 5,
    (b"K", b"[2].X"): 6, (b"P", b""): KrlTarget((1.0, 2.0, 3.0, 0.0, 0.0, 90.0), status=2, turn=3),
    (b"Q", b""): KrlTarget((10.0, 0.0, 0.0, 90.0, 0.0, 0.0), status=4, external=((b"E1", 1.0, b"1"),)),
    (b"PART", b""): KrlTarget((1.0, None, None, None, None, None)),
    (b"LOST", b""): UnknownValue("KRL019", "it was lost"),
}  # fmt: skip


def value(text: str) -> object:
    return evaluate(text.encode(), lambda name, path: NAMES.get((name, path)))  # type: ignore[arg-type, return-value]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("5", 5), ("+5", 5), ("- 5", -5), ("5.", 5.0), ("1e2", 100.0), ("1E2", 100.0), ("'HE'", 14), ("'B11'", 3),
        ("'HE'+0", 14), ("1E2+0", 100.0), (" 5 ", 5), ("5+1 ", 6), ("1-2-3", -4), ("8/2/2", 2), ("2*3/4", 1),
        ("-9/-2", 4),
        ("9/-2", -4), ("0/-2", 0), ("9/2.0", 4.5), ("9.0/2", 4.5), ("-(3-5)", 2), ("+-+-5", 5), ("--5", 5),
        ("---5", -5),
        ("+ 5-+3", 2), ("2*-3", -6), ("N-R", 4.5), ("5-TRUE", None), ("-TRUE", None), ("+YES", None), ("YES", True),
        ("k[n]", 3), ("K[6+1]", 3), ("K[N,k[7]]", 4), ("k[2] . x", 6), ("s.a.x", 5), ("k[TRUE]", None),
        ("k[1.0]", None),
        ("k[8]", None), ("s.5", None), ("k[7", None), ("k[7,]", None), ("ABS(-4)", 4), ("abs ( 3-5 )", 2),
        ("ATAN2(0,-1)", 180.0), ("ATAN2(1)", None), ("SQRT(4", None), ("SQRT(4)5", None), ("sin(90)", 1.0),
        ("ABS(YES)", None),
        ("ABS(1)(2)", None), ("1==1.0", True), ("1<2", True), ("2<1", False), ("2>1", True), ("1>2", False),
        ("1>=1", True),
        ("1<=1", True), ("1>=2", False), ("2<=1", False), ("1<1", False), ("1>1", False), ("1<>1", False),
        ("1<>2", True),
        ("#A==#a", True), ("#A<># b", True), ('"A"=="a"', False), ('"A"<>"a"', True), ("1==TRUE", None),
        ("TRUE<FALSE", None),
        ("TRUE>=FALSE", None), ("TRUE==TRUE", True), ("TRUE<>FALSE", True), ("#A>=#B", None), ("#A==1", None),
        ("1==#A", None),
        ("P==P", None), ("P==1", None), ("1==P", None), ("1<2==TRUE", True), ("1<2<3", None),
        ("TRUE AND FALSE", False), ("TRUE OR FALSE", True), ("FALSE OR FALSE AND TRUE", False),
        ("TRUE OR TRUE AND FALSE", True),
        ("TRUE EXOR TRUE", False), ("FALSE EXOR TRUE", True), ("TRUE OR TRUE EXOR TRUE", True), ("TRUE AND 1", None),
        ("1 AND TRUE", None), ("1 OR 2", None), ("6 B_AND 3", 2), ("4 B_OR 1", 5), ("7 B_EXOR 2", 5),
        ("TRUE B_AND 1", None),
        ("1 B_AND 1.0", None), ("1.0 B_AND 1", None), ("6 B_OR 1 B_AND 3", 7), ("1+1==2 AND TRUE", None),
        ("(1+1==2) AND TRUE", True),
        ("NOT TRUE", False), ("not not true", True), ("NOT NOT NOT TRUE", False), ("B_NOT 5", -6), ("B_NOT B_NOT 5", 5),
        ("B_NOT TRUE", None), ("NOT 1.0", None), ("NOT B_NOT 1", None), ("B_NOT 1.0", None),
        ("TRUE AND NOT FALSE", True),
        ("(5)", 5), ("((5)", None), ("5)", None), ("()", None), ("5 5", None), ("5;", None), ("", None), (" ", None),
        ("1=1", None), ("'HG'+1", None), ("{X 1", None), ("{X {Y 1}}", None), ("{X two}", None), ("LOST+1", None),
        ("none", None),
        ("move(1)", None), ("2147483647*1", 2**31 - 1), ("2147483647+1", None), ("2147483648*2147483649", None),
        ("-2147483648*2147483649", None),
        ("0+" + "9" * 18, None), ("0+1" + "0" * 18, None), ("1.0E300*1.0E300", None),
        ("2.0*3000000000000000000.0", 6e18),
        ("1/0", None), ("1.0/0", None), ("TRUE/2", None), ("ACOS(2)", None), ("FALSE", False), ("true", True),
        ("1" + "+1" * 30, 31), (" " * 45 + "5", 5), ("'B" + "0" * 36 + "1'", 1),
    ],
)  # fmt: skip
def test_the_value_of_an_expression(text: str, expected: object) -> None:
    found = value(text)
    if expected is None:
        assert isinstance(found, UnknownValue)
    else:
        assert type(found) is type(expected)
        assert found == (pytest.approx(expected) if isinstance(expected, float) else expected)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("5 5", "'5 5' is not understood"), ("1/0", "'1/0' has no value"), ("SQRT(-1)", "'SQRT(-1)' has no value"),
        ("1E300*1E300", "'1E300*1E300' has no value"), ("none", "none is not a constant of the program"),
        ("none[1].x+1", "NONE[1].X is not a constant of the program"), ("LOST", "it was lost"),
        ("lost*2", "it was lost"),
        ("P==1", "it compares points and words"), ("#A<1", "it compares points and words"),
        ("1==TRUE", "it compares values of different kinds"), ("#A<#B", "it compares values of different kinds"),
        ("1 AND 2", "AND is applied to a value of another kind"), ("1 B_or TRUE", "B_OR is applied to a"
        " value of another kind"),
        ("0+1234567890123456789", "it overflows"), ("999999999*9999999999", "it overflows"),
        ("not 1", "NOT is applied to a value of another kind"),
        ("1:2", "':' is applied to something that is not a point"), ("P:1", "':' is applied to something"
        " that is not a point"), ("1:P", "':' is applied to something that is not a point"),
        ("P:PART", "':' is applied to a point that is not known in all of X, Y, Z, A, B, C"),
        ("PART:P", "':' is applied to a point that is not known in all of X, Y, Z, A, B, C"),
        ("'HG'+1", "''HG'+1' is not understood"), ("'BFF'+1", "'BFF' is not a number"),
        ("(" * 50 + "1" + ")" * 50, "it is nested too deep"), ("{X 1+0", "its braces do not match"),
        ("s.(", "'s.(' is not understood"),
        ("k[TRUE]", "an index of K is not a constant"), ("move(1)", "it calls MOVE"),
        ("1+TRUE", "it calculates with something that is not a number"),
        ("(1", "'(1' is not understood"), ("{X 1,X 2}", "X occurs twice"),
    ],
)  # fmt: skip
def test_why_an_expression_has_no_value(text: str, message: str) -> None:
    found = value(text)
    assert isinstance(found, UnknownValue)
    assert found.message == message


@pytest.mark.parametrize("left", ["(", "ABS(", "K[7]+K["])
def test_brackets_are_nested_up_to_a_depth(left: str) -> None:
    right, inner = ("]", "7") if left.endswith("[") else (")", "1")
    if right == "]":
        texts = [f"{'K[4+' * depth}{inner}{']' * depth}" for depth in (1, DEEPEST + 1)]
        assert isinstance(value(texts[0]), UnknownValue)  # K[11] has no value
        deep = value(texts[1])
        assert isinstance(deep, UnknownValue)
        assert deep.message == "it is nested too deep"
        return
    assert value(left * DEEPEST + inner + right * DEEPEST) == 1
    found = value(left * (DEEPEST + 1) + inner + right * (DEEPEST + 1))
    assert isinstance(found, UnknownValue)
    assert found.message == "it is nested too deep"


def test_elements_of_elements_are_nested_up_to_a_depth() -> None:
    def looked_up(name: bytes, path: bytes) -> int:
        return 7

    for depth, known in (DEEPEST, True), (DEEPEST + 1, False):
        found = evaluate(b"K[" * depth + b"7" + b"]" * depth, looked_up)
        assert (found == 7) == known


def test_geometric_products_take_status_and_axes_of_the_last() -> None:
    found = value("P:Q")
    assert isinstance(found, KrlTarget)
    # Rx(90) turns Rz(90) so that x goes along z and z along -y.
    np.testing.assert_allclose(found.values[:3], [11, 2, 3], atol=1e-12)
    np.testing.assert_allclose(
        rotation(*found.values[3:]),
        [[0, -1, 0], [0, 0, -1], [1, 0, 0]],
        atol=1e-12,  # type: ignore[arg-type]
    )
    assert (found.status, found.turn, found.external) == (4, -1, ((b"E1", 1.0, b"1"),))
    again = value("P:Q:P")
    assert isinstance(again, KrlTarget)
    assert (again.status, again.turn) == (2, 3)
    np.testing.assert_allclose(again.values[:3], [9, -1, 4], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", b"1"), (" 1 ,\t2 ", b"1,2"), ("n", b"7"), ("N,2*3", b"7,6"), ("-1", b"-1"), ("", None), ("n,,2", None),
        ("n,", None), ("TRUE", None), ("1.0", None), ("none", None), ("1" * 19, b"1" * 19), ("1" * 20, None),
    ],
)  # fmt: skip
def test_indices(text: str, expected: bytes | None) -> None:
    assert (
        index_text(text.encode(), lambda name, path: NAMES.get((name, path))) == expected  # type: ignore[arg-type, return-value]
    )


# points


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{}", "the aggregate is empty"), ("{X}", "X has no value"), ("{X 1,X 2}", "X occurs twice"),
        ("{E1}", "E1 has no value"),
        ("{X 1,}", "a component is missing after the last comma"),
        ("{X 1, }", "a component is missing after the last comma"),
        ("{X 1,A1 2}", "it mixes axes with Cartesian components"), ("{Q 1}", "Q is not a component of a point"),
        ("{S -1}", "S is -1, which is not a bit pattern"), ("{T 0.5}", "T is 0.5, which is not a bit pattern"),
        ("{S 2147483648}", "S is 2.14748e+09, which is not a bit pattern"),
        ("{X n}", "X is 'n', which is not a constant"),
        ("{THING: X 1}", "the type THING is not the type of a point"),
        ("{X 1,5}", "'5' is not a component with its value"),
        ("{X[1] 5}", "X is '5', which is not a constant"), ("{X TRUE}", "X is 'TRUE', which is not a constant"),
    ],
)  # fmt: skip
def test_aggregates_that_are_no_points(text: str, message: str) -> None:
    found = parse(text.encode(), 0, 0, lambda inner: inner == b"TRUE" or None)
    assert isinstance(found, UnknownValue)
    assert found.message == message


def test_the_parts_of_an_aggregate_have_places() -> None:
    text = b"{E6POS: X 1.5 ,Y -2,Z 2*f(1,2),S 'B11', T 2147483647 ,E2 k[1,2],B 5}"
    found = parse(text, 1000, 3, lambda inner: 9)
    assert isinstance(found, KrlTarget)
    assert found.values == (1.5, -2.0, 9.0, None, 5.0, None)
    spots = [text[a - 1000 : b - 1000] for a, b in zip(found.start, found.stop, strict=True) if a >= 0]
    assert spots == [b"1.5", b"-2", b"5"]
    assert found.file == (3, 3, -1, -1, 3, -1)
    assert (found.status, found.turn, found.axes, found.home) == (3, 2**31 - 1, None, 3)
    assert found.external == ((b"E2", 9.0, b"k[1,2]"),)
    assert found.insert == 1000 + len(text) - 1
    assert found.words == b"S 3,T 2147483647,E2 k[1,2]"
    assert found.missing == "A, C"
    assert found.numbers is None
    bare = parse(b"{ S 2}", 10, 0)
    assert isinstance(bare, KrlTarget)
    assert (bare.insert, bare.start, bare.axes) == (12, (-1,) * 6, None)
    axes = parse(b"{E6AXIS: E1 5}", 0, 0)
    assert isinstance(axes, KrlTarget)
    assert axes.axes == (None,) * 6
    assert axes.missing == "A1, A2, A3, A4, A5, A6"


WHY = UnknownValue("KRL002", "because")


def test_components_of_points_are_read_and_changed() -> None:
    whole = KrlTarget(
        (1.0, 2.0, 3.0, 4.0, 5.0, 6.0),
        (10,) * 6,
        (11,) * 6,
        (0,) * 6,
        status=2,
        external=((b"E1", 7.0, b"7."),),
    )
    assert [whole.component(key) for key in (b"X", b"C", b"S", b"T", b"E1", b"E2", b"A1")] == [
        1,
        6,
        2,
        None,
        7,
        None,
        None,
    ]
    assert whole.numbers == (1, 2, 3, 4, 5, 6)
    axes = KrlTarget((None,) * 6, axes=(1.0, 2.0, 3.0, 4.0, 5.0, None), turn=0)
    assert [axes.component(key) for key in (b"A1", b"A5", b"A6", b"X", b"A", b"S", b"T")] == [
        1,
        5,
        None,
        None,
        None,
        None,
        0,
    ]
    assert axes.numbers is None

    found = whole.changed(b"Z", 9.0, WHY, (1, 20, 22), b"9.")
    assert isinstance(found, KrlTarget)
    assert found.values == (1, 2, 9, 4, 5, 6)
    assert (found.start, found.stop) == ((10, 10, 20, 10, 10, 10), (11, 11, 22, 11, 11, 11))
    assert (found.file, found.unknown) == ((0, 0, 1, 0, 0, 0), None)

    lost = whole.changed(b"Z", None, WHY, (-1, -1, -1), b"n")
    assert isinstance(lost, KrlTarget)
    assert lost.unknown == WHY
    assert math.isnan(lost.values[2])  # type: ignore[arg-type]
    assert (lost.numbers, lost.component(b"Z"), lost.component(b"X")) == (None, None, 1.0)
    assert component(lost, b".Z") == WHY
    assert component(lost, b".X") == 1.0
    assert component(lost, b"Z") is None
    assert component(5, b".Z") is None
    second = lost.changed(b"X", None, UnknownValue("KRL002", "later"), (-1, -1, -1), b"n")
    assert isinstance(second, KrlTarget)
    assert second.unknown == WHY
    once = second.changed(b"Z", 1.0, WHY, (-1, -1, -1), b"1")
    assert isinstance(once, KrlTarget)
    assert once.unknown == WHY
    back = once.changed(b"X", 1.0, WHY, (-1, -1, -1), b"1")
    assert isinstance(back, KrlTarget)
    assert back.unknown is None

    outer = whole.changed(b"E1", 8.0, WHY, (-1, -1, -1), b"8")
    assert isinstance(outer, KrlTarget)
    assert outer.external == ((b"E1", 8.0, b"8"),)
    more = whole.changed(b"E2", None, WHY, (-1, -1, -1), b"n")
    assert isinstance(more, KrlTarget)
    assert more.external == ((b"E1", 7.0, b"7."), (b"E2", None, b"n"))

    for bits, held in (
        (3.0, 3),
        (0.0, 0),
        (2.0**31 - 1, 2**31 - 1),
        (2.0**31, -1),
        (-1.0, -1),
        (0.5, -1),
        (None, -1),
    ):
        state = whole.changed(b"S", bits, WHY, (-1, -1, -1), b"")
        turn = whole.changed(b"T", bits, WHY, (-1, -1, -1), b"")
        assert isinstance(state, KrlTarget)
        assert isinstance(turn, KrlTarget)
        assert (state.status, state.turn, turn.status, turn.turn) == (held, -1, 2, held)

    moved = axes.changed(b"A6", 6.0, WHY, (0, 5, 6), b"6")
    assert isinstance(moved, KrlTarget)
    assert moved.axes == (1, 2, 3, 4, 5, 6)
    assert moved.start == (-1,) * 6
    for point, key in (whole, b"A1"), (axes, b"X"), (whole, b"Q"):
        assert point.changed(key, 1.0, WHY, (-1, -1, -1), b"1") == UnknownValue(
            "KRL002", f"{key.decode()} is assigned, but it has no such component"
        )


def test_a_detached_point_has_no_places() -> None:
    found = parse(b"{X 1}", 5, 0)
    assert isinstance(found, KrlTarget)
    assert found.detached() == KrlTarget((1.0, None, None, None, None, None))
    bare = KrlTarget((1.0,) * 6)
    assert bare.detached() is bare
    assert KrlTarget((1.0,) * 6, locked="why").detached() == bare
    assert KrlTarget((1.0,) * 6, insert=5, home=0).detached() == bare


def test_fields_of_other_aggregates() -> None:
    assert fields(b" {FDAT: tool_no 1 , B[ 2 ] {C 1,D 2},E #X,F} ") == {
        b"TOOL_NO": b"1", b"B[2]": b"{C 1,D 2}", b"E": b"#X", b"F": b"",
    }  # fmt: skip
    assert fields(b"{A 1,5}") == {b"A": b"1"}
    assert fields(b"x") == {}


@pytest.mark.parametrize(("count", "held"), [(40, "x" * 40), (41, "x" * 37 + "...")])
def test_long_code_is_shown_cut(count: int, held: str) -> None:
    assert shown(b" " + b"x" * count + b" ") == held


@pytest.mark.parametrize(
    ("code", "points", "slurs", "reference", "clause", "odd"),
    [
        ("LIN P1", ["P1"], (), None, "", ""), ("LIN  {X 1,Y 2} C_DIS", ["{X 1,Y 2}"], (b"C_DIS",), None, "", ""),
        ("LIN f(1,2),P[1,2] ,{X 3}", ["f(1,2)", "P[1,2]", "{X 3}"], (), None, "", ""),
        ("LIN P c_ptp C_DIS", ["P"], (b"C_PTP", b"C_DIS"), None, "", ""),
        ("LIN P #base C_VEL", ["P"], (b"C_VEL",), "#base", "", ""),
        ("LIN P # TOOL", ["P"], (), "# TOOL", "", ""),
        ("LIN P C_DIS more C_VEL x", ["P"], (b"C_DIS", b"C_VEL"), None, "", "more"),
        ("LIN P WITH $VEL.CP=1,$A=2 C_DIS", ["P"], (b"C_DIS",), None, " $VEL.CP=1,$A=2", ""),
        ("LIN P C_VEL with x", ["P"], (b"C_VEL",), None, " x", ""), ("LIN P WITH", ["P"], (), None, "", "WITH"),
        ("LIN P WITH x=C_DIS", ["P"], (), None, " x=C_DIS", ""), ("LIN P.C_DIS", ["P.C_DIS"], (), None, "", ""),
        ('LIN P "C_DIS, x" ', ['P "C_DIS, x"'], (), None, "", ""), ("LIN {X C_DIS}", ["{X C_DIS}"], (), None, "", ""),
        ("LIN ,P", ["P"], (), None, "", ","), ("LIN P,,Q", ["P", "Q"], (), None, "", ","),
        ("LIN", [], (), None, "", ""),
        ("LIN C_DIS P", [], (b"C_DIS",), None, "", "P"), ("LIN C_DIS,P", ["P"], (b"C_DIS",), None, "", ""),
        ("LIN P} C_DIS", ["P}"], (b"C_DIS",), None, "", ""), ("LIN {X 1 C_DIS", ["{X 1 C_DIS"], (), None, "", ""),
        ("LIN P #BASE #TOOL", ["P"], (), "#TOOL", "", "#TOOL"), ("LIN P #BASE x", ["P"], (), "#BASE", "", "x"),
        ("LIN P C_DISX", ["P C_DISX"], (), None, "", ""),
        ("LIN P C_SPL C_ORI", ["P"], (b"C_SPL", b"C_ORI"), None, "", ""),
    ],
)  # fmt: skip
def test_motions_taken_apart(
    code: str, points: list[str], slurs: tuple[bytes, ...], reference: str | None, clause: str, odd: str
) -> None:
    found = take_apart(code.encode(), 3)
    assert [code[a:b] for a, b in found.points] == points
    assert found.approximations == slurs
    assert (None if found.reference is None else code[slice(*found.reference)]) == reference
    assert (found.clause.decode(), found.not_understood.decode()) == (clause, odd)


# frames and arcs


def test_an_arc_of_nearly_one_line_is_none() -> None:
    begin, end = (0.0, 0.0, 0.0), (2.0, 0.0, 0.0)
    assert arc(begin, (1.0, 2e-6, 0.0), end, None) is not None
    assert arc(begin, (1.0, 0.5e-6, 0.0), end, None) is None
    assert arc(begin, (1.0, 1.0, 0.0), begin, None) is None
    assert arc(begin, (1.0, 1.0, 0.0), (1.0, 1.0 + 0.5e-6, 0.0), None) is None
    assert arc(begin, (1.0, 1.0, 0.0), (1.0, 1.0 + 3e-6, 0.0), None) is not None
    assert arc((5.0, 5.0, 5.0), (6.0, 6.0, 5.0), (7.0, 5.0, 5.0), 0) is None


@pytest.mark.parametrize("turn", [0.5, 1.0, 90.0, 181.0, 359.0, 720.0])
@pytest.mark.parametrize("sign", [1, -1])
def test_an_arc_turns_by_its_angle(turn: float, sign: int) -> None:
    """About (1, 2, 3), of radius 2, from angle 0 by way of 90 to 180 deg."""
    found = arc((3.0, 2.0, 3.0), (1.0, 4.0, 3.0), (-1.0, 2.0, 3.0), sign * turn)
    assert found is not None
    there = math.radians(sign * turn)
    np.testing.assert_allclose(found.end, (1 + 2 * math.cos(there), 2 + 2 * math.sin(there), 3), atol=1e-12)
    np.testing.assert_allclose(found.centre, (1, 2, 3), atol=1e-12)
    np.testing.assert_allclose(found.normal, (0, 0, sign), atol=1e-12)
    assert found.sweep == turn


def test_the_angles_of_frames() -> None:
    np.testing.assert_allclose(angles(rotation(30.0, 90.0 - 1e-6, 20.0)), (30, 90 - 1e-6, 20), atol=1e-6)
    np.testing.assert_allclose(angles(rotation(30.0, 90.0, 20.0)), (0, 90, -10), atol=1e-6)
    np.testing.assert_allclose(angles(rotation(30.0, -90.0, 20.0)), (0, -90, 50), atol=1e-6)
    assert product((1.0, 2.0, 3.0, 90.0, 0.0, 200.0), (5.0, 0.0, 0.0, 0.0, 0.0, 0.0))[3:] == (
        90.0,
        0.0,
        200.0,
    )
    np.testing.assert_allclose(
        product((1.0, 2.0, 3.0, 90.0, 0.0, 0.0), (5.0, 0.0, 0.0, 0.0, 0.0, 9.0)), (1, 7, 3, 90, 0, 9)
    )


# what statements change and read

SIX = {"base", "tool", "feed", "apo", "mode", "turning"}


@pytest.mark.parametrize(
    ("line", "changes", "calls"),
    [
        ("x=5", {b"X"}, ""), ("P[2].X=5", {b"P"}, ""), ("P.E1=5", set(), ""), ("$OUT[1]=TRUE", set(), ""),
        ("$BASE=x", {"base"}, ""), ("$tool.X=5", {"tool"}, ""), ("$VEL.CP=1", {"feed"}, ""),
        ("$VEL={CP 1}", {"feed"}, ""),
        ("$VEL.ORI1=1", set(), ""), ("$APO.CDIS=1", {"apo"}, ""), ("$IPO_MODE=#TCP", {"mode"}, ""),
        ("$ORI_TYPE=#VAR", {"turning"}, ""), ("$CIRC_TYPE=#PATH", {"turning"}, ""), ("$CIRC_MODE.X=1", {"turning"}, ""),
        ("FDAT_ACT=F", {"record"}, ""),
        ("LDAT_ACT=F", {"record"}, ""), ("PDAT_ACT.X=F", {"record"}, ""), ("DECL INT a,b=5,c[2]", {b"B"}, ""),
        ("DECL FRAME P[2]={X 1}", {b"P"}, ""), ("BAS(#BASE,1)", {"base"}, ""), ("BAS(#INITMOV,0)", SIX, ""),
        ("BAS(x)", SIX, ""),
        ("BAS(#ACC_PTP,5)", set(), ""), ("BAS(#CP_PARAMS,1)", SIX, ""),
        ("BAS(#PTP_PARAMS,1)", SIX - {"feed", "turning"}, ""),
        ("BAS(#FRAMES)", {"base", "tool", "mode"}, ""), ("BAS(#CP_DAT)", {"feed", "apo", "turning"}, ""),
        ("BAS(#PTP_DAT)", {"apo"}, ""),
        ("BAS(#VEL_CP,1)", {"feed"}, ""), ("BAS(#TOOL,1)", {"tool"}, ""), ("BAS(#EX_BASE,1)", {"base"}, ""),
        ("go(x,y[i])", {b"X", b"Y"}, "GO"), ("go(x+1,(y),z.A)", {b"Z"}, "GO"), ("H50(x)", set(), "H50"),
            ("SR_x(y)", set(), "SR_X"),
        ("FOR i = 1 TO n", {b"I"}, ""), ("FOR 5", set(), ""), ("IF LIN THEN", set(), ""), ("5 LIN P", {"point"}, ""),
        ("5 LINE P", set(), ""), ("WAIT FOR LIN", set(), ""), ("5 $LIN", set(), ""), ("5 #PTP", set(), ""),
        ("l\xe5 x", {"point"}, ""), ("l\xe5 x=1", UNREADABLE, ""), ("l\xe5 (1)", UNREADABLE, ""),
        ("GOTO l\xe5", UNREADABLE, ""), ("l\xe5:", UNREADABLE, ""), ("Z\xe4=1", set(), ""),
    ],
)  # fmt: skip
def test_what_a_statement_changes(line: str, changes: set[object], calls: str) -> None:
    assert effects_of(stated(line.encode("latin-1"))) == (changes, calls.encode())


@pytest.mark.parametrize(
    ("line", "called"),
    [
        ("x=f(1)+g (2)", ["F", "G"]), ("go(f(1),g(f(2)))", ["F", "G"]), ("go(1)", []),
        ("IF f(1) AND (g(2)) THEN", ["F", "G"]),
        ("UNTIL NOT(f(1))", ["F"]), ("RETURN f(1)", ["F"]), ("WAIT FOR f(1)", ["F"]), ("WAIT SEC (1)", []),
        ("HALT f(1)", []),
        ("SPLINE WITH $X=f(1)", ["F"]), ('x="f(1)"', []), ("x=#f(1)", []), ("x='f(1)'", []), ("x=a.f(1)", []),
        ("DEF a(b:IN)", []),
        ("x=5", []), ("FOR i=f(1) TO (3) STEP (f(2))", ["F"]), ("LIN f(1)", ["F"]), ("CASE f(1)", ["F"]),
        ("Z\xe4(f(1))", ["F"]),
    ],
)  # fmt: skip
def test_functions_that_a_statement_calls(line: str, called: list[str]) -> None:
    assert [name.decode() for name in functions_of(stated(line.encode("latin-1")))] == called


@pytest.mark.parametrize(
    ("line", "read"),
    [
        ("x=y", "Y"), ("x[i]=y", "I Y"), ("x.a=y", "Y"), ("x={X n,A 1}", "N"), ("x=X", "X"), ("x[i]={X 1}", "I"),
        ("$H_POS=y", ""), ("FDAT_ACT=y", ""), ("LDAT_ACT=y", ""), ("PDAT_ACT=y", ""), ("DECL INT x=n,z,u={X v}", "N V"),
        ("DECL thing x=n", "N"), ("BAS(#BASE,n)", ""), ("BAS(n)", "N"), ("go(x,1)", "X"), ("IF a THEN", "IF A THEN"),
    ],
)  # fmt: skip
def test_names_that_a_statement_reads(line: str, read: str) -> None:
    assert read_by(stated(line.encode())) == set(read.encode().split())


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (b" # base , 1 ", (b"BASE", b"1")), (b"#VEL_CP", (b"VEL_CP", b"")), (b"#A,b,c", (b"A", b"b,c")), (b"x", None),
        (b"#A b", None), (b"#a,", (b"A", b"")),
    ],
)  # fmt: skip
def test_commands_of_bas(text: bytes, found: tuple[bytes, bytes] | None) -> None:
    assert bas(text) == found


# variables


def test_variables_are_taken_back_to_every_place() -> None:
    """Random changes, and everything that can be asked, against copies."""
    chance = random.Random(5)
    names, paths = [b"A", b"B", b"F"], [b"", b".X", b"[1]", b"[1].X"]
    for _ in range(60):
        variables = Variables({b"F": {b"": 7, b"[1]": 8}})
        variables.set(b"A", b"", 1)

        def asked() -> list[object]:
            return [variables.get(name, path) for name in names for path in paths]  # noqa: B023

        marks = [(variables.facts, asked())]
        for step in range(12):
            name, path = chance.choice(names), chance.choice(paths)
            why = UnknownValue("KRL002", f"step {step}")
            match chance.randrange(5):
                case 0 | 1:
                    variables.set(name, path, step)
                    assert variables.get(name, path) == step
                    if not path:
                        assert variables.get(name, b"[1]") is None
                case 2:
                    variables.forget(name, why)
                    assert all(variables.get(name, path) == why for path in paths)
                case 3:
                    variables.forget_all(why)
                    assert variables.get(b"A") == variables.get(b"OTHER", b".X") == why
                    assert variables.get(b"F", b"[1]") == 8
                case 4:
                    variables.replace(name, chance.choice([{}, {b"": step}]))
            marks.append((variables.facts, asked()))
        while len(marks) > 1:
            marks = marks[: chance.randrange(1, len(marks))]
            variables.facts = marks[-1][0]
            assert asked() == marks[-1][1]


def test_components_of_variables() -> None:
    point = KrlTarget((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))
    variables = Variables({b"F": {b"": point}})
    assert variables.get(b"F", b".Y") == 2.0
    assert variables.get(b"F", b".Q") is None
    assert variables.get(b"NONE", b".Q") is None
    assert not variables.forget(b"NONE", WHY)
    assert variables.forget(b"F", WHY)
    assert variables.get(b"F", b".Y") == WHY
    variables.set(b"K", b"[1]", point)
    variables.set(b"K", b"[2]", WHY)
    assert variables.get(b"K", b"[1].C") == 6.0
    assert variables.get(b"K", b"[2].C") == WHY
    assert variables.get(b"K", b"[3].C") is None
    assert variables.get(b"K") is None
    variables.set(b"F", b"", point)
    variables.set(b"F", b".note", 5)
    assert variables.get(b"F", b".note") == 5
    assert variables.get(b"F", b".Z") == 3.0


def test_short_code_is_remembered() -> None:
    assert lexing.identifiers(b"a") is lexing.identifiers(b"a")


# files

KRL = KrlDialect()


@pytest.mark.parametrize(
    ("name", "raw", "claimed"),
    [
        ("a.SRC", b"", True), ("a.txt", b"x\n\tDEF a\r\nEND", True), ("a.txt", b"global def a;c", True),
        ("a.txt", b"DEF a b", False),
        ("a.txt", b"\xef\xbb\xbfDEF a()", True), ("a.txt", b"x\n SLIN{X 1}", True), ("a.txt", b"ptp {A1 5}", True),
        ("a.txt", b"DEFX a()", False),
        ("a.txt", b"; PTP {A1 5}", False), ("a.txt", b"PTP P1", False), ("a.dat", b"DEFDAT a", False),
    ],
)  # fmt: skip
def test_programs_that_are_krl(name: str, raw: bytes, claimed: bool) -> None:
    assert KRL.claims(Path(name), raw) == claimed


@pytest.mark.parametrize(
    ("raw", "marker", "at"),
    [
        (b"DEF a()\n;COMPENSATED by compensate 1\nEND\n", b";COMPENSATED by compensate 1", 8),
        (b"DEF a()\r\n \t;COMPENSATED by compensate 1 \r\nEND", b" \t;COMPENSATED by compensate 1 ", 9),
        (b"\xef\xbb\xbf;COMPENSATED by compensate 1", b";COMPENSATED by compensate 1", 3),
        (b"x=1 ;COMPENSATED by compensate 1\n\n;COMPENSATED by compensate\nDEF b()", None, 68),
        (b"x ;COMPENSATED by compensate 1\n\n;COMPENSATED by compensate 2\nDEF b", b";COMPENSATED by compensate 2", 66),
        (b"x=1 ;COMPENSATED by compensate 1\nx=2 ;COMPENSATED by compensate 3", None, 0),
        (b"&A\n\n&B\nDEF a()\n", None, 15), (b"&A\n  &B\nx=1\n&C\n", None, 8), (b"\xef\xbb\xbf&A\nx=1", None, 6),
        (b"x=1\nDEF a", None, 9),
        (b"&A", None, 2), (b"x\nDEF a()\nEND\nDEF b()\nEND\n", None, 10),
    ],
)  # fmt: skip
def test_where_the_marker_stands_or_belongs(raw: bytes, marker: bytes | None, at: int) -> None:
    program = KRL.read((Document(Path("a.src"), raw),))
    found = program.marker
    assert (None if found is None else raw[found.start : found.stop]) == marker
    assert (program.marker_at.start, program.marker_at.stop) == (at, at)


def test_a_program_without_a_routine_is_told_at_its_first_line() -> None:
    for raw, line in (b"\n \nx=1\n", 3), (b"", 1), (b"x=1", 1), (b"\n\n", 1):
        (found,) = KRL.read((Document(Path("a.src"), raw),)).findings
        assert (found.code, found.line, found.column) == ("KRL018", line, 1)


def test_names_of_the_module_in_both_files() -> None:
    texts = b"x\nDEF a()\nEND\n", b"DEFDAT b\nENDDAT\n"
    program = KRL.read(tuple(Document(Path(f"a{i}"), text) for i, text in enumerate(texts)))
    assert [texts[span.file][span.start : span.stop] for span in program.names] == [b"a", b"b"]
    program = KRL.read(tuple(Document(Path(f"a{i}"), text) for i, text in enumerate((b"", texts[1]))))
    assert [(span.file, span.start) for span in program.names] == [(1, 7)]


def test_findings_stand_in_the_order_of_their_places() -> None:
    raw = b"DEF a()\n LIN {X 1}\nENDIF\nunread()\n LIN P\nENDFOR\n"
    places = [(found.line, found.column) for found in KRL.read((Document(Path("a.src"), raw),)).findings]
    assert places == [(1, 1), (2, 2), (3, 1), (4, 1), (5, 2), (6, 1)]


@pytest.mark.parametrize("running", [True, False])
def test_the_collector_runs_behind_a_reading_as_before(running: bool) -> None:
    before = gc.isenabled()
    try:
        (gc.enable if running else gc.disable)()
        KRL.read((Document(Path("a.src"), b"DEF a()\nEND\n"),))
        assert gc.isenabled() == running
    finally:
        (gc.enable if before else gc.disable)()


def test_a_program_may_begin_with_an_empty_line():
    text = b"DEF part()\n$BASE={X 0,Y 0,Z 0,A 0,B 0,C 0}\n$TOOL=$BASE\nLIN {X 1,Y 2,Z 3,A 0,B 0,C 0}\nEND\n"
    plain, later = (
        KrlDialect().read((Document(Path("part.src"), lead + text),)).toolpath for lead in (b"", b"\n")
    )
    assert plain.line.tolist() == [4]
    assert later.line.tolist() == [5]
    np.testing.assert_array_equal(later.position, plain.position)
