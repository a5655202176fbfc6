"""A machine that cuts: the arm of ``plant`` on MuJoCo with a tool, a step of stock and a cutting law of its own.

The stock is kept as fields, nothing as a list of sweeps: of flat tools the wall, the Y up to which they have come at
each (x, z), and the floor, the height that they left at each (x, y); of a ball the height at each (x, y).  At every
step along the program the tool is where the arm settles under the force that the tool meets there, and the force is
summed over angles and heights of its surface that lie in what the fields hold: both are found together, step by step.
Lengths in mm, forces in N, moments in N mm.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numba import njit
from scipy.optimize import root

from postproc.base.geometry import vector_from_rotation

KTC, KRC, KAC = 767.01, 168.8, 222.0  # N/mm2, EN AW-7075-T6
KTE, KRE, KAE = 27.7, 26.6, 0.7  # N/mm
STEP = {1: 0.8, 2: 0.25}  # along the path: the ball's turns at once at the ends of rows
RECENT = np.array([1, 2, 4, 8, 16])
DOWN = np.diag([1.0, -1.0, -1.0])  # A 0, B 0, C 180
BASE = np.array([1450.0, -100.0, 600.0])
SETTLED = 5e-5


@njit(cache=True)
def wall_near(wall, floor, x, z):
    """Y of the wall at (x, z), from rows above the floor."""
    i = min(max(x / 0.1, 0.0), wall.shape[0] - 1.001)
    a = int(i)
    s = i - a
    low = max(z, floor + 0.01)
    r = min(max(-low / 0.05, 0.0), wall.shape[1] - 1.001)
    k = int(r)  # row k is at -0.05 k, above
    # a row as low as the floor is met by some places of a tilted tool only: go on from those above
    if -0.05 * (k + 1) < floor + 0.02:
        k = max(k - 1, 0)
    t = -z / 0.05 - k
    upper = wall[a, k] * (1 - s) + wall[a + 1, k] * s
    lower = wall[a, k + 1] * (1 - s) + wall[a + 1, k + 1] * s
    if abs(upper - lower) > 0.2:  # a ledge
        return upper if t < 0.5 else lower
    return upper + t * (lower - upper)


@njit(cache=True)
def floor_near(floor, x, y):
    """Height of the floor at (x, y) where a tool has been, 0 where none has."""
    i = min(max(x / 0.25, 0.0), floor.shape[0] - 1.001)
    j = min(max(y / 0.25, 0.0), floor.shape[1] - 1.001)
    a, b = int(i), int(j)
    least = min(min(floor[a, b], floor[a + 1, b]), min(floor[a, b + 1], floor[a + 1, b + 1]))
    total, weight = 0.0, 0.0
    for m in range(2):
        for n in range(2):
            if floor[a + m, b + n] < least + 0.3:
                w = (1 - abs(i - a - m)) * (1 - abs(j - b - n)) + 1e-9
                total += w * floor[a + m, b + n]
                weight += w
    return total / weight


@njit(cache=True)
def bite(a, b, m, dphi):
    """Middle and width of the part of the angles from m dphi to (m + 1) dphi in which the depth, ``a`` and ``b`` at
    these, is above zero; width 0 where there is none."""
    first, last = m * dphi, (m + 1) * dphi
    if a <= 0 and b <= 0:
        return first, 0.0
    if a <= 0:
        first += dphi * a / (a - b)
    elif b <= 0:
        last -= dphi * b / (b - a)
    return 0.5 * (first + last), last - first


@njit(cache=True)
def flat_force(wall, floor, recent, tip, axis, feed, radius, chip, teeth, out):
    """Force and moment about the tip, base axes, of a flat tool; ``recent`` (K, 6) tips and axes of its last places."""
    out[:] = 0.0
    x = feed - (feed @ axis) * axis
    x = x / np.sqrt(x @ x)
    y = np.cross(axis, x)
    high = -tip[2] / axis[2]
    if high <= 0:
        return
    slices, angles = 100, 120
    dz, dphi = high / slices, np.pi / angles
    f, g = np.zeros(3), np.zeros(angles + 1)
    for n in range(slices):
        h = (n + 0.5) * dz
        c = tip + h * axis
        for m in range(angles + 1):
            s, co = np.sin(m * dphi), np.cos(m * dphi)
            px, py = c[0] + radius * (s * x[0] + co * y[0]), c[1] + radius * (s * x[1] + co * y[1])
            pz = c[2] + radius * (s * x[2] + co * y[2])
            bottom = floor_near(floor, px, py)
            d = max(py - wall_near(wall, bottom, px, pz), bottom - pz if bottom < 0 else -1.0)
            d = min(min(d, min(px, 120.0 - px)), min(py, 80.0 - py))
            for k in range(len(recent)):
                up = (pz - recent[k, 2]) / recent[k, 5]
                if up > 0:
                    ox = px - recent[k, 0] - up * recent[k, 3]
                    oy = py - recent[k, 1] - up * recent[k, 4]
                    d = min(d, np.sqrt(ox * ox + oy * oy) - radius)
            g[m] = d
        for m in range(angles):
            phi, width = bite(g[m], g[m + 1], m, dphi)
            if width == 0:
                continue
            s, co = np.sin(phi), np.cos(phi)
            scale = width * dz * teeth / (2 * np.pi)
            t, r, ax = (
                (KTC * chip * s + KTE) * scale,
                (KRC * chip * s + KRE) * scale,
                (KAC * chip * s + KAE) * scale,
            )
            f[0], f[1], f[2] = -t * co - r * s, t * s - r * co, -ax
            px, py = radius * s, radius * co
            mx, my, mz = py * f[2] - h * f[1], h * f[0] - px * f[2], px * f[1] - py * f[0]
            for k in range(3):
                out[k] += f[0] * x[k] + f[1] * y[k] + f[2] * axis[k]
                out[3 + k] += mx * x[k] + my * y[k] + mz * axis[k]


@njit(cache=True)
def ball_height(field, x, y):
    i, j = x / 0.05, (y - 38.0) / 0.05
    a, b = int(i), int(j)
    s, t = i - a, j - b
    one = field[a, b] * (1 - s) + field[a + 1, b] * s
    other = field[a, b + 1] * (1 - s) + field[a + 1, b + 1] * s
    return one * (1 - t) + other * t


@njit(cache=True)
def ball_force(field, tip, axis, feed, radius, chip, teeth, out):
    """As ``flat_force``, of a ball."""
    out[:] = 0.0
    x = feed - (feed @ axis) * axis
    if np.sqrt(x @ x) < 0.017:
        x = np.array([1.0, 0.0, 0.0]) - axis[0] * axis
    x = x / np.sqrt(x @ x)
    y = np.cross(axis, x)
    centre = tip + radius * axis
    rings, angles = 60, 120
    dk, dphi = 1.2 / rings, 2 * np.pi / angles
    v = np.array([feed @ x, feed @ y, feed @ axis])
    f, g = np.zeros(3), np.zeros(angles + 1)
    for n in range(rings):
        kappa = (n + 0.5) * dk
        sk, ck = np.sin(kappa), np.cos(kappa)
        for m in range(angles + 1):
            s, co = np.sin(m * dphi), np.cos(m * dphi)
            p = centre + radius * (sk * (s * x + co * y) - ck * axis)
            within = p[2] < 0 and 0 <= p[0] <= 120
            d = ball_height(field, p[0], p[1]) - p[2] if within else -1.0
            g[m] = min(d, radius * (sk * s * v[0] + sk * co * v[1] - ck * v[2]))
        for m in range(angles):
            phi, width = bite(g[m], g[m + 1], m, dphi)
            if width == 0:
                continue
            s, co = np.sin(phi), np.cos(phi)
            h = chip * (sk * s * v[0] + sk * co * v[1] - ck * v[2])
            scale = width * radius * dk * teeth / (2 * np.pi)
            t, r, e = (KTC * h + KTE) * scale, (KRC * h + KRE) * scale, (KAC * h + KAE) * scale
            # along the edge, towards the tip: down the meridian
            f[0] = -t * co - r * sk * s - e * ck * s
            f[1] = t * s - r * sk * co - e * ck * co
            f[2] = r * ck - e * sk
            px, py, pz = radius * sk * s, radius * sk * co, radius * (1 - ck)
            mx, my, mz = py * f[2] - pz * f[1], pz * f[0] - px * f[2], px * f[1] - py * f[0]
            for k in range(3):
                out[k] += f[0] * x[k] + f[1] * y[k] + f[2] * axis[k]
                out[3 + k] += mx * x[k] + my * y[k] + mz * axis[k]


@njit(cache=True)
def remove_flat(wall, floor, tip0, axis0, tip1, axis1, radius):
    """The fields after a flat tool went from one place to the next."""
    count = int(np.sqrt(((tip1 - tip0) ** 2).sum()) / 0.04) + 2
    for q in range(count):
        s = q / (count - 1)
        tip, axis = tip0 + s * (tip1 - tip0), axis0 + s * (axis1 - axis0)
        for i in range(
            max(int((tip[0] - radius) / 0.1), 0), min(int((tip[0] + radius) / 0.1) + 2, len(wall))
        ):
            for k in range(wall.shape[1]):
                up = (-0.05 * k - tip[2]) / axis[2]
                if up < 0:
                    break
                off = 0.1 * i - tip[0] - up * axis[0]
                if abs(off) < radius:
                    reach = tip[1] + up * axis[1] + np.sqrt(radius * radius - off * off)
                    wall[i, k] = max(wall[i, k], reach)
        if q % 4 and q < count - 1:
            continue
        for i in range(
            max(int((tip[0] - radius) / 0.25), 0), min(int((tip[0] + radius) / 0.25) + 2, len(floor))
        ):
            first = max(int((tip[1] - radius) / 0.25), 0)
            for j in range(first, min(int((tip[1] + radius) / 0.25) + 2, floor.shape[1])):
                dx, dy = 0.25 * i - tip[0], 0.25 * j - tip[1]
                if dx * dx + dy * dy < radius * radius:
                    floor[i, j] = min(floor[i, j], tip[2] - (dx * axis[0] + dy * axis[1]) / axis[2])


@njit(cache=True)
def remove_ball(field, tip0, axis0, tip1, axis1, radius):
    count = int(np.sqrt(((tip1 - tip0) ** 2).sum()) / 0.04) + 2
    for q in range(count):
        s = q / (count - 1)
        c = tip0 + s * (tip1 - tip0) + radius * (axis0 + s * (axis1 - axis0))
        if c[2] >= radius:
            continue
        wide = np.sqrt(radius * radius - max(c[2], 0.0) ** 2)
        for i in range(max(int((c[0] - wide) / 0.05), 0), min(int((c[0] + wide) / 0.05) + 2, len(field))):
            first = max(int((c[1] - 38.0 - wide) / 0.05), 0)
            for j in range(first, min(int((c[1] - 38.0 + wide) / 0.05) + 2, field.shape[1])):
                square = radius * radius - (0.05 * i - c[0]) ** 2 - (0.05 * j + 38.0 - c[1]) ** 2
                if square > 0:
                    field[i, j] = min(field[i, j], c[2] - np.sqrt(square))


@dataclass
class Move:
    line: int
    rapid: bool
    tool: int
    feed: float  # mm/min
    spindle: float  # 1/min
    points: np.ndarray  # (K, 3), 0.5 mm apart


def moves_of(text):
    """The straight and round moves of a program in absolute mm with G0, G1, G2, its T and S."""
    at = {"X": np.nan, "Y": np.nan, "Z": np.nan}
    code, feed, turns, tool = 0, 0.0, 0.0, 0
    for number, line in enumerate(text.splitlines(), 1):
        words = re.findall(r"([A-Z])\s*(-?[0-9.]+)", re.sub(r"\(.*?\)", "", line))
        given = dict(words)
        tool = int(given.get("T", tool))
        turns, feed = float(given.get("S", turns)), float(given.get("F", feed))
        for letter, value in words:
            code = int(value) if letter == "G" and float(value) < 4 else code
        start = np.array([at[letter] for letter in "XYZ"])
        at.update({letter: float(value) for letter, value in words if letter in "XYZ"})
        end = np.array([at[letter] for letter in "XYZ"])
        if not set(given) & set("XYZ") or np.isnan(start).any() or np.isnan(end).any():
            continue
        count = max(int(np.ceil(np.linalg.norm(end - start) / STEP[tool])), 1)
        share = np.linspace(0, 1, count + 1)[:, None]
        points = start + share * (end - start)
        if code == 2:
            middle = start[:2] + np.array([float(given.get(letter, 0)) for letter in "IJ"])
            ends = [np.arctan2(*(p[:2] - middle)[::-1]) for p in (start, end)]
            sweep = (ends[0] - ends[1]) % (2 * np.pi)
            radius = np.linalg.norm(start[:2] - middle)
            count = int(np.ceil(radius * sweep / STEP[tool]))
            share = np.linspace(0, 1, count + 1)[:, None]
            angle = ends[0] - share[:, 0] * sweep
            points = start + share * (end - start)
            points[:, :2] = middle + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        yield Move(number, code == 0, tool, feed, turns, points)


class Arm:
    """The arm of a plant and one of its tools: where the tool settles, linear in the force between places."""

    def __init__(self, plant, tool, guess):
        self.plant, self.tool, self.guess = plant, tool, guess
        self.nodes = {}

    def motors(self, tip):
        """Motor angles that bring the tool of the unloaded arm to ``tip`` [mm], pointing down, by Newton."""
        q, goal = self.guess.copy(), (BASE + tip) / 1000

        def off(angles):
            rest = self.plant.rest(angles, np.zeros(6), self.tool)
            turn = vector_from_rotation((DOWN @ rest.rotation.T)[None])[0]
            return np.concatenate([goal - rest.position, turn])

        here = off(q)
        for _ in range(6):
            if np.abs(here).max() < 1e-10:
                break
            slopes = np.array([(off(q + 1e-6 * step) - here) / 1e-6 for step in np.eye(6)]).T
            q = q - np.linalg.solve(slopes, here)
            here = off(q)
        assert np.abs(here).max() < 1e-9
        self.guess = q
        return q

    def displaced(self, q, wrench):
        """(6,) mm and rad by which ``wrench`` (6,) N, N mm displaces the tool."""
        rest = [self.plant.rest(q, w, self.tool) for w in (wrench * [1, 1, 1, 1e-3, 1e-3, 1e-3], np.zeros(6))]
        turn = vector_from_rotation((rest[0].rotation @ rest[1].rotation.T)[None])[0]
        return np.concatenate([(rest[0].position - rest[1].position) * 1000, turn])

    def line(self, tip, wrench):
        """Displacement at ``wrench`` and its derivative (6, 6) at a tip, motors looked up."""
        q = self.motors(tip)
        here = self.displaced(q, wrench)
        sizes = np.array([20, 20, 20, 400, 400, 400.0])
        slope = np.array(
            [
                (self.displaced(q, wrench + s * e) - self.displaced(q, wrench - s * e)) / (2 * s)
                for s, e in zip(sizes, np.eye(6), strict=True)
            ]
        ).T
        return here - slope @ wrench, slope


class Machine:
    """Cuts a program.  tools: number -> (radius, teeth); arms: number -> Arm; coupled: with the force that is met."""

    NODES = 24.0  # mm between places where the arm is looked at

    def __init__(self, tools, arms):
        self.tools, self.arms = tools, arms
        self.wall = np.zeros((1202, 200))
        self.floor = np.zeros((482, 322))
        self.field = np.zeros((2402, 400))
        self.places, self.largest, self.worst = [], 0.0, 0.0
        self.tip, self.place = np.full(3, np.nan), np.full(3, np.nan)

    def run(self, text):
        chain, before = [], None
        wrench = np.zeros(6)
        for move in moves_of(text):
            step = move.points[-1] - move.points[0]
            cuts = not move.rapid and move.points[:, 2].min() < 1.0
            turned = before is not None and before @ step < 0.5 * np.linalg.norm(before) * np.linalg.norm(
                step
            )
            if not cuts or turned:
                self._end(chain)
                # where the path turns in the stock the tool goes on from where it is
                goes_on = cuts and chain and np.linalg.norm(move.points[0] - self.tip) < 0.01
                chain = chain[-1:] if goes_on else []
            before = step if cuts else None
            if cuts:
                wrench = self._cut(move, chain, wrench)
        self._end(chain)

    def _end(self, chain):
        """The fields of a flat tool after a run of moves in one direction."""
        for (tool, *one), (_, *other) in pairwise(chain):
            if tool == 1:
                remove_flat(self.wall, self.floor, *one, *other, self.tools[1][0])

    def _cut(self, move, chain, wrench):
        radius, teeth = self.tools[move.tool]
        chip = move.feed / (move.spindle * teeth)
        points = move.points
        along = np.append(0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
        many = max(int(np.ceil(along[-1] / self.NODES)), 1)
        at = np.linspace(0, along[-1], many + 1)
        arm = self.arms[move.tool]
        ends = [np.array([np.interp(a, along, points[:, k]) for k in range(3)]) for a in at]
        guess = np.array([150.0, 150, -50, 0, 0, 0]) * 0.5
        lines = [arm.line(tip, guess) for tip in ends]
        for index in range(len(points)):
            node = min(np.searchsorted(at, along[index], side="right") - 1, many - 1)
            s = (along[index] - at[node]) / (at[node + 1] - at[node])
            base, slope = (
                (1 - s) * one + s * other for one, other in zip(lines[node], lines[node + 1], strict=True)
            )
            fresh = index == 0 and chain and chain[-1][0] == move.tool
            if fresh and np.linalg.norm(points[0] - self.tip) < 0.01:
                continue  # where the tool is already
            feed = points[min(index + 1, len(points) - 1)] - points[max(index - 1, 0)]
            came = (points[index] - self.tip, self.place) if chain and chain[-1][0] == move.tool else None
            feed = feed / np.linalg.norm(feed)
            wrench, moved = self._settle(
                move.tool, points[index], feed, base, slope, wrench, chip, chain, came
            )
            self.tip, self.place = points[index], points[index] + moved[:3]
            place = (points[index] + moved[:3], np.array([0, 0, 1.0]) + np.cross(moved[3:], [0, 0, 1.0]))
            self.places.append((move.line, *place, *wrench))
            if move.tool == 2 and chain and chain[-1][0] == 2:
                remove_ball(self.field, *chain[-1][1:], *place, radius)
            if not fresh or move.tool == 2:
                chain.append((move.tool, *place))
        return wrench

    def _settle(self, tool, tip, feed, base, slope, wrench, chip, chain, came=None):
        """The wrench and the displacement (6,) that belong to each other.

        came: step of the command to ``tip`` and the place that the tool comes from.  It cuts in the direction in which
        it moves itself, and with the chip of its own speed: where the path turns, it yields, and follows only then.
        """
        radius, teeth = self.tools[tool]
        recent = [chain[-k] for k in RECENT if k <= len(chain)]
        recent = np.array([np.concatenate(one[1:]) for one in recent]).reshape(-1, 6)
        met, old_w, old_r = np.zeros(6), None, None

        def meet(wrench):
            moved = base + slope @ wrench
            at, axis = tip + moved[:3], np.array([0, 0, 1.0]) + np.cross(moved[3:], [0, 0, 1.0])
            axis = axis / np.linalg.norm(axis)
            own, thick = feed, chip
            if came is not None:
                own = at - came[1]
                far = max(np.linalg.norm(own), 1e-9)
                own, thick = own / far, chip * far / np.linalg.norm(came[0])
            if tool == 1:
                flat_force(self.wall, self.floor, recent, at, axis, own, radius, thick, teeth, met)
            else:
                ball_force(self.field, at, axis, own, radius, thick, teeth, met)
            return met - wrench

        first = wrench
        for _ in range(60):
            rest = meet(wrench)
            size = np.linalg.norm((slope @ rest)[:3])
            if size < SETTLED:
                break
            # half way at first, then as far as the change of the rest says
            step = 0.5
            if old_r is not None:
                u, v = slope[:3] @ (rest - old_r), slope[:3] @ (wrench - old_w)
                step = float(np.clip(-(u @ v) / max(u @ u, 1e-30), 0.1, 1.0))
            old_w, old_r = wrench, rest
            wrench = wrench + step * rest
        if size > SETTLED * 100:
            sizes = np.array([100, 100, 100, 1000, 1000, 1000.0])
            for start in (first, wrench):
                found = root(
                    lambda x: meet(x * sizes) / sizes, start / sizes, options={"eps": 1e-6, "xtol": 1e-5}
                )
                other = np.linalg.norm((slope @ meet(found.x * sizes))[:3])
                if other < size:
                    size, wrench = other, found.x * sizes
        self.worst = max(self.worst, size)
        self.largest = max(self.largest, np.linalg.norm(wrench[:3]))
        return wrench, base + slope @ wrench

    def errors(self, points, normals):
        """(K,) mm along the normals from the points (K, 3) of the part that is meant to what was cut, above zero where
        material remains; NaN where the fields do not hold the surface.  And which are of the wall, the floor, the
        wave."""
        x, y, z = points.T
        error = np.full(len(points), np.nan)
        wall = (normals[:, 1] < -1 + 1e-6) & (np.abs(y - 32.5) < 0.01) & (x > 1) & (x < 109)
        error[wall] = 32.5 - _between(self.wall, x[wall] / 0.1, -z[wall] / 0.05)
        floor = (normals[:, 2] > 1 - 1e-6) & (np.abs(z + 8) < 0.01) & (x < 108) & (y < 31)
        error[floor] = _between(self.floor, x[floor] / 0.25, y[floor] / 0.25) + 8
        wave = (y > 40) & (z < -0.02) & (normals[:, 2] > 0.5)
        low, high = np.full(wave.sum(), -3.0), np.full(wave.sum(), 3.0)
        for _ in range(40):
            middle = 0.5 * (low + high)
            at = points[wave] + middle[:, None] * normals[wave]
            inside = at[:, 2] < _between(self.field, at[:, 0] / 0.05, (at[:, 1] - 38) / 0.05)
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        error[wave] = 0.5 * (low + high)
        return error, {"wall": wall, "floor": floor, "wave": wave}


def _between(field, x, y):
    """Values of a field between its nodes."""
    a = np.clip(x.astype(int), 0, field.shape[0] - 2)
    b = np.clip(y.astype(int), 0, field.shape[1] - 2)
    s, t = x - a, y - b
    one = field[a, b] * (1 - s) + field[a + 1, b] * s
    return one * (1 - t) + (field[a, b + 1] * (1 - s) + field[a + 1, b + 1] * s) * t
