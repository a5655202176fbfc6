"""Measurements: the CSV of readings, checked.

Comments that state something, a header row, then one row a reading, in the order of time::

    # robot: kuka_kr270
    # tool: 0 0 300
    # target M1: 60 0 345
    A1,A2,A3,A4,A5,A6,FX,FY,FZ,DX,DY,DZ,TARGET
    0,-90,90,0,45,0,0,0,-2500,0.1021,0.0033,-1.2040,M1

The file is in mm, deg, N, N m, s and degC.  ``read_measurements`` reads it, ``measurements_csv`` writes it.
"""

from __future__ import annotations

import csv
import difflib
import io
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from postproc.arrays import Bools, Floats, Ints, frozen
from postproc.findings import Finding, Refusal, nearest
from postproc.geometry import Poses, abc_from_rotation, rotation_from_abc
from postproc.tables import Table, comments_above, finite_number, is_missing, read_table
from postproc.units import DEG, MM

WRENCH = ("FX", "FY", "FZ", "MX", "MY", "MZ")
PLACE, ANGLES = ("X", "Y", "Z"), ("A", "B", "C")
SHIFT, TURN = ("DX", "DY", "DZ"), ("DA", "DB", "DC")
OPTIONAL = ("TARGET", "T", "TEMP", "SIGMA", "REPEAT", "SESSION")

KEYS = ("robot", "frame", "tool", "sigma_mm", "sigma_deg", "target")
"""What a comment above the header can state."""

FRAMES = ("tracker", "robot")

SAME_ANGLE, SAME_WAY, SAME_LOAD, SAME_SHARE = 0.1 * DEG, 1.0 * MM, 10.0, 0.1
"""[rad], [m], [N, N m] and share of the load that rows of one REPEAT id may differ by, as a new command and a new
hanging of the same weight do."""

_RESERVED = frozenset(name.lower() for name in (*WRENCH, *PLACE, *ANGLES, *SHIFT, *TURN, *OPTIONAL))

# unit -> (how people write it, what is expected in words)
_UNITS = {
    "deg": (("deg", "degree", "degrees", "°"), "degrees are expected"),
    "mm": (("mm",), "millimetres are expected"),
    "N": (("n",), "newtons are expected"),
    "N m": (("n m", "nm", "n*m", "n·m"), "newton metres are expected"),
    "s": (("s",), "seconds are expected"),
    "degC": (("degc", "°c", "c"), "degrees Celsius are expected"),
    "": ((), "this column has no unit"),
}
_WITH_UNIT = re.compile(r"(.*?)\s*(?:\[([^\]]*)\]|\(([^)]*)\))")
_TARGET = re.compile(
    r"target(\s.*|\s*)[:=]([^:=]*)", re.IGNORECASE
)  # a name may hold a colon, numbers do not
_KEYED = re.compile(r"([^:=]*?)\s*[:=]\s*(.*)")
_JOINT_LIKE = re.compile(r"[aej][0-9]+")
_PLAIN = re.compile(r"[A-Za-z_][\w.-]*")
_CLOSE = 0.75  # of difflib's ratio: sigma is close to sigma_mm, load is not close to tool
_SHOWN = 5


@dataclass(frozen=True, eq=False)
class Readings:
    """R readings in the order of time.

    ``files``, ``digests``: where they were read, SHA-256 of the bytes; ``robot``: as the file names it, "" where it
    does not; ``joints``: (name, whether it slides) of the columns of ``q``; ``tool``: TCP on the flange, None where not
    stated.

    ``deflection``: ``value`` is loaded minus unloaded, robot base axes; else the absolute place, in the robot base
    (``in_robot_frame``) or in the tracker's frame.  ``targets``: names of the measured points, () where there is one
    unnamed point; ``places``: name -> (3,) [m] on the flange, of those that are stated.

    q (R, n) [rad, m] as commanded; wrench (R, 6) [N, N m] at the TCP, robot base axes; value (R, 3) [m], NaN where a
    coordinate is missing; rotation (R, 3, 3) of the pose, or of the turn from unloaded to loaded, NaN where missing,
    None without; target (R,) index into ``targets``, 0 without; sigma (R,) [m] one sigma per coordinate of the row as
    given, NaN where not stated; ``sigma_turn`` [rad] the same of the angles, None where not stated.

    repeat (R,): rows that repeat one state share a number from 0, -1 elsewhere; session (R,) index into ``sessions``;
    time (R,) [s], temperature (R,) [degC], direction (R, n) sense of approach -1, 0, 1, each None where not stated.

    file (R,) index into ``files`` and line (R,): where the row stands, -1 and 0 for a row of no file.
    """

    files: tuple[Path, ...]
    digests: tuple[str, ...]
    robot: str
    joints: tuple[tuple[str, bool], ...]
    deflection: bool
    in_robot_frame: bool
    tool: Poses | None
    targets: tuple[str, ...]
    places: Mapping[str, Floats]
    q: Floats
    wrench: Floats
    value: Floats
    rotation: Floats | None
    target: Ints
    sigma: Floats
    sigma_turn: float | None
    repeat: Ints
    session: Ints
    sessions: tuple[str, ...]
    time: Floats | None
    temperature: Floats | None
    direction: Floats | None
    file: Ints
    line: Ints
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        r, n = len(self.q), len(self.joints)
        shapes = {
            "q": (r, n),
            "wrench": (r, 6),
            "value": (r, 3),
            "rotation": (r, 3, 3),
            "sigma": (r,),
            "time": (r,),
            "temperature": (r,),
            "direction": (r, n),
        }
        for name, shape in shapes.items():
            if getattr(self, name) is not None:
                object.__setattr__(self, name, frozen(getattr(self, name), shape))
        for name in _INDICES:
            object.__setattr__(self, name, frozen(getattr(self, name), (r,), np.int64))
        places = {name: frozen(place, (3,)) for name, place in self.places.items()}
        object.__setattr__(self, "places", places)

    def __len__(self) -> int:
        return len(self.q)

    def part(self, rows: Any) -> Readings:
        """Some of the readings; the names of targets, sessions and files stay."""
        given: dict[str, Any] = {name: getattr(self, name) for name in (*_ARRAYS, *_INDICES)}
        given = {name: None if values is None else values[rows] for name, values in given.items()}
        return replace(self, **given)

    def where(self, row: int) -> tuple[str, int]:
        """File and line of a reading; ("", 0) for one of no file."""
        file = int(self.file[row])
        return ("", 0) if file < 0 else (str(self.files[file]), int(self.line[row]))


