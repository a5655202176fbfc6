"""Robot files: every kind of geometry, the robots that are shipped, and every mistake with its line.

Forward kinematics are held against products written down here once more, from other descriptions of the same arms
where there are any, and against Pinocchio's own reader.
"""

import math
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reference import reference_flange
from tiers import examples

from postproc.base.findings import Refusal
from postproc.base.geometry import vector_from_rotation
from postproc.model import StiffnessModel
from postproc.robot.axis_track import nominal_flange
from postproc.robot.chain import Chain
from postproc.robot.description import check_programmable, find_robot, load_robot, robot_files
from postproc.robot.geometries import KukaLengths, KukaVariant, SerialArm
from postproc.robot.inverse import branch_of, inverse

DEG = math.pi / 180

# products of elementary transforms, 4 x 4


def turn(axis, angle):
    i, j = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    found = np.eye(4)
    found[i, i] = found[j, j] = math.cos(angle)
    found[j, i], found[i, j] = math.sin(angle), -math.sin(angle)
    return found


def shift(x, y, z):
    found = np.eye(4)
    found[:3, 3] = x, y, z
    return found


def product(*factors):
    found = np.eye(4)
    for factor in factors:
        found = found @ factor
    return found


def standard(rows, q, kinds="rrrrrrr"):
    """rows (a, alpha, d, theta)"""
    found = np.eye(4)
    for (a, alpha, d, theta), value, kind in zip(rows, q, kinds, strict=False):
        angle, way = (theta + value, d) if kind == "r" else (theta, d + value)
        found = product(found, turn("z", angle), shift(0, 0, way), shift(a, 0, 0), turn("x", alpha))
    return found


def modified(rows, q, kinds="rrrrrrr"):
    found = np.eye(4)
    for (a, alpha, d, theta), value, kind in zip(rows, q, kinds, strict=False):
        angle, way = (theta + value, d) if kind == "r" else (theta, d + value)
        found = product(found, turn("x", alpha), shift(a, 0, 0), turn("z", angle), shift(0, 0, way))
    return found


def along_axes(joints, q, tip):
    """joints (xyz, axis) as a URDF has them, all frames parallel at zero."""
    found = np.eye(4)
    for (place, axis), value in zip(joints, q, strict=True):
        sign = -1 if axis[0] == "-" else 1
        found = product(found, shift(*place), turn(axis[-1], sign * value))
    return found @ tip


def agrees(robot, q, expected):
    """The chain, Pinocchio and ``expected(q)`` give one flange."""
    chain = Chain(robot.joints, robot.flange)
    ours, reference = chain.flange(q), reference_flange(chain, q)
    assert np.abs(ours.position - reference.position).max() < 1e-13
    assert np.abs(ours.rotation - reference.rotation).max() < 1e-13
    matrices = np.array([expected(row) for row in q])
    assert np.abs(ours.position - matrices[:, :3, 3]).max() < 1e-12
    assert np.abs(ours.rotation - matrices[:, :3, :3]).max() < 1e-12


def states(robot, count, seed=0):
    low, high = robot.limits.T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


# the robots that are shipped

ROBOTS = sorted(robot_files())


@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_robot_has_a_source_for_every_figure(name):
    robot = load_robot(find_robot(name))
    assert robot.name == name
    assert robot.maker_name
    assert len(robot.geometry_source) > 20
    assert len(robot.limits_source) > 20
    model = StiffnessModel.from_robot(robot)
    for term in model.terms:
        assert all(len(value.source) > 10 for value in term.stated.values())
    assert all(mechanism.source for mechanism in robot.mechanisms)
    if not model.terms:
        assert "Geometry alone" in robot.about


@pytest.mark.parametrize("name", ROBOTS)
def test_shipped_robot_goes_there_and_back(name):
    """IK(FK(q)) leads to the same pose within 1 nm and 1 nrad, and to the same axes off the singular places."""
    robot = load_robot(find_robot(name))
    q = states(robot, 3000)
    pose = nominal_flange(robot, q)
    near = q + np.random.default_rng(1).uniform(-0.03, 0.03, q.shape)
    found = inverse(robot.nominal, pose, branch_of(robot.nominal, q), near)
    assert found.reachable.all()
    back = nominal_flange(robot, found.q)
    assert np.abs(back.position - pose.position).max() < 1e-9
    turned = vector_from_rotation(back.rotation @ np.swapaxes(pose.rotation, 1, 2))
    assert np.abs(turned).max() < 1e-9
    assert np.median(np.abs(found.q - q).max(axis=1)) < 1e-11
    assert np.mean(np.abs(found.q - q).max(axis=1) < 1e-8) > 0.95


def test_kr500_is_the_published_table():
    """Modified DH with signs -1, 1, 1, -1, 1, -1, all at zero: 3115, 0, 990 mm, as published."""
    rows = [
        (0, 0, 1.045, 0),
        (0.5, -math.pi / 2, 0, 0),
        (1.3, 0, 0, -math.pi / 2),
        (-0.055, -math.pi / 2, 1.025, 0),
        (0, math.pi / 2, 0, 0),
        (0, -math.pi / 2, 0.29, math.pi),
    ]
    signs = np.array([-1, 1, 1, -1, 1, -1])
    robot = load_robot(find_robot("kuka_kr500"))
    agrees(robot, states(robot, 100), lambda q: modified(rows, signs * q))
    at_zero = nominal_flange(robot, np.zeros((1, 6)))
    assert at_zero.position[0] == pytest.approx([3.115, 0, 0.990], abs=1e-12)
    # the reach in its name, to the wrist
    assert 0.5 + 1.3 + math.hypot(1.025, 0.055) == pytest.approx(2.826, abs=1e-3)


def test_kr500_compliances_are_the_stiffnesses_of_the_source():
    model = StiffnessModel.from_robot(load_robot(find_robot("kuka_kr500")))
    (term,) = model.terms
    stiffness = 1 / np.array([term.values[f"c{i}"] for i in range(1, 7)])
    assert stiffness == pytest.approx([2.3e6, 8.6e6, 2.8e6, 3.0e6, 0.2e6, 0.9e6], rel=2e-4)
    assert all(value.interval is None for value in term.stated.values())


