"""The process that diagnoses: is told folders, one a line, and answers each with what it found, as JSON.

It may open nothing of a run but the folder that it was told, which holds ``data.csv`` and ``robot.yaml``.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from postproc.diagnosis.diagnose import diagnose
from postproc.findings import Refusal
from postproc.identification.campaign import Campaign
from postproc.measurements import read_measurements
from postproc.model import StiffnessModel
from postproc.robot.description import load_robot

ROOMS = "blind-"
"""How the folders of all runs begin, by ``tempfile``."""

_allowed = ""


def guard(event: str, arguments: tuple) -> None:
    """Refuses to open or list anything of a run but what was told."""
    if (
        event in ("open", "os.listdir", "os.scandir")
        and arguments
        and isinstance(arguments[0], str | bytes | os.PathLike)
    ):
        path = os.path.abspath(os.fsdecode(arguments[0]))
        if f"{os.sep}{ROOMS}" in path and not path.startswith(_allowed + os.sep):
            raise PermissionError(f"{path} is none of the diagnosis's business")


def diagnosed(folder: Path) -> dict:
    """What the diagnosis says of ``data.csv`` and ``robot.yaml``."""
    begun = time.perf_counter()
    robot = load_robot(folder / "robot.yaml")
    readings = read_measurements(folder / "data.csv", [(joint.name, False) for joint in robot.joints])
    try:
        found = diagnose(Campaign(readings), StiffnessModel.from_robot(robot))
    except Refusal as refusal:
        return {"verdict": "refused", "why": str(refusal), "seconds": time.perf_counter() - begun}
    verdict, final = found.verdict, found.final
    return {
        "verdict": verdict.word,
        "named": [
            {
                "effect": one.effect,
                "joints": list(one.joints),
                "margin": one.evidence.margin,
                "alias": None if one.evidence.alias is None else one.evidence.alias.label,
                "heldout": one.evidence.heldout,
                "regions": one.evidence.regions,
            }
            for one in verdict.named
        ],
        "ambiguous": [[[c.name, c.joint] for c in alternatives] for alternatives in verdict.alternatives],
        "rejected": [[c.label, why] for c, why in verdict.rejected],
        "chosen": [c.label for c in found.search.chosen],
        "not_testable": list(verdict.not_testable),
        "lack": verdict.lack,
        "estimates": {e.unknown.name: [e.value, e.ci95] for e in final.estimates},
        "before": terms_of(found.search.base.model),
        "after": terms_of(final.model),
        "seconds": time.perf_counter() - begun,
    }


def terms_of(model: StiffnessModel) -> list:
    """Effects, their options and values (SI)."""
    return [[term.effect.name, term.effect.described(), dict(term.values)] for term in model.terms]


def main() -> None:
    global _allowed
    sys.addaudithook(guard)
    for line in sys.stdin:
        _allowed = os.path.abspath(line.strip())
        print(json.dumps(diagnosed(Path(_allowed))), flush=True)


if __name__ == "__main__":
    main()
