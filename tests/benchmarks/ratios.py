"""How many times as fast as plain ways to the same result: ``python -m tests.benchmarks.ratios`` prints a table.

Both sides of a row are measured in the same run, one after the other several times; their medians count.  A pose is
processor time of one thread; where two results are not equal the comparison is void.  BLAS has one thread everywhere.

- mirror loop: ``compensation.mirror`` from the wanted pose against the plain loop over Pinocchio calls of
  ``tests/benchmarks/loop.py``, which begins there as well; and as the command runs it, from commands whose loaded
  joints stand where the goal is, against the same loop.  All come to the same results.
- linear deflection: forward kinematics, Jacobian and J K^-1 J^T F, against roboticstoolbox-python, which is installed
  into a virtual environment of its own (``--toolbox`` names the Python of one that is there already).
- whole run: the command, in a process with start-up, reading back and all reports, against
  ``tests/benchmarks/floor.py``; by the clock, on all cores, and by the processor.
"""

from __future__ import annotations

import os

os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = (
    "1"  # before numpy is there; for children as well
)

import argparse
import shutil
import subprocess
import sys
import tempfile
import time
import venv
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np
import pinocchio as pin

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.memory import use_mmap_for_large_arrays
from postproc.compensation.load_case import LoadCase
from postproc.compensation.mirror import ANGLE_TOLERANCE, POSITION_TOLERANCE, initial_guess, mirror
from postproc.model import NOTHING, StiffnessModel
from postproc.robot.chain import Chain
from postproc.robot.description import find_robot, load_robot
from postproc.robot.inverse import branch_of
from tests.benchmarks.loop import Loop
from tests.benchmarks.machine import heading
from tests.benchmarks.parts import made_apart
from tests.benchmarks.processes import compensation, cost_of
from tests.motions import milling_angles

TOOL = Poses(rotation_from_vector([0.2, 0.5, -0.1]), np.array([0.12, -0.05, 0.25]))
POSES, PLAIN = 2**15, 1000
"""Poses a repetition: of ours, and of a loop."""

TIMES = 5
FARTHEST = 0.01
"""[m] Corrections at most, as in a cell that says nothing."""

SAME_MM, SAME_ANGLE, SAME = 2e3 * POSITION_TOLERANCE, 2.0 * ANGLE_TOLERANCE, 1e-9
"""How far two results of one mathematics may differ: commands [mm], [rad], and deflections in parts of the largest."""

WANTED_MIRROR, WANTED_LINEAR = 50.0, 15.0
WANTED_CLOCK, WANTED_PROCESSOR = 1.7, 2.5
"""Of whole runs, at most."""

REQUIREMENTS = ("roboticstoolbox-python", "numpy<2")

HEADINGS = f"{'':42} {'ours':>9} {'other':>9} {'ratio':>7} {'wanted':>9}"


class States:
    """Poses where a heavy arm mills, each with a wrench, one tool."""

    def __init__(self) -> None:
        rng = np.random.default_rng(9)
        self.model = StiffnessModel.from_robot(load_robot(find_robot("kuka_kr270")))
        self.q = milling_angles(POSES, rng)
        self.wrench = rng.uniform(-1.0, 1.0, (POSES, 6)) * [600.0, 600.0, 600.0, 60.0, 60.0, 60.0]


def line(name: str, ours: float, other: float, unit: str, ratio: float, wanted: str, reached: bool) -> None:
    said = "reached" if reached else "not reached"
    print(f"{name:42} {ours:6.2f} {unit} {other:6.2f} {unit} {ratio:7.1f} {wanted:>9}  {said}", flush=True)


def faster(name: str, ours: list[float], other: list[float], wanted: float) -> None:
    """A row of times a pose [us]."""
    mine, its = median(ours), median(other)
    line(name, mine, its, "us", its / mine, f">= {wanted:g}", its / mine >= wanted)


def timed(work: Callable[[], object], count: int) -> float:
    """[us] of processor time for each of ``count``."""
    begin = time.process_time()
    work()
    return (time.process_time() - begin) / count * 1e6


def mirror_loop(states: States) -> None:
    model, q, wrench = states.model, states.q, states.wrench
    wanted = model.chain.flange(q) @ TOOL
    status = branch_of(model.robot.nominal, q)
    loop = Loop(model, TOOL)
    places = [pin.SE3(wanted.rotation[i], wanted.position[i]) for i in range(PLAIN)]

    case = LoadCase(TOOL, wrench, NOTHING, status, q)

    def batch() -> None:
        nonlocal done
        done = mirror(model, wanted, wanted, case)

    def as_run() -> None:
        nonlocal run
        begin = initial_guess(model, wanted, wanted, case, FARTHEST)
        run = mirror(model, wanted, wanted, case, guess=begin)

    def plain() -> None:
        nonlocal found
        found = [loop.corrected(place, *state) for place, *state in zip(places, q, wrench, strict=False)]

    done = run = None
    found = []
    batch()
    as_run()
    times = [(timed(batch, POSES), timed(as_run, POSES), timed(plain, PLAIN)) for _ in range(TIMES)]
    there = np.array([one.command.translation for one in found])
    turned = np.array([one.command.rotation for one in found])
    for one in (done, run):
        off_mm = 1e3 * np.abs(there - one.command.position[:PLAIN]).max()
        angle = np.abs(turned - one.command.rotation[:PLAIN]).max()
        if not one.converged.all() or not off_mm <= SAME_MM or not angle <= SAME_ANGLE:
            raise SystemExit(f"mirror loop: void, the results are {off_mm:.2g} mm and {angle:.2g} apart")
    same, other, theirs = map(list, zip(*times, strict=True))
    faster("mirror loop, Pinocchio, a pose", same, theirs, WANTED_MIRROR)
    faster("the same, as the command begins it", other, theirs, WANTED_MIRROR)


