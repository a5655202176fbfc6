"""The codes of the findings of the identification."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "IDN001": Code(
            "error",
            "no such effect or parameter",
            meaning="Effects have the names of a robot file, parameters are written as effect.parameter.",
            consequence="A misspelt name would be identified as something else.",
            action="Choose one of the names that the message lists.",
            example="`--effects joint_complience`.",
        ),
        "IDN002": Code(
            "error",
            "fewer readings than unknowns",
            meaning="The number of readings is below the number of unknown parameters.",
            consequence="The equations have no unique solution.",
            action="Measure more poses, or identify fewer effects with --effects.",
            example="12 readings for 18 parameters.",
        ),
        "IDN003": Code(
            "error",
            "model has no equilibrium",
            meaning="With these values the robot has no equilibrium under its own weight and loads.",
            consequence="No deflection can be predicted, so no parameter can be identified.",
            action="Check the compliances and the compensator in the robot file.",
            example="A compensator stiffness that is 100 times too large.",
        ),
        "IDN010": Code(
            "error",
            "joint angles look like radians",
            meaning="No joint angle of the file exceeds a few units.",
            consequence="The columns A1..An are in degrees; in radians every pose would be wrong.",
            action="Convert the columns to degrees.",
            example="A1 between -3.1 and 3.1 in all rows.",
        ),
        "IDN011": Code(
            "error",
            "poses are alike",
            meaning="All poses are nearly the same.",
            consequence="One pose cannot separate the parameters.",
            action="Measure distinct poses; `compensate plan` proposes them.",
            example="40 readings of one pose.",
        ),
        "IDN012": Code(
            "error",
            "deflections do not fit any robot",
            meaning=(
                "The deflections and forces imply a robot that is far stiffer or softer than any robot."
            ),
            consequence="The unit of the deflections or of the forces is another one.",
            action="Write DX, DY, DZ in mm and forces in N.",
            example="Deflections in micrometres.",
        ),
        "IDN013": Code(
            "error",
            "loads are not informative",
            meaning="The rows have no load, or the same load everywhere.",
            consequence="The effect of a constant load cannot be separated from the geometry.",
            action="Measure poses with and without the load, or with loads of different size.",
            example="A weight on the tool in all rows.",
        ),
        "IDN014": Code(
            "error",
            "readings fit after one change",
            meaning=(
                "The readings do not fit the robot as they are, but they do with one column or unit changed."
            ),
            consequence="Such a mistake would result in wrong parameters.",
            action="Correct the file if the change is right; the tool never changes it silently.",
            example="Columns A2 and A3 exchanged.",
        ),
        "IDN015": Code(
            "warning",
            "readings fit badly",
            meaning="A large part of the measured values is not explained by the model.",
            consequence="The identified values are not reliable.",
            action="Check robot, tool and effects; `compensate robots NAME` lists what the model contains.",
            example="60 % of the deflections remain as residuals.",
        ),
        "IDN032": Code(
            "warning",
            "reflector mounted again",
            meaning="Between two sessions a reflector was at different places of the tool.",
            consequence="It counts as another reflector in each session; its place is no error of the robot.",
            action="Give reflectors that were mounted again other names.",
            example="A nest that was taken off over night.",
        ),
        "IDN033": Code(
            "warning",
            "tracker moved within a session",
            meaning="From one row on all readings are moved as a whole.",
            consequence="The rows from there on count as another session.",
            action="State a new SESSION where the tracker was moved.",
            example="Somebody bumped the tripod.",
        ),
        "IDN034": Code(
            "error",
            "readings belong to other rows",
            meaning="From one row on the readings belong to the joint angles of the row above or below.",
            consequence="Every reading would be compared with another pose.",
            action="Move the measured values by one row from there on.",
            example="One pose was skipped, its row was not.",
        ),
        "IDN035": Code(
            "error",
            "readings of another arm",
            meaning="No lengths and zeros, or no compliances, of this arm explain the readings.",
            consequence="Identified values would describe neither arm.",
            action="Use --robot with the robot that was measured, and check joint angles and loads.",
            example="The campaign of another robot in the same folder.",
        ),
    }
)
