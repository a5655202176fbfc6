"""Rotations, KUKA's angles and poses: laws, with scipy's rotations as the second opinion."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays as array_of
from scipy.spatial.transform import Rotation

from postproc.base import geometry
from postproc.base.geometry import (
    PoseRows,
    Poses,
    abc_from_rotation,
    lengths,
    product,
    rotation_from_abc,
    rotation_from_vector,
    skew,
    turn_between,
    vector_from_rotation,
    wrapped,
)

turns = st.floats(-math.pi, math.pi)
abcs = st.tuples(turns, turns, turns).map(np.array)
tiny = st.sampled_from([0.0, 1e-16, 1e-12, 3e-10, 9e-10, 1.1e-9, 1e-8, 1e-6, 1e-3])
vectors = array_of(float, 3, elements=st.floats(-1.0, 1.0))
directions = vectors.filter(lambda v: np.linalg.norm(v) > 1e-3).map(lambda v: v / np.linalg.norm(v))
rotations = st.tuples(directions, st.floats(0.0, math.pi)).map(
    lambda pair: Rotation.from_rotvec(pair[0] * pair[1]).as_matrix()
)
poses = st.tuples(rotations, vectors).map(lambda pair: Poses(*pair))


def same(one, other, tolerance):
    return np.abs(np.asarray(one) - np.asarray(other)).max() <= tolerance


# KUKA's A, B, C


@settings(deadline=None)
@given(abcs)
def test_abc_are_turns_about_z_then_new_y_then_new_x(abc):
    """R = Rz(A) Ry(B) Rx(C)."""
    assert same(rotation_from_abc(abc), Rotation.from_euler("ZYX", abc).as_matrix(), 1e-14)


def test_senses_of_abc():
    quarter = math.pi / 2
    x, y, z = np.eye(3)
    assert same(rotation_from_abc([quarter, 0, 0]) @ x, y, 1e-15)
    assert same(rotation_from_abc([0, quarter, 0]) @ z, x, 1e-15)
    assert same(rotation_from_abc([0, 0, quarter]) @ y, z, 1e-15)


@settings(deadline=None)
@given(rotations)
@example(np.array([[-1, 4e-16, -4e-16], [-4e-16, 0, 1], [4e-16, 1, 0]]))  # A a hair above -180 deg
def test_rotation_comes_back_from_its_angles(rotation):
    abc = abc_from_rotation(rotation)
    assert (np.abs(abc) <= math.pi).all()
    assert abs(abc[1]) <= math.pi / 2
    cosine = math.hypot(rotation[0, 0], rotation[1, 0])
    # inside of the lock A is a choice, which leaves at most its width
    assert same(rotation_from_abc(abc), rotation, 1e-14 if cosine > 1e-9 else 3e-9)


@settings(deadline=None)
@given(a=turns, c=turns, off=tiny, end=st.sampled_from([-1, 1]), side=st.sampled_from([-1, 1]))
def test_rotation_comes_back_at_and_near_the_lock(a, c, off, end, side):
    """B = +-90 deg, exactly and near it from both sides."""
    abc = np.array([a, end * (math.pi / 2 - side * off), c])
    rotation = rotation_from_abc(abc)
    for near in (None, abc, np.zeros(3), -abc):
        found = abc_from_rotation(rotation, near)
        assert same(rotation_from_abc(found), rotation, 1e-14 if off > 1e-9 else 3e-9)


@settings(deadline=None)
@given(a=turns, c=turns, end=st.sampled_from([-1, 1]), wish=turns)
@example(a=-1.177, c=math.pi, end=-1, wish=-1.177)
@example(a=-0.882, c=math.pi, end=1, wish=-0.882)
def test_at_the_lock_a_is_the_wished_one(a, c, end, wish):
    rotation = rotation_from_abc([a, end * math.pi / 2, c])
    assert abs(wrapped(abc_from_rotation(rotation, [wish, end * math.pi / 2, 0.0])[0] - wish)) < 1e-12
    assert abc_from_rotation(rotation)[0] == 0.0


@settings(deadline=None)
@given(abcs)
def test_near_gives_back_the_triple_it_was(abc):
    """Also where B is beyond 90 deg, and at the lock, where A and C could be others."""
    cosine = abs(math.cos(abc[1]))
    found = abc_from_rotation(rotation_from_abc(abc), near=abc)
    tolerance = 1e-12 if cosine < 1e-12 else max(1e-12, 4e-16 / cosine)
    if cosine < 1e-12 or cosine > 1e-7:
        assert same(wrapped(found - abc), 0.0, tolerance)


@settings(deadline=None)
@given(rotations, abcs)
def test_near_takes_the_nearer_of_both_triples(rotation, wish):
    if math.hypot(rotation[0, 0], rotation[1, 0]) < 1e-6:
        return
    a, b, c = abc_from_rotation(rotation)
    both = wrapped([[a, b, c], [a + math.pi, math.pi - b, c + math.pi]])
    assert same(rotation_from_abc(both[1]), rotation, 1e-13)
    distance = np.abs(wrapped(both - wish)).sum(axis=1)
    chosen = abc_from_rotation(rotation, near=wish)
    assert np.abs(wrapped(chosen - wish)).sum() == pytest.approx(distance.min(), abs=1e-9)


@pytest.mark.parametrize(
    "abc", [(180, 0, 0), (-180, 0, 0), (0, 0, 180), (0, 0, -180), (0, 180, 0), (180, 0, 180)]
)
def test_half_turns(abc):
    rotation = rotation_from_abc(np.radians(abc))
    for near in (None, np.radians(abc)):
        found = abc_from_rotation(rotation, near)
        assert same(rotation_from_abc(found), rotation, 1e-14)
        assert (found > -math.pi).all()
        if near is not None:
            assert same(np.abs(found), np.abs(near), 1e-14)


def test_batch_of_angles_is_row_by_row():
    rng = np.random.default_rng(0)
    abc = rng.uniform(-math.pi, math.pi, (4, 5, 3))
    abc[0, :3, 1] = [math.pi / 2, -math.pi / 2, 0.0]
    near = rng.uniform(-math.pi, math.pi, (4, 5, 3))
    rotation = rotation_from_abc(abc)
    found = abc_from_rotation(rotation, near)
    for index in np.ndindex(4, 5):
        assert np.array_equal(rotation[index], rotation_from_abc(abc[index]))
        assert np.array_equal(found[index], abc_from_rotation(rotation[index], near[index]))


# wrapped


@settings(deadline=None)
@given(st.floats(-1e3, 1e3))
def test_wrapped_is_the_same_angle_within_half_a_turn(angle):
    found = float(wrapped(angle))
    assert -math.pi - 1e-15 < found <= math.pi
    turns_off = (angle - found) / (2 * math.pi)
    assert abs(turns_off - round(turns_off)) < 1e-12


def test_half_a_turn_is_positive():
    assert wrapped(math.pi) == math.pi
    assert wrapped(-math.pi) == math.pi
    assert wrapped([3 * math.pi, 0.0]) == pytest.approx([math.pi, 0.0])


# rotation vectors


@settings(deadline=None)
@given(directions, st.floats(0.0, math.pi))
def test_rotation_vector_turns_about_itself(axis, angle):
    found = rotation_from_vector(axis * angle)
    assert same(found, Rotation.from_rotvec(axis * angle).as_matrix(), 1e-14)
    assert same(found @ axis, axis, 1e-14)


@settings(deadline=None)
@given(
    directions, st.one_of(st.floats(0.0, 3.0), st.sampled_from([1e-15, 1e-9, 9.9e-8, 1.1e-7, 9e-5, 1.1e-4]))
)
def test_vector_comes_back(axis, angle):
    vector = axis * angle
    assert same(vector_from_rotation(rotation_from_vector(vector)), vector, 1e-15 + 1e-14 * angle)


@settings(deadline=None)
@given(directions, st.one_of(st.floats(1e-7, 0.2), st.sampled_from([1e-15, 1e-12, 1e-9, 1e-8, 1e-7])))
def test_vector_comes_back_near_half_a_turn(axis, short):
    vector = axis * (math.pi - short)
    back = vector_from_rotation(rotation_from_vector(vector))
    assert same(rotation_from_vector(back), rotation_from_vector(vector), 1e-13)
    if short > 1e-12:  # nearer than that the axis may as well point the other way
        assert same(back, vector, 1e-13)


@settings(deadline=None)
@given(directions)
def test_half_a_turn_has_either_axis(axis):
    """R = 2 n n^T - 1, symmetric: the log has length pi and lies on the axis, with one sign or the other."""
    vector = vector_from_rotation(2 * np.outer(axis, axis) - np.eye(3))
    assert np.linalg.norm(vector) == pytest.approx(math.pi, abs=1e-12)
    assert same(np.cross(vector, axis), 0.0, 1e-12)


def test_batch_of_vectors_is_row_by_row():
    rng = np.random.default_rng(1)
    vector = rng.normal(size=(3, 7, 3))
    vector *= (np.array([1e-9, 1.0, math.pi - 1e-5])[:, None] / np.linalg.norm(vector, axis=-1))[..., None]
    rotation = rotation_from_vector(vector)
    back = vector_from_rotation(rotation)
    assert same(back, vector, 1e-12)
    for index in np.ndindex(3, 7):
        assert np.array_equal(rotation[index], rotation_from_vector(vector[index]))
        assert same(back[index], vector_from_rotation(rotation[index]), 1e-15)


@settings(deadline=None)
@given(vectors, vectors)
def test_skew_is_the_cross_product(v, u):
    assert same(skew(v) @ u, np.cross(v, u), 1e-15)


# Poses


@settings(deadline=None)
@given(poses, poses, poses)
def test_poses_are_a_group(a, b, c):
    for one, other in (
        ((a @ b) @ c, a @ (b @ c)),
        (a @ a.inverse(), Poses.identity()),
        (a.inverse() @ a, Poses.identity()),
        ((a @ b).inverse(), b.inverse() @ a.inverse()),
        (a @ Poses.identity(), a),
    ):
        assert same(one.rotation, other.rotation, 1e-14)
        assert same(one.position, other.position, 1e-14)


@settings(deadline=None)
@given(poses, poses, vectors)
def test_product_takes_a_point_through_both(a, b, point):
    def moved(pose, p):
        return pose.rotation @ p + pose.position

    assert same(moved(a @ b, point), moved(a, moved(b, point)), 1e-14)


def test_poses_broadcast_and_index():
    rng = np.random.default_rng(2)
    many = Poses.from_abc(rng.normal(size=(6, 3)), rng.normal(size=(6, 3)))
    one = Poses.from_abc([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])
    assert len(many) == 6
    for joined, left, right in ((many @ one, many, None), (one @ many, None, many)):
        assert joined.position.shape == (6, 3)
        for row in range(6):
            single = (left[row] if left else one) @ (right[row] if right else one)
            assert same(joined[row].position, single.position, 1e-15)
            assert same(joined[row].rotation, single.rotation, 1e-15)
    assert len(many[2:4]) == 2


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-5, 0.0099, 0.0101, 0.3, 1.5, 3.1])
def test_small_and_large_turns_are_those_of_scipy(angle):
    rng = np.random.default_rng(3)
    axis = rng.normal(size=(200, 3))
    vector = angle * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    turn = rotation_from_vector(vector)
    np.testing.assert_allclose(turn, Rotation.from_rotvec(vector).as_matrix(), atol=1e-15, rtol=0)
    begin = Rotation.random(200, random_state=4).as_matrix()
    np.testing.assert_allclose(product(turn, begin), turn @ begin, atol=1e-15, rtol=0)
    np.testing.assert_allclose(product(turn[0], begin), turn[0] @ begin, atol=1e-15, rtol=0)
    np.testing.assert_allclose(turn_between(begin, turn @ begin), vector, atol=3e-14, rtol=0)


def test_one_large_turn_among_small_ones_changes_none_of_them():
    vector = np.array([[1e-3, -2e-3, 5e-4], [1.0, 2.0, 0.5], [0.0, 0.0, 0.0]])
    turn = rotation_from_vector(vector)
    np.testing.assert_allclose(turn[:1], rotation_from_vector(vector[:1]), atol=1e-16)
    begin = np.broadcast_to(np.eye(3), (3, 3, 3))
    np.testing.assert_allclose(turn_between(begin, turn), vector, atol=1e-15)


def test_lengths_are_those_of_vectors():
    vectors = np.random.default_rng(5).normal(size=(50, 3))
    np.testing.assert_allclose(lengths(vectors), np.linalg.norm(vectors, axis=1), rtol=1e-15)
    assert np.isnan(lengths(np.array([[np.nan, 0.0, 0.0]]))).all()


def test_poses_of_one_for_all_are_taken_as_such():
    poses = Poses(np.broadcast_to(np.eye(3), (9, 3, 3)), np.broadcast_to([1.0, 2.0, 3.0], (9, 3)))
    some = poses[np.array([2, 7])]
    assert some.position.tolist() == [[1.0, 2.0, 3.0]] * 2
    assert some.rotation.shape == (2, 3, 3)


def remembered_rows(monkeypatch, count=1000):
    """Poses by rows that are remembered by runs, the same without that, and the rows that were computed."""
    monkeypatch.setattr(geometry, "STORED", 10)
    rng = np.random.default_rng(5)
    base = Poses.from_abc([0.1, -0.4, 0.2], [0.3, -0.2, 1.1])
    poses = Poses.from_abc(rng.uniform(-2, 2, (count, 3)), rng.uniform(-3, 3, (count, 3)))
    built = []

    def build(rows):
        built.append(rows)
        return base @ poses[rows]

    return PoseRows(count, build).remembered(), base @ poses, built


def test_rows_of_a_block_and_their_neighbours_are_computed_once(monkeypatch):
    rows, whole, built = remembered_rows(monkeypatch)
    block = np.arange(200, 300)
    for asked in (block, block - 1, block + 1, block[::3], np.repeat(block, 4), block[::-1], block[:0]):
        there = rows[asked]
        assert np.array_equal(there.rotation, whole.rotation[asked])
        assert np.array_equal(there.position, whole.position[asked])
    assert sum(map(len, built)) <= len(block) + 2
    with pytest.raises(ValueError, match="read-only"):
        rows[block].position[0] = 0.0


@pytest.mark.parametrize("seed", range(20))
def test_remembered_rows_are_those_that_are_computed(monkeypatch, seed):
    """To the last bit, whatever was asked for before: runs, some that overlap, single rows, rows here and there."""
    rows, whole, _ = remembered_rows(monkeypatch)
    rng = np.random.default_rng(seed)
    at = 0
    for _ in range(60):
        size = int(rng.choice([2, 3, 50, 400]))
        at = int(np.clip(at + rng.integers(-40, 60), 0, 999))
        run = np.arange(at, min(at + size, 1000))
        asked = run if rng.random() < 0.6 or len(run) < 2 else rng.choice(run, max(2, len(run) // 3))
        if len(asked) < 2:
            continue
        there = rows[asked]
        assert np.array_equal(there.rotation, whole.rotation[asked])
        assert np.array_equal(there.position, whole.position[asked])
        there = rows[rng.integers(0, 1000, 5)]  # not remembered


def test_rows_here_and_there_are_not_computed_with_all_between(monkeypatch):
    rows, whole, built = remembered_rows(monkeypatch)
    asked = np.arange(0, 1000, 50)
    assert np.array_equal(rows[asked].position, whole.position[asked])
    assert sum(map(len, built)) == len(asked)
