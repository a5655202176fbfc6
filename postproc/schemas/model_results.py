"""The schemas of the results about models and measurements: identify, diagnose, plan, map, robots."""

from __future__ import annotations

from postproc.effects import EFFECTS
from postproc.robot.provenance import COMMANDS, GAP
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
_RMS = {
    "before": "of the old parameters",
    "after": "of the new parameters",
    "held_out_before": "of the old parameters, on poses held out of the fit",
    "held_out_after": "of the new parameters, on poses held out of the fit",
}

_PARAMETER: dict[str, Schema] = {
    "value": quantity("as in unit", "value"),
    "ci95": quantity("as in unit", "half width of the 95 % interval", nullable=True),
    "unit": word("SI unit"),
    "at_bound": boolean("present where the value is at a bound of its range"),
}

_MEASURED: dict[str, Schema] = {
    "measured": word("what was measured", ("deflection", "position")),
    "readings": integer("readings"),
    "poses": integer("poses"),
    "targets": integer("targets"),
    "sessions": integer("sessions"),
}


def _gap(**more: Schema) -> Schema:
    known = {
        key: quantity(
            "mm",
            "scatter of the readings, 3-D RMS"
            if key == "noise_mm"
            else f"residual {_RMS[key.removesuffix('_rms_mm')]}, 3-D RMS",
            nullable=True,
        )
        for key in GAP
    }
    return record({**known, **more}, "residuals before and after")


def _residuals(quantities: tuple[str, ...]) -> dict[str, Schema]:
    words = {"rms": "RMS", "mean": "mean", "max": "maximum"}
    return {
        f"{name}_{key}_mm": quantity("mm", f"residual {about}, {words[key]}", nullable=True)
        for name, about in _RMS.items()
        for key in quantities
    }


def identify_schema() -> Schema:
    validation = {
        f"{name}_{key}_mm": quantity("mm", f"residual {_RMS[name]}, {key}", nullable=True)
        for name in ("before", "after")
        for key in ("rms", "mean", "max")
    }
    held_out = [key for key in _residuals(("rms", "mean", "max")) if key.startswith("held_out")]
    part = record(
        {
            "from": quantity("as in unit", "smallest value"),
            "to": quantity("as in unit", "largest value"),
            "readings": integer("readings"),
            **_residuals(("rms",)),
        },
        "one range of values",
        optional=held_out,
    )
    by_variable = {
        "unit": word('unit of the variable, "" for none'),
        "parts": array(part, "ranges of values"),
    }
    gap = _gap(**_residuals(("mean", "max")))
    gap["required"] = [key for key in gap["required"] if key not in held_out or key in GAP]
    return result(
        "identify",
        "parameters of effects, fitted to measurements",
        {
            **ROBOT,
            "robot_file": word("path of the robot file read"),
            "data": DATA,
            "asked": array(word("effect or effect.parameter"), "effects asked for"),
            **_MEASURED,
            "fitted_readings": integer("readings that are fitted"),
            "effects": by_name(
                by_name(
                    record(
                        {
                            **_PARAMETER,
                            "before": quantity("as in unit", "value of the robot file", nullable=True),
                            "bootstrap_ci95": quantity(
                                "as in unit", "half width of the 95 % interval by bootstrap"
                            ),
                            "prior": boolean("present where its interval in the robot file is used"),
                        },
                        "one parameter",
                        optional=("at_bound", "bootstrap_ci95", "prior"),
                    ),
                    "parameters by name",
                ),
                "identified parameters, by effect",
            ),
            "sums": array(
                record(
                    {
                        "of": array(
                            array({"description": "effect.parameter, and its weight"}, "one term"),
                            "parameters and their weights",
                        ),
                        "value": quantity("as in unit", "value of the sum"),
                        "ci95": quantity("as in unit", "half width of the 95 % interval"),
                        "unit": word("SI unit"),
                    },
                    "one sum",
                ),
                "sums of parameters that are known where the single parameters are not",
            ),
            "gap": gap,
            "folds": integer("folds of the cross-validation; 0: none"),
            "validation": record(
                {
                    "data": array(word("name"), "files"),
                    "readings": integer("readings"),
                    "registration_refitted": boolean(
                        "whether the positions of tracker and targets are fitted to them"
                    ),
                    **validation,
                },
                "residuals of other measurements, which are not fitted",
                nullable=True,
            ),
            "condition": quantity("1", "condition number of the scaled sensitivities"),
            "rank": integer("parameters that are identified"),
            "dropped": array(
                record(
                    {
                        "name": word("effect.parameter"),
                        "why": word("reason"),
                        "value": quantity("as in unit", "value that it keeps"),
                        "unit": word("SI unit"),
                    },
                    "one parameter",
                ),
                "parameters that the readings do not determine",
            ),
            "fixed": array(word("effect.parameter"), "dimensions of hardware that are not fitted"),
            "at_bound": array(word("effect.parameter"), "parameters at a bound of their range"),
            "correlations": array(
                array({"description": "two parameters, and their correlation"}, "one pair"),
                "pairs of parameters with strong correlation, strongest first",
            ),
            "bootstrap": record({"draws": integer("draws")}, "bootstrap of the intervals", nullable=True),
            "noise": record(
                {
                    "sigma_mm": quantity("mm", "scatter per coordinate, one sigma"),
                    "source": word("where the scatter comes from"),
                    "exceeded": boolean("whether the residuals clearly exceed it"),
                    "shared_mm": quantity("mm", "error common to the readings of one pose, one sigma"),
                },
                "scatter of the readings",
            ),
            "residuals": record(
                {
                    "direction": by_name(
                        record(
                            _residuals(("rms", "mean")),
                            "one coordinate",
                            optional=[
                                key for key in _residuals(("rms", "mean")) if key.startswith("held_out")
                            ],
                        ),
                        "by coordinate, robot base axes",
                    ),
                    "joint": by_name(record(by_variable, "one joint"), "by position of each joint"),
                    "load": record({"what": word("the load"), **by_variable}, "by load", nullable=True),
                    "order": record(by_variable, "in the order of time"),
                },
                "residuals by direction, joint, load and time",
            ),
            "outliers": array(
                record(
                    {
                        "file": word("file"),
                        "line": integer("line"),
                        "distance_mm": quantity("mm", "distance from the prediction"),
                        "sigmas": quantity("1", "the same in standard deviations"),
                        "what": word("kind of the outlier"),
                    },
                    "one reading",
                ),
                "outliers",
            ),
            "outliers_excluded": boolean("whether they are excluded from the fit"),
            **ENDING,
        },
    )


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
    parameter = record(_PARAMETER, "one parameter", optional=("at_bound",))
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
            **_PARAMETER,
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
            **_MEASURED,
            "verdict": word("the verdict", VERDICTS),
            "conditional": boolean("whether the scatter is not stated and the residuals replace it"),
            "named": array(named, "missing effects"),
            "ambiguous": array(names, "sets of effects that the readings can not distinguish"),
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
            "refitted": array(refitted, "parameters of the robot file that have changed"),
            "residual_patterns": _patterns("patterns in the residuals of the robot file"),
            "residual_patterns_refitted": _patterns("the same, its own parameters refitted"),
            "residual_patterns_final": _patterns("the same, of the final model"),
            "gap": _gap(refitted_rms_mm=quantity("mm", "residual with the old parameters refitted, 3-D RMS")),
            "reduced_chi2": quantity(
                "1",
                "variance of the final residuals over that of the scatter; null if not known",
                nullable=True,
            ),
            "next_poses": array(
                by_name(
                    quantity("as in name", "deg, mm or kg; DIR columns: -1, 0, +1"),
                    "one pose: axes, load, direction of approach",
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
            "robot_file": word("path of the new robot file", nullable=True),
            **ENDING,
        },
    )


