"""Engagement and force of cuts whose truth is known in closed form, or by plain quadrature."""

import numpy as np
import pytest

pytest.importorskip("numba")

from stock_cases import (
    BALL,
    BULL,
    CHIP,
    CONE,
    FLAT,
    KNOWN,
    MM,
    block,
    force_off,
    path_through,
    run,
    within_goal,
)

from postproc.process.milling_forces import Engagement, engagement, mean_force
from postproc.toolpath import Arcs, Kind

DEG = np.pi / 180
BLOCK = block([0, -60, -40], [200, 60, 0])


def expected(direction, width, depth, cutter=FLAT, chip=CHIP):
    entry, out = engagement(direction, width, 2 * cutter.radius)
    cut = Engagement(2 * cutter.radius, cutter.teeth, cutter.helix, depth, entry, out, KNOWN)
    return mean_force(cut, np.array([chip]))[0], entry, out


def place(cut, row):
    return cut.entry[row] / DEG, cut.exit[row] / DEG


def angles_off(cut, row, entry, out):
    """deg, the larger of both."""
    return max(abs(cut.entry[row] - entry), abs(cut.exit[row] - out)) / DEG


@pytest.mark.parametrize("depth", [5.123, 0.37, 11.9, 0.011])
@pytest.mark.parametrize("width", [16.0, 8.0, 1.6, 0.5, 0.3, 0.05, 0.01])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_slots_and_shoulders(depth, width, direction):
    """Angles within 0.1 deg, forces within 0.5 %: arcs down to 2.9 deg, depths off any boundary of a slice."""
    side, sign = (1, 1) if direction == "down" else (1, -1)
    y = 0 if width == 16 else side * (60 + 8 - width)
    ends = [[90, y, -depth], [110, y, -depth]]
    cut = run(path_through(ends[::sign]), BLOCK, FLAT)
    force, entry, out = expected("slot" if width == 16 else direction, width * MM, depth * MM)
    within_goal("slots, shoulders, thin arcs", "angle deg", angles_off(cut, 1, entry, out), 0.1)
    within_goal("slots, shoulders, thin arcs", "force %", force_off(cut.mean[1, :3], force), 0.5)
    assert cut.depth[1] / MM == pytest.approx(depth, abs=0.01)
    assert cut.width[1] / MM == pytest.approx(width, abs=0.01)
    assert cut.volume[1] / MM**3 == pytest.approx(20 * width * depth, rel=0.005)
    assert cut.chip[1] == pytest.approx(
        CHIP * (1 if width >= 8 else np.sin(entry if direction == "down" else out)), rel=0.01
    )


@pytest.mark.parametrize("tilt", [17.0, 45.0, 88.0])
def test_walls_in_any_direction(tilt):
    """The angle of a wall in the plane does not count: the stock has no grid."""
    c, s = np.cos(tilt * DEG), np.sin(tilt * DEG)

    def turned(points):
        return [[c * x - s * y, s * x + c * y, z] for x, y, z in points]

    wide = block([-150, -150, -10], [150, 150, 0])
    first = turned([[-120, 0, -5], [120, 0, -5]])
    second = turned([[10, 0.5, -5], [-10, 0.5, -5]])
    cut = run(
        path_through([*first, second[0], second[1]], kinds=[Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN]),
        wide,
        FLAT,
    )
    force, entry, out = expected("down", 0.5 * MM, 5 * MM)
    # fresh material is on the right of the motion back, 0.5 mm of the slot beside
    within_goal("walls at 17, 45, 88 deg", "angle deg", angles_off(cut, 3, entry, out), 0.1)
    within_goal("walls at 17, 45, 88 deg", "force %", force_off(cut.mean[3, :3], force), 0.5)


@pytest.mark.parametrize("width", [0.3, 0.5, 0.592, 0.5945, 0.597, 1.2, 3.0])
def test_walls_above_a_floor_that_is_cut_already(width):
    """Where the bottom of the tool runs on the floor that the pass before left, both are the nearest surface beside the
    wall: circles there end where the others do."""
    ends = [[-112, -8, -8], [140, -8, -8], [-112, width - 8, -8], [100, width - 8, -8]]
    path = path_through(ends, kinds=[Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN])
    cut = run(path, block([-100, -60, -30], [120, 60, 0]), FLAT)
    force, entry, out = expected("up", width * MM, 8 * MM)
    within_goal("walls above a floor", "angle deg", angles_off(cut, 3, entry, out), 0.1)
    assert cut.width[3] / MM == pytest.approx(width, abs=2e-3)
    within_goal("walls above a floor", "force %", force_off(cut.along[3, 1, :3], force), 0.1)


