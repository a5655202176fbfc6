MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
RECORD cut
robtarget at;
speeddata fast;
ENDRECORD
VAR cut c:=[[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[70,500,5000,1000]];
PROC main()
c.at.trans.x:=5;
MoveL c.at,v100,z10,t\WObj:=w;
MoveL c.at,c.fast,z10,t\WObj:=w;
ENDPROC
ENDMODULE
