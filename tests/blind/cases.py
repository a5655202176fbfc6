"""The matrix: which run hides what, and the run itself made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
from plant import GRAVITY

from postproc.measurements import Readings

from . import hidden, measured
from .arm import LIMITS, Scene, as_filed, cluttered, model_of, robot_file
from .design import Design, drawn
from .hidden import ABSOLUTE, DEFLECTION, EVERY, OUTSIDE, Hidden
from .measured import TAIL
from .oracle import Oracle

SNRS = (0.5, 1.0, 2.0, 5.0)
POSES = (15, 30, 60)

ROWS = (
    "null_clean",
    "null_cluttered",
    "single",
    "decoy",
    "pair",
    "triple",
    "outside",
    "unidentifiable",
    "compensator",
    "compensator_null",
    "compensator_narrow",
)

COMPENSATED, NARROW = 200, 60
"""Runs at most of the compensator's rows, and where A2 hardly moves."""

COMPENSATOR = {15: 5e-5, 40: 1e-4}
"""Poses of a campaign of the companion experiments' kind -> scatter [m] of a deflection in each coordinate."""

DECOYS = (
    "joint_stiffening",
    "backlash",
    "link_compliance",
    "joint_compliance",
    "transmission_error",
    "hysteresis",
    "joint_offset",
)

UNIDENTIFIABLE = ("balancer_at_one_angle", "foot_or_first_bearing", "wave_at_one_angle")

NOT_TOGETHER = (
    {"joint_compliance", "joint_stiffening"},
    {"joint_compliance", "backlash"},
    {"link_gravity", "payload"},
    {"base_compliance", "link_compliance"},
    {"tool_compliance", "link_compliance"},
)
"""A joint that is not said to give way has no other spring; of the others one is nearly the other."""

TOGETHER = 60
"""Sets of effects of which each is run, of pairs and of triples."""

CLOSE = 0.05
"""Within this share of the wanted size."""


@dataclass(frozen=True)
class Case:
    """A cell of the matrix, and the seed of one run of it.  effects: names of what is hidden; snr: 0 where nothing
    is."""

    row: str
    number: int
    seed: int
    effects: tuple[str, ...]
    snr: float
    poses: int

    @property
    def key(self) -> str:
        return f"{self.row}/{self.number}/{self.seed}"


@dataclass(frozen=True)
class Run:
    """A case made: what is hidden and how large it is, without (R, 3) [m] and with it as readings, and the files."""

    case: Case
    robot: bytes
    ranges: object
    scene: Scene
    bare: Scene
    design: Design
    sigma: float
    hidden: tuple[tuple[Hidden, float], ...]
    snr: tuple[float, ...]
    without: np.ndarray
    readings: Readings
    oracle: Oracle

    def true(self) -> dict[str, float]:
        """Parameters (SI) of what is there, hidden or not, as effect.parameter."""
        found = self.scene.true()
        for one, size in self.hidden:
            found |= one.true(size)
        return found

    @property
    def reached(self) -> bool:
        """Whether every effect shows as large as it should."""
        return all(snr > 0.8 * self.case.snr for snr in self.snr)


def cases(row: str, count: int, seed: int) -> list[Case]:
    """The first ``count`` runs of a row; cells come in turn, in an order of their own."""
    rng = np.random.default_rng([ROWS.index(row), 2])
    names: list[tuple[str, ...]]
    if row in ("null_clean", "null_cluttered"):
        names, sizes = [()], (0.0,)
    elif row == "single":
        names, sizes = [(name,) for name in EVERY], SNRS
    elif row == "decoy":
        names, sizes = [(name,) for name in DECOYS], SNRS[1:]
    elif row == "outside":
        names, sizes = [(name,) for name in OUTSIDE], SNRS
    elif row == "unidentifiable":
        names, sizes = [(name,) for name in UNIDENTIFIABLE], (2.0,)
    elif row.startswith("compensator"):
        names = [()] if row.endswith("null") else [("gravity_compensator",)]
        count = min(count, NARROW if row.endswith("narrow") else COMPENSATED)
        return [Case(row, k, seed, names[0], 0.0, list(COMPENSATOR)[k % 2]) for k in range(count)]
    else:
        names, sizes = _together(2 if row == "pair" else 3, rng), SNRS[1:]
    cells = list(product(names, sizes, POSES))
    order = [cells[i] for i in rng.permutation(len(cells))]
    return [Case(row, k, seed, *order[k % len(order)]) for k in range(count)]


