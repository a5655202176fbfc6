"""Arms of other kinds than the benchmark's own, moved by plain matrices: a table of axes and lengths is all that is
known of an arm here, and nothing of the package's kinematics or effects is used.

An axis is a line in the base at the zero pose; the arm is the product of the screws about (or along) its axes.  What is
wrong is drawn as a mechanic knows it: one axis that is shifted or turned, one zero, one wave of a gear, one soft joint;
or it is one of the errors of ``UNKNOWN``, which no library has.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

MM, DEG, GRAVITY = 1e-3, np.pi / 180, 9.80665

TARGETS = np.array([[0.12, 0.02, 0.05], [-0.07, 0.11, 0.09], [-0.05, -0.10, 0.02]])
"""[m] on the flange, in its axes."""

ROBOTS = Path(__file__).parent.parent.parent / "robots"

FLOOR = -0.2
"""[m] below which no reflector goes."""


@dataclass(frozen=True)
class Arm:
    """names; rows (n, 3) of a, alpha, d [m, rad] by Denavit and Hartenberg; limits (n, 2)
    [rad, m]; linear: names of joints that move along their axis; external: the one of seven that keeps its value."""

    name: str
    names: tuple[str, ...]
    rows: np.ndarray
    limits: np.ndarray
    linear: tuple[str, ...] = ()
    external: str = ""

    @property
    def turns(self) -> np.ndarray:
        return np.array([name not in self.linear for name in self.names])

    def file(self, effects: str = "effects: []") -> bytes:
        """The robot file."""
        if not len(self.rows):
            text = (ROBOTS / f"{self.name}.yaml").read_text(encoding="utf-8")
            return text.replace("effects: []", effects).encode()
        rows = ", ".join(
            f"{{a: {a / MM:.6g}, alpha: {al / DEG:.6g}, d: {d / MM:.6g}}}" for a, al, d in self.rows
        )
        geometry = f"dh: {{unit: mm, angle_unit: deg, rows: [{rows}]}}"
        lines = [
            f"name: {self.name}",
            "maker_name: an arm of the benchmark",
            "geometry:",
            "  source: drawing",
        ]
        lines += [f"  {geometry}", "joints:", "  source: drawing", "  unit: deg"]
        for k, name in enumerate(self.names):
            unit = MM if name in self.linear else DEG
            low, high = self.limits[k] / unit
            kind = "kind: prismatic, unit: mm, " if name in self.linear else ""
            lines.append(f"  {name}: {{{kind}limits: [{low:.6g}, {high:.6g}]}}")
        if self.external:
            lines.append(f"  external: {self.external}")
        return ("\n".join([*lines, effects]) + "\n").encode()


def _rows(*rows: tuple[float, float, float]) -> np.ndarray:
    return np.array(rows, float) * [MM, DEG, MM]


def _span(count: int, *spans: tuple[float, float]) -> np.ndarray:
    return np.array(spans if len(spans) == count else spans * count, float) * DEG


COBOT = Arm(
    "cobot",
    tuple(f"J{i}" for i in range(1, 7)),
    _rows((0, 90, 152), (-612, 0, 0), (-572, 0, 0), (0, 90, 164), (0, -90, 116), (0, 0, 92)),
    _span(6, (-180, 180), (-170, -10), (-150, 150), (-180, 180), (-180, 180), (-180, 180)),
)
SEVEN = Arm(
    "seven_axes",
    tuple(f"A{i}" for i in range(1, 8)),
    _rows((0, -90, 340), (0, 90, 0), (0, 90, 400), (0, -90, 0), (0, -90, 400), (0, 90, 0), (0, 0, 126)),
    _span(7, (-170, 170), (-110, 110), (-170, 170), (-115, 115), (-170, 170), (-110, 110), (-170, 170)),
    external="A3",
)
FIVE = Arm(
    "five_axes",
    tuple(f"A{i}" for i in range(1, 6)),
    _rows((180, -90, 450), (600, 0, 0), (120, 90, 0), (0, -90, 620), (0, 0, 0)),
    _span(5, (-160, 160), (-120, 20), (-60, 140), (-180, 180), (-120, 120)),
)
GANTRY = Arm(
    "gantry",
    ("E1", *(f"A{i}" for i in range(1, 7))),
    _rows((0, -90, 0), (0, 90, 0), (75, -90, 335), (270, 0, 0), (90, -90, 0), (0, 90, 295), (0, -90, 80)),
    np.vstack(
        [[0.0, 3.0], _span(6, (-170, 170), (-190, 10), (-60, 150), (-185, 185), (-120, 120), (-350, 350))]
    ),
    linear=("E1",),
)
LARGE = Arm(
    "abb_irb6700",
    tuple(f"J{i}" for i in range(1, 7)),
    np.empty((0, 3)),
    _span(6, (-170, 170), (-65, 85), (-100, 70), (-300, 300), (-130, 130), (-360, 360)),
)
"""The robot file of the repository; its lines at zero are those of the URDF that it names."""

ARMS = {one.name: one for one in (COBOT, SEVEN, FIVE, GANTRY, LARGE)}
ABB_AXES = np.array([(0, 0, 1), (0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0)], float)
ABB_POINTS = 1e-3 * np.array(
    [(0, 0, 0), (320, 0, 780), (320, 0, 1915), (320, 0, 2115), (1502.5, 0, 2115), (1502.5, 0, 2115)], float
)
ABB_FLANGE = np.array([(0, 0, 1, 1.7025), (0, 1, 0, 0), (-1, 0, 0, 2.115), (0, 0, 0, 1)], float)


def _turned(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """(N, 3, 3) by Rodrigues' formula: about a unit vector (3,) by (N,) angles."""
    x, y, z = axis
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[:, None, None], (1 - np.cos(angle))[:, None, None]
    return np.eye(3) + s * k + c * (k @ k)