def test_ur5_is_that_of_the_other_description():
    """ur_description's default_kinematics.yaml: xyz and roll, pitch, yaw of every joint, turning about z."""
    frames = [
        ((0, 0, 0.089159), (0, 0, 0)),
        ((0, 0, 0), (math.pi / 2, 0, 0)),
        ((-0.425, 0, 0), (0, 0, 0)),
        ((-0.39225, 0, 0.10915), (0, 0, 0)),
        ((0, -0.09465, 0), (math.pi / 2, 0, 0)),
        ((0, 0.0823, 0), (math.pi / 2, math.pi, math.pi)),
    ]

    def there(q):
        found = np.eye(4)
        for (place, (roll, pitch, yaw)), value in zip(frames, q, strict=True):
            about = product(turn("z", yaw), turn("y", pitch), turn("x", roll))
            found = product(found, shift(*place), about, turn("z", value))
        return found

    robot = load_robot(find_robot("ur5"))
    agrees(robot, states(robot, 100), there)
    assert nominal_flange(robot, np.zeros((1, 6))).position[0] == pytest.approx(
        [-0.81725, -0.19145, -0.005491], abs=1e-12
    )


def test_irb120_is_that_of_the_other_description():
    joints = [
        ((0, 0, 0), "z"),
        ((0, 0, 0.29), "y"),
        ((0, 0, 0.27), "y"),
        ((0, 0, 0.07), "x"),
        ((0.302, 0, 0), "y"),
        ((0.072, 0, 0), "x"),
    ]
    robot = load_robot(find_robot("abb_irb120"))
    agrees(robot, states(robot, 100), lambda q: along_axes(joints, q, turn("y", math.pi / 2)))
    at_zero = nominal_flange(robot, np.zeros((1, 6)))
    assert at_zero.position[0] == pytest.approx([0.374, 0, 0.630], abs=1e-12)


def test_irb120_is_inverted_within_its_limits():
    """Upper arm far back: the closed form's angle is past half a turn there, the controller's is not."""
    robot = load_robot(find_robot("abb_irb120"))
    q = np.radians([[20.0, -105, -100, 30, 40, 50], [20, 105, 60, -30, -40, 300]])
    found = inverse(robot.nominal, nominal_flange(robot, q), branch_of(robot.nominal, q), q)
    assert np.abs(found.q - q).max() < 1e-10


def test_tx2_90l_is_that_of_the_other_description():
    joints = [
        ((0, 0, 0.478), "z"),
        ((0.05, 0, 0), "y"),
        ((0, 0.05, 0.5), "y"),
        ((0, 0, 0), "z"),
        ((0, 0, 0.55), "y"),
        ((0, 0, 0.1), "z"),
    ]
    robot = load_robot(find_robot("staubli_tx2_90l"))
    agrees(robot, states(robot, 100), lambda q: along_axes(joints, q, np.eye(4)))


# kinds of geometry

DH = """\
name: arm
geometry:
  source: made up
  dh:
    unit: mm
    angle_unit: deg
    rows:
      - {a: 50, alpha: -90, d: 400, theta: 0}
      - {a: 500, alpha: 0, d: 30, theta: -90}
      - {a: 20, alpha: 90, d: 0, theta: 90}
      - {a: 0, alpha: -90, d: 550}
      - {a: 0, alpha: 90, d: 0}
      - {a: 0, alpha: 0, d: 100}
joints:
  source: made up
  unit: deg
  J1: [-180, 180]
  J2: [-130, 140]
  J3: [-145, 145]
  J4: [-270, 270]
  J5: [-115, 140]
  J6: [-270, 270]
"""
ROWS = [
    (0.05, -math.pi / 2, 0.4, 0),
    (0.5, 0, 0.03, -math.pi / 2),
    (0.02, math.pi / 2, 0, math.pi / 2),
    (0, -math.pi / 2, 0.55, 0),
    (0, math.pi / 2, 0, 0),
    (0, 0, 0.1, 0),
]

KUKA = """\
name: arm
geometry:
  source: made up
  kuka: {unit: mm, d1: 700, a1: 300, a2: 1200, a3: -40, d4: 1000, d6: 200}
joints:
  source: made up
  unit: deg
  A1: [-185, 185]
  A2: [-146, 0]
  A3: [-119, 155]
  A4: [-350, 350]
  A5: [-125, 125]
  A6: [-350, 350]
"""

URDF = """\
<?xml version="1.0"?>
<robot name="arm">
  <link name="world"/>
  <link name="base_link">
    <visual><geometry><mesh filename="package://nowhere/base.stl"/></geometry></visual>
  </link>
  <joint name="stand" type="fixed">
    <parent link="world"/><child link="base_link"/><origin xyz="0.1 0.2 0.3" rpy="0 0 0.5"/>
  </joint>
  <joint name="pan" type="continuous">
    <parent link="base_link"/><child link="l1"/><origin xyz="0 0 0.4"/><axis xyz="0 0 1"/>
  </joint>
  <link name="l1"/>
  <joint name="lift" type="revolute">
    <parent link="l1"/><child link="l2"/><origin xyz="0.05 0.03 0" rpy="0.1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="l2"/>
  <joint name="elbow" type="revolute">
    <parent link="l2"/><child link="l3"/><origin xyz="0 0 0.5"/><axis xyz="0 0.6 0.8"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="l3"/>
  <joint name="plate" type="fixed">
    <parent link="l3"/><child link="l3b"/><origin xyz="0.02 0 0.01" rpy="0 0.2 0"/>
  </joint>
  <link name="l3b"/>
  <joint name="w1" type="revolute">
    <parent link="l3b"/><child link="l4"/><origin xyz="0.3 0 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="l4"/>
  <joint name="w2" type="revolute">
    <parent link="l4"/><child link="l5"/><origin xyz="0.1 0 0"/><axis xyz="0 -1 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="l5"/>
  <joint name="w3" type="revolute">
    <parent link="l5"/><child link="l6"/><origin xyz="0.08 0 0" rpy="0 1.5707963267948966 0"/><axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <link name="l6"/>
  <joint name="end" type="fixed"><parent link="l6"/><child link="tool0"/><origin xyz="0 0 0.07" rpy="0 0 0.3"/></joint>
  <link name="tool0"/>
</robot>
"""
BY_URDF = DH[: DH.index("  dh:")] + "  urdf: {file: arm.urdf}\n" + DH[DH.index("joints:") :]


