"""A push test separates compliances from forces: held against the true values of the sample's plant."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from blind_parts.truth import filed_compliances
from plant import Plant, kr270

import postproc
from postproc.base.geometry import Poses

pytestmark = pytest.mark.slow

SAMPLE = Path(__file__).resolve().parent.parent / "samples" / "kr270_second_part"
SIGMA = 5e-6


def push(path: Path, force: float = 400.0, factor: float = 1.0) -> Path:
    """Readings of a plant with the sample's compliances, without a balancer's part in a horizontal push."""
    rng = np.random.default_rng(5)
    compliance = filed_compliances()
    compliance[0] *= 1.25
    plant = Plant(kr270().arm, compliance)
    lines = ["# robot: kuka_kr270", f"# sigma_mm: {1e3 * SIGMA:g}", "A1,A2,A3,A4,A5,A6,FX,FY,FZ,DX,DY,DZ"]
    for _ in range(6):
        degrees = np.array([rng.uniform(-30, 30), -60, 100, 20, rng.uniform(-60, 60), 10])
        angle = rng.uniform(0, 2 * np.pi)
        wrench = np.array([force * np.cos(angle), force * np.sin(angle), 0, 0, 0, 0])
        ends = [
            plant.rest(np.deg2rad(degrees), one, Poses.identity()).position for one in (0 * wrench, wrench)
        ]
        moved = 1e3 * (factor * (ends[1] - ends[0]) + rng.normal(0, SIGMA, 3))
        lines.append(",".join(f"{one:.6g}" for one in (*degrees, *wrench[:3], *moved)))
    path.write_text("\n".join(lines) + "\n")
    return path


def values(learned, name):
    return next((value, deviation) for cause, value, deviation in learned.causes() if cause.name == name)


def test_a_push_test_narrows_compliance_and_force_about_their_true_values(tmp_path):
    shutil.copytree(SAMPLE, tmp_path / "shop")
    program, part = tmp_path / "shop" / "part.src", tmp_path / "shop" / "part1.csv"
    alone = postproc.learn(program, part, dry_run=True)
    pushed = postproc.learn(program, part, push=push(tmp_path / "push.csv"), dry_run=True)
    for name, true in (("joint_compliance.c1", np.log(1.25)), ("force", np.log(1.3))):
        wide, narrow = values(alone, name), values(pushed, name)
        assert abs(narrow[0] - true) < 2.5 * narrow[1]
        assert narrow[1] < (0.5 if name != "force" else 0.9) * wide[1]


@pytest.mark.parametrize("change", ["no force", "metres", "no scatter"])
def test_a_push_test_that_cannot_be_is_refused(tmp_path, change):
    shutil.copytree(SAMPLE, tmp_path / "shop")
    path = push(tmp_path / "push.csv", factor=50.0 if change == "metres" else 1.0)
    text = path.read_text()
    if change == "no scatter":
        text = text.replace("# sigma_mm: 0.005\n", "")
    if change == "no force":
        rows = text.splitlines()
        cells = rows[3].split(",")
        rows[3] = ",".join([*cells[:6], "0", "0", "0", *cells[9:]])
        text = "\n".join(rows) + "\n"
    path.write_text(text)
    with pytest.raises(postproc.Refusal) as caught:
        postproc.learn(tmp_path / "shop" / "part.src", tmp_path / "shop" / "part1.csv", push=path)
    assert [finding.code for finding in caught.value.findings] == ["LRN001"]
    assert not (tmp_path / "shop" / "learned").exists()