def _together(count: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    """Sets of effects that may be there at once, of one kind of readings."""
    kinds = DEFLECTION, tuple(name for name in ABSOLUTE if name != "base_offset")
    sets = [chosen for names in kinds for chosen in combinations(names, count)]
    sets = [chosen for chosen in sets if not any(bad <= set(chosen) for bad in NOT_TOGETHER)]
    return [tuple(sets[i]) for i in rng.permutation(len(sets))[:TOGETHER]]


def made(case: Case) -> Run:
    """The run of a case: always the same."""
    rng = np.random.default_rng([ROWS.index(case.row), case.number, case.seed])
    if case.row == "unidentifiable":
        return _unidentifiable(case, rng)
    if case.row.startswith("compensator"):
        return _compensator(case, rng)
    best: Run | None = None
    for _ in range(6):
        run = drawn_from(case, rng)
        if best is None or min(run.snr, default=0.0) > min(best.snr, default=0.0):
            best = run
        if run.reached:
            return run
    assert best is not None
    return best


def drawn_from(case: Case, rng: np.random.Generator) -> Run:
    row, names = case.row, case.effects
    if row.startswith("null"):
        deflection = case.number % 2 == 0
    elif row == "outside":
        deflection = OUTSIDE[names[0]]
    else:
        deflection = names[0] in DEFLECTION
    weights = bool(rng.random() < 0.6)
    if {"link_gravity", "payload"} & set(names):
        # the file's own weights would be anything that hangs on the arm
        weights = False
    if {"backlash", "windup"} & set(names):
        weights = True
    clean = row == "null_clean"
    ranges = planned = None
    hid = _hidden(names, rng)
    if row == "decoy":
        ranges, planned = _alike(hid[0], rng), False
    lacking = [(h.effect, h.joint) for h in hid if not h.outside]
    raw = robot_file(not deflection, weights, lacking)
    design = drawn(
        model_of(raw),
        case.poses,
        deflection,
        rng,
        clean=clean,
        at_tip="tool_compliance" in names,
        several=bool({"joint_stiffening", "force_sensor", "quadratic_bending", "loose_flange"} & set(names)),
        warm="thermal_growth" in names,
        in_robot_frame="base_offset" in names,
        places=True if "tool_offset" in names else None,
        ranges=ranges,
        planned=planned,
    )
    bare = as_filed(weights) if clean else cluttered(rng, weights, lacking)
    return run_of(case, raw, bare, design, hid, rng, ranges)


def _hidden(names: tuple[str, ...], rng: np.random.Generator) -> tuple[Hidden, ...]:
    """One of each name, no two of a joint."""
    while True:
        hid = tuple(hidden.drawn(name, rng) for name in names)
        joints = [h.joint for h in hid if h.joint]
        if len(set(joints)) == len(joints):
            return hid


def _alike(truth: Hidden, rng: np.random.Generator):
    """(6, 2) [deg] ranges in which a neighbour of the joint does nearly the same: parallel axes, a wrist almost
    stretched."""
    ranges = np.array(LIMITS, float)
    if truth.joint in ("A4", "A6"):
        ranges[4] = [-35.0, 35.0]
    if truth.joint in ("A2", "A3"):
        ranges[2] = [40.0, 120.0]
    if truth.joint in ("A1", "A5"):
        ranges[3] = [-40.0, 40.0]
    return ranges


def run_of(
    case: Case, raw: bytes, bare: Scene, design: Design, hid: tuple[Hidden, ...], rng, ranges=None, sizes=None
) -> Run:
    """The run of what is hidden in ``bare``, each as large as the case wants, or of ``sizes``."""
    for h in hid:
        bare = h.absent(bare)
    model = model_of(raw)
    sigma = measured.scatter(design, model)
    moved = design.jitter * rng.normal(size=design.q.shape) if design.jitter else None
    without = measured.observed(bare, design, moved)
    exact = measured.readings(design, without, sigma)
    oracle = Oracle(model, exact, design, sigma)
    found = []
    for k, h in enumerate(hid):
        if sizes is not None:
            size = sizes[k]
            signal = measured.observed(h.into(bare, size), design, moved) - without
        else:
            size, signal = _sized(h, bare, design, moved, without, oracle, case.snr)
        found.append((h, size, showing(oracle, h)(signal)))
    scene = bare
    for h, size, _ in found:
        scene = h.into(scene, size)
    value = measured.observed(scene, design, moved) if found else without
    value = value + measured.noise(design, rng)
    return Run(
        case=case,
        robot=raw,
        ranges=ranges,
        scene=scene,
        bare=bare,
        design=design,
        sigma=sigma,
        hidden=tuple((h, size) for h, size, _ in found),
        snr=tuple(snr for *_, snr in found),
        without=without,
        readings=replace(exact, value=value),
        oracle=oracle,
    )


def showing(oracle: Oracle, h: Hidden):
    """How large what is hidden counts: of what no library has, only what no effect of one can imitate."""
    return oracle.beyond if h.outside else oracle.shown


def _sized(h: Hidden, bare, design, moved, without, oracle, wanted: float):
    """The size at which it shows as wanted, and what it then does (R, 3) [m]; the largest plausible one where that
    does not do."""
    size = min(1.0, h.cap)
    for _ in range(12):
        signal = measured.observed(h.into(bare, size), design, moved) - without
        shows = showing(oracle, h)(signal)
        if abs(shows - wanted) < CLOSE * wanted or (size >= h.cap and shows < wanted):
            break
        size = min(h.cap, size * float(np.clip(wanted / max(shows, 1e-9), 0.02, 20.0)))
    return size, signal


def _unidentifiable(case: Case, rng: np.random.Generator) -> Run:
    """Designs on which nothing can tell the truth from something else."""
    (name,) = case.effects
    ranges = np.array(LIMITS, float)
    sizes = None
    if name == "balancer_at_one_angle":
        # where A2 stands still a balancer is a little more or less stiffness of it
        middle = rng.uniform(-120.0, -40.0)
        ranges[1] = middle - 0.5, middle + 0.5
        h = hidden.drawn("gravity_compensator", rng)
        deflection, lacking, sizes = True, [], (1.5,)
    elif name == "foot_or_first_bearing":
        h = hidden.drawn("link_compliance", rng, "A1")
        deflection, lacking = True, []
    else:
        middle = rng.uniform(-60.0, 60.0)
        ranges[2] = middle - 0.5, middle + 0.5
        h = hidden.drawn("joint_offset", rng, "A3")
        deflection, lacking = False, [("joint_offset", "A3")]
    raw = robot_file(not deflection, True, lacking)
    design = drawn(model_of(raw), case.poses, deflection, rng, ranges=ranges, planned=False)
    bare = cluttered(rng, True, lacking)
    return run_of(case, raw, bare, design, (h,), rng, ranges, sizes)


def _compensator(case: Case, rng: np.random.Generator) -> Run:
    """Weights of 250 to 280 kg hung at random poses, three reflectors, and a balancer about as stiff as that of the
    companion experiments; of the narrow ones A2 moves by 20 degrees only."""
    ranges = np.array(LIMITS, float)
    if case.row.endswith("narrow"):
        middle = rng.uniform(-120.0, -30.0)
        ranges[1] = middle - 10.0, middle + 10.0
    hid = tuple(hidden.drawn(name, rng) for name in case.effects)
    raw = robot_file(False, False)
    design = drawn(model_of(raw), case.poses, True, rng, ranges=ranges, planned=False)
    wrench = np.zeros((case.poses, 1, 6))
    wrench[:, 0, 2] = -np.round(GRAVITY * rng.uniform(250.0, 280.0), 2)
    around = 2 * np.pi / 3 * np.arange(3)
    targets = np.round(np.column_stack([0.3 * np.cos(around), 0.3 * np.sin(around), [0.0, 0.1, 0.2]]), 6)
    sigma = COMPENSATOR[case.poses] / np.sqrt(2 * (1 + design.tails * (TAIL**2 - 1)))
    design = replace(design, wrench=wrench, targets=targets, stated=True, sigma=sigma)
    sizes = tuple(rng.uniform(5.5, 8.0, len(hid)).tolist())
    return run_of(case, raw, cluttered(rng, False), design, hid, rng, ranges, sizes)