def write(folder, text, urdf=None):
    path = folder / "arm.yaml"
    path.write_text(text, encoding="utf-8")
    if urdf is not None:
        (folder / "arm.urdf").write_text(urdf, encoding="utf-8")
    return path


def test_standard_dh(tmp_path):
    robot = load_robot(write(tmp_path, DH))
    agrees(robot, states(robot, 60), lambda q: standard(ROWS, q))
    assert isinstance(robot.arm, SerialArm)
    assert robot.nominal is robot.arm
    assert [joint.name for joint in robot.joints] == ["J1", "J2", "J3", "J4", "J5", "J6"]
    assert robot.programmed.tolist() == [0, 1, 2, 3, 4, 5]


def test_modified_dh(tmp_path):
    robot = load_robot(write(tmp_path, DH.replace("dh:", "mdh:")))
    agrees(robot, states(robot, 60), lambda q: modified(ROWS, q))


def test_dh_in_metres_and_radians(tmp_path):
    text = DH.replace("unit: mm", "unit: m").replace("angle_unit: deg", "angle_unit: rad")
    for (a, alpha, d, theta), line in zip(
        ROWS, [line for line in DH.splitlines() if "alpha" in line], strict=True
    ):
        text = text.replace(line, f"      - {{a: {a}, alpha: {alpha!r}, d: {d}, theta: {theta!r}}}")
    robot = load_robot(write(tmp_path, text))
    agrees(robot, states(robot, 20), lambda q: standard(ROWS, q))


def test_base_and_flange_frames(tmp_path):
    frames = (
        "  base: {unit: mm, angle_unit: deg, x: 100, z: 20, a: 30, b: 10}\n"
        "  flange: {unit: m, angle_unit: rad, y: 0.05, c: 0.5}\n"
    )
    robot = load_robot(write(tmp_path, DH.replace("  dh:", frames + "  dh:")))
    base = product(shift(0.1, 0, 0.02), turn("z", 30 * DEG), turn("y", 10 * DEG))
    flange = product(shift(0, 0.05, 0), turn("x", 0.5))
    agrees(robot, states(robot, 20), lambda q: product(base, standard(ROWS, q), flange))


SIGNED = (
    DH.replace("J2: [-130, 140]", "J2: {limits: [-100, 120], sign: -1, offset: 15}")
    .replace("J4: [-270, 270]", "J4: {limits: [-3, 3], unit: rad, offset: 0.25}")
    .replace("J6: [-270, 270]", "J6: {limits: [-270, 270], sign: -1}")
)


@pytest.mark.parametrize("kind", ["dh", "mdh"])
def test_controllers_senses_and_offsets(tmp_path, kind):
    """sign * value + offset is the angle of the geometry."""
    robot = load_robot(write(tmp_path, SIGNED.replace("dh:", f"{kind}:")))
    signs, offsets = np.array([1, -1, 1, 1, 1, -1]), np.array([0, 15 * DEG, 0, 0.25, 0, 0])
    table = standard if kind == "dh" else modified
    agrees(robot, states(robot, 60), lambda q: table(ROWS, signs * q + offsets))
    assert robot.limits[1] == pytest.approx([-100 * DEG, 120 * DEG])
    assert robot.limits[3] == pytest.approx([-3, 3])


def test_controllers_senses_of_a_kuka_type_arm(tmp_path):
    text = KUKA.replace("A1: [-185, 185]", "A1: {limits: [-185, 185], sign: -1}")
    text = text.replace("A2: [-146, 0]", "A2: {limits: [-56, 90], offset: -90}")
    text = text.replace("A6: [-350, 350]", "A6: {limits: [-350, 350], sign: -1, offset: 20}")
    robot = load_robot(write(tmp_path, text))
    plain = load_robot(write(tmp_path, KUKA))
    assert isinstance(plain.arm, KukaLengths)
    assert isinstance(robot.arm, KukaVariant)
    q = states(robot, 500)
    angles = np.array([-1, 1, 1, 1, 1, -1]) * q + np.array([0, -90, 0, 0, 0, 20]) * DEG
    ours, theirs = nominal_flange(robot, q), nominal_flange(plain, angles)
    assert np.abs(ours.position - theirs.position).max() < 1e-13
    assert np.abs(ours.rotation - theirs.rotation).max() < 1e-13
    assert np.array_equal(branch_of(robot.nominal, q), branch_of(plain.nominal, angles))
    found = inverse(robot.nominal, ours, branch_of(robot.nominal, q), q)
    clear = np.abs(np.sin(q[:, 4])) > 0.01
    assert np.abs(found.q - q)[clear].max() < 1e-9


ON_RAIL = KUKA.replace("  kuka:", "  rail: -y\n  kuka:").replace(
    "  A1:", "  E1: {kind: prismatic, limits: [0, 4000], unit: mm, offset: 250}\n  A1:"
)


def test_kuka_on_a_linear_axis(tmp_path):
    robot = load_robot(write(tmp_path, ON_RAIL))
    plain = load_robot(write(tmp_path, KUKA))
    assert robot.joints[0].kind == "prismatic"
    assert robot.limits[0] == pytest.approx([0, 4])
    assert robot.external == 0
    assert robot.programmed.tolist() == [1, 2, 3, 4, 5, 6]
    q = states(robot, 300)
    there = nominal_flange(plain, q[:, 1:])
    ours = nominal_flange(robot, q)
    assert np.abs(ours.rotation - there.rotation).max() < 1e-13
    moved = there.position - np.outer(q[:, 0] + 0.25, [0, 1, 0])
    assert np.abs(ours.position - moved).max() < 1e-13
    chain = Chain(robot.joints, robot.flange)
    assert np.abs(reference_flange(chain, q).position - ours.position).max() < 1e-13
    found = inverse(robot.nominal, ours, branch_of(robot.nominal, q), q)
    clear = np.abs(np.sin(q[:, 5])) > 0.01
    assert np.array_equal(found.q[:, 0], q[:, 0])
    assert np.abs(found.q - q)[clear].max() < 1e-9