def test_entry_ramps_over_the_radius():
    """Half way into a face the first teeth cut what the circle over the face says: acos of the depth of entry."""
    entered = 3.0  # mm of the radius 8 beyond the face
    cut = run(path_through([[-8 + entered - 0.01, 0, -5], [-8 + entered + 0.01, 0, -5]]), BLOCK, FLAT)
    half = np.arccos((8 - entered) / 8) / DEG
    within_goal(
        "entry into a face", "angle deg", angles_off(cut, 1, (90 - half) * DEG, (90 + half) * DEG), 0.1
    )


def test_a_corner_adds_the_engagement_of_both_walls():
    """In the corner of a slot finished with 0.5 mm on both walls: the wall at the side and the one ahead."""
    path = [[60, -40, -5], [60, 40, -5], [60.5, 0, -5], [60.5, 40.49, -5], [60.5, 40.5, -5]]
    cut = run(path_through(path, kinds=[Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN, Kind.LIN]), BLOCK, FLAT)
    phi = np.linspace(0, np.pi, 1_000_001)  # from the left, over the feed along +y, to the right
    x, y = 60.5 - 8 * np.cos(phi), 40.495 + 8 * np.sin(phi)
    stock = np.hypot(x - 60, np.maximum(y - 40, 0)) > 8
    entry, out = phi[stock][[0, -1]] / DEG
    within_goal("corner", "angle deg", angles_off(cut, 4, entry * DEG, out * DEG), 0.1)
    width = np.trapezoid(np.where(stock, 8 * np.sin(phi), 0.0), phi)
    assert cut.volume[4] / MM**3 == pytest.approx(0.01 * 5 * width, rel=0.005)


def test_a_ramp_cuts_with_its_bottom_too():
    """Going down at 3 deg into full material: the sides as in a slot, the bottom over the whole disc."""
    slope = np.tan(3 * DEG)
    ends = [[90, 0, -5 + 10 * slope], [110, 0, -5 - 10 * slope]]
    cut = run(path_through(ends), BLOCK, FLAT)
    volume = (
        20 * 16 * 5 + np.pi * 64 * 20 * slope
    )  # mm3: the sides at their mean depth, and the disc's descent
    assert cut.volume[1] / MM**3 == pytest.approx(volume, rel=0.005)
    # linear in the depth, so its mean is that of the middle; the chip of the sides is that of the way in the plane
    side, _, _ = expected("slot", 16 * MM, 5 * MM, chip=CHIP * np.cos(3 * DEG))
    thrust = 3 * FLAT.radius * (KNOWN.cutting[1] * CHIP * np.sin(3 * DEG) + KNOWN.edge[1])
    force = side + np.array([0, 0, thrust])
    within_goal("ramp", "force %", force_off(cut.mean[1, :3], force), 0.5)


def test_a_helical_ramp_removes_what_its_columns_say():
    """Half a turn on a radius of 10 mm, down by 3 mm: a column is cut as deep as the tool last covers it."""
    none = np.full((2, 3), np.nan)
    centre, normal, sweep = none.copy(), none.copy(), none[:, 0].copy()
    centre[1], normal[1], sweep[1] = [0.1, 0, -2 * MM], [0, 0, 1], np.pi
    path = path_through(
        [[110, 0, -2], [90, 0, -5]],
        kinds=[Kind.PTP, Kind.CIRC],
        arcs=Arcs(centre=centre, normal=normal, sweep=sweep),
    )
    cut = run(path, BLOCK, FLAT)
    x, y = np.meshgrid(np.arange(-17.975, 18, 0.05), np.arange(-7.975, 18, 0.05))
    depth = np.zeros(x.shape)
    for angle in np.linspace(0, np.pi, 1801):
        covered = np.hypot(x - 10 * np.cos(angle), y - 10 * np.sin(angle)) < 8
        depth[covered] = 2 + 3 * angle / np.pi
    volume = depth.sum() * 0.05**2 - np.pi * 64 * 2  # the first place is where it stands already
    assert cut.volume[1] / MM**3 == pytest.approx(volume, rel=0.005)


