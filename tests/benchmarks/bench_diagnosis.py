"""What a diagnosis costs: 60 poses under two weights, three reflectors, all candidates; the whole command.

    python -m pytest tests/benchmarks/bench_diagnosis.py

Time of this process, not of the clock; what is missing is the compensator, or nothing, or in places instead of
differences.
"""

from dataclasses import replace

import numpy as np
import pytest
from blind import arm
from blind.cases import Case, run_of
from blind.design import drawn
from blind.hidden import drawn as hidden

from postproc.cli.main import run
from postproc.measurements import measurements_csv

POSES, SECONDS = 60, 5.0


@pytest.mark.parametrize("case", ["compensator", "nothing", "places"])
def test_diagnosis(case, benchmark, tmp_path):
    rng = np.random.default_rng(1)
    deflection = case != "places"
    names = {"compensator": ("gravity_compensator",), "nothing": (), "places": ("hysteresis",)}[case]
    what = tuple(hidden(name, rng) for name in names)
    raw = arm.robot_file(not deflection, True)
    design = drawn(arm.model_of(raw), POSES, deflection, rng, several=True, planned=False)
    around = 2 * np.pi / 3 * np.arange(3)
    targets = np.column_stack([0.3 * np.cos(around), 0.3 * np.sin(around), [0.0, 0.1, 0.2]])
    design = replace(design, targets=targets, stated=True)
    made = run_of(Case("single", 0, 1, names, 2.0, POSES), raw, arm.cluttered(rng, True), design, what, rng)
    (tmp_path / "loads.csv").write_bytes(measurements_csv(made.readings))
    (tmp_path / "robot.yaml").write_bytes(made.robot)
    words = ["diagnose", str(tmp_path / "loads.csv"), "--robot", str(tmp_path / "robot.yaml")]

    def command():
        with pytest.raises(SystemExit):
            run([*words, "-o", str(tmp_path / "new.yaml"), "--quiet"])

    command()  # what is imported once
    benchmark.pedantic(command, rounds=3)
    median = benchmark.stats["median"]
    print(f"\n{case}: {len(made.readings)} readings, {median:.1f} s, {SECONDS:g} are allowed")