def test_prismatic_rows(tmp_path):
    text = DH.replace("{a: 50, alpha: -90, d: 400, theta: 0}", "{a: 50, alpha: -90, d: 400, theta: 10}")
    text = text.replace("J1: [-180, 180]", "J1: {kind: prismatic, limits: [-2, 3], unit: m, sign: -1}")
    robot = load_robot(write(tmp_path, text))
    rows = [(*ROWS[0][:3], 10 * DEG), *ROWS[1:]]
    signs = np.array([-1, 1, 1, 1, 1, 1])
    agrees(robot, states(robot, 60), lambda q: standard(rows, signs * q, "prrrrr"))
    robot = load_robot(write(tmp_path, text.replace("dh:", "mdh:")))
    agrees(robot, states(robot, 60), lambda q: modified(rows, signs * q, "prrrrr"))


lengths = st.integers(-800, 800)
angles = st.sampled_from([-90, 0, 90, 180, 37, -12])
table = st.lists(st.tuples(lengths, angles, lengths, angles), min_size=6, max_size=7)


@settings(max_examples=examples(40), deadline=None)
@given(
    table, st.lists(st.sampled_from([-1, 1]), min_size=7, max_size=7), st.booleans(), st.integers(0, 2**31)
)
def test_any_table(tmp_path_factory, rows, signs, craig, seed):
    lines = [f"      - {{a: {a}, alpha: {al}, d: {d}, theta: {th}}}" for a, al, d, th in rows]
    joints = [f"  J{i + 1}: {{limits: [-170, 170], sign: {signs[i]}}}" for i in range(len(rows))]
    if len(rows) == 7:
        joints.insert(0, "  external: J3")
    head = "name: arm\ngeometry:\n  source: made up\n  {}:\n    unit: mm\n    angle_unit: deg\n    rows:\n"
    text = "\n".join(
        [
            head.format("mdh" if craig else "dh") + "\n".join(lines),
            "joints:\n  source: s\n  unit: deg",
            *joints,
        ]
    )
    robot = load_robot(write(tmp_path_factory.mktemp("arm"), text + "\n"))
    expected = [(a * 1e-3, al * DEG, d * 1e-3, th * DEG) for a, al, d, th in rows]
    signed = np.array(signs[: len(rows)])
    agrees(robot, states(robot, 5, seed), lambda q: (modified if craig else standard)(expected, signed * q))


# URDF


def of_pinocchio(text, tip, q):
    model = pin.buildModelFromXML(text)
    data = model.createData()
    frame = model.getFrameId(tip)
    found = []
    for row in q:
        # a continuous joint is a point on the circle there
        configuration = np.concatenate([[math.cos(row[0]), math.sin(row[0])], row[1:]])
        pin.framesForwardKinematics(model, data, configuration)
        found.append(data.oMf[frame].homogeneous)
    return np.array(found)


def test_urdf_is_pinocchios(tmp_path):
    robot = load_robot(write(tmp_path, BY_URDF, URDF))
    q = states(robot, 60)
    expected = of_pinocchio(URDF, "tool0", q)
    rows = iter(expected)
    agrees(robot, q, lambda _: next(rows))
    assert robot.arm.kind == "urdf"


def test_urdf_between_named_links(tmp_path):
    text = BY_URDF.replace("{file: arm.urdf}", "{file: arm.urdf, base: base_link, tip: l6}")
    gripper = (
        '<link name="jaw"/><joint name="grip" type="prismatic"><parent link="l6"/><child link="jaw"/></joint>'
    )
    robot = load_robot(write(tmp_path, text, URDF.replace("</robot>", gripper + "</robot>")))
    q = states(robot, 20)
    stand = product(shift(0.1, 0.2, 0.3), turn("z", 0.5))
    expected = np.linalg.inv(stand) @ of_pinocchio(URDF, "l6", q)
    rows = iter(expected)
    agrees(robot, q, lambda _: next(rows))


def test_urdf_with_a_flange_of_its_own(tmp_path):
    text = BY_URDF.replace("  urdf:", "  flange: {unit: mm, angle_unit: deg, x: 30, c: 40}\n  urdf:")
    robot = load_robot(write(tmp_path, text, URDF))
    q = states(robot, 20)
    rows = iter(of_pinocchio(URDF, "tool0", q) @ product(shift(0.03, 0, 0), turn("x", 40 * DEG)))
    agrees(robot, q, lambda _: next(rows))


def test_axis_of_any_length(tmp_path):
    one = load_robot(write(tmp_path, BY_URDF, URDF))
    other = load_robot(write(tmp_path, BY_URDF, URDF.replace('"0 0.6 0.8"', '"0 3 4"')))
    q = states(one, 20)
    assert np.abs(nominal_flange(one, q).position - nominal_flange(other, q).position).max() < 1e-14


def test_digest_is_of_both_files(tmp_path):
    one = load_robot(write(tmp_path, BY_URDF, URDF)).digest
    other = load_robot(write(tmp_path, BY_URDF, URDF.replace("0.08 0 0", "0.09 0 0"))).digest
    assert one != other


