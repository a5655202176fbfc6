"""Whether every word of a statement has its place in it; motions are taken apart elsewhere."""

from __future__ import annotations

import re

from postproc.languages.krl.expressions import TOKEN
from postproc.languages.krl.lexing import (
    BRANCHES,
    CLOSES,
    DECLARED,
    LONGEST,
    MOTIONS,
    NAME,
    OPENS,
    SPLINES,
    SYSTEM_WORDS,
    Assignment,
    Call,
    Declared,
    Statement,
    StatementKind,
    assignment,
    cached,
    split_values,
)

ALONE = frozenset(b"HALT CONTINUE RESUME LOOP REPEAT ELSE DEFAULT EXIT END ENDFCT".split())
"""Statements of one word, besides those that end a block."""
LOOSE = frozenset(
    b"EXT EXTFCT EXTP IMPORT SIGNAL ENUM STRUC ANOUT ANIN DIGIN INI ASYPTP ASYCONT ASYSTOP ASYCANCEL "
    b"DEFDAT ENDDAT CONST BRAKE TIME_BLOCK".split()
)
"""Statements whose words do not state the motions of a program, or are looked at elsewhere."""

_PLAIN = re.compile(rb"[ \t]*+(?:#[ \t]*+)?+(?:" + NAME + rb"|[-+]?\d{1,15}+(?:\.\d{0,15}+)?+)[ \t]*+\Z")
_FIELD = re.compile(rb"[ \t]*+" + NAME + rb"(?:[ \t]*+\[[^\[\]]*+\])?+(?=[ \t'\"#{+-])")
_TYPE = re.compile(rb"[ \t]*+" + NAME + rb"[ \t]*+:")
_DECLARATION = re.compile(rb"[ \t]*+(" + NAME + rb")[ \t]*+(?:\[([^\[\]]*+)\][ \t]*+)?+(?:=(.*))?+\Z", re.S)
_RESERVED = (
    MOTIONS
    | OPENS
    | CLOSES.keys()
    | BRANCHES.keys()
    | SYSTEM_WORDS
    | ALONE
    | {b"GOTO", b"RETURN", b"THEN", b"DECL"}
) - {b"INI", b"SIGNAL"}
_SIGNS = frozenset([b"+", b"-", b"NOT", b"B_NOT"])
_BINARY = frozenset(
    b"+ - * / : == <> < > <= >= AND OR EXOR B_AND B_OR B_EXOR".split()
)  # fmt: skip
_CLOSING = {b"(": b")", b"[": b"]"}
_NESTED = 5

_INNER = rb"[ \t]*+(.*\S)[ \t]*+"
_WORD = rb"(?<![A-Za-z0-9_$])%s(?![A-Za-z0-9_$])"
_PATTERNS: dict[bytes, re.Pattern[bytes]] = {
    word: re.compile(pattern + rb"\Z", re.I | re.S)
    for word, pattern in {
        b"IF": rb"IF" + _INNER + _WORD % b"THEN",
        b"WHILE": rb"WHILE" + _INNER,
        b"UNTIL": rb"UNTIL" + _INNER,
        b"SWITCH": rb"SWITCH" + _INNER,
        b"WAIT": rb"WAIT[ \t]++(?:SEC|FOR)\b" + _INNER,
        b"RETURN": rb"RETURN(?:" + _INNER + rb")?",
        b"ENDSPLINE": rb"ENDSPLINE(?:[ \t]++C_SPL)?+",
        b"GOTO": rb"GOTO[ \t]++" + NAME,
    }.items()
}
_FOR = re.compile(
    rb"FOR[ \t]++" + NAME + rb"[ \t]*+=(.*?)" + _WORD % b"TO" + rb"(.*?)(?:" + _WORD % b"STEP" + rb"(.*))?\Z",
    re.I | re.S,
)
_LATER = re.compile(
    rb"(?<![A-Za-z0-9_$])(WHEN(?![A-Za-z0-9_$])|DO(?![A-Za-z0-9_$])|DELAY[ \t]*+=|PRIO[ \t]*+=)", re.I
)
_PLACE = re.compile(rb"[ \t]*+(?:DISTANCE|PATH)[ \t]*+=", re.I)
_DECLARED = re.compile(rb"(?:GLOBAL[ \t]++)?+INTERRUPT[ \t]++DECL[ \t]", re.I)
_SWITCHED = re.compile(rb"INTERRUPT[ \t]++(?:ON|OFF|ENABLE|DISABLE)\b(.*)\Z", re.I | re.S)


def is_well_formed(statement: Statement) -> bool:
    """Whether every word of a statement that is no motion has a meaning at its place."""
    kind, code, said = statement.kind, statement.code, statement.strings
    if (
        kind
        in (
            StatementKind.MOTION,
            StatementKind.UNREADABLE,
            StatementKind.UMLAUT_NAME,
            StatementKind.COMMENT,
            StatementKind.LABEL,
            StatementKind.DEF,
        )
        or len(code) > LONGEST
    ):
        return True
    if isinstance(said, Assignment):
        return _assigns(said)
    if isinstance(said, Call):
        return _all_expressions(said.arguments)
    if isinstance(said, Declared):
        return _declares(code)
    return statement.word in LOOSE or _has_form(code)


