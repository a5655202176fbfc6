"""Robot files: ``robots/<name>.yaml`` read, checked, in SI."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from postproc.arrays import Floats, Ints, frozen
from postproc.findings import Finding, Refusal, nearest
from postproc.geometry import Poses
from postproc.robot.geometries import (
    Axis,
    Geometry,
    KukaVariant,
    Link,
    Row,
    SerialArm,
    based,
    modified_dh,
    standard_dh,
    turn_about,
)
from postproc.robot.geometries import Joint as Joint
from postproc.robot.geometries import KukaLengths as KukaLengths
from postproc.robot.urdf import read_urdf
from postproc.units import DEG, UNITS, to_si, words_for
from postproc.yamlfile import Section, load

KINDS = ("kuka", "dh", "mdh", "urdf")
MAX_TURN = 1000 * DEG
MAX_WAY = 200.0
"""[m] Limits beyond these were written in another unit."""


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
class Mass:
    """Mass [kg] of the link that a joint moves; ``com`` (3,) [m] its centre, in the frame that the joint moves."""

    joint: str
    mass: float
    com: Floats


@dataclass(frozen=True)
class Quantity:
    """Numbers of a mechanism: ``values`` (k,) in the SI ``unit``; ``source``, empty where it is the mechanism's."""

    values: Floats
    unit: str
    source: str


@dataclass(frozen=True)
class Mechanism:
    """Known hardware whose effect may or may not be modelled, as data."""

    name: str
    kind: str
    joint: str | None
    about: str
    source: str
    quantities: dict[str, Quantity]
    line: int


@dataclass(frozen=True)
class Robot:
    """A robot file.  ``arm``: geometry of the actual robot, ``nominal``: the one that the controller believes.

    All values of joints are the controller's (see ``geometries``).  ``external``: column of the joint of seven that a
    program does not place the flange with; it stays where it was.
    """

    name: str
    maker_name: str
    path: Path
    digest: str
    about: str
    arm: Geometry
    nominal: Geometry
    geometry_source: str
    joints: tuple[Joint, ...]
    flange: Poses
    limits_source: str
    effects: tuple[EffectEntry, ...]
    axes: tuple[Axis, ...] = ()
    external: int | None = None
    masses: tuple[Mass, ...] = ()
    masses_source: str = ""
    mechanisms: tuple[Mechanism, ...] = ()

    @property
    def limits(self) -> Floats:
        """(n, 2) [rad, m]"""
        return np.array([(joint.lower, joint.upper) for joint in self.joints])

    @property
    def programmed(self) -> Ints:
        """(6,) columns of the joints that a program's six axis values are: all but the external one."""
        return np.array([i for i in range(len(self.joints)) if i != self.external])


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
    top.only(
        "name", "maker_name", "about", "geometry", "controller", "joints", "masses", "effects", "mechanisms"
    )
    geometry = top.section("geometry")
    kind = _kind(geometry)
    axes = _axes(top.section("joints"))
    arm, read = _geometry(geometry, kind, axes, top.section("joints"))
    nominal = arm
    if "controller" in top:
        controller = top.section("controller")
        believed = _kind(controller)
        if believed != kind:
            raise controller.error(
                "YML004", f"the controller's geometry must be of the same kind, {kind}", believed
            )
        nominal, more = _geometry(controller, kind, axes, top.section("joints"))
        read += more
    names = [axis.name for axis in axes]
    limits = [(axis.lower, axis.upper) for axis in axes]
    digest = hashlib.sha256(path.read_bytes())
    for other in read:
        digest.update(other.read_bytes())
    return Robot(
        name=top.text("name"),
        maker_name=top.text("maker_name", ""),
        path=path,
        digest=digest.hexdigest(),
        about=top.text("about", ""),
        arm=arm,
        nominal=nominal,
        geometry_source=geometry.text("source"),
        joints=arm.joints(names, limits),
        flange=arm.flange(),
        limits_source=top.section("joints").text("source"),
        effects=tuple(EffectEntry(section.text("effect"), section) for section in top.sections("effects")),
        axes=axes,
        external=_external(arm),
        masses=_masses(top.section("masses"), names, arm) if "masses" in top else (),
        masses_source=top.section("masses").text("source") if "masses" in top else "",
        mechanisms=_mechanisms(top, names),
    )


