"""Readings of a design on a scene, by the plant."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np

from postproc.base.geometry import Poses
from postproc.base.units import DEG, MM
from postproc.measurements import Readings
from postproc.measurements.readings import alike, planned
from postproc.model import StiffnessModel

from .arm import Scene
from .design import Design

TAIL = 3.0
"""Times the scatter that readings far out have."""


def observed(scene: Scene, design: Design, moved: np.ndarray | None = None) -> np.ndarray:
    """(R, 3) [m] what a tracker without noise reads, visit by visit, load by load, reflector by reflector; ``moved``
    (V, 6) [rad]: joints come to stand beside their places."""
    plant, given, tool = scene.plant(), design.conditions, design.tool
    q = design.q if moved is None else design.q + moved
    into = tool.inverse()
    places = design.targets @ into.rotation.T + into.position if len(design.targets) else np.zeros((1, 3))
    at_tip = not len(design.targets)
    found = np.empty((*design.wrench.shape[:2], design.points, 3))
    for visit in range(len(q)):

        def points(wrench, visit=visit):
            rest = plant.rest(q[visit], wrench, tool, given, visit)
            # reflectors sit on the tool's body: what the spindle gives they do not see
            origin = rest.position if at_tip else rest.position - _give(plant)
            return origin + places @ rest.rotation.T

        still = points(np.zeros(6)) if design.deflection else 0.0
        for load, wrench in enumerate(design.wrench[visit]):
            found[visit, load] = points(wrench) - still
    found = found.reshape(-1, 3)
    return found if design.frame is None else _tracked(found, design.frame, scene.eccentric)


def _give(plant) -> np.ndarray:
    """(3,) [m] by which the tip's slides have moved it, robot base."""
    return plant.data.xpos[plant.tip_body] - (
        plant.data.xpos[plant.last_body]
        + plant.data.xmat[plant.last_body].reshape(3, 3) @ plant.model.body_pos[plant.tip_body]
    )


def _tracked(points: np.ndarray, frame: Poses, eccentric: tuple[float, float]) -> np.ndarray:
    seen = points @ frame.rotation.T + frame.position
    azimuth = np.arctan2(seen[:, 1], seen[:, 0])
    off = eccentric[0] * np.sin(azimuth) + eccentric[1] * np.cos(azimuth)
    c, s = np.cos(off), np.sin(off)
    return np.column_stack([c * seen[:, 0] - s * seen[:, 1], s * seen[:, 0] + c * seen[:, 1], seen[:, 2]])


def scatter(design: Design, model: StiffnessModel) -> float:
    """[m] one sigma of a coordinate of a reading, all together: what the file states."""
    tracker = design.sigma**2 * (1 + design.tails * (TAIL**2 - 1)) * (2 if design.deflection else 1)
    if not design.jitter:
        return float(np.sqrt(tracker))
    at = Poses(np.eye(3), design.targets[0]) if len(design.targets) else design.tool
    j = model.chain.jacobian(design.q, at)[:, :3, model.chain.motor_rows]
    return float(np.sqrt(tracker + design.jitter**2 * (j**2).sum(axis=2).mean()))


def noise(design: Design, rng: np.random.Generator) -> np.ndarray:
    """(R, 3) [m] of the tracker; differences at one visit share the unloaded reading."""

    def drawn(*shape: int) -> np.ndarray:
        far = np.where(rng.random(shape) < design.tails, TAIL, 1.0)
        return design.sigma * far[..., None] * rng.normal(size=(*shape, 3))

    visits, loads = design.wrench.shape[:2]
    own = drawn(visits, loads, design.points)
    if design.deflection:
        own = own - drawn(visits, 1, design.points)
    return own.reshape(-1, 3)


def readings(design: Design, value: np.ndarray, sigma: float) -> Readings:
    """The readings as a file has them."""
    visits, loads = design.wrench.shape[:2]
    each = loads * design.points

    def rows(of_visits: np.ndarray) -> np.ndarray:
        return np.repeat(of_visits, each, axis=0)

    names = tuple(f"M{k + 1}" for k in range(len(design.targets)))
    direction = rows(design.came) if design.told else None
    made = planned(
        [(f"A{i}", False) for i in range(1, 7)],
        rows(design.q),
        np.repeat(design.wrench.reshape(-1, 6), design.points, axis=0),
        design.deflection,
        "blind_arm",
        design.tool,
        names,
        dict(zip(names, design.targets, strict=True)) if design.stated else {},
        np.tile(np.arange(design.points), visits * loads),
        sigma,
        direction,
    )
    temperature = None if design.temperature is None else rows(design.temperature)
    return replace(
        made,
        value=value,
        in_robot_frame=not design.deflection and design.frame is None,
        time=None if design.time is None else rows(design.time),
        temperature=temperature,
        repeat=alike(made.q, made.wrench, made.target, direction, temperature),
    )


def filled(scene: Scene, design: Design, plan: str, rng: np.random.Generator) -> str:
    """A plan of poses (CSV) with what a ``design`` of that order reads on a scene, as somebody fills it in."""
    comments = [line for line in plan.splitlines() if line.startswith("#")]
    rows = list(csv.DictReader(line for line in plan.splitlines() if not line.startswith("#")))

    def numbers(names) -> np.ndarray:
        return np.array([[float(row.get(name) or 0.0) for name in names] for row in rows])

    axes = [f"A{i}" for i in range(1, 7)]
    q, wrench = numbers(axes) * DEG, numbers(("FX", "FY", "FZ", "MX", "MY", "MZ"))
    visits = np.flatnonzero(np.append(True, (np.diff(q, axis=0) != 0).any(axis=1)))
    loads = len(rows) // len(visits) // design.points
    later = replace(
        design,
        q=q[visits],
        wrench=wrench[:: design.points].reshape(len(visits), loads, 6),
        senses=numbers([f"DIR{i}" for i in range(1, 7)])[visits] if "DIR1" in rows[0] else None,
        time=None if design.time is None else design.time[-1] + 3600.0 + 120.0 * np.arange(len(visits)),
        temperature=None if design.temperature is None else np.full(len(visits), design.temperature[-1]),
    )
    order = np.arange(len(rows)) % design.points
    if design.points > 1 and [row["TARGET"] for row in rows] != [f"M{k + 1}" for k in order]:
        raise ValueError("a plan of other targets, or in another order")
    moved = later.jitter * rng.normal(size=later.q.shape) if later.jitter else None
    value = observed(scene, later, moved) + noise(later, rng)
    names = ("DX", "DY", "DZ") if design.deflection else ("X", "Y", "Z")
    each = loads * design.points
    for k, row in enumerate(rows):
        row.update((name, f"{x / MM:.4f}") for name, x in zip(names, value[k].tolist(), strict=True))
        for name, given in (("T", later.time), ("TEMP", later.temperature)):
            if name in row and given is not None:
                row[name] = f"{given[k // each]:.3f}"
    stream = io.StringIO()
    writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return "\n".join([*comments, stream.getvalue()])