def plan_schema() -> Schema:
    width = record(
        {
            "ci95": quantity("as in unit", "half width of the 95 % interval", nullable=True),
            "unit": word("SI unit"),
        },
        "one parameter",
    )
    intervals = by_name(by_name(width, "parameters by name"), "by effect")
    lost = array(
        record({"name": word("effect.parameter"), "why": word("reason")}, "one parameter"), "parameters"
    )
    ratio = quantity("1", "worst ratio of an interval to the wanted one", nullable=True)
    of_random = {
        "type": "object",
        "description": "intervals by effect, and the worst ratio",
        "properties": {"worst_ratio": ratio},
        "required": ["worst_ratio"],
        "additionalProperties": by_name(width, "parameters by name"),
    }
    return result(
        "plan",
        "poses and loads to measure",
        {
            **ROBOT,
            "effects": array(word("effect or effect.parameter"), "effects to identify"),
            "kind": word("what is measured", ("deflection", "absolute")),
            "sigma_mm": quantity("mm", "scatter per coordinate, one sigma"),
            "loads_kg": array(quantity("kg", "mass"), "loads"),
            "each_load": boolean("whether every load is measured at every pose"),
            "criterion": word("criterion of the plan"),
            "seed": integer("seed of the random poses"),
            "candidates": integer("candidate poses"),
            "poses": integer("poses of the plan"),
            "readings": integer("readings of the plan"),
            "wanted": {**intervals, "description": "wanted intervals, by effect"},
            "before": {
                **intervals,
                "type": ["object", "null"],
                "description": "intervals of the existing readings, by effect",
            },
            "intervals": by_name(intervals, "predicted intervals, by number of poses"),
            "worst_ratio": by_name(ratio, "worst ratio, by number of poses"),
            "test_rms_mm": by_name(
                quantity("mm", "predicted error at the cuts of the test program, RMS", nullable=True),
                "by number of poses",
            ),
            "random_poses": by_name(of_random, "predicted intervals of random poses, by their number"),
            "unobservable": {**lost, "description": "parameters that no pose shows"},
            "excluded": {**lost, "description": "parameters that the plan does not show"},
            "weakly_observable": {**lost, "description": "parameters with an interval wider than wanted"},
            "discriminate": array(word("effect"), "two effects to distinguish", nullable=True),
            "separation": by_name(
                array(quantity("1", "standard deviations", nullable=True), "both ways"),
                "expected separation, by number of poses",
            ),
            "fixed": array(word("effect.parameter"), "dimensions of hardware that are not fitted"),
            **ENDING,
        },
    )


