MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
CONST robtarget p10:=[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
CONST num h:=2.5*2;
PROC main()
MoveL Offs(p10,1,-2,h),v100,z10,t\WObj:=w;
MoveL RelTool(p10,0,0,-10),v100,z10,t\WObj:=w;
MoveL RelTool(p10,1,2,3\Rx:=10\Ry:=20\Rz:=30),v100,z10,t\WObj:=w;
MoveL Offs(Offs(p10,1,0,0),0,1,0),v100,z10,t\WObj:=w;
ENDPROC
ENDMODULE
