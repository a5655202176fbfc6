"""A motion statement taken apart, and what its operands say."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import chain

from postproc.dialects.krl.effects import HERE, READS_POSITION
from postproc.dialects.krl.expressions import index_text
from postproc.dialects.krl.lexing import NAME, identifiers
from postproc.dialects.krl.places import Variable
from postproc.dialects.krl.run import Run
from postproc.dialects.krl.target import Target, Unclear, parse, shown

_NAMED = re.compile(
    rb"(" + NAME + rb")[ \t]*(?:\[((?:[^\[\]]|\[[^\[\]]*\])*)\])?((?:[ \t]*\.[ \t]*" + NAME + rb")*)[ \t]*"
)
_MARK = re.compile(
    rb'"[^"]*"?|[{}()\[\],]|#[ \t]*[A-Za-z_]+'
    rb"|(?<![A-Za-z0-9_$.])(?:C_(?:DIS|VEL|ORI|PTP|SPL)|WITH)(?![A-Za-z0-9_$])",
    re.I,
)
_LAST_SLUR = re.compile(rb"[ \t,]C_(DIS|VEL|ORI|PTP|SPL)[ \t]*\Z", re.I)
_HOME = re.compile(rb"X?HOME[1-5]?\Z")


@dataclass(frozen=True, slots=True)
class Parts:
    """A motion statement taken apart; offsets in its code.  points: begin and end of what stands between commas; slurs:
    approximation words; reference: begin and end of #BASE or #TOOL; clause: WITH and what follows; odd: what has no
    meaning there."""

    points: tuple[tuple[int, int], ...]
    slurs: tuple[bytes, ...]
    reference: tuple[int, int] | None = None
    clause: bytes = b""
    odd: bytes = b""


@dataclass(frozen=True, slots=True)
class Operand:
    """One target as it is written: what it says, where it stands in document 0, and the variable that holds it.

    builds: it may leave components to the point before, but what it says is not known.
    """

    target: Target | Unclear
    start: int
    stop: int
    variable: Variable | None = None
    builds: bool = False


@lru_cache(maxsize=4096)
def take_apart(code: bytes, begin: int) -> Parts:
    """The parts of a motion statement, whose word ends at ``begin``."""
    points: list[tuple[int, int]] = []
    slurs: list[bytes] = []
    reference: tuple[int, int] | None = None
    clause = odd = b""
    is_open, at = True, begin  # whether a point is open, and behind what
    depth = 0
    for mark in chain(_MARK.finditer(code, begin), (None,)):
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
        if mark is None:
            break
        is_open, at = token == b",", mark.end()
        if token.startswith(b"#"):
            reference = mark.span()
        elif token.upper() == b"WITH":
            clause = code[at:]
            found = _LAST_SLUR.search(clause)
            if found:
                slurs.append(b"C_" + found[1].upper())
                clause = clause[: found.start()]
            break
        elif token != b",":
            slurs.append(token.upper())
    return Parts(tuple(points), tuple(slurs), reference, clause, odd)


def operand_at(run: Run, code: bytes, at: int, place: tuple[int, int]) -> Operand:
    """The target that stands at ``place`` of the code, which begins at byte ``at``."""
    start, stop = place
    text = code[start:stop]
    begin, end = at + start, at + stop
    if text.startswith(b"{"):
        close = text.find(b"}")
        if close == len(text) - 1 and b"{" not in text[1:]:
            if b'"' in text:
                return Operand(Unclear("KRL001", "its braces do not close"), begin, end, None, True)
            target = parse(text, begin, 0, run.value)
            if isinstance(target, Unclear) or -1 in target.start:
                run.mentioned |= identifiers(text)
            return Operand(target, begin, end, None, isinstance(target, Unclear))
        if close < 0 or b"{" in text[1:close]:
            return Operand(Unclear("KRL001", "its braces do not close"), begin, end, None, True)
        if text[close + 1 :].lstrip()[:1] not in (b":", b"+", b"-", b"*", b"/"):
            why = f"'{shown(text[close + 1 :])}' is not understood"
            return Operand(Unclear("KRL001", why), begin, end, None, True)
        return _computed(run, text, begin, end)
    found = _NAMED.match(text)
    if found is None:
        if text.startswith(b"("):
            return _computed(run, text, begin, end)
        return Operand(Unclear("KRL001", "it has no target that can be read"), begin, end)
    rest = text[found.end() :]
    if rest[:1] in (b":", b"+", b"-", b"*", b"/", b"(", b"[", b"."):
        return _computed(run, text, begin, end)
    if rest:
        why = f"'{shown(rest)}' is not understood; an inline form without the lines that it unfolds to"
        return Operand(Unclear("KRL001", why), begin, end)
    return _variable(run, found, begin, end)


def _variable(run: Run, found: re.Match[bytes], begin: int, end: int) -> Operand:
    name = found[1].upper()
    words = shown(found[0])
    path = found[3].replace(b" ", b"").replace(b"\t", b"").upper()
    if found[2] is not None:
        run.mentioned |= identifiers(found[2])
        indices = index_text(found[2], run.lookup)
        if indices is None:
            run.mentioned.add(name)
            return Operand(
                Unclear("KRL002", f"its target {words} has an index that is not a constant"), begin, end
            )
        path = b"[" + indices + b"]" + path
    value = run.lookup(name, path)
    line = run.declarations.lines.get(name + path)
    has = run.variables.get(name, path)
    if run.routine is not None and name in run.routine.types:
        line = None
    variable = Variable(name + path, run.type_of(name) if b"." not in path else b"", line, b"")
    if isinstance(value, Target):
        if value.lost is not None:
            return Operand(
                Unclear(value.lost.code, f"point {words}: {value.lost.message}"), begin, end, variable
            )
        return Operand(value, begin, end, replace(variable, words=value.words))
    if isinstance(value, Unclear) and has is not None:
        return Operand(Unclear(value.code, f"point {words}: {value.message}"), begin, end, variable, True)
    if name in HERE or name.startswith(b"$"):
        reads = READS_POSITION.match(name) is not None
        why = Unclear("KRL002", f"its target {words} is a variable of the controller")
        return Operand(why, begin, end, variable, reads)
    if isinstance(value, Unclear):
        return Operand(Unclear("KRL003", f"point {words} has no value yet"), begin, end, variable)
    if value is not None:
        return Operand(Unclear("KRL001", f"{words} is no point"), begin, end)
    if _HOME.match(name) and not path:
        why = Unclear("KRL016", f"{words} is a point of the controller; the motion stays as it is")
        return Operand(why, begin, end, variable)
    return Operand(Unclear("KRL003", f"point {words} is not declared"), begin, end, variable)


def _computed(run: Run, text: bytes, begin: int, end: int) -> Operand:
    """An expression as a target."""
    run.mentioned |= identifiers(text)
    value = run.value(text)
    reads = READS_POSITION.search(text) is not None
    if isinstance(value, Target):
        value = value.detached()
        if value.lost is None:
            return Operand(value, begin, end, Variable(b"", b"", None, value.words))
        value = value.lost
    why = value.message if isinstance(value, Unclear) else f"'{shown(text)}' is no point"
    code = value.code if isinstance(value, Unclear) else "KRL002"
    return Operand(
        Unclear(code, f"its target is computed: {why}"), begin, end, None, reads or text.startswith(b"{")
    )
