"""The codes of the findings of RAPID."""

from __future__ import annotations

from postproc.base.findings import Code, Topic, define
from postproc.languages.core.finding_codes import STAYS, warning

CODES = define(
    {
        "RAP001": warning(
            "statement is not understood",
            "The statement contains something that this tool does not know.",
            "Its motion is not corrected; what it may change is not known after it.",
            "Write the motion as MoveL, MoveJ, MoveC or MoveAbsJ with target, speed, zone and tool.",
            "`MoveL p10 v100, z1, tool0;` (a comma is missing).",
        ),
        "RAP002": warning(
            "target is not a constant",
            "The target depends on what the program computes where it runs, or differs between executions.",
            "A correction for one value would be wrong for the others, so the motion is not corrected.",
            "Write the target as numbers: [[x,y,z],[q1,q2,q3,q4],[cf1,cf4,cf6,cfx],[...]].",
            "`MoveL Offs(p10, 0, 0, i * 5), v100, z1, tool0;` in a loop over i.",
        ),
        "RAP003": warning(
            "point is not declared",
            "The file does not declare this point.",
            "Its coordinates are unknown, so the motion is not corrected.",
            "Declare the point in the module of the motion.",
            "`MoveL pFromAnotherModule, v100, z1, tool0;`.",
        ),
        "RAP004": warning(
            "quaternion is not of length 1",
            "The length of the quaternion of the target differs from 1 by more than 0.01.",
            "The controller refuses it, or runs another orientation.",
            "Write a quaternion whose squares add up to 1.",
            "`[0,0,0,0]` of a target that was never set.",
        ),
        "RAP005": warning(
            "tool or work object is not known",
            "Neither the file nor the cell states the tool or the work object of the motion in numbers.",
            "The place of the target in the cell is unknown, so the motion is not corrected.",
            "Declare it in the module, or bind its name in the cell: symbols: {tSpindle: 1} for tool 1 of the"
            " cell, or symbols: {wPart: {X: .., Y: .., Z: .., A: .., B: .., C: ..}}.",
            "`MoveL p10, v100, z1, tSpindle;` where another module declares tSpindle.",
        ),
        "RAP006": warning(
            "force comment differs with the path of the program",
            "Several FORCE or COMPENSATE comments may be in force at the motion.",
            "Which force acts there is not known, so the motion is not corrected.",
            "Repeat the comment before the motion.",
            "A routine that is called once after FORCE 0 100 0 and once after FORCE OFF.",
        ),
        "RAP007": warning(
            "structure is not understood",
            "A block, a routine or the module has no end of its own, a label is missing, or a name is declared twice.",
            "Whether and how often the motions run is not known, so they are not corrected.",
            "Close every block and routine, and give each label and routine a name of its own.",
            "An IF without its ENDIF.",
        ),
        "RAP008": warning(
            "target is displaced",
            "A displacement, an offset, a sensor or soft servos are in force at the motion.",
            "The robot goes elsewhere than to the target of the text, so the motion is not corrected.",
            "Remove the displacement before the cut (PDispOff, EOffsOff), or check these motions by other means.",
            "`PDispSet offset;` before the cut.",
        ),
        "RAP009": warning(
            "motion is not run in the known flow",
            "The motion is in a trap, an error handler or a function, or the flow does not reach it.",
            "When it runs, and from where, is not known, so it is not corrected.",
            "Nothing needs to be done if the motion is no cut.",
            "A motion after ERROR.",
        ),
        "RAP010": warning(
            "call of a routine that is not in the file",
            "The called routine may move the robot.",
            "The position is unknown after the call; data of this module, frames, speeds (VelSet) and displacements are"
            " assumed unchanged.",
            "Check what the routine does.",
            "`rToolChange 4;` is declared in another module.",
        ),
        "RAP011": warning(
            "work object moves",
            "A mechanical unit moves the work object (ufprog is FALSE, or ufmec names a unit).",
            STAYS,
            "Use a work object that is fixed in the cell.",
            '`[FALSE,FALSE,"STN1",...]`.',
        ),
        "RAP012": warning(
            "path of an arc is not known",
            "The start of the arc is not known in numbers, or its points define no circle, or too short a one.",
            "Without the circle no point on the path can be corrected, so the arc is not corrected.",
            "Write a MoveL before the arc, and the arc with three distinct points.",
            "`MoveC p1, p1, v100, z1, tool0;`.",
        ),
        "RAP013": warning(
            "stationary tool",
            "The work object is on the robot, and the tool is fixed in the cell (robhold).",
            STAYS,
            "Check these motions by other means; this version corrects programs with the tool on the robot.",
            "`PERS tooldata tFixed := [FALSE,...];`.",
        ),
        "RAP014": warning(
            "synchronised motion",
            "The motion is synchronised with another robot or positioner (\\ID).",
            STAYS,
            "Check these motions by other means.",
            "`MoveL p10 \\ID:=10, v100, z1, tool0;`.",
        ),
        "RAP015": warning(
            "point is shared by several motions",
            "Several motions, or other code, use the point, and it cannot be split.",
            "A changed point would move the others too, so none of them is corrected.",
            "Give the motions points of their own, or allow copies with --shared-points copy-inline.",
            "p10 is the end of a cut and the start of another one.",
        ),
        "RAP016": warning(
            "comment has no effect",
            "A FORCE or COMPENSATE comment is where no statement is run.",
            "It applies to no motion.",
            "Write it in a routine, before the first motion to which it applies.",
            "`! FORCE 0 100 0` between two routines.",
        ),
        "RAP017": warning(
            "flow is too long to follow",
            "Calls and loops execute more statements than this tool follows.",
            "The motions of the file are not corrected.",
            "Let the post-processor write the path as a straight run of motions.",
            "Routines that call each other many thousand times.",
        ),
        "RAP018": warning(
            "file is not RAPID",
            "The file has no MODULE.",
            "It may be in another language, and then nothing of it is read correctly.",
            "Check the file, or name its language in the cell: dialect: {name: ...}.",
            "A text with the ending .mod.",
        ),
        "RAP019": warning(
            "external axis is not known",
            "The place of an external axis at the motion is not known.",
            STAYS,
            "Write the external axes of the target as numbers.",
            "`[[...],[...],[...],extax]` where extax is computed.",
        ),
        "RAP022": Code(
            "warning",
            "external axes move",
            meaning="The program contains motions of external axes.",
            consequence="Where they carry the robot or the part, the place of each cut depends on them.",
            action="Declare in the cell what each of them carries: external_axes.",
            example="`[[...],[...],[...],[500,9E9,9E9,9E9,9E9,9E9]]` on a track.",
            topic=Topic.EXTERNAL_AXES,
        ),
    }
)
