"""The error of a part's surface against closed forms of what displaced tools leave."""

import numpy as np
import pytest

pytest.importorskip("numba")

from part_cases import constant, errors_of
from scipy.optimize import minimize_scalar
from stock_cases import BALL, FLAT, MM, block, path_through

from postproc.toolpath import Arcs, Kind

UM = 1e-3  # mm
NEAR = 0.2 * UM
SHIFT = np.array([0.05, -0.03, 0.02])
BOX = block([-50, -40, -20], [50, 40, 0])


def in_circle(radius, centre, points, direction, shift):
    """How far along ``direction`` (K, 2) a circle is that is shifted, from points (K, 2) on it."""
    u = (points - centre) / radius
    side = u @ shift
    along = np.sum(u * direction, axis=1)  # 1 outward, -1 inward
    return along * (side + np.sqrt(radius**2 - shift @ shift + side**2) - radius)


def pocket():
    rows = [[x, y, -5] for y in (-10, -3, 4, 11) for x in (-28, 28)]
    return path_through(
        [[30, 0, 20], [30, -15, -5], [-30, -15, -5], [-30, 15, -5], [30, 15, -5], [30, -15, -5], *rows]
    )


def test_walls_floor_and_fillets_of_a_pocket_that_is_shifted():
    """A constant shift moves walls and floor by its share along their normals, and each fillet as a whole."""
    points, normals, error = errors_of(pocket(), BOX, constant(SHIFT), FLAT)
    straight = (np.abs(points[:, 0]) < 29) & (np.abs(points[:, 1]) < 14)
    floor = straight & (normals[:, 2] > 0.999) & (points[:, 2] < -4)
    wall = (np.abs(normals[:, 2]) < 1e-6) & (points[:, 2] > -4.9) & (points[:, 2] < -0.1)
    ends = np.abs(points[:, 0]) < 29
    for plane in (floor, wall & ends & (np.abs(normals[:, 1]) > 0.999)):
        assert plane.sum() > 300
        assert error[plane] == pytest.approx(normals[plane] @ SHIFT, abs=0.01 * UM)
    corner = wall & (points[:, 0] > 30.2) & (points[:, 1] > 15.2)
    assert corner.sum() > 30
    true = in_circle(8.0, np.array([30.0, 15.0]), points[corner, :2], normals[corner, :2], SHIFT[:2])
    assert error[corner] == pytest.approx(true, abs=NEAR)


def test_a_wave_along_a_wall_is_that_of_the_parallel_curve():
    """The wall is the envelope of circles whose middles move on a wave; what is cut deepest stays."""
    length, swing = 100.0, 0.08

    def wave(motion, share):
        shift = np.zeros((len(motion), 3))
        shift[:, 1] = np.where(motion == 1, swing * np.sin(6 * np.pi * share), 0.0)
        return shift, np.zeros_like(shift)

    path = path_through([[-50, 32.5, -5], [50, 32.5, -5]])
    points, normals, error = errors_of(path, BOX, wave, FLAT)
    wall = (normals[:, 1] > 0.999) & (np.abs(points[:, 0]) < 40) & (points[:, 2] > -4.9)
    assert wall.sum() > 300
    true = []
    for x in points[wall, 0]:

        def depth(u, x=x):
            return 32.5 + swing * np.sin(6 * np.pi * (u + 50) / length) - np.sqrt(64 - (x - u) ** 2)

        best = minimize_scalar(depth, bounds=(x - 1.5, x + 1.5), method="bounded", options={"xatol": 1e-10})
        true.append(best.fun - (32.5 - 8))
    assert error[wall] == pytest.approx(np.array(true), abs=0.02 * UM)


@pytest.mark.parametrize("tilt", [2e-3, -1e-2])
def test_a_tool_that_is_turned_about_its_feed_leaves_a_sloping_floor(tilt):
    """Its bottom lies in a plane; beside the path it is off by the distance from there times the tangent."""
    path = path_through([[-60, 0, -5], [60, 0, -5]])
    points, normals, error = errors_of(path, BOX, constant(turn=(tilt, 0, 0)), FLAT)
    floor = (normals[:, 2] > 0.999) & (np.abs(points[:, 1]) < 7.9) & (np.abs(points[:, 0]) < 40)
    assert floor.sum() > 300
    assert error[floor] == pytest.approx(points[floor, 1] * np.tan(tilt), abs=NEAR)


