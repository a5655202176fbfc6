"""Time and memory of reading drawn hostile programs: `python -m tests.drawn_hostile COUNT SEED [BYTES] [LANGUAGE]`.

A program has one to three parts.  A part is one of these, drawn from the words of its language:

    part   = around | deep | long
    around = loops in each other (0 to 4), around one to four statements that are repeated as often as there is room
    deep   = blocks in each other (up to 300), each with statements, as often as there is room
    long   = statements of 300 to 100,000 characters: sums, products, nested parentheses or lists, strings, names

Statements are numbered, so that names, labels, points, registers and numbers are new ones each time, or the same ones.
"""

import random
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from linear import CONTROLS, KRL_HEAD, MB, MEGABYTES, SECONDS, Case, Cost, import_readers, measure
from linear_robots import RAPID_HEAD, RAPID_TAIL, TP_HEAD, TP_POINT

LENGTHS = (300, 3_000, 30_000, 100_000)


@dataclass(frozen=True)
class Language:
    """``kind``: of a case; ``statements``: one each, %d its number; ``blocks``: what starts and ends one, %d as a
    number that no other one has; ``long``: statements around %s; ``operators``: between terms of an expression."""

    kind: str
    head: str
    tail: str
    statements: tuple[str, ...]
    blocks: tuple[tuple[str, str], ...]
    long: tuple[str, ...]
    operators: tuple[str, ...]
    brackets: tuple[str, str]


