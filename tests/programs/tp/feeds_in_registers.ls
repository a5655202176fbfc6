/PROG  SPRUT_MILL
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "";
PROG_SIZE	= 1234;
CREATE		= DATE 24-03-11  TIME 09:12:44;
MODIFIED	= DATE 24-03-12  TIME 16:01:02;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 20;
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
   1:  UFRAME_NUM = 1 ;
   2:  UTOOL_NUM = 1 ;
   3:  R[10:Feed]=50 ;
   4:  CALL SPINDLE_ON(12000) ;
   5:J P[1] 20% FINE ;
   6:L P[2] R[10:Feed]mm/sec CNT10 ;
   7:L P[3] R[10:Feed]mm/sec CNT10 ;
   8:L P[4] R[10:Feed]mm/sec CNT10 ;
   9:L P[5] R[10:Feed]mm/sec CNT10 ;
  10:L P[6] R[10:Feed]mm/sec CNT10 ;
  11:L P[7] R[10:Feed]mm/sec CNT10 ;
  12:L P[8] R[10:Feed]mm/sec CNT10 ;
  13:L P[9] R[10:Feed]mm/sec CNT10 ;
  14:L P[10] R[10:Feed]mm/sec CNT10 ;
  15:L P[11] R[10:Feed]mm/sec CNT10 ;
  16:  R[10:Feed]=80 ;
  17:L P[12] R[10:Feed]mm/sec CNT10 ;
  18:L P[13] R[10:Feed]mm/sec CNT10 ;
  19:L P[14] R[10:Feed]mm/sec CNT10 ;
  20:  CALL SPINDLE_OFF ;
/POS
P[1]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    10.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    20.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    30.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    40.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[5]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    50.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    60.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[7]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    70.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[8]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    80.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[9]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    90.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[10]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   100.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[11]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   110.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[12]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   120.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[13]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   130.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[14]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   140.000  mm,	Y =     5.000  mm,	Z =    -1.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
