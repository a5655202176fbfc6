"""A motion statement taken apart, and what its operands say."""

from __future__ import annotations

import re
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

from postproc.languages.krl.execution_context import ExecutionContext
from postproc.languages.krl.expressions import index_text
from postproc.languages.krl.lexing import NAME, cached, identifiers
from postproc.languages.krl.source_map import PointVariable
from postproc.languages.krl.statement_effects import HERE, READS_POSITION
from postproc.languages.krl.target import KrlTarget, UnknownValue, parse, plain, shown

_NAMED = re.compile(
    rb"(" + NAME + rb")[ \t]*(?:\[((?:[^\[\]]|\[[^\[\]]*\])*)\])?((?:[ \t]*\.[ \t]*" + NAME + rb")*)[ \t]*"
)
_MARK = re.compile(
    rb'"[^"]*"?|[{}()\[\],]|#[ \t]*[A-Za-z_]+'
    rb"|(?<![A-Za-z0-9_$.])(?:C_(?:DIS|VEL|ORI|PTP|SPL)|WITH)(?![A-Za-z0-9_$])",
    re.I,
)
_LAST_SLUR = re.compile(rb"[ \t,]C_(DIS|VEL|ORI|PTP|SPL)[ \t]*\Z", re.I)
_SLUR = rb"[ \t]*+C_(?:DIS|VEL|ORI|PTP|SPL)(?![A-Za-z0-9_$])"
_POINT = rb"[ \t]*+(\{[^{}()\[\]\"]*+\}|(?!WITH(?![A-Za-z0-9_$])|" + _SLUR + rb")[A-Za-z_$][A-Za-z0-9_$]*+)"
_COMMON = re.compile(_POINT + rb"(?:[ \t]*+," + _POINT + rb")?+((?:" + _SLUR + rb")*+)[ \t]*+\Z", re.I)
"""One or two targets without brackets of their own, and approximations: most of the motions."""
_HOME = re.compile(rb"X?HOME[1-5]?\Z")


class Parts(NamedTuple):
    """A motion statement taken apart; offsets in its code.  points: start and end of what is between commas;
    approximations: approximation words; reference: start and end of #BASE or #TOOL; clause: WITH and what follows; odd:
    what has no meaning there."""

    points: tuple[tuple[int, int], ...]
    approximations: tuple[bytes, ...]
    reference: tuple[int, int] | None = None
    clause: bytes = b""
    not_understood: bytes = b""


class Operand(NamedTuple):
    """One target as it is written: what it says, where it is in document 0, and the variable that holds it.

    builds: it may leave components to the point before, but what it says is not known.
    """

    target: KrlTarget | UnknownValue
    start: int
    stop: int
    variable: PointVariable | None = None
    builds: bool = False


@lru_cache(maxsize=4096)
def take_apart(code: bytes, start: int) -> Parts:
    """The parts of a motion statement, whose word ends at ``start``."""
    if common := _COMMON.match(code, start):
        places = (common.span(1),) if common[2] is None else (common.span(1), common.span(2))
        return Parts(places, tuple(common[3].upper().split()))
    points: list[tuple[int, int]] = []
    approximations: list[bytes] = []
    reference: tuple[int, int] | None = None
    clause = odd = b""
    is_open, at = True, start  # whether a point is open, and after what
    depth = 0
    for mark in chain(_MARK.finditer(code, start), (None,)):
        token = b"" if mark is None else mark[0]
        if mark is None:
            pass
        elif token in b"{([":
            depth += 1
            continue
        elif token in b"})]":
            depth -= 1
            continue
        elif depth > 0 or token.startswith(b'"'):
            continue
        text = code[at : len(code) if mark is None else mark.start()]
        inner = text.strip(b" \t")
        if inner and is_open:
            left = at + text.find(inner)
            points.append((left, left + len(inner)))
        elif inner:
            odd = odd or inner
        elif is_open and (at != start or token == b","):
            odd = odd or b","
        if mark is None:
            break
        is_open, at = token == b",", mark.end()
        if token.startswith(b"#"):
            odd = odd or (b"" if reference is None else token)
            reference = mark.span()
        elif token.upper() == b"WITH":
            clause = code[at:]
            found = _LAST_SLUR.search(clause)
            if found:
                approximations.append(b"C_" + found[1].upper())
                clause = clause[: found.start()]
            odd = odd or (b"" if clause.strip() else token)
            break
        elif token != b",":
            approximations.append(token.upper())
    return Parts(tuple(points), tuple(approximations), reference, clause, odd)


