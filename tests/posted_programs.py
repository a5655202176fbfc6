"""Programs as CAM systems post them, made up: headers with variables, tool changes, work offsets, cycles, macros.

Each is a header in the manner of one kind of post, the same pocket as motions, and a footer.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path


def pocket(levels: int = 3, arcs: bool = True, start: str = "") -> list[str]:
    """Feed moves of a pocket; modal words, as posts write them."""
    lines = [f"G0 X0. Y0.{start}", "Z5.", "G1 Z-1. F200."]
    for level in range(levels):
        for step in range(1, 8):
            size = step * 4.0
            lines += [f"G1 X{size:.3f}", f"Y{size:.3f}", f"X{-size:.3f}", f"Y{-size:.3f}", f"X{size:.3f}"]
            if arcs:
                lines += [f"G3 X{size + 2:.3f} Y{-size + 2:.3f} I0. J2.", "G1 Y0."]
        lines.append(f"G1 Z{-2.0 - level:.1f}")
    return [*lines, "G0 Z50."]


def holes(code: str, more: str = "") -> list[str]:
    return [f"G98 {code} X10. Y10. Z-8. R2. {more}F100.", "X20.", "X30. Y20.", "G80"]


def five_axes(count: int = 60) -> list[str]:
    lines = []
    for i in range(count):
        angle = i * 2 * math.pi / count
        lines.append(
            f"G1 X{30 * math.cos(angle):.4f} Y{30 * math.sin(angle):.4f} Z{2 * math.sin(3 * angle):.4f}"
            f" A{10 * math.sin(angle):.3f} B{8 * math.cos(angle):.3f}"
        )
    return lines


def fanuc() -> dict[str, list[str]]:
    head = ["%", "O0001 (POCKET)", "N10 G17 G21 G40 G49 G80 G90"]
    change = ["T1 M6", "G54", "S8000 M3", "G43 H1 Z50."]
    end = ["G91 G28 Z0.", "G28 X0. Y0.", "M30", "%"]
    return {
        "fanuc-plain.nc": [*head, *change, *pocket(), *end],
        "fanuc-home-first.nc": [*head, "G91 G28 Z0.", "G90", *change, *pocket(), *end],
        "fanuc-variables.nc": [
            *head, "#100=1.5 (CLEARANCE)", "#101=[#100*2+5]", "#500=200.", *change,
            "G0 X[#100+1.] Y-#101", "Z#101", "G1 Z-#100 F#500", *(
                line for step in range(1, 40) for line in (f"X[#101+{step}.5]", f"Y[#100*{step}]", f"G1 X{step}. Y#101")
            ), "G0 Z50.", *end,
        ],
        "fanuc-loop.nc": [
            *head, *change, "G0 X0. Y0.", "Z5.", "#1=0", "#2=5", "WHILE [#1 LT #2] DO1", "#1=#1+1",
            "G1 Z[-#1] F200.", "X20.", "Y20.", "X0.", "Y0.", "END1", *pocket(1), *end,
        ],
        "fanuc-sub.nc": [
            *head, *change, "G0 X0. Y0.", "Z2.", "M98 P2000 L3", *pocket(1), "G91 G28 Z0.", "M30",
            "O2000", "G91 G1 Z-1. F100.", "G90 X20.", "Y20.", "X0.", "Y0.", "M99", "%",
        ],
        "fanuc-sub-m98-packed.nc": [
            *head, *change, "G0 X0. Y0.", "Z2.", "M98 P22000", *pocket(1), "M30",
            "O2000", "G91 G1 Z-1. F100.", "G90 X20.", "Y20.", "X0.", "Y0.", "M99", "%",
        ],
        "fanuc-offsets.nc": [
            *head, "G90 G10 L2 P1 X100. Y200. Z-50.", "G10 L2 P2 X300. Y200. Z-50.", *change, *pocket(),
            "G55", *pocket(), *end,
        ],
        "fanuc-drilling.nc": [
            *head, *change, "G0 X0. Y0.", "Z20.", *holes("G81"), *holes("G83", "Q2. "), *pocket(1), *end,
        ],
        "fanuc-tools.nc": [
            *head, *change, *pocket(1), "G91 G28 Z0. M5", "G90", "T2 M6", "G54", "S4000 M3", "G43 H2 Z50.", *pocket(2),
            "M5", "G91 G28 Z0.", "G28 Y0.", "T0 M6", *end[2:],
        ],
        "fanuc-goto.nc": [
            *head, "#120=1", "IF[#120EQ1]GOTO100", "M0", "N100", *change, *pocket(), "IF[#120NE1]GOTO200",
            *pocket(1), "N200", *end,
        ],
        "haas-macro.nc": [
            "%", "O00123", "(POST)", "G20", "G0 G17 G40 G49 G80 G90", "G53 G0 Z0.", "T3 M6", "G0 G90 G54 X0. Y0.",
            "S5000 M3", "G43 H3 Z1.", "G187 P2", *pocket(), "G53 G0 Z0.", "G53 G0 Y0.", "G187", "M30", "%",
        ],
        "haas-symbols.nc": [
            "%", "O00124", "G0 G17 G40 G49 G80 G90 G21", "T3 M6", "G54", "S5000 M3", "G43 H3 Z50.",
            "G65 P9810 X1.", *pocket(), "M30", "%",
        ],
        "fanuc-tcp.nc": [
            *head, "T1 M6", "G54", "G0 A0. B0.", "G43.4 H1 Z50.", "G0 X30. Y0. Z5.", "F500.", *five_axes(),
            "G49", *end,
        ],
        "fanuc-absolute-centres.nc": [
            *head, *change, "G0 X10. Y0.", "G1 Z-1. F200.", *(
                line for i in range(1, 12) for line in (
                    f"G1 X{10 + i}. Y{i}.", f"G3 X{5 + i}. Y{5 + i}. I{5 + i}. J{i}.", f"G1 X{7 + i}.")
            ), *end,
        ],
        "fanuc-tilted.nc": [
            *head, "G28 G91 Z0.", "G90", "T1 M6", "S8000 M3", "G54", "G0 B0. C0.", "G68.2 X0. Y0. Z0. I90. J45. K-90.",
            "G53.1", "G0 X0. Y0.", "G43 Z50. H1", *pocket(), "G69", "G28 G91 Z0.", "G90", "G49", "G0 B0. C0.",
            "G43 Z50. H1", *pocket(1), *end,
        ],
        "fanuc-rotated.nc": [
            *head, *change, *pocket(1), *(
                line for k in range(4) for line in (f"G68 X50. Y50. R{k * 90}.", *pocket(1), "G69")
            ), *end,
        ],
        "fanuc-mirrored.nc": [
            *head, *change, *pocket(1), "G51.1 X-50.", *pocket(1), "G51.1 Y0.", *pocket(1), "G50.1 X0. Y0.", *pocket(1),
            *end,
        ],
        "fanuc-polar.nc": [
            *head, *change, "G0 X0. Y0.", "Z20.", "G98 G81 G16 X40. Y0. Z-8. R2. F100.",
            *(f"Y{angle}." for angle in range(45, 360, 45)), "G15 G80", *pocket(1), *end,
        ],
        "fanuc-rotary-indexed.nc": [
            *head, *change, *pocket(1), "G91 G28 Z0.", "G90 G0 B90.", *change, *pocket(1), "G0 B0.", *pocket(2), *end,
        ],
    }  # fmt: skip


def sinumerik() -> dict[str, list[str]]:
    head = ["; POST", "N10 G17 G40 G64 G71 G90 G94"]
    change = ['N20 T="MILL_10"', "N21 M6", "N22 D1", "N23 G54", "N24 S8000 M3"]
    end = ["SUPA G0 Z0 D0", "M30"]
    cycle = 'CYCLE800(1,"TC1",100000,57,0,0,0,0,0,0,0,0,0,-1,100,1)'
    swivel = 'CYCLE800(1,"TC1",100000,57,0,0,0,0,30,0,0,0,0,-1,100,1)'
    return {
        "nx-840d.mpf": [*head, "CYCLE800()", "TRAFOOF", "SUPA G0 Z0 D0", *change, *pocket(), *end],
        "nx-840d-cycle832.mpf": [
            *head, "DEF REAL _camtolerance", "DEF REAL _X_HOME, _Y_HOME, _Z_HOME", "DEF REAL _F_CUTTING, _F_ENGAGE",
            "_camtolerance=0.05", "_X_HOME=0 _Y_HOME=0", "_Z_HOME=300", "_F_CUTTING=500 _F_ENGAGE=250.5",
            "SUPA G0 Z=_Z_HOME D0", *change, "CYCLE832(_camtolerance,1,1)", "G0 X=_X_HOME Y=_Y_HOME",
            *(line.replace("F200.", "F=_F_ENGAGE") for line in pocket()), "G1 F=_F_CUTTING X10", *pocket()[3:],
            "CYCLE832()", *end,
        ],
        "nx-840d-if.mpf": [
            *head, "DEF INT _mode", "_mode=1", *change, "IF _mode==1", "CYCLE800()", "ELSE", "G0 X500", "ENDIF",
            *pocket(), *end,
        ],
        "840d-swivel.mpf": [
            *head, cycle, *change, *pocket(), swivel, *pocket(1), cycle, "G54", *pocket(2), *end,
        ],
        "840d-swivel-cba.mpf": [
            *head, *change, 'CYCLE800(1,"TC1",200000,27,0,0,0,0,90,0,0,0,0,1,0,0)', *pocket(), "CYCLE800()",
            "SUPA G0 Z0 D0", 'CYCLE800(0,"0",0,27,0,0,0,0,0,0,0,0,0,1,0,0)', "D1", *pocket(1), *end,
        ],
        "840d-mirrored.mpf": [
            *head, *change, *pocket(1), "TRANS X100", "AMIRROR X0", *pocket(1), "SCALE X1.5 Y1.5", *pocket(1), "SCALE",
            *pocket(1), *end,
        ],
        "840d-drill.mpf": [
            *head, *change, "G0 X0 Y0", "Z50", "MCALL CYCLE81(50,0,2,-10)", "X10 Y10", "X20", "MCALL", *pocket(),
            "G0 X0 Y0 Z50", "CYCLE83(50,0,2,-20,,-5,,2,0,0,1,0)", *pocket(1), *end,
        ],
        "840d-parameters.mpf": [
            *head, "R1=10", "R2=R1*2 R3=-(R1+0.5)", *change, "G0 X=R1 Y=R2", "Z5", "G1 Z=R3 F300",
            *(line for i in range(1, 20) for line in (f"X=R1+{i}", f"Y=R2*{i}", f"G1 X{i} Y{i}")), *end,
        ],
        "840d-for.mpf": [
            *head, "DEF INT _I", *change, "G0 X0 Y0", "Z2", "FOR _I=1 TO 4", "G1 Z=-_I F200", "X20", "Y20", "X0", "Y0",
            "ENDFOR", *pocket(1), *end,
        ],
        "840d-repeat.mpf": [
            *head, *change, "G0 X0 Y0", "Z2", "LEVEL:", "G1 Z=IC(-1) F200", "X20", "Y20", "X0", "Y0", "LEVEL_END:",
            "REPEAT LEVEL LEVEL_END P=3", *pocket(1), *end,
        ],
        "840d-goto.mpf": [
            *head, "R10=1", "IF R10==1 GOTOF START", "M0", "START:", *change, *pocket(), *end,
        ],
        "840d-user-variable.mpf": [
            *head, "V.E.DISP=4", "EXTCALL_OFF=0", *change, *pocket(), *end,
        ],
        "840d-traori.mpf": [
            *head, "TRAFOOF", "SUPA G0 Z0 D0", *change, "G0 A0 B0", "TRAORI", "G54", "G0 X30 Y0 Z50 A0 B0", "F500",
            *five_axes(), "TRAFOOF", *end,
        ],
        "840d-vectors.mpf": [
            *head, *change, "TRAORI", "G54", "ORIWKS", "ORIAXES", "G0 X30 Y0 Z50 A3=0 B3=0 C3=1", "F500",
            *(f"G1 X{30 + i} Y{i} A3={i / 100:.4f} B3=0 C3=1" for i in range(40)), "TRAFOOF", *end,
        ],
        "840d-workpiece.mpf": [
            "WORKPIECE(,,,\"BOX\",112,0,-20,-80,0,0,100,100)", *head, "GROUP_BEGIN(0,\"A\",0,0)", *change, *pocket(),
            "GROUP_END(0,0)", *end,
        ],
        "840d-robot.mpf": [
            "N01 G17 G710 G40", "N02 TRAORI", "N03 G90 G64",
            "N04 $P_UIFR[1]=CTRANS(X,800.5,Y,-960.25,Z,40.125):CROT(X,0.00000,Y,0.00000,Z,90.00000)", "N05 G54",
            "N06 $TC_DP3[1,1]=-100.00000", "N07 T1 D1", "N08 ORIWKS", "N09 ORIVIRT1", "F6000",
            *(f"G1 X{220 + i}.000 Y250.000 Z{350 + i % 3}.000 A={i - 90}.000 B=60.000 C=30.000" for i in range(40)),
            "M30",
        ],
        "840d-sub.mpf": [
            "%_N_MAIN_MPF", *head, *change, "G0 X0 Y0", "Z2", "L10 P3", *pocket(1), "M30",
            "%_N_L10_SPF", "G91 G1 Z-1 F100", "G90 X20", "Y20", "X0", "Y0", "M17",
        ],
    }  # fmt: skip


def linuxcnc() -> dict[str, list[str]]:
    head = ["%", "G21 G17 G40 G49 G80 G90 G94", "T1 M6", "G43 H1", "G54", "S8000 M3"]
    return {
        "linuxcnc-plain.ngc": [*head, *pocket(), "M2"],
        "linuxcnc-named.ngc": [
            *head,
            "#<depth>=-3",
            "#<step> = [ABS[#<depth>]/3]",
            "G0 X0 Y0",
            "Z#<step>",
            "G1 Z#<depth> F100",
            *(
                line
                for i in range(1, 30)
                for line in (f"X[{i}*#<step>]", "Y#<step>", f"G1 X{i}. Y[#<step>+{i}]")
            ),
            "M2",
        ],
        "linuxcnc-while.ngc": [
            *head,
            "G0 X0 Y0",
            "Z5",
            "#1=0",
            "O100 WHILE [#1 GT -4]",
            "#1=[#1-1]",
            "G1 Z#1 F100",
            "X10",
            "Y10",
            "X0",
            "Y0",
            "O100 ENDWHILE",
            *pocket(1),
            "M2",
        ],
        "linuxcnc-sub.ngc": [
            "%",
            "O200 SUB",
            "G1 Z#1 F100",
            "X20",
            "Y20",
            "X0",
            "Y0",
            "O200 ENDSUB",
            *head[1:],
            "G0 X0 Y0",
            "Z5",
            "O200 CALL [-1]",
            "O200 CALL [-2]",
            *pocket(1),
            "M2",
        ],
        "mach-no-start.tap": [*head, "G1 Z-1 F100", *pocket()[3:], "M30"],
        "heidenhain-iso.nc": [
            "%POCKET G71 *",
            "N10 G30 G17 X+0 Y+0 Z-20*",
            "N20 G31 G90 X+100 Y+100 Z+0*",
            "N30 T1 G17 S5000*",
            *(f"N{40 + i} G01 X+{i} Y+{i * 2} G40 F200*" for i in range(10)),
            "N9999999 %POCKET G71 *",
        ],
        "printer-like.gcode": ["G21", "G90", "M82", "G28", "G1 Z5 F3000", *pocket(1)[2:], "M84"],
    }


def posted_programs() -> Iterator[tuple[Path, bytes]]:
    """Name and bytes of every program."""
    for programs in (fanuc(), sinumerik(), linuxcnc()):
        for name, lines in programs.items():
            yield Path(name), ("\n".join(lines) + "\n").encode()