def _external(arm: Geometry) -> int | None:
    if isinstance(arm, SerialArm):
        return arm.held
    return 0 if isinstance(arm, KukaVariant) and arm.rail is not None else None


def _kind(section: Section) -> str:
    section.only(*KINDS, "rail", "base", "flange", "source")
    kinds = [kind for kind in KINDS if kind in section]
    if len(kinds) > 1:
        raise section.error("YML004", f"beside {kinds[0]}; one geometry is enough", kinds[1])
    if not kinds:
        raise section.error("YML003", "a geometry is missing", help="one of: " + ", ".join(KINDS))
    section.text("source")
    for key, only in (("rail", ("kuka",)), ("base", KINDS[1:]), ("flange", KINDS[1:])):
        if key in section and kinds[0] not in only:
            raise section.error("YML004", f"has no meaning for a {kinds[0]} geometry", key)
    return kinds[0]


def _geometry(
    section: Section, kind: str, axes: tuple[Axis, ...], joints: Section
) -> tuple[Geometry, list[Path]]:
    """The geometry of a section, and the files it was read from beside this one."""
    if kind == "kuka":
        return _kuka(section, axes, joints), []
    read: list[Path] = []
    tip = Poses.identity()
    if kind == "urdf":
        given = section.section("urdf")
        given.only("file", "base", "tip")
        path = _beside(given)
        found = read_urdf(path, *(given.text(key) if key in given else None for key in ("base", "tip")))
        read, tip = [path], found.tip
        links: Sequence[Link] = found.links
        for axis, name, moves in zip(axes, found.names, found.kinds, strict=False):
            if axis.kind != moves:
                raise joints.error("YML004", f"is {axis.kind}, {name} of the URDF is {moves}", axis.name)
    else:
        rows = _table(section.section(kind))
        links = standard_dh(rows) if kind == "dh" else modified_dh(rows)
    _check_count(joints, axes, len(links))
    if len(axes) not in (6, 7):
        raise section.error("YML004", f"{len(axes)} joints; an arm has 6 or 7", kind)
    links = based(links, _frame(section, "base"))
    tip = tip @ _frame(section, "flange")
    return SerialArm(kind, axes, links, tip, _held(axes, joints)), read


def _kuka(section: Section, axes: tuple[Axis, ...], joints: Section) -> Geometry:
    lengths = _lengths(section.section("kuka"))
    rail = None
    if "rail" in section:
        ways = {f"{sign}{axis}": (sign, axis) for axis in "xyz" for sign in "+-"}
        sign, axis = ways[section.text("rail", choices=tuple(ways))]
        rail = frozen((1.0 if sign == "+" else -1.0) * np.eye(3)["xyz".index(axis)])
    _check_count(joints, axes, 6 if rail is None else 7)
    for i, joint in enumerate(axes):
        wanted = "prismatic" if rail is not None and i == 0 else "revolute"
        if joint.kind != wanted:
            raise joints.error("YML004", f"joint {i + 1} of this geometry is {wanted}", joint.name)
    if "external" in joints and (rail is None or joints.text("external") != axes[0].name):
        raise joints.error("YML004", "only the joint of the rail can be external here", "external")
    if rail is None and all(joint.sign == 1.0 and joint.offset == 0.0 for joint in axes):
        return lengths
    return KukaVariant(lengths, axes, rail)


