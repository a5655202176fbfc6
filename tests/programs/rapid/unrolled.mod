MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
CONST robtarget p:=[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
VAR num n;
PROC main()
VAR num k:=0;
! after a loop of constants its variables are constants
n:=0;
FOR i FROM 1 TO 3 DO
n:=n+i;
IF i=2 MoveL [[i,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t;
IF i=4 MoveL [[4,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t;
MoveL Offs(p,0,0,i),v100,z10,t;
ENDFOR
MoveL Offs(p,0,0,n),v100,z10,t;
! the bounds of a loop are computed once
n:=2;
FOR i FROM n TO 1 DO
n:=n+1;
ENDFOR
MoveL Offs(p,0,0,n),v100,z10,t;
WHILE k<5 DO
FOR i FROM 1 TO 2 DO
k:=k+1;
ENDFOR
ENDWHILE
MoveL Offs(p,0,0,k),v100,z10,t;
! what rounding does is not known
FOR i FROM 0 TO 1 STEP 0.1 DO
k:=k+1;
ENDFOR
MoveL Offs(p,0,0,k),v100,z10,t;
! a loop in one that is not known
WHILE di1=1 DO
k:=0;
FOR i FROM 1 TO 3 DO
k:=k+i;
ENDFOR
MoveL Offs(p,0,0,k),v100,z10,t;
ENDWHILE
WHILE TRUE DO
MoveL p,v100,z10,t;
ENDWHILE
MoveL [[5,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,z10,t;
ENDPROC
ENDMODULE