def map_schema() -> Schema:
    ends = array(quantity("mm", "coordinate"), "first and last")
    place = by_name(quantity("mm", "coordinate in the robot base"), "x_mm, y_mm, z_mm")
    extremes = {"min": quantity("mm", "minimum"), "max": quantity("mm", "maximum")}
    return result(
        "map",
        "deflection over the workspace",
        {
            **ROBOT,
            "force": record(
                {
                    "values": array(quantity("N, N m", "component"), "fx, fy, fz, mx, my, mz"),
                    "frame": word("frame of the force"),
                },
                "the force on the tool",
            ),
            "grid": record(
                {
                    **{f"{axis}_mm": ends for axis in "xyz"},
                    "points": array(integer("points"), "points along x, y, z"),
                    "orientation_deg": array(
                        quantity("deg", "angle"), "A, B, C of the tool in the robot base"
                    ),
                    "tool": array(
                        quantity("mm, deg", "coordinate"), "x, y, z, a, b, c of the TCP on the flange"
                    ),
                    "status": integer("KUKA Status (S); null for other arms", nullable=True),
                },
                "the cells, robot base",
            ),
            "method": word("how the deflection is computed", ("linear", "equilibrium")),
            "sign": word("reading of eq. (3) of the gravity compensator; null without one", nullable=True),
            "ignore_limits": boolean("whether cells beyond the axis limits count as reached"),
            "cells": integer("cells"),
            "unreachable": integer("cells without a value"),
            "out_of_reach": integer("cells out of reach"),
            "beyond_limits": integer("cells within reach, beyond the axis limits"),
            "deflection_mm": record(extremes, "deflection", nullable=True),
            "deflection_without_compensator_mm": record(
                extremes, "deflection without the gravity compensator", nullable=True
            ),
            "compensator_difference_mm": record(extremes, "difference of the two", nullable=True),
            "extremes_at": by_name(
                record({"min": place, "max": place}, "one quantity"), "where the extremes are, by quantity"
            ),
            **ENDING,
        },
    )


def robots_schema() -> Schema:
    limits = by_name(array(quantity("as in name", "limit"), "lower, upper"), "limits of the axes, by name")
    run = record(
        {
            "command": word("command", COMMANDS),
            "version": word("version of compensate"),
            "date": word("date, UTC, as 2026-01-31"),
            "data": DATA,
            "robot_digest": word("SHA-256 of the robot file read, hexadecimal"),
            "effects": array(word("effect or effect.parameter"), "effects fitted"),
            "poses": integer("poses"),
            "readings": integer("readings"),
            "gap": record(
                {key: quantity("mm", "3-D RMS") for key in GAP}, "residuals before and after", optional=GAP
            ),
            "correlation": record(
                {
                    "parameters": array(word("effect.parameter"), "parameters"),
                    "rows": array(array(quantity("1", "correlation"), "one row"), "matrix"),
                },
                "correlation of the parameters fitted",
            ),
        },
        "one run of identify or diagnose",
    )
    mechanism = record(
        {
            "name": word("name"),
            "kind": word("kind"),
            "joint": word('joint, "" for none', nullable=True),
            "source": word("where it is documented"),
            "quantities": by_name(
                record(
                    {
                        "values": {"description": "number or list of numbers, as in unit"},
                        "unit": word("SI unit"),
                    },
                    "one dimension",
                ),
                "dimensions by name",
            ),
        },
        "one mechanism",
    )
    parameter = record(
        {
            "value": quantity("as in unit", "value"),
            "interval": quantity("as in unit", "half width of the interval", nullable=True),
            "level": quantity("1", "level of the interval; null where it is unstated", nullable=True),
            "source": word("where the value comes from"),
            "unit": word("SI unit"),
        },
        "one parameter",
    )
    robot = record(
        {
            "name": word("name"),
            "maker_name": word("name by its maker"),
            "file": word("path of the robot file"),
            "digest": word("SHA-256 of the robot file, hexadecimal"),
            "geometry": {
                "type": "object",
                "description": "kind, axes, link lengths (kuka_m: m), source",
                "additionalProperties": {"description": "as in the robot file"},
            },
            "limits_deg": limits,
            "limits_mm": limits,
            "external": word("external axis; null for none", nullable=True),
            "mechanisms": array(mechanism, "known hardware"),
            "identified": array(run, "runs that gave the file new values"),
            "effects": by_name(
                {
                    "type": "object",
                    "description": f"one effect: its parameters, and {OPTIONS}",
                    "required": ["parameters"],
                    "properties": {"parameters": by_name(parameter, "parameters by name")},
                    "additionalProperties": {"description": "an option of the effect"},
                },
                "effects by name",
            ),
        },
        "one robot",
    )
    return result(
        "robots",
        "the robots, or one of them",
        {"robots": array(robot, "robots"), "exit": integer("exit code of the command")},
    )
