"""Diagnoses the arm, compensates the panel of ../kr270_panel in a cell of its own with the old and the new robot file,
and cuts both on the arm itself, which is a plant in MuJoCo that has the compensator.

    python samples/kr270_missing_compensator/story.py          (in an environment with the [test] extra)
"""

import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "tests"))

from plant import Plant, kr270  # noqa: E402

from postproc.cli.main import run  # noqa: E402
from postproc.model import StiffnessModel  # noqa: E402
from postproc.verification.differences import end_rows  # noqa: E402
from postproc.verification.pairing import pair_motions  # noqa: E402
from postproc.verification.simulator import Simulator  # noqa: E402
from postproc.workflows.preparation import Request, prepare  # noqa: E402

PANEL = HERE.parent / "kr270_panel"
EVERY = 15  # of the cutting motions is cut on the plant


def command(*words: str | Path) -> None:
    try:
        run([str(word) for word in words])
    except SystemExit as end:
        if end.code not in (0, 3):
            raise


def cut(program: Path, plant: Plant) -> np.ndarray:
    """[mm] how far the tool is from the original path at the end of cutting motions, forces against none."""
    wanted = prepare(Request(PANEL / "panel.src", force="", cell=HERE / "cell.yaml")).task
    sent = prepare(Request(program, force="", cell=HERE / "cell.yaml")).task
    pairing = pair_motions(wanted, sent)  # motions may have been inserted
    simulator = Simulator.of(wanted, pairing)
    ends = end_rows(simulator, simulator.run(sent, pairing.start, pairing.stop).samples)
    rows = np.flatnonzero(wanted.carries)[::EVERY]
    away = []
    for row in rows:
        tool = wanted.tool[row]
        loaded = plant.rest(sent.track.q[ends[row]], wanted.wrench[row], tool)
        touched = plant.rest(wanted.track.q[row], np.zeros(6), tool)
        away.append(np.linalg.norm(loaded.position - touched.position) * 1e3)
    return np.array(away)


def main(folder: Path) -> dict[str, np.ndarray]:
    plant = Plant.of(StiffnessModel.from_robot(kr270()))
    old, new = HERE / "kr270_plain.yaml", folder / "found.yaml"
    command("diagnose", HERE / "loads.csv", "--robot", old, "-o", new)
    shutil.copy(PANEL / "panel.src", folder)
    results = {"as posted": cut(PANEL / "panel.src", plant)}
    for name, robot in (("compensated, old robot file", old), ("compensated, new robot file", new)):
        command(
            *(
                "program",
                folder / "panel.src",
                "--force=",
                "--cell",
                HERE / "cell.yaml",
                "--robot",
                robot,
                "-q",
            ),
            *("-o", folder / robot.stem / "panel.src"),
        )
        results[name] = cut(folder / robot.stem / "panel.src", plant)
    print(f"\nthe panel, {len(results['as posted'])} cutting motions on the plant   max mm   rms mm")
    for name, away in results.items():
        print(f"{name:46s} {away.max():9.4f} {np.sqrt(np.mean(away**2)):8.4f}")
    return results


if __name__ == "__main__":
    with TemporaryDirectory() as place:
        main(Path(place))
