"""What the module's .dat, and files like $config.dat, declare: points, constants and motion records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Set
from dataclasses import dataclass, field
from typing import NamedTuple

from postproc.base.document import Document, Span
from postproc.languages.krl.expressions import UntypedNumber, Value, evaluate
from postproc.languages.krl.lexing import (
    FRAME_TABLES,
    POINT_TYPES,
    RECORD_TYPES,
    SCALARS,
    Assignment,
    Declared,
    StatementKind,
    identifiers,
    lines,
    statement,
)
from postproc.languages.krl.spatial import Numbers
from postproc.languages.krl.target import (
    AXES,
    COMPONENTS,
    EXTERNAL,
    NAN,
    KrlTarget,
    UnknownValue,
    fields,
    parse,
    shown,
)
from postproc.languages.krl.value_types import (
    PREDEFINED,
    Structures,
    component_type,
    of_component,
    of_type,
    structures_of,
)
from postproc.languages.krl.variables import Entry
from postproc.toolpath.initial_state import Symbol

DEFAULTS = b"DEF_"
"""Start of the names that KUKA's bas.src takes its defaults from; other numbers of other files may change."""

_POINT_KEYS = frozenset([*COMPONENTS, *AXES, *EXTERNAL, b"S", b"T"])


@dataclass
class Declarations:
    """By name, upper case.

    values: points and constants; records: FDAT, LDAT, PDAT (key -> value); types: as they are declared; lines: name of
    a point with its index -> its declaration's line, where another one can be after; shared: names that other
    programs know too; origin: what only another file declares -> that file; frames: entries of
    BASE_DATA and TOOL_DATA in the controller's own files -> X..C [mm, deg], and the file; loads: number of a tool ->
    mass [kg] and centre [m] there; structures: the types of their components.
    """

    values: dict[bytes, Entry] = field(default_factory=dict)
    records: dict[bytes, dict[bytes, bytes]] = field(default_factory=dict)
    types: dict[bytes, bytes] = field(default_factory=dict)
    lines: dict[bytes, Span] = field(default_factory=dict)
    declared: set[bytes] = field(default_factory=set)
    shared: set[bytes] = field(default_factory=set)
    origin: dict[bytes, str] = field(default_factory=dict)
    frames: dict[str, tuple[Numbers, str]] = field(default_factory=dict)
    loads: dict[int, tuple[float, float, float, float]] = field(default_factory=dict)
    structures: Structures = field(default_factory=lambda: PREDEFINED)


def read_references(result: Declarations, documents: Iterable[Document]) -> None:
    """Adds what other files declare for all programs; what two of them declare differently is not known."""
    own = frozenset([*result.types, *map(_root, result.records)])
    found: dict[bytes, _Declaration] = {}
    for document in documents:
        one = Declarations(structures=structures_of([document], known=result.structures))
        read_data(one, document, -1)
        for root, declaration in _by_root(one, document.path.name).items():
            before = found.setdefault(root, declaration)
            if before[:3] != declaration[:3]:
                why = f"{shown(root)} is declared differently in {before.file} and {declaration.file}"
                unknown: Entry = {b"": UnknownValue("KRL019", why)}
                found[root] = before._replace(values=unknown, records={})
    for root, (kind, values, records, file) in found.items():
        if root in own:
            continue  # the module's own goes before
        result.origin[root] = file
        result.shared.add(root)
        if kind:
            result.types[root] = kind
        if values:
            result.values[root] = values
            result.declared |= {root + path for path in values}
        result.records |= records


class _Declaration(NamedTuple):
    """What a file declares of one name."""

    kind: bytes
    values: Entry
    records: dict[bytes, dict[bytes, bytes]]
    file: str


def _by_root(one: Declarations, file: str) -> dict[bytes, _Declaration]:
    records: dict[bytes, dict[bytes, dict[bytes, bytes]]] = {}
    for key, record in one.records.items():
        records.setdefault(_root(key), {})[key] = record
    roots = dict.fromkeys([*one.types, *one.values, *records])
    return {
        root: _Declaration(one.types.get(root, b""), one.values.get(root, {}), records.get(root, {}), file)
        for root in roots
    }


