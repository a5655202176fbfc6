"""The codes of the findings of Fanuc TP."""

from __future__ import annotations

from postproc.base.findings import Code, Topic, define
from postproc.languages.core.finding_codes import STAYS, warning

CODES = define(
    {
        "FTP001": warning(
            "statement is not understood",
            "The statement contains something that this tool does not know.",
            "Its motion is not corrected; where the robot is and which frames are selected is not known after it.",
            "Write the motion as J, L, C or A with P[n], speed, and FINE, CNT or CR.",
            "`L P[1] 100mm FINE ;` (a speed has no unit of length alone).",
        ),
        "FTP002": warning(
            "target is computed",
            "The target is a position register, or a point that the program computes or assigns where it runs; or the"
            " program reads the place at which the motion ends.",
            "A correction for one value would be wrong for the others, so the motion is not corrected.",
            "Write the target as a point of /POS.",
            "`L PR[1] 100mm/sec FINE ;`.",
        ),
        "FTP003": warning(
            "point is not in /POS",
            "The file has no such point.",
            "Its coordinates are unknown, so the motion is not corrected.",
            "Save the program again with its points, or add the point.",
            "`L P[7] 100mm/sec FINE ;` in a file without P[7].",
        ),
        "FTP004": warning(
            "point is not complete",
            "The point does not state all of its numbers, is there twice, or its configuration is not read.",
            STAYS,
            "Set the point again, or write X, Y, Z, W, P, R and a configuration such as 'N U T, 0, 0, 0'.",
            "`X = ********  mm` of a point that was never taught.",
        ),
        "FTP005": warning(
            "frame of the point is not the selected one",
            "UFRAME_NUM or UTOOL_NUM in force is not the UF or UT of the point, or neither is stated.",
            "The controller refuses such a motion, or runs it in another frame; it is not corrected.",
            "Select the frame of the point before the motion.",
            "`UFRAME_NUM=2 ;` before a point with UF : 1.",
        ),
        "FTP006": warning(
            "force comment differs with the path of the program",
            "Several FORCE or COMPENSATE comments may be in force at the motion.",
            "Which force acts there is not known, so the motion is not corrected.",
            "Repeat the comment before the motion.",
            "A JMP around `!FORCE 0 100 0 ;`.",
        ),
        "FTP007": warning(
            "structure is not understood",
            "A block has no end, a label is missing or there twice, or a section of the file is missing.",
            "Whether and how often the motions run is not known, so they are not corrected.",
            "Check labels, IF, ENDIF, FOR, ENDFOR, and the sections /MN, /POS and /END; end every statement with ;.",
            "`JMP LBL[5] ;` in a program without LBL[5].",
        ),
        "FTP008": warning(
            "target is displaced",
            "An offset, an increment, tracking, weaving or soft servos may displace the target.",
            "The robot goes elsewhere than to the point of the text, so the motion is not corrected.",
            "Write the points where the tool is to go, or check these motions by other means.",
            "`L P[1] 100mm/sec FINE Offset,PR[1] ;`.",
        ),
        "FTP009": warning(
            "motion is not reached",
            "The flow of the program does not reach the motion.",
            "When it runs, and from where, is not known, so it is not corrected.",
            "Nothing needs to be done if the motion is no cut.",
            "A motion after END.",
        ),
        "FTP010": warning(
            "call of another program",
            "The called program may move the robot and select frames.",
            "The position and the selected frames are unknown after the call; those of the points are taken."
            " Speeds (OVERRIDE) and displacements are assumed unchanged.",
            "Check what the program does.",
            "`CALL TOOL_CHANGE(4) ;`.",
        ),
        "FTP011": warning(
            "several motion groups",
            "The motion is coordinated with another motion group, or moves one.",
            STAYS,
            "Check these motions by other means.",
            "`L P[1] 100mm/sec FINE COORD ;`, or a point with GP2.",
        ),
        "FTP012": warning(
            "path of an arc is not known",
            "The start of the arc is not known in numbers, its points define no circle, the tool does not turn evenly"
            " along it, or a run of A motions is not on one circle.",
            "Without the circle no point on the path can be corrected, so the arc is not corrected.",
            "Write an L motion to the start of the arc, and the arc as C with points that are apart.",
            "`C P[1] P[1] 100mm/sec FINE ;`.",
        ),
        "FTP013": warning(
            "motion may end early",
            "A signal may end the motion before its target (Skip).",
            STAYS,
            "Check these motions by other means.",
            "`L P[1] 10mm/sec FINE Skip,LBL[1] ;`.",
        ),
        "FTP014": warning(
            "path of the tool to axes",
            "The point states axes, and the motion is a line or an arc.",
            STAYS,
            "Write the point as X, Y, Z, W, P, R.",
            "`L P[1] 100mm/sec FINE ;` with `P[1]{ GP1: UF : 1, UT : 1, J1= 0.000 deg, ...`.",
        ),
        "FTP015": warning(
            "point is shared by several motions",
            "Several motions, or other statements, use the point, and it is not split.",
            "A changed point would move the others too, so none of them is corrected.",
            "Give the motions points of their own, or allow copies (without --shared-points keep).",
            "P[1] is the end of a cut and the start of another one.",
        ),
        "FTP016": warning(
            "comment has no effect",
            "A FORCE or COMPENSATE comment is where no statement is run.",
            "It applies to no motion.",
            "Write it before the first motion to which it applies.",
            "`!FORCE 0 100 0 ;` after END.",
        ),
        "FTP017": Code(
            "info",
            "frames of points are taken",
            meaning="UFRAME_NUM or UTOOL_NUM is not known at a motion; the frame of its point is taken.",
            consequence=(
                "The controller refuses the motion where another frame is selected, unless that check is switched off"
                " ($FRM_CHKTYP)."
            ),
            action="Select the frames at the start of the program, and after each call.",
            example="A program without UFRAME_NUM=.",
        ),
        "FTP018": warning(
            "file is no TP program",
            "The file has no /MN.",
            "It may be in another language, and then nothing of it is read correctly.",
            "Check the file, or name its language in the cell: dialect: {name: ...}.",
            "A text with the ending .ls.",
        ),
        "FTP019": warning(
            "LINE_COUNT is not the number of lines",
            "The attribute LINE_COUNT differs from the number of numbered lines of /MN.",
            "It is not corrected: what wrote the file may know why; a controller may refuse the file.",
            "Check that the file is complete.",
            "`LINE_COUNT = 12;` of a program with 14 lines.",
        ),
        "FTP020": warning(
            "program sets a frame",
            "The user frame or the tool of the motion is set by the program.",
            "The place of the target in the cell is unknown, so the motion is not corrected.",
            "State the frame in the controller and in the cell, and remove the assignment.",
            "`UFRAME[1]=PR[5] ;`.",
        ),
        "FTP021": Code(
            "error",
            "name cannot name a TP program",
            meaning="The name of a TP program is a letter, then letters, digits or _, 36 characters at most.",
            consequence="The controller does not load a program of another name.",
            action="Choose such a name with -o.",
            example="`compensate part.ls -o part-2.ls` contains a minus sign.",
        ),
        "FTP022": Code(
            "warning",
            "external axes move",
            meaning="The program contains motions of external axes.",
            consequence="Where they carry the robot or the part, the place of each cut depends on them.",
            action="Declare in the cell what each of them carries: external_axes.",
            example="`E1 = 500.000 mm` of a point on a track.",
            topic=Topic.EXTERNAL_AXES,
        ),
    }
)
