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
    }
)