def test_a_plunge_is_the_thrust_of_its_end_edges():
    """Straight down: Fz = teeth R (Krc c + Kre) and Mz = teeth R^2 / 2 (Ktc c + Kte), and no force across."""
    cut = run(path_through([[100, 0, -5], [100, 0, -6]]), BLOCK, FLAT)
    ktc, krc, _ = KNOWN.cutting
    kte, kre, _ = KNOWN.edge
    radius = FLAT.radius
    thrust = 3 * radius * (krc * CHIP + kre)
    torque = 3 * radius**2 / 2 * (ktc * CHIP + kte)
    # an end edge has an axial force towards the axis, which cancels over a turn
    within_goal("plunge", "force %", force_off(cut.mean[1, :3], np.array([0, 0, thrust])), 0.5)
    assert cut.mean[1] == pytest.approx([0, 0, thrust, 0, 0, torque], rel=1e-3, abs=1e-3 * thrust)
    assert cut.volume[1] / MM**3 == pytest.approx(np.pi * 64, rel=1e-3)
    assert cut.exit[1] - cut.entry[1] == pytest.approx(2 * np.pi, abs=1e-6)


def integrated(cutter, depth, chip=CHIP, slices=2000, angles=4000, beside=None):
    """The mean force and the area across the feed of a slot, by plain quadrature over the profile's length and angle:
    by height it would be coarse near the tip of a ball, where edges lie across the axis.

    beside [m]: what a row so far to the right left is cut."""
    part = (np.arange(slices) + 0.5) / slices
    if cutter.taper is not None:
        top = min(depth, (cutter.radius - cutter.tip) / np.tan(cutter.taper))
        r = np.concatenate([cutter.tip + part * top * np.tan(cutter.taper), np.full(slices, cutter.radius)])
        k = np.repeat([np.pi / 2 - cutter.taper, np.pi / 2], slices)
        length = np.repeat([top / np.cos(cutter.taper), depth - top], slices) / slices
    else:
        top = min(depth, cutter.corner)
        last = np.arccos(1 - top / max(cutter.corner, 1e-12))
        k = np.concatenate([part * last, np.full(slices, np.pi / 2)])
        r = cutter.radius - cutter.corner + cutter.corner * np.sin(k)
        length = np.repeat([cutter.corner * last, depth - top], slices) / slices
    phi = (np.arange(angles) + 0.5) / angles * np.pi
    s, c = np.sin(phi), np.cos(phi)
    sk, ck, r = (v[:, None] for v in (np.sin(k), np.cos(k), r))
    thick = sk * s
    area = length[:, None] * np.full(angles, np.pi / angles)
    if beside is not None:
        area = np.where(r * c > r - beside, area, 0.0)
    weight = area * cutter.teeth / (2 * np.pi)
    t, n, a = (
        (cutting * chip * thick + edge) * weight
        for cutting, edge in zip(KNOWN.cutting, KNOWN.edge, strict=True)
    )
    force = np.array(
        [
            (-t * c - n * sk * s - a * ck * s).sum(),
            (t * s - n * sk * c - a * ck * c).sum(),
            (n * ck - a * sk).sum(),
        ]
    )
    return force, (thick * r * area).sum()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("cutter", "depth", "limit"),
    [(BALL, 0.8, 0.02), (BALL, 3.3, 0.02), (BULL, 1.1, 0.005), (BULL, 4.7, 0.005), (CONE, 3.7, 0.005)],
)
def test_slots_of_curved_cutters(cutter, depth, limit):
    cut = run(path_through([[95, 0, -depth], [105, 0, -depth]]), BLOCK, cutter)
    force, rate = integrated(cutter, depth * MM)
    off = force_off(cut.mean[1, :3], force)
    within_goal(f"slots: {cutter.shape}", "force %", off, 100 * limit)
    assert off < 0.05  # the edges at the tip of a ball, where the profile has no slope, are 1 %
    assert cut.volume[1] == pytest.approx(rate * 10 * MM, rel=limit)


@pytest.mark.slow
@pytest.mark.parametrize("beside", [2.0, 0.5, 0.2])
@pytest.mark.parametrize(
    ("cutter", "depth", "limit"),
    [(BALL, 1.3, 0.02), (BULL, 4.7, 0.005), (CONE, 3.7, 0.005), (FLAT, 5.0, 0.005)],
    ids=lambda value: getattr(value, "shape", None),
)
def test_rows_beside_one_another(cutter, depth, limit, beside):
    """A second row at the depth of the first: walls of balls, bulls and cones with some ae."""
    points = [[60, -beside, -depth], [140, -beside, -depth], [95, 0, -depth], [105, 0, -depth]]
    kinds = [Kind.PTP, Kind.LIN, Kind.PTP, Kind.LIN]
    cut = run(path_through(points, kinds=kinds), BLOCK, cutter)
    force, rate = integrated(cutter, depth * MM, beside=beside * MM)
    within_goal(
        f"rows with ae 0.2 to 2 mm: {cutter.shape}", "force %", force_off(cut.mean[3, :3], force), 100 * limit
    )
    assert cut.volume[3] == pytest.approx(rate * 10 * MM, rel=limit)


