"""The codes of the findings of measurement files."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "MEA001": Code(
            "error",
            "measurements are wrong",
            meaning="A comment, the header or a row of the CSV cannot be used.",
            consequence="A misread value would lead to wrong parameters.",
            action="Correct the row, column or comment that the message names.",
            example="A column `DX (inch)`.",
        ),
        "MEA002": Code(
            "error",
            "no readings yet",
            meaning="No row of the CSV contains a measured value.",
            consequence="Nothing can be identified from an empty plan.",
            action="Fill in what is measured.",
            example="The file that `compensate plan` wrote, not yet filled in.",
        ),
        "MEA003": Code(
            "info",
            "rows without a reading",
            meaning="Some rows are planned but not measured; they are excluded.",
            consequence="Fewer readings lead to wider intervals.",
            action="Nothing needs to be done if these poses were skipped on purpose.",
            example="5 of 40 poses without a value.",
        ),
        "MEA004": Code(
            "warning",
            "comment looks like a key",
            meaning="The comment is similar to a key but is none, or is at the wrong place; it is ignored.",
            consequence="A setting such as the tool may be missing then.",
            action="Correct the spelling, or move the comment above the header.",
            example="`# tol: 0 0 200`.",
        ),
        "MEA005": Code(
            "warning",
            "target never occurs",
            meaning="The file states the place of a target that no row measures.",
            consequence="The name may be misspelt in the rows.",
            action="Check the column TARGET.",
            example="`# target T2: ...` and rows with t2.",
        ),
        "MEA006": Code(
            "warning",
            "time decreases",
            meaning="Rows must be in the order of time.",
            consequence="Drift, backlash and hysteresis are read from this order.",
            action="Sort the rows into the order in which they were measured.",
            example="T 120 after T 180.",
        ),
        "MEA007": Code(
            "warning",
            "repeats of different states",
            meaning=(
                "REPEAT identifies one state that is measured again; these rows differ in joint angles "
                "or loads."
            ),
            consequence="Only rows that agree count as repeats.",
            action="Use another REPEAT for each state.",
            example="REPEAT 3 with two different values of A2.",
        ),
        "MEA008": Code(
            "error",
            "files do not belong together",
            meaning="Files that are read together must agree in what they state.",
            consequence="A fit of both would mix two setups.",
            action="Identify from each file on its own, or correct the comment.",
            example="Two files with different `# tool:`.",
        ),
        "MEA009": Code(
            "info",
            "frame is not used",
            meaning="Deflections are given in the axes of the robot base.",
            consequence="The stated frame has no influence on them.",
            action="Remove the comment, or give positions instead of deflections.",
            example="`# frame: tracker` with the columns DX, DY, DZ.",
        ),
        "MEA010": Code(
            "info",
            "columns are not used",
            meaning="The file has columns that are no part of the format.",
            consequence="They have no influence on the result.",
            action="Nothing, unless one was to be used: rename it then.",
            example="A column OPERATOR.",
        ),
        "MEA011": Code(
            "warning",
            "readings of 0, 0, 0",
            meaning="Some trackers write zeros where the beam was lost.",
            consequence="These rows are excluded; as readings they would be far off.",
            action="Remove the zeros so that the cells are empty, or measure these poses again.",
            example="X, Y, Z of a row are 0.",
        ),
        "MEA012": Code(
            "warning",
            "readings are copies",
            meaning=(
                "Rows of two files agree in every digit of joints, loads and values, or more rows of one file do than "
                "repeated readings that are rounded."
            ),
            consequence="They count once; twice, intervals would be too narrow.",
            action="Name each file once, and remove copies of rows.",
            example="A file and a copy of it with another comment.",
        ),
        "MEA013": Code(
            "error",
            "no measurements",
            meaning="The file is a program or a YAML file, in the place of measurements.",
            consequence="There is nothing to identify or diagnose in it.",
            action="Give a CSV of readings; `compensate plan` writes one to fill in.",
            example="`compensate diagnose part.src`.",
        ),
        "MEA014": Code(
            "warning",
            "implausible number above the readings",
            meaning="The tool, a target or the scatter has a size that only another unit explains.",
            consequence="The measured place, or the weight of the readings, would be wrong.",
            action="Write lengths in mm.",
            example="`# target M1: 0.3 0 0.1` in metres.",
        ),
    }
)
