"""What is done to a program: every mutation takes bytes and a generator of random numbers, and gives bytes."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np

Random = np.random.Generator
Mutation = Callable[[bytes, Random], bytes]

_TOKEN = re.compile(rb"[A-Za-z_$][A-Za-z0-9_$]*|[-+]?[0-9.]+|[^\sA-Za-z0-9]|[ \t]+")
_NUMBER = re.compile(rb"[-+]?[0-9]*\.?[0-9]+")
NUMBERS = (
    b"0 -0 1e5 -1E-3 99999999999999999999 'HFF' 'B101' 1.2.3 nan 180 -180 90 1e400 0.0000000000000000001 #1 R1 [1+2] "
    b"X - . 5."
).split()
WORDS = [
    *b"{ } ( ) [ ] ; , : = ' \" % / & # $ \xff \xef\xbb\xbf LIN CIRC _REL C_DIS WITH SPLINE ENDSPLINE".split(),
    *b"FOR ENDFOR LOOP ENDLOOP IF ENDIF DEF END GOTO BAS(#INITMOV,0) ;FOLD ;ENDFOLD $BASE $POS_ACT".split(),
    *b"G91 G90 G2 G3 G20 G18 G41 G81 M98 O1 TRAORI AC( IC( CR= TRANS MCALL REPEAT WHILE I1 R-5 N10".split(),
    *(b"\r", b"\n", b"\t", b"\0", b""),
]
RAPID_WORDS = [
    *b'{ } ( ) [ ] ; , : := = " \\ ! * + - \xff MoveL MoveC MoveJ MoveAbsJ MODULE ENDMODULE PROC ENDPROC'.split(),
    *b"FOR ENDFOR WHILE ENDWHILE IF ENDIF ELSE THEN TEST CASE ENDTEST GOTO RETURN ERROR RETRY TRAP FUNC".split(),
    *b"CONST PERS VAR robtarget num LOCAL TASK Offs( RelTool( \\Off \\On \\WObj:=w \\ID:=1 \\Corr [9E9] 9E9".split(),
    *b"PDispOn PDispOff EOffsOn SearchL TriggL ConfL SingArea VelSet AccSet .trans.x .rot %% CirPathMode".split(),
    *(b"\r", b"\n", b"\t", b"\0", b"", b"! FORCE 1 2 3\n", b"! COMPENSATE OFF\n"),
]
TP_WORDS = [
    *b"{ } ( ) [ ] ; , : = ' \" \\ ! // * + - \xff L J C A S P[1] P[2:a] PR[1] R[1] LBL[1] JMP CALL END".split(),
    *b"UFRAME_NUM=2 UTOOL_NUM=2 UFRAME[1]=PR[1] OVERRIDE=50% FINE CNT100 CR5 mm/sec cm/min deg/sec % sec".split(),
    *b"Offset Offset,PR[1] Tool_Offset INC Skip,LBL[1] Weave Wjnt ACC80 TB COORD GP1: GP2: UF : UT CONFIG 'N".split(),
    *b"/PROG /ATTR /APPL /MN /POS /END X Y Z W J1 E1 mm deg ***.** F IF FOR ENDFOR SELECT".split(),
    *(b"\r", b"\n", b"\t", b"\0", b"", b"  1:  !FORCE 1 2 3 ;\n", b"  1:  !COMPENSATE OFF ;\n"),
]
OWN_WORDS = ((b"/MN", TP_WORDS), (b"MODULE", RAPID_WORDS))
"""What a text has, and the words that mean something there."""


def cut(raw: bytes, random: Random) -> bytes:
    """The begin of a file, as a transfer that broke off leaves it; sometimes its end."""
    at = int(random.integers(0, len(raw) + 1))
    return raw[:at] if random.random() < 0.8 else raw[at:]


def flipped(raw: bytes, random: Random) -> bytes:
    """Some bits are others."""
    result = bytearray(raw)
    for at in random.integers(0, max(len(raw), 1), int(random.integers(1, 20))).tolist():
        if at < len(result):
            result[at] ^= 1 << int(random.integers(0, 8))
    return bytes(result)


def noise(raw: bytes, random: Random) -> bytes:
    """A stretch of any bytes, in place of another or between."""
    at = int(random.integers(0, len(raw) + 1))
    stuff = random.integers(0, 256, int(random.integers(1, 200)), dtype=np.uint8).tobytes()
    return raw[:at] + stuff + raw[at + int(random.integers(0, 100)) :]


def lines_moved(raw: bytes, random: Random) -> bytes:
    """Lines swapped, doubled or left out."""
    lines = raw.splitlines(keepends=True)
    for _ in range(int(random.integers(1, 8))):
        if len(lines) < 2:
            break
        one, other = (int(i) for i in random.integers(0, len(lines), 2))
        what = random.random()
        if what < 0.4:
            lines[one], lines[other] = lines[other], lines[one]
        elif what < 0.8:
            lines.insert(other, lines[one])
        else:
            del lines[one]
    return b"".join(lines)


def tokens_moved(raw: bytes, random: Random) -> bytes:
    """Tokens of the file, or words that mean something, put in places where they do not belong."""
    spans = [found.span() for found in _TOKEN.finditer(raw)]
    if not spans:
        return raw
    words = next((own for sign, own in OWN_WORDS if sign in raw), WORDS)
    for _ in range(int(random.integers(1, 6))):
        start, stop = spans[int(random.integers(0, len(spans)))]
        a, b = spans[int(random.integers(0, len(spans)))]
        word = raw[a:b] if random.random() < 0.5 else words[int(random.integers(0, len(words)))]
        raw = raw[:start] + word + raw[start if random.random() < 0.4 else stop :]
    return raw


def numbers_changed(raw: bytes, random: Random) -> bytes:
    """Other numbers, and what only looks like one."""
    spans = [found.span() for found in _NUMBER.finditer(raw)]
    if not spans:
        return raw
    chosen = {int(i) for i in random.integers(0, len(spans), int(random.integers(1, 10)))}
    for i in sorted(chosen, reverse=True):
        start, stop = spans[i]
        number = NUMBERS[int(random.integers(0, len(NUMBERS)))]
        if random.random() < 0.5:
            number = b"%.*f" % (int(random.integers(0, 7)), float(random.normal(0, 500)))
        raw = raw[:start] + number + raw[stop:]
    return raw


def newlines_changed(raw: bytes, random: Random) -> bytes:
    """Other line endings, all of them or some, or blanks squeezed."""
    what = int(random.integers(0, 5))
    if what == 0:
        return raw.replace(b"\r\n", b"\n").replace(b"\n", b"\r\n")
    if what == 1:
        return raw.replace(b"\r\n", b"\n").replace(b"\n", b"\r")
    if what == 2:
        return raw.replace(b" ", b"")
    if what == 3:
        return raw.swapcase()
    at = int(random.integers(0, len(raw) + 1))
    return raw[:at].replace(b"\n", b"\r\n") + raw[at:]


def nothing(raw: bytes, random: Random) -> bytes:
    """The program as it is: it is moved at random all the same."""
    return raw


MUTATIONS: dict[str, Mutation] = {
    function.__name__: function
    for function in (
        cut, flipped, noise, lines_moved, tokens_moved, numbers_changed, newlines_changed, nothing
    )
}  # fmt: skip


def mutated(raw: bytes, random: Random, only: tuple[str, ...] = ()) -> tuple[str, bytes]:
    """One or two mutations, and their names."""
    names = only or tuple(MUTATIONS)
    said = []
    for _ in range(1 if random.random() < 0.7 else 2):
        said.append(names[int(random.integers(0, len(names)))])
        raw = MUTATIONS[said[-1]](raw, random)
    return "+".join(said), raw
