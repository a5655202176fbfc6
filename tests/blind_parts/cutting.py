"""A part cut by the plant: the errors at points of its surface, and what a probe measures of them."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from weakref import WeakKeyDictionary

import numpy as np
from plant import Plant, Rest

from postproc.base.geometry import Poses
from postproc.effects import Conditions
from postproc.learning.measured_part import FREEDOMS, MeasuredPart
from postproc.learning.touched_points import touched_points
from postproc.part.contact import find_contacts
from postproc.workflows.learn_commands import commands_at, cutting_program
from postproc.workflows.learn_points import CutProgram, read_job
from postproc.workflows.preparation import Request

from .truth import SCATTER, Truth

CORNER = 8.0
"""[mm] along the path from a corner, within which the cutter is in it."""


@dataclass(frozen=True, eq=False)
class Surface:
    """A shop's program and K points of its surface, in mm in the base, with their motions."""

    folder: Path
    program: CutProgram
    point: np.ndarray
    normal: np.ndarray
    feature: list[str]
    row: np.ndarray
    share: np.ndarray

    @property
    def request(self) -> Request:
        return Request(self.folder / "part.src", force="")


@lru_cache(maxsize=4)
def _job(folder: Path, program: bytes, cell: bytes) -> CutProgram:
    return read_job(Request(folder / "part.src", force=""))


def surface_of(folder: Path, point: np.ndarray, normal: np.ndarray, feature: list[str]) -> Surface:
    """Points that one motion of the program cuts."""
    job = _job(folder, (folder / "part.src").read_bytes(), (folder / "cell.yaml").read_bytes())
    base = job.ready.task.base[job.motions.rows[:1]]
    place = base.position + 1e-3 * point @ base.rotation[0].T
    contacts = find_contacts(job.motions, place, normal @ base.rotation[0].T)
    assert contacts.touched.all(), "a point of the benchmark is touched by no tool"
    return Surface(folder, job, point, normal, feature, contacts.last.row, contacts.last.share)


def commands(surface: Surface, program: Path | None) -> Poses | None:
    """Where the controller is sent at the points by a compensated program."""
    if program is None:
        return None
    raw = program.read_bytes()
    known = _SENT.setdefault(surface, {})
    if raw in known:
        return known[raw]
    part = MeasuredPart(
        surface.folder / "x.csv", "", surface.point, surface.normal, np.zeros(0), np.zeros(0), (), (), np.zeros(0, int),
        np.zeros(0, int), np.zeros(0), np.zeros(0, int), FREEDOMS, str(program), hashlib.sha256(raw).hexdigest(), False,
        None, (),
    )  # fmt: skip
    other, pairing = cutting_program(surface.request, surface.program.ready, part)
    assert other is not None
    assert pairing is not None
    poses, lost = commands_at(surface.program.ready, other, pairing, surface.row, surface.share)
    assert not lost.any()
    known[raw] = poses
    return poses


_SENT: WeakKeyDictionary[Surface, dict[bytes, Poses]] = WeakKeyDictionary()
"""Where programs send the controller at the points of a surface."""


def cut(
    surface: Surface, truth: Truth, plant: Plant, program: Path | None, rng: np.random.Generator
) -> np.ndarray:
    """(K,) [m] errors along the normals of a part that ``program`` cut, None the original."""
    job = surface.program
    task = job.ready.task
    base = task.base[job.motions.rows[:1]]
    rotation = base.rotation[0]
    point = base.position + 1e-3 * surface.point @ rotation.T
    normal = surface.normal @ rotation.T
    states = touched_points(
        task, job.spindle, (surface.row, surface.share), (point, normal), commands(surface, program)
    )
    scatter = {name: 1 + SCATTER * rng.normal() for name in job.operations.names}
    errors = np.empty(len(point))
    corner = _corners(surface)
    sense = _senses(surface, np.maximum(truth.hardware.width, truth.hardware.gap))
    tcp = task.tool[surface.row]
    goals = _goals(surface, plant, states.q_goal, tcp)
    for k in range(len(point)):
        name = job.operations.names[job.operations.which[surface.row[k]]]
        scale = truth.factor[name] * scatter[name] * (1 + truth.corner * corner[k])
        force = states.wrench[k].copy() * scale
        force[:3] = _turned(force[:3], rotation[:, 2], truth.turn[name])
        came = Conditions(direction=sense[k][None])
        tool = Poses(tcp.rotation[k], tcp.position[k])
        loaded = plant.rest(states.q[k], force, tool, came)
        still = goals[k]
        lever = tool.rotation.T @ (states.tool.position[k] - tool.position)
        shift = loaded.position - still.position + (loaded.rotation - still.rotation) @ lever
        spindle = states.spindle[k]
        along = normal[k] @ spindle
        wave = truth.wobble[:, 0] * np.sin(surface.point[k] @ _WAVES.T + truth.wobble[:, 1])
        errors[k] = (
            normal[k] @ (shift + wave) + truth.length * along - truth.radius * np.sqrt(max(1 - along**2, 0.0))
        )
    return errors


_GOALS: WeakKeyDictionary[Plant, tuple[Surface, list[Rest]]] = WeakKeyDictionary()
"""Where a plant without force takes the tool; the same for every part that it cuts."""


