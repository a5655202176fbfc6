"""The schemas of the results about programs: the main job, predict, check, verify, batch, and the corrections table."""

from __future__ import annotations

from postproc.batching.job_file import FOLDER
from postproc.cell import MODES
from postproc.compensation.correct import MotionOutcome
from postproc.part.part_figures import FEATURES
from postproc.report.batched import STATES, WORDS_OF_SUMMARY
from postproc.report.corrections_csv import STATE_NAMES
from postproc.report.report import REVIEW, VERDICTS, WITHIN
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import (
    ENDING,
    FINDINGS,
    OPTIONS,
    array,
    boolean,
    by_name,
    integer,
    quantity,
    record,
    result,
    spread,
    word,
)
from postproc.toolpath import Kind

_SIDES = {
    "before": spread("before the correction"),
    "after": spread("after the correction"),
}
_CI95 = quantity("mm", "half width of the 95 % interval of the maximum", nullable=True)
_LARGEST = {"max": quantity("deg", "maximum", nullable=True)}

_UNCERTAINTY = record(
    {
        "known": boolean("whether the stated intervals determine the uncertainty"),
        "lower_bound": boolean("whether an input has no interval: the uncertainty is at least this"),
        "before_mm": quantity("mm", "half width (95 %) of the largest error before", nullable=True),
        "after_mm": quantity("mm", "half width (95 %) of the largest error after", nullable=True),
        "bound_after_mm": quantity("mm", "the largest error after is below, with 95 %", nullable=True),
        "budget": array(
            record(
                {
                    "parameter": word("effect.parameter, or force"),
                    "share": quantity("1", "share of the variance"),
                },
                "one contribution",
            ),
            "uncertainty budget: contributions to the variance of the largest error, largest first",
        ),
        "effect_of_10_percent_mm": by_name(
            quantity("mm", "change of the largest error", nullable=True),
            "inputs without an interval: what 10 % of each changes of the largest error",
        ),
        "without_interval": array(word("effect.parameter, or force"), "inputs without an interval"),
        "level_unstated": array(
            word("effect.parameter"), "inputs whose interval has no stated level; 95 % is assumed"
        ),
        "no_equilibrium": integer("motions without an equilibrium within the intervals"),
    },
    "expanded uncertainty (95 %) of the predicted errors",
)

MODEL = by_name(
    {
        "type": "object",
        "description": f"one effect: its parameters, and {OPTIONS}",
        "required": ["parameters"],
        "properties": {
            "parameters": by_name(
                record(
                    {
                        "value": quantity("as in unit", "value"),
                        "unit": word("SI unit"),
                        "interval": quantity("as in unit", "half width of the interval", nullable=True),
                        "level": {
                            "description": "level of the interval, or unstated",
                            "type": ["number", "string", "null"],
                            "unit": "1",
                        },
                        "source": word("where the value comes from"),
                    },
                    "one parameter",
                ),
                "parameters by name",
            )
        },
        "additionalProperties": {"description": "an option of the effect"},
    },
    "effects of the model as it was used, by name",
)

_PATH_FIGURES: dict[str, Schema] = {
    "along_feed_mm": record(_SIDES, "error at the points along the feed; absent for predict"),
    "across_feed_mm": record(_SIDES, "error at the points across the feed; absent for predict"),
    "force_ramp_mm": quantity("mm", "shortest path over which a force step inside a cut is spread"),
    "force_ramps": integer("force steps inside cuts that are spread"),
    "force_ramp_max": record(
        {
            "mm": quantity("mm", "its length", nullable=True),
            "line": integer("line of the motion at whose start the force steps, 0 without one"),
        },
        "longest path over which a force step inside a cut is spread: longer where the correction goes back",
    ),
    "lead_ins": integer("motions in air that end where a corrected cut starts"),
    "stops_added": integer("exact stops that the correction adds inside cuts"),
    "backwards": integer("motions of the output against the feed"),
    "correction_rate": record(
        {
            "mm_per_mm": quantity("mm/mm", "per length of the path", nullable=True),
            "mm_per_s": quantity("mm/s", "per time at the programmed feed", nullable=True),
            "line": integer("line where it is"),
        },
        "largest change of the correction inside a cut",
    ),
}

