"""The process that learns: it is told a folder and the files in it, and nothing of the truth."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np


def forces_of(result: Any) -> dict[str, list[float]]:
    """Operation -> logarithm of the factor of its force, and its standard deviation."""
    names = [cause.name for cause in result.causes]
    found = {}
    for i, cause in enumerate(result.causes):
        if cause.name.startswith("force of "):
            pick = np.isin(np.arange(len(names)), [names.index("force"), i]).astype(float)
            found[cause.place] = [float(pick @ result.x), float(np.sqrt(pick @ result.covariance @ pick))]
    return found


def main() -> None:
    """Each line of standard input is a task {folder, measured, options}; each answer a line of JSON."""
    import postproc
    from postproc.learning.covariance import Explanation, SmoothField

    for line in sys.stdin:
        task = json.loads(line)
        folder = Path(task["folder"])
        try:
            learned = postproc.learn(
                folder / "part.src",
                [folder / name for name in task["measured"]],
                output=folder / task["output"],
                **task.get("options", {}),
            )
        except postproc.Refusal as refusal:
            answer = {"refused": sorted({finding.code for finding in refusal.findings})}
            print(json.dumps(answer), flush=True)
            continue
        result = learned.attribution
        whole = result.explained
        named = len(result.causes) - sum(len(one.causes) for one in result.candidates)
        alone = Explanation(whole.layout, SmoothField(), whole.rest, whole.columns[:, :named], whole.by_force)
        mean = alone.causes()[0] * result.prediction.deviations[:named]
        answer = {
            "refused": [],
            "verdict": result.verdict,
            "named": [one.name for one in result.named],
            "alternatives": list(result.alternatives),
            "sizes": {
                cause.place or cause.name: [float(x), float(s)]
                for cause, x, s in learned.causes()
                if cause.group == "effect"
            },
            "forces": forces_of(result),
            "promise": [
                learned.promise.before,
                learned.promise.after,
                learned.promise.lower,
                learned.promise.upper,
            ],
            "written": learned.next_program is not None,
            "causes": {
                cause.name: [float(x), float(s)]
                for cause, x, s in zip(result.causes, result.x, result.deviations, strict=True)
            },
            "alone": dict(
                zip([c.name for c in result.causes[:named]], np.asarray(mean).tolist(), strict=True)
            ),
            "outliers": int((~result.kept).sum()),
            "exit": learned.exit,
            "codes": sorted({finding.code for finding in learned.findings}),
        }
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
