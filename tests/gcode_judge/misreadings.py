"""Small programs that were once misread, each for a reason of its own."""

from __future__ import annotations

from .blocks import Block, Made

START = "G21 G90 G0 X1 Y2 Z3\nF100\n"

MISREADINGS = {
    "words beside an assignment": "G21 G90 G0 X1 Y2 Z3\nF100\n#1=4 G1 X80\nM2",
    "the place after a canned cycle": "G21 G90 G0 X1 Y2 Z3\nF100 G81 X5 Z-5 R1\nG1 X9\nM2",
    "cycles in another plane without a motion between": "G21 G90 G0 X1 Y7 Z9\nF100 G98 G81 X1 Y5 Z-1 R2\n"
    "G18 G81 X2 Z3 Y-1 R2\nG80 G17\nG1 X5\nX2 Y2 Z2\nM2",
    "a cycle in a plane that is not known": START + "/G19\nX-2 Z3 G81 R42\nG99 Z4\nG80\nG17 G1 X5 Y5 Z5\nM2",
    "coordinates after a tool length offset": "G21 G90 G0 X1 Y2 Z3\nF100 G43 H2\nG1 X9\nM2",
    "a code that is computed": "G21 G90 G0 X1 Y2 Z3\nG[55+1]\nG1 X5 Y3 Z2 F100\nM2",
    "a full circle that may run often or never": "G21 G90 G0 X1 Y2 Z3\no1 repeat [2]\nG2 I5 F100\no1 endrepeat\nM2",
    "G92 in an offset that has just been written": START
    + "G10 L2 P1 X-13.5\nG92 X4\nX8 Y2 Z2\nG10 L2 P1 X0\nG56 G0 X1 Y2 Z3\nM2",
    "a shift that a deleted block may have stored": START + "/G92 Y23\nG92.3\nG0 Y-6 Z5\nM2",
    "R of a cycle in a deleted block": START + "G99 G81 X5 Z-5 R1\n/X3 R94\nX4\nG1 Y3\nX2\nM2",
    "a DO after a WHILE with a BREAK": START
    + "#20=0\no1 while [0]\no1 break\no1 endwhile\no2 do\n#20=[#20+1]\nG1 X5\no2 while [#20 lt 3]\nM2",
    "a CONTINUE after which nothing is known": START
    + "#20=0\no1 while [#20 lt 4]\n/#20=[#20+1]\n#20=[#20+1]\nG0 X9\no1 continue\no1 endwhile\nM2",
    "a difference before a canned cycle": START + "M3\nG98 G81 X1 Y2 Z-9 R5\nG1 Z40\nG91 Z-38\nG90\n"
    "G87 R9 Z-3 I2 J2 K-6\nG1 X8\nZ1\nM2",
    "an expression before a canned cycle": START + "#1=[#5420-21]\nG1 Z40\nZ#1\nG98 G81 X5 Z-30 R-7\n"
    "G80\nG1 X8\nZ1\nX4\nM2",
    "a REPEAT behind a CONTINUE of a DO": START + "#20=0\no1 do\n#20=[#20+1]\no2 repeat [3]\nG91 G0 X1\nG90\n"
    "o2 endrepeat\no1 continue\no1 while [#20 lt 3]\nM2",
    "a REPEAT that is left from within": START
    + "#20=0\n#7=0\no1 while [#20 lt 3]\n#20=[#20+1]\no2 repeat [2]\n"
    "#7=[#7+1]\nG0 X#7\no1 continue\no2 endrepeat\no1 endwhile\nM2",
    "a BREAK of a WHILE behind a CONTINUE of a DO": START + "#20=0\n#7=0\no1 do\n#20=[#20+1]\no1 continue\n"
    "o1 while [#20 lt 2]\n#21=0\no2 while [#21 lt 3]\n#21=[#21+1]\n#7=[#7+1]\nG0 X#7\no2 break\no2 endwhile\nM2",
    "an offset in a deleted block after another one": START
    + "G1 Y8\n/G58\nG1 X9 Y2 Z2\n/G57\nX2\nG54\nX3 Y3 Z3\nM2",
    "an offset that is written and selected in inches": "G10 L2 P7 X24 Y25.36 Z-19.43\nG20\nG59.1\nG21\n"
    "G1 X20.437 Y75 Z-28.203 F100\nX9\nM2",
    "the centre of an arc in a mode that is not known": START + "/G90.1\nG1 X10 Y10\nG3 I-10 J-10\nM2",
}


def written(text: str) -> Made:
    """A program from its text, every line a block of words."""
    lines = text.splitlines()
    return Made(tuple(Block((line.removeprefix("/"),), line.startswith("/")) for line in lines), False, 1)
