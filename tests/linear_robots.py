"""What hostile RAPID and TP programs are made of; see `linear.py`."""

RAPID = {
    "bare": ("", ""), "name": ("a", ";"), "label": ("a", ":"), "number": ("n:=1", ";"), "string": ('TPWrite "', '";'),
    "target": ("MoveL [[1", ",2,3],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v1,z1,tool0;"),
    "aggregate": ("MoveL [", "],v1,z1,tool0;"), "tail": ("MoveL p,v1,z1,", ";"), "index": ("a{", "}:=1;"),
    "component": ("a.", ":=1;"), "assignment": ("n:=", ";"), "call": ("f ", ";"), "option": ("f \\", ";"),
    "IF": ("IF ", " THEN"), "FOR": ("FOR i FROM ", " DO"), "comment": ("!", ""), "FORCE": ("! FORCE ", ""),
    "declaration": ("VAR num ", ";"), "PROC": ("ENDPROC\nPROC ", "()"), "header": ("%%%", "%%%"),
}  # fmt: skip
RAPID_LINE = "MoveL [[%d,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v50,z1,t;\n"
RAPID_LINES = (
    RAPID_LINE, RAPID_LINE.replace("0,0,1,0", "0,0,1E99,0"), RAPID_LINE.replace("%d", "1" * 320), "MoveL *,v1,z1,t;\n",
    7 * RAPID_LINE.replace("%d", "1") + ";\n", RAPID_LINE.replace("%d", "1"), RAPID_LINE[:-2], "MoveL p%d,v1,z1,t;\n",
    "MoveC p,p%d,v1,z1,t;\n", "MoveAbsJ j%d,v1,z1,t;\n", "VAR num n%d;\n", "n:=n+%d;\n", "n:=(\n", "a%d:\n",
    "GOTO a%d;\n",
    "IF n=%d THEN\n", "IF n=%d THEN\nENDIF\n", "FOR i FROM 1 TO %d DO\n", "FOR i FROM 1 TO 3 DO\nENDFOR\n",
    "FOR i FROM 1 TO 9 DO\nFOR k FROM 1 TO 9 DO\nENDFOR\nENDFOR\n", "WHILE n<%d DO\n", "WHILE n<9 DO\nENDWHILE\n",
    "WHILE di1=%d DO\nENDWHILE\n", "WHILE di1=1 DO\nWHILE di1=1 DO\nn:=%d;\nENDWHILE\nENDWHILE\n", "TEST n\nCASE %d:\n",
    "f%d;\n", "ENDPROC\nPROC f%d()\n", "ENDPROC\nPROC f%d()\nmain;\n", "! FORCE %d 2 3\n", "! a\n", "\n", "\r", ";",
    "ConfL\\Off;\n", "PDispOff;\n", "p:=Offs(p,0,0,%d);\n", "p%d:=p;\n", "RETURN;\n", "ERROR\n", "EXIT;\n",
)  # fmt: skip
RAPID_AROUND = {
    "FOR": ("FOR i FROM 1 TO 1000 DO", "ENDFOR"), "WHILE": ("n:=0;\nWHILE n<9 DO\nn:=n+1;", "ENDWHILE"),
    "WHILE in FOR": ("FOR i FROM 1 TO 99 DO\nWHILE di1=1 DO", "ENDWHILE\nENDFOR"),
    "FOR in WHILE": ("WHILE di1=1 DO\nFOR i FROM 1 TO 99 DO", "ENDFOR\nENDWHILE"),
    "WHILE thrice": (3 * "WHILE di1=1 DO\n", 3 * "ENDWHILE\n"), "IF": ("IF di1=1 THEN", "ENDIF"),
    "GOTO": ("a:", "GOTO a;"), "calls": ("f;\nf;\nf;\nENDPROC\nPROC f()", ""),
    "WHILE after FOR": ("FOR i FROM 1 TO 9 DO\nn:=n+1;\nENDFOR\nWHILE n>0 DO\nn:=n-1;", "ENDWHILE"),
    "label": ("", "b:"), "routine": ("", "ENDPROC\nPROC h()\nMoveL p,v1,z1,t;\nm:=m+1;"),
}  # fmt: skip
RAPID_BODIES = (
    RAPID_LINE, "MoveL Offs(p,0,0,n),v1,z1,t;\n", "n:=n+1;\n", "! a\n", "IF n=%d THEN\nENDIF\n", "p%d:=p;\n",
    "FOR k FROM 1 TO 9 DO\nMoveL p,v1,z1,t;\nENDFOR\n", "g;\n", "! FORCE 1 2 3\n",
    "VAR num v%d;\nIF di1=1 THEN\nv%d:=1;\nENDIF\n", "IF di1=1 THEN\nMoveL p,v1,z1,t;\nENDIF\n",
    "a{%d}:=n;\n", "IF di1=1 GOTO b;\nMoveL p,v1,z1,t;\n", "IF di1=1 RETURN;\nMoveL p,v1,z1,t;\n",
    "h;\nMoveL Offs(p,%d,0,0),v1,z1,t;\n", "TEST n\nCASE 1:\nMoveL p,v1,z1,t;\nDEFAULT:\nMoveJ p,v1,z1,t;\nENDTEST\n",
    "p:=CRobT();\nMoveL p,v1,z1,t;\n", "PDispOn p,t;\nMoveL p,v1,z1,t;\nPDispOff;\n", "k x,y;\n", "n:=k(n);\n",
    "WaitTime 1;\nMoveC p,p,v1,z1,t;\n", "%%\"f%d\"%%;\n", "q.trans.x:=q.trans.x+1;\nMoveL q,v1,z1,t;\n",
    "IF di1=1 THEN\nWHILE di1=1 DO\nMoveL p,v1,z1,t;\nENDWHILE\nENDIF\n", "ConfL\\Off;\nSingArea\\Wrist;\n",
)  # fmt: skip
RAPID_HEAD = """MODULE m
VAR num n;
VAR num m;
VAR num a{200000};
VAR robtarget p;
VAR robtarget q;
PROC main()
"""
RAPID_TAIL = "\nENDPROC\nENDMODULE\n"

