"""Readings as shops take them: one length or twist that is wrong, a tracker whose scale is off, several stations,
reflectors nobody has measured, files without senses of approach, lost beams, robot files without stiffness.

Geometry errors are drawn as a mechanic knows them, one Denavit-Hartenberg length or twist at a time; nothing here is in
the coordinates of an effect of the library.  Each function makes one ``Trial``; the truth stays with it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from postproc.base.geometry import Poses, rotation_from_vector
from postproc.measurements import Readings
from postproc.measurements.readings import alike
from postproc.measurements.write_csv import measurements_csv
from postproc.model import StiffnessModel

from . import hidden, measured
from .arm import COMPLIANCE, Scene, as_filed, model_of, robot_file
from .design import Design, drawn, poses

LENGTHS = {
    "a1": (2, "y"),
    "a2": (3, "y"),
    "a3": (4, "x"),
    "elbow sideways": (4, "y"),
    "forearm": (5, "y"),
    "wrist sideways": (6, "y"),
}
"""A Denavit-Hartenberg length -> the joint whose axis it shifts, and along which axis of that joint's frame."""

TWISTS = {f"twist of A{i}, {axis}": (i, axis) for i in range(2, 7) for axis in "xy"}
"""A twist -> the joint whose axis it turns, about which axis of its frame."""


@dataclass(frozen=True)
class Trial:
    """One run.  files: name -> content, ``data*.csv`` are the readings; accept: (effect, joint) that may be named,
    joint "*" for any; needed: one of these must be named or stand in a set; truth: the arm; design: of fresh poses."""

    row: str
    number: int
    files: dict[str, bytes]
    accept: frozenset[tuple[str, str]]
    needed: frozenset[tuple[str, str]]
    scene: Scene | None
    design: Design | None
    sigma: float
    words: str
    also: dict[str, bytes] = field(default_factory=dict)
    """The same readings, told in another way: with the scatter stated where it is not, say."""
    fresh: Callable[[StiffnessModel], float] | None = None
    """[m] what a model leaves at poses that were not measured, where ``scene`` and ``design`` do not say it."""

    @property
    def data(self) -> list[str]:
        return sorted(name for name in self.files if name.endswith(".csv"))


def rng_of(row: str, number: int, seed: int) -> np.random.Generator:
    return np.random.default_rng([*row.encode(), number, seed])


def campaign(rng, count=None, weights=False, loads=False, stated=None, filed: bytes | None = None) -> Design:
    """Absolute places; ``loads``: with and without a weight."""
    count = count or int(rng.choice([30, 45, 60]))
    filed = robot_file(True, weights) if filed is None else filed
    design = drawn(model_of(filed), count, False, rng, places=stated, planned=False)
    tracker_only = replace(design, time=None, temperature=None, told=True)
    if not loads:
        tracker_only = replace(tracker_only, wrench=np.zeros((len(design.q), 1, 6)))
    return tracker_only


def with_targets(design: Design, rng, least: int = 3) -> Design:
    around = rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(least)
    places = np.column_stack([0.3 * np.cos(around), 0.3 * np.sin(around), rng.uniform(0.0, 0.2, least)])
    return replace(design, targets=np.round(places, 6))


def jitter(design: Design, rng) -> np.ndarray:
    return design.jitter * rng.normal(size=design.q.shape)


def read(scene: Scene, design: Design, rng, scale: float = 0.0) -> tuple[Readings, float]:
    """Readings of ``design`` by a tracker that reads lengths longer by ``scale``; and one sigma of a coordinate."""
    sigma = measured.scatter(design, model_of(robot_file(True, False)))
    value = measured.observed(scene, design, jitter(design, rng)) * (1.0 + scale)
    return measured.readings(design, value + measured.noise(design, rng), sigma), sigma


