"""The schema of the result of ``identify``."""

from __future__ import annotations

from postproc.robot.provenance import GAP
from postproc.schemas.measured_parts import MEASURED, PARAMETER, RMS, gap_schema
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import (
    DATA,
    ENDING,
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


def _residuals(quantities: tuple[str, ...]) -> dict[str, Schema]:
    words = {"rms": "RMS", "mean": "mean", "max": "maximum"}
    return {
        f"{name}_{key}_mm": quantity("mm", f"residual {about}, {words[key]}", nullable=True)
        for name, about in RMS.items()
        for key in quantities
    }


def identify_schema() -> Schema:
    validation = {
        f"{name}_{key}_mm": quantity("mm", f"residual {RMS[name]}, {key}", nullable=True)
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
    gap = gap_schema(**_residuals(("mean", "max")))
    gap["required"] = [key for key in gap["required"] if key not in held_out or key in GAP]
    return result(
        "identify",
        "parameters of effects, fitted to measurements",
        {
            **ROBOT,
            "robot_file": word("path of the robot file read"),
            "data": DATA,
            "asked": array(word("effect or effect.parameter"), "effects asked for"),
            **MEASURED,
            "fitted_readings": integer("readings that are fitted"),
            "effects": by_name(
                by_name(
                    record(
                        {
                            **PARAMETER,
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
                    "files": array(
                        record(
                            {"file": word("path"), "readings": integer("readings"), **validation}, "one file"
                        ),
                        "the same of each file",
                    ),
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
