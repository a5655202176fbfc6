/PROG  ROBOGUIDE_TAUGHT
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "Left side";
PROG_SIZE	= 1234;
CREATE		= DATE 24-03-11  TIME 09:12:44;
MODIFIED	= DATE 24-03-12  TIME 16:01:02;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 30;
MEMORY_SIZE	= 2345;
PROTECT		= READ_WRITE;
TCD:  STACK_SIZE	= 0,
      TASK_PRIORITY	= 50,
      TIME_SLICE	= 0,
      BUSY_LAMP_OFF	= 0,
      ABORT_REQUEST	= 0,
      PAUSE_REQUEST	= 0;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  !************  ;
   2:  !Weld left side  ;
   3:  !************  ;
   4:  UFRAME_NUM=1 ;
   5:  UTOOL_NUM=1 ;
   6:  PAYLOAD[1] ;
   7:  OVERRIDE=100% ;
   8:  DO[1:Spindle]=OFF ;
   9:  $WAITTMOUT=200 ;
  10:J P[1:Home] 100% FINE     ;
  11:  WAIT DI[3:Clamp]=ON TIMEOUT,LBL[99] ;
  12:L P[2] 500mm/sec CNT50 ACC80     ;
  13:L P[3] 60mm/sec FINE     ;
  14:  RO[1]=ON ;
  15:  WAIT    .50(sec) ;
  16:L P[4] 60mm/sec CNT100     ;
  17:C P[5]    
    :  P[6] 60mm/sec CNT100     ;
  18:  F[3]=(ON) ;
  19:  R[5:count]=R[5:count]+1 ;
  20:  IF R[5:count]>=10,JMP LBL[10] ;
  21:L P[2] 500mm/sec FINE     ;
  22:  JMP LBL[11] ;
  23:  LBL[10:done] ;
  24:  CALL UNLOAD ;
  25:  LBL[11] ;
  26:J P[1:Home] 100% FINE     ;
  27:  END ;
  28:  LBL[99] ;
  29:  UALM[1] ;
  30:  ABORT ;
/POS
P[1]{
   GP1:
	UF : 1, UT : 1,	
	J1=     0.000 deg,	J2=     0.000 deg,	J3=     0.000 deg,
	J4=     0.000 deg,	J5=   -90.000 deg,	J6=     0.000 deg
};
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   100.000  mm,	Y =     0.000  mm,	Z =    50.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   100.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   150.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[5]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   160.000  mm,	Y =    10.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   150.000  mm,	Y =    20.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