@pytest.mark.sample(1)
@pytest.mark.parametrize("tilt", [10.0, 30.0])
def test_a_tilted_ball(tilt):
    """A ball that leans back along the feed: cross-section of the sphere, force by quadrature on the tilted sphere."""
    axis = [-np.sin(tilt * DEG), 0, np.cos(tilt * DEG)]
    depth = 1.3
    centre = np.array([[95.0, 0, 5 - depth], [105.0, 0, 5 - depth]])
    tips = centre - 5 * np.array(axis)
    cut = run(path_through(tips, [axis, axis]), BLOCK, BALL)
    area = 25 * np.arccos(1 - depth / 5) - (5 - depth) * np.sqrt(10 * depth - depth**2)
    assert cut.volume[1] / MM**3 == pytest.approx(10 * area, rel=0.01)
    # quadrature over the sphere in the axes of the tool: x across the axis in the plane of the feed
    x_axis = np.array([np.cos(tilt * DEG), 0, np.sin(tilt * DEG)])
    kappa = (np.arange(3000) + 0.5) / 3000 * np.pi / 2
    phi = (np.arange(3000) + 0.5) / 3000 * 2 * np.pi
    sk, ck = np.sin(kappa)[:, None], np.cos(kappa)[:, None]
    s, c = np.sin(phi), np.cos(phi)
    normal_x, normal_z = sk * s, -ck
    height = 5 - depth + 5 * (normal_x * x_axis[2] + normal_z * axis[2])
    thick = normal_x * x_axis[0] + normal_z * axis[0]
    cuts = (height < 0) & (thick > 0)
    weight = np.where(cuts, 5 * MM * (np.pi / 2 / 3000) * (2 * np.pi / 3000) * 3 / (2 * np.pi), 0.0)
    t, n, a = ((kc * CHIP * thick + ke) * weight for kc, ke in zip(KNOWN.cutting, KNOWN.edge, strict=True))
    force = [
        (-t * c - n * sk * s - a * ck * s).sum(),
        (t * s - n * sk * c - a * ck * c).sum(),
        (n * ck - a * sk).sum(),
    ]
    within_goal("ball tilted by 10 and 30 deg", "force %", force_off(cut.mean[1, :3], force), 2.0)


def test_the_force_of_the_first_law_is_that_of_operations():
    """Moments: the side force acts at half the depth, the torque is that of the power."""
    cut = run(path_through([[90, 0, -5], [110, 0, -5]]), BLOCK, FLAT)
    fx, fy, _, mx, my, mz = cut.mean[1]
    half = 2.5 * MM
    ktc, kte = KNOWN.cutting[0], KNOWN.edge[0]
    torque = 3 / (2 * np.pi) * FLAT.radius * 5 * MM * (2 * ktc * CHIP + np.pi * kte)
    assert mz == pytest.approx(torque, rel=1e-3)
    axial = 3 / (2 * np.pi) * FLAT.radius * 5 * MM * (np.pi / 2 * KNOWN.cutting[2] * CHIP + 2 * KNOWN.edge[2])
    assert my == pytest.approx(half * fx + axial, rel=2e-3)
    assert cut.power[1] == pytest.approx(torque * 2 * np.pi * 200, rel=1e-3)
    assert fy > 0 > fx
    assert mx < 0


def test_air_is_air():
    """Above, beside, on a surface that is cut already, and upward."""
    points = [[-20, 0, 5], [220, 0, 5], [220, 0, -5], [-20, 0, -5], [220, 0, -5], [220, 0, 30]]
    cut = run(path_through(points), BLOCK, FLAT)
    assert cut.cuts.tolist() == [False, False, False, True, False, False]
    assert cut.hits == {}


