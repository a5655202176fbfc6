"""Arms with joints that have no motor (a parallelogram, a geared joint) and with more than seven joints: their
kinematics and statics against MuJoCo, and what a diagnosis makes of their readings."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from postproc.base.findings import Refusal
from postproc.base.geometry import Poses
from postproc.effects import EFFECTS
from postproc.model import StiffnessModel
from postproc.robot.description import check_programmable, load_robot
from postproc.workflows.diagnose import DiagnoseRequest, diagnose_robot

TOOL = Poses(np.eye(3), np.array([0.05, 0.0, 0.12]))

# a palletizer: the forearm keeps its inclination when A2 moves, the flange stays level
PALLETIZER = """\
name: palletizer
maker_name: Palletizer
geometry:
  source: test
  mdh:
    unit: mm
    angle_unit: deg
    rows:
      - {a: 0, alpha: 0, d: 800}
      - {a: 300, alpha: -90, d: 0}
      - {a: 1200, alpha: 0, d: 0}
      - {a: 0, alpha: 0, d: 0}
      - {a: 1100, alpha: 0, d: 0}
      - {a: 200, alpha: -90, d: 0}
joints:
  source: test
  unit: deg
  A1: [-170, 170]
  A2: {limits: [-140, 0], offset: 0}
  P1: {follows: {A2: -1}}
  A3: {limits: [-40, 100], sign: -1, offset: 10}
  P2: {follows: {A3: 1}, offset: 80}
  A4: [-180, 180]
effects:
  - effect: joint_compliance
    parameters:
      c1: {value: 4e-7, unit: rad/(N m), source: test}
      c2: {value: 3e-7, unit: rad/(N m), source: test}
      c3: {value: 5e-7, unit: rad/(N m), source: test}
      c4: {value: 2e-6, unit: rad/(N m), source: test}
"""
COMPLIANCE = np.array([4e-7, 3e-7, 5e-7, 2e-6])

MDH = np.array(
    [(0, 0, 0.8), (0.3, -90, 0), (1.2, 0, 0), (0, 0, 0), (1.1, 0, 0), (0.2, -90, 0)], float
)  # a, alpha, d of the rows above


def of_geometry(values):
    """(N, 6) [rad] angles of the table from what the controller counts (N, 4): written out by hand."""
    a1, a2, a3, a4 = values.T
    third = np.radians(10) - a3
    return np.stack([a1, a2, -a2, third, a3 + np.radians(80), a4], axis=1)


def chain_of(rows, tip):
    """MuJoCo's model of modified Denavit-Hartenberg rows (a [m], alpha [deg], d [m]), a hinge each."""
    bodies, closing = "", ""
    for i, (a, alpha, d) in enumerate(rows):
        turn = Rotation.from_euler("x", alpha, degrees=True)
        place = np.array([a, 0.0, 0.0]) + turn.apply([0.0, 0.0, d])
        x, y, z, w = turn.as_quat()
        bodies += (
            f'<body pos="{place[0]} {place[1]} {place[2]}" quat="{w} {x} {y} {z}">'
            f'<joint name="j{i}" type="hinge" axis="0 0 1"/><geom size="0.01" mass="1"/>'
        )
        closing += "</body>"
    bodies += f'<site name="tip" pos="{tip[0]} {tip[1]} {tip[2]}"/>'
    return mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{bodies}{closing}</worldbody></mujoco>")


def tips(model, angles):
    """(N, 3) [m] the tip at joint ``angles`` (N, n) [rad], by MuJoCo."""
    data = mujoco.MjData(model)
    places = []
    for row in angles:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        places.append(data.site("tip").xpos.copy())
    return np.array(places)


@pytest.fixture(scope="module")
def palletizer(tmp_path_factory):
    path = tmp_path_factory.mktemp("arm") / "palletizer.yaml"
    path.write_text(PALLETIZER)
    return load_robot(path)


def poses_of(robot, count, seed):
    low, high = robot.limits.T
    return low + np.random.default_rng(seed).random((count, len(low))) * (high - low)


def test_joints_without_a_motor_are_no_joints_of_the_program(palletizer):
    assert [joint.name for joint in palletizer.joints] == ["A1", "A2", "A3", "A4"]
    with pytest.raises(Refusal):
        check_programmable(palletizer)


def test_linkage_places_the_tool_as_mujoco_does(palletizer):
    q = poses_of(palletizer, 40, 1)
    ours = (StiffnessModel.from_robot(palletizer).chain.flange(q) @ TOOL).position
    there = tips(chain_of(MDH, TOOL.position), of_geometry(q))
    np.testing.assert_allclose(ours, there, atol=1e-12)


