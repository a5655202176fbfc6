MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
TASK PERS wobjdata w:=[FALSE,TRUE,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
VAR num n:=1;
VAR num m:=1;
VAR num k:=4;
PROC main()
cut 5,n\fast;
cut 6,m;
MoveL [[n,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
MoveL [[k,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
ENDPROC
PROC cut(num h,INOUT num o\switch fast)
o:=o+h;
MoveL [[1,2,h],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
MoveL [[9,9,9],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t\WObj:=w;
ENDPROC
ENDMODULE
