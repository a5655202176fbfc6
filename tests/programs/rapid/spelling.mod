module part
pers tooldata t:=[true,[[0,0,200],[1,0,0,0]],[5,[0,0,80],[1,0,0,0],0,0,0]];
task pers wobjdata w:=[false,true,"",[[1000,0,500],[1,0,0,0]],[[0,10,20],[1,0,0,0]]];
proc main()
mOVEl [[1,2,3],[0,0,1,0],[0,0,0,0],[9e9,9e9,9e9,9e9,9e9,9e9]],v100,z10,t\wobj:=w;
mOVEl [[4,5,6],[0,0,1,0],[0,0,0,0],[9e9,9e9,9e9,9e9,9e9,9e9]],v100,z10,t\wobj:=w;
endproc
endmodule