_PART_ERRORS: dict[str, Schema] = {
    "gouge_max": quantity("mm", "largest gouge: material that is missing"),
    "excess_max": quantity("mm", "largest excess: material that remains"),
    "rms": quantity("mm", "root mean square by area"),
    "p95": quantity("mm", "95 % of the area have less"),
    "out_of_tolerance": quantity("1", "share of the area with more than the tolerance"),
}
_PART_SIDE: dict[str, Schema] = {
    **_PART_ERRORS,
    "ci95": quantity("mm", "half width of the 95 % interval of the largest error", nullable=True),
    "worst": record(
        {
            "line": integer("line of the motion that made the surface there", nullable=True),
            "error": quantity("mm", "error with its sign, excess above zero"),
            "feature": word("kind of surface", FEATURES),
            "position": array(quantity("mm", "coordinate"), "X Y Z in the base of the stock"),
        },
        "the point with the largest error",
    ),
}
_PART_GROUPS = record(
    {
        "name": word("kind of surface, or tool"),
        "lines": array(integer("line"), "first and last line of the motions that make it"),
        "area_share": quantity("1", "share of the area"),
        "before": record(_PART_ERRORS, "as posted"),
        "after": record(_PART_ERRORS, "as compensated", nullable=True),
    },
    "a part of the surface",
)
_CUT_FORCES = {
    "engagement": word(
        "coupled: solved together with the deflection; nominal: that of tools that do not yield",
        ("coupled", "nominal"),
    ),
    "reason": word("why it is the nominal one", nullable=True),
    "force_max_n": quantity("N", "largest force of this side", nullable=True),
    "nominal_force_max_n": quantity("N", "largest force of the nominal engagement"),
    "residual": quantity(
        "mm",
        "largest difference between the deflection by a force and that it acts at",
        nullable=True,
    ),
}
_PART_ERROR = record(
    {
        "points": integer("points of the surface that the program makes"),
        "spacing": quantity("mm", "spacing of the grid that chooses them"),
        "area_mm2": quantity("mm2", "area of the surface that the program makes"),
        "tolerance": quantity("mm", "tolerance of the cell"),
        "before": record(_PART_SIDE, "as posted"),
        "after": record(_PART_SIDE, "as compensated", nullable=True),
        "features": array(_PART_GROUPS, "by the angle of the surface to the spindle"),
        "operations": array(_PART_GROUPS, "by tool, in the order of the program"),
        "as_posted": record(_CUT_FORCES, "the forces as posted"),
        "as_compensated": record(_CUT_FORCES, "the forces as compensated", nullable=True),
    },
    "signed normal error of the surface of the part; null where the process states no stock",
    nullable=True,
)

