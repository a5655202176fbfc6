from postproc.robot import codes as codes
