"""Robot files: ``robots/<name>.yaml`` read, checked, in SI."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import NormalDist

import numpy as np

from postproc.base.arrays import Floats, Ints, frozen
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.geometry import Poses
from postproc.base.read_files import read_file
from postproc.base.units import UNITS
from postproc.base.yaml_section import YamlSection, parsed, read
from postproc.robot.chain import Chain
from postproc.robot.geometries import Axis, Geometry, Joint, KukaVariant, SerialArm
from postproc.robot.provenance import Identification, correlations, read_identification
from postproc.robot.read_geometry import driven, geometry_kind, read_geometry, read_joints, unit_factor

COVERAGE = 1.96
"""Half width of a 95 % interval over the standard deviation (normal distribution)."""


@dataclass(frozen=True)
class Value:
    """A parameter as the file states it, in SI.  ``interval``: half width, of ``level`` (None: unstated)."""

    value: float
    interval: float | None
    level: float | None
    source: str

    @property
    def deviation(self) -> float | None:
        """Standard deviation, of a normal distribution; a level that is not stated is taken for 95 %."""
        if self.interval is None:
            return None
        if self.level in (None, 0.95):
            return self.interval / COVERAGE
        return self.interval / NormalDist().inv_cdf(0.5 * (1.0 + float(self.level or 0.0)))


@dataclass(frozen=True)
class EffectEntry:
    """One entry of ``effects:``; what it may hold is the business of the effect itself."""

    name: str
    section: YamlSection


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
    program does not place the flange with; it is where the program has the external axis of its name (E1..E6), and
    without one it stays where it was.  ``identified``: runs of the tool that gave it new
    values, in order.  ``raw``: the bytes of the file.  ``rated_payload`` [kg]: the heaviest that it may carry, None
    where the file does not state it.
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
    rated_payload: float | None = None
    mechanisms: tuple[Mechanism, ...] = ()
    identified: tuple[Identification, ...] = ()
    raw: bytes = field(default=b"", repr=False)

    @property
    def limits(self) -> Floats:
        """(n, 2) [rad, m]"""
        return np.array([(joint.lower, joint.upper) for joint in self.joints])

    @property
    def speeds(self) -> Floats:
        """(n,) [rad/s, m/s] the fastest that each joint moves, NaN where the file does not state it."""
        stated = [np.nan if axis.speed is None else axis.speed for axis in self.axes]
        return np.array(stated or [np.nan] * len(self.joints))

    def joint_values(self, programmed: Floats) -> Floats:
        """(N, n) [rad, m] values between the links, from those (N, n) that programs and the pendant show."""
        values = programmed
        for column, axis in enumerate(self.axes):
            if axis.interaction is not None:
                values = values.copy() if values is programmed else values
                values[:, column] = programmed[:, column] + values[:, axis.interaction]
        return values

    @cached_property
    def nominal_chain(self) -> Chain:
        """The joints and the flange that the controller believes in."""
        limits = [(joint.lower, joint.upper) for joint in self.joints]
        joints = self.nominal.joints([joint.name for joint in self.joints], limits)
        return Chain(joints, self.nominal.flange())

    @property
    def is_programmable(self) -> bool:
        """Whether a program's six axis values, or one pose, say where its joints are."""
        return len(self.programmed) == 6

    @property
    def programmed(self) -> Ints:
        """(6,) columns of the joints that a program's six axis values are: all but the external one."""
        return np.array([i for i in range(len(self.joints)) if i != self.external])

    @property
    def correlation(self) -> tuple[tuple[str, ...], Floats]:
        """Names (k,) of parameters that were fitted, as effect.parameter, and their correlation (k, k)."""
        return correlations(self.identified)


def folders() -> list[Path]:
    """Where robot files lie: in the installed package, or beside it in a source tree."""
    package = Path(__file__).resolve().parent.parent
    return [folder for folder in (package / "_robots", package.parent / "robots") if folder.is_dir()]


def robot_files() -> dict[str, Path]:
    """name -> file of every robot that comes with the tool."""
    return {path.stem: path for folder in reversed(folders()) for path in sorted(folder.glob("*.yaml"))}


def robot_words(name: str, path: Path) -> str:
    """A robot as a report names it: with its file, unless that came with the tool."""
    return name if path.parent in folders() else f"{name} ({path})"


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
                help="the known robots are "
                + ", ".join(sorted(known))
                + "; or state the path of a robot file (.yaml)",
            )
        )
    path = Path(name)
    if beside is not None and not path.is_absolute():
        path = beside / path
    if not os.path.isfile(path):
        raise Refusal(Finding("CEL003", f"robot file {path} does not exist"))
    return path


def load_robot(path: Path) -> Robot:
    """Read and check a robot file.  Raises Refusal with file, line and key."""
    return robot_of(read(path), path)