_ARRAYS = ("q", "wrench", "value", "rotation", "sigma", "time", "temperature", "direction")
_INDICES = ("target", "repeat", "session", "file", "line")


def planned(
    joints: Sequence[tuple[str, bool]],
    q: Floats,
    wrench: Floats,
    deflection: bool,
    in_robot_frame: bool = False,
    robot: str = "",
    tool: Poses | None = None,
    targets: Sequence[str] = (),
    places: Mapping[str, Floats] | None = None,
    target: Ints | None = None,
    sigma: float = np.nan,
    direction: Floats | None = None,
) -> Readings:
    """Readings that are still to be taken, of no file: ``q`` (R, n) [rad, m] under ``wrench`` (R, 6) [N, N m];
    ``target`` (R,) index into ``targets``, ``direction`` (R, n) sense of approach.  Values are NaN; rows of one state
    repeat each other."""
    r = len(q)
    target = np.zeros(r, np.int64) if target is None else target
    return Readings(
        files=(),
        digests=(),
        robot=robot,
        joints=tuple(joints),
        deflection=deflection,
        in_robot_frame=in_robot_frame,
        tool=tool,
        targets=tuple(targets),
        places=places or {},
        q=q,
        wrench=wrench,
        value=np.full((r, 3), np.nan),
        rotation=None,
        target=target,
        sigma=np.full(r, sigma),
        sigma_turn=None,
        repeat=_alike(q, wrench, target, *([] if direction is None else [direction])),
        session=np.zeros(r, np.int64),
        sessions=("",),
        time=None,
        temperature=None,
        direction=direction,
        file=np.full(r, -1),
        line=np.zeros(r, np.int64),
    )


def robot_named(path: Path) -> str:
    """The ``# robot:`` of a file, "" where it has none; the rest of the file may be wrong.

    Raises Refusal FIL001 (not readable), FIL003 (binary).
    """
    stated = (_keyed(text) for _, text in comments_above(path))
    return next((value for key, _, value in stated if key == "robot"), "")