def _root(key: bytes) -> bytes:
    return key.split(b"[")[0]


def read_data(result: Declarations, document: Document, file: int) -> None:
    """Adds the declarations of a file; ``file`` is -1 for one that is never written: of that what is GLOBAL counts, and
    in $config.dat everything."""
    foreign = file < 0
    everything = not foreign or "config" in document.path.stem.lower()
    for line, start, stop in lines(document):
        found = statement(document.raw, line, start, stop)
        if found is None or (
            found.kind != StatementKind.DECLARATION and found.kind != StatementKind.ASSIGNMENT
        ):
            continue
        span = Span(file, start, start + len(document.raw[start:stop].rstrip(b"\r\n")))
        said = found.strings
        if isinstance(said, Declared):
            if not (everything or said.is_global):
                continue
            for key, value, at in said.items:
                if key is not None:
                    _declare(result, said, key, value, at, line, span, foreign)
        elif isinstance(said, Assignment) and not said.path and everything:
            key = said.key
            if key is not None and said.value.startswith(b"{"):
                root = _root(key)
                if root in FRAME_TABLES:
                    continue
                if result.types.get(root) in RECORD_TYPES:
                    result.records[key] = fields(said.value)
                elif result.types.get(root, b"FRAME") in POINT_TYPES:
                    _add(result, key, read_point(said.value.rstrip(), said.at, file, line), span, foreign)
            elif key is not None and not foreign and result.types.get(_root(key)) in SCALARS:
                _add(
                    result, key, _constant(said.value.rstrip(), result.types[_root(key)], key), span, foreign
                )


def _declare(
    result: Declarations, declaration: Declared, key: bytes, value: bytes, at: int, line: int, span: Span,
    in_other_file: bool,
) -> None:  # fmt: skip
    root = _root(key)
    kind = result.types[root] = declaration.type
    if declaration.is_global or in_other_file:
        result.shared.add(root)
    if root in FRAME_TABLES:
        return
    if declaration.type in RECORD_TYPES:
        if value.startswith(b"{"):
            result.records[key] = fields(value)
    elif declaration.type in POINT_TYPES:
        if value:
            point = read_point(value, at, span.file, line)
            if isinstance(point, KrlTarget) and (declaration.is_global or in_other_file):
                point = point._replace(locked="it is GLOBAL, other programs may use it")
            _add(result, key, point, span, in_other_file)
    elif value.startswith(b"{") and identifiers(value):
        _members(result, root, key[len(root) :], value, line)
    elif (
        value
        and declaration.type in SCALARS
        and (declaration.is_constant or _keeps_number(root, declaration, in_other_file))
    ):
        _add(result, key, _constant(value, kind, key), span, in_other_file)


def _keeps_number(root: bytes, declaration: Declared, in_other_file: bool) -> bool:
    """Whether nothing outside of the module assigns a number."""
    return root.startswith(DEFAULTS) if in_other_file else not declaration.is_global


def _members(result: Declarations, root: bytes, path: bytes, value: bytes, line: int, depth: int = 0) -> None:
    """Takes up the points and numbers in a structure of the user's own, without their places."""
    if depth > 4:
        return
    for key, text in fields(value).items():
        name = path + b"." + key
        kind = component_type(result.types[root], name, result.structures)
        if not (text.startswith(b"{") and text.endswith(b"}")):
            constant = of_component(evaluate(text, _no_variable), kind, root + name)
            if not isinstance(constant, UnknownValue):
                result.values.setdefault(root, {}).setdefault(name, constant)
        elif (not kind or kind in POINT_TYPES) and b"{" not in text[1:] and identifiers(text) <= _POINT_KEYS:
            point = read_point(text, 0, -1, line)
            if isinstance(point, KrlTarget):
                point = point._replace(locked="")
            result.values.setdefault(root, {}).setdefault(name, point)
        else:
            _members(result, root, name, text, line, depth + 1)


def _no_variable(name: bytes, path: bytes) -> None:
    """Nothing: constants are made of digits alone."""