@cached
def _has_form(code: bytes) -> bool:
    """Whether a statement that its first word identifies has the form that this word asks for."""
    found = re.match(NAME, code)
    word = found[0].upper() if found else b""
    rest = code[len(word) :].strip(b" \t")
    if word in _PATTERNS:
        parts = _PATTERNS[word].match(code)
        return parts is not None and all(is_expression(part) for part in parts.groups() if part is not None)
    if word == b"CASE":
        return bool(rest) and _all_expressions(rest)
    if word == b"FOR":
        bounds = _FOR.match(code)
        return bounds is not None and all(is_expression(text) for text in bounds.groups() if text is not None)
    if word in SPLINES:
        return not rest or rest[:4].upper() == b"WITH"
    if word in (b"TRIGGER", b"INTERRUPT", b"GLOBAL"):
        return _is_later(code)
    return not rest and (word in ALONE or word.startswith(b"END") or word == b"ON_ERROR_PROCEED")


@cached
def _declares(code: bytes) -> bool:
    head = DECLARED.match(code)
    if head is None or head[3].upper() in _RESERVED:
        return False
    items = [_DECLARATION.match(item) for item in split_values(code[head.end() :])]
    return all(
        item is not None
        and item[1].upper() not in _RESERVED
        and not item[1].startswith(b"$")
        and (item[2] is None or _all_expressions(item[2]))
        and (item[3] is None or is_expression(item[3]))
        for item in items
    )


def _is_later(code: bytes) -> bool:
    if switched := _SWITCHED.match(code):
        return not switched[1].strip() or is_expression(switched[1])
    head, *parts = _LATER.split(code)
    order = [word[:2].upper() for word in parts[0::2]]
    texts = parts[1::2]
    declared = _DECLARED.match(head)
    if declared is not None:
        texts, rest = [head[declared.end() :], *texts], order[:2] == [b"WH", b"DO"] and order[2:]
    else:
        place = _PLACE.match(texts[0]) if texts and head.strip().upper() == b"TRIGGER" else None
        if place is None:
            return False
        texts, rest = [texts[0][place.end() :], *texts[1:]], order[:3] == [b"WH", b"DE", b"DO"] and order[3:]
    if rest not in ([], [b"PR"]):
        return False
    does = texts.pop(len(texts) - 1 - len(rest))
    if not all(map(is_expression, texts)):
        return False
    text = does.strip(b" \t")
    said = assignment(text, 0)
    return _assigns(said) if said is not None else is_expression(text)


def _assigns(assignment: Assignment) -> bool:
    if assignment.name in _RESERVED:
        return False
    return is_expression(assignment.value) and (
        assignment.element is None or _all_expressions(assignment.element)
    )


def _all_expressions(text: bytes) -> bool:
    """Whether what is between commas are expressions, or nothing."""
    return all(not part.strip(b" \t") or is_expression(part) for part in split_values(text))


def is_expression(text: bytes, depth: int = 0) -> bool:
    """Whether a text is an expression as a whole: operands with operators between them, and brackets that match."""
    if _PLAIN.match(text):
        return True
    open_brackets: list[bytes] = []
    wants_operand, may_be_called, at = True, False, 0
    while found := TOKEN.match(text, at):
        kind, at = found.lastgroup, found.end()
        token = found[kind or 0].upper()
        if wants_operand:
            if token == b"(":
                open_brackets.append(b")")
            elif token == b"{":
                end = _end_of_aggregate(text, found.start("op"))
                if depth > _NESTED or end < 0 or not _is_aggregate(text[found.end() : end - 1], depth):
                    return False
                wants_operand, may_be_called, at = False, False, end
            elif token in (b")", b"]", b",") and open_brackets and may_be_called:
                if token != b"," and open_brackets.pop() != token:  # nothing is handed over
                    return False
                wants_operand = token == b","
            elif token not in _SIGNS:
                if kind == "op":
                    return False
                wants_operand, may_be_called = False, kind == "name"
            continue
        if token in _CLOSING and may_be_called:
            open_brackets.append(_CLOSING[token])
            wants_operand = True
        elif token == b"." and (member := TOKEN.match(text, at)) and member.lastgroup == "name":
            at, may_be_called = member.end(), True
        elif token == b"," and open_brackets:
            wants_operand = may_be_called = True
        elif token in (b")", b"]"):
            if not open_brackets or open_brackets.pop() != token:
                return False
            may_be_called = token == b"]" or may_be_called
        elif token in _BINARY:
            wants_operand, may_be_called = True, False
        else:
            return False
    return not text[at:].strip(b" \t") and not wants_operand and not open_brackets


def _is_aggregate(inner: bytes, depth: int) -> bool:
    """Whether the inside of braces are keys with their values."""
    tag = _TYPE.match(inner)
    for part in split_values(inner[tag.end() :] if tag else inner):
        key = _FIELD.match(part)
        if key is None or not is_expression(part[key.end() :], depth + 1):
            return False
    return not inner.rstrip(b" \t").endswith(b",")


def _end_of_aggregate(text: bytes, start: int) -> int:
    """Where the braces that open at ``start`` are closed; -1 where they are not."""
    depth = 0
    for found in re.finditer(rb'"[^"\r\n]*+"?+|[{}]', text[start:]):
        depth += (found[0] == b"{") - (found[0] == b"}")
        if depth == 0:
            return start + found.end()
    return -1
