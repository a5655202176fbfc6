"""Fanuc TP: frames, payload, overrides, conditions, system variables, options of motions."""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program

from .scan import ACTS, IDLE, Language, Statement

_ACTS = (
    "PAYLOAD[2]\nPAYLOAD[3]", "PAYLOAD[GP1:2]\nPAYLOAD[GP1:3]", "UFRAME_NUM=2", "UTOOL_NUM=2", "UFRAME_NUM=R[9]",
    "UTOOL_NUM=AR[1]", "UFRAME[1]=PR[5]", "UTOOL[1]=PR[5]", "UFRAME[R[9]]=PR[5]", "PAYLOAD[R[9]]", "OVERRIDE=37%",
    "OVERRIDE=R[9]", "$MCR.$GENOVERRIDE=37", "$MCR.$GENOVERRIDE=R[9]", "$MNUFRAMENUM[1]=2", "$MNUTOOLNUM[1]=2",
    "$MNUFRAME[1,1]=PR[5]", "$MNUTOOL[1,1]=PR[5]", "$MCR_GRP[1].$PRGOVERRIDE=30", "$PARAM_GROUP[1].$PAYLOAD=5",
    "$PARAM_GROUP[1].$JNTVELLIM[1]=5", "$GROUP[1].$UFRAME=PR[5]", "$CPCFG.$CP_ENABLE=FALSE", "$UNHEARD.$OF=3",
    "JMP LBL[988]", "VISION GET_OFFSET 'X' VR[1] JMP,LBL[982]\nUFRAME_NUM=2\nLBL[982]",
    "VISION GET_PASSFAIL 'X' R[1]", "CALL UNHEARD", "CALL UNHEARD(1,2)", "P[81]=PR[5]", "P[82]=P[81]", "P[81]=LPOS",
    "LINEAR_MAX_SPEED=12", "LINEAR_MAX_SPEED=R[9]", "TORQ_LIMIT 50.0%", "SOFTFLOAT[1]", "Weave Sine[1]",
    "Weave Circle[1]", "Track TAST[1]", "Track Sensor[1]", "TOUCH OFFSET PR[1]", "Touch Offset PR[1]", "LINE[1] ON",
    "FOLLOW UP", "END", "ABORT", "IF DI[1]=ON,CALL UNHEARD", "IF DI[1]=ON,JMP LBL[988]",
    "IF (DI[1]=ON),UFRAME_NUM=(2)", "IF (DI[1]=ON) THEN\nOVERRIDE=37%\nENDIF",
    "IF (DI[1]=ON) THEN\nUTOOL_NUM=2\nENDIF", "SELECT R[9]=1,CALL UNHEARD\n       ELSE,CALL UNHEARD2",
    "FOR R[9]=1 TO 2\nUFRAME_NUM=2\nENDFOR", "RUN UNHEARD", "L P[83] 50mm/sec FINE", "J P[83] 50% FINE",
    "L PR[5] 50mm/sec FINE", "A P[83] 50mm/sec FINE", "SPLINE_START", "S P[83] 50mm/sec FINE",
    "VISION OVERRIDE 'X' R[9]", "SENSOR_ON", "RCAL", "ACC50", "ERROR_PROG=UNHEARD", "MONITOR UNHEARD",
    "FORCE CTRL[1]", "CONSTANT PATH", "STOP_TRACKING", "DEFENCEPOS ON[1]", "JOINT_MAX_SPEED[1]=12",
    "LOAD_CORRECTION[1]", "PAYLOAD_CHECK", "COORD_SYS=2", "GO_HOME",
)  # fmt: skip
_IDLE = (
    "Arc Start[1]", "UALM[1]", "VISION SET_REFERENCE 'X'", "OFFSET CONDITION PR[1]", "TOOL_OFFSET CONDITION PR[2]",
    "SKIP CONDITION DI[1]=ON", "VOFFSET CONDITION VR[1]", "COL DETECT OFF", "COL DETECT ON", "COL GUARD ADJUST 50",
    "COL GUARD ADJUST R[9]", "$WAITTMOUT=200", "WAIT .50(sec)", "WAIT DI[1]=ON",
    "WAIT DI[1]=ON TIMEOUT,LBL[989]\nLBL[989]", "WAIT R[9]", "WAIT (DI[1] AND DI[2])", "PR[5]=LPOS", "PR[5]=JPOS",
    "PR[5,1]=33", "PR[5]=P[81]", "LOCK PREG", "UNLOCK PREG", "TIMER[1]=START", "TIMER[1]=RESET", "TIMER[R[9]]=STOP",
    "DO[1]=ON", "DO[1]=PULSE,0.5sec", "DO[R[9]]=OFF", "RO[1]=ON", "GO[1]=5", "AO[1]=5", "F[1]=ON",
    "F[1]=(DI[1] AND DI[2])", "MESSAGE[a message]", "PAUSE", "R[9]=R[9]+1", "R[9]=DI[1]", "R[9]=(R[9]+1)",
    "SR[1]=SR[2]", "R[9]=STRLEN SR[1]", "LBL[987]", "LBL[987:a name]", "! a remark", "//a remark", "--eg:a remark",
    "IF DI[1]=ON,R[9]=3", "IF (DI[1]=ON),DO[1]=(ON)", "IF (DI[1]=ON) THEN\nDO[1]=ON\nELSE\nDO[1]=OFF\nENDIF",
    "IF R[9]=1,JMP LBL[986]\nDO[1]=ON\nLBL[986]", "FOR R[9]=1 TO 2\nDO[1]=PULSE,0.5sec\nENDFOR",
    "SELECT R[9]=1,JMP LBL[985]\n       =2,JMP LBL[985]\n       ELSE,JMP LBL[985]\nLBL[985]", "VISION RUN_FIND 'X'",
    "VISION GET_OFFSET 'X' VR[1] JMP,LBL[984]\nLBL[984]", "DIAG_REC[1,2]", "TC_ONLINE ON", "TC_ONLINE OFF",
    "TC_ONLINE", "SOFTFLOAT END", "TOUCH OFFSET END", "Weave End", "RSR[1]=ENABLE", "MONITOR END X", "UO[1]=ON",
    "WO[1]=ON", "TOOL_OFFSET CONDITION PR[R[9]]", "OFFSET CONDITION PR[1],UFRAME[1]", "SO[1]=ON", "", "Weave End[1]",
    "Track End", "Arc End[1]", "PR[5]=PR[6]", "PR[5]=UFRAME[1]", "PR[5]=UTOOL[1]", "R[9]=$MCR.$GENOVERRIDE",
    "R[9]=TIMER[1]",
)  # fmt: skip
_ACTING_OPTIONS = (
    "Offset,PR[1]", "Offset", "Tool_Offset,PR[1]", "Tool_Offset", "INC", "Wjnt", "COORD", "RTCP", "Skip,LBL[983]",
    "Skip,LBL[983],PR[1]=LPOS", "VOFFSET,VR[1]", "PSPD50", "MROT", "TB .10sec,CALL UNHEARD", "TA .10sec,CALL UNHEARD",
    "DB 5.0mm,CALL UNHEARD", "CNT50", "TB .1sec,POINT_LOGIC", "RT_LD1.0", "AP_LD5", "Search[X]", "COORD[R[9]]",
    "COORD[2]", "TRACK", "Offset,PR[R[9]]", "LOCK", "UNHEARD3", "Touch[1]", "ARC_VIA", "Spline", "CTV10",
    "TIMEBEFORE .1sec,CALL UNHEARD", "RTCP Wjnt",
)  # fmt: skip
_IDLE_OPTIONS = (
    "ACC50", "ACC100", "ACC R[9]", "PTH", "TA .10sec,DO[1]=ON", "TB .10sec,DO[1]=ON", "DB 5.0mm,DO[1]=ON",
    "DB -5.0mm,DO[1]=PULSE,0.1sec", "BREAK", "TB .10sec,AO[1]=5", "TA .00sec,GO[1]=3", "TB .1sec,RO[1]=ON",
)  # fmt: skip
_LINE = re.compile(r"[ \t]*(\d+)(:.*)")
_MOTION = re.compile(r"[ \t]*\d+:[ \t]*[LCJ] ?P")