def test_jacobian_of_a_linkage_is_the_derivative_of_mujoco(palletizer):
    q = poses_of(palletizer, 10, 2)
    chain = StiffnessModel.from_robot(palletizer).chain
    columns = chain.jacobian(q, TOOL)[:, :3, chain.motor_rows]
    there = np.moveaxis(slopes(chain_of(MDH, TOOL.position), q), 0, 2)
    np.testing.assert_allclose(columns, there, atol=1e-8)


def slopes(model, q, step=1e-6):
    """(4, N, 3) [m/rad] what each motor moves the tip by, by differences of MuJoCo."""
    lines = []
    for k in range(4):
        move = step * np.eye(4)[k]
        lines.append((tips(model, of_geometry(q + move)) - tips(model, of_geometry(q - move))) / (2 * step))
    return np.array(lines)


def test_loaded_linkage_rests_where_its_gears_balance_the_virtual_work(palletizer):
    """The rods are rigid: only the four gears are elastic, and what pushes the forearm pushes the gears."""
    q = poses_of(palletizer, 5, 3)
    force = np.random.default_rng(4).uniform(-4000, 4000, (5, 3))
    wrench = np.column_stack([force, np.zeros((5, 3))])
    ours = StiffnessModel.from_robot(palletizer).equilibrium(q, wrench, TOOL)
    assert ours.converged.all()
    model, theta = chain_of(MDH, TOOL.position), np.zeros((5, 4))
    for _ in range(12):
        theta = COMPLIANCE * np.einsum("knx,nx->nk", slopes(model, q + theta), force)
    assert np.abs(theta).max() > 1e-3
    np.testing.assert_allclose(ours.pose.position, tips(model, of_geometry(q + theta)), atol=1e-9)


def test_weight_of_a_linkage_loads_the_joints_that_hold_it(palletizer):
    """The moment on a gear is the derivative of the potential energy, here of a weight at the tool."""
    model = StiffnessModel.from_robot(palletizer).with_effect(EFFECTS["payload"](palletizer.joints))
    term = len(model.terms) - 1
    names = [p.name for p in model.terms[term].effect.parameters]
    model = model.with_values({(term, "mass"): 100.0} | {(term, n): 0.0 for n in names if n != "mass"})
    q = poses_of(palletizer, 6, 5)
    state = model.state(q, np.zeros((6, 6)), TOOL)
    force, _ = model.forces(state)
    lift = slopes(chain_of(MDH, np.zeros(3)), q)[:, :, 2]
    np.testing.assert_allclose(force[model.chain.motor_rows], -100.0 * 9.80665 * lift, atol=1e-3)


URDF = """\
<robot name="geared">
  <link name="l0"/><link name="l1"/><link name="l2"/><link name="l3"/><link name="tip"/>
  <joint name="lift" type="revolute"><origin xyz="0 0 0.5"/>
    <parent link="l0"/><child link="l1"/><axis xyz="0 1 0"/></joint>
  <joint name="gear" type="revolute"><origin xyz="0.4 0 0"/>
    <parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
    <mimic joint="lift" multiplier="-2" offset="0.3"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0.3 0 0"/>
    <parent link="l2"/><child link="l3"/><axis xyz="1 0 0"/></joint>
  <joint name="end" type="fixed"><origin xyz="0.1 0 0"/>
    <parent link="l3"/><child link="tip"/></joint>
</robot>
"""


def test_mimic_of_a_urdf_counts_as_its_controller_does(tmp_path):
    (tmp_path / "arm.urdf").write_text(URDF)
    path = tmp_path / "arm.yaml"
    path.write_text(
        "name: geared\nmaker_name: g\ngeometry: {source: t, urdf: {file: arm.urdf}}\njoints:\n  source: t\n"
        "  unit: deg\n  A1: {limits: [-90, 90], sign: -1, offset: 20}\n"
        "  A2: {kind: prismatic, unit: mm, limits: [0, 400]}\neffects: []\n"
    )
    robot = load_robot(path)
    q = np.array([[np.radians(-35.0), 0.17]])
    lift = np.radians(35.0 + 20.0)
    gear = 0.3 - 2 * lift
    # in the plane x, z a turn about y goes from z to x
    x = 0.4 * np.cos(lift) + (0.3 + 0.17 + 0.1) * np.cos(lift + gear)
    z = 0.5 - 0.4 * np.sin(lift) - (0.3 + 0.17 + 0.1) * np.sin(lift + gear)
    place = StiffnessModel.from_robot(robot).chain.flange(q).position[0]
    np.testing.assert_allclose(place, [x, 0.0, z], atol=1e-12)


