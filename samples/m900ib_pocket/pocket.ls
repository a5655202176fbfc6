/PROG  POCKET
/ATTR
OWNER		= MNEDITOR;
COMMENT		= "Pocket";
PROG_SIZE	= 0;
CREATE		= DATE 24-01-01  TIME 12:00:00;
MODIFIED	= DATE 24-01-01  TIME 12:00:00;
FILE_NAME	= ;
VERSION		= 0;
LINE_COUNT	= 31;
MEMORY_SIZE	= 0;
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
   3:J P[1:HOME] 50% CNT50    ;
   4:J P[2:above] 50% FINE    ;
   5:L P[3] 20mm/sec FINE    ;
   6:  !FORCE 120 260 -60 @feed ;
   7:L P[4] 50mm/sec CNT100    ;
   8:C P[5]    
    :  P[6] 50mm/sec CNT100    ;
   9:L P[7] 50mm/sec CNT100    ;
  10:C P[8]    
    :  P[9] 50mm/sec CNT100    ;
  11:L P[10] 50mm/sec CNT100    ;
  12:C P[11]    
    :  P[12] 50mm/sec CNT100    ;
  13:L P[13] 50mm/sec CNT100    ;
  14:C P[14]    
    :  P[15] 50mm/sec CNT100    ;
  15:L P[16] 50mm/sec FINE    ;
  16:  !FORCE OFF ;
  17:L P[2:above] 200mm/sec FINE    ;
  18:L P[17] 20mm/sec FINE    ;
  19:  !FORCE 120 260 -60 @feed ;
  20:L P[18] 50mm/sec CNT100    ;
  21:C P[19]    
    :  P[20] 50mm/sec CNT100    ;
  22:L P[21] 50mm/sec CNT100    ;
  23:C P[22]    
    :  P[23] 50mm/sec CNT100    ;
  24:L P[24] 50mm/sec CNT100    ;
  25:C P[25]    
    :  P[26] 50mm/sec CNT100    ;
  26:L P[27] 50mm/sec CNT100    ;
  27:C P[28]    
    :  P[29] 50mm/sec CNT100    ;
  28:L P[30] 50mm/sec FINE    ;
  29:  !FORCE OFF ;
  30:L P[2:above] 200mm/sec FINE    ;
  31:J P[1:HOME] 50% FINE    ;
/POS
P[1:"HOME"]{
   GP1:
	UF : 1, UT : 1,	
	J1=     0.000 deg,	J2=     0.000 deg,	J3=     0.000 deg,
	J4=     0.000 deg,	J5=   -60.000 deg,	J6=     0.000 deg
};
P[2:"above"]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   120.000  mm,	Y =    80.000  mm,	Z =    20.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[3]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   120.000  mm,	Y =     0.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[4]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   210.000  mm,	Y =     0.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[5]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   231.213  mm,	Y =     8.787  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[6]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   240.000  mm,	Y =    30.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[7]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   240.000  mm,	Y =   130.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[8]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   231.213  mm,	Y =   151.213  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[9]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   210.000  mm,	Y =   160.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[10]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    30.000  mm,	Y =   160.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[11]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     8.787  mm,	Y =   151.213  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[12]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     0.000  mm,	Y =   130.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[13]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     0.000  mm,	Y =    30.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[14]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     8.787  mm,	Y =     8.787  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[15]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    30.000  mm,	Y =     0.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[16]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   120.000  mm,	Y =     0.000  mm,	Z =    -2.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[17]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   120.000  mm,	Y =     0.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[18]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   210.000  mm,	Y =     0.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[19]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   231.213  mm,	Y =     8.787  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[20]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   240.000  mm,	Y =    30.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[21]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   240.000  mm,	Y =   130.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[22]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   231.213  mm,	Y =   151.213  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[23]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   210.000  mm,	Y =   160.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[24]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    30.000  mm,	Y =   160.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[25]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     8.787  mm,	Y =   151.213  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[26]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     0.000  mm,	Y =   130.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[27]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     0.000  mm,	Y =    30.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[28]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     8.787  mm,	Y =     8.787  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[29]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =    30.000  mm,	Y =     0.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
P[30]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =   120.000  mm,	Y =     0.000  mm,	Z =    -4.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