def bent(scene: Scene, shifts: dict[tuple[int, str], float], turns: dict[tuple[int, str], float]) -> Scene:
    """The arm with axes shifted [m] and turned [rad], each in the frame of its joint."""
    parts: dict[str, object] = {}
    if shifts:
        moved: dict[int, np.ndarray] = {}
        for (joint, axis), by in shifts.items():
            moved.setdefault(joint - 1, np.zeros(2))["xy".index(axis)] += by
        parts["shift"] = moved
    if turns:
        twist = np.zeros(12)
        for (joint, axis), by in turns.items():
            twist[2 * (joint - 1) + "xy".index(axis)] += by
        parts["turn"] = twist
    return scene.having(parts)


def unsaid(readings: Readings) -> Readings:
    """Without a stated scatter, and without repeats that would give it."""
    return replace(readings, sigma=np.full(len(readings), np.nan))


def sized(rng, low: float, high: float) -> float:
    """Log-uniform with a random sign."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))) * rng.choice([-1.0, 1.0]))


GEOMETRY = frozenset({("link_geometry", "*"), ("joint_offset", "*")})


def length(number: int, seed: int, of=LENGTHS, row: str = "length") -> Trial:
    """One length (or twist) is wrong; the robot file states the geometry, or does not."""
    rng = rng_of(row, number, seed)
    name = list(of)[number % len(of)]
    stated = bool(rng.random() < 0.5)
    raw = robot_file(stated, False)
    design = with_targets(campaign(rng, stated=bool(rng.random() < 0.5)), rng)
    by = sized(rng, 5e-5, 5e-4)
    shifts, turns = ({of[name]: by}, {}) if of is LENGTHS else ({}, {of[name]: by})
    scene = bent(as_filed(False), shifts, turns)
    readings, sigma = read(scene, design, rng)
    joint = f"A{of[name][0]}"
    own = frozenset({("link_geometry", joint)})
    # what the file states as geometry may move; nothing is missing then
    needed = frozenset() if stated else own
    words = f"{name} {1e3 * by:+.3f}, {'stated' if stated else 'not stated'}, {len(design.q)} poses"
    return Trial(
        row, number, files_of(raw, readings), own, needed, scene, design, sigma, words,
        {"data.csv": measurements_csv(unsaid(readings))},
    )  # fmt: skip


def twist(number: int, seed: int) -> Trial:
    return length(number, seed, TWISTS, "twist")


def scale(number: int, seed: int) -> Trial:
    """Nothing is wrong but the tracker's scale."""
    rng = rng_of("scale", number, seed)
    raw = robot_file(bool(rng.random() < 0.3), False)
    design = with_targets(campaign(rng), rng)
    by = sized(rng, 1e-5, 3e-4)
    readings, sigma = read(as_filed(False), design, rng, by)
    words = f"scale {1e6 * by:+.0f} ppm"
    return Trial("scale", number, files_of(raw, readings), frozenset(), frozenset(), as_filed(False), design,
                 sigma, words, {"data.csv": measurements_csv(unsaid(readings))})  # fmt: skip


SHOWN, SOME = 2.0, 5
"""Standard deviations of a coordinate, root mean square, by which a gap shows, and poses at which it does clearly."""