TP = {
    "bare": ("", " ;"), "line": ("1:", ";"), "remark": ("1: !", ";"), "motion": ("1:L P[1] ", " ;"),
    "point": ("1:L P[", "] 9mm/sec FINE ;"), "speed": ("1:L P[1] ", "mm/sec FINE ;"),
    "name": ("1:L P[1:", "] 9mm/sec FINE ;"),
    "register": ("1:R[1]=", " ;"), "IF": ("1:IF R[1]=", ",JMP LBL[1] ;"), "call": ("1:CALL F(", ") ;"),
    "label": ("1:LBL[1:", "] ;"), "output": ("1:DO[1]=", " ;"), "wait": ("1:WAIT ", " ;"),
    "select": ("1:SELECT ", " ;"),
    "in POS": ("/POS\n", ""), "in a point": ("/POS\nP[1]{\nGP1:\n", "};"),
    "number": ("/POS\nP[1]{\nGP1:\nUF : 1, UT : 1,\nX = ", " mm\n};"),
}  # fmt: skip
TP_POINT = (
    "P[%d]{\nGP1:\nUF : 1, UT : 1, CONFIG : 'N U T, 0, 0, 0',\nX = 1.0 mm, Y = 2.0 mm, Z = 3.0 mm,\n"
    "W = 0 deg, P = 0 deg, R = 0 deg\n};\n"
)
TP_LINES = (
    "1:L P[%d] 9mm/sec FINE ;\n", "1:L P[1] 9mm/sec FINE ;\n", "1:J P[%d] 9% CNT9 ;\n",
    "1:C P[1]\n:P[%d] 9mm/sec FINE ;\n",
    "1:A P[%d] 9mm/sec FINE ;\n", "1:R[%d]=1 ;\n", "1:R[1]=R[1]+1 ;\n", "1:LBL[%d] ;\n", "1:JMP LBL[%d] ;\n",
    "1:JMP LBL[1] ;\n",
    "1:IF R[1]=%d,JMP LBL[1] ;\n1:L P[1] 9mm/sec FINE ;\n", "1:IF DI[1]=ON,JMP LBL[%d] ;\n1:LBL[%d] ;\n",
    "1:LBL[%d] ;\n1:L P[1] 9mm/sec FINE ;\n1:IF DI[1]=ON,JMP LBL[%d] ;\n", "1:IF DI[1]=ON,CALL F%d ;\n",
    "1:IF DI[1]=ON,JMP LBL[1] ;\n1:R[%d]=1 ;\n",
    "1:FOR R[1]=1 TO %d ;\n", "1:FOR R[1]=1 TO 9 ;\n1:L P[1] 9mm/sec FINE ;\n1:ENDFOR ;\n", "1:ENDFOR ;\n",
    "1:IF (DI[1]=ON) THEN ;\n",
    "1:IF (DI[1]=ON) THEN ;\n1:L P[1] 9mm/sec FINE ;\n1:ENDIF ;\n",
    "1:IF (DI[1]=ON) THEN ;\n1:R[%d]=2 ;\n1:ELSE ;\n1:R[%d]=3 ;\n1:ENDIF ;\n",
    "1:SELECT R[1]=%d,JMP LBL[1] ;\n", "1:      =%d,JMP LBL[1] ;\n", "1:! FORCE %d 2 3 ;\n", "1:! a ;\n", "1: ;\n",
    "\n", "\r", ";",
    "1:UFRAME_NUM=%d ;\n", "1:PR[%d]=LPOS ;\n", "1:OFFSET CONDITION PR[%d] ;\n", "1:CALL F%d(1) ;\n",
    "1:WAIT 1.00(sec) ;\n", "1:SKIP CONDITION DI[%d]=ON ;\n",
    "/POS\n", TP_POINT, "/POS\n" + TP_POINT.replace("%d", "1"), "/POS\nP[%d]{\n", "/END\n", "/PROG A%d\n", "/MN\n",
)  # fmt: skip
TP_AROUND = {
    "label": ("1:LBL[1] ;", "1:IF DI[1]=ON,JMP LBL[1] ;\n"), "FOR": ("1:FOR R[9]=1 TO 9 ;", "1:ENDFOR ;\n"),
    "end": ("", "1:LBL[1] ;\n1:L P[1] 9mm/sec FINE ;\n"),
}  # fmt: skip
TP_HEAD = "/PROG A\n/ATTR\n/MN\n1:UFRAME_NUM=1 ;\n1:UTOOL_NUM=1 ;\n"
TP_TAIL = "/POS\n" + TP_POINT.replace("%d", "1") + "/END\n"
