"""Trials of other arms: what the library knows, on arms that were not its pattern, and what no library has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from postproc.identification.campaign import Campaign
from postproc.identification.registration import registered
from postproc.measurements.read_csv import read_measurements
from postproc.model import StiffnessModel

from .other_arms import ARMS, SIGMA, UNKNOWN, Arm, World, csv_of, drawn_poses, lines_of, strange_error
from .real_worlds import GEOMETRY, Trial, rng_of, sized

FRESH = 20
"""Poses that were not measured."""

SHOWN = 3.0
"""Standard deviations of a coordinate, root mean square, by which a strange error shows."""

Truth = tuple[frozenset[tuple[str, str]], frozenset[tuple[str, str]]]
"""What may be named, and of which one must be."""

NOTHING: Truth = frozenset(), frozenset()


def fresh_gap(world: World, number: int, hung: float) -> Callable[[StiffnessModel], float]:
    """[m] root mean square that a model leaves at poses that were not measured, tracker and targets found anew."""

    def gap(model: StiffnessModel) -> float:
        rng = np.random.default_rng([number, 8])
        q = drawn_poses(world.arm, FRESH, rng)
        text = csv_of(world, q, rng, load=_weights(len(q), hung) if hung else None, sigma=0.0, stated=False)
        with TemporaryDirectory() as folder:
            path = Path(folder, "fresh.csv")
            path.write_bytes(text)
            axes = [(joint.name, joint.kind == "prismatic") for joint in model.robot.joints]
            seen = Campaign(read_measurements(path, axes))
        at = seen.predicted(model)
        given = registered(seen, at, np.ones(len(seen), bool))
        return float(np.sqrt(3 * np.mean(seen.residual(at, given)[:, :3] ** 2)))

    return gap


def _weights(count: int, hung: float) -> np.ndarray:
    """(N, 3) [N] every second pose under a weight [kg]."""
    load = np.zeros((count, 3))
    load[1::2, 2] = -9.80665 * hung
    return load


def _joint(arm: Arm, rng: np.random.Generator, first: int = 1, last: int = -1) -> int:
    """One that turns, neither the first nor the last: what those do, tracker and targets may do as well."""
    own = np.flatnonzero(arm.turns)[first:last]
    return int(own[int(rng.integers(len(own)))])


def _across(world: World, joint: int, rng: np.random.Generator) -> str:
    """A direction of the base, at zero, across the axis of a joint; of the second not along the first, where the base
    is moved."""
    axes = lines_of(world.arm).axis[[joint, 0] if joint == 1 else [joint]]
    return "xyz"[rng.choice([k for k in range(3) if (abs(axes[:, k]) < 0.5).all()])]


def _nothing(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    return world, NOTHING, "nothing"


def _scale(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    by = sized(rng, 1e-5, 3e-4)
    return replace(world, scale=by), NOTHING, f"scale {1e6 * by:+.0f} ppm"


def _length(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    joint, by = _joint(world.arm, rng), sized(rng, 5e-5, 5e-4)
    way, name = _across(world, joint, rng), world.arm.names[joint]
    own = frozenset({("link_geometry", "*")})
    return replace(world, moved={(joint, way): by}), (own, own), f"{name} {way} {1e3 * by:+.3f} mm"


def _twist(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    joint, by = _joint(world.arm, rng), sized(rng, 5e-5, 5e-4)
    way, name = _across(world, joint, rng), world.arm.names[joint]
    own = frozenset({("link_geometry", "*")})
    # a turn about an axis that is parallel is a zero of that one
    return (
        replace(world, moved={(joint, f"r{way}"): by}),
        (GEOMETRY, own | GEOMETRY),
        (f"{name} r{way} {1e3 * by:+.3f} mrad"),
    )


def _zero(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    joint, by = _joint(world.arm, rng), sized(rng, 1e-4, 1e-3)
    zero = world.zero.copy()
    zero[joint] = by
    name = world.arm.names[joint]
    return replace(world, zero=zero), (GEOMETRY, GEOMETRY), f"zero of {name} {1e3 * by:+.3f} mrad"


def _wave(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    joint, wave = _joint(world.arm, rng), world.wave.copy()
    wave[joint, :2] = rng.normal(0.0, 2e-4, 2)
    name = world.arm.names[joint]
    own = frozenset({("transmission_error", name)})
    alike = frozenset({("gravity_sag", name), ("link_gravity", "*"), ("joint_compliance", name)})
    return replace(world, wave=wave), (own | alike, own | alike), f"wave of {name}"


def _side(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    joint, wave = _joint(world.arm, rng), world.wave.copy()
    wave[joint, 2] = rng.uniform(5e-5, 2e-4)
    name = world.arm.names[joint]
    own = frozenset({("hysteresis", name), ("backlash", name)})
    return replace(world, wave=wave), (own, own), f"hysteresis of {name} {1e3 * wave[joint, 2]:.3f} mrad"


def _soft(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    """Joints that give way, about a millimetre under the weight that is hung."""
    lever = 0.5 * world.arm.limits.shape[0] / 6.0
    soft = np.exp(rng.uniform(np.log(0.5), np.log(2.0), len(world.soft))) * 1e-6 / lever
    own = frozenset({("joint_compliance", "*")})
    return replace(world, soft=np.where(world.arm.turns, soft, 0.0)), (own, own), "soft joints"


def _sag(world: World, rng: np.random.Generator) -> tuple[World, Truth, str]:
    world, _, _ = _soft(world, rng)
    masses = np.where(world.arm.turns, rng.uniform(10.0, 40.0, len(world.soft)), 0.0)
    own = frozenset({("gravity_sag", "*"), ("link_gravity", "*"), ("joint_compliance", "*")})
    return replace(world, masses=masses), (own, own), "own weight on soft joints"


KNOWN = {
    "nothing": _nothing,
    "length": _length,
    "twist": _twist,
    "zero": _zero,
    "wave": _wave,
    "side": _side,
    "scale": _scale,
    "soft": _soft,
    "sag": _sag,
}


def arms(number: int, seed: int) -> Trial:
    """One thing is wrong with an arm of another kind; half of the files do not state their scatter, a third not where
    the reflectors are, a third no senses of approach."""
    rng = rng_of("arms", number, seed)
    arm = list(ARMS.values())[number % len(ARMS)]
    kind = list(KNOWN)[number % len(KNOWN)]
    world, (accept, needed), words = KNOWN[kind](World.of(arm), rng)
    stated, told, targets = rng.random() < 0.5, rng.random() < 0.67, rng.random() < 0.67
    q = drawn_poses(arm, int(rng.choice([25, 40, 60])), rng)
    hung = float(rng.uniform(3.0, 30.0)) if kind == "soft" else 0.0
    if hung:
        q = np.repeat(q, 2, axis=0)
    if kind == "side" and not told:
        needed = frozenset()
    side = np.sign(np.diff(q, axis=0, prepend=2 * q[:1] - q[1:2])) if not told else None
    if side is not None:
        side = np.where(side == 0, rng.choice([-1.0, 1.0], side.shape), side)
    load = _weights(len(q), hung) if hung else None
    text = csv_of(world, q, rng, side, load, stated, told, targets)
    words = f"{arm.name}, {words}, {len(q)} poses" + "".join(
        f", no {what}"
        for what, there in (("sigma", stated), ("DIR", told), ("targets", targets))
        if not there
    )
    return Trial("arms", number, {"robot.yaml": arm.file(), "data.csv": text}, accept, needed, None, None, SIGMA,
                 words, fresh=fresh_gap(world, number, hung))  # fmt: skip


def unknown(number: int, seed: int) -> Trial:
    """Something that no library has is wrong with an arm of another kind."""
    rng = rng_of("unknown", number, seed)
    arm = list(ARMS.values())[number % len(ARMS)]
    name = list(UNKNOWN)[number % (len(UNKNOWN) + 1) % len(UNKNOWN)]
    world, q = World.of(arm), drawn_poses(arm, int(rng.choice([25, 40, 60])), rng)
    size = SHOWN * SIGMA * (1.0 if rng.random() < 0.6 else 5.0)
    stated, targets = rng.random() < 0.7, rng.random() < 0.67
    text = csv_of(
        world, q, rng, stated=stated, targets=targets, more=strange_error(world, q, name, size, rng)
    )
    words = f"{arm.name}, {name} {1e3 * size:.2f} mm, {len(q)} poses{'' if stated else ', no sigma'}"
    return Trial("unknown", number, {"robot.yaml": arm.file(), "data.csv": text}, frozenset(), frozenset(), None,
                 None, SIGMA, words, fresh=fresh_gap(world, number, 0.0))  # fmt: skip
