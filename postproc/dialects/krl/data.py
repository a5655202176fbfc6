"""The module's .dat file: the points and motion records that it declares."""

from __future__ import annotations

from dataclasses import dataclass, field

from postproc.dialects.krl.lexing import POINT_TYPES, RECORD_TYPES, Assignment, Declared, lines, statement
from postproc.dialects.krl.state import Point
from postproc.dialects.krl.target import Unclear, fields, parse
from postproc.document import Document


@dataclass
class Declarations:
    """Points and records (FDAT, LDAT, PDAT: key -> value) by name, upper case."""

    points: dict[bytes, Point] = field(default_factory=dict)
    records: dict[bytes, dict[bytes, bytes]] = field(default_factory=dict)


def read_data(document: Document, file: int) -> Declarations:
    """Reads the declarations of a .dat; what is no point and no record is passed over."""
    result = Declarations()
    declared: set[bytes] = set()
    for line, start, stop in lines(document):
        found = statement(document.raw, line, start, stop)
        if found is None:
            continue
        if isinstance(found.said, Declared):
            for key, value, at in found.said.items:
                if key is not None and found.said.type in RECORD_TYPES and value.startswith(b"{"):
                    result.records[key] = fields(value)
                elif key is not None and found.said.type in POINT_TYPES and value:
                    point = read_point(value, at, file, line)
                    if found.said.is_global:
                        point.blocked = Unclear("KRL007", "it is GLOBAL, other programs may use it")
                    _add(result, declared, key, point)
        elif isinstance(found.said, Assignment) and not found.said.path:
            said = found.said
            if said.key is not None and said.value.startswith(b"{"):
                _add(result, declared, said.key, read_point(said.value.rstrip(), said.at, file, line))
    return result


def _add(result: Declarations, declared: set[bytes], key: bytes, point: Point) -> None:
    if key in declared:
        point = Point(Unclear("KRL019", f"{key.decode('latin-1')} is declared twice in the .dat"))
    declared.add(key)
    result.points[key] = point


def read_point(value: bytes, at: int, file: int, line: int) -> Point:
    """The point of an aggregate ``value`` that stands at byte ``at`` of document ``file``."""
    if not (value.startswith(b"{") and value.endswith(b"}") and value.count(b"{") == 1):
        return Point(
            Unclear("KRL019", f"its declaration in line {line} of the .dat is no aggregate of numbers")
        )
    target = parse(value, at, file)
    if isinstance(target, Unclear):
        return Point(Unclear("KRL019", f"its declaration in line {line} of the .dat: {target.message}"))
    return Point(target)
