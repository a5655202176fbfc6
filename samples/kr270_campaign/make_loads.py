"""Fills in the plans of this folder: a KR 270 of its own in MuJoCo, three reflectors, a tracker with 0.03 mm scatter.

    python samples/kr270_campaign/make_loads.py          (in an environment with the [test] extra)

The arm that is measured is not the one of ``robots/kuka_kr270.yaml``: each of its joints and its compensator's spring
differ by the factors below.  MuJoCo is another engine than the model that is fitted.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "tests"))

from plant import Plant, kr270  # noqa: E402

from postproc.measurements import measurements_csv, read_measurements  # noqa: E402
from postproc.measurements.readings import Readings  # noqa: E402
from postproc.model import StiffnessModel  # noqa: E402

FACTORS = {"c2": 1.12, "c3": 0.91, "c4": 1.23, "c5": 0.84, "c6": 1.06, "K_c": 0.88, "s0": 1.03}
SIGMA = 3e-5


def arm() -> StiffnessModel:
    model = StiffnessModel.from_robot(kr270())
    of = {name: index for index, term in enumerate(model.terms) for name in term.values}
    return model.with_values(
        {(of[name], name): model.terms[of[name]].values[name] * f for name, f in FACTORS.items()}
    )


def measured(plan: Readings, plant: Plant, rng: np.random.Generator) -> Readings:
    """Every reading of ``plan``: the reflector under load minus the same without."""
    assert plan.tool is not None
    into = plan.tool.inverse()
    value = np.empty((len(plan), 3))
    for row, (q, wrench) in enumerate(zip(plan.q, plan.wrench, strict=True)):
        place = into.rotation @ plan.places[plan.targets[plan.target[row]]] + into.position
        loaded, unloaded = (plant.rest(q, w, plan.tool) for w in (wrench, np.zeros(6)))
        value[row] = loaded.position + loaded.rotation @ place - unloaded.position - unloaded.rotation @ place
    return replace(plan, value=value + SIGMA * rng.normal(size=value.shape))


def main() -> None:
    joints = [(joint.name, False) for joint in kr270().joints]
    plant, rng = Plant.of(arm()), np.random.default_rng(270)
    for name in ("plan", "check_plan"):
        text = (HERE / f"{name}.csv").read_text(encoding="utf-8")
        # a plan has no readings yet, and is refused as a file of readings: any number stands in for them
        stand_in = HERE / f"{name}.stand_in.csv"
        stand_in.write_text(text.replace(",,,\n", ",0,0,0\n").replace(",,\n", ",0,0,0\n"), encoding="utf-8")
        plan = read_measurements(stand_in, joints)
        stand_in.unlink()
        out = HERE / ("loads.csv" if name == "plan" else "check.csv")
        out.write_bytes(measurements_csv(measured(plan, plant, rng), ["simulated by make_loads.py"]))


if __name__ == "__main__":
    main()
