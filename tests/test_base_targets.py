"""Reflectors on the robot base, columns that are no part of the format, and a figure per file to validate with."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.base.findings import Refusal
from postproc.effects import EFFECTS
from postproc.identification.campaign import Campaign
from postproc.identification.fit import fit
from postproc.identification.sensitivities import columns
from postproc.identification.unknowns import unknowns_of
from postproc.measurements import joined, measurements_csv, read_measurements
from postproc.model import StiffnessModel
from postproc.report.placed import stations, targets
from postproc.robot.description import find_robot, load_robot
from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot
from postproc.workflows.identify import IdentifyRequest, identify

ROBOT = load_robot(find_robot("kuka_kr270"))
JOINTS = [(joint.name, False) for joint in ROBOT.joints]
PLACES = {
    "B1": np.array([0.6, 0.5, 0.1]),
    "B2": np.array([-0.6, 0.4, 0.2]),
    "B3": np.array([0.1, -0.7, 0.15]),
}
STATION = Rotation.from_euler("zyx", [70, -4, 8], degrees=True), np.array([3.0, 1.0, 0.5])


def rigid():
    return StiffnessModel.from_robot(ROBOT).without_effects(EFFECTS)


def poses(count, seed):
    q = np.random.default_rng(seed).uniform(
        [-60, -120, 30, -90, -60, -90], [60, -40, 120, 90, 60, 90], (count, 6)
    )
    return np.radians(q)


def file_of(path, q, rows, head=(), more=""):
    """``rows``: (pose, name, place [m])"""
    lines = [*head, "A1,A2,A3,A4,A5,A6,TARGET,X,Y,Z" + more]
    for pose, name, place in rows:
        cells = [*np.degrees(q[pose]), name, *(1e3 * np.asarray(place))]
        lines.append(
            ",".join(c if isinstance(c, str) else f"{c:.6f}" for c in cells) + (",note" if more else "")
        )
    path.write_text("\n".join(lines) + "\n")
    return path


def seen(place, rng, sigma=2e-5):
    return STATION[0].apply(place) + STATION[1] + rng.normal(0, sigma, 3)


def absolute(path, count, base, head=(), seed=1):
    """One reflector on the flange at 100, 20, 80 mm, and those of ``base``, read once each."""
    rng, q = np.random.default_rng(seed), poses(count, seed)
    flange = rigid().chain.flange(q)
    points = flange.position + flange.rotation @ np.array([0.1, 0.02, 0.08])
    rows = [(k, "M1", seen(points[k], rng)) for k in range(count)]
    rows += [(0, name, seen(PLACES[name], rng)) for name in base for _ in range(3)]
    return file_of(path, q, rows, ("# robot: kuka_kr270", "# sigma_mm: 0.02", *head))


def stated(names):
    return [f"# base_target {n}: {' '.join(f'{1e3 * v:g}' for v in PLACES[n])}" for n in names]


def test_stated_base_targets_register_the_tracker(tmp_path):
    """Three points of a rigid body, found by the closed form of Kabsch (1976)."""
    path = absolute(tmp_path / "a.csv", 12, PLACES, stated(PLACES))
    readings = read_measurements(path, JOINTS)
    assert readings.on_base == set(PLACES)
    campaign = Campaign(readings)
    assert [n for n in campaign.nuisance_names if n.startswith("target")] == [f"target M1.{c}" for c in "xyz"]
    found = fit(campaign, rigid(), ())
    (station,) = stations(found)
    np.testing.assert_allclose(station.position, 1e3 * STATION[1], atol=0.1)
    based = [name in PLACES for name in np.array(readings.targets)[readings.target]]
    here = np.array([PLACES[n] for n in np.array(readings.targets)[readings.target][based]])
    there = readings.value[based]
    best, _ = Rotation.align_vectors(there - there.mean(0), here - here.mean(0))
    turn = best.inv() * Rotation.from_matrix(found.point.nuisances.frames.rotation[0])
    assert turn.magnitude() < 2e-4
    assert np.linalg.norm(found.residual[based], axis=1).max() < 1e-4


def test_place_of_a_base_target_is_found(tmp_path):
    path = absolute(tmp_path / "a.csv", 25, ["B1"], ["# base_target B1:"])
    found = fit(Campaign(read_measurements(path, JOINTS)), rigid(), ())
    by_name = {one.name: one for one in targets(found)}
    assert by_name["B1"].on_base
    assert not by_name["M1"].on_base
    away = np.abs(by_name["B1"].position - 1e3 * PLACES["B1"])
    assert (away < 2.0 * by_name["B1"].ci95).all()
    assert by_name["B1"].ci95.max() < 0.3
    np.testing.assert_allclose(by_name["M1"].position, [100, 20, 80], atol=0.2)


def tilting():
    model = rigid().with_effect(EFFECTS["base_compliance"](ROBOT.joints))
    return model.with_values({(0, "c_rx"): 3e-8, (0, "c_ry"): 2e-8, (0, "c_z"): 1e-8})


def loaded(tmp_path, moves=True, count=20):
    """Deflections of a reflector on the flange and of those on the base, of a foundation that tilts and gives."""
    rng, q, model = np.random.default_rng(3), poses(count, 4), tilting()
    lines = ["# robot: kuka_kr270", "# sigma_mm: 0.005", "# target M1: 0 0 0", *stated(PLACES)]
    lines.append("A1,A2,A3,A4,A5,A6,FX,FY,FZ,TARGET,DX,DY,DZ")
    for k in range(count):
        force = rng.uniform(-2500, 2500, 3)
        wrench = np.concatenate([force, np.zeros(3)])
        still = model.chain.flange(q[k : k + 1]).position[0]
        place = still
        for _ in range(6):  # the closed form of one tilting, giving body: it is the base alone that moves
            turn = Rotation.from_rotvec([3e-8 * np.cross(place, force)[0], 0, 0])
            turn = turn * Rotation.from_rotvec([0, 2e-8 * np.cross(place, force)[1], 0])
            place = turn.apply(still) + np.array([0, 0, 1e-8 * force[2]])
        values = {"M1": place - still}
        for name, point in PLACES.items():
            values[name] = (
                turn.apply(point) + np.array([0, 0, 1e-8 * force[2]]) - point if moves else np.zeros(3)
            )
        for name, value in values.items():
            value = value + rng.normal(0, 5e-6, 3)
            cells = [*np.degrees(q[k]), *wrench[:3], name, *(1e3 * value)]
            lines.append(",".join(c if isinstance(c, str) else f"{c:.7f}" for c in cells))
    path = tmp_path / f"loads{moves}.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_base_target_goes_with_a_base_that_tilts(tmp_path):
    campaign = Campaign(read_measurements(loaded(tmp_path), JOINTS))
    model = tilting()
    there = campaign.predicted(model)
    residual = campaign.residual(there, campaign.start())
    assert np.sqrt(np.mean(residual**2)) == pytest.approx(5e-6, rel=0.2)
    assert np.abs(campaign.readings.value[campaign.on_base[campaign.readings.target]]).max() > 1e-5


def test_columns_of_base_targets_are_derivatives(tmp_path):
    campaign = Campaign(read_measurements(loaded(tmp_path), JOINTS))
    model, given = tilting(), campaign.start()
    unknowns = [u for u in unknowns_of(model, 0) if u.parameter.name in ("c_rx", "c_z")]
    there = campaign.predicted(model)
    moves = columns(campaign, model, unknowns, there, given)
    for k, unknown in enumerate(unknowns):
        value, step = model.terms[0].values[unknown.parameter.name], 1e-11
        ahead, back = (
            campaign.expected(campaign.predicted(model.with_values({unknown.key: value + s})), given)[0]
            for s in (step, -step)
        )
        slope = (ahead - back) / (2 * step) * unknown.parameter.scale
        np.testing.assert_allclose(moves[:, :, k], slope, atol=1e-6 * np.abs(slope).max())


@pytest.mark.slow
def test_base_targets_tell_a_base_from_joint_1(tmp_path):
    robot = tmp_path / "rigid.yaml"
    text = ROBOT.path.read_text()
    robot.write_text(text[: text.index("effects:")] + "effects: []\n")
    with_base = diagnose_robot(DiagnoseRequest((loaded(tmp_path),), str(robot)))
    assert {n.effect for n in with_base.diagnosis.verdict.named} == {"base_compliance"}
    assert with_base.diagnosis.verdict.word in ("named", "partly_named")
    without = diagnose_robot(DiagnoseRequest((loaded(tmp_path, moves=False),), str(robot)))
    assert "base_compliance" not in {n.effect for n in without.diagnosis.verdict.named}


def test_base_target_that_stays_is_no_lost_beam(tmp_path):
    path = loaded(tmp_path, moves=False)
    lines = path.read_text().splitlines()
    lines = [",".join([*line.split(",")[:-3], "0,0,0"]) if ",B2," in line else line for line in lines]
    path.write_text("\n".join(lines) + "\n")
    readings = read_measurements(path, JOINTS)
    assert len(readings) == 80
    assert not any(finding.code == "MEA011" for finding in readings.findings)


WRONG = {
    "a place of two numbers": ("# base_target B1: 1 2", "2 numbers"),
    "both": ("# base_target M1: 1 2 3\n# target M1: 1 2 3", "both a target and a base_target"),
    "no name": ("# base_target: 1 2 3", "name of the target is missing"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_base_target_is_refused(tmp_path, case):
    head, words = WRONG[case]
    path = absolute(tmp_path / "a.csv", 3, [], head.split("\n"))
    with pytest.raises(Refusal) as refusal:
        read_measurements(path, JOINTS)
    assert words in refusal.value.findings[0].message


def test_mounting_must_agree_between_files(tmp_path):
    one = read_measurements(absolute(tmp_path / "a.csv", 4, ["B1"], stated(["B1"])), JOINTS)
    other = read_measurements(absolute(tmp_path / "b.csv", 4, ["B1"], seed=2), JOINTS)
    with pytest.raises(Refusal) as refusal:
        joined([one, other])
    assert "mounting of target B1" in refusal.value.findings[0].message


def test_base_targets_and_extra_columns_are_written_and_read_back(tmp_path):
    path = absolute(tmp_path / "a.csv", 4, ["B1", "B2"], [*stated(["B1"]), "# base_target B2:"])
    lines = path.read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if not line.startswith("#"))
    lines = [
        line + ("" if k < head else ",OPERATOR" if k == head else f',"a;{k}"') for k, line in enumerate(lines)
    ]
    path.write_text("\n".join(lines) + "\n")
    readings = read_measurements(path, JOINTS)
    assert any(f.code == "MEA010" and "operator" in f.message for f in readings.findings)
    again = tmp_path / "again.csv"
    again.write_bytes(measurements_csv(readings))
    there = read_measurements(again, JOINTS)
    assert there.on_base == {"B1", "B2"}
    assert list(there.places) == ["B1"]
    assert there.extras == readings.extras
    assert there.extras["operator"][0] == f"a;{head + 1}"
    heads = [*stated(["B1"]), "# base_target B2:"]
    both = joined(
        [readings, read_measurements(absolute(tmp_path / "c.csv", 4, ["B1", "B2"], heads, 5), JOINTS)]
    )
    assert both.extras["operator"][-1] == ""
    assert len(both.extras["operator"]) == len(both)


def test_extra_column_stays_in_the_residuals(tmp_path):
    path = absolute(tmp_path / "a.csv", 20, [])
    lines = path.read_text().splitlines()
    path.write_text(
        "\n".join(
            f"{line}{'' if line[0] == '#' else ',WEATHER' if 'TARGET' in line else f',rain {k}'}"
            for k, line in enumerate(lines)
        )
        + "\n"
    )
    out = tmp_path / "residuals.csv"
    diagnose_robot(DiagnoseRequest((path,), csv=out))
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["weather"] for row in rows] == [f"rain {k + 3}" for k in range(20)]


@pytest.mark.slow
def test_each_file_to_validate_with_has_its_figures(tmp_path):
    data = absolute(tmp_path / "a.csv", 25, [])
    good, bad = absolute(tmp_path / "b.csv", 8, [], seed=6), absolute(tmp_path / "c.csv", 8, [], seed=7)
    text = bad.read_text().splitlines()
    # one target too high by 2 mm in every second row of the second file
    rows = [k for k, line in enumerate(text) if line[0] not in "#A"]
    for k in rows[::2]:
        cells = text[k].split(",")
        text[k] = ",".join([*cells[:-1], f"{float(cells[-1]) + 2.0:.6f}"])
    bad.write_text("\n".join(text) + "\n")
    request = IdentifyRequest((data,), effects=("joint_offset",), validate=(good, bad), bootstrap=0)
    files = identify(request).as_json()["validation"]["files"]
    assert [file["file"] for file in files] == [str(good), str(bad)]
    assert [file["readings"] for file in files] == [8, 8]
    assert files[0]["after_rms_mm"] < 0.2 < 0.5 < files[1]["after_rms_mm"]
    told = json.loads(json.dumps(diagnose_robot(DiagnoseRequest((data,), validate=(good, bad))).as_json()))
    assert [one["file"] for one in told["validation"]] == [str(good), str(bad)]
