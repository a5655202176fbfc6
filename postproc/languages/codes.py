"""The codes of the findings that all languages share."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "FIL008": Code(
            "error",
            "self-check failed: the output differs from the plan",
            meaning="The program that would be written is read back, and it is not the planned one.",
            consequence=(
                "This is a defect of this tool. Nothing is written, so no wrong program reaches the machine."
            ),
            action="Please report the message together with the program.",
            example="A correction that is 0.2 mm in the plan and 0.3 mm in the text of the output.",
        ),
        "FIL009": Code(
            "error",
            "no motion in the file",
            meaning="The file contains no motion of a language that this tool reads.",
            consequence="Without a motion there is nothing to correct.",
            action=(
                "Check that the file is a robot or CNC program, and name its language in the cell: "
                "dialect: {name: ...}."
            ),
            example="A Fanuc TP program is given.",
        ),
    }
)