WRONG = {
    "a leader that is none": ("{A2: -1}", "{A9: -1}", "'A9' is no joint"),
    "a leader without a motor": ("{A3: 1}", "{P1: 1}", "'P1' is no joint"),
    "nothing to follow": ("{A2: -1}", "{}", "names no joint"),
    "limits of what has no motor": ("{follows: {A2: -1}}", "{follows: {A2: -1}, limits: [0, 1]}", "limits"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_linkage_is_refused(tmp_path, case):
    old, new, words = WRONG[case]
    path = tmp_path / "arm.yaml"
    path.write_text(PALLETIZER.replace(old, new, 1))
    with pytest.raises(Refusal) as refusal:
        load_robot(path)
    finding = refusal.value.findings[0]
    assert words in f"{finding.message} {finding.help}"
    assert finding.line > 0


def csv_of(path: Path, names, q, places, robot):
    """Readings of a tracker, in its own frame, of one target whose place is not stated."""
    frame = Rotation.from_euler("zyx", [40, 5, -3], degrees=True)
    seen = frame.apply(places) + np.array([2.0, -1.0, 0.4])
    seen = 1e3 * (seen + np.random.default_rng(7).normal(0, 2e-5, seen.shape))
    lines = [f"# robot: {robot}", "# sigma_mm: 0.02", ",".join([*names, "X", "Y", "Z"])]
    rows = np.column_stack([np.degrees(q), seen])
    path.write_text("\n".join([*lines, *(",".join(f"{v:.6f}" for v in row) for row in rows)]) + "\n")


@pytest.mark.slow
def test_wrong_zero_of_a_linkage_is_found(tmp_path, palletizer):
    """Made by MuJoCo with A2 off by 1.5 mrad, which the linkage hands on to the forearm.  A target by itself shows A2
    up to a turn about A1 only where something keeps its direction: the linkage does."""
    q = poses_of(palletizer, 60, 8)
    off = q + np.array([0.0, 1.5e-3, 0.0, 0.0])
    places = tips(chain_of(MDH, TOOL.position), of_geometry(off))
    data, robot = tmp_path / "loads.csv", tmp_path / "palletizer.yaml"
    robot.write_text(PALLETIZER)
    csv_of(data, ["A1", "A2", "A3", "A4"], q, places, robot)
    done = diagnose_robot(DiagnoseRequest((data,), str(robot)))
    after = np.sqrt(3 * np.nanmean(done.held_out_after**2))
    before = np.sqrt(3 * np.nanmean(done.held_out_before**2))
    assert before > 4e-4
    assert after < 5e-5
    told = {n.effect for n in done.diagnosis.verdict.named}
    told |= {c.name for one in done.diagnosis.verdict.alternatives for c in one}
    assert "joint_offset" in told


@pytest.mark.slow
def test_arm_of_nine_joints_is_diagnosed(tmp_path):
    rng = np.random.default_rng(11)
    rows = [(0.0, 0.0, 0.4)] + [(0.3 - 0.02 * k, 90.0 * (-1) ** k, 0.1) for k in range(8)]
    text = "".join(f"      - {{a: {a}, alpha: {alpha}, d: {d}}}\n" for a, alpha, d in rows)
    joints = "".join(f"  J{k}: [-110, 110]\n" for k in range(1, 10))
    robot = tmp_path / "nine.yaml"
    robot.write_text(
        "name: nine\nmaker_name: n\ngeometry:\n  source: t\n  mdh:\n    unit: m\n    angle_unit: deg\n    rows:\n"
        f"{text}joints:\n  source: t\n  unit: deg\n{joints}effects: []\n"
    )
    q = np.radians(rng.uniform(-110, 110, (70, 9)))
    off = q.copy()
    off[:, 4] += 2e-3 * np.sin(2 * q[:, 4])
    places = tips(chain_of(rows, TOOL.position), off)
    data = tmp_path / "poses.csv"
    csv_of(data, [f"J{k}" for k in range(1, 10)], q, places, robot)
    done = diagnose_robot(DiagnoseRequest((data,), str(robot)))
    assert done.diagnosis.verdict.word == "named"
    (named,) = done.diagnosis.verdict.named
    assert named.effect == "transmission_error"
    assert named.joints == ("J5",)
    found = {e.unknown.parameter.name: e.value for e in named.estimates}
    assert found["s5_2"] == pytest.approx(2e-3, abs=1e-4)
