"""The schema of a job file of ``compensate batch``."""

from __future__ import annotations

from postproc.batching.job_file import FORMER_KEYS, JOB_KEYS, PROGRAM_KEYS
from postproc.schemas.parts import (
    Schema,
    describe,
    flag,
    former_name_of,
    known,
    listed,
    mapping,
    number,
    text,
)
from postproc.workflows.option_names import FORMER_VALUES, SHARED_POINTS

_PATTERN = text(
    "a program, a folder, or a pattern (* ? [ ] **), relative to this file; quote a pattern that starts with *"
)

PROGRAM: dict[str, Schema] = {
    "cell": text("cell file, instead of the nearest cell.yaml of each program"),
    "robot": text("name of a robot, or a robot file (.yaml), instead of the cell's"),
    "force": {
        "description": "true: the forces that belong to each program; false: none; else fx,fy,fz[,mx,my,mz][@frame]"
        " or a CSV",
        "anyOf": [flag(), text()],
    },
    "gain": number("share of the correction that is applied", 0.0, 1.0),
    "config_dat": text("the controller's $config.dat, for points and frames defined there [the cell's]"),
    "tare": flag("subtract the mean force in air from all readings of the force CSV"),
    "no_insert": flag("insert no motions"),
    "shared_points": text(
        f"what happens to a named point that several motions use [{SHARED_POINTS[0]}]",
        [*SHARED_POINTS, *FORMER_VALUES["shared_points"]],
    ),
    "strict": flag("treat warnings as errors"),
    "allow_compensated": flag("accept programs that are compensated already"),
}

FORMER = {former: former_name_of(key, PROGRAM[key]) for former, key in FORMER_KEYS.items()}

BATCH: dict[str, Schema] = {
    "programs": describe({"anyOf": [_PATTERN, listed(_PATTERN, least=1)]}, "the programs of the batch"),
    "exclude": describe({"anyOf": [_PATTERN, listed(_PATTERN, least=1)]}, "programs that are excluded"),
    "output": text("folder of the results, relative to this file [compensated]"),
    "overrides": describe(
        {
            "type": "object",
            "additionalProperties": mapping(
                {
                    **known(PROGRAM_KEYS, PROGRAM),
                    **FORMER,
                    "output": text("file or folder, below the folder of the results"),
                }
            ),
        },
        "options of single programs, by pattern; where several patterns match, the later one wins",
    ),
    **PROGRAM,
    **FORMER,
}


def job_schema() -> Schema:
    return mapping(
        known((*JOB_KEYS, *FORMER), BATCH),
        ["programs"],
        "many programs to compensate",
        title="job file of compensate batch",
    )
