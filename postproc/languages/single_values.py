"""Whether bytes of a block are one value of a word, or words with one value each, and nothing beside these.

A value is a number, a variable or an expression: of ISO dialects one operand (``#<w>``, ``[#<w>*2]``, ``SIN[30]``),
after ``=`` a chain of operands (``WE+2``, ``SIN(30)*4``).
"""

from __future__ import annotations

import re

_BLANKS = re.compile(rb"[ \t]*+")
_SIGNS = re.compile(rb"[-+ \t]*+")
_NUMBER = re.compile(rb"(?:\d++\.?\d*+|\.\d++)(?:EX?[-+]?\d++)?(?![A-Za-z0-9_$.])", re.I)
_PARAMETER = re.compile(rb"#[# \t]*+(?:\d++|<[^<>()\r\n;]*+>)?")
_NAME = re.compile(rb"[A-Za-z_$][A-Za-z0-9_$]*+")
_OPERATOR = re.compile(rb"[-+*/]|(?:MOD|DIV|B_AND|B_OR|B_XOR|AND|OR|XOR)(?![A-Za-z0-9_$])", re.I)
_WORD = re.compile(rb"([A-Za-z])(\d?)(R?)[ \t]*+(=?)[ \t]*+", re.I)
_ALONE = re.compile(rb"(?:/[ \t]*+\d?|CIP)(?![A-Za-z0-9_$])", re.I)
_PAIRS = {ord("("): ord(")"), ord("["): ord("]")}


def is_one_value(text: bytes, assigned: bool) -> bool:
    """Whether ``text`` is one value; ``assigned``: it is after ``=``."""
    end = _value_end(text, 0, assigned)
    return end >= 0 and not text[end:].strip(b" \t")


def are_words(text: bytes, letters: bytes) -> bool:
    """Whether each line of ``text`` is words with addresses of ``letters`` and one value each."""
    return all(_is_block(line, letters) for line in re.split(rb"\r\n|\r|\n", text))


def _is_block(line: bytes, letters: bytes) -> bool:
    at = 0
    while at < len(line):
        at = _after(_BLANKS, line, at)
        if at == len(line):
            break
        alone = _ALONE.match(line, at)
        if alone is not None:
            at = alone.end()
            continue
        word = _WORD.match(line, at)
        if word is None or word[1].upper() not in letters:
            return False
        if (word[2] or word[3]) and not word[4]:
            word = re.compile(rb"([A-Za-z])()()()[ \t]*+").match(line, at)
            assert word is not None
        at = _value_end(line, word.end(), bool(word[4]))
        if at < 0:
            return False
    return True


def _value_end(text: bytes, at: int, assigned: bool) -> int:
    """After the value that starts at byte ``at``; -1 where none does."""
    while True:
        at = _operand_end(text, _after(_SIGNS, text, at), assigned)
        if at < 0 or not assigned:
            return at
        operator = _OPERATOR.match(text, _after(_BLANKS, text, at))
        if operator is None:
            return at
        at = operator.end()


def _operand_end(text: bytes, at: int, assigned: bool) -> int:
    if at >= len(text):
        return -1
    if text[at] in _PAIRS:
        return _group_end(text, at, assigned)
    parameter = _PARAMETER.match(text, at)
    if parameter is not None:
        found = parameter[0].rstrip(b"# \t")
        return parameter.end() if found else _group_end(text, parameter.end(), assigned)
    number = _NUMBER.match(text, at)
    if number is not None:
        return number.end()
    name = _NAME.match(text, at)
    if name is None:
        return -1
    end, groups = name.end(), 0
    while (after := _group_end(text, _after(_BLANKS, text, end), assigned)) >= 0:
        end, groups = after, groups + 1
    if assigned:
        return end
    # An ISO dialect has names of functions only: SIN[30], ATAN[1]/[2].
    if not groups:
        return -1
    divided = _after(_BLANKS, text, end)
    if text[divided : divided + 1] == b"/":
        return _group_end(text, _after(_BLANKS, text, divided + 1), assigned)
    return end


def _group_end(text: bytes, at: int, assigned: bool) -> int:
    """After the bracket that closes the one at byte ``at``; -1 where none opens or closes there.  In an ISO dialect a
    parenthesis starts a comment."""
    closing: list[int] = []
    for i in range(at, len(text)):
        if text[i] in _PAIRS and (assigned or text[i] == ord("[")):
            closing.append(_PAIRS[text[i]])
        elif not closing or text[i] in b';"\r\n' or (not assigned and text[i] in b"()"):
            return -1
        elif text[i] in b")]":
            if text[i] != closing.pop():
                return -1
            if not closing:
                return i + 1
    return -1


def _after(pattern: re.Pattern[bytes], text: bytes, at: int) -> int:
    found = pattern.match(text, at)
    return at if found is None else found.end()
