"""RAPID: settings of motion, displacements, loads, interrupts, path handling, options of motions.

Statements that set a mode to what it is at the start of a program are in neither list: in a subprogram that is called
before and after one, the reader does not know whether the mode is set.
"""

from __future__ import annotations

import re
from pathlib import Path

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.dialect import Program

from .scan import ACTS, IDLE, Language, Statement

DECLARED = (
    "PERS tooldata t71:=[TRUE,[[1,0,220],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];",
    "PERS tooldata t72:=[TRUE,[[2,0,240],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];",
    'PERS wobjdata w71:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];',
    "PERS loaddata ld71:=[7,[1,2,3],[1,0,0,0],0,0,0];",
    "VAR robtarget q71:=[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];",
    "CONST jointtarget j71:=[[1,2,3,4,5,6],[9E9,9E9,9E9,9E9,9E9,9E9]];",
    "VAR intnum int71;",
    "VAR triggdata tr71;",
    "VAR num n71;",
    "VAR clock c71;",
    "VAR pose d71:=[[5,6,7],[1,0,0,0]];",
)
TARGET = "[[{}],[{}],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
A = TARGET.format("410,2,3", "0,0,1,0")
B = TARGET.format("420,5,3", "0.5,0.5,-0.5,0.5")
C = TARGET.format("430,1,9", "0,0,1,0")
TRAP = "TRAP trap71\nMoveL " + A + ",v50,fine,t72;\nENDTRAP"
_ACTS = (
    "ConfL\\Off;", "ConfJ\\Off;", "EXIT;", "StepBwdPath 30,1;", "SetSysData ld71;", "VelSet 37,5000;",
    "VelSet 100,12;", "SingArea\\Wrist;", "CirPathMode\\ObjectFrame;", "PDispSet [[10,0,0],[1,0,0,0]];",
    "PDispSet d71;", "PDispOn\\ExeP:=q71,q71,t71;", "PDispOn q71,t71;", "SoftAct 1,50;",
    "SoftAct\\MechUnit:=ROB_1,1,50;", "GripLoad ld71;", "SpeedRefresh 37;", "t71.tframe.trans.z:=99;", "t71:=t72;",
    "t71.tload:=ld71;", "w71.oframe.trans.x:=99;", "w71.uframe:=d71;",
    "SetAllDataVal \"tooldata\"\\Object:=\"t71\",t72;", "SetDataVal \"t71\",t72;", "CorrCon id71;",
    "EGMActPose id71;", "SyncMoveOn s71,tasks71;", "unheard_of 1;", "%\"unheard\"%;", "CallByVar \"unheard\",1;",
    f"MoveL {C},v50,z1,t71;", f"MoveJ {C},v50,z1,t72;", "MoveAbsJ j71,v50,fine,t71;", f"SearchL di1,q71,{C},v50,t71;",
    f"SearchC di1,q71,{A},{C},v50,t71;", f"TriggL {C},v50,tr71,z1,t71;", f"TriggC {A},{C},v50,tr71,z1,t71;",
    f"TriggJ {C},v50,tr71,z1,t71;", f"MoveLSync {C},v50,z1,t71,\"unheard\";", f"MoveLDO {C},v50,z1,t71,do1,1;",
    f"MoveCDO {A},{C},v50,z1,t71,do1,1;", "MoveExtJ j71,vrot10,fine;", "RETURN;", "ExitCycle;",
    "IF di1=1 VelSet 37,5000;", "IF di1=1 PDispSet d71;", "IF di1=1 THEN\nGripLoad ld71;\nENDIF",
    "WHILE di1=1 DO\nSoftAct 1,50;\nENDWHILE", "TEST di1\nCASE 1:\nSingArea\\Wrist;\nENDTEST",
    "CSSAct\\RefFrame:=CSS_REFFRAME_TOOL,CSS_X\\Stiffness:=30;", "FCAct t71;", "CapL 1;", "ArcLStart 1;",
    "IndRMove M7DM1,1;", "EOffsSet [50,0,0,0,0,0];", "EOffsOn q71;", "DropWObj w71;", "WaitWObj w71;",
    "MotionProcessModeSet LOW_SPEED_STIFF_MODE;", "SpeedLimAxis ROB_1,1,10;", "SpeedLimCheckPoint 12;",
    "CONNECT int71 WITH trap71;\nISignalDI di1,1,int71;", "RestoPath;", "ClearPath;", "PathRecMoveBwd;",
    "LoadId MASS_KNOWN,ld71;", "MToolRotCalib q71,q71,t71;", "SetLeadThrough\\On;",
)  # fmt: skip
_IDLE = (
    "ActUnit STN71;", "PathAccLim TRUE\\AccMax:=1,FALSE;", "WorldAccLim\\On:=0.5;", "TuneServo ROB_1,1,50;",
    "AccSet 20,20;", "SetSysData t72;", "PDispOff;", "EOffsOff;", "SoftDeact;", "GripLoad load0;", "MotionSup\\Off;",
    "MotionSup\\On\\TuneValue:=200;", "AccSet 100,100;", "PathAccLim FALSE,FALSE;", "WorldAccLim\\Off;",
    "PathResol 100;", "TuneReset;", "Stop;", "Stop\\NoRegain;", "Break;", "StopMove;\nStartMove;",
    "StorePath;\nRestoPath;", "WaitTime 0.5;", "WaitTime\\InPos,0;", "WaitRob\\InPos;", "WaitDI di1,1;",
    "WaitUntil di1=1 AND n71>2;", "SetDO do1,1;", "SetDO\\SDelay:=0.2,do1,1;", "PulseDO do1;", "Set do1;",
    "Reset do1;", "SetAO ao1,5;", "SetGO go1,5;", "InvertDO do1;", "TPWrite \"x; y\";", "TPErase;",
    "TPReadNum n71,\"x\";", "ClkReset c71;", "ClkStart c71;", "ClkStop c71;", "IDelete int71;", "IDisable;",
    "IEnable;", "ISleep int71;", "IWatch int71;", "TriggIO tr71,5\\DOp:=do1,1;", "TriggEquip tr71,5,0.1\\DOp:=do1,1;",
    "TriggInt tr71,5,int71;", "Incr n71;", "Decr n71;", "Add n71,2;", "Clear n71;", "n71:=n71+1;",
    "q71:=CRobT(\\Tool:=t71);", "q71.trans.z:=7;", "d71.trans:=[1,2,3];", "Open \"HOME:\"\\File:=\"x\",f71;",
    "Write f71,\"x\";", "Close f71;", "ErrWrite \"a\",\"b\";", "UIMsgBox \"x\";", "WaitSyncTask s71,tasks71;",
    "SpyStart \"x\";", "SpyStop;", "PathLengthReset;", "PathLengthStart;", "IF di1=1 THEN\nSetDO do1,1;\nENDIF",
    "IF di1=1 Stop;", "WHILE di1=0 DO\nWaitTime 0.1;\nENDWHILE", "FOR i FROM 1 TO 3 DO\nPulseDO do1;\nENDFOR",
    "TEST n71\nCASE 1:\nSet do1;\nDEFAULT:\nReset do1;\nENDTEST", "label71:", "WZDisable wz71;", "ActEventBuffer;",
    "DeactEventBuffer;", "ProcerrRecovery\\SyncOrgMoveInst;", "WaitLoad\\UnloadPath:=\"a\",l71;",
    "UnLoad \"HOME:/x.mod\";", "RemoveDir \"x\";", "SkipWarn;", "BookErrNo n71;", "GetSysData t72;",
    "GetDataVal \"n71\",n71;", "MotionProcessModeSet OPTIMAL_CYCLE_TIME_MODE;", "DeactUnit STN71;",
    "SenDevice \"x\";", "SocketSend s71\\Str:=\"x\";", "RMQSendWait s71,n71,n71,n71;",
    "SaveCfgData \"x\"\\File:=\"y\",1;", "IPers n71,int71;", "ReadAnyBin f71,n71;", "TextTabInstall \"x\";",
    "CopyFile \"a\",\"b\";", "WriteCfgData \"/EIO/x\",\"y\",1;", "PackRawBytes n71,r71,1\\Hex1;", "WarmStart;",
    "ClearRawBytes r71;", "ExitCycle71:",
)  # fmt: skip
_ACTING_OPTIONS = (
    "\\TLoad:=ld71", "\\Corr", "\\V:=37", "\\T:=2", "\\Z:=7", "\\WObj:=w71", "\\ID:=10",
)  # fmt: skip
_IDLE_OPTIONS = (
    "\\Conc", "\\Inpos:=inpos50",
)  # fmt: skip

