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
        "PRT002": Code(
            "warning",
            "part as compensated exceeds the tolerance",
            meaning="Parts of the surface are beyond the tolerance although their motions are corrected.",
            consequence="A correction is even along a motion; at entries, exits and corners the force is not.",
            action="Look at the worst place on the page; divide its motion where the tool enters, leaves or turns.",
            example="A pass that is corrected by 0.4 mm, and leaves the blank, and with it the force, before its end.",
        ),
    }
)