def operand_at(run: ExecutionContext, code: bytes, at: int, place: tuple[int, int]) -> Operand:
    """The target that is at ``place`` of the code, which starts at byte ``at``."""
    start, stop = place
    start_at, end = at + start, at + stop
    text = code[start:stop]
    if text.startswith(b"{"):
        if (literal := plain(run.document.raw, start_at, end, 0)) is not None:
            return Operand(literal, start_at, end)
        close = text.find(b"}")
        if close == len(text) - 1 and b"{" not in text[1:]:
            if b'"' in text:
                return Operand(UnknownValue("KRL001", "its braces do not match"), start_at, end, None, True)
            target = parse(text, start_at, 0, run.value)
            if isinstance(target, UnknownValue) or -1 in target.start:
                run.mentioned |= identifiers(text)
            return Operand(target, start_at, end, None, isinstance(target, UnknownValue))
        if close < 0 or b"{" in text[1:close]:
            return Operand(UnknownValue("KRL001", "its braces do not match"), start_at, end, None, True)
        if text[close + 1 :].lstrip()[:1] not in (b":", b"+", b"-", b"*", b"/"):
            why = f"'{shown(text[close + 1 :])}' is not understood"
            return Operand(UnknownValue("KRL001", why), start_at, end, None, True)
        return _computed(run, text, start_at, end)
    named = _take_name(text)
    if named is None:
        if text.startswith(b"("):
            return _computed(run, text, start_at, end)
        return Operand(UnknownValue("KRL001", "it has no readable target"), start_at, end)
    rest = named.rest
    if rest[:1] in (b":", b"+", b"-", b"*", b"/", b"(", b"[", b"."):
        return _computed(run, text, start_at, end)
    if rest:
        why = f"'{shown(rest)}' is not understood; it is an inline form without its unfolded lines"
        return Operand(UnknownValue("KRL001", why), start_at, end)
    return _variable(run, named, start_at, end)


_CALLS = re.compile(rb"[A-Za-z0-9_$][ \t]*+\(")
"""A function, which may return a point that omits components."""


class _OperandName(NamedTuple):
    """A variable that is named as a target: its name and components (upper case), what is in its brackets, its words in
    a message, and what follows."""

    name: bytes
    element: bytes | None
    path: bytes
    words: str
    rest: bytes


@cached
def _take_name(text: bytes) -> _OperandName | None:
    found = _NAMED.match(text)
    if found is None:
        return None
    path = found[3].replace(b" ", b"").replace(b"\t", b"").upper()
    return _OperandName(found[1].upper(), found[2], path, shown(found[0]), text[found.end() :])


def _variable(run: ExecutionContext, named: _OperandName, start: int, end: int) -> Operand:
    name, element, path, words, _ = named
    if element is not None:
        run.mentioned |= identifiers(element)
        indices = index_text(element, run.lookup)
        if indices is None:
            run.mentioned.add(name)
            return Operand(
                UnknownValue("KRL002", f"its target {words} has an index that is not a constant"), start, end
            )
        path = b"[" + indices + b"]" + path
    has = run.variables.get(name, path)
    value = run.resolve(name, path, has)
    if isinstance(value, UnknownValue) or (isinstance(value, KrlTarget) and value.unknown is not None):
        run.mentioned.add(name)  # whatever it may be stays what it is
    line = run.declarations.lines.get(name + path)
    if run.routine is not None and name in run.routine.types:
        line = None
    variable = PointVariable(name + path, run.type_of(name) if b"." not in path else b"", line, b"")
    if isinstance(value, KrlTarget):
        if value.unknown is not None:
            return Operand(
                UnknownValue(value.unknown.code, f"point {words}: {value.unknown.message}"),
                start,
                end,
                variable,
            )
        return Operand(value, start, end, variable._replace(words=value.words))
    if isinstance(value, UnknownValue) and has is not None:
        return Operand(
            UnknownValue(value.code, f"point {words}: {value.message}"), start, end, variable, True
        )
    if name in HERE or name.startswith(b"$"):
        reads = READS_POSITION.match(name) is not None
        why = UnknownValue("KRL002", f"its target {words} is a variable of the controller")
        return Operand(why, start, end, variable, reads)
    if isinstance(value, UnknownValue):
        return Operand(_no_point(f"point {words} has no value yet"), start, end, variable)
    if value is not None:
        return Operand(UnknownValue("KRL001", f"{words} is not a point"), start, end)
    if _HOME.match(name) and not path:
        why = UnknownValue("KRL016", f"{words} is a point of the controller; the motion is not corrected")
        return Operand(why, start, end, variable)
    return Operand(_no_point(f"point {words} is not declared"), start, end, variable)


@lru_cache(maxsize=1024)
def _no_point(message: str) -> UnknownValue:
    return UnknownValue("KRL003", message)


def _computed(run: ExecutionContext, text: bytes, start: int, end: int) -> Operand:
    """An expression as a target."""
    run.mentioned |= identifiers(text)
    value = run.value(text)
    reads = READS_POSITION.search(text) is not None
    if isinstance(value, KrlTarget):
        value = value.detached()
        if value.unknown is None:
            return Operand(value, start, end, PointVariable(b"", b"", None, value.words))
        value = value.unknown
    why = value.message if isinstance(value, UnknownValue) else f"'{shown(text)}' is not a point"
    code = value.code if isinstance(value, UnknownValue) else "KRL002"
    return Operand(
        UnknownValue(code, f"its target is computed: {why}"), start, end, None,
        reads or text.startswith(b"{") or _CALLS.search(text) is not None,
    )  # fmt: skip