def places(text: str) -> list[int]:
    """Before motions, and before the end of the program."""
    lines = text.split("\n")
    return [at for at, line in enumerate(lines) if _MOTION.match(line) or line.startswith("/POS")]


def insert(text: str, at: int, lines: list[str]) -> str:
    """Numbered anew, with points of the probes."""
    own = text.split("\n")
    new = [line if line.startswith("    :") else f"   1:  {line} ;" for line in lines]
    new = [_ended(line, new[k + 1 : k + 2]) for k, line in enumerate(new)]
    number, out = 0, []
    for line in [*own[:at], *new, *own[at:]]:
        found = _LINE.match(line)
        if found:
            number += 1
            line = f"{number:4d}{found[2]}"
        out.append(line)
        if line.startswith("/POS"):
            out += "".join(map(_point, range(81, 86))).split("\n")[:-1]
    return "\n".join(out)


def _ended(line: str, following: list[str]) -> str:
    return line[:-2] if following and following[0].startswith("    :") else line


def _point(n: int) -> str:
    place = ",\t".join(f"{word} = {200 + 10 * n + 30 * n * (word == 'Y') % 7:.3f}  mm" for word in "XYZ")
    turn = ",\t".join(f"{word} = {value:.3f} deg" for word, value in zip("WPR", (180, 0, n), strict=True))
    return f"P[{n}]{{\n   GP1:\n\tUF : 1, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n\t{place},\n\t{turn}\n}};\n"


def probe(option: str) -> list[str]:
    return [
        f"L P[81] 50mm/sec FINE    {option}".rstrip(),
        "L P[82] 50mm/sec CNT50",
        "L P[84] 50mm/sec FINE",
    ]


def read(text: str) -> Program:
    return DIALECTS["tp"].read((Document(Path("part.ls"), text.encode("latin-1")),))


TP = Language(
    "tp",
    (
        *(Statement(text, ACTS) for text in _ACTS),
        *(Statement(text, IDLE) for text in _IDLE),
        *(Statement(text, ACTS, True) for text in _ACTING_OPTIONS),
        *(Statement(text, IDLE, True) for text in _IDLE_OPTIONS),
    ),
    places,
    insert,
    probe,
    ("UFRAME_NUM=1", "UTOOL_NUM=1"),
    "!nothing",
    read,
)