def read_measurements(path: Path, joints: Sequence[tuple[str, bool]]) -> Readings:
    """Reads the CSV of a robot with these ``joints``: (name, whether it slides), in the order of the chain.

    Raises Refusal: FIL001..FIL003 (no text), MEA001 (comments, header or rows are wrong), MEA002 (no readings yet).
    """
    axes, table, deflection = _columns(read_table(path, "MEA001"), joints)
    stated = _stated(table)
    findings = list(stated.findings)
    values, angles = (SHIFT, TURN) if deflection else (PLACE, ANGLES)
    if deflection and stated.frame == "tracker":
        message = "# frame: tracker is not used: DX, DY, DZ stand in the axes of the robot base"
        findings.append(Finding("MEA009", message, str(path)))

    units = np.array([MM if slides else DEG for _, slides in joints])
    q = np.stack([axes.numbers(name) for name in axes.columns], axis=1) * units
    wrench = np.nan_to_num(_block(table, WRENCH))
    value = _block(table, values) * MM
    sigma = _sigma(table, stated.sigma)
    rotation = rotation_from_abc(_turns(table, angles)) if angles[0] in table else None
    direction = _directions(table, len(joints))
    names = _filled(table, "TARGET", "the name of what was measured belongs in every row")
    visits = _filled(table, "SESSION", "give it in every row, or leave the column out", may_be_empty=True)

    measured = ~np.isnan(value).all(axis=1)
    rows = np.flatnonzero(measured)
    if not len(rows):
        message = f"holds no readings yet: {', '.join(values)} are empty in all rows ({len(table)})"
        raise Refusal(Finding("MEA002", message, str(path), help="fill in what was measured"))
    if len(rows) < len(table):
        left = table.lines[~measured]
        message = f"rows without a reading, left out: {len(left)} ({_lines(left)})"
        findings.append(Finding("MEA003", message, str(path), int(left[0])))

    targets, target = _numbered([names[row] for row in rows] if names else [""] * len(rows))
    sessions, session = _numbered([visits[row] for row in rows] if visits else [""] * len(rows))
    targets = targets if names else ()
    findings += _check_targets(table, stated, names)
    time = _complete(table, "T", rows)
    temperature = _complete(table, "TEMP", rows)
    findings += _check_time(table, time, session, rows)

    q, wrench = q[rows], wrench[rows]
    direction = None if direction is None else direction[rows]
    repeat, doubt = _repeats(table, rows, q, wrench, target, session, direction, temperature, units)
    return Readings(
        files=(path,),
        digests=(table.digest,),
        robot=stated.robot,
        joints=tuple(joints),
        deflection=deflection,
        in_robot_frame=stated.frame == "robot",
        tool=stated.tool,
        targets=targets,
        places={name: place for name, place in stated.places.items() if name in targets},
        q=q,
        wrench=wrench,
        value=value[rows],
        rotation=None if rotation is None else rotation[rows],
        target=target,
        sigma=sigma[rows],
        sigma_turn=stated.sigma_turn,
        repeat=repeat,
        session=session,
        sessions=sessions,
        time=time,
        temperature=temperature,
        direction=direction,
        file=np.zeros(len(rows), np.int64),
        line=table.lines[rows],
        findings=(*findings, *doubt),
    )


# --- comments


@dataclass(frozen=True)
class _Stated:
    """What the comments say, in SI; ``lines``: name of a target -> line."""

    robot: str
    frame: str
    tool: Poses | None
    sigma: float
    sigma_turn: float | None
    places: dict[str, Floats]
    lines: dict[str, int]
    findings: list[Finding]


def _stated(table: Table) -> _Stated:
    found: dict[str, tuple[int, str]] = {}
    targets: dict[str, tuple[int, str]] = {}
    findings: list[Finding] = []
    for line, text in table.comments:
        key, name, value = _keyed(text)
        if line > table.header_line:
            if key in KEYS:
                message = f"# {key}: stands below the header and was not used"
                help = "move it above the header; it holds for the whole file"
                findings.append(Finding("MEA004", message, str(table.path), line, help=help))
            continue
        if key not in KEYS:
            doubt = _almost_a_key(text)
            if doubt:
                help = "write # key: value with one of " + ", ".join(KEYS)
                findings.append(Finding("MEA004", doubt, str(table.path), line, help=help))
            continue
        place, of = (targets, name) if key == "target" else (found, key)
        if of in place:
            raise _wrong(table, line, f"# {key} {name}".rstrip() + f" stands in line {place[of][0]} already")
        if key == "target" and not name:
            raise _wrong(table, line, "# target: names no target", "# target NAME: x y z (mm, on the flange)")
        place[of] = line, value

    def numbers(key: str, counts: tuple[int, ...], form: str) -> list[float] | None:
        return _checked_numbers(table, key, *found[key], counts, form) if key in found else None

    tool = numbers("tool", (3, 6), "x y z [a b c] (mm, deg)")
    for key in ("robot", "frame"):
        if key in found and not found[key][1]:
            raise _wrong(table, found[key][0], f"# {key}: nothing is named")
    frame = found["frame"][1].lower() if "frame" in found else ""
    if frame and frame not in FRAMES:
        message = f"# frame: {frame[:40]!r} is no frame{nearest(frame, FRAMES)}"
        raise _wrong(table, found["frame"][0], message, "one of " + ", ".join(FRAMES))
    sigmas = []
    for key in ("sigma_mm", "sigma_deg"):
        given = numbers(key, (1,), "one number without a unit")
        if given and given[0] <= 0:
            raise _wrong(table, found[key][0], f"# {key}: {given[0]:g} is not above zero")
        sigmas.append(given[0] if given else None)
    places = {
        name: np.array(_checked_numbers(table, f"target {name}", line, text, (3,), "x y z (mm)")) * MM
        for name, (line, text) in targets.items()
    }
    return _Stated(
        robot=found["robot"][1] if "robot" in found else "",
        frame=frame,
        tool=None
        if tool is None
        else Poses.from_abc(np.array(tool[:3]) * MM, np.array(tool[3:] or [0.0] * 3) * DEG),
        sigma=np.nan if sigmas[0] is None else sigmas[0] * MM,
        sigma_turn=None if sigmas[1] is None else sigmas[1] * DEG,
        places=places,
        lines={name: line for name, (line, _) in targets.items()},
        findings=findings,
    )


