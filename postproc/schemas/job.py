"""The schema of a job file of ``compensate batch``."""

from __future__ import annotations

from postproc.batch.jobs import JOB_KEYS, OWN_POINTS, PROGRAM_KEYS
from postproc.schemas.parts import Schema, flag, known, listed, mapping, number, text, told

_PATTERN = text(
    "a program, a folder, or a pattern (* ? [ ] **), relative to this file; one that begins with * in quotes"
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
    "config_dat": text("the controller's $config.dat, for points and frames that stand there [the cell's]"),
    "force_offset": flag("take the mean of the force CSV in air off all its readings"),
    "keep_points": flag("insert no motion"),
    "own_points": text("what a named point that serves several motions becomes [inline]", OWN_POINTS),
    "strict": flag("warnings count as errors"),
    "again": flag("compensate programs that are compensated already"),
}

BATCH: dict[str, Schema] = {
    "programs": told({"anyOf": [_PATTERN, listed(_PATTERN, least=1)]}, "the programs of the batch"),
    "exclude": told({"anyOf": [_PATTERN, listed(_PATTERN, least=1)]}, "programs that are left out"),
    "output": text("folder of the results, relative to this file [compensated]"),
    "overrides": told(
        {
            "type": "object",
            "additionalProperties": mapping(
                {
                    **known(PROGRAM_KEYS, PROGRAM),
                    "output": text("file or folder, below the folder of the results"),
                }
            ),
        },
        "what is said of single programs: a pattern -> its own options; of several that match, the later wins",
    ),
    **PROGRAM,
}


def job_schema() -> Schema:
    return mapping(
        known(JOB_KEYS, BATCH),
        ["programs"],
        "many programs to compensate",
        title="job file of compensate batch",
    )
