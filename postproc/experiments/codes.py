"""The codes of the findings of the planning of measurements."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "PLN001": Code(
            "error",
            "no pose can be measured",
            meaning="Limits, box and line of sight to the tracker exclude every pose.",
            consequence="A plan without poses is empty.",
            action="Check --box, --limits, --tracker, --cone and the places of the --target.",
            example="A --box in metres.",
        ),
        "PLN002": Code(
            "error",
            "no parameter is observable",
            meaning="No candidate pose and load shows any of the requested parameters.",
            consequence="Measurements at such poses would not identify anything.",
            action="Choose other --loads, another --tool or --kind absolute, as the message proposes.",
            example="`--effects joint_offset` with the measurement of deflections.",
        ),
        "PLN003": Code(
            "error",
            "no equilibrium",
            meaning="The deflected robot has no equilibrium under these loads at any pose.",
            consequence="No deflection can be predicted.",
            action="Check the loads and the compliances of the robot file.",
            example="`--loads 50000`.",
        ),
        "PLN004": Code(
            "error",
            "not enough distinct poses",
            meaning="The ranges contain fewer poses of the requested distance than requested.",
            consequence="Poses that are too similar add no information.",
            action="Request fewer poses, or a smaller --spacing.",
            example="`--poses 200 --spacing 60`.",
        ),
    }
)
