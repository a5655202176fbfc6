"""A strict, small reader of URDF: the joints between two links, with fixed ones merged.

Only what kinematics needs is read (links, joints, origins, axes); masses and limits are passed over, and no mesh is
opened.  A mesh that is named by a path must all the same lie where the path leads, inside of the URDF's folder: a file
that was torn from its place is hardly the one that was meant.  ``package://`` names, which only a ROS installation can
resolve, are passed over.  Lengths are metres and angles radians, as the format states.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

import numpy as np

from postproc.base.arrays import Floats
from postproc.base.findings import Finding, Refusal, nearest
from postproc.base.geometry import Poses, rotation_from_abc
from postproc.base.read_files import read_file
from postproc.robot.geometries import Link, frame_with_z

MAX_BYTES = 4_000_000
MOST_JOINTS = 1000
LONGEST_NAME = 1000
"""Characters of the name of a mesh: the system walks over all folders in it."""
MOVING = {"revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic"}


@dataclass(frozen=True)
class Mimic:
    """A joint without a motor: multiplier * value of ``joint`` + offset [rad, m]."""

    joint: str
    multiplier: float
    offset: float


@dataclass
class _UrdfJoint:
    name: str
    kind: str
    line: int
    parent: str = ""
    child: str = ""
    origin: Poses | None = None
    axis: Floats | None = None
    mimic: Mimic | None = None


@dataclass(frozen=True)
class Arm:
    """The moving joints from base to tip: ``names``, ``kinds`` and ``links``, and the ``tip`` in the last link;
    ``mimics``: of those without a motor, by their place."""

    names: tuple[str, ...]
    kinds: tuple[str, ...]
    links: tuple[Link, ...]
    tip: Poses
    mimics: dict[int, Mimic]


def read_urdf(path: Path, base: str | None = None, tip: str | None = None) -> Arm:
    """The arm from link ``base`` (the only root without it) to link ``tip`` (the only end without it).

    Raises Refusal: FIL001 (not readable), URD001 (with the line).
    """
    joints, links = _parse(path)
    by_child: dict[str, _UrdfJoint] = {}
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in links:
                raise _wrong(
                    path,
                    joint.line,
                    f"joint {joint.name}: the link {link!r} is not defined{nearest(link, links)}",
                )
        if joint.child in by_child:
            raise _wrong(path, joint.line, f"link {joint.child!r} has two parent joints")
        by_child[joint.child] = joint
    for name in (base, tip):
        if name is not None and name not in links:
            raise _wrong(path, 0, f"the link {name!r} is not defined{nearest(name, links)}")
    parents = {joint.parent for joint in joints}
    end = tip or _only(path, [link for link in links if link not in parents], "tip")
    chain, at = [], end
    while at in by_child and at != base:
        joint = by_child[at]
        chain.append(joint)
        at = joint.parent
        if len(chain) > len(joints):
            raise _wrong(path, joint.line, "the joints form a circle")
    if len(chain) > MOST_JOINTS:
        raise _wrong(path, 0, f"there are more than {MOST_JOINTS} joints between base and tip")
    if base is None:
        _only(path, [link for link in links if link not in by_child], "base")
    elif at != base:
        raise _wrong(path, 0, f"the link {end!r} is not connected to {base!r}")
    return _merged(path, chain[::-1])


def _only(path: Path, links: list[str], key: str) -> str:
    if not links:
        raise _wrong(path, 0, "the joints form a circle")
    if len(links) > 1:
        words = (
            "the joints branch: the URDF has several ends" if key == "tip" else "the URDF has several roots"
        )
        raise _wrong(path, 0, f"{words}, {', '.join(links)}", f"name one with `{key}:`")
    return links[0]


def _merged(path: Path, chain: list[_UrdfJoint]) -> Arm:
    names: list[str] = []
    kinds, links, mimics = [], [], {}
    leaders = {joint.name for joint in chain if joint.kind != "fixed" and joint.mimic is None}
    at = Poses.identity()
    for joint in chain:
        at = at @ (joint.origin or Poses.identity())
        if joint.kind == "fixed":
            continue
        if joint.kind not in MOVING:
            raise _wrong(
                path,
                joint.line,
                f"joint {joint.name}: the type {joint.kind!r} is not supported{nearest(joint.kind, MOVING)}",
                f"use one of: {', '.join(('fixed', *MOVING))}",
            )
        axis = np.array([1.0, 0.0, 0.0]) if joint.axis is None else joint.axis
        frame = Poses(frame_with_z(axis), np.zeros(3))
        if joint.mimic is not None:
            if joint.mimic.joint not in leaders:
                words = f"{joint.mimic.joint!r}, which is no driven joint between base and tip"
                raise _wrong(path, joint.line, f"joint {joint.name} mimics {words}")
            mimics[len(names)] = joint.mimic
        names.append(joint.name)
        kinds.append(MOVING[joint.kind])
        links.append(Link(at @ frame, frame.inverse()))
        at = Poses.identity()
    if not links:
        raise _wrong(path, 0, "no joint between base and tip is movable")
    return Arm(tuple(names), tuple(kinds), tuple(links), at, mimics)


def _parse(path: Path) -> tuple[list[_UrdfJoint], dict[str, int]]:
    """All joints, and the lines of all links."""
    raw = read_file(path, MAX_BYTES)
    if len(raw) > MAX_BYTES:
        raise _wrong(path, 0, f"the file is larger than {MAX_BYTES} bytes")
    joints: list[_UrdfJoint] = []
    links: dict[str, int] = {}
    names: set[str] = set()
    stack: list[str] = []
    parser = expat.ParserCreate()

    def start_element(tag: str, words: dict[str, str]) -> None:
        line = parser.CurrentLineNumber
        if not stack and tag != "robot":
            raise _wrong(path, line, f"<{tag}> is found where <robot> is expected")
        if tag.startswith("xacro:"):
            raise _wrong(path, line, "expand xacro first (ros2 run xacro xacro)")
        if stack == ["robot"] and tag == "link":
            name = _word(path, line, tag, words, "name")
            if name in links:
                raise _wrong(path, line, f"link {name!r} is defined twice")
            links[name] = line
        elif stack == ["robot"] and tag == "joint":
            joints.append(_joint(path, line, words, names))
        elif stack == ["robot", "joint"]:
            _detail(path, line, joints[-1], tag, words)
        elif tag == "mesh":
            _mesh(path, line, _word(path, line, tag, words, "filename"))
        stack.append(tag)

    def end_element(tag: str) -> None:
        stack.pop()
        if stack == ["robot"] and tag == "joint":
            joint = joints[-1]
            for key in ("parent", "child"):
                if not getattr(joint, key):
                    raise _wrong(path, joint.line, f"joint {joint.name} has no <{key}>")

    def doctype(*_: object) -> None:
        raise _wrong(path, parser.CurrentLineNumber, "a DOCTYPE is not allowed")

    parser.StartElementHandler, parser.EndElementHandler = start_element, end_element
    parser.StartDoctypeDeclHandler = doctype
    try:
        parser.Parse(raw, True)
    except expat.ExpatError as error:
        raise _wrong(
            path, error.lineno, f"the file is not XML: {expat.errors.messages[error.code]}"
        ) from None
    except (ValueError, LookupError):  # what expat asks Python for: UTF-7, an encoding that nobody knows
        raise _wrong(
            path, 1, "the file states an encoding that is not supported", "save it as UTF-8"
        ) from None
    return joints, links


def _joint(path: Path, line: int, words: dict[str, str], names: set[str]) -> _UrdfJoint:
    name, kind = _word(path, line, "joint", words, "name"), _word(path, line, "joint", words, "type")
    if name in names:
        raise _wrong(path, line, f"joint {name!r} is defined twice")
    names.add(name)
    return _UrdfJoint(name, kind, line)


def _detail(path: Path, line: int, joint: _UrdfJoint, tag: str, words: dict[str, str]) -> None:
    if tag == "mimic":
        factor = _number(path, line, words.get("multiplier", "1"))
        offset = _number(path, line, words.get("offset", "0"))
        joint.mimic = Mimic(_word(path, line, tag, words, "joint"), factor, offset)
    if tag in ("parent", "child"):
        setattr(joint, tag, _word(path, line, tag, words, "link"))
    elif tag == "origin":
        place, turn = (_three(path, line, words.get(key, "0 0 0")) for key in ("xyz", "rpy"))
        joint.origin = Poses(_snapped(rotation_from_abc(turn[::-1])), place)
    elif tag == "axis":
        axis = _three(path, line, _word(path, line, tag, words, "xyz"))
        length = float(np.linalg.norm(axis))
        if length >= 1e-6:
            joint.axis = axis / length
        elif joint.kind in MOVING:  # a fixed joint has none
            raise _wrong(path, line, f"joint {joint.name}: its axis has no direction")


def _mesh(path: Path, line: int, name: str) -> None:
    """Refuse a mesh that is not there, or not inside of the URDF's folder."""
    if "://" in name and not name.startswith("file://"):
        return
    mesh = path.parent / name.removeprefix("file://")
    missing = _wrong(
        path, line, f"mesh {name!r} does not exist", "add the file, or remove the mesh: it is not used"
    )
    if len(name) > LONGEST_NAME:
        raise missing
    if not mesh.resolve().is_relative_to(path.parent.resolve()):
        raise _wrong(path, line, f"mesh {name!r} is outside the URDF's folder")
    try:
        exists = os.path.isfile(mesh)
    except OSError:
        exists = False
    if not exists:
        raise missing


def _snapped(rotation: Floats) -> Floats:
    """Quarter turns written with nine digits or more are meant: they consist of zeros and ones."""
    near = np.round(rotation)
    return near if np.abs(rotation - near).max() < 1e-9 else rotation


def _word(path: Path, line: int, tag: str, words: dict[str, str], key: str) -> str:
    if not words.get(key):
        raise _wrong(path, line, f"<{tag}> has no {key!r}")
    return words[key]


def _number(path: Path, line: int, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _wrong(path, line, f"{text[:60]!r} is not a number")
    return value


def _three(path: Path, line: int, text: str) -> Floats:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != 3 or not all(math.isfinite(value) for value in values):
        raise _wrong(path, line, f"{text[:60]!r} is not three numbers")
    return np.array(values)


def _wrong(path: Path, line: int, message: str, help: str = "") -> Refusal:
    return Refusal(Finding("URD001", message, str(path), line, help=help))
