"""What the tool has to say about its input: one type, one table of codes.

A finding says what (code, message), where (file, line, column) and what to do (help).  Its severity comes
from the table: ``info`` needs no action, ``warning`` means that something was left or deserves a look,
``error`` means that nothing was written.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple


class Code(NamedTuple):
    severity: str  # info | warning | error
    title: str
    explanation: str


SEVERITIES = ("info", "warning", "error")

CODES: dict[str, Code] = {
    # files
    "FIL001": Code("error", "file can not be read", "The path, or the right to read it, is wrong."),
    "FIL002": Code("error", "file is empty", "There is nothing to compensate."),
    "FIL003": Code("error", "file is no text", "It holds NUL bytes (binary, or UTF-16) or endless lines."),
    "FIL004": Code(
        "error", "file can not be written", "Nothing of this program was written; free the folder or disk."
    ),
    "FIL005": Code(
        "error",
        "program is compensated already",
        "Compensating twice doubles the correction; take the original, or say --again.",
    ),
    "FIL006": Code(
        "error",
        "points are missing",
        "Points that the cut needs are declared nowhere: the .dat of the module is not beside its .src.",
    ),
    "FIL007": Code(
        "error", "output would replace an input", "Inputs are never touched; name another output."
    ),
    "FIL008": Code(
        "error",
        "output does not hold",
        "The written program, read again, is not what was meant. Nothing was written: please report it.",
    ),
    "FIL009": Code(
        "error",
        "no motion was found",
        "The file has no motion that this tool reads; is it of another language?",
    ),
    "FIL010": Code("error", "input changed while it was read", "Another process wrote the file; run again."),
    "FIL011": Code(
        "error",
        "name is no module name",
        "A KRL module is named like its file: a letter, then letters, digits, _.",
    ),
    # KRL
    "KRL001": Code("warning", "motion not understood", "The motion is kept as it is and is not corrected."),
    "KRL002": Code(
        "warning",
        "target is not a constant",
        "It depends on what the program does not say (inputs, other programs); the motion is kept as it is.",
    ),
    "KRL003": Code("warning", "point is not declared", "Neither the program nor its .dat gives this point."),
    "KRL004": Code(
        "warning",
        "components are missing",
        "The point leaves components out and the point before it is not known.",
    ),
    "KRL005": Code(
        "warning",
        "base or tool is not known here",
        "No $BASE or $TOOL that this tool can read was set before the motion.",
    ),
    "KRL006": Code(
        "warning",
        "motion in a loop or branch that inputs decide",
        "It may run many times or never; it is kept as it is.",
    ),
    "KRL007": Code(
        "warning",
        "point serves several places",
        "Changing it would move more than this motion, and it can not get a point of its own; it is kept as it is.",
    ),
    "KRL008": Code(
        "warning",
        "relative motion",
        "Its end is not known in numbers, or it turns; it and the motion before are kept as they are.",
    ),
    "KRL009": Code(
        "warning",
        "way of an arc is not known",
        "Its begin or auxiliary point is not known in numbers, or they define no circle; it is kept as it is.",
    ),
    "KRL010": Code(
        "warning",
        "call of a program that was not read",
        "It may move the robot or change base and tool; after it the last position is not known.",
    ),
    "KRL011": Code(
        "warning",
        "base is moved by an external kinematic",
        "Its place depends on external axes; the motion is kept as it is.",
    ),
    "KRL012": Code(
        "warning", "frame is an expression", "$BASE or $TOOL is computed; motions after it are not corrected."
    ),
    "KRL013": Code(
        "warning",
        "stationary tool",
        "With $IPO_MODE=#TCP the tool stands in the world; such motions are not corrected.",
    ),
    "KRL014": Code(
        "warning", "block is not closed", "A loop, branch or DEF has no end, or an end has no begin."
    ),
    "KRL015": Code(
        "warning",
        "motion in a local subprogram",
        "It is called, or also called, with what is not known; it is kept as it is.",
    ),
    "KRL016": Code(
        "info",
        "point of the controller",
        "A PTP to a point that $config.dat declares (HOME); an air move, it stays as it is.",
    ),
    "KRL017": Code(
        "warning",
        "frame changed before a partial point",
        "How the controller re-expresses missing components in the new frame is not documented; the motion is kept.",
    ),
    "KRL018": Code("warning", "not KRL", "No DEF was found; the file may be G-code or another language."),
    "KRL019": Code(
        "warning",
        "declaration not understood",
        "A point in the .dat could not be read; motions that use it are kept as they are.",
    ),
    "KRL020": Code(
        "warning",
        "jump",
        "Past a label that a GOTO may reach, the position is not known until it is set again, nor are base and tool"
        " where they change between the two.",
    ),
    "KRL021": Code(
        "warning",
        "path is in another file",
        "A technology package reads the path from data beside the program; there is nothing to correct here.",
    ),
    "KRL022": Code(
        "warning",
        "external axes move",
        "One that carries the robot or the workpiece puts both elsewhere than the cell says; make sure that none does.",
    ),
    "KRL023": Code(
        "warning",
        "motion never runs",
        "The flow that the program's constants give does not lead there; it is kept as it is.",
    ),
    "KRL024": Code(
        "warning",
        "flow is too long to follow",
        "Loops and calls run more statements than are followed; motions in them are kept as they are.",
    ),
    "KRL025": Code(
        "warning",
        "letters that KRL does not have",
        "Names have the letters A to Z; what such a statement does is not known, nor is what it sets.",
    ),
    # G-code
    "GCO001": Code(
        "warning",
        "block not understood",
        "It is kept as it is; what it moves is not known, so it is not corrected.",
    ),
    "GCO002": Code(
        "warning",
        "position is not known",
        "A coordinate was never set, or something before left it unknown; the motion is kept as it is.",
    ),
    "GCO003": Code(
        "info",
        "rapid that is not fully known",
        "A coordinate, the offset or the tool is not known yet; an air move, it stays as it is.",
    ),
    "GCO004": Code(
        "info", "machine or reference position", "G28, G30, G53: not a place in the base; it stays as it is."
    ),
    "GCO005": Code(
        "warning", "variable or expression", "Only numbers can be corrected; the motion is kept as it is."
    ),
    "GCO006": Code(
        "warning",
        "motion in a loop, branch or subprogram",
        "It may run many times or never; it is kept as it is.",
    ),
    "GCO007": Code(
        "warning",
        "call of code that was not read",
        "It may move the machine and change modes; behind it these are not known until they are set again.",
    ),
    "GCO008": Code("warning", "canned cycle", "Its motions are the control's; the block is kept as it is."),
    "GCO009": Code(
        "warning",
        "tool radius compensation",
        "Under G41 and G42 the control computes the tool's path; it is not corrected.",
    ),
    "GCO010": Code(
        "warning",
        "coordinates are not those of the base",
        "Turned, scaled, mirrored or polar coordinates, or diameters; such motions are kept as they are.",
    ),
    "GCO011": Code("info", "probing", "Where a probing move ends is not known; it stays as it is."),
    "GCO012": Code("warning", "arc not understood", "Begin, end, centre and plane do not make an arc."),
    "GCO013": Code(
        "warning",
        "rotary axes without a TCP mode",
        "Where the tool is then depends on the machine's geometry; the motion is kept as it is.",
    ),
    "GCO014": Code(
        "warning",
        "work offset is not known",
        "The program writes the offset itself (G10, a variable), or it can not be told which one is in force.",
    ),
    "GCO015": Code("warning", "tool is not known", "No tool is loaded, or its number is not known."),
    "GCO016": Code(
        "warning", "other motion", "A spline, a thread, a corner or a further axis; it is kept as it is."
    ),
    "GCO017": Code(
        "warning", "words contradict each other", "Controls differ in what they do; it is kept as it is."
    ),
    "GCO018": Code("warning", "no motion code is in force", "Axis words stand before any G0, G1, G2 or G3."),
    "GCO019": Code(
        "warning",
        "origin is not known",
        "G92 set the coordinates of a position that is not known; motions behind it are kept as they are.",
    ),
    "GCO020": Code("info", "unit is not stated", "No code says mm or inch; mm is taken."),
    "GCO021": Code("info", "tool is not stated", "The program names no tool; tool 1 of the cell is taken."),
    "GCO022": Code(
        "warning",
        "words without a decimal point",
        "The cell counts them in increments, but the control of this dialect does not.",
    ),
    "GCO023": Code(
        "info", "length of another tool", "G43 names an H that is not the tool's; the cell's tool is taken."
    ),
    "GCO024": Code(
        "warning",
        "program writes offsets",
        "What the control knows of bases and tools then differs from the cell; motions with that base are kept.",
    ),
    "GCO025": Code("info", "motion behind the end", "It stands behind M2, M30 or M99 and does not run."),
    "GCO026": Code(
        "info",
        "further axes move",
        "One that carries the robot or the workpiece puts both elsewhere than the cell says; make sure that none does.",
    ),
    # Sinumerik
    "SIN001": Code(
        "info",
        "tool is called by a name",
        "Named tools are taken as the cell's tools 1, 2 ... in the order in which the program names them.",
    ),
    # G-code, written
    "GCW001": Code(
        "warning",
        "arc can not be written",
        "No numbers state the corrected arc: a circle that no longer closes, an arc shorter than a digit.",
    ),
    "GCW002": Code(
        "warning",
        "orientation can not be written",
        "The words of the block reach no such orientation of the tool; the motion is kept as it is.",
    ),
    # YAML files
    "YML001": Code("error", "not valid YAML", "It does not parse, or has aliases, tags or odd characters."),
    "YML002": Code("error", "unknown key", "A key that has no meaning here; nothing is ignored silently."),
    "YML003": Code("error", "missing key", "A key that must be there."),
    "YML004": Code("error", "wrong value", "A value of the wrong kind or outside of its range."),
    "YML005": Code("error", "wrong unit", "A unit that is not one of this quantity."),
    # cell
    "CEL001": Code(
        "error",
        "no cell",
        "A cell.yaml must lie in the program's folder or above it, or be named with --cell.",
    ),
    "CEL002": Code(
        "error",
        "frame is missing",
        "The program uses a base or tool number that neither it nor the cell gives.",
    ),
    "CEL003": Code("error", "robot is not known", "No robot file has this name."),
    "CEL004": Code(
        "error",
        "orientation is missing",
        "A three-axis program says positions only; `orientation:` of the cell says how the tool stands.",
    ),
    "ROB001": Code(
        "error",
        "robot file would lose its URDF",
        "A robot file names a URDF in its own folder or below; the new file would lie elsewhere.",
    ),
    "ROB002": Code(
        "error",
        "robot file can not be edited",
        "New values are written into the text as it is; this layout leaves no place for them.",
    ),
    "URD001": Code("error", "URDF is wrong", "The robot description can not be read as one serial arm."),
    # force
    "FRC001": Code("error", "no force", "--force was given alone, and no force belongs to the program."),
    "FRC002": Code("error", "force not understood", "A force is 3 or 6 numbers and a frame: 0,360,560@base."),
    "FRC003": Code("error", "force file is wrong", "The header or a row of the force CSV can not be used."),
    "FRC004": Code("error", "force for no motion", "The force CSV names a line that holds no motion."),
    "FRC005": Code(
        "error",
        "feed direction is not known",
        "A force in the feed frame needs a motion with a direction and a spindle axis.",
    ),
    "FRC006": Code(
        "warning", "comment looks like a force", "It begins with FORCE but is none; it was not used."
    ),
    "FRC007": Code(
        "info", "motions without a force", "The force CSV has no row for them; they are taken as air."
    ),
    "FRC008": Code(
        "info",
        "plunge before any feed",
        "A force in the feed frame without a feed direction took that of the next motion of its cut.",
    ),
    "FRC009": Code("warning", "force on an air move", "PTP is air by definition; its force was not used."),
    "FRC010": Code(
        "info",
        "direction of the feed kept",
        "A plunge or a turn on the spot has no feed direction across the spindle; the last one stays.",
    ),
    "FRC011": Code(
        "error",
        "process for another program",
        "No operation of the process file has a motion in the program: names, tools and lines all miss.",
    ),
    "FRC012": Code(
        "warning",
        "operation without motions",
        "The program has no such name, tool or lines; look at its spelling.",
    ),
    "FRC013": Code(
        "error", "feed is not known", "Feed per tooth, or the time of a motion, needs the programmed feed."
    ),
    "FRC014": Code(
        "info",
        "motion without a force",
        "The process model knows side cutting only: plunges, and approaches from axis positions, are taken as air.",
    ),
    "FRC015": Code("info", "force of an operation", "What the process file came to for this operation."),
    "FRC016": Code(
        "info", "no axial coefficients", "The source of the coefficients states none; Fz is taken as 0."
    ),
    "FRC017": Code(
        "warning",
        "feed unlike the rest of the operation",
        "Motions that are much faster than the others may go through air; state `rapid` or mark them FORCE OFF.",
    ),
    "FRC018": Code(
        "info",
        "comment names no operation",
        "A cut begins behind comments of which none names an operation; the last named one goes on.",
    ),
    "FRC019": Code(
        "error",
        "log and path do not match",
        "The log does not cover the path that cuts, or the length of the path is not known.",
    ),
    "FRC020": Code(
        "error",
        "no offset to take off",
        "--force-offset needs a log with readings in air moves (PTP, G0, FORCE OFF).",
    ),
    "FRC021": Code(
        "warning",
        "gauge offset",
        "In air the log shows a force; --force-offset takes it off, nothing else does.",
    ),
    "FRC022": Code(
        "info", "gauge offset taken off", "The mean of the readings in air was taken off all readings."
    ),
    "FRC023": Code(
        "warning",
        "channel saturated",
        "Equal readings in a row at the end of a channel's range: there was more.",
    ),
    "FRC024": Code(
        "warning", "gap in the log", "Readings are missing; the force there is taken from both sides."
    ),
    "FRC025": Code(
        "info",
        "motions between readings",
        "Motions shorter than the distance of readings take the log between them.",
    ),
    "FRC026": Code(
        "warning",
        "force changes within a motion",
        "A motion's force is linear from begin to end; here the log is not. Insert a point where the force changes.",
    ),
    "FRC027": Code(
        "warning", "log longer than the path", "The rest of the log was not used; is it of this program?"
    ),
    "FRC028": Code(
        "info",
        "motions that take no part of the log",
        "Turns on the spot and moves to axis positions have no path length, moves without a feed no known time.",
    ),
    "FRC029": Code("info", "log in short", "Readings, and the largest mean and peak force of a motion."),
    # kinematics
    "KIN001": Code(
        "error",
        "pose out of reach",
        "A programmed cutting pose can not be reached: base, tool or robot do not belong to the program.",
    ),
    "KIN002": Code(
        "warning",
        "beyond the axis limits",
        "The pose asks an axis to leave its limits; its cut is left as it was.",
    ),
    "KIN003": Code(
        "warning",
        "near a singularity",
        "Small corrections turn axes far here; watch this place in the first run.",
    ),
    "KIN004": Code(
        "error",
        "configuration is not known",
        "No axes, no S and T before this motion; give `start:` in the cell.",
    ),
    "KIN005": Code(
        "warning",
        "air move out of reach or limits",
        "Nothing is corrected there; base, tool or robot may be wrong.",
    ),
    "KIN006": Code(
        "warning",
        "S or T no longer holds",
        "The corrected pose lies on another side than the S or T that stands with it.",
    ),
    "KIN007": Code(
        "warning",
        "S or T disagree with the pose",
        "The program states an S or T that this robot does not have at that pose.",
    ),
    # model
    "KIN008": Code(
        "warning",
        "axis near its limit",
        "The correction brings an axis close to its limit; the controller may stop there.",
    ),
    "KIN009": Code(
        "warning",
        "axis too fast for the feed",
        "At the programmed feed an axis would have to move faster than it can: the robot slows down there.",
    ),
    "MOD001": Code(
        "warning",
        "compensator pulls implausibly",
        "Its static torque is far above what a balancer carries; the parameters serve for the stiffness only.",
    ),
    "MOD003": Code(
        "warning",
        "robot does not give way",
        "Its robot file states no compliance, so no force moves the tool and nothing is corrected for it; measure the"
        " arm's stiffness and write it into the file.",
    ),
    "MOD002": Code(
        "warning",
        "no equilibrium",
        "The deflected robot has no stable state under this force; the cut is left as it was.",
    ),
    # identification
    "IDN001": Code(
        "error",
        "no such effect or parameter",
        "Effects are named as in a robot file, parameters as effect.parameter.",
    ),
    "IDN002": Code("error", "fewer readings than unknowns", "Nothing can be found from so few numbers."),
    "IDN003": Code(
        "error",
        "model has no stable rest",
        "With these values the robot would fall over; the robot file is wrong.",
    ),
    "IDN010": Code("error", "joint angles look like radians", "The columns A1..An are in degrees."),
    "IDN011": Code("error", "poses are alike", "What a pose shows is the same for all of them."),
    "IDN012": Code(
        "error", "deflections are of no robot's size", "Their unit or that of the forces is another one."
    ),
    "IDN013": Code(
        "error",
        "loads say nothing",
        "Without a load, or with one that never changes, its effect can not be seen.",
    ),
    "IDN014": Code(
        "error", "readings fit after one change", "A column or a unit is another one than the header says."
    ),
    "IDN015": Code("warning", "readings fit badly", "Much of what was measured is not explained."),
    "IDN016": Code(
        "warning", "readings are of another robot", "The name in the readings is not that of the robot file."
    ),
    "IDN017": Code("error", "nothing can be found", "No parameter asked for shows in these readings."),
    "IDN018": Code(
        "warning",
        "outlier",
        "The reading lies far from where all others put it; --drop-outliers leaves it out.",
    ),
    "IDN019": Code("info", "outlier left out", "As asked for; the fit is without this reading."),
    "IDN020": Code(
        "warning",
        "parameter can not be found",
        "It keeps the value of the robot file; other poses or loads may show it.",
    ),
    "IDN021": Code(
        "info",
        "parameter is part of the registration",
        "A place of the tracker or of its target does the same.",
    ),
    "IDN022": Code(
        "warning",
        "parameter is at its bound",
        "The readings ask for more than is possible; something else is missing.",
    ),
    "IDN023": Code(
        "warning",
        "readings contradict the robot file",
        "The interval in the robot file, or the model, is wrong.",
    ),
    "IDN024": Code(
        "info", "more is left than scatter", "The model does not explain all; an effect may be missing."
    ),
    "IDN025": Code(
        "info",
        "parameters are correlated",
        "The readings hardly tell them apart; their sum or ratio is known better.",
    ),
    "IDN026": Code(
        "warning",
        "interval differs by bootstrap",
        "Few readings, outliers or a bent problem: trust the wider one.",
    ),
    "IDN027": Code(
        "warning",
        "no gain on poses not fitted",
        "What was fitted does not hold elsewhere; ask for fewer effects.",
    ),
    "IDN028": Code(
        "info", "registered anew", "The validation's tracker is registered from its own readings."
    ),
    "IDN029": Code(
        "info",
        "readings of a pose share an error",
        "It counts in the weights: more targets of a pose say less than more poses.",
    ),
    "IDN030": Code(
        "info", "level of an interval is not stated", "A prior with such an interval counts as one of 95 %."
    ),
    "IDN031": Code(
        "warning",
        "readings count twice",
        "Intervals of the robot file came from these readings: no second source. Start from the file before it.",
    ),
    # diagnosis
    "DIA001": Code("error", "too few poses for a verdict", "Of so few poses any explanation would fit."),
    "DIA002": Code(
        "warning",
        "reading left out",
        "It lies far from where all others put it; the verdict is without it. Measure there again.",
    ),
    # measurements
    "MEA001": Code(
        "error", "measurements are wrong", "A comment, the header or a row of the CSV can not be used."
    ),
    "MEA002": Code("error", "no readings yet", "No row of the CSV holds a measured value."),
    "MEA003": Code("info", "rows without a reading", "Planned, but not measured: they were left out."),
    "MEA004": Code("warning", "comment looks like a key", "It is close to a key, but none; it was not used."),
    "MEA005": Code("warning", "target never occurs", "A place is stated for a target that no row measures."),
    "MEA006": Code(
        "warning",
        "time runs backwards",
        "Rows stand in the order of time: drift, backlash and hysteresis are read from it.",
    ),
    "MEA007": Code(
        "warning",
        "repeats of different states",
        "REPEAT is the id of one state, measured again; rows with other joint angles or loads repeat nothing.",
    ),
    "MEA008": Code(
        "error", "files do not belong together", "Files that are read as one must agree in what they say."
    ),
    "MEA009": Code("info", "frame is not used", "Deflections stand in the axes of the robot base."),
    # plan
    "PLN001": Code(
        "error", "no pose can be measured", "Limits, room and sight to the tracker leave no pose."
    ),
    "PLN002": Code("error", "nothing can be seen", "No pose and load on offer shows what is asked for."),
    "PLN003": Code("error", "no stable rest", "The deflected robot has no equilibrium under these loads."),
    "PLN004": Code("error", "not enough distinct poses", "Ask for fewer poses, or for a smaller --spacing."),
    "PLN005": Code(
        "error", "no load", "A deflection is what a load does; name the weights that can be hung."
    ),
    "PLN006": Code("error", "plan can not be made so", "Two options do not go together."),
    "PLN007": Code(
        "warning",
        "parameter can not be seen",
        "Whatever the pose, these loads and readings do not show it; `identify` will leave it as it is.",
    ),
    "PLN008": Code(
        "warning",
        "parameter is left out",
        "These poses together show too little of it; `identify` will leave it as it is. More poses may show it.",
    ),
    "PLN009": Code(
        "info",
        "intervals wider than wanted",
        "More poses, a larger load or lever, reflectors further out or more room for the arm make them smaller.",
    ),
    "PLN010": Code(
        "warning",
        "effects can not be told apart",
        "Even at these poses one of them explains what the other would show, within the scatter.",
    ),
    "PLN011": Code(
        "info",
        "parameter is part of the registration",
        "A place of the tracker or of its target does the same; `identify` finds that instead.",
    ),
    # map
    "MAP001": Code(
        "error",
        "no gravity compensator",
        "--sign chooses how a compensator is read; this robot's model has none.",
    ),
    "MAP002": Code(
        "warning",
        "nothing is in reach",
        "The arm gets to no cell of the grid; no picture and no CSV were written. Look at ranges, tool, orientation.",
    ),
    "MAP003": Code(
        "warning",
        "cells without an equilibrium",
        "The deflected robot has no stable state there under this force; these cells have no value.",
    ),
    "MAP004": Code("info", "slices left out of the picture", "The CSV has all of them."),
    "MAP005": Code(
        "warning",
        "nothing gives way",
        "The robot file states no compliance, or none that this force acts on: a map of zeros says nothing.",
    ),
    "MAP006": Code("error", "arm without S", "S names the branches of KUKA-type arms; leave --status out."),
    "MAP007": Code(
        "info",
        "postures are free",
        "Each cell is solved on its own from the middle of the axis limits; a step in the map may be one of posture.",
    ),
    # correction
    "COR001": Code(
        "warning", "not converged", "The mirror correction did not settle; the cut is left as it was."
    ),
    "COR002": Code(
        "error",
        "correction too large",
        "More than max_correction of the cell; the force, the model or a frame is wrong.",
    ),
    "COR003": Code(
        "warning",
        "cut left as it was",
        "One of its motions could not be corrected, and a correction must not switch inside of a cut.",
    ),
    "COR004": Code(
        "warning",
        "COMPENSATE switched inside a cut",
        "The switch is allowed in air only; the whole cut is left as it was.",
    ),
    "COR005": Code(
        "warning",
        "residual above the tolerance",
        "The written program does not reach the wanted place within the tolerance.",
    ),
    "COR006": Code(
        "warning",
        "way between points above the tolerance",
        "Where no motion may be inserted, or none is short enough, the tool leaves the tolerance between two points.",
    ),
    "COR007": Code(
        "info", "part of the correction applied", "--gain below 1 leaves the rest of the error, as asked."
    ),
    "COR010": Code(
        "info",
        "no force",
        "Without --force the tool is not loaded, and nothing is to be corrected; the output is the input.",
    ),
    "COR011": Code(
        "warning",
        "comment looks like a switch",
        "It begins with COMPENSATE but is neither COMPENSATE OFF nor COMPENSATE ON; it was not used.",
    ),
    "COR008": Code(
        "warning",
        "corrected point leaves the limits",
        "The correction brings an axis beyond its limits; its cut is left as it was.",
    ),
    "COR009": Code(
        "warning",
        "corrected point is out of reach",
        "The correction leads out of reach; its cut is left as it was.",
    ),
    "VER001": Code(
        "error",
        "not the same program",
        "The second program does not make the motions of the first one, with others between them.",
    ),
    "VER002": Code(
        "warning",
        "no mark of a compensation",
        "The second program was not written by this tool, or its mark was taken out.",
    ),
    "VER003": Code(
        "warning",
        "path error above the tolerance",
        "The simulated tool is farther beside the wanted path than the cell allows.",
    ),
    "VER004": Code(
        "warning",
        "not simulated",
        "The way of these motions is the controller's own, or the robot can not be followed there.",
    ),
    "COR012": Code(
        "info",
        "motions inserted",
        "Links, where the correction steps, and points that keep the way between the programmed ones in tolerance.",
    ),
    "COR013": Code(
        "warning",
        "arc can not be corrected",
        "The corrected points give no arc that could be written; the cut is left as it was.",
    ),
    "COR015": Code(
        "info",
        "approximation larger than the correction",
        "The controller does not reach points that it approximates; at corners it rounds off more than is corrected.",
    ),
    "COR014": Code(
        "warning",
        "limit of growth reached",
        "max_growth of the cell allows fewer inserted motions than the tolerance asks for; the worst ones got theirs.",
    ),
    # batch
    "BAT001": Code(
        "error",
        "no program matched",
        "A batch names programs by files, folders and patterns; this one names none.",
    ),
    "BAT002": Code(
        "error",
        "two programs with one output",
        "One would overwrite the other, or the other's reports; nothing was begun.",
    ),
    "BAT003": Code(
        "error",
        "path outside of the folder",
        "Programs and outputs of a job file lie in its folder or below, unless --allow-outside is said.",
    ),
    "BAT004": Code(
        "error",
        "defect",
        "A program met a defect of this tool; the other programs went on. Please report it.",
    ),
    "BAT005": Code(
        "error",
        "process died",
        "The process that had the program ended before it was done, most often for want of memory.",
    ),
    "BAT006": Code(
        "error",
        "cluster can not be used",
        "Scheduler and workers must be there, see the same folders, and have the same version as this machine.",
    ),
    "BAT007": Code(
        "warning",
        "older output stands",
        "The program could not be done; what lies in its place was written before, from another input.",
    ),
}


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing to tell.  ``line`` and ``column`` count from 1; 0 where there is none."""

    code: str
    message: str
    file: str = ""
    line: int = 0
    column: int = 0
    help: str = ""

    def __post_init__(self) -> None:
        if self.code not in CODES:
            raise ValueError(f"no such code: {self.code}")

    @property
    def severity(self) -> str:
        return CODES[self.code].severity

    @property
    def place(self) -> str:
        """``file:line:column`` as far as it is known."""
        parts = [self.file, *(str(n) for n in (self.line, self.column) if n)]
        return ":".join(part for part in parts if part)

    def __str__(self) -> str:
        return f"{self.place}{': ' if self.place else ''}{self.code} {self.message}"

    def as_json(self) -> dict[str, object]:
        return {
            "code": self.code,
            "severity": self.severity,
            "file": self.file,
            "line": self.line,
            "column": self.column,
            "message": self.message,
            "help": self.help or CODES[self.code].explanation,
        }


class Refusal(Exception):
    """The work can not be done; it carries the findings that say why."""

    def __init__(self, *findings: Finding) -> None:
        super().__init__("; ".join(str(finding) for finding in findings))
        self.findings = findings


def nearest(word: str, words: Iterable[str]) -> str:
    """``; did you mean 'x'?`` for a misspelt word, or nothing."""
    match = difflib.get_close_matches(word, list(words), 1, 0.5)
    return f"; did you mean {match[0]!r}?" if match else ""