# text, words of the message, the line it is told for (text of the wrong file; None: the file as a whole)
URDF_ERRORS = {
    "an encoding that is not supported": (
        '<?xml version="1.0" encoding="UTF-7"?>' + URDF.lstrip().partition("?>")[2],
        "encoding that is not supported",
        None,
    ),
    "an encoding that nobody knows": (
        '<?xml version="1.0" encoding="x-none"?>' + URDF.lstrip().partition("?>")[2],
        "encoding that is not supported",
        None,
    ),
    "not XML": (URDF.replace("</robot>", ""), "not XML", None),
    "not a robot": ("<model/>\n", "<robot> is expected", "<model"),
    "no links": ("<robot name='x'/>\n", "form a circle", None),
    "type": (URDF.replace('"w2" type="revolute"', '"w2" type="floating"'), "joint w2: the type"
    " 'floating'", '"w2" type'),
    "no axis": (URDF.replace('"0 0.6 0.8"', '"0 0 0"'), "has no direction", 'axis xyz="0 0 0"'),
    "not finite": (URDF.replace('"0 0.6 0.8"', '"0 nan 1"'), "is not three numbers", "0 nan 1"),
    "two numbers": (URDF.replace('xyz="0 0 0.5"', 'xyz="0 0.5"'), "is not three numbers", 'xyz="0 0.5"'),
    "no such link": (URDF.replace('<child link="l5"/>', '<child link="l55"/>'), "the link 'l55' is not", '"w2" type'),
    "no parent": (URDF.replace('<parent link="l4"/>', ""), "has no <parent>", '"w2" type'),
    "no name": (URDF.replace('<joint name="w2" ', "<joint "), "has no 'name'", '<joint type="revolute">'),
    "two ends": (
        URDF.replace("</robot>", '<link name="cam"/><joint name="c" type="fixed"><parent link="l1"/>'
                     '<child link="cam"/></joint></robot>'),
        "the joints branch: the URDF has several ends, tool0, cam",
        None,
    ),
    "two roots": (URDF.replace("</robot>", '<link name="table"/></robot>'), "the joints branch", None),
    "two parents": (
        URDF.replace("</robot>", '<joint name="c" type="fixed"><parent link="l1"/><child link="l4"/></joint></robot>'),
        "has two parent joints",
        '<joint name="c"',
    ),
    "mimic": (URDF.replace('<axis xyz="0 0.6 0.8"/>', '<mimic joint="none"/>'), "mimics 'none', which is",
              '"elbow" type'),
    "mimic by nothing": (URDF.replace('<axis xyz="0 0.6 0.8"/>', '<mimic joint="lift" multiplier="x"/>'),
                         "'x' is not a number", "<mimic"),
    "twice": (URDF.replace('name="w3"', 'name="w2"'), "joint 'w2' is defined twice", '<parent link="l5"'),
    "link twice": (URDF.replace('<link name="l6"/>', '<link name="l5"/>'), "is defined twice", '<joint name="end"'),
    "doctype": ("<!DOCTYPE robot [<!ENTITY a 'b'>]>\n" + URDF.split("\n", 1)[1], "DOCTYPE", "<!DOCTYPE"),
    "absent mesh": (URDF.replace("package://nowhere/base.stl", "base.stl"), "mesh 'base.stl' does not exist", "<mesh"),
    "mesh elsewhere": (URDF.replace("package://nowhere/base.stl", "../base.stl"), "outside the URDF's", "<mesh"),
    "only fixed": ('<robot name="x"><link name="a"/><link name="b"/><joint name="c" type="fixed"><parent link="a"/>'
                   '<child link="b"/></joint></robot>', "no joint between base and tip is movable", None),
}  # fmt: skip


@pytest.mark.parametrize("case", URDF_ERRORS)
def test_wrong_urdf_is_told(tmp_path, case):
    text, words, place = URDF_ERRORS[case]
    finding = refused(write(tmp_path, BY_URDF, text))
    assert finding.code == "URD001"
    assert finding.file == str(tmp_path / "arm.urdf")
    assert words in finding.message
    if place is not None:
        line = text[: text.index(place)].count("\n") + 1
        assert finding.line == (line - 1 if case in ("twice", "link twice") else line)


def test_urdf_that_does_not_fit_the_joints_is_told(tmp_path):
    one_less = URDF.replace('name="w1" type="revolute"', 'name="w1" type="fixed"')
    finding = refused(write(tmp_path, BY_URDF, one_less))
    assert "the geometry has 5 joints" in finding.message
    shifting = URDF.replace('name="w1" type="revolute"', 'name="w1" type="prismatic"')
    finding = refused(write(tmp_path, BY_URDF, shifting))
    assert "J4: is revolute, w1 of the URDF is prismatic" in finding.message
    assert finding.line == BY_URDF[: BY_URDF.index("J4:")].count("\n") + 1


def test_xacro_is_told(tmp_path):
    text = URDF.replace('<robot name="arm">', '<robot name="arm" xmlns:xacro="http://x"><xacro:arm/>')
    finding = refused(write(tmp_path, BY_URDF, text))
    assert "expand xacro first" in finding.message


def test_circle_is_told(tmp_path):
    text = BY_URDF.replace("{file: arm.urdf}", "{file: arm.urdf, base: world, tip: l6}")
    ring = URDF.replace('<parent link="l1"/><child link="l2"/>', '<parent link="l5"/><child link="l2"/>')
    assert "circle" in refused(write(tmp_path, text, ring)).message


def test_named_links_that_do_not_fit_are_told(tmp_path):
    for words, told in (
        ("tip: tool1", "the link 'tool1' is not defined"),
        ("base: l6, tip: l2", "is not connected to"),
    ):
        text = BY_URDF.replace("{file: arm.urdf}", f"{{file: arm.urdf, {words}}}")
        assert told in refused(write(tmp_path, text, URDF)).message


def test_mesh_in_its_place_is_no_mistake(tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "base.stl").write_bytes(b"")
    text = URDF.replace("package://nowhere/base.stl", "meshes/base.stl")
    assert len(load_robot(write(tmp_path, BY_URDF, text)).joints) == 6


