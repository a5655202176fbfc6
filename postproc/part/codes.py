"""The codes of the findings of the part."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "PRT001": Code(
            "warning",
            "error of the part is not known",
            meaning="The process states a stock, and the surface of the part cannot be predicted from it.",
            consequence="Only the errors of the tool centre point are reported.",
            action="Complete the motions that the message names: their start, end, orientation and tool.",
            example="A cut whose start is a joint motion that the cell cannot follow.",
        ),
    }
)