_KRL = Language(
    "src",
    KRL_HEAD.replace("\n", "\nDECL INT I,J,K,R\nDECL REAL V[1000]\nDECL E6POS P\n", 1),
    "END\nDEF F()\nR=R+1\nLIN {X 1}\nEND\nDEF G(A:OUT)\nINT A\nA=A+1\nEND\n",
    (
        "LIN {X %d,Y 0,Z 0,A 0,B 0,C 180}",
        "LIN {X 1}",
        "LIN P",
        "LIN P:{X %d}",
        "P.X=P.X+%d",
        "PTP {A1 %d}",
        "R=R+1",
        "R=%d",
        "R=R*I+J",
        "V[%d]=R",
        "V[R]=%d",
        "P={X %d,Y 0,Z 0,A 0,B 0,C 0}",
        "LIN_REL {X 0.1}",
        "$BASE=BASE_DATA[1]",
        "$BASE={X %d,Y 0,Z 0,A 0,B 0,C 0}",
        "F()",
        "G(R)",
        "G(V[%d])",
        "unknown(R)",
        "WAIT SEC 0",
        "$VEL.CP=0.1",
        "BAS(#TOOL,1)",
        "CIRC {X 1},{X %d}",
        "LIN {X 1} C_DIS",
        ";FORCE %d 2 3",
        "; %d",
        "DECL INT Q%d",
        "Q%d=R",
        "IF R==%d THEN\nR=1\nENDIF",
        "IF $IN[1] THEN\nP.Z=%d\nELSE\nP.Z=R\nENDIF",
        "FOR K=1 TO 9\nLIN {X 1}\nENDFOR",
        "WHILE $IN[1]\nR=R+1\nENDWHILE",
        "SWITCH R\nCASE %d\nLIN {X 1}\nDEFAULT\nLIN {X 2}\nENDSWITCH",
        "L%d:",
        "IF $IN[1] THEN\nGOTO L\nENDIF",
        "L%d:\nIF $IN[1] THEN\nGOTO L%d\nENDIF",
        "SPLINE\nSPL {X %d}\nENDSPLINE",
        "TRIGGER WHEN DISTANCE=0 DELAY=0 DO F()",
        "R=ABS(R)+SQRT(%d)",
        "END\nDEF H%d()\nR=%d",
        "RETURN",
        "HALT",
    ),
    (
        ("FOR I=1 TO 9", "ENDFOR"),
        ("FOR J=1 TO R", "ENDFOR"),
        ("WHILE $IN[1]", "ENDWHILE"),
        ("LOOP", "ENDLOOP"),
        ("R=1\nWHILE R<9\nR=R+1", "ENDWHILE"),
        ("REPEAT", "UNTIL $IN[1]"),
        ("IF $IN[1] THEN", "ENDIF"),
        ("M%d:", "IF $IN[1] THEN\nGOTO M%d\nENDIF"),
        ("IF R==1 THEN\nGOTO N%d\nENDIF", "N%d:"),
        ("SWITCH R\nCASE 1", "ENDSWITCH"),
    ),
    (
        "R=%s",
        "IF %s THEN\nENDIF",
        "LIN {X %s}",
        "P.X=%s",
        "F(%s)",
        "V[%s]=1",
        "LIN P:%s",
        "; %s",
        'MSG("%s")',
    ),
    ("+", "-", "*", ":", " AND ", "==", " B_AND "),
    ("(", ")"),
)
_RAPID = Language(
    "mod",
    RAPID_HEAD,
    "\nENDPROC\nPROC f()\nn:=n+1;\nMoveL p,v1,z1,t;\nENDPROC\nPROC g(INOUT num x)\nx:=x+1;\n" + RAPID_TAIL,
    (
        "MoveL [[%d,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;",
        "MoveL p,v1,z1,t;",
        "MoveL Offs(p,%d,0,0),v1,z1,t;",
        "MoveL RelTool(p,0,0,n),v1,z1,t;",
        "MoveC p,q,v1,z1,t;",
        "n:=n+1;",
        "n:=%d;",
        "n:=m*n+%d;",
        "a{%d}:=n;",
        "a{n}:=%d;",
        "p.trans.x:=p.trans.x+1;",
        "q:=p;",
        "p:=Offs(q,n,0,%d);",
        "f;",
        "g n;",
        "g a{%d};",
        "unknown n;",
        "n:=unknown(n);",
        "! FORCE %d 2 3",
        "! %d",
        "VAR num v%d;",
        "VAR num w%d:=1;\nw%d:=n;",
        "IF n=%d THEN\nm:=1;\nENDIF",
        "IF di1=1 THEN\np.trans.z:=n;\nELSE\nMoveL q,v1,z1,t;\nENDIF",
        "FOR k FROM 1 TO 9 DO\nMoveL p,v1,z1,t;\nENDFOR",
        "WHILE di1=1 DO\nn:=n+1;\nENDWHILE",
        "TEST n\nCASE %d:\nMoveL p,v1,z1,t;\nDEFAULT:\nm:=n;\nENDTEST",
        "l%d:",
        "IF di1=1 GOTO z;",
        "l%d:\nIF di1=1 GOTO l%d;",
        "ConfL\\Off;",
        "PDispOff;",
        "SingArea\\Wrist;",
        "WaitTime 1;",
        "RETURN;",
        "MoveAbsJ [[%d,0,0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,t;",
        "ENDPROC\nPROC h%d()\nn:=%d;",
        "a{1}:=Abs(n)+Sqrt(%d);",
    ),
    (
        ("FOR i FROM 1 TO 9 DO", "ENDFOR"),
        ("FOR i FROM 1 TO n DO", "ENDFOR"),
        ("WHILE di1=1 DO", "ENDWHILE"),
        ("n:=0;\nWHILE n<9 DO\nn:=n+1;", "ENDWHILE"),
        ("IF di1=1 THEN", "ENDIF"),
        ("x%d:", "IF di1=1 GOTO x%d;"),
        ("IF n=1 GOTO y%d;", "y%d:"),
        ("TEST n\nCASE 1:", "ENDTEST"),
        ("FOR i FROM 9 TO 1 STEP -m DO", "ENDFOR"),
    ),
    (
        "n:=%s;",
        "IF %s THEN\nENDIF",
        "MoveL Offs(p,%s,0,0),v1,z1,t;",
        "f %s;",
        "a{%s}:=1;",
        "! %s",
        'TPWrite "%s";',
        "VAR num u:=%s;",
    ),
    ("+", "-", "*", " AND ", "=", " DIV "),
    ("(", ")"),
)
_TP = Language(
    "ls",
    TP_HEAD,
    "/POS\n" + "".join(TP_POINT % n for n in (1, 2, 3)) + "/END\n",
    (
        "1:L P[1] 9mm/sec FINE ;",
        "1:L P[%d] 9mm/sec FINE ;",
        "1:J P[2] 9% CNT9 ;",
        "1:C P[1]\n:P[2] 9mm/sec FINE ;",
        "1:A P[3] 9mm/sec FINE ;",
        "1:R[%d]=1 ;",
        "1:R[1]=R[1]+1 ;",
        "1:R[%d]=R[%d]+R[1] ;",
        "1:R[R[1]]=%d ;",
        "1:L P[R[1]] 9mm/sec FINE ;",
        "1:LBL[%d] ;",
        "1:JMP LBL[%d] ;",
        "1:IF R[1]=%d,JMP LBL[1] ;",
        "1:IF DI[1]=ON,JMP LBL[%d] ;\n1:LBL[%d] ;",
        "1:LBL[%d] ;\n1:IF DI[1]=ON,JMP LBL[%d] ;",
        "1:IF DI[1]=ON,CALL F%d ;",
        "1:FOR R[2]=1 TO 9 ;\n1:L P[1] 9mm/sec FINE ;\n1:ENDFOR ;",
        "1:IF (DI[1]=ON) THEN ;\n1:R[%d]=2 ;\n1:ELSE ;\n1:R[%d]=3 ;\n1:ENDIF ;",
        "1:SELECT R[1]=%d,JMP LBL[1] ;",
        "1:! FORCE %d 2 3 ;",
        "1:! a ;",
        "1:UFRAME_NUM=%d ;",
        "1:UTOOL_NUM=1 ;",
        "1:PR[%d]=LPOS ;",
        "1:PR[%d]=PR[1]+PR[2] ;",
        "1:L PR[%d] 9mm/sec FINE ;",
        "1:L P[1] 9mm/sec FINE Offset,PR[%d] ;",
        "1:CALL F%d(1) ;",
        "1:WAIT 1.00(sec) ;",
        "1:DO[%d]=ON ;",
        "1:L P[1] R[%d]mm/sec FINE ;",
    ),
    (
        ("1:LBL[9%d] ;", "1:IF DI[1]=ON,JMP LBL[9%d] ;"),
        ("1:FOR R[9]=1 TO 9 ;", "1:ENDFOR ;"),
        ("1:FOR R[8]=1 TO R[1] ;", "1:ENDFOR ;"),
        ("1:IF (DI[1]=ON) THEN ;", "1:ENDIF ;"),
        ("1:R[1]=1 ;\n1:LBL[8%d] ;\n1:R[1]=R[1]+1 ;", "1:IF R[1]<9,JMP LBL[8%d] ;"),
        ("1:IF R[1]=1,JMP LBL[7%d] ;", "1:LBL[7%d] ;"),
    ),
    (
        "1:R[1]=%s ;",
        "1:IF (%s) THEN ;\n1:ENDIF ;",
        "1:R[%s]=1 ;",
        "1:! %s ;",
        "1:CALL F(%s) ;",
        "1:DO[1]=(%s) ;",
    ),
    ("+", "-", "*", " AND ", "=", " DIV "),
    ("(", ")"),
)
_NGC_STATEMENTS = (
    "G1 X%d Y1 Z2 F100",
    "X%d",
    "G2 X%d I1 J0",
    "N%d G1 X1",
    "#%d=1",
    "#1=[#1+1]",
    "G1 X[#1+%d]",
    "G1 X#%d",
    "#[#1]=%d",
    "G91 G1 X1",
    "G90",
    "G10 L2 P1 X%d",
    "G92 X%d",
    "G81 X%d Z1 R2 F9",
    "G98 G83 X1 Z1 R2 Q1",
    "G80",
    "G28 X0",
    "G43 H%d",
    "T%d M6",
    "G17",
    "G54",
    "(%d)",
    "(FORCE %d 2 3)",
    "G4 P1",
    "G53 G0 X1",
    "G0 X#1 Y#2 Z#3",
    "G52 X%d",
    "M8",
    "G20",
    "G21",
)
_LINUXCNC = Language(
    "linuxcnc",
    "o7 sub\n#1=[#1+1]\nG1 X#1\no7 endsub\n" + CONTROLS["linuxcnc"],
    "M2\n",
    (
        *_NGC_STATEMENTS,
        "#<v%d>=#1",
        "G1 X#<_g>",
        "#<_g>=%d",
        "o7 call [%d]",
        "G1 X[SIN[#1]*%d+ATAN[1]/[2]]",
        "o3%d if [#1 EQ 1]\nG1 X1\no3%d endif",
        "o4%d repeat [3]\nG1 X1\no4%d endrepeat",
        "#%d=#1",
    ),
    (
        ("o1%d while [#1 LT 9]\n#1=[#1+1]", "o1%d endwhile"),
        ("o1%d repeat [9]", "o1%d endrepeat"),
        ("o1%d if [#9 GT 0]", "o1%d endif"),
        ("o1%d do", "o1%d while [#5399 LT 1]"),
        ("o1%d while [#5399 LT 1]", "o1%d endwhile"),
    ),
    ("#1=[%s]", "G1 X[%s]", "(%s)", "o2%%d if [%s]\no2%%d endif", "#[%s]=1", "(MSG,%s)", "o7 call [%s]"),
    ("+", "-", "*", " AND ", " EQ ", " MOD "),
    ("[", "]"),
)
_FANUC = Language(
    "fanuc",
    CONTROLS["fanuc"],
    "M30\nO7\n#1=#1+1\nG1 X#1\nM99\n%\n",
    (
        *_NGC_STATEMENTS,
        "M98 P7",
        "G65 P7 A%d",
        "IF[#1 EQ %d] GOTO 9",
        "IF[#1 EQ %d] THEN #2=1",
        "#%d=#1*2",
        "N%d",
        "N%d IF[#500 EQ 1] GOTO %d",
        "WHILE[#1 LT 9] DO3\nG1 X1\nEND3",
        "G66 P7 A1",
        "G67",
        "GOTO %d\nN%d",
    ),
    (
        ("WHILE[#1 LT 9] DO1\n#1=#1+1", "END1"),
        ("WHILE[#500 LT 9] DO2", "END2"),
        ("IF[#500 EQ 1] GOTO 1%d", "N1%d"),
        ("N2%d", "IF[#500 EQ 1] GOTO 2%d"),
    ),
    ("#1=%s", "G1 X[%s]", "(%s)", "IF[%s] GOTO 9", "#[%s]=1", "G65 P7 A[%s]"),
    ("+", "-", "*", " AND ", " EQ ", " MOD "),
    ("[", "]"),
)
_SINUMERIK = Language(
    "sinumerik",
    CONTROLS["sinumerik"],
    "M30\n",
    (
        "G1 X%d Y1 Z2 F100",
        "X%d",
        "G2 X%d I1 J0",
        "N%d G1 X1",
        "R%d=1",
        "R1=R1+1",
        "G1 X=R1+%d",
        "X=AC(%d)",
        "X=IC(1)",
        "R[R1]=%d",
        "TRANS X%d",
        "ATRANS X1",
        "AROT Z%d",
        "TRANS",
        "CYCLE81(10,0,2,-%d)",
        "MCALL CYCLE81(10,0,2,-5)",
        "MCALL",
        "G54",
        "SUPA G0 X1",
        "DEF REAL A%d",
        "DEF REAL B%d\nB%d=R1",
        "IF R1==%d\nR2=1\nENDIF",
        "IF R1==%d GOTOF E%d\nX1\nE%d:",
        "L%d:",
        "L%d:\nIF $A_IN[1] GOTOB L%d",
        "FOR R3=1 TO 9\nG1 X1\nENDFOR",
        "REPEAT L1",
        "T%d M6",
        "D%d",
        "G91",
        "G90",
        "; %d",
        "; FORCE %d 2 3",
        "$P_PFRAME=CTRANS(X,%d)",
        "G1 X1 A3=%d B3=0 C3=1",
        "G1 A=%d",
        "R2=SIN(R1)*%d",
        "CYCLE800()",
        "G4 F1",
        "M8",
    ),
    (
        ("FOR R4=1 TO 9", "ENDFOR"),
        ("WHILE R1<9\nR1=R1+1", "ENDWHILE"),
        ("LOOP", "ENDLOOP"),
        ("REPEAT", "UNTIL $A_IN[1]"),
        ("WHILE $A_IN[1]", "ENDWHILE"),
        ("IF $A_IN[1]", "ENDIF"),
        ("IF R1==2 GOTOF F%d", "F%d:"),
        ("G%d0_:", "IF $A_IN[1] GOTOB G%d0_"),
    ),
    ("R1=%s", "G1 X=%s", "; %s", "IF %s\nENDIF", "R[%s]=1", 'MSG("%s")', "CYCLE81(%s)", "X=AC(%s)"),
    ("+", "-", "*", " AND ", "==", " DIV "),
    ("(", ")"),
)
LANGUAGES = {
    "krl": _KRL,
    "rapid": _RAPID,
    "tp": _TP,
    "linuxcnc": _LINUXCNC,
    "fanuc": _FANUC,
    "sinumerik": _SINUMERIK,
}
_NAMES = {"src": "R", "mod": "n", "ls": "R[1]", "linuxcnc": "#1", "fanuc": "#1", "sinumerik": "R1"}

