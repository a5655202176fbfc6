"""The codes of the findings of the stiffness model."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "MOD001": Code(
            "warning",
            "compensator torque is implausible",
            meaning="The static torque of the gravity compensator is far above what a balancer carries.",
            consequence=(
                "Only the change of its torque may be used: the parameters are valid for the stiffness only."
            ),
            action="Check the parameters, or state `preload: balanced`.",
            example="A torque of 60000 N m on axis 2.",
        ),
        "MOD004": Code(
            "warning",
            "implausible number in the robot file",
            meaning="A compliance, a spring, a length or an angle has a size that built hardware does not have.",
            consequence="The predicted deflection and its correction would be too large or too small.",
            action="Check the value and its unit.",
            example="A joint compliance of 3e-10 rad/(N m).",
        ),
    }
)
