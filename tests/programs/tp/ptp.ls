/PROG  PTP
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "case";
PROG_SIZE	= 0;
CREATE		= DATE 24-01-01  TIME 12:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 5;
MEMORY_SIZE	= 0;
PROTECT		= READ_WRITE;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=1 ;
   3:J P[2] 50% FINE ;
   4:J P[3] 50% CNT50 ;
   5:L P[2] 50mm/sec FINE ;
/POS
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     1.000  mm,	Y =     2.000  mm,	Z =     3.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'F D T, 0, -1, 1',
	X =     4.000  mm,	Y =     5.000  mm,	Z =     6.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