_PROGRAM: dict[str, Schema] = {
    "program": word("path of the program"),
    "dialect": word("language of the program"),
    "robot": word("name of the robot"),
    "motions": integer("motions of the input"),
    "cuts": integer("cuts: motions between two air moves"),
    "cutting": integer("motions that cut"),
    "corrected": integer("motions that are corrected"),
    "inserted": integer("motions inserted, transition moves included"),
    "transition_moves": array(
        record(
            {"line": integer("line that it precedes"), "length_mm": quantity("mm", "length")},
            "one transition move",
        ),
        "inserted motions between two corrections",
    ),
    "uncorrected": integer("motions that need a correction and are not corrected"),
    "iterations": integer("iterations of the correction, at most"),
    "gain": quantity("1", "share of the correction that is applied"),
    "correct": word("what is corrected, as in the cell file", MODES),
    "force": record(
        {
            "source": word("where the forces come from"),
            "max_n": quantity("N", "largest force"),
            "peak_n": quantity("N", "largest peak of a measured force", nullable=True),
        },
        "the machining force",
    ),
    "error_before_mm": spread("predicted error at the points before the correction", ci95=_CI95),
    "largest_error_mm": record(
        {
            "before": quantity("mm", "without the correction", nullable=True),
            "after": quantity("mm", "with it", nullable=True),
        },
        "largest predicted error of the program: at the points, and inside of motions after the correction or where the"
        " force changes there",
    ),
    "error_after_mm": spread("predicted error at the points after the correction", nullable=True, ci95=_CI95),
    "path_error_mm": spread("predicted path error between points after the correction", nullable=True),
    **_PATH_FIGURES,
    "correction_mm": spread("length of the corrections", nullable=True),
    "angle_before_deg": record(_LARGEST, "orientation error at the points before the correction"),
    "angle_after_deg": record(
        _LARGEST, "orientation error at the points after the correction", nullable=True
    ),
    "path_error_deg": record(
        _LARGEST, "orientation error between points after the correction", nullable=True
    ),
    "part_error_mm": _PART_ERROR,
    "uncertainty": _UNCERTAINTY,
    "tolerance_mm": quantity("mm", "tolerance of the cell", nullable=True),
    "verdict": word(
        "error plus uncertainty against the tolerance; null for predict", VERDICTS, nullable=True
    ),
    "model": MODEL,
    "digests": by_name(word("SHA-256, hexadecimal"), "robot, and each file that is read for the program"),
    **ENDING,
}


def report_schema() -> Schema:
    return result("program", "the main job: one program, compensated", _PROGRAM)


def predict_schema() -> Schema:
    only_corrected = [key for key in _PROGRAM if key in _PATH_FIGURES]
    properties = {key: schema for key, schema in _PROGRAM.items() if key not in only_corrected}
    return result("predict", "the predicted errors of one program", properties)


def check_schema() -> Schema:
    counts = integer("motions")
    return result(
        "check",
        "one program, read only",
        {
            "program": word("path of the program"),
            "dialect": word("language of the program"),
            "files": array(word("path"), "files of the program"),
            "motions": integer("motions of the program"),
            "kinds": by_name(counts, "motions by kind"),
            "refused": by_name(counts, "motions that can not be corrected, by code of the finding"),
            "findings": FINDINGS,
            "exit": integer("exit code of the command"),
        },
    )


def _simulated(about: str) -> Schema:
    return spread(
        about,
        samples=integer("samples along the path"),
        converged=boolean("whether force and position converge everywhere; else no errors are known"),
        orientation_deg=quantity("deg", "largest orientation error", nullable=True),
        missed=quantity("mm", "largest distance of a point from the path of the tool", nullable=True),
        cut_ends=spread(
            "error at the first and last points of cuts",
            along=quantity("mm", "largest part along the path", nullable=True),
        ),
        doubling=record(
            {
                "mm": quantity("mm", "of the largest error", nullable=True),
                "deg": quantity("deg", "of the largest orientation error", nullable=True),
            },
            "change by twice as many samples",
        ),
        stops=integer("exact stops inside cuts"),
        backwards=integer("motions against the feed"),
        approaches=record(
            {"count": integer("number"), "length_mm": quantity("mm", "length of all")},
            "lead-ins and lead-outs in air",
        ),
        unknown_corners=integer("points with an unknown approximation distance"),
        points_alone=integer(
            "points of cuts, as of splines and drilled holes, that are compared without a path between"
        ),
        skipped=integer("motions that are not simulated"),
        worst=array(
            record(
                {
                    "line": integer("line of the motion"),
                    "mm": quantity("mm", "error"),
                    "axis": word("axis of the base along which the error is largest"),
                    "force_n": quantity("N", "force there"),
                },
                "one place",
            ),
            "places with the largest errors",
        ),
    )


