MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
PROC main()
CirPathMode\ObjectFrame;
MoveL [[0,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
MoveC [[10,10,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[20,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t\WObj:=w;
CirPathMode\PathFrame;
MoveC [[30,10,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[40,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t\WObj:=w;
CirPathMode\CirPointOri;
MoveC [[50,10,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[60,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t\WObj:=w;
ENDPROC
ENDMODULE