@dataclass(frozen=True)
class Lines:
    """An arm as lines: axis (n, 3) and point (n, 3) [m] of each joint, and the flange (4, 4), all at zero."""

    axis: np.ndarray
    point: np.ndarray
    turns: np.ndarray
    flange: np.ndarray

    def places(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Flange position (N, 3), rotation (N, 3, 3), and where each axis is now: directions and points (N, n, 3)."""
        count = len(q)
        rotation, position = np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3))
        axes, points = [], []
        for k, turning in enumerate(self.turns):
            axes.append(rotation @ self.axis[k])
            points.append(rotation @ self.point[k] + position)
            if turning:
                own = _turned(self.axis[k], q[:, k])
                shift = self.point[k] - own @ self.point[k]
            else:
                own, shift = np.tile(np.eye(3), (count, 1, 1)), q[:, k, None] * self.axis[k]
            position = position + (rotation @ shift[:, :, None])[:, :, 0]
            rotation = rotation @ own
        at = rotation @ self.flange[:3, 3] + position
        return at, rotation @ self.flange[:3, :3], np.stack(axes, 1), np.stack(points, 1)


def lines_of(arm: Arm, moved: dict[tuple[int, str], float] | None = None) -> Lines:
    """The lines of an arm at zero; ``moved``: (joint, direction) -> by how much its axis, and all that follows, is
    shifted along x, y, z of the base [m] or turned about rx, ry, rz through its point [rad]."""
    if len(arm.rows):
        at, axes, points = np.eye(4), [], []
        for a, alpha, d in arm.rows:
            axes.append(at[:3, 2])
            points.append(at[:3, 3])
            at = at @ _along(2, 0.0, d) @ _along(0, alpha, a)
        axis, point, flange = np.array(axes), np.array(points), at
    else:
        axis, point, flange = ABB_AXES.copy(), ABB_POINTS.copy(), ABB_FLANGE.copy()
    for (joint, way), by in (moved or {}).items():
        unit = np.eye(3)["xyz".index(way[-1])]
        if len(way) == 1:
            point[joint:] += by * unit
            flange[:3, 3] += by * unit
            continue
        turn, about = _turned(unit, np.array([by]))[0], point[joint].copy()
        axis[joint:] = axis[joint:] @ turn.T
        point[joint:] = (point[joint:] - about) @ turn.T + about
        flange[:3] = turn @ flange[:3]
        flange[:3, 3] += about - turn @ about
    return Lines(axis, point, arm.turns, flange)


def _along(which: int, angle: float, by: float) -> np.ndarray:
    """(4, 4) a turn about and a shift along the x (0) or z (2) axis."""
    made = np.eye(4)
    made[:3, :3] = _turned(np.eye(3)[which], np.array([angle]))[0]
    made[which, 3] = by
    return made


def drawn_poses(arm: Arm, count: int, rng: np.random.Generator) -> np.ndarray:
    """(N, n) within limits, all reflectors above the floor."""
    lines, found = lines_of(arm), np.empty((0, len(arm.names)))
    while len(found) < count:
        q = rng.uniform(*arm.limits.T, (4 * count, len(arm.names)))
        unit = np.where(arm.turns, DEG, MM)
        q = np.round(q / unit, 3) * unit
        at, rotation, _, _ = lines.places(q)
        height = (at[:, None] + TARGETS @ np.swapaxes(rotation, 1, 2))[:, :, 2]
        found = np.concatenate([found, q[height.min(axis=1) > FLOOR]])
    return found[:count]


@dataclass(frozen=True)
class World:
    """What really stands there.  moved: see ``lines_of``; zero (n,) [rad, m]; wave (n, 3) [rad]: sine and cosine over
    the angle, and by how much it stops short of its place; soft (n,) [rad/(N m)]: joints that give way to loads and to
    weights: ``masses`` (n,) [kg] at the axis after each joint; scale of the tracker."""

    arm: Arm
    moved: dict[tuple[int, str], float]
    zero: np.ndarray
    wave: np.ndarray
    soft: np.ndarray
    masses: np.ndarray
    scale: float = 0.0

    @classmethod
    def of(cls, arm: Arm) -> World:
        n = len(arm.names)
        return cls(arm, {}, np.zeros(n), np.zeros((n, 3)), np.zeros(n), np.zeros(n))

    def reflectors(self, q: np.ndarray, side: np.ndarray, load: np.ndarray) -> np.ndarray:
        """(N, 3, 3) [m] in the base under ``load`` (N, 3) [N] at the flange; ``side`` (N, n) of approach."""
        lines = lines_of(self.arm, self.moved)
        stands = (
            q + self.zero + self.wave[:, 0] * np.sin(q) + self.wave[:, 1] * np.cos(q) - self.wave[:, 2] * side
        )
        bent = np.zeros_like(q)
        for _ in range(30):
            at, rotation, axes, points = lines.places(stands + bent)
            if not self.soft.any():
                break
            before, bent = bent, self.soft * self._torque(at, axes, points, load)
            if abs(bent - before).max() < 1e-13:
                break
        return at[:, None] + TARGETS @ np.swapaxes(rotation, 1, 2)

    def _torque(self, at: np.ndarray, axes: np.ndarray, points: np.ndarray, load: np.ndarray) -> np.ndarray:
        """(N, n) [N m] about each axis of the load and of the weights after it."""
        hangs = [*(points[:, k] for k in range(1, points.shape[1])), at]
        torque = np.zeros(axes.shape[:2])
        for k in range(axes.shape[1]):
            total = np.cross(at - points[:, k], load)
            for j in range(k, axes.shape[1]):
                pull = np.array([0.0, 0.0, -GRAVITY * self.masses[j]])
                total = total + np.cross(hangs[j] - points[:, k], pull)
            torque[:, k] = (axes[:, k] * total).sum(axis=1)
        return np.where(self.arm.turns, torque, 0.0)


def station(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Rotation and place of the base in a tracker's frame."""
    turn = _turned(np.array([0.0, 0.0, 1.0]), rng.uniform(-np.pi, np.pi, 1))[0]
    turn = _turned(np.array([1.0, 0.0, 0.0]), rng.normal(0, 0.02, 1))[0] @ turn
    return turn, np.array([rng.uniform(2.5, 4.0), rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 0.0)])