def _goals(surface: Surface, plant: Plant, q: np.ndarray, tcp: Poses) -> list[Rest]:
    known = _GOALS.get(plant)
    if known is None or known[0] is not surface:
        middle = Conditions(direction=np.zeros((1, q.shape[1])))
        tools = [Poses(tcp.rotation[k], tcp.position[k]) for k in range(len(q))]
        known = surface, [plant.rest(q[k], np.zeros(6), tool, middle) for k, tool in enumerate(tools)]
        _GOALS[plant] = known
    return known[1]


_WAVES = np.array([[1.0, 0.4, 0.0], [-0.3, 1.0, 0.0], [0.7, 0.7, 0.0]]) * 2 * np.pi / 400.0
"""[1/mm]"""


def _corners(surface: Surface) -> np.ndarray:
    """(K,) 1 where the cutter is within CORNER of a corner along its own path when it cuts the point."""
    task = surface.program.ready.task
    path, carries = task.desired_path, task.carries
    end = np.cumsum(path.length)
    tip = end[surface.row] - (1.0 - surface.share) * path.length[surface.row]
    near = np.zeros(len(tip))
    for row in range(1, len(carries)):
        if carries[row] and carries[row - 1]:
            one, other = path.tangent(np.array([row - 1, row]), np.array([1.0, 0.0]))
            if one @ other < 0.7:
                near[np.abs(tip - end[row - 1]) < 1e-3 * CORNER] = 1.0
    return near


def _senses(surface: Surface, width: np.ndarray) -> np.ndarray:
    """(K, 6) -1..1 side on which each gear lies, in the order of the motions, with the whole ``width`` (6,) [rad] of
    its loop."""
    q = surface.program.ready.task.track.q
    half = 0.5 * np.maximum(width, 1e-9)
    output = np.zeros(6)
    started = False
    senses = np.zeros((len(surface.row), 6))
    for row in range(len(q)):
        if not np.isfinite(q[row]).all():
            started = False
            continue
        if not started:
            output, started = q[row].copy(), True
            continue
        for k in np.flatnonzero(surface.row == row):
            motor = q[row - 1] + surface.share[k] * (q[row] - q[row - 1])
            senses[k] = (motor - np.clip(output, motor - half, motor + half)) / half
        output = np.clip(output, q[row] - half, q[row] + half)
    return senses


def _turned(force: np.ndarray, up: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """A force turned about the vertical (swing) and about the horizontal across it (lift), by Rodrigues."""
    unit = force / np.linalg.norm(force)
    across = np.cross(unit, up)
    across /= np.linalg.norm(across)
    for axis, one in ((across, angle[0]), (np.cross(unit, across), angle[1])):
        force = (
            force * np.cos(one)
            + np.cross(axis, force) * np.sin(one)
            + axis * (axis @ force) * (1 - np.cos(one))
        )
    return force


def probe(
    surface: Surface, errors: np.ndarray, chosen: np.ndarray, noise: float, rng: np.random.Generator
) -> np.ndarray:
    """(J,) [m] deviations of the points ``chosen`` (J,), measured after a free alignment."""
    place = 1e-3 * surface.point[chosen]
    columns = np.concatenate(
        [surface.normal[chosen], np.cross(place - place.mean(axis=0), surface.normal[chosen])], axis=1
    )
    seen = errors[chosen] + rng.normal(0, noise, len(chosen))
    best = np.linalg.lstsq(columns, seen, rcond=None)[0]
    return seen - columns @ best


def aligned_rms(surface: Surface, errors: np.ndarray) -> float:
    """[m] of errors (K,) after the best alignment."""
    place = 1e-3 * surface.point
    columns = np.concatenate([surface.normal, np.cross(place - place.mean(axis=0), surface.normal)], axis=1)
    best = np.linalg.lstsq(columns, errors, rcond=None)[0]
    return float(np.sqrt(np.mean((errors - columns @ best) ** 2)))


SEEN = 4.0
"""Times the scatter of the probe."""


def write_csv(
    path: Path, surface: Surface, chosen: np.ndarray, deviation: np.ndarray, program: Path, noise: float,
    places: bool = False, checked: bool = True, found: np.ndarray | None = None,
) -> None:  # fmt: skip
    """The file of a measured part; ``places``: with the measured ones; ``checked``: somebody looked again at the place
    with the largest deviation, where that is large enough to be seen, and ``found`` (J,) [m], DEV without."""
    original = program.name == "part.src" and program.parent == surface.folder
    name = "original" if original else str(program.relative_to(surface.folder))
    lines = [
        "# positive: material_left",
        "# alignment: free",
        f"# cut_with: {name}",
        f"# sha256: {hashlib.sha256(program.read_bytes()).hexdigest()}",
        f"# sigma_mm: {1e3 * noise:g}",
        "X,Y,Z,NX,NY,NZ,DEV,FEATURE" + ",MX,MY,MZ" * places,
    ]
    seen = deviation if found is None else found
    largest = int(np.argmax(np.abs(seen)))
    if checked and abs(seen[largest]) > SEEN * noise:
        words = " ".join(f"{one:.3f}" for one in surface.point[chosen[largest]])
        lines.insert(-1, f"# checked: {words} {'material_left' if seen[largest] > 0 else 'material_missing'}")
    for k, value in zip(chosen.tolist(), deviation.tolist(), strict=True):
        numbers = [*surface.point[k], *surface.normal[k], 1e3 * value]
        place = (surface.point[k] + 1e3 * value * surface.normal[k]).tolist() if places else []
        words = [*(f"{one:.5f}" for one in numbers), surface.feature[k], *(f"{one:.4f}" for one in place)]
        lines.append(",".join(words))
    path.write_text("\n".join(lines) + "\n")
