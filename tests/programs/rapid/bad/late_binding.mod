! RAP002 RAP010
MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
VAR num n:=1;
PROC main()
MoveL [[1,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;
%"shift_"+"it"% 5;
MoveL [[n,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;
MoveL [[2,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;
ENDPROC
PROC shift_it(num a)
n:=a;
ENDPROC
ENDMODULE
