"""The same readings with their scatter stated and without it: who knows more must not answer worse."""

from __future__ import annotations

from postproc.measurements.write_csv import measurements_csv

from .cases import cases, made
from .oracle import MARGIN
from .real_worlds import Trial, unsaid
from .verdicts import GEOMETRY, nearest, truth_of

CELLS = 300


def sigma(number: int, seed: int) -> Trial:
    """One effect of the library, as in the rows of single effects, of every size; what an oracle does not tell from it
    may be named as well."""
    run = made(cases("single", CELLS, seed)[number % CELLS])
    truth = frozenset(truth_of(run))
    # a change of geometry that the robot file states is none that is missing
    own = any(h.effect in GEOMETRY and run.oracle.is_own(h, size) for h, size in run.hidden)
    near = nearest(run, 0, run.readings.value - run.without)
    alike = {(r.effect, r.joint) for r in near if r.margin < MARGIN and r.effect != "nothing"}
    return Trial(
        "sigma",
        number,
        {"robot.yaml": run.robot, "data.csv": measurements_csv(run.readings)},
        truth | alike,
        frozenset() if own else truth,
        run.scene,
        run.design,
        run.sigma,
        f"{run.case.effects[0]}, SNR {run.case.snr:g}, {run.case.poses} poses",
        {"data.csv": measurements_csv(unsaid(run.readings))},
    )
