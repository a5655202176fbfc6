"""The codes of the findings of the diagnosis."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "DIA001": Code(
            "error",
            "too few poses for a verdict",
            meaning="The number of poses is below the minimum of a diagnosis.",
            consequence="With so few poses every explanation fits.",
            action="Measure more poses; `compensate plan` proposes them.",
            example="6 poses.",
        ),
        "DIA003": Code(
            "info",
            "sides of approach are assumed",
            meaning="Backlash and hysteresis depend on the side from which a joint came; the columns DIR state it.",
            consequence="Where they are missing the sides are taken from elsewhere, or are unknown.",
            action="State DIR1, DIR2, ... in the next campaign.",
            example="A hysteresis that only the order of the rows shows.",
        ),
    }
)
