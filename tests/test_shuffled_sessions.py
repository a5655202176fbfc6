"""The names that a diagnosis gives depend neither on the order of the readings nor on their sessions."""

import numpy as np
import pytest

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.effects.joint_offset import JointOffset
from postproc.effects.link_geometry import LinkGeometry
from postproc.effects.transmission_error import TransmissionError
from postproc.model import StiffnessModel
from postproc.robot.description import find_robot, load_robot

POSES, SIGMA = 240, 0.02 * MM

REFLECTOR = np.array([0.02, -0.01, 0.06])
"""[m] on the flange; nobody states it."""


@pytest.fixture(scope="module")
def rows():
    """(N, 9) joints [deg] and places [mm] of a UR5 whose geometry and gears are off, by a tracker; and a wave of no
    harmonic, twice as large as the scatter, which no effect explains."""
    rng = np.random.default_rng(7)
    model = StiffnessModel.from_robot(load_robot(find_robot("ur5")))
    joints = model.robot.joints
    off = {
        LinkGeometry(joints): lambda p: rng.normal(0.0, 3e-4),
        JointOffset(joints): lambda p: rng.normal(0.0, 1e-3) * (p.joint not in ("J1", "J6")),
        TransmissionError(joints, (2.0,)): lambda p: rng.normal(0.0, 1e-4),
    }
    for effect, drawn in off.items():
        model = model.with_effect(effect)
        values = {(len(model.terms) - 1, p.name): drawn(p) for p in effect.parameters}
        model = model.with_values(values)
    q = np.round(rng.uniform(-150.0, 150.0, (POSES, 6)), 3) * DEG
    rest = model.equilibrium(q, np.zeros((POSES, 6)), Poses.identity())
    wave = 2.0 * SIGMA * np.sin(5.3 * q[:, 1:2] + [0.0, 1.0, 2.0]) * np.sqrt(2.0)
    seen = rest.pose.position + rest.pose.rotation @ REFLECTOR + wave + rng.normal(0.0, SIGMA, (POSES, 3))
    turned = seen @ rotation_from_vector([0.02, -0.01, 2.0]).T + [2.5, -1.0, 0.4]
    return np.column_stack([q / DEG, turned / MM])


def written(folder, rows, parts):
    """The rows in as many files, each a session."""
    head = f"# robot: UR5\n# frame: tracker\n# sigma_mm: {SIGMA / MM:g}\nJ1,J2,J3,J4,J5,J6,X,Y,Z\n"
    files = [folder / f"session{k}.csv" for k in range(parts)]
    for k, file in enumerate(files):
        lines = [",".join(f"{x:.5f}" for x in row) for row in rows[k::parts].tolist()]
        file.write_text(head + "\n".join(lines) + "\n")
    return files


def names(compensate, files):
    done = compensate("diagnose", *files, "--robot", "ur5", "--json", "-", "--quiet")
    assert done.code in (0, 3), done.err
    told = done.json
    assert not [f for f in told["findings"] if f["severity"] == "error"]
    return told["verdict"], {(one["effect"], *sorted(one["joints"])) for one in told["named"]}, told["gap"]


@pytest.mark.slow
def test_shuffled_and_split_readings_get_the_same_names(compensate, tmp_path, rows):
    verdict, named, gap = names(compensate, written(tmp_path, rows, 1))
    assert {effect for effect, *_ in named} >= {"link_geometry", "transmission_error"}
    assert gap["held_out_after_rms_mm"] < 0.2 * gap["held_out_before_rms_mm"]
    for seed in range(3):
        shuffled = np.random.default_rng(seed).permutation(rows)
        folder = tmp_path / str(seed)
        folder.mkdir()
        other = names(compensate, written(folder, shuffled, 3))
        assert other[:2] == (verdict, named)
        assert other[2]["held_out_after_rms_mm"] == pytest.approx(gap["held_out_after_rms_mm"], rel=0.1)
