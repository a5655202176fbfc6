/PROG spelling
/ATTR
line_count=4;
/mn
1:uframe_num = 1;
  2 :  UTOOL_NUM =1   ;
	3:l P [ 2 ] 50 mm/sec fine;
4:L P[3]50mm/sec CNT 100;
/pos
P[ 2 ]{ GP1: UF:1,UT:1,CONFIG:'n u t,0,0,0',X=1.5mm,Y=-.25mm,Z=+2.mm,W=180deg,P=1E1deg,R=-0deg };
P[3] { GP1 :
UF : 1 , UT : 1 , CONFIG : 'N U T, 0, 0, 0' ,
X = 4 mm , Y = 5 mm , Z = 6 mm , W = -180 deg , P = 0 deg , R = 0 deg } ;
/end
