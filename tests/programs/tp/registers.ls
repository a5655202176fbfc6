/PROG  REGISTERS
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "case";
PROG_SIZE	= 0;
CREATE		= DATE 24-01-01  TIME 12:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 13;
MEMORY_SIZE	= 0;
PROTECT		= READ_WRITE;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  R[1]=2 ;
   2:  R[2]=R[1]+1 ;
   3:  R[3]=R[2]*10 ;
   4:  R[4]=(-5) ;
   5:  R[5]=R[3]-R[4] ;
   6:  UFRAME_NUM=1 ;
   7:  UTOOL_NUM=R[2] ;
   8:L P[2] R[3]mm/sec FINE ;
   9:L P[3] R[5]mm/sec FINE ;
  10:  R[3]=R[3] DIV 4 ;
  11:L P[2] R[3]mm/sec FINE ;
  12:  R[R[1]]=5 ;
  13:L P[3] R[5]mm/sec FINE ;
/POS
P[2]{
   GP1:
	UF : 1, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =     1.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 3,		CONFIG : 'N U T, 0, 0, 0',
	X =     2.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
