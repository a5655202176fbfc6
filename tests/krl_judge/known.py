"""Misreadings of the present reader that are known, each with a small program.

A disagreement that vanishes where the interpreter makes the same mistake is explained by it.  What is mended here is
taken out: its name in ``machine``, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from .judge import Case, Disagreement, Reader, judge


@dataclass(frozen=True)
class Known:
    name: str
    """As ``machine`` and ``judge`` know it."""
    what: str
    case: Case


KNOWN = (
    Known(
        "partial axes",
        "A PTP to some axes moves the robot also where the other axes are not known; a partial point behind it is read"
        " with components from before that PTP.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "PTP {A3 66}\n"
            "LIN {X 9}\n"
            "END\n"
        ),
    ),
    Known(
        "tables",
        "BASE_DATA and TOOL_DATA outlive the program: a motion before the assignment of an entry stands in the old"
        " frame in the first run and in the new one in the next.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "BASE_DATA[1]={X 9,Y 0,Z 0,A 0,B 0,C 0}\n"
            "END\n"
        ),
    ),
    Known(
        "never",
        "A subprogram that is followed for one call, and called elsewhere where the flow is not followed: what the"
        " followed call does not reach is said to run never.",
        Case(
            "DEF part()\n"
            "DECL INT n\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "IF $IN[1] THEN\n"
            "sub(4)\n"
            "ENDIF\n"
            "sub(3)\n"
            "END\n"
            "DEF sub(v:IN)\n"
            "INT v\n"
            "IF v==4 THEN\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "ENDIF\n"
            "END\n",
            inputs=({1: (True,)},),
        ),
    ),
    Known(
        "orientation",
        "Under $ORI_TYPE=#CONSTANT the robot does not turn to the orientation of the point, and a partial point behind"
        " such a motion is not read; but it is, with that orientation, where inputs decide on #CONSTANT in a loop.",
        Case(
            "DEF part()\n"
            "DECL INT k\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "k=1\n"
            "WHILE k<=2\n"
            "IF $IN[1] THEN\n"
            "$ORI_TYPE=#CONSTANT\n"
            "ENDIF\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "k=k+1\n"
            "ENDWHILE\n"
            "$ORI_TYPE=#VAR\n"
            "LIN {Y 9}\n"
            "END\n",
            inputs=({1: (True,)},),
        ),
    ),
    Known(
        "functions",
        "A function that is called in the point of a motion may set frames and variables, and move; what it does there"
        " is not seen.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "LIN {X 1,Y 2,Z twice(3),A 4,B 5,C 6}\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEFFCT INT twice(v:IN)\n"
            "INT v\n"
            "$TOOL=TOOL_DATA[3]\n"
            "RETURN 2*v\n"
            "ENDFCT\n"
        ),
    ),
    Known(
        "aliases",
        "A parameter :OUT is the variable of the caller itself: where the subprogram sets that variable of the .dat"
        " under its own name too, the last value counts.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "sub(r)\n"
            "LIN {X r,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF sub(w:OUT)\n"
            "REAL w\n"
            "w=5\n"
            "r=8\n"
            "END\n",
            "DECL REAL r=1\n",
        ),
    ),
    Known(
        "aggregates",
        "What an aggregate leaves out of a point that had it is not documented: unset, as it is read, or as it was.",
        Case(
            "DEF part()\n"
            "DECL FRAME f\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "f={X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X 0,Y 0,Z 0,A 0,B 0,C 0}\n"
            "f={X 9}\n"
            "LIN f\n"
            "END\n"
        ),
    ),
)


def unexplained(case: Case, reader: Reader | None = None) -> tuple[Disagreement, ...]:
    """The disagreements that no known misreading explains, nor two or all of them together."""
    left = judge(case, reader).disagreements
    for chosen in (*combinations(KNOWN, 1), *combinations(KNOWN, 2), KNOWN):
        if not left:
            break
        still = judge(case, reader, frozenset(known.name for known in chosen)).disagreements
        places = {(d.line, d.word) for d in still}
        left = tuple(d for d in left if (d.line, d.word) in places)
    return left
