"""What is said to touch no stock, from a few places of it, touches none at any."""

import numpy as np
import pytest

pytest.importorskip("numba")

from stock_cases import BALL, BULL, CONE, FLAT, block, path_through, sweeps_of
from test_stock_bounds import random_path

from postproc.process.stock.blank import (
    CYLINDER,
    blank_distance,
    box_blank,
    cylinder_blank,
    half_space,
    mesh_blank,
)
from postproc.process.stock.bounds import BOUND_COLUMNS, convex_distance, set_bound
from postproc.process.stock.cell_lists import build_stock
from postproc.process.stock.cells import nearest_line, stock_distance
from postproc.process.stock.contact import CutterCircle, find_arcs, set_pose
from postproc.process.stock.cutter_circles import chip_of, circle_at, on_circle
from postproc.process.stock.distance import pose_distance
from postproc.process.stock.empty_patches import arc_bound, touches_none

MARGIN, GAP = 1e-8, 20e-6
CUTTERS = [BALL, BULL, CONE, FLAT]
UPRIGHT = np.array([1.0, 0.0, 0.0])


def rows_of(points, axes, cutter, blank):
    return np.ascontiguousarray(sweeps_of(path_through(points, axes), blank, cutter)[0].rows)


@pytest.mark.parametrize("cutter", CUTTERS, ids=lambda one: one.shape)
@pytest.mark.parametrize("five", [False, True])
def test_a_convex_distance_is_not_less_than_the_distance_and_convex(cutter, five):
    cutters, known, deep = np.array([cutter.numbers]), 0, 0
    for seed in range(4):
        rows = rows_of(*random_path(seed, five), cutter, block([0, 0, -40], [100, 60, 0]))
        bounds = np.zeros((len(rows), BOUND_COLUMNS))
        rng = np.random.default_rng(300 + seed)
        for j in range(len(rows)):
            set_bound(rows, cutters, j, bounds[j])
            middle = rows[j, :3] + 0.5 * rows[j, 3:6] + rng.uniform(0, 8e-3) * rows[j, 6:9]
            corners = middle + rng.normal(0, 2e-3, (4, 3))
            most = max(convex_distance(rows, cutters, bounds, j, *corner) for corner in corners)
            if not most <= 0.0:
                continue
            known += 1
            for weights in rng.dirichlet(np.ones(4), 10):
                place = weights @ corners
                least = min(
                    pose_distance(rows, cutters, j, share, *place) for share in np.linspace(0, 1, 201)
                )
                assert least <= most + 1e-9
                deep += least < -1e-3
    assert known > 15
    assert deep > 50


BODIES = {
    "box": box_blank(np.array([0.0, 0.0, -0.03]), np.array([0.05, 0.04, 0.0])),
    "cylinder": cylinder_blank(np.array([0.02, 0.02, -0.03]), 0.04, 0.03),
    "lying": cylinder_blank(np.array([0.0, 0.02, -0.02]), 0.04, 0.05, 0),
}


@pytest.mark.parametrize("name", BODIES)
def test_a_half_space_beside_the_blank_holds_none_of_it(name):
    blank, rng, some = BODIES[name], np.random.default_rng(5), 0
    inside = [
        p for p in rng.uniform(-0.01, 0.06, (3000, 3)) - [0, 0, 0.035] if blank_distance(blank, *p) > 0.0
    ]
    assert len(inside) > 100
    for place in rng.uniform(-0.02, 0.07, (200, 3)) - [0, 0, 0.035]:
        offset, *normal = half_space(blank, *place)
        if blank_distance(blank, *place) >= 0.0:
            continue
        some += 1
        assert np.linalg.norm(normal) == pytest.approx(1.0)
        assert offset + normal @ place < 1e-12
        assert min(offset + np.array(normal) @ one - blank_distance(blank, *one) for one in inside) > -1e-12
    assert some > 50


def test_beside_a_mesh_only_its_box_has_a_half_space():
    tetrahedron = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * 0.03
    mesh = mesh_blank(tetrahedron[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]], 1000)
    assert half_space(mesh, 0.025, 0.025, 0.025)[1:] == (0.0, 0.0, 0.0)
    assert half_space(mesh, 0.035, 0.01, 0.01)[1:] == (-1.0, 0.0, 0.0)


def wedge():
    """A closed mesh whose top leans."""
    corners = (
        np.array([[x, y, z] for x in (25, 75) for y in (10, 50) for z in (-20, -1 - 0.06 * (x - 25))]) * 1e-3
    )
    faces = [[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]]
    return mesh_blank(
        corners[[*faces, [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]]], 20000
    )


BLANKS = {
    "box": block([25, 10, -20], [75, 50, 0]),
    "cylinder": cylinder_blank(np.array([0.05, 0.03, -0.02]), 0.04, 0.02),
    "lying": cylinder_blank(np.array([0.025, 0.03, -0.01]), 0.03, 0.05, 0),
    "mesh": wedge(),
}