def linear_deflection(states: States, python: str, folder: Path) -> None:
    model = states.model.without_effects(["gravity_compensator"])
    chain = Chain(model.robot.joints, model.robot.flange)
    placed = [chain.model.jointPlacements[i + 1] for i in range(chain.model.nq)]
    placed.append(
        chain.model.frames[chain.model.getFrameId("flange")].placement * pin.SE3(TOOL.rotation, TOOL.position)
    )
    compliance = list(model.terms[0].values.values())
    given, answer = folder / "states.npz", folder / "deflections.npy"
    np.savez(
        given,
        placements=[place.homogeneous for place in placed],
        q=states.q[:PLAIN],
        wrench=states.wrench[:PLAIN],
        compliance=compliance,
    )
    words = [python, "-P", str(Path(__file__).with_name("toolbox.py")), str(given), str(answer)]
    alone = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    with subprocess.Popen(
        words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=alone
    ) as child:

        def plain() -> float:
            try:
                print(file=child.stdin, flush=True)
                return float(child.stdout.readline()) / PLAIN * 1e6
            except (OSError, ValueError):
                child.kill()
                last = child.stderr.read().strip().splitlines()[-1:]
                raise SystemExit(
                    f"linear deflection: {python} has no roboticstoolbox: {' '.join(last)}"
                ) from None

        def batch() -> None:
            nonlocal found
            found = model.linear_deflection(states.q, states.wrench, TOOL)

        found = np.empty(0)
        batch()
        plain()
        times = [(timed(batch, POSES), plain()) for _ in range(TIMES)]
        child.stdin.close()
    theirs = np.load(answer)
    off = np.abs(theirs - found[:PLAIN]).max(axis=0) / np.abs(theirs).max(axis=0)
    if not (off <= SAME).all():
        raise SystemExit(f"linear deflection: void, the results are {off.max():.2g} of the largest apart")
    faster("linear deflection, roboticstoolbox, a pose", *map(list, zip(*times, strict=True)), WANTED_LINEAR)


def toolbox(folder: Path) -> str | None:
    """The Python of a new virtual environment with roboticstoolbox-python; None where it can not be made."""
    venv.create(folder, with_pip=True)
    python = folder / "bin" / "python"
    done = subprocess.run(
        [python, "-m", "pip", "install", "-q", *REQUIREMENTS], capture_output=True, text=True
    )
    return str(python) if done.returncode == 0 else None


def whole_run(count: int, times: int, folder: Path) -> None:
    program = made_apart(folder, "krl", count)
    floor = [sys.executable, "-m", "tests.benchmarks.floor", program, folder / "floor.src"]
    costs = []
    for _ in range(times):
        costs.append((compensation(program, count), cost_of(floor)))
        shutil.rmtree(folder / "compensated")
    for name, field, most in (("clock", "wall", WANTED_CLOCK), ("processor", "cpu", WANTED_PROCESSOR)):
        ours, other = (median(getattr(pair[i], field) for pair in costs) for i in (0, 1))
        line(
            f"whole run, {count} motions, {name}", ours, other, "s ", ours / other, f"<= {most:g}",
            ours <= most * other,
        )  # fmt: skip
    print(f"{'':4}{'a motion, processor':38} {1e6 * ours / count:6.2f} us {1e6 * other / count:6.2f} us")


def poses(python: str | None, folder: Path) -> None:
    """The rows of poses; ``python``: one that has roboticstoolbox-python."""
    python = python or toolbox(folder / "venv")
    os.environ["POSTPROC_THREADS"] = "1"
    states = States()
    mirror_loop(states)
    if python is None:
        print("linear deflection: not measured, roboticstoolbox-python can not be installed here")
    else:
        linear_deflection(states, python, folder)
    del os.environ["POSTPROC_THREADS"]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--toolbox", metavar="PYTHON", help="one that has roboticstoolbox-python")
    parser.add_argument("--sizes", default="100000,1000000", help="motions of whole runs [%(default)s]")
    parser.add_argument("--runs-alone", action="store_true", help="whole runs, and no poses")
    asked = parser.parse_args()
    use_mmap_for_large_arrays()  # as the command does
    print(f"{heading()}\n{HEADINGS}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if not asked.runs_alone:
            poses(asked.toolbox, folder)
        for count in map(int, asked.sizes.split(",") if asked.sizes else []):
            whole_run(count, 1 if count >= 10**6 else 3, folder / str(count))


if __name__ == "__main__":
    main()
