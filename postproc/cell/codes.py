"""The codes of the findings of the cell."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "CEL001": Code(
            "error",
            "no cell",
            meaning="No cell.yaml is in the program's folder or above it, and --cell names none.",
            consequence=(
                "The cell states robot, bases, tools and tolerance, which the program does not contain."
            ),
            action="Put a cell.yaml beside the program or above it, or name one with --cell.",
            example="A program alone in a new folder.",
        ),
        "CEL002": Code(
            "error",
            "frame is missing",
            meaning="The program uses a base or tool number that neither it nor the cell defines.",
            consequence="The place of the cut relative to the robot is unknown.",
            action=(
                "Add the frame to the cell: bases: {1: {x: ..., y: ..., z: ..., a: ..., b: ..., c: ...}}."
            ),
            example="`$BASE = BASE_DATA[3]` with a cell that defines bases 1 and 2.",
        ),
        "CEL010": Code(
            "error",
            "absolute accuracy is not stated",
            meaning="The cell does not state whether the controller corrects the robot's geometry itself.",
            consequence="A geometry error would be corrected twice.",
            action="State it: controller: {absolute_accuracy: true} or false.",
            example="`correct: absolute` without `controller:`.",
        ),
        "CEL013": Code(
            "warning",
            "side of a wall is not stated",
            meaning="tool_errors states the radius of a tool, and not on which side of the feed its walls lie.",
            consequence="The larger or smaller radius is not corrected in the operations that the message names.",
            action="Add walls: {OPERATION: left}, right, or none to the tool, seen along the spindle.",
            example="A cell that was learnt from one program, used for another with other operations.",
        ),
        "CEL005": Code(
            "warning",
            "implausible number in the cell",
            meaning="A frame, an angle, a mass or a cutter of the cell has a size that only another unit explains.",
            consequence="The robot would be elsewhere, or carry another weight, than the prediction assumes.",
            action="Write lengths in mm, angles in deg and masses in kg.",
            example="`tools: {1: {x: 0.3, y: 0, z: 0.18}}` in metres.",
        ),
        "CEL015": Code(
            "warning",
            "operation of the cell is not in the program",
            meaning="force_factors or tool_errors name an operation that no motion of the program belongs to.",
            consequence="What is stated of it is not used, and an operation of a similar name is left without.",
            action="Write the whole name, as the comment OPERATION or the process file has it.",
            example="`SLOTT` or `OUTSIDE` where the program has `OUTSIDE CONTOUR ROUGHING`.",
        ),
        "CEL016": Code(
            "info",
            "operations of other programs",
            meaning="force_factors or tool_errors name operations that this program does not have.",
            consequence="What is stated of them is not used here.",
            action="Nothing, where the cell is shared with other programs.",
            example="A cell for roughing and finishing in two programs.",
        ),
        "CEL014": Code(
            "warning",
            "start is beyond a limit",
            meaning="The axes before the first motion, `start`, are beyond the limits of the robot.",
            consequence="No program starts there, and configurations that follow from it may be others.",
            action="Write the axes of the home position, in deg, in the order and with the signs of the controller.",
            example="`start: [0, 90, -90, 0, 90, 0]` with A2 and A3 exchanged.",
        ),
        "CEL006": Code(
            "warning",
            "implausible tool",
            meaning="The tool centre point is inside the wrist, or the spindle's axis points away from the tip.",
            consequence="Forces in the feed frame, and the deflection of the spindle, have the wrong direction.",
            action="State the pose from the flange to the tip, and the axis from the spindle to the tip.",
            example="`axis: -z` of a tool whose +z points at the part.",
        ),
        "CEL007": Code(
            "warning",
            "tolerance permits everything",
            meaning="The tolerance of the cell is larger than the deflection of a robot.",
            consequence="Errors that matter are reported as within the tolerance.",
            action="State the path error that the part permits, in mm and deg.",
            example="`tolerance: 20` for 0.02 mm.",
        ),
        "CEL008": Code(
            "error",
            "cell for another language",
            meaning="The cell states the language of its programs, and this program is in another one.",
            consequence="Read in the wrong language, a program has no motions, or wrong ones.",
            action="Remove dialect.name from the cell, or name the cell of this program with --cell.",
            example="A KRL program beside a cell with `dialect: {name: fanuc}`.",
        ),
    }
)
