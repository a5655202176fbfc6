MODULE CellWork
  VAR num nParts:=0;
  VAR bool bOk:=FALSE;
  PERS num nCount{3}:=[0,0,0];
  VAR intnum irStop;
  CONST speeddata vApproach:=[200,500,5000,1000];
  CONST zonedata zPath:=[FALSE,2,3,3,0.3,3,0.3];
  PERS tooldata tGrip:=[TRUE,[[0,0,180],[1,0,0,0]],[8,[0,0,90],[1,0,0,0],0.1,0.1,0.1]];
  PERS loaddata ldPart:=[4,[0,0,150],[1,0,0,0],0,0,0];
  CONST robtarget pPick:=[[600,0,100],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pPlace:=[[0,700,100],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  CONST robtarget pHome:=[[500,0,600],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
  PROC main()
    rInit;
    WHILE TRUE DO
      IF diStart=1 AND nParts<10 THEN
        rPick;
        rPlace;
        Incr nParts;
        nCount{1}:=nCount{1}+1;
      ELSEIF diStop=1 THEN
        MoveJ pHome,v1000,fine,tGrip;
        EXIT;
      ELSE
        WaitTime 0.1;
      ENDIF
    ENDWHILE
  ERROR
    IF ERRNO=ERR_WAIT_MAXTIME THEN
      TPWrite "Timeout";
      RETRY;
    ENDIF
  ENDPROC
  PROC rInit()
    CONNECT irStop WITH trStop;
    ISignalDI diEmergency,1,irStop;
    VelSet 100,5000;
    AccSet 100,100;
    GripLoad load0;
    Reset doGrip;
    MoveJ pHome,v1000,fine,tGrip;
  ENDPROC
  PROC rPick()
    MoveJ Offs(pPick,0,0,100),v1000,z50,tGrip;
    MoveL pPick,vApproach,fine,tGrip;
    Set doGrip;
    WaitUntil diGripped=1\MaxTime:=2\TimeFlag:=bOk;
    GripLoad ldPart;
    MoveL Offs(pPick,0,0,100),vApproach,zPath,tGrip;
  ENDPROC
  PROC rPlace()
    MoveJ Offs(pPlace,0,0,100),v1000,z50,tGrip;
    MoveL pPlace,vApproach,fine,tGrip;
    PulseDO\PLength:=0.2,doRelease;
    WaitTime\InPos,0.3;
    GripLoad load0;
    MoveL Offs(pPlace,0,0,100),vApproach,zPath,tGrip;
  ENDPROC
  TRAP trStop
    StopMove;
    TPWrite "Stopped";
    ExitCycle;
  ENDTRAP
ENDMODULE