@pytest.mark.parametrize(
    "part",
    [
        '<joint name="c" type="floating"><parent link="l1"/><child link="cam"/></joint>',
        '<joint name="c" type="fixed"><parent link="l1"/><child link="cam"/><axis xyz="0 0 0"/></joint>',
    ],
)
def test_joints_that_do_not_turn_the_arm_may_be_of_any_kind(tmp_path, part):
    text = BY_URDF.replace("{file: arm.urdf}", "{file: arm.urdf, tip: tool0}")
    arm = load_robot(write(tmp_path, text, URDF.replace("</robot>", f'<link name="cam"/>{part}</robot>')))
    assert len(arm.joints) == 6


def test_the_file_that_the_readme_shows_is_read(tmp_path):
    readme = (Path(__file__).parents[1] / "robots" / "README.md").read_text(encoding="utf-8")
    text = readme.split("```yaml\n", 1)[1].split("```", 1)[0]
    (term,) = StiffnessModel.from_robot(load_robot(write(tmp_path, text))).terms
    assert term.values["c1"] == pytest.approx(3.774e-6, rel=1e-12)
    assert term.values["c2"] == pytest.approx(0.302e-6, rel=1e-12)


def test_urdf_stays_in_its_folder(tmp_path):
    folder = tmp_path / "robots"
    folder.mkdir()
    (tmp_path / "arm.urdf").write_text(URDF, encoding="utf-8")
    (folder / "link.urdf").symlink_to(tmp_path / "arm.urdf")
    for name in ("../arm.urdf", str(tmp_path / "arm.urdf"), "link.urdf"):
        finding = refused(write(folder, BY_URDF.replace("arm.urdf", name)))
        assert finding.code == "YML004"
        assert "folder of the robot file" in finding.message
        assert finding.line == 4
    finding = refused(write(folder, BY_URDF.replace("arm.urdf", "sub/none.urdf")))
    assert "does not exist" in finding.message


# mistakes


def refused(path):
    with pytest.raises(Refusal) as caught:
        load_robot(Path(path))
    assert len(caught.value.findings) == 1
    return caught.value.findings[0]


SEVEN = DH.replace("      - {a: 0, alpha: 0, d: 100}\n", "      - {a: 0, alpha: 90, d: 100}\n" * 2).replace(
    "  J6: [-270, 270]\n", "  J6: [-270, 270]\n  J7: [-100, 100]\n"
)
MASSES = "masses:\n  source: made up\n  unit: kg\n  com_unit: mm\n  J2: {mass: 10, com: [1, 2, 3]}\n"
SPRING = "mechanisms:\n  - name: spring\n    kind: gas spring\n    source: made up\n    joint: J2\n"