def approach(number: int, seed: int) -> Trial:
    """Backlash (under load) or hysteresis, with senses of approach in the file and without; so large that it shows at
    some poses (a gap that no load changes sides of cannot)."""
    rng = rng_of("approach", number, seed)
    name = ("backlash", "hysteresis")[number % 2]
    told = number // 2 % 2 == 0
    raw = robot_file(name == "hysteresis", True)
    count = int(rng.choice([30, 45, 60]))
    design = drawn(model_of(raw), count, name == "backlash", rng, planned=False, places=True)
    design = replace(design, told=told, time=None, temperature=None)
    if not told:  # the file's order is not that of the approach either
        design = replace(design, senses=rng.choice([-1.0, 1.0], design.q.shape))
    sigma, size, without = (
        measured.scatter(design, model_of(raw)),
        0.0,
        measured.observed(as_filed(True), design),
    )
    for more in range(20):
        h, size = hidden.drawn(name, rng), float(rng.uniform(1.0, 4.0)) * 1.1**more
        scene = h.into(as_filed(True), size)
        away = (measured.observed(scene, design) - without).reshape(len(design.q), -1)
        if np.sqrt(np.mean(away**2)) > SHOWN * sigma and (abs(away).max(axis=1) > 3 * sigma).sum() >= SOME:
            break
    moved = jitter(design, rng)
    value = measured.observed(scene, design, moved) + measured.noise(design, rng)
    own = frozenset({(name, h.joint)})
    words = f"{name} {h.joint} x{size:.2f}, {'DIR' if told else 'no DIR'}, {count} poses"
    return Trial("approach", number, files_of(raw, measured.readings(design, value, sigma)), own, own, scene,
                 design, sigma, words)  # fmt: skip


def twin(number: int, seed: int) -> Trial:
    """What two effects predict alike at every pose: a foundation that only tilts or a tilt of axis 1, a wave of A2's
    gear or a weight on A2 with compliance, the zero of A1 or the robot turned on its base."""
    rng = rng_of("twin", number, seed)
    kind = number % 2
    count = int(rng.choice([20, 30, 45]))
    if kind == 0:
        raw = robot_file(False, False)
        design = drawn(model_of(raw), count, True, rng, planned=False, places=True)
        tilt = np.zeros(6)
        tilt[3:5] = rng.uniform(1.0, 4.0, 2) * 1e-8
        scene = as_filed(False).having({"base": tilt})
        if rng.random() < 0.5:
            tilts = np.zeros(12)
            tilts[:2] = tilt[3:5]
            scene = as_filed(False).having({"tilts": tilts})
        accept = frozenset({("base_compliance", ""), ("link_compliance", "A1")})
    else:
        raw = robot_file(False, False)
        design = with_targets(campaign(rng, count, stated=True, filed=raw), rng)
        design = replace(design, frame=None)
        turn = sized(rng, 3e-4, 2e-3)
        zero = np.zeros(6)
        zero[0] = turn
        offset = np.zeros(6)
        offset[5] = turn
        parts = {"zero": zero} if rng.random() < 0.5 else {"base_offset": offset}
        scene = as_filed(False).having(parts)
        accept = frozenset({("joint_offset", "A1"), ("base_offset", "")})
    sigma = measured.scatter(design, model_of(raw))
    value = measured.observed(scene, design, jitter(design, rng)) + measured.noise(design, rng)
    readings = replace(measured.readings(design, value, sigma), time=None, temperature=None)
    words = ("tilting foundation or bearing", "zero of A1 or turned base")[kind] + f", {count} poses"
    return Trial("twin", number, files_of(raw, readings), accept, accept, scene, design, sigma, words)


def remounted(number: int, seed: int) -> Trial:
    """Four sessions, before each of which the reflectors were mounted anew."""
    return stations(number, seed, "remounted")