@pytest.mark.parametrize(
    ("name", "cutter"),
    [*[("box", cutter) for cutter in CUTTERS], *[(name, BALL) for name in ("cylinder", "lying", "mesh")]],
    ids=lambda one: one if isinstance(one, str) else one.shape,
)
@pytest.mark.parametrize("five", [False, True])
def test_what_touches_nothing_is_outside_the_stock_everywhere(name, cutter, five):
    """Patches of the tool at random places of its path, looked at closely where none is said to touch; and arcs."""
    blank, profile = BLANKS[name], cutter.profile()
    proven = touching = close = arcs = 0
    for seed in range(3):
        points, axes = random_path(seed, five)
        points = np.concatenate([points, points + np.array([0.3, 0.2, -0.4])])
        rows = rows_of(points, np.concatenate([axes, axes]), cutter, blank)
        stock, _ = build_stock(blank, rows, np.array([cutter.numbers]))
        rng, pose = np.random.default_rng(400 + seed), np.zeros((6, 3))
        for _ in range(60):
            j = int(rng.integers(len(rows) // 2, len(rows)))
            set_pose(rows, j, float(rng.uniform()), UPRIGHT, pose)
            element = profile[rng.integers(np.count_nonzero(profile[:, 0] == 0.0))]
            top = min(element[7], 0.02)
            low, high = np.sort(rng.uniform(0, top, 2))
            high = min(high, low + 2e-3)
            says = touches_none(stock, pose, element, low, high, MARGIN, GAP, j)
            most = -np.inf
            for s in np.linspace(low, high, 9):
                r, height, sine, cosine = circle_at(element, s)
                _, _, _, middle, half = chip_of(pose, r, height, sine, cosine)
                angles = np.linspace(middle - half, middle + half, 73) if half > 0.0 else []
                most = max(
                    [most] + [stock_distance(stock, *on_circle(pose, r, height, phi), j) for phi in angles]
                )
            if len(angles):
                arcs += arc_holds(stock, pose, r, height, rng.choice(angles), j)
            proven += says
            if says:
                assert most <= MARGIN
                close += most > -0.3e-3
            else:
                touching += most > MARGIN
    assert proven > 30
    assert touching > 4
    assert close > 5
    assert arcs > 15


def depth_outside(blank, place):
    """What is below zero only outside: all sides of a box, and the wall of a cylinder."""
    low, high = blank.frame[1:4], blank.frame[4:7]
    d = min(blank_distance(blank, *place), *(place - low), *(high - place))
    if blank.frame[0] == CYLINDER:
        across = np.delete(place - 0.5 * (low + high), int(blank.frame[7]))
        d = min(d, 0.5 * np.delete(high - low, int(blank.frame[7]))[0] - np.linalg.norm(across))
    return d


def arc_holds(stock, pose, r, height, first, time):
    """Whether a bound is known for an arc; if so it is one."""
    last = first + 0.3
    _, owner, end = nearest_line(stock, *on_circle(pose, r, height, first), time, 0.0)
    most = arc_bound(stock, pose, r, height, first, last, (owner, end))
    if most > 0.0:
        assert np.isinf(most)
        return False
    for phi in np.linspace(first, last, 4):
        place = on_circle(pose, r, height, phi)
        d = depth_outside(stock.blank, np.array(place))
        if d > most:
            shares = np.linspace(0, 1, 201)
            each = (
                pose_distance(stock.sweeps, stock.cutters, k, t, *place) for k in range(time) for t in shares
            )
            d = min([d, *each])
        assert d <= most + 30e-6
    return True


def test_a_layer_of_a_micrometre_between_places_without_stock_is_seen():
    """A cutter leaves the side of a block: 10 um on, what is left between its last place and the side is 1 um thick."""
    blank = block([0, 0, -60], [200, 100, 0])
    points = np.column_stack([np.arange(150, 202.0), np.full(52, -4.0), np.full(52, -2.0)])
    rows = rows_of(points, None, FLAT, blank)
    stock, _ = build_stock(blank, rows, np.array([FLAT.numbers]))
    last, pose, arc = int(np.argmin(abs(rows[:, 0] - 0.199))), np.zeros((6, 3)), np.zeros(12)
    set_pose(rows, last, 0.01, UPRIGHT, pose)
    find_arcs(stock, pose, CutterCircle(8e-3, 1e-3, 0.0, np.pi, MARGIN, 3e-4), last, arc)
    assert arc[0] == pytest.approx(np.arcsin(0.99 / 8), rel=0.02)


@pytest.mark.parametrize("depth", [0.01, -0.01])
@pytest.mark.parametrize("turned", [0.0, 0.04])
def test_a_bulge_between_places_that_touch_nothing_is_seen(depth, turned):
    """The lowest point of a ball that leans by 45 deg, beside the middle of the part of its profile."""
    lean = np.array([np.sin(np.pi / 4), 0.0, np.cos(np.pi / 4)])
    tip = np.array([50.0, 30.0, 5.0 - depth]) - 5.0 * lean
    rows = rows_of([tip + np.array([0, 0, 1.0]), tip], [lean, lean], BALL, block([0, 0, -40], [100, 60, 0]))
    stock, _ = build_stock(block([0, 0, -40], [100, 60, 0]), rows, np.array([BALL.numbers]))
    pose, element = np.zeros((6, 3)), BALL.profile()[0]
    set_pose(rows, 0, 1.0, UPRIGHT, pose)
    lowest = 5e-3 * np.pi / 4
    part = lowest - 5e-3 * np.radians(10 + turned), lowest + 5e-3 * np.radians(30)
    assert touches_none(stock, pose, element, *part, MARGIN, GAP, 0) == (depth < 0.0)
