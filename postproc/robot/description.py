"""Robot files: ``robots/<name>.yaml`` read, checked, in SI."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.arrays import Floats, frozen
from postproc.findings import Finding, Refusal, nearest
from postproc.geometry import Poses, rotation_from_vector
from postproc.units import DEG, to_si, words_for
from postproc.yamlfile import Section, load


@dataclass(frozen=True)
class Joint:
    """A joint that turns about (``revolute``) or moves along (``prismatic``) the z axis of its own frame.

    ``placement``: that frame in the frame of the joint before (of the base for the first), at value zero.
    ``lower``, ``upper`` [rad, m].
    """

    name: str
    placement: Poses
    lower: float
    upper: float
    kind: str = "revolute"


@dataclass(frozen=True)
class KukaLengths:
    """Link lengths [m] of a KUKA-type arm with a spherical wrist.

    d1 floor to axis 2, a1 axis 1 to axis 2, a2 axis 2 to axis 3, a3 height of the wrist axis over axis 3 and
    d4 axis 3 to wrist centre with the forearm level, d6 wrist centre to flange.
    """

    d1: float
    a1: float
    a2: float
    a3: float
    d4: float
    d6: float

    def joints(self, names: list[str], limits: list[tuple[float, float]]) -> tuple[Joint, ...]:
        """Axis senses A1 -z, A2 +y, A3 +y, A4 -x, A5 +y, A6 -x; zero pose: arm stretched forward."""
        axes = [(0, 0, -1), (0, 1, 0), (0, 1, 0), (-1, 0, 0), (0, 1, 0), (-1, 0, 0)]
        origins = [
            (0.0, 0.0, 0.0),
            (self.a1, 0.0, self.d1),
            (self.a2, 0.0, 0.0),
            (self.d4, 0.0, self.a3),
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
        ]
        joints, before = [], np.eye(3)
        for name, axis, origin, (lower, upper) in zip(names, axes, origins, limits, strict=True):
            frame = _frame_with_z(axis)
            placement = Poses(frozen(before.T @ frame), frozen(before.T @ np.array(origin)))
            joints.append(Joint(name, placement, lower, upper))
            before = frame
        return tuple(joints)

    def flange(self) -> Poses:
        """The flange in the frame of A6: its z axis points out along the forearm (R = Ry(90 deg) at zero)."""
        last = _frame_with_z((-1, 0, 0))
        at_zero = rotation_from_vector([0.0, np.pi / 2, 0.0])
        return Poses(frozen(last.T @ np.round(at_zero)), frozen(last.T @ np.array([self.d6, 0.0, 0.0])))


def _frame_with_z(axis: tuple[int, int, int]) -> Floats:
    """A rotation whose z column is ``axis``, of zeros and ones only."""
    z = np.array(axis, dtype=float)
    x = np.array([0.0, 0.0, 1.0]) if abs(z[2]) < 0.5 else np.array([1.0, 0.0, 0.0])
    return np.stack([x, np.cross(z, x), z], axis=1)


@dataclass(frozen=True)
class Value:
    """A parameter as the file states it, in SI.  ``interval``: half width, of ``level`` (None: unstated)."""

    value: float
    interval: float | None
    level: float | None
    source: str


@dataclass(frozen=True)
class EffectEntry:
    """One entry of ``effects:``; what it may hold is the business of the effect itself."""

    name: str
    section: Section


@dataclass(frozen=True)
class Robot:
    """A robot file.  ``arm``: link lengths of the actual robot, ``nominal``: those that the controller believes."""

    name: str
    maker_name: str
    path: Path
    digest: str
    about: str
    arm: KukaLengths
    nominal: KukaLengths
    geometry_source: str
    joints: tuple[Joint, ...]
    flange: Poses
    limits_source: str
    effects: tuple[EffectEntry, ...]

    @property
    def limits(self) -> Floats:
        """(n, 2) [rad]"""
        return np.array([(joint.lower, joint.upper) for joint in self.joints])


def folders() -> list[Path]:
    """Where robot files lie: in the installed package, or beside it in a source tree."""
    package = Path(__file__).resolve().parent.parent
    return [folder for folder in (package / "_robots", package.parent / "robots") if folder.is_dir()]


def robot_files() -> dict[str, Path]:
    """name -> file of every robot that comes with the tool."""
    return {path.stem: path for folder in reversed(folders()) for path in sorted(folder.glob("*.yaml"))}


def find_robot(name: str, beside: Path | None = None) -> Path:
    """The file of a robot: its name in ``robots/``, or a path, relative to the folder ``beside``.

    Raises Refusal CEL003 with the nearest name.
    """
    if not name.endswith((".yaml", ".yml")):
        known = robot_files()
        if name in known:
            return known[name]
        raise Refusal(
            Finding(
                "CEL003",
                f"robot {name!r} is not known{nearest(name, known)}",
                help="known robots: "
                + ", ".join(sorted(known))
                + "; or give the path of a robot file (.yaml)",
            )
        )
    path = Path(name)
    if beside is not None and not path.is_absolute():
        path = beside / path
    if not path.is_file():
        raise Refusal(Finding("CEL003", f"robot file {path} does not exist"))
    return path


def load_robot(path: Path) -> Robot:
    """Read and check a robot file.  Raises Refusal with file, line and key."""
    top = load(path)
    top.only("name", "maker_name", "about", "geometry", "controller", "joints", "effects", "mechanisms")
    geometry = top.section("geometry")
    geometry.only("kuka", "source")
    arm = _lengths(geometry.section("kuka"))
    controller = top.section("controller", {})
    controller.only("kuka", "source")
    nominal = _lengths(controller.section("kuka")) if "kuka" in controller else arm
    names, limits = _limits(top)
    entries = []
    for section in top.sections("effects"):
        entries.append(EffectEntry(section.text("effect"), section))
    return Robot(
        name=top.text("name"),
        maker_name=top.text("maker_name", ""),
        path=path,
        digest=hashlib.sha256(path.read_bytes()).hexdigest(),
        about=top.text("about", ""),
        arm=arm,
        nominal=nominal,
        geometry_source=geometry.text("source"),
        joints=arm.joints(names, limits),
        flange=arm.flange(),
        limits_source=top.section("joints").text("source"),
        effects=tuple(entries),
    )


def _lengths(section: Section) -> KukaLengths:
    names = ("d1", "a1", "a2", "a3", "d4", "d6")
    section.only(*names, "unit")
    factor = unit_factor(section, "m")
    lengths = KukaLengths(**{name: section.number(name) * factor for name in names})
    for name in ("a2", "d4"):
        if getattr(lengths, name) <= 0:
            raise section.error("YML004", "must be positive", name)
    return lengths


def _limits(top: Section) -> tuple[list[str], list[tuple[float, float]]]:
    joints = top.section("joints")
    names = [f"A{i}" for i in range(1, 7)]
    joints.only(*names, "unit", "source")
    factor = unit_factor(joints, "rad")
    limits = []
    for name in names:
        lower, upper = joints.numbers(name, 2)
        if not lower < upper:
            raise joints.error("YML004", "the lower limit must be below the upper one", name)
        limits.append((lower * factor, upper * factor))
    if max(abs(bound) for pair in limits for bound in pair) > 1000 * DEG:
        raise joints.error("YML004", "axis limits of more than 1000 deg", "unit")
    return names, limits


def unit_factor(section: Section, si_unit: str) -> float:
    """The factor to SI of the section's ``unit`` key.  Raises Refusal YML005 for a unit of another quantity."""
    word = section.text("unit")
    factor = to_si(word, si_unit)
    if factor is None:
        allowed = words_for(si_unit)
        raise section.error(
            "YML005",
            f"{word!r} is no unit of this quantity{nearest(word, allowed)}",
            "unit",
            "allowed here: " + ", ".join(allowed),
        )
    return factor


def parameter_value(section: Section, si_unit: str) -> Value:
    """One parameter: {value, unit, ci95 | ci with ci_level: unstated, source}.  An interval is a half width."""
    section.only("value", "unit", "ci95", "ci", "ci_level", "source")
    factor = unit_factor(section, si_unit)
    interval, level = None, None
    if "ci95" in section:
        interval, level = section.number("ci95", low=0.0) * factor, 0.95
    elif "ci" in section:
        section.text("ci_level", choices=("unstated",))
        interval = section.number("ci", low=0.0) * factor
    return Value(section.number("value") * factor, interval, level, section.text("source"))
