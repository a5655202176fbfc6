MODULE Module1
    CONST robtarget Target_10:=[[100,50,20],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget Target_20:=[[110,50,20],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget Target_30:=[[120.5,60.25,20],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST robtarget Target_40:=[[130,50,20],[0,0.707106781,0.707106781,0],[0,0,0,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]];
    CONST jointtarget jHome:=[[0,0,0,0,30,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
    TASK PERS tooldata MillTool:=[TRUE,[[31.792631019,0,229.638935148],[0.945518576,0,0.325568154,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
    TASK PERS wobjdata Workobject_1:=[FALSE,TRUE,"",[[800,-200,400],[1,0,0,0]],[[10,0,0],[1,0,0,0]]];

!***********************************************************
    !
    ! Module:  Module1
    !
    ! Description:
    !   <Insert description here>
    !
    !***********************************************************

    !***********************************************************
    !
    ! Procedure main
    !
    !   This is the entry point of your program
    !
    !***********************************************************
    PROC main()
        !Add your code here
        MoveAbsJ jHome\NoEOffs,v1000,z50,MillTool\WObj:=wobj0;
        Path_10;
        MoveAbsJ jHome\NoEOffs,v1000,fine,MillTool\WObj:=wobj0;
    ENDPROC
    PROC Path_10()
        ActUnit STN1;
        MoveJ Offs(Target_10,0,0,50),v1000,z100,MillTool\WObj:=Workobject_1;
        MoveL Target_10,v100,fine,MillTool\WObj:=Workobject_1;
        MoveL Target_20,v100,z1,MillTool\WObj:=Workobject_1;
        MoveC Target_30,Target_40,v100,z1,MillTool\WObj:=Workobject_1;
        MoveL RelTool(Target_40,0,0,-50),v1000,z100,MillTool\WObj:=Workobject_1;
    ENDPROC
ENDMODULE
