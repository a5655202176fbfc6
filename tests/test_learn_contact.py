"""Which motion leaves a point: against brute force over many poses of the cutter, written down once more."""

import numpy as np
import pytest
from blind_parts.shop import DEPTH, POCKETS, RADIUS, surface_points, write_shop

from postproc.part.contact import cutter_distances, find_contacts, support
from postproc.process.stock.cutters import Cutter
from postproc.workflows.learn_points import read_job
from postproc.workflows.preparation import Request

CUTTERS = (
    Cutter(1, "flat", 8e-3, 30e-3),
    Cutter(2, "ball", 5e-3, 20e-3, corner=5e-3),
    Cutter(3, "bull", 6e-3, 25e-3, corner=2e-3),
    Cutter(4, "cone", 6e-3, 25e-3, tip=1e-3, taper=np.deg2rad(20.0)),
)


@pytest.fixture(scope="module")
def shop(tmp_path_factory):
    program = write_shop(tmp_path_factory.mktemp("shop"))
    return read_job(Request(program, force=""))


def in_robot(job, point, normal):
    base = job.ready.task.base[job.motions.rows[:1]]
    return base.position + 1e-3 * point @ base.rotation[0].T, normal @ base.rotation[0].T


def profile_points(cutter: Cutter) -> np.ndarray:
    """(J, 2) radius and height [m] of many points of the surface of a cutter."""
    found = []
    for part, form, *numbers, _ in cutter.profile().tolist():
        share = np.linspace(0, 1, 400)[:, None]
        if part == 0 and form == 0:
            one, other = np.array(numbers[:2]), np.array(numbers[2:4])
            found.append(one + share * (other - one))
        elif part == 0:
            middle, radius = np.array(numbers[:2]), numbers[2]
            angle = np.pi / 2 * share[:, 0]
            found.append(middle + radius * np.column_stack([np.sin(angle), -np.cos(angle)]))
    return np.concatenate(found)


@pytest.mark.parametrize("cutter", CUTTERS, ids=lambda cutter: cutter.shape)
def test_the_distance_is_zero_on_the_profile(cutter):
    points = profile_points(cutter)
    inner = points[points[:, 1] < cutter.edge_length - 1e-6]
    distance = cutter_distances(np.tile(cutter.numbers, (len(inner), 1)), inner[:, 0], inner[:, 1])
    assert np.abs(distance).max() < 1e-6


@pytest.mark.parametrize("cutter", CUTTERS, ids=lambda cutter: cutter.shape)
def test_the_support_is_the_farthest_point_of_the_profile(cutter):
    points = profile_points(cutter)
    angle = np.linspace(-np.pi / 2, np.pi / 2, 61)
    side, up = np.cos(angle), np.sin(angle)
    brute = (points[:, :1] * side + points[:, 1:] * up).max(axis=0)
    found = support(np.tile(cutter.numbers, (len(angle), 1)), side, up)
    np.testing.assert_allclose(found, brute, atol=2e-6)


def test_walls_are_left_by_the_ring_and_floors_by_the_zigzag(shop):
    point, normal, feature = surface_points(150, np.random.default_rng(3))
    contacts = find_contacts(shop.motions, *in_robot(shop, point, normal))
    assert contacts.touched.all()
    names = [shop.operations.names[i] for i in shop.operations.which[contacts.last.row].tolist()]
    assert names == feature
    assert np.abs(contacts.last.distance).max() < 5e-6


def test_of_two_levels_the_last_that_reaches_the_point_leaves_it(shop):
    """The upper half of a wall is touched by both rings, the lower one by the second alone."""
    x, y, _, high = POCKETS["A"]
    point = np.array([[x, y + 0.4 * high, -2.0], [x, y + 0.4 * high, -0.5 * DEPTH - 2.0]])
    contacts = find_contacts(shop.motions, *in_robot(shop, point, np.array([[1.0, 0, 0], [1.0, 0, 0]])))
    task = shop.ready.task
    tip = task.desired_path.at(contacts.last.row, contacts.last.share)
    base = task.base[shop.motions.rows[:1]]
    place = (tip.position - base.position) @ base.rotation[0]
    np.testing.assert_allclose(1e3 * place[:, 2], -DEPTH, atol=1e-6)
    np.testing.assert_allclose(1e3 * place[:, :2], [[x + RADIUS, y + 0.4 * high]] * 2, atol=1e-3)
    assert (contacts.before.row >= 0).tolist() == [True, False]


def test_a_point_in_the_air_or_with_its_normal_reversed_is_touched_by_nothing(shop):
    x, y, wide, high = POCKETS["A"]
    point = np.array(
        [[x - 0.2, y + 0.4 * high, -5.0], [x, y + 0.4 * high, -5.0], [x + 0.5 * wide, y + 0.5 * high, 3.0]]
    )
    normal = np.array([[1.0, 0, 0], [-1.0, 0, 0], [0, 0, 1.0]])
    assert not find_contacts(shop.motions, *in_robot(shop, point, normal)).touched.any()


def test_a_point_may_name_its_motions(shop):
    x, y, _, high = POCKETS["A"]
    place = in_robot(shop, np.array([[x, y + 0.4 * high, -2.0]]), np.array([[1.0, 0, 0]]))
    both = find_contacts(shop.motions, *place)
    other = find_contacts(shop.motions, *place, {0: np.array([int(both.before.row[0])])})
    assert other.last.row[0] == both.before.row[0]
    assert not find_contacts(shop.motions, *place, {0: np.array([0])}).touched.any()


def test_the_order_of_points_is_nothing_to_them(shop):
    point, normal, _ = surface_points(60, np.random.default_rng(4))
    order = np.random.default_rng(5).permutation(60)
    one = find_contacts(shop.motions, *in_robot(shop, point, normal)).last
    other = find_contacts(shop.motions, *in_robot(shop, point[order], normal[order])).last
    np.testing.assert_array_equal(one.row[order], other.row)
    np.testing.assert_allclose(one.share[order], other.share, atol=1e-12)