@pytest.mark.slow
@pytest.mark.parametrize("along", [False, True])
def test_a_round_boss(along):
    """A full circle around a boss, shifted as a whole, or always outward."""
    ring, radius = 28.0, 20.0
    none = np.full(2, np.nan)
    arcs = Arcs(
        np.array([[np.nan] * 3, [0.0, 0.0, -5 * MM]]),
        np.array([[np.nan] * 3, [0.0, 0.0, 1.0]]),
        np.array([none[0], 2 * np.pi]),
    )
    path = path_through([[ring, 0, -5], [ring, 0, -5]], kinds=[Kind.PTP, Kind.CIRC], arcs=arcs)

    def outward(motion, share):
        angle = 2 * np.pi * share
        shift = 0.05 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
        return shift, np.zeros_like(shift)

    points, normals, error = errors_of(path, BOX, outward if along else constant(SHIFT), FLAT)
    boss = np.abs(np.hypot(points[:, 0], points[:, 1]) - radius) < 1e-3
    boss &= (points[:, 2] > -4.9) & (points[:, 2] < -0.1) & (np.abs(points[:, 1]) > 0.2)
    assert boss.sum() > 300
    true = 0.05 if along else in_circle(radius, np.zeros(2), points[boss, :2], normals[boss, :2], SHIFT[:2])
    assert error[boss] == pytest.approx(np.broadcast_to(true, boss.sum()), abs=NEAR)


@pytest.mark.slow
@pytest.mark.parametrize("tilt", [0.0, 25.0])
def test_grooves_of_a_ball_in_three_and_five_axes(tilt):
    """Across its path a ball leaves a circle, however its axis stands; a shift along the path leaves nothing."""
    rows = np.arange(-10, 11, 2.0)
    ends = [[x, y, -2] for i, y in enumerate(rows) for x in ((-60, 60) if i % 2 == 0 else (60, -60))]
    lean = np.array([0.0, np.sin(np.radians(tilt)), np.cos(np.radians(tilt))])
    # the tip of a tilted ball is beside its lowest point; its middle stays where it is
    tips = np.array(ends) + 5 * np.array([0, 0, 1.0]) - 5 * lean
    path = path_through(tips, axes=np.tile(lean, (len(tips), 1)))
    points, _, error = errors_of(path, BOX, constant(SHIFT), BALL)
    nearest = rows[np.argmin(np.abs(points[:, 1:2] - rows), axis=1)]
    groove = (np.abs(points[:, 1] - nearest) < 0.9) & (np.abs(points[:, 1]) < 10) & (points[:, 2] < -1.5)
    groove &= np.abs(points[:, 0]) < 45
    assert groove.sum() > 300
    middle = np.column_stack([nearest[groove], np.full(groove.sum(), 3.0)])
    u = (points[groove, 1:] - middle) / 5.0
    side = u @ SHIFT[1:]
    true = -(side + np.sqrt(25 - SHIFT[1:] @ SHIFT[1:] + side**2) - 5)
    assert error[groove] == pytest.approx(true, abs=NEAR)


