! RAP009
MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
VAR num x;
PROC main()
MoveL [[1,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
x:=f();
ENDPROC
FUNC num f()
MoveL [[2,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
RETURN 1;
ENDFUNC
ENDMODULE