SIGMA = 1.5e-5
"""[m] of a coordinate."""


def csv_of(
    world: World,
    q: np.ndarray,
    rng: np.random.Generator,
    side: np.ndarray | None = None,
    load: np.ndarray | None = None,
    stated: bool = True,
    told: bool = True,
    targets: bool = True,
    more: np.ndarray | float = 0.0,
    sigma: float = SIGMA,
) -> bytes:
    """A file of readings.  more (N, 3, 3) [m]: errors of another kind, in the tracker's frame; told: with DIR."""
    arm, turn = world.arm, station(rng)
    came = rng.choice([-1.0, 1.0], q.shape) if side is None else side
    hung = np.zeros((len(q), 3)) if load is None else load
    seen = world.reflectors(q, came, hung) @ turn[0].T + turn[1]
    seen = seen * (1.0 + world.scale) + more + sigma * rng.normal(size=seen.shape)
    head = [f"# robot: {arm.name}", "# frame: tracker", "# tool: 0 0 0 0 0 0"]
    head += [f"# sigma_mm: {sigma / MM:.6g}"] if stated else []
    if targets:
        head += [f"# target M{k + 1}: {' '.join(f'{v / MM:.6g}' for v in t)}" for k, t in enumerate(TARGETS)]
    names = [*arm.names]
    if told:
        names += [f"DIR{i}" for i in range(1, len(arm.names) + 1)]
    if load is not None:
        names += ["FX", "FY", "FZ"]
    names += ["TARGET", "X", "Y", "Z"]
    unit = np.where(arm.turns, DEG, MM)
    lines = [*head, ",".join(names)]
    for k in range(len(q)):
        row = [f"{v:.4f}" for v in q[k] / unit]
        if told:
            row += [f"{v:.0f}" for v in came[k]]
        if load is not None:
            row += [f"{v:.3f}" for v in hung[k]]
        for target in range(3):
            place = [f"{v / MM:.5f}" for v in seen[k, target]]
            lines.append(",".join([*row, f"M{target + 1}", *place]))
    return ("\n".join(lines) + "\n").encode()


