"""The codes of the findings of G-code."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "GCO001": Code(
            "warning",
            "block is not understood",
            meaning="The block contains a code, a word or a text that this tool does not know.",
            consequence=(
                "Its effect is unknown, so it is not corrected, and the position after it may be unknown."
            ),
            action="Check what it does; if it moves, write it as G0 to G3 with numbers.",
            example="`G187 P2`.",
        ),
        "GCO002": Code(
            "warning",
            "position is not known",
            meaning="A coordinate is not set before this motion, or an earlier block makes it unknown.",
            consequence="The target is unknown, so the motion is not corrected.",
            action="Write X, Y and Z in the first motion after the unknown block.",
            example="`G1 X10` as the first motion of a program.",
        ),
        "GCO003": Code(
            "info",
            "rapid that is not fully known",
            meaning="A coordinate, the work offset or the tool is not known yet.",
            consequence="It is an air move; it is not corrected and needs no correction.",
            action="Nothing needs to be done.",
            example="`G0 Z100` before the first `G54`.",
        ),
        "GCO004": Code(
            "info",
            "machine or reference position",
            meaning="G28, G30 and G53 address a place of the machine and not a place in the base.",
            consequence="Such a move is in air; it is not corrected and needs no correction.",
            action="Nothing needs to be done.",
            example="`G28 Z0`.",
        ),
        "GCO005": Code(
            "warning",
            "variable or expression",
            meaning="A word has a variable or an expression whose value is not known, or the block sets a variable.",
            consequence="The target is unknown or other blocks use it, so the motion is not corrected.",
            action="Let the post-processor write numbers.",
            example="`G1 X[#1+5]`.",
        ),
        "GCO006": Code(
            "warning",
            "motion in a loop, branch or subprogram",
            meaning="The motion may run many times or never.",
            consequence="Its correction could differ from run to run, so it is not corrected.",
            action="Write the cut as a straight run of blocks.",
            example="`WHILE [#1 LT 5] DO1`.",
        ),
        "GCO007": Code(
            "warning",
            "call of code that is not read",
            meaning="The called code may move the machine and change modes.",
            consequence="Position and modes are unknown after it until they are set again.",
            action=(
                "Put the file of the subprogram (POCKET.SPF, O1000.nc) beside the program, or one with M99 alone if it "
                "moves and changes nothing; or write its blocks in place of the call; or set modes and X, Y, Z after "
                "it."
            ),
            example="`M98 P1000`.",
        ),
        "GCO008": Code(
            "warning",
            "canned cycle",
            meaning=(
                "The control generates the motions of a cycle itself. Holes of G73, G74, G81 to G86, G88 and G89 under "
                "G90 are corrected where X, Y, depth and R are known; R stays, it is a plane in air."
            ),
            consequence="What the cycle cuts is not in this block, so the block is not corrected.",
            action="Let the post-processor write cycles as single motions.",
            example="`G91 G81 X10 Z-10 R2 L5`.",
        ),
        "GCO009": Code(
            "warning",
            "tool radius compensation",
            meaning="Under G41 and G42 the control computes the path of the tool's centre.",
            consequence=(
                "The programmed contour is not the path of the tool, so the motion is not corrected."
            ),
            action=(
                "Let the post-processor write the path of the tool's centre (compensation in the CAM system)."
            ),
            example="`G41 D1`.",
        ),
        "GCO010": Code(
            "warning",
            "coordinates are not those of the base",
            meaning="The coordinates are rotated, scaled, mirrored, polar, or diameters.",
            consequence="Their place in the base is not followed, so the motion is not corrected.",
            action="Let the post-processor write coordinates of the base itself.",
            example="`G51 P2.`.",
        ),
        "GCO011": Code(
            "info",
            "probing",
            meaning="A probing move ends where the probe touches.",
            consequence="Its end is unknown and needs no correction.",
            action="Nothing needs to be done.",
            example="`G38.2 Z-20`.",
        ),
        "GCO012": Code(
            "warning",
            "arc is not understood",
            meaning="Start, end, centre and plane do not define an arc.",
            consequence="Controls treat such a block differently, so it is not corrected.",
            action="Check start, end and centre of the arc, and G17, G18, G19.",
            example="`G2 X10 Y0 R3` where the end is 10 mm away.",
        ),
        "GCO013": Code(
            "warning",
            "rotary axes without a TCP mode",
            meaning=(
                "The rotary axes are not at 0, or not known, and no TCP mode such as G43.4 is active; or they are not "
                "known under one."
            ),
            consequence=(
                "The place of the tool depends on the machine's geometry, so the motion is not corrected."
            ),
            action=(
                "Let the post-processor write tip coordinates (G43.4), or all motions with the rotary axes at 0; or "
                "state in the cell what the rotary words do (dialect: {rotary_words: part} or tip)."
            ),
            example="`G1 X10 B30` without G43.4.",
        ),
        "GCO014": Code(
            "warning",
            "work offset is not known",
            meaning=(
                "The program writes the offset itself by values that are not known, or it is unclear which "
                "one is active."
            ),
            consequence="The place of the target in the cell is unknown, so the motion is not corrected.",
            action=(
                "Select the offset with G54 to G59, and define offsets in the cell and not in the program."
            ),
            example="`G10 L2 P1 X5`, then `G54`.",
        ),
        "GCO015": Code(
            "warning",
            "tool is not known",
            meaning="No tool is loaded, or its number is not known, or the program itself writes its length.",
            consequence="Length and load of the tool are unknown, so the motion is not corrected.",
            action="Load a tool by number before the cut.",
            example="`T#5 M6`.",
        ),
        "GCO016": Code(
            "warning",
            "other motion",
            meaning="The block is a spline, a thread, a rounded corner or a motion of a further axis.",
            consequence="This tool does not follow such a path, so the block is not corrected.",
            action="Let the post-processor write it as G1, G2 and G3.",
            example="`G33 Z-20 K1.5`.",
        ),
        "GCO017": Code(
            "warning",
            "words contradict each other",
            meaning="Two words of the block exclude each other.",
            consequence="Controls differ in which word they execute, so the block is not corrected.",
            action="Write every word once.",
            example="`G1 G2 X10`.",
        ),
        "GCO018": Code(
            "warning",
            "no motion code is active",
            meaning="The block has axis words before any G0, G1, G2 or G3.",
            consequence="Controls start in different modes, so the motion is not corrected.",
            action="Write G0, G1, G2 or G3 before it.",
            example="`X10 Y10` as the first block.",
        ),
        "GCO019": Code(
            "warning",
            "origin is not known",
            meaning="Something that is not read moves the origin, or G92 sets it where the position is not known.",
            consequence="The motions after it have no known place, so they are not corrected.",
            action="Move to known X, Y and Z before it, or remove it and define the base in the cell.",
            example="`G92 X0 Y0` as the first block.",
        ),
        "GCO020": Code(
            "info",
            "unit is not stated",
            meaning="No code selects mm or inch; mm is assumed.",
            consequence="In inches every correction would be wrong by a factor of 25.4.",
            action="Write G21 or G20.",
            example="A program without G20 and G21.",
        ),
        "GCO021": Code(
            "info",
            "tool is not stated",
            meaning="The program names no tool; tool 1 of the cell is assumed.",
            consequence="Length and load of another tool would lead to another correction.",
            action="Load a tool with T, or check that the cell's tool 1 is the right one.",
            example="A program without T.",
        ),
        "GCO022": Code(
            "warning",
            "words without a decimal point",
            meaning=(
                "The cell counts such words in increments, but the control of this dialect does not; or it does, and "
                "the program has words that are too large for mm and too small for increments."
            ),
            consequence="A wrong reading differs by a factor of 1000.",
            action=(
                "Write `dialect: {name: fanuc, integer_words: um}` in the cell if the control counts "
                "increments."
            ),
            example="`X10` for 10 um.",
        ),
        "GCO023": Code(
            "info",
            "length of another tool",
            meaning=(
                "G43 names an H number that is not the tool's number, or no G43 follows the change of the tool; the "
                "cell's tool is used."
            ),
            consequence="With another length the tool tip would be elsewhere.",
            action="Check that the cell's tool has the intended length.",
            example="`T3 M6`, then `G43 H5`.",
        ),
        "GCO024": Code(
            "warning",
            "program writes offsets",
            meaning="The program writes bases or tools of the control.",
            consequence="The control's offsets then differ from those of the cell.",
            action="Define offsets and tools in the cell; check that both agree.",
            example="`G10 L1 P3 R120`.",
        ),
        "GCO025": Code(
            "info",
            "motion after the end",
            meaning="The motion follows M2, M30 or M99.",
            consequence="It does not run and is not corrected.",
            action="Nothing needs to be done.",
            example="`M30`, then `G1 X10`.",
        ),
        "GCO026": Code(
            "warning",
            "further axes move",
            meaning="An axis moves that is not one of X, Y, Z, E1 to E6 and the rotary axes.",
            consequence=(
                "If it carries the robot or the part, both are elsewhere than the cell states, so the "
                "motions are not corrected."
            ),
            action=(
                "State in the cell what carries robot or part, and which word names it (external_axes: with word:); or "
                "let the post-processor name it E1 to E6."
            ),
            example="`G1 X10 W50`.",
        ),
        "GCO027": Code(
            "info",
            "words without a decimal point are decided",
            meaning=(
                "A control of this kind counts X10 as 10 mm or as 10 increments, and the cell does not state which."
            ),
            consequence="A wrong reading differs by a factor of 1000.",
            action="State `dialect: {integer_words: mm}` or `um` in the cell.",
            example="`X30500` beside `X30.5`.",
        ),
        "GCO028": Code(
            "info",
            "M code is not known",
            meaning="The machine's builder gives such a code its meaning.",
            consequence="It is assumed that it moves no axis; if it does, the positions after it are wrong.",
            action="Check that it moves no axis; if it does, state X, Y and Z in the motion after it.",
            example="`M405`.",
        ),
        "GCO029": Code(
            "warning",
            "tool offset is not active",
            meaning="The tool's length is off (G49, D0), and the program moves at feed.",
            consequence=(
                "Its coordinates are not those of the tool tip that is stated in the cell, so it is not corrected."
            ),
            action="Select the tool's length (G43, D1) before the cut.",
            example="`G49`, then `G1 Z-5`.",
        ),
        "GCO030": Code(
            "info",
            "the program may end early",
            meaning="A block that runs only sometimes ends the program.",
            consequence="The motions after it may not run; where they run, they are corrected.",
            action="Nothing needs to be done.",
            example="`/M30` before the last cut.",
        ),
        "GCO031": Code(
            "info",
            "centres are coordinates",
            meaning="No code selects what I J K are; the radii of the arcs agree only if they are coordinates.",
            consequence="Read otherwise the arcs would be others.",
            action="Write G90.1 or G91.1.",
            example="`G3 X5 Y5 I5 J0` after `G1 X10 Y0`.",
        ),
        "GCO032": Code(
            "info",
            "another file is read too",
            meaning="A subprogram that the program calls is in a file beside it.",
            consequence="It is followed, so that what it leaves is known; it is never written.",
            action="Load the same file on the control.",
            example="`POCKET` with POCKET.SPF in the folder of the program.",
        ),
        "GCO033": Code(
            "warning",
            "motion in another file",
            meaning="The motion is in a subprogram that has a file of its own.",
            consequence="It is not corrected, as only the program itself is written.",
            action="Put the subprogram into the file of the program, or correct its file by itself.",
            example="`M98 P1234` with O1234.nc beside the program.",
        ),
        "GCO034": Code(
            "info",
            "tool along a plane that the program states",
            meaning=(
                "G53.1 and CYCLE800 bring the tool along the normal of the plane; how far it then turns about its own "
                "axis is the machine's. It is taken as turned from the cell's orientation by the least angle."
            ),
            consequence="Another turn about the tool's axis is another pose of the arm, and another correction.",
            action="Check in a simulation that the tool has this orientation.",
            example="`G68.2 X0 Y0 Z0 I0 J30 K0` and `G53.1`.",
        ),
        "SIN001": Code(
            "info",
            "tool is called by a name",
            meaning="Named tools are numbered 1, 2 ... in the order in which the program names them.",
            consequence="Another tool of the cell would lead to another correction.",
            action="Check that the cell's tools of these numbers are the right ones; or write T=1.",
            example='`T="MILL_20"`.',
        ),
        "GCW001": Code(
            "warning",
            "arc cannot be written",
            meaning=(
                "No numbers of the block express the corrected arc, for example a full circle that does not "
                "close."
            ),
            consequence="The cut is not corrected, because a rounded arc would leave the tolerance.",
            action="Let the post-processor write the arc as shorter arcs or as lines.",
            example="A full circle of which start and end get different corrections.",
        ),
        "GCW003": Code(
            "warning",
            "hole cannot be written",
            meaning="The correction is as large as the distance of the hole's depth from R.",
            consequence="The hole is not corrected: R stays, and controls refuse a depth above it.",
            action="Let the post-processor write a higher R, or the hole as single motions.",
            example="`G81 X10 Z-0.1 R0` where the tool deflects by 0.2 mm.",
        ),
        "GCW002": Code(
            "warning",
            "orientation cannot be written",
            meaning="The words of the block cannot express the corrected orientation of the tool.",
            consequence="The motion is not corrected.",
            action="Correct positions only, or let the post-processor write rotary words in this block.",
            example="A block with X, Y, Z only, whose correction tilts the tool.",
        ),
        "GCW004": Code(
            "warning",
            "line would be too long",
            meaning="With the digits of the correction the line has more characters than the control reads.",
            consequence="The motion is not corrected, because the control would stop at the line.",
            action="Write a shorter comment in the line, or the comment in a line of its own.",
            example="A line of 250 characters under LinuxCNC.",
        ),
    }
)