def _lengths(section: Section) -> KukaLengths:
    names = ("d1", "a1", "a2", "a3", "d4", "d6")
    section.only(*names, "unit")
    factor = unit_factor(section, "m")
    lengths = KukaLengths(**{name: section.number(name) * factor for name in names})
    for name in ("a2", "d4"):
        if getattr(lengths, name) <= 0:
            raise section.error("YML004", "must be positive", name)
    return lengths


def _table(section: Section) -> list[Row]:
    """Rows {a, alpha, d[, theta]} with the units of the table."""
    section.only("unit", "angle_unit", "rows")
    metre, radian = unit_factor(section, "m"), unit_factor(section, "rad", "angle_unit")
    rows = []
    for row in section.sections("rows"):
        row.only("a", "alpha", "d", "theta")
        rows.append(
            Row(
                row.number("a") * metre,
                row.number("alpha") * radian,
                row.number("d") * metre,
                row.number("theta", 0.0) * radian,
            )
        )
    if not rows:
        raise section.error("YML003", "the table has no rows")
    return rows


def _frame(section: Section, key: str) -> Poses:
    """A frame x, y, z, a, b, c with its units; none where the key is absent."""
    if key not in section:
        return Poses.identity()
    given = section.section(key)
    given.only("unit", "angle_unit", *"xyzabc")
    metre, radian = unit_factor(given, "m"), unit_factor(given, "rad", "angle_unit")
    place = np.array([given.number(name, 0.0) * metre for name in "xyz"])
    a, b, c = (given.number(name, 0.0) * radian for name in "abc")
    return Poses(turn_about("z", a) @ turn_about("y", b) @ turn_about("x", c), place)


def _beside(section: Section) -> Path:
    """The URDF file: below the folder of the robot file, nowhere else."""
    name = section.text("file")
    folder = section.file.resolve().parent
    path = (folder / name).resolve()
    if Path(name).is_absolute() or not path.is_relative_to(folder):
        raise section.error("YML004", "must lie in the folder of the robot file, or below", "file")
    if not path.is_file():
        raise section.error("YML004", f"the file {path} does not exist", "file")
    return path


def _axes(section: Section) -> tuple[Axis, ...]:
    """The joints in the order of the chain: [lower, upper], or {limits, kind, unit, sign, offset}."""
    section.text("source")
    factor = unit_factor(section, "rad")
    axes = []
    for name in section:
        if name in ("source", "unit", "external"):
            continue
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
            raise section.error("YML002", "is no name of a joint: a letter, then letters, digits, _", name)
        axes.append(_axis(section, name, factor))
    _check_order(section, [axis.name for axis in axes])
    return tuple(axes)


def _axis(section: Section, name: str, factor: float) -> Axis:
    if section.is_list(name):
        given, key, kind, sign, offset = section, name, "revolute", 1.0, 0.0
    else:
        given, key = section.section(name), "limits"
        given.only("limits", "kind", "unit", "sign", "offset")
        kind = given.text("kind", "revolute", ("revolute", "prismatic"))
        if kind == "prismatic" or "unit" in given:
            factor = unit_factor(given, "m" if kind == "prismatic" else "rad")
        sign = given.number("sign", 1.0)
        if sign not in (1.0, -1.0):
            raise given.error("YML004", "must be 1 or -1", "sign")
        offset = given.number("offset", 0.0) * factor
    lower, upper = given.numbers(key, 2)
    if not lower < upper:
        raise given.error("YML004", "the lower limit must be below the upper one", key)
    largest = max(abs(lower), abs(upper)) * factor
    at = "unit" if "unit" in given else key
    if kind == "revolute" and max(largest, abs(offset)) > MAX_TURN:
        raise given.error("YML004", "axis limits or offset of more than 1000 deg; is it the right unit?", at)
    if kind == "prismatic" and max(largest, abs(offset)) > MAX_WAY:
        raise given.error("YML004", "axis limits or offset of more than 200 m; is it the right unit?", at)
    return Axis(name, lower * factor, upper * factor, kind, sign, offset)