def verify_schema() -> Schema:
    return result(
        "verify",
        "two programs, simulated along their paths",
        {
            "programs": array(word("path"), "original, compensated"),
            "robot": word("name of the robot"),
            "force": record({"source": word("where the forces come from")}, "the machining force"),
            "motions": array(integer("motions"), "original, compensated"),
            "growth": quantity("1", "motions of the compensated program over those of the original"),
            "step_mm": quantity("mm", "distance of the first samples"),
            "tolerance_mm": quantity("mm", "tolerance of the cell"),
            "tolerance_deg": quantity("deg", "tolerance of the orientation"),
            "converged": boolean("whether both simulations converge"),
            "samples": integer("samples along the compensated program"),
            "original": _simulated("distance of the tool from the desired path, original program"),
            "compensated": _simulated("distance of the tool from the desired path, compensated program"),
            "verdict": word(
                "largest errors of the compensated program against the tolerances; null where they are not known",
                (WITHIN, REVIEW),
                nullable=True,
            ),
            "findings": FINDINGS,
            "exit": integer("exit code of the command"),
        },
    )


_OF_SEVERAL = {
    "name": word("path of the program in the folder of the batch"),
    "state": word("state of the program", STATES),
    **{key: _PROGRAM[key] for key in WORDS_OF_SUMMARY},
}
_ONLY_SOME = [
    key for key in _OF_SEVERAL if key not in ("name", "state", "program", "findings", "outputs", "exit")
]
"""Keys of one of several programs that a failed one has not."""


def watch_schema() -> Schema:
    about = "one program of a folder that is watched; each is one line; of a failed one only some keys"
    return result("watch", about, _OF_SEVERAL, optional=_ONLY_SOME)


def batch_schema() -> Schema:
    return result(
        "batch",
        f"many programs; also summary.json in the folder of the results ({FOLDER})",
        {
            **{state.replace(" ", "_"): integer(f"programs {state}") for state in STATES},
            "programs": array(
                record(_OF_SEVERAL, "one program", optional=_ONLY_SOME),
                "programs, in the order of the batch; of a failed one only some keys",
            ),
            "skipped_files": array(word("path"), "files that match and are not programs"),
            "outputs": array(word("path"), "files of the summary"),
            "exit": integer("exit code, of the worst program"),
        },
    )


def corrections_schema() -> Schema:
    """The columns of <stem>.corrections.csv and <stem>.deflection.csv, as an object per row; an empty cell is null."""

    def axes(name: str, unit: str, about: str, of: str = "xyz") -> dict[str, Schema]:
        return {name.format(axis): quantity(unit, f"{about}, {axis}", nullable=True) for axis in of}

    columns: dict[str, Schema] = {
        "line": integer("line of the motion in the input"),
        "kind": word("kind of the motion", [kind.name for kind in Kind]),
        "state": word("what is done with it", [STATE_NAMES[state] for state in MotionOutcome]),
        "cut": integer("number of the cut, from 1; empty in air", nullable=True),
        **axes("{}_mm", "mm", "programmed position in the programmed base"),
        **axes("{}_deg", "deg", "programmed orientation in the programmed base", "abc"),
        **axes("f{}_n", "N", "force on the tool in the programmed base"),
        **axes("m{}_nm", "N m", "moment on the tool in the programmed base"),
        **axes("deflection_{}_mm", "mm", "predicted deflection before the correction"),
        "error_before_mm": quantity("mm", "predicted error before the correction", nullable=True),
        **axes("correction_{}_mm", "mm", "correction of the position"),
        "correction_mm": quantity("mm", "length of the correction", nullable=True),
        **axes("correction_r{}_deg", "deg", "correction of the orientation, rotation vector"),
        "error_after_mm": quantity("mm", "predicted error after the correction", nullable=True),
        "transition_moves": integer("transition moves inserted before it"),
        "intermediate_points": integer("intermediate points inserted before it"),
        "path_error_mm": quantity("mm", "largest predicted path error between points", nullable=True),
        "iterations": integer("iterations of its correction"),
    }
    inserted = ("transition_moves", "intermediate_points", "path_error_mm")
    row = record(columns, "one motion of the input; a prediction has no inserted motions", optional=inserted)
    history = quantity("mm", "predicted error after so many iterations", nullable=True)
    row["patternProperties"] = {"^error_[0-9]+_mm$": history}
    return {"title": "corrections.csv, deflection.csv", "type": "array", "items": row}
