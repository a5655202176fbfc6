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
            consequence="Where the path turns at once the force steps; the correction follows along a motion.",
            action="Use a larger corner radius at the worst place on the page, or end the pass in air.",
            example="A row of a ball end mill that ends in the stock with a step aside of 0.6 mm.",
        ),
        "PRT003": Code(
            "info",
            "places that the correction cannot bring within the tolerance",
            meaning="These places of the part are out of tolerance, and the message states why.",
            consequence="The part keeps the error there that the page shows.",
            action="Let the path turn in air or with a radius, or allow the motion to be corrected.",
            example="A step aside of 0.6 mm between two rows: the force turns within less than the tool yields.",
        ),
        "PRT004": Code(
            "info",
            "engagement without equilibrium",
            meaning="At some places no position of the tool near the one before is in equilibrium with its force.",
            consequence=(
                "The tool moves there at once; where none is near it is taken to cut in the direction of the feed."
                " The error of the part is less certain near these places."
            ),
            action="Check these places on the page.",
            example="A slot whose front opens all at once where the tool leaves the blank.",
        ),
    }
)