Part = Callable[[int], str]
"""The text of a part of about so many characters."""


def _numbered(text: str, number: int) -> str:
    return text.replace("%d", str(number))


def _around(random_: random.Random, language: Language) -> tuple[str, Part]:
    blocks = [random_.choice(language.blocks) for _ in range(random_.choice((0, 1, 1, 2, 2, 3, 4)))]
    body = "\n".join(random_.choice(language.statements) for _ in range(random_.randint(1, 4))) + "\n"

    def text(size: int) -> str:
        starts = [_numbered(start, number) for number, (start, _) in enumerate(blocks, 900_001)]
        ends = [_numbered(end, number) for number, (_, end) in enumerate(blocks, 900_001)]
        length = len(body) + 4 * body.count("%d")
        middle = "".join(_numbered(body, number) for number in range(1, max(size // length, 1)))
        return "\n".join([*starts, middle + (ends[-1] if ends else ""), *reversed(ends[:-1])]) + "\n"

    return f"{[start for start, _ in blocks]} around {body!r}", text


def _deep(random_: random.Random, language: Language) -> tuple[str, Part]:
    block = random_.choice(language.blocks)
    body = random_.choice(language.statements)
    depth = random_.choice((3, 10, 30, 100, 300))

    def text(size: int) -> str:
        found, length, number = [], 0, 0
        while length < size:
            numbers = range(number + 1, number + depth + 1)
            one = "\n".join(
                [_numbered(f"{block[0]}\n{body}", each) for each in numbers]
                + [_numbered(block[1], each) for each in reversed(numbers)]
            )
            number, length = number + depth, length + len(one)
            found.append(one)
        return "\n".join(found) + "\n"

    return f"{depth} deep {block[0]!r} with {body!r}", text


def _long(random_: random.Random, language: Language) -> tuple[str, Part]:
    frame, length = random_.choice(language.long), random_.choice(LENGTHS)
    name, operator = _NAMES[language.kind], random_.choice(language.operators)
    opened, closed = language.brackets
    forms: dict[str, Callable[[], str]] = {
        "sum": lambda: operator.join([name] * (length // len(name + operator))),
        "numbers": lambda: operator.join(["1.5"] * (length // len("1.5" + operator))),
        "nested": lambda: opened * (length // 2) + "1" + closed * (length // 2),
        "nested sum": lambda: f"{opened}{name}{operator}" * (length // 8) + "1" + closed * (length // 8),
        "list": lambda: ",".join(["1"] * (length // 2)),
        "name": lambda: "a" * length,
        "digits": lambda: "1" * length,
        "calls": lambda: "ABS(" * (length // 5) + "1" + ")" * (length // 5),
        "indices": lambda: "V[" * (length // 3) + "1" + "]" * (length // 3),
        "signs": lambda: "-" * length + "1",
        "strings": lambda: '"' + '" "' * (length // 3) + '"',
        "open": lambda: opened * length,
    }
    form = random_.choice(sorted(forms))
    statement = frame.replace("%%d", "%d").replace("%s", forms[form]()) + "\n"

    def text(size: int) -> str:
        return "".join(_numbered(statement, number) for number in range(max(size // len(statement), 1)))

    return f"{form} of {length} with {operator!r} in {frame!r}", text


@dataclass(frozen=True)
class DrawnCase(Case):
    parts: tuple[Part, ...] = ()

    def text(self, size: int) -> bytes:
        return (
            self.head + "".join(part(size // len(self.parts)) for part in self.parts) + self.tail
        ).encode()


def draw(seed: int, language: str) -> DrawnCase:
    """The hostile program of a seed."""
    random_ = random.Random(f"{language} {seed}")
    chosen = LANGUAGES[language]
    makers = [
        random_.choice((_around, _around, _around, _deep, _long)) for _ in range(random_.choice((1, 1, 2, 3)))
    ]
    names, parts = zip(*(make(random_, chosen) for make in makers), strict=True)
    return DrawnCase(chosen.kind, f"{seed}: {'; '.join(names)}", chosen.head, "", chosen.tail, parts)


def main(count: int, seed: int, size: int = MB, language: str = "", longest: int = 20) -> None:
    import_readers()
    costs: list[tuple[Cost, str]] = []
    names = [language] if language else sorted(LANGUAGES)
    for number in range(count):
        name = names[number % len(names)]
        case = draw(seed + number, name)
        cost = measure(case, size, longest)
        costs.append((cost, f"{name} {case.name}"))
        if cost.seconds > SECONDS * size / MB or cost.megabytes > MEGABYTES or cost.error:
            print(
                f"{cost.seconds:7.2f} s {cost.megabytes:6.0f} MB  {costs[-1][1][:240]}  {cost.error}",
                flush=True,
            )
    beyond = sum(cost.seconds > SECONDS * size / MB or cost.megabytes > MEGABYTES for cost, _ in costs)
    bounds = f"{SECONDS * size / MB} s or {MEGABYTES} MB"
    print(f"{count} programs of {size} bytes from seed {seed}: {beyond} beyond {bounds}; the slowest:")
    for cost, title in sorted(costs, key=lambda each: -each[0].seconds)[:20]:
        print(f"{cost.seconds:7.2f} s {cost.megabytes:6.0f} MB  {title[:240]}")
    print("the largest:")
    for cost, title in sorted(costs, key=lambda each: -each[0].megabytes)[:10]:
        print(f"{cost.seconds:7.2f} s {cost.megabytes:6.0f} MB  {title[:240]}")


if __name__ == "__main__":
    main(*(int(word) if word.isdigit() else word for word in sys.argv[1:]))