def _keyed(text: str) -> tuple[str, str, str]:
    """Key in lower case, name of a target and value of ``key: value`` or ``target NAME: value``, "" without."""
    text = text.lstrip("# \t")
    target = _TARGET.fullmatch(text)
    if target:
        return "target", target[1].strip(), target[2].strip()
    keyed = _KEYED.fullmatch(text)
    return (keyed[1].lower(), "", keyed[2].strip()) if keyed else ("", "", "")


def _almost_a_key(text: str) -> str:
    """What is odd about a comment that was probably meant to state something, or ""."""
    words = text.lower().split()
    keyed = _KEYED.fullmatch(text.lstrip("# \t"))
    if keyed:
        head = keyed[1].lower()
        first = head.partition(" ")[0]
        whole = "_".join(head.split())
        numeric = _close(first) not in ("", "robot", "frame") and _numbers(keyed[2])
        if _close(whole) or numeric:
            return f"{head[:40]!r} is no key{nearest(whole if _close(whole) else first, KEYS)}"
    elif (
        len(words) > 1 and words[0] in KEYS and (finite_number(words[-1]) is not None or words[0] == "frame")
    ):
        return f"{text[:40]!r} has no colon after its key"
    return ""


def _close(word: str) -> str:
    """The key that ``word`` is, or is a slip of the hand away from, or ""."""
    return next(iter(difflib.get_close_matches(word, KEYS, 1, _CLOSE)), "")


def _checked_numbers(
    table: Table, key: str, line: int, text: str, counts: tuple[int, ...], form: str
) -> list[float]:
    numbers = _numbers(text.replace(",", ".") if counts == (1,) else text)
    if numbers is None or len(numbers) not in counts:
        what = f"{text[:40]!r} is not understood" if numbers is None else f"{len(numbers)} numbers"
        help = "separate the numbers by blanks; a comma in a number is a decimal comma then"
        raise _wrong(table, line, f"# {key}: {what} where {form} is expected", help)
    return numbers


def _numbers(text: str) -> list[float] | None:
    """Numbers separated by blanks, commas or semicolons; a comma is a decimal comma where blanks or semicolons
    separate.  None where one is no number, or commas do both."""
    if ";" in text or not re.search(r",\s|\s,", text):
        by_commas = not re.search(r"[;\s]", text.strip())
    elif re.search(r"\S,\S", text):
        return None
    else:
        by_commas = True
    words = re.split(r"[,\s]+" if by_commas else r"[;\s]+", text.strip())
    numbers = [finite_number(word if by_commas else word.replace(",", ".", 1)) for word in words]
    return None if None in numbers else [number for number in numbers if number is not None]


def _wrong(table: Table, line: int, message: str, help: str = "") -> Refusal:
    return Refusal(Finding(table.code, message, str(table.path), line, help=help))


# --- header


def _columns(table: Table, joints: Sequence[tuple[str, bool]]) -> tuple[Table, Table, bool]:
    """The columns of the joints in their order, the others under their own names, and whether they hold deflections.

    Refusal: a column that is missing, unknown, of another unit, or one too many.
    """
    own = [name.lower() for name, _ in joints]
    heads: dict[str, tuple[str, str]] = {}  # name without its unit -> name as it stands, unit
    for head in table.columns:
        match = None if head in own else _WITH_UNIT.fullmatch(head)
        name, unit = (match[1], match[2] or match[3] or "") if match else (head, "")
        if name in heads:
            raise table.header_error(f"columns {heads[name][0]!r} and {head!r} are the same")
        heads[name] = head, unit.strip()

    joint_columns = _joint_columns(table, heads, joints)
    free = heads.keys() - {name.lower() for name in joint_columns}
    deflection = _is_deflection(table, free)
    directions = [f"DIR{index}" for index in range(1, len(joints) + 1)]
    values, angles = (SHIFT, TURN) if deflection else (PLACE, ANGLES)
    units = {name: "mm" if slides else "deg" for name, (_, slides) in zip(joint_columns, joints, strict=True)}
    for names, unit in (
        (WRENCH[:3], "N"),
        (WRENCH[3:], "N m"),
        ((*values, "SIGMA"), "mm"),
        (angles, "deg"),
        (("T",), "s"),
        (("TEMP",), "degC"),
        (("TARGET", "REPEAT", "SESSION", *directions), ""),
    ):
        units = {**dict.fromkeys(names, unit), **units}  # a joint may be called T

    spelled = {name.lower(): name for name in units}
    for name, (head, unit) in heads.items():
        if name not in spelled:
            raise _unknown(table, head, joint_columns, joints, list(spelled))
        words, expected = _UNITS[units[spelled[name]]]
        if unit and " ".join(unit.split()) not in words:
            raise table.header_error(f"column {head!r}: {expected}", "convert the column and its header")
    axes = {name: table.columns[heads[name.lower()][0]] for name in joint_columns}
    others = {spelled[name]: table.columns[heads[name][0]] for name in free}
    return replace(table, columns=axes), replace(table, columns=others), deflection