def _check_order(section: Section, names: list[str]) -> None:
    """Names that end in a number count up from 1 in the order of the chain: a gap or a swap is a slip."""
    last: dict[str, int] = {}
    for name in names:
        match = re.fullmatch(r"(.*?)([0-9]+)", name)
        if match is None:
            continue
        word, number = match[1], int(match[2])
        wanted = last.get(word, 0) + 1
        if number != wanted:
            raise section.error("YML002", f"unknown joint; did you mean '{word}{wanted}'?", name)
        last[word] = number


def _check_count(section: Section, axes: tuple[Axis, ...], count: int) -> None:
    if len(axes) < count:
        raise section.error("YML003", f"{count - len(axes)} of the geometry's {count} joints missing")
    if len(axes) > count:
        raise section.error(
            "YML004", f"the geometry has {count} joints, {len(axes)} are given", axes[count].name
        )


def _held(axes: tuple[Axis, ...], section: Section) -> int | None:
    """Column of the joint of seven that the other six leave where it is."""
    names = [axis.name for axis in axes]
    if len(axes) == 6:
        if "external" in section:
            raise section.error("YML004", "of six joints none can be external", "external")
        return None
    if "external" in section:
        return names.index(section.text("external", choices=names))
    linear = [i for i, axis in enumerate(axes) if axis.kind == "prismatic"]
    if len(linear) != 1:
        raise section.error(
            "YML003",
            "the key 'external' is missing",
            help="of seven joints, name the one that keeps its value while the other six place the flange",
        )
    return linear[0]


def _masses(section: Section, names: list[str], arm: Geometry) -> tuple[Mass, ...]:
    """{mass, com} of links, by the joint that moves them; com in the link's own frame of the geometry."""
    section.only("source", "unit", "com_unit", *names)
    kilogram, metre = unit_factor(section, "kg"), unit_factor(section, "m", "com_unit")
    masses = []
    for name, frame in zip(names, arm.link_frames(), strict=True):
        if name not in section:
            continue
        given = section.section(name)
        given.only("mass", "com")
        place = np.array(given.numbers("com", 3)) * metre
        com = frame.rotation @ place + frame.position
        masses.append(Mass(name, given.number("mass", low=0.0) * kilogram, frozen(com)))
    return tuple(masses)


def _mechanisms(top: Section, names: list[str]) -> tuple[Mechanism, ...]:
    """{name, kind, source[, joint, about]} and numbers, each {value, unit[, source]}; several of a name are refused."""
    found: dict[str, Mechanism] = {}
    for section in top.sections("mechanisms"):
        name = section.text("name")
        if name in found:
            raise section.error("YML004", f"{name!r} stands in line {found[name].line} already", "name")
        quantities = {
            key: _quantity(section.section(key))
            for key in section
            if key not in ("name", "kind", "joint", "about", "source")
        }
        found[name] = Mechanism(
            name,
            section.text("kind"),
            section.text("joint", choices=names) if "joint" in section else None,
            section.text("about", ""),
            section.text("source"),
            quantities,
            section.line,
        )
    return tuple(found.values())


def _quantity(section: Section) -> Quantity:
    section.only("value", "unit", "source")
    word = section.text("unit")
    unit = UNITS.get(" ".join(word.split()))
    if unit is None:
        raise section.error("YML005", f"{word!r} is no unit{nearest(word, UNITS)}", "unit", ", ".join(UNITS))
    values = section.numbers("value", 3) if section.is_list("value") else [section.number("value")]
    return Quantity(frozen(np.array(values) * unit[1]), unit[0], section.text("source", ""))


def unit_factor(section: Section, si_unit: str, key: str = "unit") -> float:
    """The factor to SI of the section's unit.  Raises Refusal YML005 for a unit of another quantity."""
    word = section.text(key)
    factor = to_si(word, si_unit)
    if factor is None:
        allowed = words_for(si_unit)
        raise section.error(
            "YML005",
            f"{word!r} is no unit of this quantity{nearest(word, allowed)}",
            key,
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
