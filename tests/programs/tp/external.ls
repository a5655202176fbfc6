/PROG  EXTERNAL
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
   3:L P[2] 50mm/sec FINE ;
   4:L P[3] 50mm/sec FINE ;
   5:J P[1] 50% FINE ;
/POS
P[1]{
   GP1:
	UF : 1, UT : 1,	
	J1=     0.000 deg,	J2=     0.000 deg,	J3=     0.000 deg,
	J4=     0.000 deg,	J5=   -90.000 deg,	J6=     0.000 deg,
	E1=   500.000  mm
};
P[2]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     1.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg,
	E1 =   500.000  mm,	E2 =    10.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     2.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg,
	E1 =   500.000  mm,	E2 =    10.000 deg
};
/END
