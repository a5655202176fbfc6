"""Parts of the schemas of results that are about measurements."""

from __future__ import annotations

from postproc.robot.provenance import GAP
from postproc.schemas.parts import Schema
from postproc.schemas.result_parts import (
    boolean,
    integer,
    quantity,
    record,
    word,
)

RMS = {
    "before": "of the old parameters",
    "after": "of the new parameters",
    "held_out_before": "of the old parameters, on poses held out of the fit",
    "held_out_after": "of the new parameters, on poses held out of the fit",
}

PARAMETER: dict[str, Schema] = {
    "value": quantity("as in unit", "value"),
    "ci95": quantity("as in unit", "half width of the 95 % interval", nullable=True),
    "unit": word("SI unit"),
    "at_bound": boolean("present where the value is at a bound of its range"),
}

MEASURED: dict[str, Schema] = {
    "measured": word("what was measured", ("deflection", "position")),
    "readings": integer("readings"),
    "poses": integer("poses"),
    "targets": integer("targets"),
    "sessions": integer("sessions"),
}


def gap_schema(**more: Schema) -> Schema:
    known = {
        key: quantity(
            "mm",
            "scatter of the readings, 3-D RMS"
            if key == "noise_mm"
            else f"residual {RMS[key.removesuffix('_rms_mm')]}, 3-D RMS",
            nullable=True,
        )
        for key in GAP
    }
    return record({**known, **more}, "residuals before and after")