def test_an_arc_is_cut_as_a_ring():
    """A full slot on an arc, and the same arc again 0.5 mm further out: volumes of rings."""
    count = 4
    centre = np.full((count, 3), np.nan)
    normal, sweep = centre.copy(), np.full(count, np.nan)
    for row in (1, 3):
        centre[row], normal[row], sweep[row] = [0.1, 0, 0], [0, 0, 1], np.pi
    path = path_through(
        [[130, 0, -5], [70, 0, -5], [130.5, 0, -5], [69.5, 0, -5]],
        kinds=[Kind.PTP, Kind.CIRC, Kind.PTP, Kind.CIRC],
        arcs=Arcs(centre=centre, normal=normal, sweep=sweep),
    )
    cut = run(path, block([0, -60, -40], [200, 60, 0]), FLAT)
    # half a ring; the disc at its start is where the cutter stands already
    assert cut.volume[1] / MM**3 == pytest.approx(np.pi / 2 * (38**2 - 22**2) * 5, rel=0.005)
    x, y = np.meshgrid(np.arange(60.025, 140, 0.05), np.arange(-9.975, 40, 0.05))

    def swept(radius):
        """Which points are within 8 mm of the half circle about (100, 0)."""
        angle = np.clip(np.mod(np.arctan2(y, x - 100) + np.pi / 2, 2 * np.pi) - np.pi / 2, 0, np.pi)
        return np.hypot(x - 100 - radius * np.cos(angle), y - radius * np.sin(angle)) < 8

    new = swept(30.5) & ~swept(30.0) & (np.hypot(x - 130.5, y) > 8)
    assert cut.volume[3] / MM**3 == pytest.approx(new.sum() * 0.05**2 * 5, rel=0.01)


@pytest.mark.slow
def test_short_motions_cut_what_one_long_one_does():
    """A shoulder in motions of 1 mm across a slot of 5 mm that is open already: each motion's volume, and the force."""
    slot = [[100, 80, -20], [100, -80, -20]]
    x = np.arange(60, 141, 1.0)
    narrow = FLAT.__class__(1, "flat", 2.5 * MM, length=40 * MM, teeth=3, helix=np.pi / 6)
    points = [*slot, *np.column_stack([x, 0 * x + 62, 0 * x - 5])]
    tools = [1, 1, *[2] * len(x)]
    kinds = [Kind.PTP, Kind.LIN, Kind.PTP, *[Kind.LIN] * (len(x) - 1)]
    cut = run(path_through(points, kinds=kinds, tools=tools), BLOCK, narrow, FLAT)
    # what the front of the cutter newly covers on the way from x to x + 1, by columns of 10 um
    fine = np.arange(50.005, 160, 0.01)
    height = np.arange(54.005, 60, 0.01)

    def reached(end):
        front = end + np.sqrt(64 - (62 - height) ** 2)
        return (fine[:, None] < front) & (np.abs(fine - 100) > 2.5)[:, None]

    rows = np.arange(3 + 10, len(points))
    new = np.array([(reached(x[row - 2]) & ~reached(x[row - 3])).sum() * 1e-4 * 5 for row in rows])
    assert new.min() < 4  # in the slot
    assert cut.volume[rows] / MM**3 == pytest.approx(new, abs=0.02 * 30)
    assert cut.volume[rows].sum() / MM**3 == pytest.approx(new.sum(), rel=0.002)
    force, _, _ = expected("down", 6 * MM, 5 * MM)
    within_goal("short motions", "force %", force_off(cut.mean[-2, :3], force), 0.5)


def test_collisions_have_their_motion():
    """A rapid through the block, a pocket deeper than the edges, and a holder that comes too near."""
    from dataclasses import replace

    path = path_through([[-20, 0, -5], [220, 0, -5]], kinds=[Kind.PTP, Kind.PTP])
    path2 = path_through([[-20, 0, -5], [220, 0, -5], [220, 0, 50]], kinds=[Kind.PTP, Kind.LIN, Kind.PTP])
    assert run(path, BLOCK, FLAT).hits == {1: (0,)}
    assert run(path2, BLOCK, FLAT).hits == {}
    short = replace(FLAT, length=4 * MM, shank=8 * MM)
    assert run(path2, BLOCK, short).hits == {1: (1,)}
    thin = replace(FLAT, length=4 * MM, shank=7 * MM)
    assert run(path2, BLOCK, thin).hits == {1: (1,)}  # the last millimetre stays, and the shank is in it
    held = replace(FLAT, length=4.5 * MM, shank=7 * MM, holder=(20 * MM, 4.8 * MM))
    assert 2 in run(path2, BLOCK, held).hits[1]
    clear = replace(FLAT, length=6 * MM, shank=7 * MM, holder=(20 * MM, 8 * MM))
    assert run(path2, BLOCK, clear).hits == {}
