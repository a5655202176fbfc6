/PROG  SPEEDS
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "case";
PROG_SIZE	= 0;
CREATE		= DATE 24-01-01  TIME 12:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 17;
MEMORY_SIZE	= 0;
PROTECT		= READ_WRITE;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  R[7]=40 ;
   2:  UFRAME_NUM=1 ;
   3:  UTOOL_NUM=1 ;
   4:J P[2] R[1:fast]% CNT50 ;
   5:J P[2] 2.5sec FINE ;
   6:L P[2] 100mm/sec FINE ;
   7:L P[3] 300cm/min FINE ;
   8:L P[2] 40inch/min FINE ;
   9:L P[3] 90deg/sec FINE ;
  10:L P[2] 2.0sec FINE ;
  11:L P[3] 500msec FINE ;
  12:L P[2] R[7]mm/sec FINE ;
  13:L P[3] R[8:feed]mm/sec FINE ;
  14:L P[2] WELD_SPEED FINE ;
  15:L P[3] max_speed CNT100 ;
  16:  OVERRIDE=50% ;
  17:L P[2] 100mm/sec FINE ;
/POS
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   100.000  mm,	Y =    20.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   200.000  mm,	Y =    30.000  mm,	Z =    -5.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
