"""The codes of the findings of a batch."""

from __future__ import annotations

from postproc.base.findings import Code, define

CODES = define(
    {
        "BAT001": Code(
            "error",
            "no program matched",
            meaning="A batch names programs by files, folders and patterns; this one matches none.",
            consequence="Nothing would be done.",
            action="Check the pattern and the folder.",
            example='`compensate batch "*.src"` in another folder.',
        ),
        "BAT002": Code(
            "error",
            "two programs with one output",
            meaning="Two programs of the batch have the same output or report.",
            consequence="One would overwrite the other. Nothing is started.",
            action="Give one of them another `output:` under `overrides:`, or exclude it with `exclude:`.",
            example="a/panel.src and b/panel.src with one output folder.",
        ),
        "BAT003": Code(
            "error",
            "path outside the folder",
            meaning="Programs and outputs of a job file must be in its folder or below.",
            consequence="A job file from elsewhere could write to any place.",
            action="Move the files, or use --allow-outside.",
            example="`output: ../elsewhere`.",
        ),
        "BAT004": Code(
            "error",
            "internal defect",
            meaning="A program causes an internal error of this tool; the other programs continue.",
            consequence="This program has no output.",
            action="Please report the message together with the program.",
            example="An exception in the middle of a correction.",
        ),
        "BAT005": Code(
            "error",
            "process died",
            meaning="The process that computes the program ends before it is done.",
            consequence="This program has no output; the usual cause is missing memory.",
            action="Use fewer --workers.",
            example="Killed by signal 9.",
        ),
        "BAT006": Code(
            "error",
            "cluster cannot be used",
            meaning="The scheduler or a worker is missing, or has another version than this machine.",
            consequence="The batch would not start, or would give other results there.",
            action=(
                "Start scheduler and workers, with the same folders and the same version as this machine."
            ),
            example="`--cluster tcp://host:8786` without a scheduler.",
        ),
        "BAT007": Code(
            "warning",
            "older output remains",
            meaning="The program fails, and its output of an earlier run remains.",
            consequence="That output belongs to another input.",
            action="Do not run it; remove the cause of the failure and repeat the batch.",
            example="panel.src of yesterday in compensated/.",
        ),
        "BAT008": Code(
            "error",
            "system refuses",
            meaning="The system does not give what the program needs: memory, open files, a folder.",
            consequence="This program has no output; the other programs continue.",
            action="Use fewer --workers, or remove the cause that the message names.",
            example="A limit of the memory that is too small for the program.",
        ),
    }
)
