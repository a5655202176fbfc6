"""The header row: what the columns are called, and that none is missing, unknown or one too many."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from postproc.base.findings import Refusal, nearest
from postproc.base.tables import CsvTable
from postproc.base.tables.header_units import check_unit, split_unit

WRENCH = ("FX", "FY", "FZ", "MX", "MY", "MZ")
PLACE, ANGLES = ("X", "Y", "Z"), ("A", "B", "C")
SHIFT, TURN = ("DX", "DY", "DZ"), ("DA", "DB", "DC")
OPTIONAL = ("TARGET", "T", "TEMP", "SIGMA", "REPEAT", "SESSION")

RESERVED = frozenset(name.lower() for name in (*WRENCH, *PLACE, *ANGLES, *SHIFT, *TURN, *OPTIONAL))
"""What is more than a joint, in lower case."""

_DIRECTION_LIKE = re.compile(r"dir[0-9]+")
_CLOSE = 0.75
_JOINT_LIKE = re.compile(r"[aej][0-9]+")


def value_columns(deflection: bool) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Names of the coordinates and of the angles of what was measured."""
    return (SHIFT, TURN) if deflection else (PLACE, ANGLES)


def direction_columns(count: int) -> list[str]:
    return [f"DIR{index}" for index in range(1, count + 1)]


def expected_joints(names: Sequence[str], joints: Sequence[tuple[str, bool]]) -> str:
    """In words, which columns the ``joints`` have under these ``names``."""
    units = ("mm" if slides else "deg" for _, slides in joints)
    listed = ", ".join(f"{name} ({unit})" for name, unit in zip(names, units, strict=True))
    return f"one column per joint, with the commanded values: {listed}"


def split_columns(
    table: CsvTable, joints: Sequence[tuple[str, bool]]
) -> tuple[CsvTable, CsvTable, bool, CsvTable]:
    """The columns of the joints in their order, the others under their own names, whether they hold deflections, and
    those that are no part of the format.

    Refusal: a column that is missing, of another unit, one too many, or that differs from a known one by a typing
    error.
    """
    heads = _heads(table, joints)
    own = _joint_columns(table, heads, joints)
    others = heads.keys() - {name.lower() for name in own}
    deflection = _is_deflection(table, others)
    values, angles = value_columns(deflection)
    units = {
        **dict.fromkeys(("TARGET", "REPEAT", "SESSION", *direction_columns(len(joints))), ""),
        **dict.fromkeys(WRENCH[:3], "N"),
        **dict.fromkeys(WRENCH[3:], "N m"),
        **dict.fromkeys((*values, "SIGMA"), "mm"),
        **dict.fromkeys(angles, "deg"),
        "T": "s",
        "TEMP": "degC",
        # a joint may be called T
        **{name: "mm" if slides else "deg" for name, (_, slides) in zip(own, joints, strict=True)},
    }
    spelled = {name.lower(): name for name in units}
    ignored = []
    for name, (head, unit) in heads.items():
        if name not in spelled:
            if _is_mistyped(name, spelled):
                raise _unknown(table, head, own, joints, spelled)
            ignored.append(name)
            continue
        check_unit(table, head, unit, units[spelled[name]])
    axes = {name: table.columns[heads[name.lower()][0]] for name in own}
    rest = {spelled[name]: table.columns[heads[name][0]] for name in others if name in spelled}
    extra = {heads[name][0]: table.columns[heads[name][0]] for name in ignored}
    return (
        replace(table, columns=axes),
        replace(table, columns=rest),
        deflection,
        replace(table, columns=extra),
    )


def _is_mistyped(name: str, known: Collection[str]) -> bool:
    """Whether a column probably was to be one of the format: of one letter, of a joint, or nearly its name."""
    if len(name) <= 2 or _JOINT_LIKE.match(name) or _DIRECTION_LIKE.match(name):
        return True
    return bool(difflib.get_close_matches(name, [one for one in known if len(one) > 2], 1, _CLOSE))


def _heads(table: CsvTable, joints: Sequence[tuple[str, bool]]) -> Mapping[str, tuple[str, str]]:
    """Name of a column without its unit -> name as written, unit or ""."""
    own = [name.lower() for name, _ in joints]
    heads: dict[str, tuple[str, str]] = {}
    for head in table.columns:
        name, unit = (head, "") if head in own else split_unit(head)
        if name in heads:
            raise table.header_error(f"columns {heads[name][0]!r} and {head!r} are the same")
        heads[name] = head, unit
    return heads


def _joint_columns(table: CsvTable, heads: Collection[str], joints: Sequence[tuple[str, bool]]) -> list[str]:
    """The robot's own names of its joints where the header has them, else A1..An or J1..Jn."""
    own = [name for name, _ in joints]
    count = len(own)
    # T or B may be a joint as well as a time or an angle: alone it states nothing
    schemes = [(own, [name for name in own if name.lower() not in RESERVED])]
    schemes += [(names, names) for names in ([f"{letter}{i + 1}" for i in range(count)] for letter in "AJ")]
    for names, conclusive in schemes:
        if any(name.lower() in heads for name in conclusive):
            for name in names:
                if name.lower() not in heads:
                    raise table.header_error(
                        f"column {name!r} is missing", f"add {expected_joints(names, joints)}"
                    )
            return names
    message = "the columns of the joints are missing"
    raise table.header_error(message, f"add {expected_joints(own, joints)}; or A1..A{count}, or J1..J{count}")


def _is_deflection(table: CsvTable, heads: Collection[str]) -> bool:
    """Whether values are DX,DY,DZ; Refusal unless they are all of one kind."""
    here: dict[tuple[str, ...], list[str]] = {
        names: [name for name in names if name.lower() in heads] for names in (PLACE, SHIFT, ANGLES, TURN)
    }
    forms = "use X,Y,Z (measured place) or DX,DY,DZ (loaded minus unloaded)"
    if here[PLACE] and here[SHIFT]:
        raise table.header_error(
            f"columns {here[PLACE][0]!r} and {here[SHIFT][0]!r} exclude each other", forms
        )
    deflection = bool(here[SHIFT])
    values, angles = value_columns(deflection)
    others = value_columns(not deflection)[1]
    if not here[values]:
        raise table.header_error("the columns of the measured values are missing", forms)
    if here[others]:
        message = f"column {here[others][0]!r} does not belong to {','.join(values)}"
        raise table.header_error(message, f"the angles are {','.join(angles)} here")
    for names in (values, angles):
        if here[names] and len(here[names]) < 3:
            missing = next(name for name in names if name not in here[names])
            message = f"column {missing!r} is missing; {here[names][0]!r} needs it"
            raise table.header_error(
                message, f"add {','.join(names)}; cells may be empty where no value exists"
            )
    return deflection


def _unknown(
    table: CsvTable, head: str, own: Sequence[str], joints: Sequence[tuple[str, bool]], known: Collection[str]
) -> Refusal:
    if _JOINT_LIKE.match(head):
        message = f"column {head!r} is none of the robot's {len(joints)} joints"
        return table.header_error(message, expected_joints(own, joints))
    names = (*own, *WRENCH, *PLACE, *ANGLES, *SHIFT, *TURN, *OPTIONAL, f"DIR1..DIR{len(joints)}")
    message = f"column {head!r} is unknown{nearest(head, known)}"
    return table.header_error(message, "columns: " + ", ".join(names))
