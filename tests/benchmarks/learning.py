"""What learning from a measured part costs: 500 points of a program of 100,000 motions.

    python -m tests.benchmarks.learning [--motions 100000] [--points 500]

A plate is cut in levels by straight rows in motions of 1 mm; the points lie on its last floor.  Their deviations are
those of the model under a force that is a fifth larger, with the scatter of a probe.  Printed are the seconds of the
processor until the causes are known, those of the whole command with its next program, and the memory of the process.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command does, before numpy is there

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from blind_parts.shop import CELL, HOME

LONG, ROW, LEVEL = 400, 15.0, 0.5
NOISE = 0.01


def write_program(folder: Path, motions: int) -> float:
    """Cell and program of about so many cutting motions in ``folder``; the depth [mm] of its last floor."""
    cell = CELL.replace("BASE_X", f"{HOME[0]:g}").replace("BASE_Y", f"{HOME[1]:g}")
    (folder / "cell.yaml").write_text(cell)
    rows = 20
    levels = max(1, round(motions / (LONG * rows)))
    lines = [
        "DEF part()",
        "$BASE=BASE_DATA[1]",
        "$TOOL=TOOL_DATA[1]",
        "PTP {A1 0,A2 -90,A3 100,A4 0,A5 80,A6 0}",
    ]
    turn = "A -45.000,B 0.000,C 180.000}"
    for level in range(1, levels + 1):
        depth = -LEVEL * level
        for row in range(rows):
            y = ROW * row
            lines += [";FORCE OFF", "$VEL.CP=0.2", f"LIN {{X 0.000,Y {y:.3f},Z 20.000,{turn}"]
            lines += [
                f"LIN {{X 0.000,Y {y:.3f},Z {depth:.3f},{turn}",
                "$VEL.CP=0.03",
                ";FORCE -30 62 -18 @feed",
            ]
            lines += [f"LIN {{X {x}.000,Y {y:.3f},Z {depth:.3f},{turn}" for x in range(1, LONG + 1)]
            lines += [";FORCE OFF", f"LIN {{X {LONG}.000,Y {y:.3f},Z 20.000,{turn}"]
    (folder / "part.src").write_text("\n".join([*lines, "END", ""]))
    return -LEVEL * levels


def write_part(folder: Path, depth: float, points: int) -> Path:
    """The file of the measured part."""
    from postproc.learning.causes import CausePrediction, PriorKnowledge
    from postproc.learning.measured_part import read_measured_part
    from postproc.workflows.learn_points import match, read_job
    from postproc.workflows.preparation import Request

    rng = np.random.default_rng(1)
    place = np.column_stack([rng.uniform(10, LONG - 10, points), rng.uniform(-5, 290, points)])
    path = folder / "part1.csv"

    def write(deviation: np.ndarray) -> None:
        digest = hashlib.sha256((folder / "part.src").read_bytes()).hexdigest()
        head = [
            "# positive: material_left",
            "# alignment: datum",
            "# cut_with: original",
            f"# sha256: {digest}",
        ]
        rows = [
            f"{x:.4f},{y:.4f},{depth:.4f},0,0,1,{d:.5f}" for (x, y), d in zip(place, deviation, strict=True)
        ]
        path.write_text("\n".join([*head, f"# sigma_mm: {NOISE}", "X,Y,Z,NX,NY,NZ,DEV", *rows, ""]))

    write(rng.normal(0, NOISE, points))
    request = Request(folder / "part.src", force="")
    job = read_job(request)
    found = match(request, job, [read_measured_part(path)], PriorKnowledge())
    prediction = CausePrediction(found.points, job.ready.model, found.causes)
    x = np.where([cause.name == "force" for cause in found.causes], np.log(1.2), 0.0)
    deviation = np.zeros(points)
    deviation[found.line - 7] = 1e3 * prediction.errors(x)
    write(deviation + rng.normal(0, NOISE, points))
    return path


def main() -> None:
    import postproc

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--motions", type=int, default=100_000)
    parser.add_argument("--points", type=int, default=500)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        measured = write_part(folder, write_program(folder, chosen.motions), chosen.points)
        start = time.process_time()
        learnt = 0.0

        def stage(word: str) -> None:
            nonlocal learnt
            if word.startswith("compensating"):
                learnt = time.process_time() - start

        from postproc.workflows.learn import LearnRequest, learn
        from postproc.workflows.preparation import Request

        main = Request(folder / "part.src", force="")
        done = learn(LearnRequest(main, (measured,), positive="material_left"), stage)
        whole = time.process_time() - start
        used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        motions = len((folder / "part.src").read_text().splitlines())
        assert isinstance(done, postproc.Learned)
        print(
            f"{done.attribution.kept.sum()} of {chosen.points} points, {motions} lines, seconds of the processor:"
            f" causes after {learnt:.1f}, next program after {whole:.1f}; {used:.2f} GB"
        )


if __name__ == "__main__":
    main()