def _joint_columns(table: Table, heads: Collection[str], joints: Sequence[tuple[str, bool]]) -> list[str]:
    """The robot's own names of its joints where the header has them, else A1..An or J1..Jn."""
    numbers = range(1, len(joints) + 1)
    own = [name for name, _ in joints]
    # T or B may be a joint as well as a time or an angle: alone it says nothing
    schemes = [(own, [name for name in own if name.lower() not in _RESERVED])]
    schemes += [(names, names) for names in ([f"{letter}{i}" for i in numbers] for letter in "AJ")]
    for names, telling in schemes:
        if any(name.lower() in heads for name in telling):
            for name in names:
                if name.lower() not in heads:
                    raise table.header_error(f"column {name!r} is missing", _expected(names, joints))
            return names
    message = "the columns of the joints are missing"
    raise table.header_error(message, f"{_expected(own, joints)}; or A1..A{len(own)}, or J1..J{len(own)}")


def _expected(names: Sequence[str], joints: Sequence[tuple[str, bool]]) -> str:
    units = ("mm" if slides else "deg" for _, slides in joints)
    listed = ", ".join(f"{name} ({unit})" for name, unit in zip(names, units, strict=True))
    return f"one column a joint, as commanded: {listed}"


def _is_deflection(table: Table, heads: Collection[str]) -> bool:
    """Whether values are DX,DY,DZ; Refusal unless they are all of one kind."""
    here = {
        names: [name for name in names if name.lower() in heads] for names in (PLACE, SHIFT, ANGLES, TURN)
    }
    forms = "X,Y,Z (measured place) or DX,DY,DZ (loaded minus unloaded)"
    if here[PLACE] and here[SHIFT]:
        raise table.header_error(f"columns {here[PLACE][0]!r} and {here[SHIFT][0]!r} stand together", forms)
    deflection = bool(here[SHIFT])
    values, angles, others = (SHIFT, TURN, ANGLES) if deflection else (PLACE, ANGLES, TURN)
    if not here[values]:
        raise table.header_error("the columns of what was measured are missing", forms)
    if here[others]:
        message = f"column {here[others][0]!r} does not belong to {','.join(values)}"
        raise table.header_error(message, f"the angles are {','.join(angles)} here")
    for names in (values, angles):
        if here[names] and len(here[names]) < 3:
            missing = next(name for name in names if name not in here[names])
            message = f"column {missing!r} is missing beside {here[names][0]!r}"
            raise table.header_error(message, f"{','.join(names)}; leave cells empty where there is no value")
    return deflection


def _unknown(
    table: Table,
    head: str,
    joint_columns: Sequence[str],
    joints: Sequence[tuple[str, bool]],
    spelled: Collection[str],
) -> Refusal:
    if _JOINT_LIKE.match(head):
        return table.header_error(
            f"column {head!r} is none of the robot's {len(joints)} joints", _expected(joint_columns, joints)
        )
    columns = (*joint_columns, *WRENCH, *PLACE, *ANGLES, *SHIFT, *TURN, *OPTIONAL, f"DIR1..DIR{len(joints)}")
    return table.header_error(
        f"unknown column {head!r}{nearest(head, spelled)}", "columns: " + ", ".join(columns)
    )


# --- rows


def _block(table: Table, names: Sequence[str]) -> Floats:
    """(rows, len(names)), NaN where a cell or a column is missing."""
    block = np.full((len(table), len(names)), np.nan)
    for index, name in enumerate(names):
        if name in table:
            block[:, index] = table.numbers_or_nan(name)
    return block


def _sigma(table: Table, stated: float) -> Floats:
    """(rows,) [m]: the cell, else what the file states."""
    if "SIGMA" not in table:
        return np.full(len(table), stated)
    sigma = table.numbers_or_nan("SIGMA")
    wrong = np.flatnonzero(sigma <= 0)
    if len(wrong):
        shown = table.texts("SIGMA")[wrong[0]]
        raise table.error(int(wrong[0]), "SIGMA", f"{shown} is not above zero")
    return np.where(np.isnan(sigma), stated, sigma * MM)


def _turns(table: Table, names: Sequence[str]) -> Floats:
    """(rows, 3) [rad] A, B, C, NaN where all three are missing."""
    turns = _block(table, names) * DEG
    missing = np.isnan(turns)
    half = np.flatnonzero(missing.any(axis=1) & ~missing.all(axis=1))
    if len(half):
        row = int(half[0])
        name = names[int(np.flatnonzero(missing[row])[0])]
        raise table.error(row, name, "the cell is empty", f"{', '.join(names)}: all three, or none")
    return turns


def _directions(table: Table, count: int) -> Floats | None:
    """(rows, n) sense of approach, 0 where it is not stated."""
    names = [f"DIR{index}" for index in range(1, count + 1)]
    block = _block(table, names)
    if np.isnan(block).all():
        return None
    sense = np.nan_to_num(block)
    wrong = np.argwhere(~np.isin(sense, (-1.0, 0.0, 1.0)))
    if len(wrong):
        row, column = wrong[0]
        shown = table.texts(names[column])[row]
        raise table.error(int(row), names[column], f"{shown!r} is no direction of approach", "-1, 0 or 1")
    return sense


