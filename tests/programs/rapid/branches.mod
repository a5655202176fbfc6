MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
VAR num a;
PROC main()
IF di1=1 THEN
MoveL [[1,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
a:=1;
ELSEIF di2=1 THEN
MoveL [[2,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
a:=1;
ELSE
a:=1;
ENDIF
MoveL [[a,0,5],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
IF a=1 MoveL [[3,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
IF a=2 THEN
MoveL [[4,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
ENDIF
MoveL [[5,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
ENDPROC
ENDMODULE
