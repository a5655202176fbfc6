"""Small programs that were once misread, each for a reason of its own."""

from __future__ import annotations

from dataclasses import dataclass

from .judge import Case


@dataclass(frozen=True)
class Misreading:
    name: str
    what: str
    case: Case


MISREADINGS = (
    Misreading(
        "counters",
        "The counter of a FOR that its own statements set goes on from what they set.",
        Case(
            "DEF part()\n"
            "DECL INT i\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "FOR i=1 TO 7 STEP 2\n"
            "i=i+1\n"
            "LIN {X i,Y 2,Z 3,A 4,B 5,C 6}\n"
            "ENDFOR\n"
            "END\n"
        ),
    ),
    Misreading(
        "override",
        "$OV_PRO slows the motions behind it down, in subprograms too.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "$VEL.CP=1\n"
            "slower()\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF slower()\n"
            "$OV_PRO=50\n"
            "END\n"
        ),
    ),
    Misreading(
        "constant after axes",
        "With $ORI_TYPE=#CONSTANT a LIN after an axis motion keeps the orientation of that motion, whatever its text"
        " states; a partial point behind it is read with the angle of the text.",
        Case(
            "DEF part()\n"
            "$ORI_TYPE=#CONSTANT\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "PTP {A1 -71,A2 -21,A3 -67,A4 68,A5 -11,A6 76}\n"
            "LIN {X 193,Y 297,A -14,B -79,C -80}\n"
            "LIN {Z 224,Y -40,B -33,C -27}\n"
            "END\n"
        ),
    ),
    Misreading(
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
    Misreading(
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
    Misreading(
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
    Misreading(
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
    Misreading(
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
    Misreading(
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
    Misreading(
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
    Misreading(
        "parts",
        "A parameter that comes back as a component, or as an element whose index is computed: the variable keeps its"
        " old value.",
        Case(
            "DEF part()\n"
            "DECL FRAME f\n"
            "DECL INT n\n"
            "DECL REAL s[3]\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "f={X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "n=2\n"
            "s[2]=1\n"
            "sub(f.X)\n"
            "LIN f\n"
            "sub(s[n])\n"
            "LIN {X s[2],Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF sub(w:OUT)\n"
            "REAL w\n"
            "w=50\n"
            "END\n"
        ),
    ),
    Misreading(
        "controller",
        "A parameter that is the frame in force, or an entry of the table: later motions are said to stand in the old"
        " one, and so are motions in the subprogram.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "sub($BASE)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "sub(TOOL_DATA[2])\n"
            "BAS(#TOOL,2)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF sub(p)\n"
            "FRAME p\n"
            "p.X=9\n"
            "LIN {X 7,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
        ),
    ),
    Misreading(
        "axes in a frame",
        "A trigger may change base or tool at any time: an axis motion is said to run with the one before.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $TOOL=TOOL_DATA[3]\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "PTP {A1 1,A2 2,A3 3,A4 4,A5 5,A6 6}\n"
            "END\n",
            inputs=({}, {1: (True,)}),
        ),
    ),
    Misreading(
        "moved by an event",
        "A subprogram that an interrupt or a trigger runs moves the robot: the motion behind starts where that ends,"
        " and what a partial point or a relative motion keeps is not known.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "TRIGGER WHEN DISTANCE=0 DELAY=0 DO away() PRIO=-1\n"
            "LIN {X 2,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X 3}\n"
            "LIN {X 4,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF away()\n"
            "LIN {X 9,Y 9,Z 9,A 4,B 5,C 6}\n"
            "END\n",
            inputs=({}, {1: (True,)}, {1: (True, True)}),
        ),
    ),
    Misreading(
        "ended by RESUME",
        "An interrupt may end a subprogram anywhere: what that sets behind, and where its last motion leads, is said to"
        " hold after the call.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "INTERRUPT DECL 3 WHEN $IN[1] DO stop()\n"
            "INTERRUPT ON 3\n"
            "sub()\n"
            "INTERRUPT OFF 3\n"
            "LIN {X 7,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF sub()\n"
            "BAS(#BASE,2)\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X 2,Y 2,Z 3,A 4,B 5,C 6}\n"
            "BAS(#BASE,3)\n"
            "END\n"
            "DEF stop()\n"
            "BRAKE\n"
            "RESUME\n"
            "END\n",
            inputs=({1: (True,)}, {1: (True, True)}, {1: (True, True, True)}),
        ),
    ),
    Misreading(
        "BAS of an event",
        "An interrupt calls BAS itself, which is said not to be read and to leave base and tool.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "INTERRUPT DECL 3 WHEN $IN[1] DO BAS(#BASE,3)\n"
            "INTERRUPT ON 3\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X 2,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n",
            inputs=({1: (True,)},),
        ),
    ),
    Misreading(
        "what an event is handed",
        "An interrupt calls a function for what it hands over: the frame that this sets is said not to change.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "INTERRUPT DECL 3 WHEN $IN[1] DO ir(twice(4))\n"
            "INTERRUPT ON 3\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X 2,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF ir(v:IN)\n"
            "END\n"
            "DEFFCT INT twice(v:IN)\n"
            "BAS(#BASE,2)\n"
            "RETURN 2*v\n"
            "ENDFCT\n",
            inputs=({1: (True,)},),
        ),
    ),
    Misreading(
        "a parameter that changes later",
        "A trigger of a subprogram sets a parameter, when that has returned: the variable that was handed over for it"
        " is said to keep its value.",
        Case(
            "DEF part()\n"
            "DECL REAL r\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "r=7\n"
            "sub(r)\n"
            "LIN {X r,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF sub(w:OUT)\n"
            "TRIGGER WHEN PATH=0 DELAY=0 DO inner(w) PRIO=-1\n"
            "END\n"
            "DEF inner(u:OUT)\n"
            "u=9\n"
            "END\n",
            inputs=({1: (True,)}, {}),
        ),
    ),
    Misreading(
        "a variable that changes under its parameter",
        "A trigger sets a variable while a subprogram has it as its parameter.",
        Case(
            "DEF part()\n"
            "DECL REAL r\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "TRIGGER WHEN PATH=0 DELAY=0 DO r=9\n"
            "sub(r)\n"
            "END\n"
            "DEF sub(w:OUT)\n"
            "w=7\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X w,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n",
            inputs=({1: (True,)}, {1: (True, True)}),
        ),
    ),
    Misreading(
        "a parameter that is set in a loop",
        "A subprogram sets its base, and then a parameter for which a component of the base was handed over: motions"
        " behind are said to stand in the base that it set.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "sub($BASE.Z)\n"
            "END\n"
            "DEF sub(w:OUT)\n"
            "DECL INT i\n"
            "BAS(#BASE,2)\n"
            "BAS(#TOOL,1)\n"
            "FOR i=1 TO 2\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "inner(w)\n"
            "ENDFOR\n"
            "END\n"
            "DEF inner(u:OUT)\n"
            "BAS(#BASE,3)\n"
            "u=7\n"
            "LIN {X 2,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
        ),
    ),
    Misreading(
        "a variable under two names",
        "A subprogram sets a variable of the module, and then the parameter for which it was handed over: what it knows"
        " by its own name is said to be as it was set.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "sub(mr)\n"
            "END\n"
            "DEF sub(w:OUT)\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "mr=5\n"
            "w=9\n"
            "LIN {X mr,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n",
            dat="DEFDAT part\nDECL REAL mr=1\nENDDAT\n",
        ),
    ),
    Misreading(
        "a wait behind a call",
        "A routine is read apart, because what it gets is a frame in force; its last motion is said to be approximated,"
        " and the caller stops the advance run behind the call.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "between()\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n"
            "DEF between()\n"
            "inner($BASE.Z)\n"
            "WAIT SEC 1\n"
            "END\n"
            "DEF inner(w:OUT)\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "$APO.CDIS=49\n"
            "LIN {X 5,Y 2,Z 3,A 4,B 5,C 6} C_DIS\n"
            "END\n"
        ),
    ),
    Misreading(
        "a structure in a list",
        "A structure gets a new value as a whole, behind one of its parts: the old part is still said to hold.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "jobs[2].P={X 7,Y 7,Z 7,A 0,B 0,C 0}\n"
            "jobs[2]=job\n"
            "LIN jobs[2].P\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n",
            dat="DEFDAT part\nSTRUC jobtype FRAME P,INT count\n"
            "DECL jobtype job={P {X 1,Y 2,Z 3,A 4,B 5,C 6},count 3}\nDECL jobtype jobs[2]\nENDDAT\n",
        ),
    ),
    Misreading(
        "a force behind a condition",
        "A FORCE comment that is passed, or not, as an input decides is in force behind the condition too.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "IF $IN[1] THEN\n"
            ";FORCE 1 0 0\n"
            "ENDIF\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n",
            inputs=({1: (False,)}, {1: (True,)}),
        ),
    ),
    Misreading(
        "a force that a return goes past",
        "A FORCE comment before a RETURN is in force behind it.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "sub()\n"
            "END\n"
            "DEF sub()\n"
            "IF $IN[1] THEN\n"
            ";FORCE 1 0 0\n"
            "RETURN\n"
            "ENDIF\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "END\n",
            inputs=({1: (False,)}, {1: (True,)}),
        ),
    ),
    Misreading(
        "a force of the last pass",
        "A FORCE comment at the end of a loop is not in force at its start.",
        Case(
            "DEF part()\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            "REPEAT\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            ";FORCE 1 0 0\n"
            "UNTIL $IN[1]\n"
            "END\n",
            inputs=({1: (False, True)}, {1: (True,)}),
        ),
    ),
    Misreading(
        "a force that an interrupt states",
        "A FORCE comment in a routine that an interrupt runs is not in force behind it.",
        Case(
            "DEF part()\n"
            "INTERRUPT DECL 8 WHEN $IN[2]==TRUE DO away()\n"
            "INTERRUPT ON 8\n"
            "BAS(#BASE,1)\n"
            "BAS(#TOOL,1)\n"
            ";FORCE 1 0 0\n"
            "LIN {X 1,Y 2,Z 3,A 4,B 5,C 6}\n"
            "LIN {X 1,Y 2,Z 5,A 4,B 5,C 6}\n"
            "LIN {X 1,Y 2,Z 7,A 4,B 5,C 6}\n"
            "END\n"
            "DEF away()\n"
            ";FORCE OFF\n"
            "END\n",
            inputs=({2: (True,)},),
        ),
    ),
)
