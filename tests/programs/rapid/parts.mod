MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
CONST num x:=1.5;
CONST confdata conf:=[-1,0,-2,1];
CONST extjoint ext:=[9E9,9E9,9E9,9E9,9E9,9E9];
CONST pos pos1:=[4,5,6];
CONST orient rot1:=[0.7071068,0,0.7071068,0];
PROC main()
MoveL [[x,2,3],[0,0,1,0],conf,ext],v100,z1,t\WObj:=w;
MoveL [pos1,rot1,conf,ext],v100,z1,t\WObj:=w;
ENDPROC
ENDMODULE