# text, what is replaced and by what, code, words, the line it is told for (text of the wrong file)
MISTAKES = {
    "no geometry": (DH, "  dh:", "  dhh:", "YML002", "did you mean 'dh'", "  dhh:"),
    "two geometries": (DH, "  dh:", "  urdf: {file: a}\n  dh:", "YML004", "state only one geometry", "  urdf:"),
    "only a source": (
        DH, DH[DH.index("  dh:") : DH.index("joints:")], "", "YML003", "geometry is missing", "  source:"
    ),
    "no unit of lengths": (DH, "    unit: mm\n", "", "YML003", "'unit' is missing", "    angle_unit"),
    "no unit of angles": (DH, "    angle_unit: deg\n", "", "YML003", "'angle_unit'", "    unit: mm"),
    "length in degrees": (DH, "unit: mm", "unit: deg", "YML005", "these are allowed here: m, mm", "    unit: deg"),
    "angle in mm": (DH, "angle_unit: deg", "angle_unit: mm", "YML005", "these are allowed here: rad,"
    " deg", "    angle_unit"),
    "row without alpha": (DH, "alpha: -90, d: 550", "d: 550", "YML003", "'alpha' is missing", "d: 550}"),
    "row with a slip": (DH, "{a: 0, alpha: -90, d: 550}", "{a: 0, alfa: -90, d: 550}", "YML002", "alpha", "alfa"),
    "row not finite": (DH, "d: 550", "d: .inf", "YML004", "is not a number", ".inf"),
    "row too large": (DH, "d: 550", "d: 1e999", "YML004", "too large", "1e999"),
    "no rows": (DH, DH[DH.index("    rows:") : DH.index("joints:")], "    rows: []\n", "YML003", "no rows",
                "    unit: mm"),
    "too few rows": (DH, "      - {a: 0, alpha: 0, d: 100}\n", "", "YML004", "has 5 joints", "  J6:"),
    "too few joints": (DH, "  J6: [-270, 270]\n", "", "YML003", "1 of the geometry's 6 joints are missing",
                       "  source: made up\n  unit"),
    "joint left out": (DH, "  J3: [-145, 145]\n", "", "YML002", "did you mean 'J3'", "  J4:"),
    "joints swapped": (DH, "  J3: [-145", "  J5: [-145", "YML004", "J5 is defined twice", "  J5: [-115"),
    "no limits": (DH, "J2: [-130, 140]", "J2: {sign: -1}", "YML003", "'limits' is missing", "J2:"),
    "limits reversed": (DH, "J2: [-130, 140]", "J2: [140, -130]", "YML004", "lower limit must be", "J2:"),
    "limits reversed, long form": (DH, "J2: [-130, 140]", "J2: {limits: [140, -130]}", "YML004", "lower", "J2:"),
    "limits equal": (DH, "J2: [-130, 140]", "J2: [140, 140]", "YML004", "lower limit must be", "J2:"),
    "limits not finite": (DH, "J2: [-130, 140]", "J2: [-.inf, 140]", "YML004", "is not a number", "J2:"),
    "limits empty": (DH, "J2: [-130, 140]", "J2:", "YML003", "has no value", "J2:"),
    "sign of two": (DH, "J2: [-130, 140]", "J2: {limits: [-1, 1], sign: 2}", "YML004", "must be 1 or -1", "J2:"),
    "unit of a turn": (DH, "J2: [-130, 140]", "J2: {limits: [-1, 1], unit: mm}", "YML005", "rad, deg", "J2:"),
    "unit of a way": (DH, "J2: [-130, 140]", "J2: {kind: prismatic, limits: [-1, 1], unit: deg}", "YML005", "m, mm",
                      "J2:"),
    "way without a unit": (DH, "J2: [-130, 140]", "J2: {kind: prismatic, limits: [-1, 1]}", "YML003", "'unit'", "J2:"),
    "way in the wrong unit": (DH, "J2: [-130, 140]", "J2: {kind: prismatic, limits: [0, 4000], unit: m}", "YML004",
                              "exceeds 200 m", "J2:"),
    "offset in the wrong unit": (DH, "J2: [-130, 140]", "J2: {limits: [-1, 1], unit: rad, offset: 90}", "YML004",
                                 "exceeds 1000 deg", "J2:"),
    "kind of a joint": (DH, "J2: [-130, 140]", "J2: {kind: linear, limits: [-1, 1]}", "YML004", "revolute, prismatic",
                        "J2:"),
    "name of a joint": (DH, "J2: [-130, 140]", "J-2: [-130, 140]", "YML002", "not a name of a joint", "J-2:"),
    "key of a joint": (DH, "J2: [-130, 140]", "J2: {limits: [-1, 1], offsett: 1}", "YML002", "'offset'", "J2:"),
    "rail of a table": (DH, "  dh:", "  rail: +y\n  dh:", "YML004", "no meaning for a dh", "  rail:"),
    "base of lengths": (KUKA, "  kuka:", "  base: {unit: mm, angle_unit: deg}\n  kuka:", "YML004",
                        "no meaning for a kuka", "  base:"),
    "rail askew": (ON_RAIL, "rail: -y", "rail: y", "YML004", "not one of +x", "  rail:"),
    "rail without its joint": (KUKA, "  kuka:", "  rail: +y\n  kuka:", "YML003", "missing",
                               "  source: made up\n  unit"),
    "joint without its rail": (ON_RAIL, "  rail: -y\n", "", "YML004", "has 6 joints, 7", "  A6:"),
    "rail that turns": (ON_RAIL, "E1: {kind: prismatic, limits: [0, 4000], unit: mm, offset: 250}", "E1: [0, 1]",
                        "YML004", "joint 1 of this geometry is prismatic", "  E1:"),
    "arm that shifts": (KUKA, "A3: [-119, 155]", "A3: {kind: prismatic, unit: mm, limits: [0, 1]}", "YML004",
                        "joint 3 of this geometry is revolute", "  A3:"),
    "external of a rail": (ON_RAIL, "  unit: deg\n", "  unit: deg\n  external: A1\n", "YML004", "only the joint of",
                           "  external"),
    "external of six": (DH, "  unit: deg\n", "  unit: deg\n  external: J1\n", "YML004", "has no external"
    " one", "  external"),
    "external of seven": (SEVEN, "J7: [-100, 100]", "J7: [-100, 101]", "YML003", "'external' is missing",
                          "  source: made up\n  unit"),
    "external that is none": (SEVEN, "  unit: deg\n", "  unit: deg\n  external: J8\n", "YML004", "J8", "  external"),
    "frame without units": (DH, "  dh:", "  base: {x: 1}\n  dh:", "YML003", "'unit' is missing", "  base:"),
    "frame with a slip": (DH, "  dh:", "  flange: {unit: mm, angle_unit: deg, q: 1}\n  dh:", "YML002",
        "the key is unknown",
                          "  flange:"),
    "controller of another kind": (
        DH, "joints:", "controller:\n  source: s\n  kuka: {unit: mm}\njoints:", "YML004", "of the same kind, dh",
        "  kuka:"
    ),
    "controller without a source": (
        KUKA, "joints:", "controller:\n  kuka: {unit: mm, d1: 1}\njoints:", "YML003", "'source'",
        "  kuka: {unit: mm, d1: 1}"
    ),
    "controller without geometry": (DH, "joints:", "controller: {source: s}\njoints:", "YML003", "geometry is missing",
                                    "controller:"),
    "mass without a centre": (DH + MASSES, ", com: [1, 2, 3]", "", "YML003", "'com' is missing", "  J2: {mass"),
    "centre without a mass": (DH + MASSES, "mass: 10, ", "", "YML003", "'mass' is missing", "  J2: {com"),
    "negative mass": (DH + MASSES, "mass: 10", "mass: -10", "YML004", "not within", "  J2: {mass"),
    "mass of nothing": (DH + MASSES, "  J2: {mass", "  J9: {mass", "YML002", "the key is unknown", "  J9: {mass"),
    "unit of masses": (DH + MASSES, "unit: kg", "unit: N", "YML005", "these are allowed here: kg", "  unit: N"),
    "unit of centres": (DH + MASSES, "  com_unit: mm\n", "", "YML003", "'com_unit'", "  source: made up\n  unit: kg"),
    "source of masses": (DH + MASSES, "masses:\n  source: made up\n", "masses:\n", "YML003", "'source'", "  unit: kg"),
    "mechanism without a kind": (DH + SPRING, "    kind: gas spring\n", "", "YML003", "'kind'", "  - name"),
    "mechanism without a source": (DH + SPRING, "    source: made up\n", "", "YML003", "'source'", "  - name"),
    "mechanism elsewhere": (DH + SPRING, "joint: J2", "joint: J9", "YML004", "not one of J1", "    joint: J9"),
    "number without a unit": (DH + SPRING + "    length: {value: 3}\n", "gas", "oil", "YML003", "'unit'", "    length"),
    "plain number": (DH + SPRING + "    length: 3\n", "gas", "oil", "YML004", "keys and values", "    length"),
    "unit that is none": (DH + SPRING + "    length: {value: 3, unit: inch}\n", "gas", "oil", "YML005", "is not a unit",
                          "    length"),
    "point of two numbers": (DH + SPRING + "    p0: {value: [1, 2], unit: mm}\n", "gas", "oil", "YML004", "3 numbers",
                             "    p0"),
    "two of one name": (DH + SPRING + SPRING[SPRING.index("  - "):], "gas", "gas", "YML004", "already", None),
}  # fmt: skip