def _constant(text: bytes, kind: bytes, name: bytes) -> Value:
    return of_type(evaluate(text, _no_variable), kind, name)


def _add(result: Declarations, key: bytes, value: Value, span: Span, in_other_file: bool) -> None:
    root = _root(key)
    if key in result.declared:
        if in_other_file and result.values[root].get(key[len(root) :]) == value:
            return
        value = UnknownValue("KRL019", f"{key.decode('latin-1')} is declared twice in the .dat")
    elif not in_other_file:
        result.lines[key] = span
    result.declared.add(key)
    result.values.setdefault(root, {})[key[len(root) :]] = value


def read_point(value: bytes, at: int, file: int, line: int) -> KrlTarget | UnknownValue:
    """The point of an aggregate ``value`` that is at byte ``at`` of document ``file``."""
    where = f"its declaration in line {line} of the .dat"
    if not (value.startswith(b"{") and value.endswith(b"}") and value.count(b"{") == 1):
        return UnknownValue("KRL019", f"{where} is not an aggregate of numbers")
    target = parse(value, at, file)
    if isinstance(target, UnknownValue):
        return UnknownValue("KRL019", f"{where}: {target.message}")
    if file < 0:
        return target.detached()._replace(locked="it is in a file that is not written")
    return target


def at_the_start(
    declarations: Declarations, assigned: set[bytes]
) -> tuple[dict[bytes, Entry], dict[bytes, Entry]]:
    """What holds when the program starts: of names that it never assigns, and of those that it assigns.

    Of the latter the .dat keeps what the last run left; only components that are never assigned are what they say.
    """
    fixed: dict[bytes, Entry] = {}
    changing: dict[bytes, Entry] = {}
    components: dict[bytes, set[bytes]] = {}
    for name in assigned:
        root, dot, path = name.partition(b".")
        components.setdefault(root, set()).add(path if dot else b"")
    for root, entry in declarations.values.items():
        if root not in components:
            fixed[root] = entry
            continue
        changing[root] = {path: _preserved(value, components[root]) for path, value in entry.items()}
    return fixed, changing


def _preserved(value: Value, assigned: set[bytes]) -> Value:
    why = UnknownValue("KRL002", "the program does not preserve its value in the .dat")
    if (
        not isinstance(value, KrlTarget)
        or not assigned.isdisjoint([b""])
        or any(b"." in path for path in assigned)
    ):
        return why
    for key in assigned:
        if key in COMPONENTS or key.startswith(b"A"):
            changed = value.changed(key, NAN, why, (-1, -1, -1), b"")
            if isinstance(changed, UnknownValue):
                return changed
            value = changed._replace(unknown=why)
    return value


def bind_symbols(declarations: Declarations, symbols: Mapping[str, Symbol], own: Set[bytes]) -> None:
    """Gives names the values that the cell states, but those that the module itself declares (``own``)."""
    for name, symbol in symbols.items():
        key = name.upper().replace(" ", "").encode("latin-1", "replace")
        root = key.split(b"[")[0]
        if key in own:
            continue
        declarations.records.pop(key, None)
        if isinstance(symbol, Mapping):
            fields = {part.upper().encode("latin-1", "replace"): value for part, value in symbol.items()}
            if not fields.keys() <= _POINT_KEYS:
                declarations.records[key] = {part: _literal(value) for part, value in fields.items()}
                continue
            text = b",".join(part + b" " + _literal(value) for part, value in fields.items())
            value: Value = parse(b"{" + text + b"}", 0, -1)
            if isinstance(value, KrlTarget):
                value = value.detached()._replace(locked="its value is known to the controller only")
        elif (kind := declarations.types.get(root)) in (b"INT", b"REAL"):
            value = of_type(symbol, kind, key)
        else:
            value = UntypedNumber(symbol)
        declarations.declared.add(key)
        declarations.shared.add(root)
        declarations.values.setdefault(root, {})[key[len(root) :]] = value


def _literal(value: float) -> bytes:
    return b"%d" % value if value == int(value) else repr(value).encode()
