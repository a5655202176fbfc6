from postproc.compensation import codes as codes
