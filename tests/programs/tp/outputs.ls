/PROG  OUTPUTS
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "case";
PROG_SIZE	= 0;
CREATE		= DATE 24-01-01  TIME 12:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 22;
MEMORY_SIZE	= 0;
PROTECT		= READ_WRITE;
DEFAULT_GROUP	= 1,*,*,*,*;
CONTROL_CODE	= 00000000 00000000;
/MN
   1:  UFRAME_NUM=1 ;
   2:  UTOOL_NUM=1 ;
   3:  DO[1:spindle]=ON ;
   4:  RO[2]=PULSE,0.5sec ;
   5:  GO[1]=R[2] ;
   6:  WAIT   1.00(sec) ;
   7:  WAIT DI[5]=ON ;
   8:  WAIT (DI[1] AND !DI[2]) TIMEOUT,LBL[9] ;
   9:  TIMER[1]=START ;
  10:  PAYLOAD[2] ;
  11:  MESSAGE[Part is ready] ;
  12:  COL DETECT ON ;
  13:  UALM[2] ;
  14:  $WAITTMOUT=200 ;
  15:  PR[5]=LPOS-PR[6] ;
  16:  PR[5,3]=50 ;
  17:  OFFSET CONDITION PR[5] ;
  18:  PAUSE ;
  19:L P[2] 50mm/sec FINE ;
  20:  LBL[9] ;
  21:L P[3] 50mm/sec FINE ;
  22:  ABORT ;
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