@pytest.mark.slow
def test_a_groove_of_a_ball_up_and_down_is_the_envelope_of_its_places():
    """A surface of free form, the ball shifted by another vector at each place: along each normal what is left ends
    where the first of all its places does."""
    x = np.linspace(-60, 60, 121)
    rise = lambda x: -3 + 1.5 * np.sin(x / 9)  # noqa: E731

    def shift_at(x):
        return np.stack([0.03 * np.sin(x / 8), 0.05 * np.cos(x / 11), 0.04 * np.sin(x / 7 + 1)], axis=1)

    def moved(motion, share):
        at = x[motion - 1] + share * (x[motion] - x[motion - 1])
        return shift_at(at), np.zeros((len(motion), 3))

    points, normals, error = errors_of(
        path_through(np.column_stack([x, 0 * x, rise(x)])), BOX, moved, BALL, count=40_000
    )
    chosen = np.flatnonzero(
        (np.abs(points[:, 1]) < 2.5) & (np.abs(points[:, 0]) < 40) & (points[:, 2] < -0.5)
    )
    chosen = chosen[:: max(len(chosen) // 200, 1)]
    fine = np.linspace(-60, 60, 240_001)
    middle = np.column_stack([fine, 0 * fine, np.interp(fine, x, rise(x)) + 5.0]) + shift_at(fine)
    true = []
    for point, normal in zip(points[chosen], normals[chosen], strict=True):
        out = middle - point
        along = out @ normal
        rest = 25.0 - np.einsum("ki,ki->k", out, out) + along**2
        true.append((along - np.sqrt(np.where(rest >= 0, rest, np.nan)))[rest >= 0].min())
    assert len(chosen) > 100
    assert np.abs(true).max() > 0.04
    assert error[chosen] == pytest.approx(np.array(true), abs=NEAR)


def test_a_tilted_flank_is_a_plane_that_is_shifted():
    lean = np.array([0.0, -np.sin(0.3), np.cos(0.3)])
    path = path_through([[-60, 30, -15], [60, 30, -15]], axes=[lean, lean])
    points, normals, error = errors_of(path, BOX, constant(SHIFT), FLAT)
    inward = np.array([0.0, np.cos(0.3), np.sin(0.3)])
    flank = (normals @ inward > 0.9999) & (np.abs(points[:, 0]) < 45) & (points[:, 2] > -14)
    flank &= (points[:, 2] < -0.5) & (points[:, 1] < 39.5)
    assert flank.sum() > 200
    assert error[flank] == pytest.approx(np.full(flank.sum(), inward @ SHIFT), abs=0.01 * UM)


def test_a_line_in_pieces_is_one_line():
    """Distances to what is left do not depend on how a straight motion is divided, at any time of it."""
    from part_cases import sweeps_of

    from postproc.process.stock.cells import nearest_sweep, stock_distance

    x = np.linspace(-30, 30, 61)
    short = sweeps_of(path_through(np.column_stack([x, 0.3 * x, 0 * x - 5])), BOX, FLAT)[1]
    assert (short.stop > short.near).mean() > 0.5
    rng = np.random.default_rng(2)
    points = rng.uniform([-45, -20, -10], [45, 20, -0.1], (400, 3)) * MM
    for time in (1, 17, 60):
        end = path_through([[x[0], 0.3 * x[0], -5], [x[time], 0.3 * x[time], -5]])
        whole = sweeps_of(end, BOX, FLAT)[1]
        pieces = [stock_distance(short, *point, time) for point in points]
        one = [stock_distance(whole, *point, 99) for point in points]
        reach = min(short.grid[1], whole.grid[1])
        assert np.sign(pieces) == pytest.approx(np.sign(one))
        outside = np.array(one) > 0
        assert np.minimum(pieces, reach)[outside] == pytest.approx(np.minimum(one, reach)[outside], abs=1e-12)
    # of the pieces the one beside the point
    assert nearest_sweep(short, 0.0105, 0.0105 * 0.3, -5e-3, 60, 1e-3)[1] == 40


@pytest.mark.parametrize("slack", [0.0, 0.2 * MM])
@pytest.mark.parametrize("cutter", [FLAT, BALL], ids=lambda cutter: cutter.shape)
def test_no_list_leaves_out_a_motion_that_counts(cutter, slack):
    """Distances by the lists of the cells are those to every motion, at any time of a zigzag of short motions."""
    from part_cases import sweeps_of

    from postproc.process.stock.cell_lists import build_stock
    from postproc.process.stock.cells import stock_distance
    from postproc.process.stock.distance import swept_distance

    u = np.linspace(-40, 40, 41)
    rows = [np.column_stack([u[::way], 0 * u + 5 * k, 0 * u - 3 - k]) for k, way in enumerate((1, -1, 1, -1))]
    turn = np.array([[0.9, -0.436, 0], [0.436, 0.9, 0], [0, 0, 1]])
    sweeps, stock = sweeps_of(path_through(np.concatenate(rows) @ turn.T), BOX, cutter)
    listed, _ = build_stock(stock.blank, stock.sweeps, stock.cutters, 2 * MM, slack)
    rng = np.random.default_rng(3)
    points = rng.uniform([-45, -20, -10], [45, 30, -0.1], (150, 3)) * MM
    seen = 0
    for point, time in zip(points, rng.integers(1, len(stock.sweeps), 150), strict=True):
        every = [swept_distance(stock.sweeps, stock.cutters, j, *point, 1.0) for j in range(time)]
        found, true = stock_distance(listed, *point, time), min(every)
        assert (found > 0) == (true > 0)
        if 0 < true < listed.grid[1]:
            assert found <= true + 1e-12
            seen += found == pytest.approx(true, abs=1e-9)
    assert seen > 5
    assert len(sweeps.rows) == len(stock.sweeps)


def test_points_lie_on_the_surface_and_the_mesh_holds_its_volume():
    """A slot of known walls: points to 1 nm; the mesh is closed and has the volume of the part to 0.1 %."""
    from part_cases import sweeps_of

    from postproc.part.surface import find_surface

    _, stock = sweeps_of(path_through([[-60, 0, -5.123], [60, 0, -5.123]]), BOX, FLAT)
    surface = find_surface(stock, 20_000)
    own = surface.sweep >= 0
    points = surface.points[own] / MM
    on = np.minimum(np.abs(points[:, 2] + 5.123), np.abs(np.abs(points[:, 1]) - 8))
    assert on.max() < 1e-6
    area = 100 * (16 + 2 * 5.123)
    assert surface.area[own].sum() / MM**2 == pytest.approx(area, rel=0.06)
    corners = surface.vertices[surface.faces] / MM
    volume = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(100 * 80 * 20 - 100 * 16 * 5.123, rel=1e-3)
    edges = np.sort(surface.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] % 2 == 0).all()
