MODULE part
PERS tooldata t:=[TRUE,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
VAR robtarget p:=[[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
VAR intnum iStop;
VAR num n:=1;
PROC main()
CONNECT iStop WITH onStop;
p.robconf:=[0,0,0,1];
p.extax:=[9E9,9E9,9E9,9E9,9E9,9E9];
p.trans:=[10,20,30];
p.rot:=OrientZYX(90,0,180);
MoveL p,v50,z1,t;
p.rot:=NOrient([0,1.01,0,0]);
p.trans.z:=n;
MoveL p,v50,z1,t;
p:=CRobT();
ENDPROC
TRAP onStop
Stop;
ENDTRAP
ENDMODULE
