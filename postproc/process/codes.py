"""The codes of the findings of forces."""

from __future__ import annotations

from postproc.base.findings import Code, define
from postproc.process.stock.codes import CODES as STOCK_CODES

FORCE_CODES = define(
    {
        "EXT005": Code(
            "error",
            "force or cut that a moving part leaves undefined",
            meaning=(
                "A force in world axes acts on a part that rotates, or a cut starts on another part "
                "than the motion before it."
            ),
            consequence="The load on the robot, or the path on the part, is not defined.",
            action=(
                "State the force @base, @tool or @feed; write a motion without force in the new base "
                "before the cut."
            ),
            example="`--force 0,0,-500@world` while a positioner turns the part.",
        ),
        "FRC001": Code(
            "error",
            "no force",
            meaning="--force is given without a value, and no force belongs to the program.",
            consequence="Without a force nothing is corrected.",
            action=(
                "Write a FORCE comment, a force CSV or `force:` in the cell, or give the force: --force"
                " 0,360,560@base."
            ),
            example="`compensate panel.src --force` in a cell without `force:`.",
        ),
        "FRC002": Code(
            "error",
            "force is not understood",
            meaning="A force consists of 3 or 6 numbers and a frame.",
            consequence="A misread force would lead to a wrong correction.",
            action="Write fx,fy,fz[,mx,my,mz][@base|world|tool|feed] in N and N m.",
            example="`--force 0,360@base` has two numbers.",
        ),
        "FRC003": Code(
            "error",
            "force file is wrong",
            meaning="The header or a row of the force CSV cannot be used.",
            consequence="A misread force would lead to a wrong correction.",
            action="Correct the row or column that the message names.",
            example="A column `fx_kN`.",
        ),
        "FRC004": Code(
            "error",
            "force for no motion",
            meaning="The force CSV names a line that contains no motion.",
            consequence="The CSV does not belong to this version of the program.",
            action="Write the line number of the motion; export the CSV again if the program changed.",
            example="Row `12,0,360,560` where line 12 is a comment.",
        ),
        "FRC005": Code(
            "error",
            "feed direction is not known",
            meaning="A force in the feed frame needs a feed direction and a spindle axis.",
            consequence="Without them the direction of the force is undefined.",
            action="Add the spindle axis to the tool in the cell, or give the force @tool or @base.",
            example="`0,360,560@feed` on a plunge.",
        ),
        "FRC006": Code(
            "warning",
            "comment looks like a force",
            meaning="The comment starts with FORCE but is not a valid force; it is ignored.",
            consequence="The motions after it keep the previous force.",
            action="Write FORCE fx fy fz [mx my mz] [@base|world|tool|feed], or FORCE OFF.",
            example="`;FORCE 0 360`.",
        ),
        "FRC007": Code(
            "info",
            "motions without a force",
            meaning="The force source has no entry for these motions; they count as air.",
            consequence="Motions in air are not corrected.",
            action="Add entries if these motions cut.",
            example="A CSV with rows for lines 10 to 50 of a program of 80 lines.",
        ),
        "FRC008": Code(
            "info",
            "plunge before any feed",
            meaning=(
                "These motions have a force in the feed frame but no feed direction; they use the "
                "direction of the next motion."
            ),
            consequence="The direction of the force is an assumption there.",
            action="Give the force @tool or @base for the plunge if the direction matters.",
            example="A plunge along the spindle before the first cut.",
        ),
        "FRC009": Code(
            "warning",
            "force on an air move",
            meaning="PTP and G0 are air moves by definition; the force for them is ignored.",
            consequence="If the motion cuts, it is not corrected.",
            action="Remove the row, or write FORCE OFF before the motion; program it as LIN or G1 if it cuts.",
            example="A CSV row for the line of a PTP, or a PTP between FORCE and FORCE OFF.",
        ),
        "FRC010": Code(
            "info",
            "feed direction is kept",
            meaning=(
                "A plunge or a rotation on the spot has no feed direction across the spindle; the last "
                "direction is kept."
            ),
            consequence="The direction of the force is an assumption there.",
            action="Give the force @tool or @base if the direction matters.",
            example="A plunge along the spindle inside a pocket.",
        ),
        "FRC011": Code(
            "error",
            "process for another program",
            meaning="No operation of the process file belongs to a motion of the program.",
            consequence="No force is known, so nothing would be corrected.",
            action="Check the names, tool numbers and line ranges of the operations.",
            example="A process with `tool: 3` for a program that uses tool 5.",
        ),
        "FRC012": Code(
            "warning",
            "operation without motions",
            meaning="The program has no such name, tool or lines.",
            consequence="The force of the operation is not used.",
            action="Check its spelling.",
            example="`name: roughing` where the comment is `;Rough`.",
        ),
        "FRC013": Code(
            "error",
            "feed is not known",
            meaning="Feed per tooth, or the time of a motion, needs the programmed feed.",
            consequence="The cutting force cannot be computed.",
            action=(
                "Set the feed in the program before the motion ($VEL.CP, F), or mark air with FORCE OFF."
            ),
            example="A LIN before the first `$VEL.CP`.",
        ),
        "FRC014": Code(
            "info",
            "motions without a computed force",
            meaning=(
                "The process model covers side cutting only; plunges, and approaches from axis "
                "positions, count as air."
            ),
            consequence="These motions are not corrected.",
            action="State a force for them with a FORCE comment if they cut.",
            example="A plunge into solid material.",
        ),
        "FRC015": Code(
            "info",
            "force of an operation",
            meaning="The process file gives this mean force for this operation.",
            consequence="The correction is proportional to it.",
            action="Compare it with a measured force or with experience.",
            example="A mean of 420 N for a slot in aluminium.",
        ),
        "FRC016": Code(
            "info",
            "no axial coefficients",
            meaning="The source of the cutting coefficients states no axial ones; Fz is set to 0.",
            consequence="An axial force would deflect the tool along its axis, and that is not corrected.",
            action="Give own coefficients (kac, kae) if they are known.",
            example="A material with ktc and krc only.",
        ),
        "FRC017": Code(
            "warning",
            "feed differs from the rest of the operation",
            meaning="Some motions are much faster than the others and count as cutting.",
            consequence="If they move through air, they are corrected for a force that is not there.",
            action="State `rapid:` in the operation, or mark them FORCE OFF.",
            example="Moves at 200 mm/s between cuts at 20 mm/s.",
        ),
        "FRC018": Code(
            "info",
            "comment names no operation",
            meaning=(
                "A cut starts after comments that name no operation; the last named operation continues."
            ),
            consequence="The cut may belong to another operation.",
            action="Name the operation in the comment, or add the comment's name to the process file.",
            example="`;Finish wall` without an operation of that name.",
        ),
        "FRC019": Code(
            "error",
            "log and path do not match",
            meaning="The log does not cover the path that cuts, or the length of the path is not known.",
            consequence="Each reading would be assigned to a wrong place.",
            action="Use the log of this program, from its first motion on.",
            example="A log over 2 m for a path of 3 m.",
        ),
        "FRC020": Code(
            "error",
            "no offset to subtract",
            meaning="--tare needs a log with readings in air moves (PTP, G0, FORCE OFF).",
            consequence="Without such readings the offset of the gauge is unknown.",
            action="Record the log from before the cut on; mark LIN moves in air with FORCE OFF.",
            example="`--tare` with a CSV by line.",
        ),
        "FRC021": Code(
            "warning",
            "gauge offset",
            meaning="The log shows a force in air.",
            consequence="If it is an offset of the gauge, all forces are wrong by it.",
            action="Use --tare to subtract it; nothing else does.",
            example="A mean of 35 N in the moves before the cut.",
        ),
        "FRC022": Code(
            "info",
            "gauge offset subtracted",
            meaning="The mean of the readings in air is subtracted from all readings.",
            consequence="The forces of the correction are those after the subtraction.",
            action="Check that the stated offset is plausible for the gauge.",
            example="An offset of 35 N in x.",
        ),
        "FRC023": Code(
            "warning",
            "channel is saturated",
            meaning="Equal readings follow each other at the end of a channel's range.",
            consequence="The force there is larger than the log states, so the correction is too small.",
            action="Measure again with a larger range.",
            example="2000.0 N in 40 readings in a row.",
        ),
        "FRC024": Code(
            "warning",
            "gap in the log",
            meaning="Readings are missing; the force there is interpolated from both sides.",
            consequence="A force peak inside the gap is not corrected.",
            action="Check the recorder; measure again if the gap is in a cut.",
            example="A log with 0.4 s without a reading.",
        ),
        "FRC025": Code(
            "info",
            "motions between readings",
            meaning="Motions shorter than the distance of the readings use interpolated readings.",
            consequence="Force changes on such short motions are not resolved.",
            action="Record at a higher rate if that matters.",
            example="Motions of 0.2 mm and readings every 0.5 mm.",
        ),
        "FRC026": Code(
            "warning",
            "force changes within a motion",
            meaning="A motion's force is linear from start to end; the log is not.",
            consequence="The correction does not follow the force inside the motion.",
            action="Insert a point where the force changes.",
            example="A cut that starts in the middle of a LIN.",
        ),
        "FRC027": Code(
            "warning",
            "log longer than the path",
            meaning="The rest of the log is not used.",
            consequence="The log may belong to another program.",
            action="Check that it is the log of this program, and that nothing in between takes time or path that "
            "the scale does not count: dwells, halts, motions without a feed.",
            example="A log over 5 m for a path of 3 m; a log over t_s of a program with G4.",
        ),
        "FRC028": Code(
            "info",
            "motions that take no part of the log",
            meaning="Rotations on the spot and moves to axis positions have no path length.",
            consequence="No reading of the log belongs to them.",
            action="Nothing needs to be done if they are in air.",
            example="A PTP to an axis position.",
        ),
        "FRC029": Code(
            "info",
            "summary of the log",
            meaning=(
                "The message states the number of readings, and the largest mean and peak force of a motion."
            ),
            consequence="The correction uses the mean of each motion.",
            action="Check that the forces are plausible.",
            example="A largest mean of 560 N in line 42.",
        ),
        "FRC030": Code(
            "error",
            "force is not requested",
            meaning="A run without --force predicts and corrects the effect of no force, which is nothing.",
            consequence="Nothing was written: the output would be the input.",
            action=(
                "Run with --force. It takes FORCE comments of the program, a force CSV beside it, or `force:`"
                " or `process:` of the cell; or state the force: --force 0,360,560@base."
            ),
            example="`compensate panel.src` in a cell with `correct: process`.",
        ),
        "FRC031": Code(
            "warning",
            "forces are stated twice",
            meaning="The program has FORCE comments, and a force CSV lies beside it.",
            consequence="The comments are used, and the CSV is ignored.",
            action="Name the CSV with --force, or remove what is outdated.",
            example="`;FORCE 0 360 560` in panel.src, and panel.force.csv.",
        ),
        "FRC032": Code(
            "info",
            "bias of logged forces",
            meaning=(
                "A robot that yields cuts less than it should, so forces that were logged without compensation"
                " differ from those of the compensated robot. The log is used as it is."
            ),
            consequence="The correction of first passes is too small, that of passes over what remains too large.",
            action="Log the forces of the compensated program and compensate the original again with them.",
            example="Logged on a robot of 1 um/N, finishing with ae 0.5 mm: 6 % too small.",
        ),
        "FRC034": Code(
            "warning",
            "force is very small",
            meaning="No component of any force of the program exceeds 2 N or 2 N m.",
            consequence="If it is in kN, a thousandth of the correction is applied.",
            action="State forces in N and moments in N m.",
            example="`--force 0,0.36,0.56`.",
        ),
        "FRC035": Code(
            "info",
            "FORCE comments are not used",
            meaning="The program has FORCE comments, and --force has a value.",
            consequence="The value states the forces: a force also of motions after FORCE OFF.",
            action="Use --force without a value for the forces of the comments.",
            example="`compensate panel.src --force 0,360,560`, with `;FORCE 0 280 0` in panel.src.",
        ),
        "FRC040": Code(
            "warning",
            "stated forces contradict the stock",
            meaning="Over all cuts these forces point elsewhere than those that follow from blank, tools and motions,"
            " or are several times as large or small.",
            consequence="If they are wrong, so is the correction: of a force with the other sign it doubles the error.",
            action="Check sign (on the tool, not on the part), unit and frame of the forces, and blank and tools.",
            example="A log of a dynamometer below the part: what it measures acts on the part.",
        ),
        "FRC036": Code(
            "warning",
            "mirrored obliquely to the spindle",
            meaning="The program mirrors coordinates in a plane that is neither along nor across the spindle.",
            consequence="On which side of the feed they cut is not known, and what depends on it is not corrected.",
            action="Incline the tool along or across the mirrored axis, or state the forces @base or @tool.",
            example="`G51.1 Y0.` with a tool that the cell inclines by 30 deg towards Y.",
        ),
        "FRC037": Code(
            "warning",
            "sideways force of mirrored motions",
            meaning=(
                "A force across the feed is stated @feed for motions whose coordinates the program mirrors: the spindle"
                " is not mirrored, and neither this force nor its mirror image need be that of the cut."
            ),
            consequence="A force stated for the programmed side acts to the other one, and the correction is wrong.",
            action="State the force of these motions @base or @tool, or a process, whose forces follow the mirror.",
            example="`(FORCE 61 115 -22 @FEED)` before a motion under `G51.1 Y40.`.",
        ),
        "FRC039": Code(
            "info",
            "forces are multiplied by factors of the cell",
            meaning="Forces of program, CSV or process file are multiplied by `force_factors` of the cell.",
            consequence="The force that is used, and shown as the largest, is the product.",
            action="Remove a factor that was learnt from another tool or material.",
            example="`force_factors: {SLOT: {factor: 1.5}}`.",
        ),
        "FRC033": Code(
            "error",
            "spindle turns counter-clockwise",
            meaning="An operation of the process file cuts after M4.",
            consequence="Its forces are those of a spindle that turns clockwise: sideways they are opposite.",
            action="Check M3 and M4; state the force, or blank and tools, for which both directions are computed.",
            example="`S12000 M4` before a cut with `direction: down`.",
        ),
        "FRC041": Code(
            "warning",
            "operation differs from a comment",
            meaning="The process file states another diameter for an operation than the comments of its tool.",
            consequence="One of them is wrong: the forces and the correction may be.",
            action="Correct the process file, or post the program for the tool that is used.",
            example="`diameter: 8` for `(T1 D=16. CR=0. - ZMIN=-5. - flat end mill)`.",
        ),
        "FRC042": Code(
            "warning",
            "spindle speed differs from the operation's",
            meaning="The process file states another speed of the spindle than the program.",
            consequence="One of them is wrong: the feed per tooth, the forces and the correction may be.",
            action="Correct `spindle` in the process file, or S in the program.",
            example="`spindle: 12000` for a program with `S3000 M3`.",
        ),
        "FRC043": Code(
            "warning",
            "spindle is stopped in an operation",
            meaning="An operation of the process file cuts after M5.",
            consequence="A tool that does not turn breaks; the forces are those of one that does.",
            action="Check M3 and M5.",
            example="`M5` before the last pass.",
        ),
        "FRC044": Code(
            "warning",
            "feed per tooth of an operation is implausible",
            meaning="The feed per tooth is that of no cutter: the limits are those of STK024.",
            consequence="Feed or speed have probably another unit than stated, and the forces are as wrong.",
            action="Compare F, its unit (G94, G95, mm, inches), `spindle` and `teeth` with the machine.",
            example="`spindle: 200` (1/s) for F3600: 6 mm per tooth.",
        ),
        "FRC045": Code(
            "warning",
            "size of an operation's tool is implausible",
            meaning="The cell states another diameter, or no tool of the stated size cuts what the operation does.",
            consequence="Forces and corrections belong to another tool.",
            action="State diameter and depth in mm, the diameter and not the radius, the spindle in 1/min.",
            example="`diameter: 8` where the tool in the cell has `diameter: 16`.",
        ),
        "FRC046": Code(
            "warning",
            "force or coefficients of an operation are implausible",
            meaning="The coefficients are those of no material, or force or power are beyond any robot.",
            consequence="The correction is wrong by as much.",
            action="State ktc, krc, kac in N/mm2 and kte, kre, kae in N/mm.",
            example="`ktc: 0.78`: that is 780 N/mm2 in kN/mm2.",
        ),
        "FRC047": Code(
            "warning",
            "unknown time between cuts",
            meaning="A log over t_s counts the time at the programmed feed; rapid motions, rotations on the spot and "
            "moves to axis positions state none, and while the program waits (a dwell, a halt, an input, a change of "
            "tool) none is counted.",
            consequence="The forces after them are shifted along the path by the time that they took.",
            action="Record the log over s_mm, or state the forces by line.",
            example="A log over t_s of a program with G0 or G4 between two cuts.",
        ),
    }
)
CODES = {**FORCE_CODES, **STOCK_CODES}
