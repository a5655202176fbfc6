"""KRL: system variables, commands of bas.src, events, waits."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program, ReadingSettings

from .scan import ACTS, IDLE, Language, Statement

FRAME = "{X 11,Y 12,Z 13,A 14,B 15,C 16}"
_ACTS = (
    "$VEL.CP=0.0123", "$VEL={CP 0.0123,ORI1 200,ORI2 200}", "BAS(#VEL_CP,0.0123)", "$BASE=BASE_DATA[7]",
    "$BASE.X=99.5", f"$BASE={FRAME}", f"$BASE={FRAME}:$BASE", "$BASE=EB(#EASYS)",
    "$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,{X 0})", "$TOOL=TOOL_DATA[7]", "$TOOL.Z=99.5",
    f"$TOOL={FRAME}", "$TOOL=$FLANGE", "BAS(#BASE,7)", "BAS(#TOOL,7)", "BAS(#EX_BASE,1)", "$IPO_MODE=#TCP",
    "$ORI_TYPE=#CONSTANT", "$ORI_TYPE=#JOINT", "$CIRC_TYPE=#PATH", "$APO.CDIS=77", "$APO={CDIS 77}", "$OV_PRO=37",
    "$OV_ROB=37", "$LOAD={M 33,CM {X 1,Y 2,Z 3,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}", "$LOAD.M=33", "$LOAD=LOAD_DATA[7]",
    "$ROBROOT={X 5,Y 0,Z 0,A 0,B 0,C 0}", "$ROBROOT.X=5", "$WORLD.X=5",
    "$LOAD_A3={M 33,CM {X 1,Y 2,Z 3,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}", "$LOAD_A3.M=33", "BAS(#INITMOV,0)",
    "FDAT_ACT={TOOL_NO 7,BASE_NO 7,IPO_FRAME #BASE}\nBAS(#FRAMES)",
    "FDAT_ACT={TOOL_NO 7,BASE_NO 7,IPO_FRAME #BASE}\nBAS(#CP_PARAMS,0.5)",
    "FDAT_ACT={TOOL_NO 7,BASE_NO 7,IPO_FRAME #BASE}\nBAS(#PTP_PARAMS,50)",
    "LDAT_ACT={VEL 0.0123,ACC 50,APO_DIST 77}\nBAS(#CP_DAT)", "BAS(#CP_PARAMS,0.0123)", "BAS(#UNHEARD_OF,1)",
    "$TECH[1].MODE=#CYCLE", "$TECH[1].CLASS=#DATALINK", "SET_TORQUE_LIMITS(1,{LOWER -10,UPPER 10})", "RSI_ON()",
    "RSI_MOVECORR()", "ST_ON(1,1)", "ST_MOVESENS(1)", "some_routine(1)", "RETURN", "PTP_REL {A1 5}", "LIN_REL {X 5}",
    "LIN_REL {X 5} #TOOL", "SLIN_REL {X 5}", "SPTP_REL {A1 5}", "SPTP {A1 5}", "SLIN {X 5}",
    "SCIRC {X 5,Y 9},{X 3,Y 2}", "LIN elsewhere", "PTP XHOME",
    "INTERRUPT DECL 21 WHEN $IN[9]==TRUE DO other_isr()\nINTERRUPT ON 21",
    "GLOBAL INTERRUPT DECL 21 WHEN $IN[9]==TRUE DO other_isr()\nINTERRUPT ON",
    "TRIGGER WHEN DISTANCE=0 DELAY=0 DO other_sub() PRIO=-1", "TRIGGER WHEN PATH=20 DELAY=0 DO other_sub() PRIO=81",
    "TRIGGER WHEN DISTANCE=1 DELAY=0 DO $VEL.CP=0.02", "TRIGGER WHEN PATH=0 ONSTART DELAY=0 DO $OV_PRO=20",
    "$ADVANCE=0", "SPLINE\nSPL {X 5}\nENDSPLINE",
    "SPLINE WITH $VEL.CP=0.2\nSLIN {X 5}\nCONST_VEL START=0 ONSTART\nSLIN {X 6}\nCONST_VEL END=0\nENDSPLINE",
    "$RED_VEL=20", "$OV_APPL=20", "$VEL_MA.CP=0.01", "$ERSYSROOT={X 5,Y 0,Z 0,A 0,B 0,C 0}", "$SINGUL_POS[1]=0",
    "$SINGUL_STRATEGY=1", "$RAT_MOT_AX[1]={N 1,D 2}", "$MAMES[1]=5", "$PAL_MODE=TRUE",
    "BASE_DATA[7].X=5\n$BASE=BASE_DATA[7]", "FOR $VEL.CP=1 TO 2\nENDFOR", "GOTO l7\nLIN {X 44}\nl7:",
    "GOTO l8\nl8:\nLIN {X 44}", "IF $IN[9]==TRUE THEN\n$VEL.CP=0.0123\nENDIF",
    "IF $IN[9] THEN\n$BASE=BASE_DATA[7]\nENDIF", "LOOP\nEXIT\nLIN {X 44}\nENDLOOP",
    "LOOP\n$VEL.CP=0.0123\nEXIT\nENDLOOP", "REPEAT\n$TOOL=TOOL_DATA[7]\nUNTIL $IN[9]",
    "WHILE $IN[9]\n$ORI_TYPE=#JOINT\nENDWHILE", "SWITCH $MODE_OP\nCASE #T1\n$OV_PRO=20\nENDSWITCH",
    "SWITCH $MODE_OP\nCASE #T1\n$VEL.CP=0.02\nENDSWITCH",
)  # fmt: skip
_IDLE = (
    "HALT", "WAIT SEC 0.5", "WAIT SEC $TIMER[2]", "WAIT FOR $IN[1]", "WAIT FOR NOT ($IN[1] AND $FLAG[2])",
    "$OUT[5]=TRUE", "$OUT_C[5]=TRUE", "PULSE($OUT[5],TRUE,0.2)", "CONTINUE", "$ANOUT[1]=0.5", "ANOUT OFF",
    "$TIMER[1]=0", "$TIMER_STOP[1]=FALSE", "$FLAG[3]=TRUE", "$CYCFLAG[1]=$IN[2] AND $IN[3]",
    "INTERRUPT OFF 21", "INTERRUPT DISABLE 21", "INTERRUPT OFF",
    ";FOLD a fold\nHALT\n;ENDFOLD", "$LOOP_MSG[]=\"x\"", "$LOOP_CONT=TRUE",
    "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $OUT[5]=TRUE", "TRIGGER WHEN PATH=-5 DELAY=10 DO PULSE($OUT[5],TRUE,0.2)",
    "BAS(#ACC_CP,50)", "BAS(#VEL_PTP,50)", "BAS(#ACC_PTP,50)", "$ACC.CP=1.5", "$ACC={CP 1.5,ORI1 100,ORI2 100}",
    "$ACC_AXIS[1]=50", "$VEL_AXIS[1]=50", "$VEL.ORI1=100", "$JERK.CP=50", "$GEAR_JERK[1]=50", "$ADVANCE=3",
    "$APO.CPTP=17", "PTP $AXIS_ACT", "$CP_VEL_TYPE=#VAR_ALL", "$SOFTN_END[1]=-10",
    "PDAT_ACT={VEL 50,ACC 50,APO_DIST 77}\nBAS(#PTP_DAT)", "$ADVANCE=1", "$H_POS=XHOME", "$CYCFLAG[4]=FALSE",
    "$SEN_PREA[1]=5", "$SEN_PINT[1]=5", "$CURR_RED[1,1]=50", "BASE_DATA[17].X=5", "TOOL_DATA[17].Z=5",
    "BASE_DATA[17]={X 1,Y 2,Z 3,A 0,B 0,C 0}", "LOAD_DATA[7].M=5", "FDAT_ACT={TOOL_NO 7,BASE_NO 7,IPO_FRAME #BASE}",
    "LDAT_ACT={VEL 0.0123,ACC 50,APO_DIST 77}", "PDAT_ACT={VEL 50,ACC 50,APO_DIST 77}",
    "SWRITE(text[],state,offs,\"%d\",n)", "MsgNotify(\"x\")", "XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}",
    "IF $IN[9]==TRUE THEN\n$OUT[5]=TRUE\nENDIF", "IF $MODE_OP==#T1 THEN\nHALT\nENDIF",
    "SWITCH $MODE_OP\nCASE #T1\n$OUT[5]=TRUE\nDEFAULT\n$OUT[5]=FALSE\nENDSWITCH", "LOOP\nEXIT\nENDLOOP",
    "REPEAT\nWAIT SEC 0.1\nUNTIL $IN[9]", "WHILE $IN[9]\nWAIT SEC 0.1\nENDWHILE", "GOTO l9\nHALT\nl9:",
    "IF $IN[9] THEN\nGOTO l9\nENDIF\nHALT\nl9:", "$IOSYS_IN_TRUE=TRUE", "$SPL_ORI_JOINT_AUTO=#ON",
    "$EX_AX_IGNORE='B000000'", "$ASYNC_AXIS='B0000'", "$TORQUE_AXIS_MAX_0[1]=5", "$MSG_T.KEY[]=\"x\"", "$APO.CVEL=33",
    "$APO.CORI=33", "$STOPNOAPROX=TRUE", "ERR_CLEAR(state)", "ON_ERROR_PROCEED", "SIGNAL_ONE=TRUE", "$PRO_IP.SNR=3",
    "$BRAKES_TEST=1", "VW(#VW_ROB,5)", "$TECHPAR[1,2]=5", "DIGIN OFF", "$DIGIN1CODE=#UNSIGNED",
)  # fmt: skip

_MOTION = re.compile(r"[ \t]*(?:LIN|PTP|CIRC|SLIN|SPTP|SCIRC)(?:_REL)?[ \t{$]", re.I)
_SPLINE = re.compile(r"[ \t]*(?:PTP_)?SPLINE\b", re.I)
_ENDED = re.compile(r"[ \t]*ENDSPLINE\b", re.I)
_INLINE = re.compile(r"[ \t]*(?:[FLP]DAT_ACT|BAS[ \t]*\(|;[ \t]*FOLD)", re.I)


def places(text: str) -> list[int]:
    """Before motions, outside of splines and inline forms."""
    out, spline = [], False
    lines = text.split("\n")
    for at, line in enumerate(lines):
        spline = (spline or bool(_SPLINE.match(line))) and not _ENDED.match(line)
        inline = at and _INLINE.match(lines[at - 1])
        if _MOTION.match(line) and not spline and not inline:
            out.append(at)
    return out


def insert(text: str, at: int, lines: list[str]) -> str:
    own = text.split("\n")
    end = "\r" if own[0].endswith("\r") else ""
    return "\n".join([*own[:at], *(line + end for line in lines), *own[at:]])


def probe(option: str) -> list[str]:
    """Path motions that approximate, one that turns the tool, an arc, and a point-to-point motion."""
    return [
        "LIN {X 210.5,Y 20,Z 30,A 40,B 50,C 60} C_DIS",
        "LIN {X 230.5,Y 25,Z 35,A 70,B 20,C 65} C_DIS",
        "CIRC {X 240.5,Y 40,Z 30},{X 210.5,Y 45,Z 30,A 40,B 50,C 60}",
        "PTP {X 220.5,Y 20,Z 30,A 40,B 50,C 60,S 2,T 3} C_PTP",
        "LIN {X 210.5,Y 20,Z 30,A 40,B 50,C 60}",
    ]


def read(text: str) -> Program:
    document = Document(Path("part.src"), text.encode("latin-1"))
    return DIALECTS["krl"].read((document,), ReadingSettings())


KRL = Language(
    "krl",
    (*(Statement(text, ACTS) for text in _ACTS), *(Statement(text, IDLE) for text in _IDLE)),
    places,
    insert,
    probe,
    ("BAS(#BASE,1)", "BAS(#TOOL,1)", "$VEL.CP=0.1", "$APO.CDIS=3", "$ORI_TYPE=#VAR", "$CIRC_TYPE=#BASE"),
    ";",
    read,
)