def _filled(table: Table, name: str, help: str, may_be_empty: bool = False) -> list[str]:
    """The cells of a column of names, [] without it (or if no cell is filled in and it ``may_be_empty``)."""
    if name not in table:
        return []
    cells = list(table.texts(name))
    empty = [row for row, cell in enumerate(cells) if is_missing(cell)]
    if may_be_empty and len(empty) == len(cells):
        return []
    if empty:
        raise table.error(empty[0], name, "the cell is empty", help)
    return cells


def _complete(table: Table, name: str, rows: Ints) -> Floats | None:
    """A number of every reading, None where no reading has one."""
    if name not in table:
        return None
    numbers = table.numbers_or_nan(name)[rows]
    empty = np.isnan(numbers)
    if empty.all():
        return None
    if empty.any():
        help = "give it for every reading, or leave the column out"
        raise table.error(int(rows[np.argmax(empty)]), name, "the cell is empty", help)
    return numbers


def _check_targets(table: Table, stated: _Stated, names: Sequence[str]) -> list[Finding]:
    """Names that differ from a stated one by case are refused; stated places of no row are told (MEA005)."""
    spelled = {name.casefold(): name for name in stated.places}
    used = dict.fromkeys(names)
    for name in used:
        other = spelled.get(name.casefold())
        if other is not None and name not in stated.places:
            row = names.index(name)
            help = f"line {stated.lines[other]} states the place of {other!r}; write both alike"
            raise table.error(row, "TARGET", f"{name!r} differs from {other!r} by its case", help)
    findings = []
    for name, line in stated.lines.items():
        if name not in used:
            what = nearest(name, used) if names else "; there is no column TARGET"
            message = f"no row has the target {name!r}{what}"
            findings.append(Finding("MEA005", message, str(table.path), line))
    return findings


def _check_time(table: Table, time: Floats | None, session: Ints, rows: Ints) -> list[Finding]:
    """Whether T falls from one reading of a session to the next (MEA006)."""
    if time is None:
        return []
    order = np.argsort(session, kind="stable")
    back = (np.diff(time[order]) < 0) & (np.diff(session[order]) == 0)
    if not back.any():
        return []
    row = int(rows[np.min(order[1:][back])])
    message = f"column T: {table.texts('T')[row]} is before the time of the reading above it"
    more = f" (and {back.sum() - 1} more)" if back.sum() > 1 else ""
    help = "put the rows into the order in which they were taken"
    return [Finding("MEA006", message + more, str(table.path), int(table.lines[row]), help=help)]


def _numbered(texts: Sequence[str]) -> tuple[tuple[str, ...], Ints]:
    """The different texts in the order of their first, and the number of each one."""
    known: dict[str, int] = {}
    numbers = [known.setdefault(text, len(known)) for text in texts]
    return tuple(known), np.array(numbers, dtype=np.int64)


def _lines(lines: Ints) -> str:
    shown = ", ".join(str(line) for line in lines[:_SHOWN])
    more = f" and {len(lines) - _SHOWN} more" if len(lines) > _SHOWN else ""
    return f"line{'s' if len(lines) > 1 else ''} {shown}{more}"


# --- repeats


def _alike(*columns: ArrayLike) -> Ints:
    """(R,) rows that are equal in all ``columns`` (R,) or (R, k) share a number from 0, in the order of their first;
    -1 for a row that is like no other."""
    keys = np.column_stack([np.asarray(column, float) for column in columns])
    if not len(keys):
        return np.empty(0, np.int64)
    order = np.lexsort(keys.T)
    begins = np.append(True, (keys[order][1:] != keys[order][:-1]).any(axis=1))
    group = np.empty(len(keys), np.int64)
    group[order] = np.cumsum(begins) - 1
    first = order[begins]  # the sort is stable
    several = np.flatnonzero(np.bincount(group) > 1)
    number = np.full(len(first), -1)
    number[several[np.argsort(first[several])]] = np.arange(len(several))
    return np.asarray(number[group])


def _repeats(
    table: Table,
    rows: Ints,
    q: Floats,
    wrench: Floats,
    target: Ints,
    session: Ints,
    direction: Floats | None,
    temperature: Floats | None,
    units: Floats,
) -> tuple[Ints, list[Finding]]:
    """(R,) number of the state that a reading repeats, by REPEAT, or of rows that say the same; -1 for none."""
    texts = [table.texts("REPEAT")[row] for row in rows] if "REPEAT" in table else []
    given = np.array([not is_missing(text) for text in texts], bool)
    if not given.any():
        said = [column for column in (direction, temperature) if column is not None]
        return _alike(q, wrench, target, session, *said), []
    alone = -1 - np.arange(len(rows))
    ids = np.where(given, _numbered(texts)[1], alone)
    repeat = _alike(session, target, ids)
    first = _first(repeat)
    other = _differ(q, wrench, first, units) & (repeat >= 0)
    if not other.any():
        return repeat, []
    row = int(np.argmax(other))
    message = (
        f"column REPEAT: {texts[row]!r} stands with other joint angles or loads in line"
        f" {table.lines[rows[first[row]]]}; of this id only rows that say the same were taken as repeats"
    )
    finding = Finding("MEA007", message, str(table.path), int(table.lines[rows[row]]))
    states = _alike(q, wrench)
    states = np.where(states < 0, alone, states)
    mixed = np.isin(repeat, repeat[other])
    return _alike(session, target, ids, np.where(mixed, states, 0)), [finding]


