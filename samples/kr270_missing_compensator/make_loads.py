"""Writes loads.csv: a KR 270 with its gravity compensator (Table 1), in MuJoCo, under a hung weight.

    python samples/kr270_missing_compensator/make_loads.py          (in an environment with the [test] extra)

40 poses drawn within the axis limits, three reflectors, 0.02 mm scatter in each coordinate of loaded minus unloaded.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "tests"))

from plant import GRAVITY, Plant, kr270  # noqa: E402

from postproc.base.geometry import Poses  # noqa: E402
from postproc.base.units import DEG  # noqa: E402
from postproc.measurements import measurements_csv, planned  # noqa: E402
from postproc.model import StiffnessModel  # noqa: E402

POSES, WEIGHT, SIGMA = 40, 95.0, 2e-5
TOOL = Poses(np.eye(3), np.array([0.0, 0.5, 0.3]))
PLACES = {"M1": [0.3, 0.0, 0.1], "M2": [-0.15, 0.26, 0.1], "M3": [-0.15, -0.26, 0.1]}
ROOM = 0.3  # m above the ground


def poses(rng: np.random.Generator) -> np.ndarray:
    """(POSES, 6) [rad]: anywhere within the limits where flange and weight hang free."""
    model = StiffnessModel.from_robot(kr270())
    low, high = kr270().limits.T
    q = np.round(rng.uniform(low, high, (20 * POSES, 6)) / DEG, 1) * DEG
    flange = model.chain.flange(q)
    hung = flange.position + flange.rotation @ TOOL.position
    return q[(flange.position[:, 2] > ROOM) & (hung[:, 2] > ROOM)][:POSES]


def main() -> None:
    rng = np.random.default_rng(2)
    plant = Plant.of(StiffnessModel.from_robot(kr270()))
    names = tuple(PLACES)
    q = np.repeat(poses(rng), len(names), axis=0)
    target = np.tile(np.arange(len(names)), POSES)
    wrench = np.tile([0, 0, -WEIGHT * GRAVITY, 0, 0, 0], (len(q), 1))
    places = {name: np.array(place) for name, place in PLACES.items()}
    joints = [(joint.name, False) for joint in kr270().joints]
    plan = planned(
        joints, q, wrench, True, tool=TOOL, targets=names, places=places, target=target, sigma=SIGMA
    )
    into = TOOL.inverse()
    value = np.empty((len(q), 3))
    for row in range(len(q)):
        place = into.rotation @ places[names[target[row]]] + into.position
        loaded, unloaded = (plant.rest(q[row], w, TOOL) for w in (wrench[row], np.zeros(6)))
        value[row] = loaded.position + loaded.rotation @ place - unloaded.position - unloaded.rotation @ place
    readings = replace(plan, value=value + SIGMA * rng.normal(size=value.shape))
    (HERE / "loads.csv").write_bytes(measurements_csv(readings, ["simulated by make_loads.py"]))


if __name__ == "__main__":
    main()
