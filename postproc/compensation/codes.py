"""The codes of the findings of kinematics and correction."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "KIN001": Code(
            "error",
            "pose out of reach",
            meaning="The robot cannot reach a programmed cutting pose.",
            consequence="Base, tool or robot of the cell do not belong to the program.",
            action="Check base, tool and robot of the cell against the program.",
            example="A base that is 1 m too far from the robot.",
        ),
        "KIN002": Code(
            "warning",
            "pose exceeds the axis limits",
            meaning="The programmed pose needs an axis value beyond its limit.",
            consequence="The robot would stop there; the cut is not corrected.",
            action="Check base, tool and axis limits; re-orient the tool if they are right.",
            example="A4 at 361 deg with limits of -350 to 350 deg.",
        ),
        "KIN003": Code(
            "warning",
            "near a singularity",
            meaning="Near a singularity small corrections rotate axes by large angles.",
            consequence="The robot may become slow or leave the path.",
            action="Watch this place in the first run; tilt the tool in the program if it is in a cut.",
            example="A5 within 1 deg of 0.",
        ),
        "KIN004": Code(
            "error",
            "configuration is not known",
            meaning="No axes and no Status and Turn are programmed before this motion.",
            consequence="The deflection depends on the configuration of the robot.",
            action=(
                "Add `start:` (axes before the first motion) to the cell, or state S and T in the PTP "
                "before it."
            ),
            example="A program that starts with LIN.",
        ),
        "KIN005": Code(
            "warning",
            "air move exceeds reach or limits",
            meaning="The robot cannot make this air move.",
            consequence="It is not corrected, but base, tool or robot may be wrong.",
            action="Check base, tool and robot of the cell against the program.",
            example="A retract to Z 3000.",
        ),
        "KIN006": Code(
            "warning",
            "Status/Turn mismatch",
            meaning=(
                "The corrected pose is on the other side of an axis angle than the target states"
                " (S or T of KUKA, the turns of Fanuc)."
            ),
            consequence="The controller would turn the axis by a full turn, so the cut is not corrected.",
            action="Omit S and T in this target, or state the pose further from the axis angle.",
            example="T states A4 >= 0 and the corrected pose has A4 = -0.01 deg.",
        ),
        "KIN008": Code(
            "warning",
            "axis near its limit",
            meaning="The correction moves an axis close to its limit.",
            consequence="The controller may stop there.",
            action="Watch this place in the first run; re-orient the tool if the controller stops.",
            example="A3 at 0.3 deg from its limit.",
        ),
        "KIN009": Code(
            "warning",
            "axis too fast for the feed",
            meaning="At the programmed feed an axis would exceed its speed.",
            consequence="The robot slows down there, which changes feed per tooth and force.",
            action="Reduce the feed, or tilt the tool away from the singularity.",
            example="A4 needs 250 deg/s and can make 219 deg/s.",
        ),
        "MOD002": Code(
            "warning",
            "no equilibrium",
            meaning="The deflected robot has no equilibrium under this force.",
            consequence="No correction exists, so the cut is not corrected.",
            action="Check the force and the stiffness values of the robot file.",
            example="A compensator stiffness with a wrong sign.",
        ),
        "COR001": Code(
            "warning",
            "not converged",
            meaning="The iteration of the correction does not converge.",
            consequence="No reliable correction exists, so the cut is not corrected.",
            action="Check force and model at this place; a singularity is a common cause.",
            example="A pose with A5 near 0 under a large force.",
        ),
        "COR002": Code(
            "error",
            "correction too large",
            meaning="A correction exceeds max_correction of the cell.",
            consequence=("A wrong force, model or frame is the usual cause. Nothing is written."),
            action=(
                "Check force, base and tool; raise max_correction in the cell if the correction is intended."
            ),
            example="A force in kN that is given in N.",
        ),
        "COR003": Code(
            "warning",
            "cut is not corrected",
            meaning="One motion of the cut cannot be corrected.",
            consequence=(
                "A correction that starts or ends inside a cut would leave a step on the part, so the "
                "whole cut is not corrected."
            ),
            action="Remove the cause that the message names, or split the cut by an air move.",
            example="A cut with one LIN to a computed point.",
        ),
        "COR004": Code(
            "warning",
            "COMPENSATE is switched inside a cut",
            meaning="The switch is allowed in air only.",
            consequence=(
                "A switch inside a cut would leave a step on the part, so the whole cut is not corrected."
            ),
            action="Move the comment before the first or after the last motion of the cut.",
            example="`;COMPENSATE OFF` between two LIN under force.",
        ),
        "COR008": Code(
            "warning",
            "corrected point exceeds the limits",
            meaning="The correction moves an axis beyond its limit.",
            consequence="The robot would stop there, so the cut is not corrected.",
            action="Re-orient the tool, or move the part away from the limit.",
            example="A3 at 155.2 deg with a limit of 155 deg.",
        ),
        "COR009": Code(
            "warning",
            "corrected point is out of reach",
            meaning="The robot cannot reach the corrected pose.",
            consequence="The cut is not corrected.",
            action="Move the part nearer to the robot.",
            example="A cut at the edge of the workspace.",
        ),
        "COR011": Code(
            "warning",
            "comment looks like a switch",
            meaning=(
                "The comment starts with COMPENSATE but is neither COMPENSATE OFF nor COMPENSATE ON; it"
                " is ignored."
            ),
            consequence="The cuts after it are corrected, or not, as before.",
            action="Write COMPENSATE OFF or COMPENSATE ON.",
            example="`;COMPENSATE=OFF`.",
        ),
        "COR013": Code(
            "warning",
            "arc cannot be corrected",
            meaning="The corrected points define no arc that can be written.",
            consequence="The cut is not corrected, because a wrong arc would damage the part.",
            action="Let the post-processor write the arc as shorter arcs or as lines.",
            example="A full circle whose corrected points are not on a circle.",
        ),
        "COR014": Code(
            "warning",
            "limit of growth reached",
            meaning=(
                "max_growth of the cell allows fewer inserted motions than the tolerance needs; the "
                "largest errors get theirs first."
            ),
            consequence="The path error between points exceeds the tolerance at some motions.",
            action="Raise max_growth or tolerance in the cell.",
            example="500 motions need 4000 inserted ones and max_growth is 4.",
        ),
        "COR016": Code(
            "warning",
            "cut would not improve",
            meaning=(
                "The corrected path of this cut is not nearer to the programmed path than the "
                "uncorrected one."
            ),
            consequence="A correction without a gain is not written, so the cut is not corrected.",
            action="Allow inserted motions (no --no-insert), raise max_growth, or loosen the tolerance.",
            example="A cut with --no-insert whose motions are long.",
        ),
        "COR022": Code(
            "error",
            "tolerance cannot be met",
            meaning=(
                "The tolerance needs more motions between the points than a program can have, or more digits than "
                "its numbers have."
            ),
            consequence="They are not computed and nothing is written: no controller executes such a program.",
            action="Use a larger tolerance or min_segment, or a smaller max_growth in the cell.",
            example="tolerance: 0.000001 with max_growth: 1000000.",
        ),
        "COR024": Code(
            "info",
            "force changes inside of motions",
            meaning="The tool enters, leaves or meets a corner between the end points of motions.",
            consequence="The figures at the end points do not show the largest error before the correction.",
            action="Read the path error between the points as written, and the error of the part.",
            example="A slot from air to air: its end points carry no force, its middle 300 N.",
        ),
        "COR025": Code(
            "info",
            "motions shorter than an interpolation cycle",
            meaning="At the programmed feed, motions beside inserted points are shorter than a controller cycle.",
            consequence="The controller may slow down there; the path is as reported.",
            action="Use a smaller feed there, or a longer force_ramp if the force changes more slowly.",
            example="A point 0.3 mm from the next at 72 mm/s: 4 ms, with a cycle of 12 ms.",
        ),
    }
)
