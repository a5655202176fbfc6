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
    }
)
