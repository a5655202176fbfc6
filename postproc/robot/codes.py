"""The codes of the findings of robot files, robots and external axes."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "EXT001": Code(
            "error",
            "external axis of unknown kinematics",
            meaning="The program moves an external axis, and the cell does not state what it carries.",
            consequence="The place of each cut depends on it.",
            action=(
                "Declare it in the cell (external_axes), as `kind: fixed` where it moves neither robot "
                "nor part."
            ),
            example="E1 moves to 500 and the cell has no external_axes.",
        ),
        "EXT002": Code(
            "error",
            "place of an external axis is not known",
            meaning="Neither the program nor the cell states the position of the axis.",
            consequence="The place of the robot or the part is unknown.",
            action="Add `start:` to the axis in the cell.",
            example="A track whose first motion has no E1.",
        ),
        "EXT003": Code(
            "error",
            "external axis exceeds its limits",
            meaning="The program moves the axis beyond the limits of the cell or the robot file.",
            consequence="The controller stops there, or a limit or a unit is wrong.",
            action="Check the program and the limits.",
            example="E1 4500 with limits of 0 to 4000 mm.",
        ),
        "EXT004": Code(
            "warning",
            "position of an external axis is not known here",
            meaning="The program computes its value, or a call or a jump may move it.",
            consequence="The place of the cut is unknown, so the motion is not corrected.",
            action="Write the axis as a number in this motion.",
            example="`E1 track_pos`.",
        ),
        "EXT006": Code(
            "info",
            "external axes are followed",
            meaning=(
                "The robot or the part is at the place to which these axes move it, at each point and "
                "on the path between."
            ),
            consequence="The message states what each axis carries and how far it moves.",
            action="Check that the carried parts are the right ones.",
            example="A track E1 that moves from 0 to 2000 mm.",
        ),
        "CEL003": Code(
            "error",
            "robot is not known",
            meaning="No robot file has this name, or the named file does not exist.",
            consequence="Without the robot no pose can be computed.",
            action="Choose a name from `compensate robots`, or give the path of a robot file.",
            example="`robot: kr270r2700` for a file named kuka_kr270_r2700.",
        ),
        "ROB001": Code(
            "error",
            "robot file would lose its URDF",
            meaning=(
                "A robot file names a URDF in its own folder or below; the new file would be elsewhere."
            ),
            consequence="The new robot file could not be read.",
            action="Write the new file beside the old one, or copy the URDF first.",
            example="`--save ../new.yaml` from a folder with arm.urdf.",
        ),
        "ROB002": Code(
            "error",
            "robot file cannot be edited",
            meaning="New values are written by ruamel.yaml, which cannot read this file.",
            consequence="Nothing is written, so that no comment of the file is lost.",
            action="Write the file as plain YAML 1.2.",
            example="A file that starts with %YAML 1.3.",
        ),
        "ROB003": Code(
            "error",
            "self-check failed: the robot file differs from the plan",
            meaning="The robot file that would be written is read back, and it has other values.",
            consequence="This is a defect of this tool. Nothing is written.",
            action="Please report the message together with the robot file.",
            example="A value of 1.2e-6 that is read back as 1.2e-5.",
        ),
        "URD001": Code(
            "error",
            "URDF is wrong",
            meaning="The file cannot be read as the description of one serial arm.",
            consequence="Without its joints no pose can be computed.",
            action="Correct what the message names.",
            example="A joint whose parent link is not defined.",
        ),
        "KIN012": Code(
            "error",
            "no program is for this arm",
            meaning="A program places the flange with six axes, and an external one; the robot has another number.",
            consequence="Its motion is not determined. `identify`, `diagnose` and `plan` work.",
            action="State an arm of six joints, or of seven with `external:`.",
            example="A robot file with nine joints and a program.",
        ),
        "KIN010": Code(
            "warning",
            "kept orientation is not known",
            meaning=(
                "The motion keeps the orientation with which it starts, and that orientation is unknown."
            ),
            consequence="The orientation of the tool is unknown, so the motion is not corrected.",
            action=(
                "Program a motion with a full orientation before it, or select variable orientation control."
            ),
            example="KRL: `$ORI_TYPE=#CONSTANT` before the first Cartesian motion.",
        ),
        "KIN011": Code(
            "info",
            "programmed orientation has no effect",
            meaning="The motion keeps the orientation with which it starts, whatever its target states.",
            consequence="Position and path are corrected for the orientation that the controller executes.",
            action="Check that the constant orientation is intended.",
            example="KRL: `$ORI_TYPE=#CONSTANT` with targets of different A, B, C.",
        ),
        "KIN013": Code(
            "info",
            "quadrants of confdata",
            meaning="The pose, as programmed or as corrected, is not in the quadrants that cf1, cf4 and cf6 state.",
            consequence=(
                "The motion is corrected and confdata is kept. A control that supervises the configuration"
                " (ConfL or ConfJ on) may stop before this motion."
            ),
            action="If the control stops there, switch ConfL off around this motion or change its confdata.",
            example="cf4 is 0 and the corrected pose has axis 4 at -0.01 deg.",
        ),
    }
)
