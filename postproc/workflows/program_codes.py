"""The codes of the findings of the commands that run programs: compensate, predict, verify."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "FIL005": Code(
            "error",
            "program is already compensated",
            meaning="The program contains the mark of an earlier compensation.",
            consequence="A second compensation would double the correction.",
            action="Compensate the original, or use --allow-compensated if this is intended.",
            example="`compensate compensated/panel.src`.",
        ),
        "FIL006": Code(
            "error",
            "points are missing",
            meaning="A motion under force uses points that no file of the program declares.",
            consequence="Without their coordinates the cut cannot be corrected. Nothing is written.",
            action="Put the file that declares the points beside the program.",
            example="A program that is copied without its data file.",
        ),
        "CEL004": Code(
            "error",
            "orientation is missing",
            meaning="The program contains positions only, and the cell states no orientation.",
            consequence="The deflection depends on the orientation of the tool.",
            action=(
                "Add the orientation of the tool in the base to the cell: orientation: {a: 0, b: 0, c: 180}."
            ),
            example="A three-axis G-code program.",
        ),
        "CEL011": Code(
            "error",
            "reference temperature is missing",
            meaning=(
                "The cell states a temperature, and thermal_growth of the robot file does not state "
                "that of its calibration."
            ),
            consequence="The growth is proportional to the difference of both.",
            action="Add it to the effect: options: {reference: 20}.",
            example="`temperature: 24` in the cell.",
        ),
        "FIL015": Code(
            "error",
            "feed that no machine has",
            meaning="A motion states a feed of more than 100 m/s.",
            consequence="No point could be inserted that the controller runs without slowing.",
            action="Correct the feed; KRL states m/s, G-code mm or inches a minute, RAPID and TP mm/s.",
            example="`$VEL.CP=1000000`.",
        ),
        "CEL012": Code(
            "error",
            "touch points do not fit the program",
            meaning=(
                "It is not clear which base was touched off, or the robot cannot reach its touch points."
            ),
            consequence="The touched-off base determines which part of the error remains.",
            action="Name the bases in touch_points, with places in mm that the robot reaches.",
            example="`touch_points: [[0, 0, 0]]` for a program that uses two bases.",
        ),
        "KIN007": Code(
            "warning",
            "Status/Turn disagree with the pose",
            meaning="The program states an S or T that this robot does not have at that pose.",
            consequence="The program may be made for another robot, base or tool.",
            action="Check robot, base and tool; correct S and T.",
            example="`S 6` at a pose that the robot reaches with S 2.",
        ),
        "MOD003": Code(
            "warning",
            "the model has no compliance",
            meaning="The robot file states no compliance, so no force deflects the tool.",
            consequence="Nothing is corrected for the force.",
            action="Measure the stiffness of the arm and write it into the robot file.",
            example="A robot file with geometry and limits only.",
        ),
        "COR005": Code(
            "warning",
            "residual exceeds the tolerance",
            meaning="The corrected tool is not at the wanted place within the tolerance.",
            consequence="The part has an error of this size there.",
            action=(
                "Check singularities and limits at this place; loosen the tolerance if it is acceptable."
            ),
            example="0.14 mm with a tolerance of 0.1 mm.",
        ),
        "COR006": Code(
            "warning",
            "path error between points exceeds the tolerance",
            meaning=(
                "No motion may be inserted there, or none is short enough, so the tool leaves the "
                "tolerance between two points."
            ),
            consequence="The part has an error of this size between the points.",
            action="Allow inserted motions (no --no-insert), raise max_growth, or loosen the tolerance.",
            example="A LIN of 2 m with --no-insert.",
        ),
        "COR007": Code(
            "info",
            "part of the correction applied",
            meaning="--gain below 1 applies a share of the correction.",
            consequence="The rest of the error remains.",
            action="Use --gain 1 when the first cut confirms the direction of the correction.",
            example="`--gain 0.5`.",
        ),
        "COR010": Code(
            "info",
            "no force",
            meaning="No motion has a force.",
            consequence="The tool is not loaded, so nothing is corrected and the output equals the input.",
            action="State the forces of the cuts, if the program cuts.",
            example="`--force 0,0,0`, or FORCE OFF for the whole program.",
        ),
        "COR012": Code(
            "info",
            "motions inserted",
            meaning=(
                "The output has more motions than the input: intermediate points inside motions, and "
                "transition moves before cuts."
            ),
            consequence=(
                "Intermediate points reduce the path error between points; transition moves lead into a"
                " corrected cut."
            ),
            action="Limit them with max_growth of the cell or with --no-insert.",
            example="12 intermediate points and 2 transition moves.",
        ),
        "COR015": Code(
            "info",
            "approximation not stated",
            meaning="The program approximates a corner without an approximation distance.",
            consequence="The corner of the output may differ from that of the original.",
            action="State the approximation distance in the program.",
            example="`LIN P2 C_DIS` without $APO.CDIS.",
        ),
        "COR017": Code(
            "warning",
            "approximated corner differs",
            meaning="The approximated corner of the output exceeds the tolerance to that of the original.",
            consequence="The part has an error of this size at the corner.",
            action="Use a smaller approximation distance there.",
            example="A corner that cuts 0.2 mm more with a tolerance of 0.1 mm.",
        ),
        "COR018": Code(
            "warning",
            "spline is not known between its points",
            meaning="The path between the points of a spline is computed by the controller alone.",
            consequence=(
                "The direction of the feed, and with it of the force, is estimated there; so is the correction."
            ),
            action="Write the spline with more points, or state the force in the axes of the base.",
            example="SPL points 60 mm apart on a curve, with a force @feed.",
        ),
        "COR019": Code(
            "warning",
            "kept orientation exceeds the tolerance",
            meaning="Under $ORI_TYPE=#CONSTANT a motion keeps the orientation with which it starts.",
            consequence="The rotation of the deflected tool is not corrected.",
            action="Write $ORI_TYPE=#VAR for cuts whose orientation matters.",
            example="A cut under #CONSTANT whose tool is rotated by 0.04 deg.",
        ),
        "COR020": Code(
            "info",
            "orientation between blocks is assumed",
            meaning=(
                "Rotary words are assumed to run linearly between blocks (G43.4, ORIAXES), tool vectors"
                " on a great circle (ORIVECT)."
            ),
            consequence="A control that interpolates otherwise tilts the tool between the points.",
            action="Check the interpolation of the control.",
            example="Two blocks with A0 C0 and A30 C90.",
        ),
        "COR023": Code(
            "warning",
            "cut starts where branches meet or part",
            meaning="Several motions may precede the first motion of a cut, or others start where it starts.",
            consequence="Its end point is corrected; at its start the tool is where the motion before leads it.",
            action="Program a motion in air to the start of the cut, within the same branch.",
            example="A LIN under force that follows ENDIF, after branches that end at different points.",
        ),
        "COR021": Code(
            "info",
            "orientation is not corrected",
            meaning="The program has no words for the orientation of the tool.",
            consequence="The rotation of the deflected tool is not corrected.",
            action="Nothing: three axes cannot tilt the tool.",
            example="Three-axis G-code with `orientation:` in the cell.",
        ),
        "COR030": Code(
            "info",
            "effects that are not corrected",
            meaning=(
                "The robot file has effects that the mode (`correct:` of the cell) or the controller "
                "excludes."
            ),
            consequence="Their errors remain.",
            action="Choose another mode in the cell if they are to be corrected.",
            example="`correct: process` with a link_gravity.",
        ),
        "COR031": Code(
            "warning",
            "temperature is not corrected",
            meaning=(
                "A correction of thermal growth needs a temperature in the cell and thermal_growth in "
                "the robot file."
            ),
            consequence="The growth of the warm robot remains as an error.",
            action="Add what the message names.",
            example="`temperature: 24` for a robot file without thermal_growth.",
        ),
        "COR033": Code(
            "warning",
            "weight of a tool has no effect",
            meaning=(
                "A weight of a tool is stated, the correction contains weights, and something that this one needs is"
                " missing: the tool or its mass in the cell, or the effect payload in the robot file. Or the program"
                " states another load than the cell, by its data or while it runs ($LOAD, GripLoad, PAYLOAD)."
            ),
            consequence=(
                "The sag of the robot under this tool or load remains as an error, and no figure contains it."
            ),
            action="Add what the message names.",
            example="`correct: absolute` and a tool with `mass: 100`, for a robot file without payload.",
        ),
        "COR032": Code(
            "info",
            "base is touched off",
            meaning=(
                "With `correct: touched_off` the base contains the rigid part of the error at the touch"
                " points."
            ),
            consequence="The correction contains only what exceeds this rigid part.",
            action="Check that the touch points are those of the set-up.",
            example="A base that is touched off at three corners.",
        ),
        "VER001": Code(
            "error",
            "not the same program",
            meaning=(
                "The second program does not make the motions of the first one, with inserted ones "
                "between them."
            ),
            consequence="The two cannot be compared.",
            action="Name the original first and the compensated program second.",
            example="Two different versions of a program.",
        ),
        "VER002": Code(
            "warning",
            "no mark of a compensation",
            meaning="The second program has no mark of this tool.",
            consequence="Another tool may have made it, or somebody removed the mark.",
            action="Check that the second file is the compensated program.",
            example="`compensate verify panel.src panel.src`.",
        ),
        "VER003": Code(
            "warning",
            "path error exceeds the tolerance",
            meaning=(
                "The simulated tool is farther from the wanted path, or tilted further, than the cell allows."
            ),
            consequence="The part has an error of this size there.",
            action="Check the place that the message names.",
            example="0.15 mm with a tolerance of 0.1 mm.",
        ),
        "VER004": Code(
            "warning",
            "not simulated",
            meaning="The path of these motions is not known, or the robot cannot follow it.",
            consequence="Errors there are not checked.",
            action="Check these motions in the first run.",
            example="A spline.",
        ),
        "VER005": Code(
            "warning",
            "differs from the original",
            meaning=(
                "Something other than corrected places differs: a statement or the motion that it follows, a word"
                " of a motion, a frame, feed, external axis or air move, or a motion is missing."
            ),
            consequence="The output makes something else than the original.",
            action="Compare the lines that the message names.",
            example="A LIN with another $VEL.CP, or a HALT that the original does not have.",
        ),
        "VER006": Code(
            "warning",
            "stop or reversal where the original flows",
            meaning="The tool stops in a cut, or moves against its feed.",
            consequence="A stop leaves a mark on the part.",
            action="Check the transition move and the approximation at this place.",
            example="An inserted point without C_DIS.",
        ),
        "VER007": Code(
            "warning",
            "no error value",
            meaning=(
                "The force at a place and the place under that force do not converge, or the robot "
                "cannot reach it."
            ),
            consequence="No error is known there.",
            action="Check force and model at this place.",
            example="A pose without an equilibrium.",
        ),
        "VER008": Code(
            "info",
            "no error value of the original",
            meaning=(
                "Without a correction the force at a place and the place under that force do not converge: "
                "the deflected tool has several places on the path, or none."
            ),
            consequence="No error before the correction is stated; that of the compensated program is.",
            action="Nothing; a longer force_ramp, if the force changes more slowly, makes the places distinct.",
            example="A corner at which the force turns, and the tool is deflected by more than its ramp.",
        ),
        "VER009": Code(
            "warning",
            "compensated from other inputs",
            meaning=(
                "The mark of the compensated program states the SHA-256 of the file that it was made from and of the"
                " robot, and one of them is not that of this run."
            ),
            consequence="The original or the robot file was changed since, or the program belongs to another one.",
            action="Compensate the original again, or name the file and the robot that the program was made with.",
            example="An M code that was added to the original after it was compensated.",
        ),
        "FIL012": Code(
            "error",
            "program of two files in a stream",
            meaning="Points of the program are in its .dat, which changes too, and standard output takes one file.",
            consequence="The program alone would be corrected in part.",
            action="Name a folder with -o instead of -.",
            example="`compensate - -o - --stdin-name taught.src --force` of a program with points in taught.dat.",
        ),
        "FIL016": Code(
            "info",
            "reports of another program",
            meaning="The reports have the names of those that another program already has in this folder.",
            consequence="They are replaced; the other program is not.",
            action="To keep both, name another folder with -o or --report, or rename one of the programs.",
            example="panel.src after panel.ngc, both to compensated/.",
        ),
        "FIL014": Code(
            "error",
            "output has an ending that no controller loads",
            meaning="The name after -o does not end as programs of this language do.",
            consequence="The controller would not find the program, or not take it for one.",
            action="Name the output with the ending that the message proposes.",
            example="`compensate panel.src -o panel.txt`.",
        ),
    }
)