def cable(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A hose that pulls the wrist towards where it hangs, the more the further the wrist is away from there."""
    hook = np.array([0.3, rng.uniform(-0.4, 0.4), 1.6])
    away = hook - at
    size = np.linalg.norm(away, axis=1, keepdims=True)
    return away / size * np.maximum(size - np.quantile(size, 0.4), 0.0)


def bolt(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A foot bolt that is loose: the base tips once the arm leans to that side."""
    way = rng.uniform(0, 2 * np.pi)
    out = at[:, 0] * np.cos(way) + at[:, 1] * np.sin(way)
    tip = np.maximum(out - 0.2 * np.ptp(out), 0.0)
    return tip[:, None] * np.cross([-np.sin(way), np.cos(way), 0.0], at)


def settling(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Read before the arm stands still: behind on its way."""
    return -np.diff(at, axis=0, prepend=at[:1])


def flank(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A gear with another ratio beyond some angle."""
    corner = np.median(q[:, 1]) + rng.uniform(-0.2, 0.2)
    return np.maximum(q[:, 1] - corner, 0.0)[:, None] * np.cross([0.0, 1.0, 0.0], at)


def warming(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A column that leans as the arm warms up."""
    share = 1.0 - np.exp(-np.arange(len(q)) / (0.3 * len(q)))
    return share[:, None] * np.cross(rng.normal(size=3), at)


def slip(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """The robot is pushed on its floor at some moment, and stays there."""
    later = np.arange(len(q)) >= rng.integers(len(q) // 4, 3 * len(q) // 4)
    return later[:, None] * (rng.normal(size=3) + np.cross(rng.normal(size=3), at))


def refraction(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A beam that warm air bends."""
    return (np.linalg.norm(at[:, :2] - [3.0, 0.5], axis=1) ** 2 * np.exp(-at[:, 2] / 0.5))[:, None] * [
        0.0,
        0.0,
        1.0,
    ]


def nest(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A reflector that lies too deep in its nest where it faces aside."""
    beam = at - np.array([3.0, 0.5, 0.8])
    beam /= np.linalg.norm(beam, axis=1, keepdims=True)
    return (beam @ rng.normal(size=3))[:, None] ** 2 * beam


def brake(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A brake that drops as it likes: one joint stands a random bit beside its place, pose by pose."""
    return rng.standard_t(3, len(q))[:, None] * np.cross([0.0, 1.0, 0.0], at)


def encoder_loss(q: np.ndarray, at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """An encoder of A1 that loses counts: a step further after each of some poses."""
    lost = np.cumsum(rng.random(len(q)) < 5.0 / len(q))
    return lost[:, None] * np.cross([0.0, 0.0, 1.0], at)


UNKNOWN = {
    one.__name__: one
    for one in (cable, bolt, settling, flank, warming, slip, refraction, nest, brake, encoder_loss)
}
"""Errors that no effect of the library is."""


def strange_error(
    world: World, q: np.ndarray, name: str, size: float, rng: np.random.Generator
) -> np.ndarray:
    """(N, 1, 3) [m] one of ``UNKNOWN``, whose root mean square about its mean is ``size``; as far as
    directions do not matter, in the tracker's frame."""
    at = lines_of(world.arm).places(q)[0]
    error = UNKNOWN[name](q, at, rng)
    error = error * (size / np.sqrt(np.mean((error - error.mean(axis=0)) ** 2)))
    return error[:, None, :]
