"""The URDF reader against Pinocchio's own: kinds, placements and axes of the moving joints, and the tip."""

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_robot_files import URDF

from postproc.robot.urdf import read_urdf

EQUAL = 1e-7
"""A rotation within 1e-9 of the axes is taken for them, link by link of some metres."""
LENGTHS = st.floats(-3, 3)
ANGLES = st.one_of(st.floats(-4, 4), st.sampled_from([k * math.pi / 2 for k in range(-4, 5)]))
AXES = st.one_of(
    st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0, 0, -1), (-1, 0, 0)]),
    st.tuples(*3 * [st.floats(-2, 2)]).filter(lambda axis: np.linalg.norm(axis) > 0.1),
)
JOINTS = st.tuples(
    st.sampled_from(["revolute", "continuous", "prismatic", "fixed"]),
    st.none() | st.tuples(LENGTHS, LENGTHS, LENGTHS, ANGLES, ANGLES, ANGLES),
    st.none() | AXES,
)


def words(values):
    return " ".join(map(repr, map(float, values)))


def urdf_of(joints):
    text = ['<?xml version="1.0"?><robot name="made"><link name="l0"/>']
    for i, (kind, origin, axis) in enumerate(joints):
        text.append(f'<link name="l{i + 1}"/><joint name="j{i}" type="{kind}">')
        text.append(f'<parent link="l{i}"/><child link="l{i + 1}"/>')
        text += [f'<origin xyz="{words(origin[:3])}" rpy="{words(origin[3:])}"/>'] if origin else []
        text += [f'<axis xyz="{words(axis)}"/>'] if axis else []
        text.append('<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>')
    return "\n".join([*text, "</robot>"])


def check(path, text, tip):
    path.write_text(text, encoding="utf-8")
    arm, model = read_urdf(path), pin.buildModelFromUrdf(str(path))
    assert arm.names == tuple(model.names)[1:]
    q = pin.neutral(model)
    for kind, link, joint, placement in zip(
        arm.kinds, arm.links, model.joints[1:], model.jointPlacements[1:], strict=True
    ):
        motion = joint.createData()
        joint.calc(motion, q)
        at_zero = link.before @ link.after
        assert np.abs(at_zero.rotation - placement.rotation).max() < EQUAL
        assert np.abs(at_zero.position - placement.translation).max() < EQUAL
        linear, angular = np.split(np.ravel(motion.S), 2)
        axis, none = (linear, angular) if kind == "prismatic" else (angular, linear)
        assert np.abs(link.after.inverse().rotation[:, 2] - axis).max() < EQUAL
        assert not none.any()
    end = model.frames[model.getFrameId(tip)].placement
    assert np.abs(arm.tip.rotation - end.rotation).max() < EQUAL
    assert np.abs(arm.tip.position - end.translation).max() < EQUAL
    return arm


def test_an_arm_with_every_kind_of_joint(tmp_path):
    assert len(check(tmp_path / "arm.urdf", URDF, "tool0").names) == 6


@settings(max_examples=150, deadline=None)
@given(st.lists(JOINTS, min_size=1, max_size=9).filter(lambda joints: any(j[0] != "fixed" for j in joints)))
def test_any_chain_is_read_as_pinocchio_reads_it(tmp_path_factory, joints):
    check(tmp_path_factory.getbasetemp() / "made.urdf", urdf_of(joints), f"l{len(joints)}")


@pytest.mark.parametrize("rpy", [(0.3, 1.1, -2.0), (-3.0, -1.5, 0.2)])
def test_angles_turn_about_the_fixed_axes_in_the_order_x_y_z(tmp_path, rpy):
    (link,) = check(tmp_path / "arm.urdf", urdf_of([("revolute", (1, 2, 3, *rpy), (0, 0, 1))]), "l1").links
    assert np.abs(link.before.rotation - pin.rpy.rpyToMatrix(*rpy)).max() < EQUAL
