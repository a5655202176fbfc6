MODULE CalibData
    PERS tooldata Spindle:=[TRUE,[[0,0,300],[1,0,0,0]],[15,[0,0,120],[1,0,0,0],0,0,0]];
    TASK PERS wobjdata Wobj_Block:=[FALSE,TRUE,"",[[1200,-300,500],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
ENDMODULE
MODULE Paths
    CONST robtarget p_1:=[[0,0,0],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget p_2:=[[50,0,0],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    PROC Path_1()
        MoveL p_1,v50,z1,Spindle\WObj:=Wobj_Block;
        MoveL p_2,v50,z1,Spindle\WObj:=Wobj_Block;
    ENDPROC
ENDMODULE
MODULE Main_Module
    PROC main()
        Path_1;
    ENDPROC
ENDMODULE
