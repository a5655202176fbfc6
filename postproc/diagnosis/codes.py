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
        "DIA004": Code(
            "info",
            "searched in a part of the readings",
            meaning="Where there are thousands of readings the search uses whole poses at random.",
            consequence="What it chooses is fitted to all readings; an effect of one region may be missed.",
            action="Diagnose the readings of a region by themselves where one is suspected.",
            example="1,500 of 10,000 readings.",
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
