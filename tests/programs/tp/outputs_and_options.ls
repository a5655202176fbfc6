/PROG  IO_RICH
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "";
PROG_SIZE	= 1234;
CREATE		= DATE 24-03-11  TIME 09:12:44;
MODIFIED	= DATE 24-03-12  TIME 16:01:02;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 27;
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
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=1 ;
   3:  //L P[9] 100mm/sec FINE ;
   4:  --eg: remark line  ;
   5:  GO[1]=5 ;
   6:  AO[2]=(R[1]*2) ;
   7:  SO[1]=PULSE,0.5sec ;
   8:  DO[R[3]]=ON ;
   9:  SR[1]='abc' ;
  10:  R[1]=DI[1] ;
  11:  PL[1]=PL[2] ;
  12:  COL DETECT ON ;
  13:  COL GUARD ADJUST 80 ;
  14:  $MCR.$GENOVERRIDE=50 ;
  15:  JOINT_MAX_SPEED[1]=100 ;
  16:  LINEAR_MAX_SPEED=1000 ;
  17:L P[1] 100mm/sec CNT100 TB .10sec,DO[4]=ON ;
  18:L P[2] 2000cm/min CR5 ;
  19:L P[3] 100inch/min FINE PTH ;
  20:L P[4] 5.0sec FINE ;
  21:L P[5] 30deg/sec FINE ;
  22:L P[6] max_speed CNT100 ;
  23:J P[7] 100% CNT100 Wjnt ACC50 ;
  24:L P[8] 100mm/sec FINE Wjnt ;
  25:A P[1] 50mm/sec CNT100 ;
  26:A P[2] 50mm/sec CNT100 ;
  27:A P[10] 50mm/sec FINE ;
/POS
P[1]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    10.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    20.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    30.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    40.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[5]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    50.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    60.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[7]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    70.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[8]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    80.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[9]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    90.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[10]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    10.000  mm,	Y =    20.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