def _first(group: Ints) -> Ints:
    """(R,) the first row with the same number."""
    _, first, inverse = np.unique(group, return_index=True, return_inverse=True)
    return np.asarray(first[inverse.reshape(-1)])


def _differ(q: Floats, wrench: Floats, other: Ints, units: Floats) -> Bools:
    """(R,) whether a row is of another state than the row ``other`` (R,)."""
    moved = (np.abs(q - q[other]) > np.where(units == MM, SAME_WAY, SAME_ANGLE)).any(axis=1)
    change = np.abs(wrench - wrench[other]).reshape(-1, 2, 3).max(axis=2)
    size = np.abs(wrench[other]).reshape(-1, 2, 3).max(axis=2)
    return np.asarray(moved | (change > SAME_LOAD + SAME_SHARE * size).any(axis=1))


# --- several files


def joined(several: Sequence[Readings]) -> Readings:
    """The readings of several files, one after the other; their sessions and repeats stay apart.

    A session is called ``stem`` of its file, or ``stem:session``.  Refusal MEA008 where they differ in what must be
    the same.
    """
    if len(several) == 1:
        return several[0]
    first = several[0]
    for index, other in enumerate(several):
        for one in several[:index]:
            _check_alike(one, other)
    targets, _ = _numbered([name for one in several for name in one.targets])
    labels = _labels(several)
    sessions = [
        f"{label}:{name}" if label and name else label or name
        for one, label in zip(several, labels, strict=True)
        for name in one.sessions
    ]
    places: dict[str, Floats] = {}
    indices: dict[str, Any] = {name: [] for name in _INDICES}
    repeats = files = visits = 0
    for one in several:
        places |= one.places
        lookup = np.array([targets.index(name) for name in one.targets] or [0])
        indices["target"].append(lookup[one.target])
        indices["repeat"].append(np.where(one.repeat < 0, -1, one.repeat + repeats))
        indices["session"].append(one.session + visits)
        indices["file"].append(np.where(one.file < 0, -1, one.file + files))
        indices["line"].append(one.line)
        repeats += int(one.repeat.max(initial=-1)) + 1
        files += len(one.files)
        visits += len(one.sessions)
    parts: dict[str, Any] = {name: [getattr(one, name) for one in several] for name in _ARRAYS} | indices
    if any(rotation is not None for rotation in parts["rotation"]):
        parts["rotation"] = [
            np.full((len(one), 3, 3), np.nan) if one.rotation is None else one.rotation for one in several
        ]
    arrays: dict[str, Any] = {
        name: None if part[0] is None else np.concatenate(part) for name, part in parts.items()
    }
    return replace(
        first,
        files=tuple(path for one in several for path in one.files),
        digests=tuple(digest for one in several for digest in one.digests),
        robot=next((one.robot for one in several if one.robot), ""),
        targets=targets,
        places=places,
        sigma_turn=next((one.sigma_turn for one in several if one.sigma_turn is not None), None),
        sessions=tuple(sessions),
        findings=tuple(finding for one in several for finding in one.findings),
        **arrays,
    )


def _labels(several: Sequence[Readings]) -> list[str]:
    """What the sessions of each are called by: the stem of its file, its path where stems are alike, or a number."""
    stems = [one.files[0].stem if len(one.files) == 1 else "" for one in several]
    return [
        stem if stem and stems.count(stem) == 1 else str(one.files[0]) if stem else f"part {index}"
        for index, (one, stem) in enumerate(zip(several, stems, strict=True), start=1)
    ]


def _check_alike(one: Readings, other: Readings) -> None:
    """Refusal MEA008 unless the two can be read as one."""
    twice = set(one.digests) & set(other.digests)
    if twice:
        message = f"holds the same bytes as {_named(one)}: every reading would count twice"
        raise Refusal(Finding("MEA008", message, _named(other), help="name each file once"))
    here, there = _facts(one), _facts(other)
    for what, said in here.items():
        if what in there and there[what] != said:
            message = f"{what}: {there[what]}, but {said} in {_named(one)}"
            raise Refusal(Finding("MEA008", message, _named(other), help="identify from each on its own"))


def _facts(readings: Readings) -> dict[str, str]:
    """What must be the same where two files both say it."""
    one = readings
    facts = {
        "joints": _expected([name for name, _ in one.joints], one.joints),
        "values": ",".join(SHIFT if one.deflection else PLACE),
        "tool": "not stated" if one.tool is None else _pose(one.tool),
    }
    if not one.deflection:
        facts["frame"] = FRAMES[one.in_robot_frame]
    columns = {"TARGET": one.targets, "T": one.time, "TEMP": one.temperature, "DIR1": one.direction}
    for name, column in columns.items():
        facts[f"column {name}"] = "none" if column is None or len(column) == 0 else "given"
    if one.robot:
        facts["robot"] = one.robot.casefold()
    if one.sigma_turn is not None:
        facts["sigma_deg"] = f"{one.sigma_turn / DEG:.6g}"
    return facts | {f"place of target {name}": _fixed(place / MM) for name, place in one.places.items()}


