"""What a variable, or a component of a structure, makes of a value: by the type that is declared for it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType

from postproc.base.byte_search import matches
from postproc.base.document import Document
from postproc.languages.krl.expressions import UntypedNumber, Value, decided_by_digits
from postproc.languages.krl.lexing import LONGEST, NAME, POINT_TYPES, is_number
from postproc.languages.krl.target import AXES, COMPONENTS, EXTERNAL, UnknownValue, shown

Structures = Mapping[bytes, Mapping[bytes, bytes]]
"""Name of a structure -> name of a component -> its type; upper case."""

_STRUC = re.compile(
    rb"^[ \t]*+((?:GLOBAL[ \t]++|DECL[ \t]++)*+)STRUC[ \t]++(" + NAME + rb")[ \t]++([^;\r\n]*+)", re.I | re.M
)
_SIZES = re.compile(rb"\[[^\[\]]*+\]")
_POINT = {**dict.fromkeys([*COMPONENTS, *AXES, *EXTERNAL], b"REAL"), b"S": b"INT", b"T": b"INT"}
_REALS = {
    b"LDAT": (b"VEL", b"ACC", b"APO_DIST", b"APO_FAC"),
    b"PDAT": (b"VEL", b"ACC", b"APO_DIST", b"GEAR_JERK"),
    b"CP": (b"CP", b"ORI1", b"ORI2"),
    b"APO": (b"CPTP", b"CDIS", b"CORI", b"CVEL"),
}
PREDEFINED: Structures = MappingProxyType(
    dict.fromkeys(POINT_TYPES, _POINT)
    | {name: dict.fromkeys(components, b"REAL") for name, components in _REALS.items()}
    | {
        b"FDAT": {b"TOOL_NO": b"INT", b"BASE_NO": b"INT"},
        b"LOAD": {b"M": b"REAL", b"CM": b"FRAME", b"J": b"FRAME"},
    }
)


def structures_of(
    own: Iterable[Document], others: Iterable[Document] = (), known: Structures = PREDEFINED
) -> Structures:
    """What STRUC declares in a module's files (``own``), and for all modules in ``others``: there GLOBAL, or in
    $config.dat.  Of one that is declared in two ways no component is known."""
    shared: dict[bytes, Mapping[bytes, bytes]] = {}
    for document in others:
        everything = "config" in document.path.stem.lower()
        for name, is_global, components in _declared_in(document.raw):
            if is_global or everything:
                _add(shared, name, components)
    found: dict[bytes, Mapping[bytes, bytes]] = {}
    for document in own:
        for name, _, components in _declared_in(document.raw):
            _add(found, name, components)
    return {**known, **shared, **found}


def _add(found: dict[bytes, Mapping[bytes, bytes]], name: bytes, components: Mapping[bytes, bytes]) -> None:
    if found.setdefault(name, components) != components:
        found[name] = {}


def _declared_in(raw: bytes) -> Iterator[tuple[bytes, bool, dict[bytes, bytes]]]:
    """Name of each structure, whether it is GLOBAL, and its components."""
    for found in matches(_STRUC, raw, (b"STRUC",), LONGEST):
        components: dict[bytes, bytes] = {}
        kind = b""
        for part in _SIZES.sub(b"", found[3]).upper().split(b","):
            *before, name = part.split() or [b""]
            kind = before[0] if before else kind
            components[name] = kind
        yield found[2].upper(), b"GLOBAL" in found[1].upper(), components


def component_type(kind: bytes, path: bytes, structures: Structures) -> bytes:
    """The type of what ``path`` (b"[2].P.X") names in a variable of the type ``kind``; b"" where it is not known."""
    for part in path.split(b".")[1:]:
        kind = structures.get(kind, {}).get(part.partition(b"[")[0], b"")
    return kind


def of_type(value: Value, kind: bytes, name: bytes) -> Value:
    """The value as what is called ``name`` holds it; a number is no BOOL, and a BOOL no number."""
    if not isinstance(value, (int, float)) or kind not in (b"INT", b"REAL", b"BOOL"):
        return value
    if isinstance(value, bool) != (kind == b"BOOL"):
        return UnknownValue(
            "KRL002", f"{shown(name)} has the type {shown(kind)} and gets a value of another type"
        )
    if kind == b"INT":
        if (halves := round(2.0 * value)) % 2 and decided_by_digits(2.0 * value, float(halves)):
            why = f"{shown(name)} is a whole number, and the last digits of a REAL decide which one"
            return UnknownValue("KRL002", why)
        return int(value + 0.5) if value >= 0 else -int(0.5 - value)
    return float(value) if kind == b"REAL" else value


def of_component(value: Value, kind: bytes, name: bytes) -> Value:
    """The same of a component, whose type b"" is not known: an INT would round a number, and divide otherwise."""
    if kind or not is_number(value):
        return of_type(value, kind, name)
    if value == int(value):
        return UntypedNumber(value)
    why = f"the type of {shown(name)} is not declared in the files that are read: an INT is rounded"
    return UnknownValue("KRL002", why)
