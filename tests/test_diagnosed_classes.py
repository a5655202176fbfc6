"""Errors of arms of other kinds, moved by plain matrices: a passive joint, parallel axes, a linkage that sags."""

from dataclasses import replace

import numpy as np
import pytest
from blind.other_arms import DEG, GRAVITY, MM, SIGMA, Arm, World, csv_of, drawn_poses, lines_of

from postproc import diagnose
from postproc.model import StiffnessModel
from postproc.robot.description import load_robot

ROWS = np.array([(300, -90, 800), (1000, 0, 0), (0, 0, 0), (1100, 0, 0), (250, 90, 0), (0, 0, 200)], float)
LIMITS = np.array([(-170, 170), (-130, -10), (0, 0), (-30, 60), (-60, 60), (-180, 180)], float)
LINKAGE = Arm("palletizer", ("A1", "A2", "P1", "A3", "A4", "A5"), ROWS * [MM, DEG, MM], LIMITS * DEG)
"""P1 has no motor: a parallelogram keeps the forearm's inclination when A2 moves."""

PARALLEL = Arm(
    "parallel",
    tuple(f"A{i}" for i in range(1, 7)),
    np.array([(400, -90, 900), (1100, 0, 0), (-50, -90, 0), (0, 90, 980), (0, -90, 0), (0, 0, 250)], float)
    * [MM, DEG, MM],
    np.array([(-180, 180), (-125, 10), (-100, 120), (-180, 180), (-118, 118), (-180, 180)], float) * DEG,
)


def followed(q):
    """(N, 6) with P1 as the linkage turns it."""
    q = q.copy()
    q[:, 2] = -q[:, 1]
    return q


def linkage_file() -> bytes:
    lines = LINKAGE.file().decode().splitlines()
    return (
        "\n".join(
            "  P1: {follows: {A2: -1}}" if line.startswith("  P1:") else line for line in lines
        ).encode()
        + b"\n"
    )


def without_column(text: bytes, name: str) -> bytes:
    lines = text.decode().splitlines()
    head = [line for line in lines if line.startswith("#")]
    rows = [line.split(",") for line in lines[len(head) :]]
    place = rows[0].index(name)
    return ("\n".join([*head, *(",".join(r[:place] + r[place + 1 :]) for r in rows)]) + "\n").encode()


def told(folder, robot: bytes, data: bytes):
    """The answer to readings, and the model of the new robot file (None where none was written)."""
    (folder / "robot.yaml").write_bytes(robot)
    (folder / "data.csv").write_bytes(data)
    new = folder / "new.yaml"
    answer = diagnose(folder / "data.csv", robot=str(folder / "robot.yaml"), output=new)
    return answer, StiffnessModel.from_robot(load_robot(new)) if new.exists() else None


def names(answer) -> list:
    return sorted((n.effect, *n.joints) for n in answer.verdict.named)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_length_before_a_joint_without_a_motor(tmp_path, seed):
    rng = np.random.default_rng([seed, 61])
    q = followed(drawn_poses(LINKAGE, 40, rng))
    world = replace(World.of(LINKAGE), moved={(2, "x"): 3e-4})
    data = without_column(csv_of(world, q, rng, told=False), "P1")
    answer, new = told(tmp_path, linkage_file(), data)
    assert (answer.verdict.word, names(answer)) == ("named", [("link_geometry", "P1")])
    found = {p: v for term in new.terms for p, v in term.values.items()}
    assert found["dx_P1"] == pytest.approx(3e-4, abs=3e-5)


@pytest.mark.parametrize("seed", [0, 1])
def test_weights_on_a_linkage_are_no_waves_of_its_gears(tmp_path, seed):
    """Both follow the angles alike there: the joints that sag together are one explanation, waves are another."""
    rng = np.random.default_rng([seed, 62])
    q = followed(drawn_poses(LINKAGE, 45, rng))
    lines, masses, soft = (
        lines_of(LINKAGE),
        np.array([15.0, 22, 8, 18, 12, 10]),
        np.array([0, 2.2e-7, 0, 1.6e-7, 2.5e-7, 0]),
    )

    def energy(at):
        """(N,) of weights at the ends of the links."""
        _, _, _, points = lines.places(followed(at))
        flange = lines.places(followed(at))[0]
        height = np.column_stack([points[:, 1:, 2], flange[:, 2]])
        return GRAVITY * height @ masses

    bent = q.copy()
    for joint in (1, 3, 4):
        step = np.zeros(6)
        step[joint] = 1e-5
        bent[:, joint] -= soft[joint] * (energy(q + step) - energy(q - step)) / 2e-5
    world = World.of(LINKAGE)
    true = csv_of(world, followed(bent), rng, told=False).decode().splitlines()
    asked = csv_of(world, q, rng, told=False).decode().splitlines()
    # commanded angles beside what was read
    n = len(LINKAGE.names)
    mixed = [
        line
        if line.startswith("#") or line.startswith("A1")
        else ",".join(other.split(",")[:n] + line.split(",")[n:])
        for line, other in zip(true, asked, strict=True)
    ]
    answer, _ = told(tmp_path, linkage_file(), without_column(("\n".join(mixed) + "\n").encode(), "P1"))
    everything = {n.effect for n in answer.verdict.named}
    everything |= {c.name for one in answer.verdict.alternatives for c in one}
    assert "gravity_sag" in everything
    assert (
        "transmission_error" not in {n.effect for n in answer.verdict.named}
        or answer.verdict.word == "ambiguous"
    )


@pytest.mark.parametrize("seed", [0, 3])
def test_a_shift_along_parallel_axes_is_written_whichever_axis_has_it(tmp_path, seed):
    """Of joints with several parameters only those count that the readings ask for."""
    rng = np.random.default_rng([seed, 63])
    q = drawn_poses(PARALLEL, 40, rng)
    world = replace(World.of(PARALLEL), moved={(2, "y"): 1.2e-4})
    answer, new = told(tmp_path, PARALLEL.file(), csv_of(world, q, rng, told=False))
    assert answer.verdict.word == "ambiguous"
    assert {c.name for one in answer.verdict.alternatives for c in one} == {"link_geometry"}
    assert answer.diagnosis.agreed
    assert max(answer.diagnosis.disagreement) < 0.01 * SIGMA
    assert new is not None