def stations(number: int, seed: int, row: str = "stations") -> Trial:
    """Two to four sessions of one mounting with one reflector or three that nobody has measured, each from another
    station; geometry as of an arm that was never calibrated.  Every third time files instead of a column, every fourth
    time the reflector is mounted anew between sessions."""
    rng = rng_of(row, number, seed)
    raw = robot_file(False, False)
    always = row == "remounted"
    sessions = 4 if always else 2 + number % 3
    design = with_targets(campaign(rng, 40, stated=False), rng, 1 if number % 2 else 3)
    scene = as_filed(False)
    shifts = {key: rng.normal(0, 3e-4) for key in LENGTHS.values()}
    zero = np.append(0.0, rng.normal(0, 1e-3, 5))
    scene = bent(scene, shifts, {}).having({"zero": zero})
    several, remount = [], always or number % 4 == 3
    for k in range(sessions):
        away, turn = rng.uniform(2.5, 4.0), rng.uniform(-np.pi, np.pi)
        frame = Poses(
            rotation_from_vector([0.0, 0.0, rng.uniform(-np.pi, np.pi)]),
            np.array([away * np.cos(turn), away * np.sin(turn), rng.uniform(0.5, 1.5)]),
        ).inverse()
        q = poses(model_of(raw), int(rng.choice([8, 15, 25])), design.tool, rng)
        targets = design.targets + (rng.normal(0, 5e-3, 3) if remount and k else 0.0)
        part = replace(design, q=q, frame=frame, targets=targets, wrench=np.zeros((len(q), 1, 6)))
        several.append(read(scene, part, rng))
    sigma = several[0][1]
    if number % 3 == 2:
        files = {"robot.yaml": raw} | {
            f"data{k}.csv": measurements_csv(one) for k, (one, _) in enumerate(several)
        }
    else:
        files = files_of(raw, one_file([one for one, _ in several]))
    truth = frozenset({("link_geometry", "*"), ("joint_offset", "*")})
    words = f"{sessions} sessions, {len(design.targets)} reflectors{', mounted anew' if remount else ''}"
    return Trial(row, number, files, truth, truth, scene, design, sigma, words)


def one_file(several: list[Readings]) -> Readings:
    """Sessions of one file."""
    arrays = {
        name: np.concatenate([getattr(one, name) for one in several])
        for name in ("q", "wrench", "value", "target", "sigma", "file", "line")
    }
    session = np.repeat(np.arange(len(several)), [len(one) for one in several])
    direction = None
    if several[0].direction is not None:
        direction = np.concatenate([one.direction for one in several if one.direction is not None])
    names = tuple(f"S{k + 1}" for k in range(len(several)))
    repeat = alike(arrays["q"], arrays["wrench"], arrays["target"], session)
    return replace(several[0], **arrays, session=session, sessions=names, direction=direction, repeat=repeat)


def sag(number: int, seed: int) -> Trial:
    """The arm's own weight bends it; the robot file states neither weight nor stiffness."""
    rng = rng_of("sag", number, seed)
    raw = bare_file()
    design = with_targets(campaign(rng, 45, stated=bool(rng.random() < 0.5), filed=raw), rng)
    scene = as_filed(True)
    scene = replace(scene, compliance=COMPLIANCE * np.exp(rng.uniform(np.log(0.7), np.log(1.4), 6)))
    sigma = measured.scatter(design, model_of(raw))
    value = measured.observed(scene, design, jitter(design, rng)) + measured.noise(design, rng)
    readings = measured.readings(design, value, sigma)
    accept = frozenset({("link_gravity", "*"), ("joint_compliance", "*"), ("gravity_sag", "*")})
    return Trial("sag", number, files_of(raw, readings), accept, accept, scene, design, sigma, "own weight",
                 {"data.csv": measurements_csv(unsaid(readings))})  # fmt: skip


