"""The geometry and the joints of a robot file, checked and in SI."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from postproc.base.arrays import frozen
from postproc.base.findings import nearest
from postproc.base.geometry import Poses
from postproc.base.units import DEG, to_si, words_for
from postproc.base.yaml_section import YamlSection
from postproc.robot.geometries import (
    Axis,
    DhRow,
    Follower,
    Geometry,
    KukaLengths,
    KukaVariant,
    Link,
    SerialArm,
    based,
    modified_dh,
    standard_dh,
    turn_about,
)

KINDS = ("kuka", "dh", "mdh", "urdf")
MAX_TURN = 1000 * DEG
MAX_TRAVEL = 200.0
"""[m] Limits beyond these were written in another unit."""


def geometry_kind(section: YamlSection) -> str:
    section.only(*KINDS, "rail", "base", "flange", "source")
    kinds = [kind for kind in KINDS if kind in section]
    if len(kinds) > 1:
        raise section.error("YML004", f"excludes {kinds[0]}; state only one geometry", kinds[1])
    if not kinds:
        raise section.error("YML003", "a geometry is missing", help="state one of: " + ", ".join(KINDS))
    section.text("source")
    for key, only in (("rail", ("kuka",)), ("base", KINDS[1:]), ("flange", KINDS[1:])):
        if key in section and kinds[0] not in only:
            raise section.error("YML004", f"has no meaning for a {kinds[0]} geometry", key)
    return kinds[0]


def read_geometry(
    section: YamlSection, kind: str, listed: tuple[Axis | Follower, ...], joints: YamlSection
) -> tuple[Geometry, list[Path]]:
    """The geometry of a section with the joints that are ``listed``, and the files it was read from beside this one."""
    axes = driven(listed)
    followers = {k: one for k, one in enumerate(listed) if isinstance(one, Follower)}
    if followers and kind in ("kuka", "urdf"):
        why = "the URDF states it with <mimic>" if kind == "urdf" else "a kuka geometry has none"
        name = next(iter(followers.values())).name
        raise joints.error("YML004", f"a joint that follows others has no meaning here: {why}", name)
    if kind == "kuka":
        return _kuka(section, axes, joints), []
    read: list[Path] = []
    tip = Poses.identity()
    if kind == "urdf":
        from postproc.robot.urdf import read_urdf  # XML: only where there is a URDF

        given = section.section("urdf")
        given.only("file", "base", "tip")
        path = beside(given)
        arm = read_urdf(path, *(given.text(key) if key in given else None for key in ("base", "tip")))
        read, tip = [path], arm.tip
        links: Sequence[Link] = arm.links
        moving = [k for k in range(len(arm.names)) if k not in arm.mimics]
        _check_count(joints, axes, len(moving))
        for axis, k in zip(axes, moving, strict=True):
            if axis.kind != arm.kinds[k]:
                message = f"is {axis.kind}, {arm.names[k]} of the URDF is {arm.kinds[k]}"
                raise joints.error("YML004", message, axis.name)
        named = dict(zip((arm.names[k] for k in moving), axes, strict=True))
        for k, mimic in arm.mimics.items():
            leader = named[mimic.joint]
            ratio, offset = mimic.multiplier * leader.sign, mimic.multiplier * leader.offset + mimic.offset
            followers[k] = Follower(arm.names[k], ((leader.name, ratio),), offset, arm.kinds[k])
    else:
        rows = _table(section.section(kind))
        links = standard_dh(rows) if kind == "dh" else modified_dh(rows)
    _check_count(joints, axes, len(links) - len(followers))
    if len(links) - 1 in followers:
        name = followers[len(links) - 1].name
        raise joints.error(
            "YML004", f"{name} follows other joints and is the last one; the flange is its link"
        )
    links = based(links, _frame(section, "base"))
    tip = tip @ _frame(section, "flange")
    return SerialArm(kind, axes, links, tip, _fixed_joint(axes, joints), followers), read


def _kuka(section: YamlSection, axes: tuple[Axis, ...], joints: YamlSection) -> Geometry:
    lengths = _lengths(section.section("kuka"))
    rail = None
    if "rail" in section:
        directions = {f"{sign}{axis}": (sign, axis) for axis in "xyz" for sign in "+-"}
        sign, axis = directions[section.text("rail", choices=tuple(directions))]
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


def _lengths(section: YamlSection) -> KukaLengths:
    names = ("d1", "a1", "a2", "a3", "d4", "d6")
    section.only(*names, "unit")
    factor = unit_factor(section, "m")
    lengths = KukaLengths(**{name: section.number(name) * factor for name in names})
    for name in ("a2", "d4"):
        if getattr(lengths, name) <= 0:
            raise section.error("YML004", "must be positive", name)
    return lengths


def _table(section: YamlSection) -> list[DhRow]:
    """Rows {a, alpha, d[, theta]} with the units of the table."""
    section.only("unit", "angle_unit", "rows")
    metre, radian = unit_factor(section, "m"), unit_factor(section, "rad", "angle_unit")
    rows = []
    for row in section.sections("rows"):
        row.only("a", "alpha", "d", "theta")
        rows.append(
            DhRow(
                row.number("a") * metre,
                row.number("alpha") * radian,
                row.number("d") * metre,
                row.number("theta", 0.0) * radian,
            )
        )
    if not rows:
        raise section.error("YML003", "the table has no rows")
    return rows


def _frame(section: YamlSection, key: str) -> Poses:
    """A frame x, y, z, a, b, c with its units; none where the key is absent."""
    if key not in section:
        return Poses.identity()
    given = section.section(key)
    given.only("unit", "angle_unit", *"xyzabc")
    metre, radian = unit_factor(given, "m"), unit_factor(given, "rad", "angle_unit")
    place = np.array([given.number(name, 0.0) * metre for name in "xyz"])
    a, b, c = (given.number(name, 0.0) * radian for name in "abc")
    return Poses(turn_about("z", a) @ turn_about("y", b) @ turn_about("x", c), place)


def beside(section: YamlSection) -> Path:
    """The file of a ``urdf:`` section: below the folder of the robot file, nowhere else."""
    name = section.text("file")
    folder = section.file.resolve().parent
    path = (folder / name).resolve()
    if Path(name).is_absolute() or not path.is_relative_to(folder):
        raise section.error("YML004", "must be in the folder of the robot file, or below", "file")
    if not os.path.isfile(path):
        raise section.error("YML004", f"the file {path} does not exist", "file")
    return path


def driven(listed: Sequence[Axis | Follower]) -> tuple[Axis, ...]:
    """The joints that have a motor."""
    return tuple(one for one in listed if isinstance(one, Axis))


def read_joints(section: YamlSection) -> tuple[Axis | Follower, ...]:
    """The joints in the order of the chain: [lower, upper], or {limits, kind, unit, sign, offset, speed}; of one
    without a motor {follows, kind, unit, offset}."""
    section.text("source")
    factor = unit_factor(section, "rad")
    listed: list[Axis | Follower] = []
    for name in section:
        if name in ("source", "unit", "external"):
            continue
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name):
            raise section.error(
                "YML002", "is not a name of a joint; write a letter, then letters, digits, _", name
            )
        follows = not section.is_list(name) and "follows" in section.section(name)
        before = [axis.name for axis in driven(listed)]
        listed.append(_follower(section, name, factor) if follows else _axis(section, name, factor, before))
    _check_order(section, [one.name for one in listed])
    names = [axis.name for axis in driven(listed)]
    for one in listed:
        for leader, _ in one.follows if isinstance(one, Follower) else ():
            if leader not in names:
                what = nearest(leader, names) or ": it must have a motor"
                raise section.section(one.name).error("YML004", f"{leader!r} is no joint{what}", "follows")
    return tuple(listed)


def _follower(section: YamlSection, name: str, factor: float) -> Follower:
    """Ratios are rad per rad, m per m, and m per rad or rad per m where the two are of different kinds."""
    given = section.section(name)
    given.only("follows", "kind", "unit", "offset")
    kind = given.text("kind", "revolute", ("revolute", "prismatic"))
    if kind == "prismatic" or "unit" in given:
        factor = unit_factor(given, "m" if kind == "prismatic" else "rad")
    ratios = given.section("follows")
    follows = tuple((leader, ratios.number(leader)) for leader in ratios)
    if not follows:
        raise given.error("YML003", "names no joint; write follows: {A2: -1}", "follows")
    return Follower(name, follows, given.number("offset", 0.0) * factor, kind)


def _axis(section: YamlSection, name: str, factor: float, before: list[str]) -> Axis:
    if section.is_list(name):
        given, key, kind, sign, offset = section, name, "revolute", 1.0, 0.0
        speed, interaction = None, None
    else:
        given, key = section.section(name), "limits"
        given.only("limits", "kind", "unit", "sign", "offset", "speed", "interaction")
        interaction = (
            before.index(given.text("interaction", choices=before)) if "interaction" in given else None
        )
        kind = given.text("kind", "revolute", ("revolute", "prismatic"))
        if kind == "prismatic" or "unit" in given:
            factor = unit_factor(given, "m" if kind == "prismatic" else "rad")
        sign = given.number("sign", 1.0)
        if sign not in (1.0, -1.0):
            raise given.error("YML004", "must be 1 or -1", "sign")
        offset = given.number("offset", 0.0) * factor
        speed = given.number("speed") * factor if "speed" in given else None
        if speed is not None and speed <= 0:
            raise given.error("YML004", "must be above 0", "speed")
    lower, upper = given.numbers(key, 2)
    if not lower < upper:
        raise given.error("YML004", "the lower limit must be below the upper one", key)
    largest = max(abs(lower), abs(upper)) * factor
    at = "unit" if "unit" in given else key
    if kind == "revolute" and max(largest, abs(offset)) > MAX_TURN:
        raise given.error("YML004", "an axis limit or offset exceeds 1000 deg; is it the right unit?", at)
    if kind == "prismatic" and max(largest, abs(offset)) > MAX_TRAVEL:
        raise given.error("YML004", "an axis limit or offset exceeds 200 m; is it the right unit?", at)
    if interaction is not None and kind != "revolute":
        raise given.error("YML004", "only revolute joints have an interaction", "interaction")
    return Axis(name, lower * factor, upper * factor, kind, sign, offset, speed, interaction)


def _check_order(section: YamlSection, names: list[str]) -> None:
    """Names that end in a number count up from 1 in the order of the chain: a gap or a swap is a slip."""
    last: dict[str, int] = {}
    for name in names:
        word = name.rstrip("0123456789")
        number = name[len(word) :]
        if not number:
            continue
        wanted = last.get(word, 0) + 1
        if number.lstrip("0") != str(wanted):
            raise section.error("YML002", f"the joint is unknown; did you mean '{word}{wanted}'?", name)
        last[word] = wanted


def _check_count(section: YamlSection, axes: tuple[Axis, ...], count: int) -> None:
    if len(axes) < count:
        raise section.error("YML003", f"{count - len(axes)} of the geometry's {count} joints are missing")
    if len(axes) > count:
        raise section.error(
            "YML004", f"the geometry has {count} joints, {len(axes)} are given", axes[count].name
        )


def _fixed_joint(axes: tuple[Axis, ...], section: YamlSection) -> int | None:
    """Column of the joint of seven that the other six do not move."""
    names = [axis.name for axis in axes]
    if len(axes) != 7:
        if "external" in section:
            words = f"an arm of {len(axes)} joints has no external one"
            raise section.error("YML004", words, "external")
        return None
    if "external" in section:
        return names.index(section.text("external", choices=names))
    linear = [i for i, axis in enumerate(axes) if axis.kind == "prismatic"]
    if len(linear) != 1:
        raise section.error(
            "YML003",
            "the key 'external' is missing",
            help="name the one of the seven joints that keeps its value while the other six move the flange",
        )
    return linear[0]


def unit_factor(section: YamlSection, si_unit: str, key: str = "unit") -> float:
    """The factor to SI of the section's unit.  Raises Refusal YML005 for a unit of another quantity."""
    word = section.text(key)
    factor = to_si(word, si_unit)
    if factor is None:
        allowed = words_for(si_unit)
        raise section.error(
            "YML005",
            f"{word!r} is not a unit of this quantity{nearest(word, allowed)}",
            key,
            "these are allowed here: " + ", ".join(allowed),
        )
    return factor
