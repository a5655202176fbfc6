"""What share of a whole run each stage has: ``python -m tests.benchmarks.stages`` prints a table.

The run is the command's own, in this process and one thread, with reading back and all reports.  Every few milliseconds
of processor time its stack is looked at: the time since the last look goes to the stage of the innermost function that
has one.
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command does, before numpy is there

import argparse
import signal
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from types import FrameType

from tests.benchmarks.machine import heading
from tests.benchmarks.parts import MAKERS, made_apart

EVERY = 0.002
"""[s] of processor time between two looks."""

HOT = 30
"""Functions in the second table."""

ORDER = (
    "start-up",
    "read",
    "frames",
    "forces",
    "inverse kinematics",
    "equilibrium",
    "mirror",
    "between",
    "write",
    "read back",
    "reports",
    "files",
    "else",
)

FUNCTIONS = {("output/write.py", "plan_motions"): "write", ("base/document.py", "apply"): "write"}
"""The stage of functions whose file has another one, or none."""

FILES = {
    "languages/": "read",
    "base/document.py": "read",
    "base/read_files.py": "read",
    "base/input_files.py": "read",
    "cell/": "frames",
    "workflows/preparation.py": "frames",
    "process/": "forces",
    "robot/inverse.py": "inverse kinematics",
    "robot/newton.py": "inverse kinematics",
    "robot/axis_track.py": "inverse kinematics",
    "robot/chain.py": "equilibrium",
    "effects/": "equilibrium",
    "model/": "equilibrium",
    "compensation/path_error.py": "between",
    "compensation/subdivision.py": "between",
    "compensation/subdivide.py": "between",
    "compensation/divisible_motions.py": "between",
    "compensation/transitions.py": "between",
    "compensation/knots.py": "between",
    "compensation/refinement.py": "between",
    "compensation/desired_path.py": "between",
    "compensation/axis_limits.py": "between",
    "compensation/": "mirror",
    "output/write.py": "read back",
    "report/": "reports",
    "workflows/program.py": "reports",
    "output/atomic_write.py": "files",
}
"""The stage of a file or folder of the package; the first that fits."""


class Looks:
    """Processor time [s] by stage and by function, and the memory [MB] seen in each stage: all that is resident, and
    what is no page of a file."""

    def __init__(self, package: Path) -> None:
        self.package = f"{package}{os.sep}"
        self.stages: Counter[str] = Counter()
        self.functions: Counter[str] = Counter()
        self.memory: Counter[str] = Counter()
        self.own: Counter[str] = Counter()
        self.last = 0.0

    def look(self, _signal: int, frame: FrameType | None) -> None:
        now = time.process_time()
        stage, function = self.place(frame)
        self.stages[stage] += now - self.last
        self.functions[function] += now - self.last
        everything, own = resident()
        self.memory[stage] = max(self.memory[stage], everything)
        self.own[stage] = max(self.own[stage], own)
        self.last = now

    def place(self, frame: FrameType | None) -> tuple[str, str]:
        """The stage, and the innermost function of the package."""
        stage, function, stack = "", "", []
        while frame is not None:
            code = frame.f_code
            if code.co_filename.startswith("<frozen importlib"):
                return "start-up", "imports"
            if code.co_filename.startswith(self.package):
                file = code.co_filename.removeprefix(self.package)
                stack.append((file, code.co_name))
                function = function or f"{file} {code.co_qualname}"
                stage = stage or stage_of(file, code.co_name)
            frame = frame.f_back
        if stage == "read" and any(name == "edit_targets" for _, name in stack):
            stage = "write"
        elif stage == "read" and any(file == "output/write.py" for file, _ in stack):
            stage = "read back"
        return stage or "else", function or "else"


def stage_of(file: str, function: str) -> str:
    own = FUNCTIONS.get((file, function))
    return own or next((stage for name, stage in FILES.items() if file.startswith(name)), "")


def resident() -> tuple[float, float]:
    """[MB] memory of this process now, and the part of it that is in no file."""
    with open("/proc/self/statm") as stream:
        everything, files = (
            int(word) * os.sysconf("SC_PAGE_SIZE") / 1e6 for word in stream.read().split()[1:3]
        )
    return everything, everything - files


def looked_at(program: Path) -> Looks:
    os.environ["POSTPROC_THREADS"] = "1"  # what other threads do has no stack here
    import postproc
    from postproc.cli.main import run

    looks = Looks(Path(postproc.__file__).parent)
    signal.signal(signal.SIGPROF, looks.look)
    signal.setitimer(signal.ITIMER_PROF, EVERY, EVERY)
    try:
        run([str(program), "--force", "-q"])
    except SystemExit as end:
        if end.code not in (0, 3, None):
            raise
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        looks.look(0, None)
    return looks


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=100_000, help="motions [%(default)s]")
    parser.add_argument("--language", choices=MAKERS, default="krl")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        program = made_apart(Path(name), asked.language, asked.size)
        begin = time.perf_counter()
        looks = looked_at(program)
        wall = time.perf_counter() - begin
    total = sum(looks.stages.values())
    print(f"{heading()}\n{asked.size} motions, {asked.language}: {wall:.2f} s, processor {total:.2f} s")
    print(f"\n{'stage':20} {'cpu s':>7} {'share':>7} {'us a motion':>12} {'MB':>6} {'own MB':>7}")
    for stage in ORDER:
        if looks.stages[stage]:
            line = (looks.stages[stage], 100 * looks.stages[stage] / total)
            motion = 1e6 * looks.stages[stage] / asked.size
            size = f"{looks.memory[stage]:6.0f} {looks.own[stage]:7.0f}"
            print(f"{stage:20} {line[0]:7.2f} {line[1]:5.1f} % {motion:12.2f} {size}")
    print(f"\n{'function':60} {'cpu s':>7} {'share':>7}")
    for function, seconds in looks.functions.most_common(HOT):
        print(f"{function:60} {seconds:7.2f} {100 * seconds / total:5.1f} %")


if __name__ == "__main__":
    sys.exit(main())
