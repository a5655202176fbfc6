/PROG  ARC_RUNS
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "case";
PROG_SIZE	= 0;
CREATE		= DATE 24-01-01  TIME 12:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 10;
MEMORY_SIZE	= 0;
PROTECT		= READ_WRITE;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=1 ;
   3:L P[9] 50mm/sec FINE ;
   4:A P[2] 50mm/sec CNT100 ;
   5:A P[3] 50mm/sec CNT100 ;
   6:A P[4] 50mm/sec CNT100 ;
   7:A P[5] 50mm/sec CNT100 ;
   8:A P[6] 50mm/sec CNT100 ;
   9:A P[7] 50mm/sec CNT100 ;
  10:L P[9] 50mm/sec FINE ;
/POS
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   150.000  mm,	Y =     0.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   143.301  mm,	Y =    25.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   125.000  mm,	Y =    43.301  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[5]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   100.000  mm,	Y =    50.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    75.000  mm,	Y =    43.301  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[7]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    56.699  mm,	Y =    25.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[9]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   160.000  mm,	Y =     0.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
