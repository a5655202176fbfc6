"""What is measured: where the arm goes, what hangs on it, which reflectors, in which order, when."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from plant import GRAVITY

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.base.units import DEG
from postproc.effects import Conditions
from postproc.model import StiffnessModel

from .arm import COMPLIANCE, LIMITS

GROUND, AXIS = 0.5, 0.5
"""[m] Flange and weight stay so far above the ground and from the axis of A1."""

STEP = 0.01 * DEG
"""To which joint angles are commanded."""

AGAIN = 0.2
"""Share of the poses that are gone to a second time."""


@dataclass(frozen=True)
class Design:
    """A campaign.  q (V, 6) [rad]: visits in the order of time; wrench (V, L, 6) [N, N m]: loads at each one.

    deflection: loaded minus unloaded; tool: TCP on the flange, where the loads act; targets (K, 3) [m] on the flange,
    () where the TCP itself is measured; stated: their places are; frame: robot base in the tracker's frame, None where
    places are measured in the robot's; told: senses of approach stand in the file.

    time (V,) [s], temperature (V,) [degC], None where not in the file.  sigma [m]: scatter of one coordinate of a
    tracker's reading; jitter [rad]: of where each joint comes to stand; tails: share of readings with three times the
    scatter; senses (V, 6): of approach, where another order than that of time was asked for.
    """

    q: np.ndarray
    wrench: np.ndarray
    deflection: bool
    tool: Poses
    targets: np.ndarray
    stated: bool
    frame: Poses | None
    told: bool
    time: np.ndarray | None
    temperature: np.ndarray | None
    sigma: float
    jitter: float
    tails: float
    senses: np.ndarray | None = None

    @property
    def points(self) -> int:
        """Number of points that are measured at each state."""
        return max(1, len(self.targets))

    @property
    def came(self) -> np.ndarray:
        """(V, 6) sense -1, 0, 1 in which each joint came to its place; 0 at first; ``senses`` where they are given."""
        if self.senses is not None:
            return self.senses
        sense = np.zeros_like(self.q)
        for visit in range(1, len(self.q)):
            way = np.sign(self.q[visit] - self.q[visit - 1])
            sense[visit] = np.where(way == 0, sense[visit - 1], way)
        return sense

    @property
    def conditions(self) -> Conditions:
        """Of each visit."""
        since = [None if x is None else x - x[0] for x in (self.temperature, self.time)]
        return Conditions(direction=self.came, temperature=since[0], time=since[1])


def poses(
    model: StiffnessModel, count: int, tool: Poses, rng: np.random.Generator, ranges=None
) -> np.ndarray:
    """(N, 6) [rad] random within limits, clear of ground and column; ``ranges`` (6, 2) [deg] where not the limits."""
    low, high = (np.array(LIMITS, float) if ranges is None else np.asarray(ranges, float)).T * DEG
    found = np.empty((0, 6))
    while len(found) < count:
        q = np.round(rng.uniform(low, high, (4 * count, 6)) / STEP) * STEP
        places = [model.chain.flange(q).position, (model.chain.flange(q) @ tool).position]
        clear = [(p[:, 2] > GROUND) & (np.hypot(p[:, 0], p[:, 1]) > AXIS) for p in places]
        found = np.concatenate([found, q[clear[0] & clear[1]]])
    return found[:count]


def best(model: StiffnessModel, count: int, tool: Poses, rng: np.random.Generator) -> np.ndarray:
    """(N, 6) [rad] of ten times as many, those that show the joints' compliances under a hung weight best: the largest
    determinant, one pose after the other."""
    q = poses(model, 10 * count, tool, rng)
    j = model.chain.jacobian(q, tool)[:, :3, model.chain.motor_rows]
    columns = j * (j[:, 2] * COMPLIANCE)[:, None, :]
    columns = columns / np.sqrt((columns**2).mean(axis=(0, 1)) + 1e-30)
    chosen, gram = [], 1e-3 * np.eye(6)
    for _ in range(count):
        gain = np.linalg.slogdet(np.eye(3) + columns @ np.linalg.solve(gram, np.swapaxes(columns, 1, 2)))[1]
        gain[chosen] = -np.inf
        chosen.append(int(np.argmax(gain)))
        gram = gram + columns[chosen[-1]].T @ columns[chosen[-1]]
    return q[rng.permutation(chosen)]


def drawn(
    model: StiffnessModel,
    count: int,
    deflection: bool,
    rng: np.random.Generator,
    clean: bool = False,
    at_tip: bool = False,
    several: bool = False,
    warm: bool = False,
    in_robot_frame: bool = False,
    places: bool | None = None,
    ranges=None,
    planned: bool | None = None,
) -> Design:
    """A campaign of ``count`` poses.

    clean: normal scatter only; at_tip: without reflectors; several: more than one load a pose; warm: time and
    temperature are taken; places: whether those of reflectors are stated; ranges, planned: see ``poses``, ``best``.
    """
    tool = Poses(
        rotation_from_vector(rng.uniform(-0.3, 0.3, 3)),
        np.array([rng.uniform(0.0, 0.15), rng.uniform(0.25, 0.5), rng.uniform(0.2, 0.4)]),
    )
    if planned is None:
        planned = bool(rng.random() < 0.3)
    q = (
        best(model, count, tool, rng)
        if planned and ranges is None
        else poses(model, count, tool, rng, ranges)
    )
    if not deflection:
        again = rng.choice(count, max(3, round(AGAIN * count)), replace=False)
        q = q[rng.permutation([*range(count), *again])]
        _to_the_end(q)
    loads = 2 if several or rng.random() < 0.7 else 1
    wrench = _loads(q, loads, deflection, rng)
    if at_tip:
        targets = np.empty((0, 3))
    else:
        # one reflector shows no turn: of few poses too little
        least = 1 if deflection else 3 if count < 20 else 2
        around = rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(rng.integers(least, 4))
        targets = np.column_stack(
            [0.3 * np.cos(around), 0.3 * np.sin(around), rng.uniform(0.0, 0.2, len(around))]
        )
        targets = np.round(targets, 6)
    begun, each = rng.uniform(0, 600), rng.uniform(60, 180)
    time = np.round(begun + np.arange(len(q)) * each + rng.uniform(0, 20, len(q)), 1)
    warmth = np.round(
        21.0
        + rng.uniform(5, 15) * (1 - np.exp(-(time - time[0]) / rng.uniform(1200, 4000)))
        + rng.normal(0, 0.2, len(q)),
        2,
    )
    stated = bool(rng.random() < 0.7) if places is None else places
    away, turn = rng.uniform(2.5, 4.0), rng.uniform(-np.pi, np.pi)
    tracker = Poses(
        rotation_from_vector([0.0, 0.0, rng.uniform(-np.pi, np.pi)]),
        np.array([away * np.cos(turn), away * np.sin(turn), rng.uniform(0.5, 1.5)]),
    )
    return Design(
        q=q,
        wrench=wrench,
        deflection=deflection,
        tool=tool,
        targets=targets,
        stated=stated or at_tip,
        frame=None if deflection or in_robot_frame else tracker.inverse(),
        told=bool(rng.random() < 0.5),
        time=time if warm or rng.random() < 0.3 else None,
        temperature=warmth if warm or rng.random() < 0.3 else None,
        sigma=rng.uniform(0.8e-5, 2.5e-5),
        jitter=0.0 if deflection or clean else rng.uniform(3e-6, 8e-6),
        tails=0.0 if clean else 0.05,
    )


def _to_the_end(q: np.ndarray) -> None:
    """A pose that is gone to again does not follow itself."""
    for visit in range(1, len(q)):
        if (q[visit] == q[visit - 1]).all():
            q[[visit, (visit + len(q) // 2) % len(q)]] = q[[(visit + len(q) // 2) % len(q), visit]]


def _loads(q: np.ndarray, loads: int, deflection: bool, rng: np.random.Generator) -> np.ndarray:
    """(V, L, 6) the same at all visits of a pose: weights that are hung; of some campaigns, one is a sideways pull."""
    wrench = np.zeros((len(q), loads, 6))
    masses = (
        np.sort(rng.uniform(60.0, 280.0, loads))
        if deflection
        else np.linspace(0.0, rng.uniform(50.0, 250.0), 2)[-loads:]
    )
    wrench[:, :, 2] = -np.round(masses * GRAVITY, 2)
    if deflection and loads > 1 and rng.random() < 0.4:
        turn = rng.uniform(0, 2 * np.pi, len(q))
        pull = rng.uniform(500.0, 1200.0)
        wrench[:, 0] = 0.0
        wrench[:, 0, :2] = np.round(pull * np.column_stack([np.cos(turn), np.sin(turn)]), 1)
    return wrench
