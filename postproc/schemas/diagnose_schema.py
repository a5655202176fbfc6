"""The schema of the result of ``diagnose``."""

from __future__ import annotations

from postproc.effects import EFFECTS
from postproc.schemas.measured_parts import MEASURED, PARAMETER, gap_schema
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import (
    DATA,
    ENDING,
    OPTIONS,
    ROBOT,
    array,
    boolean,
    by_name,
    integer,
    quantity,
    record,
    result,
    word,
)

VERDICTS = ("nothing_missing", "named", "partly_named", "ambiguous", "unknown")

_OPTIONS = by_name({"description": "value of the option"}, OPTIONS)

_CANDIDATE: dict[str, Schema] = {
    "effect": word("name of the effect"),
    "joint": word("joint of the effect; null for all or none", nullable=True),
    "options": _OPTIONS,
    "label": word("the candidate in words"),
}


def _patterns(about: str) -> Schema:
    return array(
        record(
            {
                "variable": word("variable that the residual depends on"),
                "pattern": word("kind of the dependence"),
                "share": quantity("1", "share of the squared residuals"),
            },
            "one pattern",
        ),
        about,
    )


def diagnose_schema() -> Schema:
    gains = {
        "likelihood_gain": "likelihood gain of the effect",
        "expected_by_chance": "probability of such a gain without the effect, among all candidates",
        "held_out_poses": "likelihood gain on poses held out of the fit",
        "held_out_regions": "likelihood gain on regions held out of the fit",
        "held_out_sessions": "likelihood gain on sessions held out of the fit",
        "margin_to_next": "likelihood gain above that of the next best explanation",
    }
    evidence = record(
        {
            **{
                key: quantity("1", f"{about}, 2 ln(likelihood ratio)", nullable=True)
                for key, about in gains.items()
            },
            "expected_by_chance": quantity("1", gains["expected_by_chance"], nullable=True),
            "next": record(_CANDIDATE, "next best explanation", nullable=True),
        },
        "evidence",
    )
    parameter = record(PARAMETER, "one parameter", optional=("at_bound",))
    named = record(
        {
            "effect": word("name of the effect", tuple(EFFECTS)),
            "joints": array(word("joint"), "joints of the effect"),
            "options": _OPTIONS,
            "parameters": by_name(parameter, "identified parameters by name"),
            "fixed": by_name(quantity("SI", "value"), "parameters that the readings do not determine"),
            "displacement_rms_mm": quantity("mm", "displacement of the readings, RMS", nullable=True),
            "displacement_max_mm": quantity("mm", "displacement of the readings, maximum", nullable=True),
            "evidence": evidence,
        },
        "one effect",
    )
    refitted = record(
        {
            "parameter": word("effect.parameter"),
            "before": quantity("as in unit", "value of the robot file"),
            **PARAMETER,
        },
        "one parameter",
        optional=("at_bound",),
    )
    names = array(word("name of the effect"), "effects")
    return result(
        "diagnose",
        "the effect that a robot file misses",
        {
            **ROBOT,
            "robot_path": word("path of the robot file read"),
            "data": DATA,
            **MEASURED,
            "verdict": word("the verdict", VERDICTS),
            "conditional": boolean("whether the scatter is not stated and the residuals replace it"),
            "named": array(named, "missing effects"),
            "ambiguous": array(names, "sets of effects that the readings can not distinguish"),
            "largest_disagreement_mm": quantity(
                "mm",
                "largest difference over the workspace of what the explanations of a set predict",
                nullable=True,
            ),
            "same_correction": boolean("whether all explanations of each set give the same correction"),
            "alternatives": array(
                array(record(_CANDIDATE, "one candidate"), "one set"), "the same as candidates"
            ),
            "rejected": array(
                record({**_CANDIDATE, "why": word("reason")}, "one candidate"),
                "candidates that explain a part and are not named",
            ),
            "tried": {**names, "description": "effects that were tested"},
            "not_testable": {**names, "description": "effects that this kind of data can not show"},
            "hardly_testable": {**names, "description": "effects that would show at unusual size only"},
            "detectable_rms_mm": quantity(
                "mm", "displacement from which on most effects are detected", nullable=True
            ),
            "detection_limits": array(
                record(
                    {
                        **_CANDIDATE,
                        "displacement_rms_mm": quantity(
                            "mm", "displacement of the parameter that shows least, RMS", nullable=True
                        ),
                        "parameters": by_name(
                            record(
                                {
                                    "smallest": quantity(
                                        "as in unit", "size found with 95 % probability", nullable=True
                                    ),
                                    "unit": word("SI unit"),
                                },
                                "one parameter, the others at their null",
                            ),
                            "each parameter; null where no size shows",
                        ),
                    },
                    "one candidate",
                ),
                "where nothing is missing: sizes below which candidates can be there without being seen",
            ),
            "refitted": array(refitted, "parameters of the robot file that have changed"),
            "residual_patterns": _patterns("patterns in the residuals of the robot file"),
            "residual_patterns_refitted": _patterns("the same, its own parameters refitted"),
            "residual_patterns_final": _patterns("the same, of the final model"),
            "gap": gap_schema(
                refitted_rms_mm=quantity("mm", "residual with the old parameters refitted, 3-D RMS")
            ),
            "reduced_chi2": quantity(
                "1",
                "variance of the final residuals over that of the scatter; null if not known",
                nullable=True,
            ),
            "next_poses": array(
                by_name(
                    quantity("as in name", "deg, mm, kg or N; DIR columns: -1, 0, +1"),
                    "one pose: axes, load, pull if there is one, direction of approach",
                ),
                "poses to measure next",
                nullable=True,
            ),
            "next_poses_file": word("path of the plan with these poses", nullable=True),
            "next_poses_between": array(
                record(_CANDIDATE, "one candidate"), "the two candidates that they distinguish", nullable=True
            ),
            "next_poses_separation": array(
                quantity("1", "standard deviations", nullable=True),
                "expected separation, both ways",
                nullable=True,
            ),
            "next_poses_beyond": array(
                word("name of the joint"), "axes that leave the ranges measured so far", nullable=True
            ),
            "stations": array(
                record(
                    {
                        "session": word("name of the session"),
                        **{axis: quantity("mm", "robot base in the tracker's frame") for axis in "xyz"},
                        **{f"{axis}_ci95": quantity("mm", "95 % interval") for axis in "xyz"},
                        **{axis: quantity("deg", "angle of the robot base there") for axis in "abc"},
                        **{f"r{axis}_ci95": quantity("deg", "95 % interval of a turn") for axis in "xyz"},
                    },
                    "one station",
                ),
                "where the tracker was found",
            ),
            "target_places": array(
                record(
                    {
                        "target": word("name of the target"),
                        **{
                            axis: quantity("mm", "place on the flange, or in the robot base")
                            for axis in "xyz"
                        },
                        **{f"{axis}_ci95": quantity("mm", "95 % interval") for axis in "xyz"},
                        "on_base": boolean("whether it is fixed to the robot base instead of the flange"),
                    },
                    "one target",
                ),
                "where targets were found whose place is not stated",
            ),
            "tracker_scale": quantity(
                "1", "lengths that the tracker reads over those of the robot, less 1", nullable=True
            ),
            "tracker_scale_ci95": quantity("1", "its 95 % interval", nullable=True),
            "validation": array(
                record(
                    {
                        "file": word("path"),
                        "readings": integer("readings of the file"),
                        **{
                            f"{name}_{size}_mm": quantity("mm", f"residual, {words}, {size}")
                            for name, words in (("before", "robot file"), ("after", "final model"))
                            for size in ("rms", "mean", "max")
                        },
                        "registration_refitted": boolean("whether its tracker was registered again"),
                    },
                    "one file",
                ),
                "readings that were not diagnosed, file by file",
            ),
            "robot_file": word("path of the new robot file", nullable=True),
            **ENDING,
        },
    )