def soft(number: int, seed: int) -> Trial:
    """An arm that bends under its own weight and has a wrong length, by a file without stiffness; every second time
    places are measured with and without one weight too, which shows how soft the joints are."""
    rng = rng_of("soft", number, seed)
    raw = bare_file()
    loaded = number % 2 == 1
    design = campaign(rng, 45, loads=loaded, stated=bool(rng.random() < 0.5), filed=raw)
    if loaded:
        wrench = np.zeros((len(design.q), 2, 6))
        wrench[:, 1, 2] = -round(float(rng.uniform(60.0, 250.0)) * 9.80665, 2)
        design = replace(design, wrench=wrench)
    design = with_targets(design, rng)
    name = list(LENGTHS)[number // 2 % len(LENGTHS)]
    scene = bent(as_filed(True), {LENGTHS[name]: sized(rng, 2e-4, 1e-3)}, {})
    scene = replace(scene, compliance=COMPLIANCE * np.exp(rng.uniform(np.log(0.7), np.log(1.4), 6)))
    readings, sigma = read(scene, design, rng)
    accept = {("gravity_sag", "*"), ("link_gravity", "*"), ("joint_compliance", "*"), *GEOMETRY}
    needed = frozenset({("joint_compliance", "*") if loaded else ("gravity_sag", "*")})
    words = f"own weight, {name}{', one weight hung' if loaded else ''}"
    return Trial(
        "soft", number, files_of(raw, readings), frozenset(accept), needed, scene, design, sigma, words
    )


def remainder(number: int, seed: int) -> Trial:
    """One length is wrong by half a millimetre to two, and what no effect explains remains for ever: every joint has
    errors of its own over its angle, of orders that no library has, three times the scatter together."""
    rng = rng_of("remainder", number, seed)
    name = list(LENGTHS)[number % len(LENGTHS)]
    raw = robot_file(False, False)
    design = with_targets(campaign(rng, 60, stated=bool(rng.random() < 0.5)), rng)
    scene = bent(as_filed(False), {LENGTHS[name]: sized(rng, 5e-4, 2e-3)}, {})
    sigma = measured.scatter(design, model_of(raw))
    exact = measured.observed(scene, design)
    order, phase = rng.uniform(3.3, 9.0, (4, 6)), rng.uniform(0.0, 2.0 * np.pi, (4, 6))
    away = np.sin(order[:, None] * design.q + phase[:, None]).sum(axis=0) * rng.normal(size=6)
    error = measured.observed(scene, design, away * 1e-5) - exact
    error *= 3.0 * sigma / np.sqrt(np.mean((error - error.mean(axis=0)) ** 2))
    readings = measured.readings(design, exact + error + measured.noise(design, rng), sigma)
    needed = frozenset({("link_geometry", f"A{LENGTHS[name][0]}")})
    words = f"{name}, and what always remains"
    return Trial(
        "remainder", number, files_of(raw, readings), needed, needed, scene, design, sigma, words,
        {"data.csv": measurements_csv(unsaid(readings))},
    )  # fmt: skip


def bare_file() -> bytes:
    """The robot file without any effect."""
    text = robot_file(False, False).decode()
    head, rest = text.split("effects:\n", 1)
    return (head + "effects: []\n" + rest[rest.index("mechanisms:") :]).encode()


def lost(number: int, seed: int) -> Trial:
    """Rows of zeros where the beam was lost, a file given twice, a row in the wrong place; and nothing is missing."""
    rng = rng_of("lost", number, seed)
    raw = robot_file(True, False)
    design = with_targets(campaign(rng, 60, stated=True), rng)
    readings, sigma = read(as_filed(False), design, rng)
    kind = number % 3
    value = readings.value.copy()
    if kind == 0:
        value[rng.choice(len(value), int(rng.integers(1, 8)), replace=False)] = 0.0
        words = "rows of zeros"
    elif kind == 1:
        start = 3 * int(rng.integers(10, len(value) // 3 - 10))
        value[start:] = np.roll(value[start:], 3, axis=0)
        words = "values shifted by one row from the middle on"
    else:
        words = "extra columns"
    files = files_of(raw, replace(readings, value=value))
    if kind == 2:
        lines = files["data.csv"].decode().splitlines()
        head = next(k for k, line in enumerate(lines) if not line.startswith("#"))
        lines = [
            *lines[:head],
            lines[head] + ",OPERATOR,HUMIDITY",
            *(f"{line},Kim,{40 + k % 5}" for k, line in enumerate(lines[head + 1 :])),
        ]
        files["data.csv"] = ("\n".join(lines) + "\n").encode()
    return Trial("lost", number, files, frozenset(), frozenset(), as_filed(False), design, sigma, words)


def files_of(raw: bytes, readings: Readings) -> dict[str, bytes]:
    return {"robot.yaml": raw, "data.csv": measurements_csv(readings)}


STRANGE_SIZE = 3.0
"""Standard deviations of a coordinate, root mean square, by which a strange error shows."""


def _settling(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """Read before the arm stands still: behind on its way, the more the further it came."""
    way = np.diff(q, axis=0, prepend=q[:1])
    return np.cross(way[:, :3] @ rng.normal(size=(3, 3)), at.position)


def _flank(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """A gear of A3 with another ratio on one side of its range: a corner at some angle."""
    corner = np.median(q[:, 2]) + rng.uniform(-0.3, 0.3)
    return np.maximum(q[:, 2] - corner, 0.0)[:, None] * np.cross([0.0, 1.0, 0.0], at.position)


def _drag(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """Cables that pull the wrist back once A4 and A6 are twisted together."""
    twisted = np.maximum(np.abs(q[:, 3] + q[:, 5]) - 2.0, 0.0) ** 2
    return twisted[:, None] * at.rotation[:, :, 0]


def _nest(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """A reflector that does not sit in the middle of its nest's sphere: off along the beam's side of the nest."""
    beam = seen / np.linalg.norm(seen, axis=1, keepdims=True)
    incidence = (at.rotation[:, :, 2] * beam).sum(axis=1)
    return (incidence**2)[:, None] * beam


def _refraction(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """A beam that warm air above the floor bends."""
    size = np.linalg.norm(seen[:, :2], axis=1) ** 2 * np.exp(-at.position[:, 2] / 0.5)
    return size[:, None] * np.array([0.0, 0.0, 1.0])


def _warming(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """A column that leans while the arm warms up, in a file without time and temperature."""
    share = 1.0 - np.exp(-np.arange(len(q)) / (0.3 * len(q)))
    return share[:, None] * np.cross(rng.normal(size=3), at.position)


def _slip(at: Poses, q: np.ndarray, seen: np.ndarray, rng) -> np.ndarray:
    """A tool that slips in its holder at some moment, and stays there."""
    later = np.arange(len(q)) >= rng.integers(len(q) // 4, 3 * len(q) // 4)
    return later[:, None] * (at.rotation @ rng.normal(size=3))


STRANGE = {
    "settling": _settling,
    "flank": _flank,
    "cable drag": _drag,
    "nest": _nest,
    "refraction": _refraction,
    "warming": _warming,
    "tool slip": _slip,
}
"""Errors of an arm, its tool and its tracker that no effect of the library is."""


def strange(number: int, seed: int) -> Trial:
    """Something is wrong that is no effect of the library."""
    rng = rng_of("strange", number, seed)
    name = list(STRANGE)[number % len(STRANGE)]
    raw = robot_file(True, False)
    design = with_targets(campaign(rng, stated=bool(rng.random() < 0.5)), rng)
    model = model_of(raw)
    at = model.chain.flange(design.q) @ design.tool
    frame = Poses.identity() if design.frame is None else design.frame
    seen = at.position @ frame.rotation.T + frame.position
    moved = STRANGE[name](at, design.q, seen, rng) @ frame.rotation.T
    sigma = measured.scatter(design, model)
    moved *= STRANGE_SIZE * sigma / np.sqrt(np.mean((moved - moved.mean(axis=0)) ** 2))
    value = measured.observed(as_filed(False), design, jitter(design, rng)) + np.repeat(
        moved, design.points, axis=0
    )
    readings = measured.readings(design, value + measured.noise(design, rng), sigma)
    return Trial(
        "strange",
        number,
        files_of(raw, readings),
        frozenset(),
        frozenset(),
        as_filed(False),
        design,
        sigma,
        name,
    )


TRIALS: dict[str, Callable[[int, int], Trial]] = {
    "length": length,
    "twist": twist,
    "scale": scale,
    "approach": approach,
    "twin": twin,
    "stations": stations,
    "remounted": remounted,
    "sag": sag,
    "soft": soft,
    "remainder": remainder,
    "lost": lost,
    "strange": strange,
}