@pytest.mark.sample(34)
@pytest.mark.parametrize("case", MISTAKES)
def test_mistake_is_told_with_its_line(tmp_path, case):
    text, old, new, code, words, place = MISTAKES[case]
    assert old in text
    load_robot(write(tmp_path, text)) if case not in FIRST_WRONG else None
    text = text.replace(old, new, 1) if old != new else text
    path = write(tmp_path, text)
    finding = refused(path)
    assert finding.code == code
    assert words in f"{finding.message} | {finding.help}"
    assert finding.file == str(path)
    if place is not None:
        assert finding.line == text[: text.index(place)].count("\n") + 1


FIRST_WRONG = {
    "external of seven",
    "external that is none",
    "number without a unit",
    "plain number",
    "unit that is none",
    "point of two numbers",
    "two of one name",
}
"""Cases whose text is wrong before anything is replaced."""


def test_eight_joints_are_of_no_program(tmp_path):
    row = "      - {a: 0, alpha: 90, d: 0}\n"
    eight = SEVEN.replace(row, 2 * row)
    eight = eight.replace("  J7: [-100, 100]\n", "  J7: [-100, 100]\n  J8: [-100, 100]\n")
    robot = load_robot(write(tmp_path, eight))
    assert len(robot.joints) == 8
    assert robot.external is None
    with pytest.raises(Refusal) as refusal:
        check_programmable(robot)
    assert "8 joints" in refusal.value.findings[0].message


# what else a file may hold


def test_names_of_joints_are_free(tmp_path):
    names = ["pan", "lift", "elbow_1", "w1", "w2", "w3"]
    text = DH
    for i, name in enumerate(names):
        text = text.replace(f"J{i + 1}:", f"{name}:")
    assert [joint.name for joint in load_robot(write(tmp_path, text)).joints] == names


def test_external_joint_of_seven(tmp_path):
    robot = load_robot(write(tmp_path, SEVEN.replace("  unit: deg\n", "  unit: deg\n  external: J3\n")))
    assert robot.external == 2
    assert robot.programmed.tolist() == [0, 1, 3, 4, 5, 6]
    text = SEVEN.replace("J5: [-115, 140]", "J5: {kind: prismatic, unit: mm, limits: [0, 500]}")
    assert load_robot(write(tmp_path, text)).external == 4


def test_controller_may_believe_another_table(tmp_path):
    believed = DH[DH.index("  dh:") : DH.index("joints:")].replace("d: 550", "d: 551")
    text = DH.replace("joints:", "controller:\n  source: guess\n" + believed + "joints:")
    robot = load_robot(write(tmp_path, text))
    q = states(robot, 20)
    rows = [*ROWS[:3], (0, -math.pi / 2, 0.551, 0), *ROWS[4:]]
    agrees(robot, q, lambda q: standard(ROWS, q))
    expected = np.array([standard(rows, row)[:3, 3] for row in q])
    assert np.abs(nominal_flange(robot, q).position - expected).max() < 1e-12
    found = inverse(robot.nominal, nominal_flange(robot, q), np.zeros(20, int), q)
    assert np.abs(found.q - q).max() < 1e-9


@pytest.mark.parametrize("signed", [False, True])
def test_masses_are_where_the_link_frames_are(tmp_path, signed):
    """The centre is stated in the link's frame of the table; it is kept in the frame that the joint moves."""
    text = (SIGNED if signed else DH) + MASSES.replace("mass: 10", "mass: 2.5")
    robot = load_robot(write(tmp_path, text))
    (mass,) = robot.masses
    assert (mass.joint, mass.mass) == ("J2", 2.5)
    q = states(robot, 1)
    angles = q * [1, -1, 1, 1, 1, -1] + [0, 15 * DEG, 0, 0.25, 0, 0] if signed else q
    expected = (standard(ROWS[:2], angles[0]) @ [1e-3, 2e-3, 3e-3, 1])[:3]
    place = np.eye(4)
    for joint, value in zip(robot.joints[:2], q[0], strict=False):
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = joint.placement.rotation, joint.placement.position
        place = product(place, frame, turn("z", value))
    assert (place @ [*mass.com, 1])[:3] == pytest.approx(expected, abs=1e-12)


def test_masses_of_a_kuka_type_arm(tmp_path):
    """Link frames are parallel to the base at zero and lie on their axes."""
    text = KUKA + MASSES.replace("J2", "A2")
    (mass,) = load_robot(write(tmp_path, text)).masses
    joints = load_robot(write(tmp_path, KUKA)).joints
    place = np.eye(4)
    for joint in joints[:2]:
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = joint.placement.rotation, joint.placement.position
        place = place @ frame
    assert (place @ [*mass.com, 1])[:3] == pytest.approx([0.301, 0.002, 0.703], abs=1e-12)


def test_mechanisms_are_kept_as_data(tmp_path):
    more = (
        "    about: seen on the arm\n    stiffness: {value: 5, unit: N/mm, source: guess}\n"
        "    p0: {value: [1, -2, 3], unit: mm}\n"
    )
    (found,) = load_robot(write(tmp_path, DH + SPRING + more)).mechanisms
    assert (found.name, found.kind, found.joint, found.about) == (
        "spring",
        "gas spring",
        "J2",
        "seen on the arm",
    )
    assert found.quantities["stiffness"].values.tolist() == [5000.0]
    assert found.quantities["stiffness"].unit == "N/m"
    assert found.quantities["stiffness"].source == "guess"
    assert found.quantities["p0"].values == pytest.approx([1e-3, -2e-3, 3e-3])


@pytest.mark.parametrize("name", [*ROBOTS, "made"])
def test_robots_command_shows_it(compensate, tmp_path, name):
    shown = name if name != "made" else write(tmp_path, ON_RAIL + MASSES.replace("J2", "A2"))
    done = compensate("robots", shown)
    assert done.code == 0
    assert "made up" in done.out if name == "made" else name in done.out
    page = compensate("robots", shown, "--json", "-").json["robots"][0]
    assert page["geometry"]["kind"] in ("kuka", "dh")
    assert len(page["limits_deg"]) + len(page["limits_mm"]) == len(page["geometry"]["axes"])
