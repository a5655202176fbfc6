"""What the module's .dat, and files like $config.dat, declare: points, constants and motion records."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from postproc.base.document import Document, Span
from postproc.languages.krl.expressions import Value, evaluate
from postproc.languages.krl.lexing import (
    FRAME_TABLES,
    POINT_TYPES,
    RECORD_TYPES,
    SCALARS,
    Assignment,
    Declared,
    identifiers,
    lines,
    statement,
)
from postproc.languages.krl.target import (
    AXES,
    COMPONENTS,
    EXTERNAL,
    NAN,
    KrlTarget,
    UnknownValue,
    fields,
    parse,
)
from postproc.languages.krl.variables import Entry

_DEFAULTS = b"DEF_"
"""Begin of the names that KUKA's bas.src takes its defaults from; other numbers of other files may change."""

_POINT_KEYS = frozenset([*COMPONENTS, *AXES, *EXTERNAL, b"S", b"T"])


@dataclass
class Declarations:
    """By name, upper case.

    values: points and constants; records: FDAT, LDAT, PDAT (key -> value); types: as they are declared; lines: name of
    a point with its index -> its declaration's line, where another one can be behind; shared: names that other
    programs know too.
    """

    values: dict[bytes, Entry] = field(default_factory=dict)
    records: dict[bytes, dict[bytes, bytes]] = field(default_factory=dict)
    types: dict[bytes, bytes] = field(default_factory=dict)
    lines: dict[bytes, Span] = field(default_factory=dict)
    declared: set[bytes] = field(default_factory=set)
    shared: set[bytes] = field(default_factory=set)


def read_data(result: Declarations, document: Document, file: int) -> None:
    """Adds the declarations of a file; ``file`` is -1 for one that is never written: of that what is GLOBAL counts, and
    in $config.dat everything."""
    foreign = file < 0
    everything = not foreign or "config" in document.path.stem.lower()
    for line, start, stop in lines(document):
        found = statement(document.raw, line, start, stop)
        if found is None or (found.kind != "declaration" and found.kind != "assignment"):
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
                root = key.split(b"[")[0]
                if root in FRAME_TABLES:
                    continue
                if result.types.get(root) in RECORD_TYPES:
                    result.records[key] = fields(said.value)
                elif result.types.get(root, b"FRAME") in POINT_TYPES:
                    _add(result, key, read_point(said.value.rstrip(), said.at, file, line), span, foreign)
            elif key is not None and not foreign and result.types.get(key.split(b"[")[0]) in SCALARS:
                _add(result, key, _constant(said.value.rstrip()), span, foreign)


def _declare(
    result: Declarations, said: Declared, key: bytes, value: bytes, at: int, line: int, span: Span, foreign: bool
) -> None:  # fmt: skip
    root = key.split(b"[")[0]
    if not (foreign and root in result.types):
        result.types[root] = said.type
    if said.is_global or foreign:
        result.shared.add(root)
    if root in FRAME_TABLES:
        return
    if said.type in RECORD_TYPES:
        if value.startswith(b"{") and not (foreign and key in result.records):
            result.records[key] = fields(value)
    elif said.type in POINT_TYPES:
        if value:
            point = read_point(value, at, span.file, line)
            if isinstance(point, KrlTarget) and (said.is_global or foreign):
                point = replace(point, locked="it is GLOBAL, other programs may use it")
            _add(result, key, point, span, foreign)
    elif value.startswith(b"{") and identifiers(value):
        _members(result, root, key[len(root) :], value, line)
    elif value and said.type in SCALARS and (root.startswith(_DEFAULTS) if foreign else not said.is_global):
        _add(result, key, _constant(value), span, foreign)


def _members(result: Declarations, root: bytes, path: bytes, value: bytes, line: int, depth: int = 0) -> None:
    """Takes up the points and numbers in a structure of the user's own, without their places."""
    if depth > 4:
        return
    for key, text in fields(value).items():
        name = path + b"." + key
        if not (text.startswith(b"{") and text.endswith(b"}")):
            constant = _constant(text)
            if not isinstance(constant, UnknownValue):
                result.values.setdefault(root, {}).setdefault(name, constant)
        elif b"{" not in text[1:] and identifiers(text) <= _POINT_KEYS:
            point = read_point(text, 0, -1, line)
            if isinstance(point, KrlTarget):
                point = replace(point, locked="")
            result.values.setdefault(root, {}).setdefault(name, point)
        else:
            _members(result, root, name, text, line, depth + 1)


def _constant(text: bytes) -> Value:
    return evaluate(text, lambda name, path: None)


def _add(result: Declarations, key: bytes, value: Value, span: Span, foreign: bool) -> None:
    root = key.split(b"[")[0]
    if key in result.declared:
        if foreign:
            return  # the module's own goes before
        value = UnknownValue("KRL019", f"{key.decode('latin-1')} is declared twice in the .dat")
    elif not foreign:
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
        return replace(target.detached(), locked="it is in a file that is not written")
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
        changing[root] = {path: _kept(value, components[root]) for path, value in entry.items()}
    return fixed, changing


def _kept(value: Value, assigned: set[bytes]) -> Value:
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
            value = replace(changed, unknown=why)
    return value