def _named(readings: Readings) -> str:
    return ", ".join(str(path) for path in readings.files) or "the plan"


# --- writing


def measurements_csv(readings: Readings, about: Sequence[str] = ()) -> bytes:
    """The file that reads back as ``readings``; ``about``: comments to begin with.

    Only columns that hold something are written, those of the measured values always.  Rounding: 1e-4 mm, 1e-4 deg
    (1e-6 deg of a deflection's angles), 1e-3 s and degC, 6 digits of a wrench or sigma.
    """
    values, angles = (SHIFT, TURN) if readings.deflection else (PLACE, ANGLES)
    r, n = readings.wrench.shape[0], len(readings.joints)
    units = np.array([MM if slides else DEG for _, slides in readings.joints])
    state = dict(zip(_written_joints(readings), _fixed_columns(readings.q / units), strict=True))
    for name, load in zip(WRENCH, readings.wrench.T, strict=True):
        if load.any():
            state[name] = [f"{value + 0.0:.6g}" for value in load.tolist()]
    if readings.direction is not None:
        names = [f"DIR{index}" for index in range(1, n + 1)]
        state |= dict(zip(names, _fixed_columns(readings.direction, 0), strict=True))
    if readings.temperature is not None:
        state["TEMP"] = _fixed_column(readings.temperature, 3)
    if readings.targets:
        state["TARGET"] = [readings.targets[index] for index in readings.target]
    if readings.sessions != ("",):
        state["SESSION"] = [readings.sessions[index] for index in readings.session]

    columns = state | dict(zip(values, _fixed_columns(readings.value / MM), strict=True))
    if readings.rotation is not None:
        turned = np.full((r, 3), np.nan)
        known = ~np.isnan(readings.rotation[:, 0, 0])
        turned[known] = abc_from_rotation(readings.rotation[known]) / DEG
        columns |= dict(zip(angles, _fixed_columns(turned, 6 if readings.deflection else 4), strict=True))
    if readings.time is not None:
        columns["T"] = _fixed_column(readings.time, 3)
    sigma = readings.sigma / MM
    one_sigma = bool(r) and np.all(sigma == sigma[0])
    if not one_sigma and not np.isnan(sigma).all():
        columns["SIGMA"] = ["" if value != value else f"{value:.6g}" for value in sigma.tolist()]
    # without the column rows that say the same are repeats
    if (readings.repeat >= 0).any() or len(set(zip(*state.values(), strict=True))) < r:
        single = readings.repeat < 0
        ids = np.where(single, readings.repeat.max(initial=-1) + np.cumsum(single), readings.repeat)
        columns["REPEAT"] = [str(value + 1) for value in ids]

    comments = [line for text in about for line in text.splitlines()]
    if readings.robot:
        comments.append(f"robot: {' '.join(readings.robot.split())}")
    if not readings.deflection:
        comments.append(f"frame: {FRAMES[readings.in_robot_frame]}")
    if readings.tool is not None:
        comments.append(f"tool: {_pose(readings.tool)}")
    if one_sigma:
        comments.append(f"sigma_mm: {sigma[0]:.6g}")
    if readings.sigma_turn is not None:
        comments.append(f"sigma_deg: {readings.sigma_turn / DEG:.6g}")
    comments += [f"target {name}: {_fixed(place / MM)}" for name, place in readings.places.items()]
    stream = io.StringIO()
    stream.writelines(f"# {comment}\n" for comment in comments)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue().encode()


def _written_joints(readings: Readings) -> list[str]:
    """The robot's own names of its joints, or A1..An where they would not be read back as such."""
    own = [name for name, _ in readings.joints]
    lower = {name.lower() for name in own}
    if len(lower) == len(own) and not lower & _RESERVED and all(_PLAIN.fullmatch(name) for name in own):
        return own
    return [f"A{index}" for index in range(1, len(own) + 1)]


def _fixed_columns(values: Floats, decimals: int = 4) -> list[list[str]]:
    return [_fixed_column(column, decimals) for column in values.T]


def _fixed_column(values: Floats, decimals: int) -> list[str]:
    """Fixed decimals, empty for what is not known, no minus zero."""
    rounded = np.round(values, decimals) + 0.0
    return ["" if value != value else f"{value:.{decimals}f}" for value in rounded.tolist()]


def _fixed(values: Floats) -> str:
    """Numbers with four decimals at most, separated by blanks."""
    return " ".join(text.rstrip("0").rstrip(".") for text in _fixed_column(values, 4))


def _pose(pose: Poses) -> str:
    """``x y z a b c`` [mm, deg]"""
    return _fixed(np.concatenate([pose.position / MM, abc_from_rotation(pose.rotation) / DEG]))
