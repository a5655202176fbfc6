"""A published calibration: 1020 poses of a UR5 by laser tracker (MIT licence, Paul Jacobi, serial_robots_datasets).

Read from the folder that POSTPROC_DATA names: the one that holds ``ur5``, or ``ur5`` itself.  Published: 2.566 mm
raw, 0.155 mm after a geometric fit and a neural network.
"""

import os
from pathlib import Path

import pytest
import yaml

ROOT = Path(os.environ.get("POSTPROC_DATA", ""))
PLACES = ROOT, ROOT / "ur5", ROOT / "measured" / "ur5"
FOLDER = next((path for path in PLACES if (path / "train.csv").is_file()), None)

pytestmark = pytest.mark.skipif(
    "POSTPROC_DATA" not in os.environ or FOLDER is None,
    reason="POSTPROC_DATA names no folder with ur5/train.csv and ur5/test.csv",
)

REGISTRATION = 0.452
"""[mm] mean on the 20 held-out poses of what finding tracker, scale and reflector leaves; no merit of the geometry."""


def identified(compensate, folder, effects):
    """The command on the 1000 poses, validated with the 20: JSON, and the robot file."""
    new = folder / "ur5_calibrated.yaml"
    done = compensate(
        *("identify", FOLDER / "train.csv", "--robot", "ur5", "--effects", effects),
        *("--validate", FOLDER / "test.csv", "-o", new, "--json", "-"),
    )
    assert done.code in (0, 3), done.err
    assert done.json["readings"] == 1000
    assert done.json["validation"]["readings"] == 20
    return done.json, yaml.safe_load(new.read_text())


def test_geometry_reaches_more_than_was_published(compensate, tmp_path):
    told, new = identified(compensate, tmp_path, "link_geometry,joint_offset")
    held_out, gap = told["validation"], told["gap"]
    assert held_out["before_mean_mm"] == pytest.approx(REGISTRATION, abs=0.002)
    assert held_out["after_mean_mm"] <= 0.105
    assert gap["held_out_after_mean_mm"] <= 0.106
    # five folds say what poses that were not fitted say, and the fit is no better than it should be
    assert gap["after_mean_mm"] < gap["held_out_after_mean_mm"] < 1.05 * gap["after_mean_mm"]
    assert gap["held_out_before_mean_mm"] > 0.5
    # the first joint's zero is where the tracker stands, the last one's where the reflector is
    dropped = {one["name"] for one in told["dropped"]}
    assert {"joint_offset.o1", "joint_offset.o6"} <= dropped
    names = [effect["effect"] for effect in new["effects"]]
    assert {"link_geometry", "joint_offset"} <= set(names)
    assert new["identified"]


def test_a_first_harmonic_explains_a_little_more(compensate, tmp_path):
    told, _ = identified(compensate, tmp_path, "link_geometry,joint_offset,transmission_error")
    assert told["validation"]["after_mean_mm"] <= 0.092
    assert told["gap"]["held_out_after_mean_mm"] <= 0.095


def test_a_diagnosis_names_what_transfers(compensate, tmp_path):
    """Geometry, zeros and waves of the gears; what remains is a statement of its own."""
    done = compensate(
        *("diagnose", FOLDER / "train.csv", "--robot", "ur5", "--validate", FOLDER / "test.csv"),
        *("-o", tmp_path / "ur5_new.yaml", "--json", "-"),
    )
    assert done.json["verdict"] == "partly_named"
    assert {one["effect"] for one in done.json["named"]} == {
        "link_geometry",
        "joint_offset",
        "transmission_error",
    }
    (kept_aside,) = done.json["validation"]
    assert kept_aside["after_mean_mm"] <= 0.09