_MOTION = re.compile(r"[ \t]*Move[LJC]\b", re.I)


def places(text: str) -> list[int]:
    return [at for at, line in enumerate(text.split("\n")) if _MOTION.match(line)]


def insert(text: str, at: int, lines: list[str]) -> str:
    """And what the statements refer to, at the start of the module of that line."""
    own = text.split("\n")
    module = max(k for k in range(at) if re.match(r"[ \t]*MODULE\b", own[k], re.I))
    end = max(
        k
        for k in range(at)
        if re.match(r"[ \t]*(?:LOCAL )?PROC\b|[ \t]*TRAP\b|[ \t]*(?:LOCAL )?FUNC\b", own[k], re.I)
    )
    named = TRAP.split("\n") if any("trap71" in line for line in lines) else []
    return "\n".join(
        [*own[: module + 1], *DECLARED, *own[module + 1 : end], *named, *own[end:at], *lines, *own[at:]]
    )


def probe(option: str) -> list[str]:
    before, v, z, after = "", "", "", ""
    if option.startswith("\\Conc"):
        before = option + ","
    elif option.startswith(("\\V", "\\T:", "\\ID")):
        v = option
    elif option.startswith(("\\Z", "\\Inpos")):
        z = option
    else:
        after = option
    return [
        f"MoveL {before}{A},v50{v},z10{z},t71{after};".replace("MoveL \\", "MoveL\\"),
        f"MoveL {B},v50,fine,t71;",
        f"MoveC {C},{A},v50,fine,t71\\WObj:=w71;",
        f"MoveJ {B},v50,z10,t71;",
    ]


def read(text: str) -> Program:
    return DIALECTS["rapid"].read((Document(Path("part.mod"), text.encode("latin-1")),))


RAPID = Language(
    "rapid",
    (
        *(Statement(text, ACTS) for text in _ACTS),
        *(Statement(text, IDLE) for text in _IDLE),
        *(Statement(text, ACTS, True) for text in _ACTING_OPTIONS),
        *(Statement(text, IDLE, True) for text in _IDLE_OPTIONS),
    ),
    places,
    insert,
    probe,
    (),
    "! nothing",
    read,
)