def check_programmable(robot: Robot) -> None:
    """Raises Refusal KIN012 for an arm that six axis values do not place."""
    if not robot.is_programmable:
        message = (
            f"{robot.name} has {len(robot.joints)} joints with a motor; programs and maps need six,"
            " or seven with an external one"
        )
        raise Refusal(Finding("KIN012", message, str(robot.path)))


def robot_of(raw: bytes, path: Path) -> Robot:
    """The robot of a file ``path`` that holds ``raw``; the file itself need not be there.  Raises Refusal with file,
    line and key."""
    top = parsed(raw, path)
    top.only(
        "name",
        "maker_name",
        "about",
        "geometry",
        "controller",
        "joints",
        "rated_payload",
        "masses",
        "effects",
        "mechanisms",
        "identified",
    )
    geometry = top.section("geometry")
    kind = geometry_kind(geometry)
    listed = read_joints(top.section("joints"))
    axes = driven(listed)
    arm, others = read_geometry(geometry, kind, listed, top.section("joints"))
    nominal = arm
    if "controller" in top:
        controller = top.section("controller")
        believed = geometry_kind(controller)
        if believed != kind:
            raise controller.error(
                "YML004", f"the controller's geometry must be of the same kind, {kind}", believed
            )
        nominal, more = read_geometry(controller, kind, listed, top.section("joints"))
        others += more
    names = [axis.name for axis in axes]
    limits = [(axis.lower, axis.upper) for axis in axes]
    digest = hashlib.sha256(raw)
    for other in others:
        digest.update(read_file(other))
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
        rated_payload=_rated_payload(top),
        masses=_masses(top.section("masses"), names, arm) if "masses" in top else (),
        masses_source=top.section("masses").text("source") if "masses" in top else "",
        mechanisms=_mechanisms(top, names),
        identified=tuple(read_identification(section) for section in top.sections("identified")),
        raw=raw,
    )


def _rated_payload(top: YamlSection) -> float | None:
    if "rated_payload" not in top:
        return None
    section = top.section("rated_payload")
    section.only("value", "unit", "source")
    section.text("source")
    value = section.number("value") * unit_factor(section, "kg")
    if value <= 0:
        raise section.error("YML004", "must be above 0", "value")
    return value


def _external(arm: Geometry) -> int | None:
    if isinstance(arm, SerialArm):
        return arm.fixed
    return 0 if isinstance(arm, KukaVariant) and arm.rail is not None else None


def _masses(section: YamlSection, names: list[str], arm: Geometry) -> tuple[Mass, ...]:
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


def _mechanisms(top: YamlSection, names: list[str]) -> tuple[Mechanism, ...]:
    """{name, kind, source[, joint, about]} and numbers, each {value, unit[, source]}; several of a name are refused."""
    mechanisms: dict[str, Mechanism] = {}
    for section in top.sections("mechanisms"):
        name = section.text("name")
        if name in mechanisms:
            raise section.error("YML004", f"{name!r} occurs in line {mechanisms[name].line} already", "name")
        quantities = {
            key: _quantity(section.section(key))
            for key in section
            if key not in ("name", "kind", "joint", "about", "source")
        }
        mechanisms[name] = Mechanism(
            name,
            section.text("kind"),
            section.text("joint", choices=names) if "joint" in section else None,
            section.text("about", ""),
            section.text("source"),
            quantities,
            section.line,
        )
    return tuple(mechanisms.values())


def _quantity(section: YamlSection) -> Quantity:
    section.only("value", "unit", "source")
    word = section.text("unit")
    unit = UNITS.get(" ".join(word.split()))
    if unit is None:
        raise section.error(
            "YML005", f"{word!r} is not a unit{nearest(word, UNITS)}", "unit", ", ".join(UNITS)
        )
    values = section.numbers("value", 3) if section.is_list("value") else [section.number("value")]
    return Quantity(frozen(np.array(values) * unit[1]), unit[0], section.text("source", ""))


def parameter_value(section: YamlSection, si_unit: str) -> Value:
    """One parameter: {value, unit, ci95 | ci with ci_level: unstated, source}.  An interval is a half width."""
    section.only("value", "unit", "ci95", "ci", "ci_level", "source")
    factor = unit_factor(section, si_unit)
    interval, level = None, None
    if "ci95" in section and ("ci" in section or "ci_level" in section):
        help = "keep ci95: for the half width of a 95 % interval, or ci: with ci_level: unstated"
        raise section.error("YML004", "the interval is stated twice", "ci95", help)
    if "ci95" in section:
        interval, level = section.number("ci95", low=0.0) * factor, 0.95
    elif "ci" in section:
        help = "write ci95: for the half width of a 95 % interval, or ci: with ci_level: unstated"
        if "ci_level" not in section:
            raise section.error("YML003", "the key 'ci_level' is missing", help=help)
        level_word = section.text("ci_level")
        if level_word != "unstated":
            raise section.error("YML004", f"the level of ci is {level_word[:20]!r}", "ci_level", help)
        interval = section.number("ci", low=0.0) * factor
    return Value(section.number("value") * factor, interval, level, section.text("source"))
