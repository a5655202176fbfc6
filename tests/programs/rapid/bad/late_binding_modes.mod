! RAP006 RAP010
MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
PROC main()
MoveL [[1,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;
%"load_"+"it"%;
MoveL [[2,0,0],[0,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;
ENDPROC
PROC load_it()
! FORCE 1 2 3
ENDPROC
ENDMODULE
