"""The codes of the findings of KRL."""

from __future__ import annotations

from postproc.base.findings import Code, Topic, define

CODES = define(
    {
        "FIL011": Code(
            "error",
            "name cannot name a KRL module",
            meaning=(
                "A KRL module has the name of its file: a letter or _, then letters, digits or _, 24 "
                "characters at most."
            ),
            consequence="The controller does not load a module whose name and file name differ.",
            action="Choose such a name with -o.",
            example="`compensate panel.src -o panel-2.src` contains a minus sign.",
        ),
        "KRL001": Code(
            "warning",
            "motion is not understood",
            meaning="The text of the motion contains something that this tool does not know.",
            consequence="The motion is not corrected and stays as programmed, and so does its cut.",
            action="Write it as PTP or LIN with an aggregate of numbers.",
            example="`LIN P1 FOO_DIS`.",
        ),
        "KRL002": Code(
            "warning",
            "target is not a constant",
            meaning=(
                "The target depends on what the program does not contain: inputs, other programs, variables."
            ),
            consequence=(
                "A correction for one value would be wrong for the others, so the motion is not corrected."
            ),
            action=(
                "Write the target as numbers: LIN {X .., Y .., Z .., A .., B .., C ..}; or state in the cell "
                "what only the controller knows (symbols:)."
            ),
            example="`LIN {X myOffset, Y 0, Z 0}` where myOffset is read from an input.",
        ),
        "KRL003": Code(
            "warning",
            "point is not declared",
            meaning="Neither the program nor its .dat declares this point.",
            consequence="Its coordinates are unknown, so the motion is not corrected.",
            action=(
                "Put the module's .dat beside its .src, declare the point there, give the $config.dat that "
                "declares it, or state it in the cell (symbols:)."
            ),
            example="`LIN XP7` without panel.dat beside panel.src.",
            topic=Topic.UNDECLARED_POINT,
        ),
        "KRL004": Code(
            "warning",
            "components are missing",
            meaning="The point omits components, and the point before it is not known.",
            consequence=(
                "The omitted components keep their previous values, which this tool cannot determine here."
            ),
            action="Write all of X, Y, Z, A, B, C in the first Cartesian motion after the unknown point.",
            example="`LIN {X 10}` after a call that may move the robot.",
        ),
        "KRL005": Code(
            "warning",
            "base or tool is not known",
            meaning="No $BASE or $TOOL that this tool can read is set before the motion.",
            consequence="The place of the target in the cell is unknown, so the motion is not corrected.",
            action=(
                "Set $BASE and $TOOL before it, to numbers or to BASE_DATA[n] and TOOL_DATA[n]; or state in the "
                "cell the frames at the start (program_start:) and the records that no file declares "
                "(symbols:, such as FHOME: {TOOL_NO: 1, BASE_NO: 0})."
            ),
            example="A program that relies on the base which another program set.",
        ),
        "KRL006": Code(
            "warning",
            "motion in a block whose structure is not understood",
            meaning="The block has no end of its own, contains an ELSEIF, or is nested deeper than 100 blocks.",
            consequence="Whether and how often the motion runs is not known, so it is not corrected.",
            action="Close every block, and write ELSEIF as ELSE and IF.",
            example="`IF $IN[3] THEN`, `LIN P4`, and no ENDIF.",
        ),
        "KRL007": Code(
            "warning",
            "point is shared by several motions",
            meaning="Several motions use the point with different corrections, and it cannot be split.",
            consequence="A changed point would move the other motions too, so none of them is corrected.",
            action=(
                "Give the motions points of their own, or allow copies with --shared-points copy-inline"
                " or copy-dat."
            ),
            example="P4 is the end of a cut at the bottom and the start of another one under another load.",
        ),
        "KRL008": Code(
            "warning",
            "relative motion",
            meaning="The end of the motion is not known in numbers, or the motion rotates the tool.",
            consequence="The motion and the one before it are not corrected.",
            action="Write the motion and the one before it with absolute targets.",
            example="`LIN_REL {A 5}`.",
        ),
        "KRL009": Code(
            "warning",
            "path of an arc is not known",
            meaning="The start or auxiliary point is not known in numbers, or the points define no circle.",
            consequence=(
                "Without the circle no point on the path can be corrected, so the arc is not corrected."
            ),
            action=(
                "Write the motion before the arc with all components, and the arc with three distinct points."
            ),
            example="`CIRC P1, P1`.",
        ),
        "KRL010": Code(
            "warning",
            "call of a program that is not read",
            meaning="The called program may move the robot or change base and tool.",
            consequence="The position is unknown after the call; base and tool are assumed unchanged.",
            action="Check what the routine does; write all components in the motion after it.",
            example="`TOOL_CHANGE(4)` is declared in another module.",
        ),
        "KRL011": Code(
            "warning",
            "base moves with an external kinematic",
            meaning=(
                "The place of the base depends on external axes, and the program alone does not state how."
            ),
            consequence="The motion is not corrected.",
            action=(
                "Set $BASE to numbers or to BASE_DATA[n] for this cut, and declare the axes in the cell"
                " (external_axes)."
            ),
            example="`$BASE = EK(MACHINE_DEF[2].ROOT, #EASYS, BASE_DATA[2])`.",
        ),
        "KRL012": Code(
            "warning",
            "frame is an expression",
            meaning="The program computes $BASE or $TOOL from values that are not constants.",
            consequence=(
                "The motions after it are not corrected, because their place in the cell is unknown."
            ),
            action="Set the frame to numbers or to BASE_DATA[n] and TOOL_DATA[n].",
            example="`$BASE = measured : {X 0, Y 0, Z 5, A 0, B 0, C 0}`.",
        ),
        "KRL013": Code(
            "warning",
            "stationary tool",
            meaning="With $IPO_MODE=#TCP the robot carries the part and the tool is fixed in the cell.",
            consequence="Such motions are not corrected.",
            action=(
                "Check these cuts by other means; this version corrects programs with the tool on the "
                "robot only."
            ),
            example="`$IPO_MODE = #TCP` before the cut.",
        ),
        "KRL014": Code(
            "warning",
            "block is not closed",
            meaning="A loop, branch or DEF has no end, or an end has no start.",
            consequence="The flow of the program is not reliable, so the motions in it are not corrected.",
            action="Close every block and every DEF.",
            example="A FOR without its ENDFOR.",
        ),
        "KRL015": Code(
            "warning",
            "motion in a local subprogram",
            meaning=(
                "An interrupt or trigger calls the subprogram, or it is also called from where its frames or "
                "values are not known."
            ),
            consequence="The motion may run at several places, so it is not corrected.",
            action="Set base and tool in the subprogram, and call it with constant values.",
            example="`POCKET(depth)` where depth is an input.",
        ),
        "KRL016": Code(
            "info",
            "point of the controller",
            meaning="A PTP moves to a point that the controller declares, such as HOME.",
            consequence="It is an air move; it is not corrected and needs no correction.",
            action="Nothing needs to be done.",
            example="`PTP HOME`.",
            topic=Topic.HOME,
        ),
        "KRL017": Code(
            "warning",
            "frame change before a partial point",
            meaning="The point omits components, and base or tool changes before it.",
            consequence=(
                "The documentation does not define the missing components in the new frame, so the "
                "motion is not corrected."
            ),
            action="Write all of X, Y, Z, A, B, C in the first motion after the change of frame.",
            example="`$BASE = BASE_DATA[2]`, then `LIN {X 10}`.",
        ),
        "KRL018": Code(
            "warning",
            "file is not KRL",
            meaning="The file has no DEF.",
            consequence="It may be G-code or another language, and then nothing of it is read correctly.",
            action="Check the file, or name its language in the cell: dialect: {name: ...}.",
            example="A G-code program with the ending .src.",
        ),
        "KRL019": Code(
            "warning",
            "declaration is not understood",
            meaning="A point in the .dat cannot be read.",
            consequence="The motions that use the point are not corrected.",
            action="Write the declaration as an aggregate of numbers.",
            example="`DECL E6POS XP1={X 10, Y offset}`.",
        ),
        "KRL021": Code(
            "warning",
            "path is in another file",
            meaning="A technology package reads the path from data beside the program.",
            consequence="The program contains no motion of that path, so nothing of it is corrected.",
            action="Export the path as motions of the program.",
            example="A spline file that a technology package reads.",
        ),
        "KRL022": Code(
            "warning",
            "external axes move",
            meaning="The program contains motions of external axes.",
            consequence="Where they carry the robot or the part, the place of each cut depends on them.",
            action="Declare in the cell what each of them carries: external_axes.",
            example="`LIN {X 10, Y 0, Z 0, E1 500}` on a linear unit.",
            topic=Topic.EXTERNAL_AXES,
        ),
        "KRL023": Code(
            "warning",
            "motion never runs",
            meaning="The flow that the program's constants define does not reach this motion.",
            consequence="It is not corrected, because no run of the program executes it.",
            action="Nothing needs to be done if the motion is not meant to run.",
            example="A motion after `GOTO END_OF_CUT`.",
        ),
        "KRL024": Code(
            "warning",
            "flow is too long to follow",
            meaning="Loops and calls execute more statements than this tool follows.",
            consequence="Only those of their motions are corrected that are the same in every pass.",
            action="Let the post-processor write the loop as a straight run of motions.",
            example="A loop of a million passes.",
        ),
        "KRL025": Code(
            "warning",
            "letters that KRL does not have",
            meaning="Names in KRL consist of the letters A to Z, digits, _ and $.",
            consequence="What such a statement does, and what it sets, is not known.",
            action=(
                "Write the names with the letters A to Z; retype a word that only looks like a word of KRL."
            ),
            example="`LIN` with a Cyrillic letter I.",
        ),
        "KRL031": Code(
            "warning",
            "unusual orientation control",
            meaning=(
                "$ORI_TYPE, $CIRC_TYPE or the motion's record sets an orientation control that this "
                "tool does not know."
            ),
            consequence=(
                "The orientation of the tool between the points is unknown, so the motion is not corrected."
            ),
            action=(
                "Set $ORI_TYPE=#VAR for this cut and state the orientations of its targets; with $CIRC_TYPE=#PATH the "
                "tool still turns with the arc."
            ),
            example="`$ORI_TYPE = #JOINT` before a LIN that rotates the tool.",
        ),
        "KRL033": Code(
            "info",
            "another file is read too",
            meaning="Points, records or routines that the program names are declared in files beside it.",
            consequence="They are read and never written; the result is computed from what they contain.",
            action="Load the same files on the controller; state in the cell (symbols:) what differs there.",
            example="$config.dat with FHOME and XHOME, in the folder System beside the program's folder.",
        ),
        "KRL034": Code(
            "warning",
            "statement that is not understood",
            meaning="The statement, or a word in it, is none that this tool knows.",
            consequence="After it, what it may assign is not known; all else is read as it was before it.",
            action="Correct the statement, or check that it changes no position, base or tool.",
            example="`WAIT SEC 0.5 0.7`, or `IF $IN[1] THAN`.",
        ),
        "KRL035": Code(
            "info",
            "advance run stops",
            meaning=(
                "A statement between two motions stops the advance run, or may: it waits, or it reads or sets inputs, "
                "outputs or where the robot is, and no CONTINUE is before it."
            ),
            consequence="The controller cannot approximate the motion before it; the path is computed with a stop.",
            action="State CONTINUE before the statement, or use TRIGGER, if the motion is to be approximated.",
            example="`$OUT[1]=TRUE` between two `LIN ... C_DIS`.",
        ),
        "KRL036": Code(
            "warning",
            "force comment differs with the path of the program",
            meaning="Several FORCE or COMPENSATE comments may be in force at the motion.",
            consequence="Which force acts there is not known, so the motion is not corrected.",
            action="Repeat the comment before the motion.",
            example="A motion after an IF in which `;FORCE 0 100 0` is.",
        ),
        "KRL037": Code(
            "warning",
            "variable of the controller whose effect is not known",
            meaning="The program sets a variable, and this tool does not know what that does to motions.",
            consequence="Motions, frames and speeds are read as if it was not set.",
            action="Check in the controller's documentation that it changes no path, speed, tool, base or load.",
            example="`$TECH[1].MODE=#CYCLE`, by which the controller weaves.",
        ),
    }
)
