"""Lines of KRL as statements: what kind a line is, where its parts stand, which names it mentions.

Works on bytes; KRL is case-insensitive, so words and names are compared in upper case.
"""

from __future__ import annotations

import math
import re
from codecs import BOM_UTF8
from collections.abc import Callable, Iterator
from enum import StrEnum, auto
from functools import lru_cache, wraps
from typing import NamedTuple, TypeGuard, TypeVar

from postproc.base.document import Document

T = TypeVar("T")
NAME = rb"[A-Za-z_$][A-Za-z0-9_$]*"

LONGEST = 8192
"""Bytes of code in a line; controllers write lines of 1300.  What is longer is no KRL and is not taken apart."""

MOTIONS = frozenset(
    b"PTP LIN CIRC SPTP SLIN SCIRC SPL PTP_REL LIN_REL CIRC_REL SPTP_REL SLIN_REL SCIRC_REL SPL_REL".split()
)
LOOPS = frozenset([b"FOR", b"WHILE", b"LOOP", b"REPEAT"])
SPLINES = frozenset([b"SPLINE", b"PTP_SPLINE"])
OPENS = LOOPS | SPLINES | {b"IF", b"SWITCH"}
CLOSES: dict[bytes, frozenset[bytes]] = {
    b"ENDIF": frozenset([b"IF"]),
    b"ENDSWITCH": frozenset([b"SWITCH"]),
    b"ENDFOR": frozenset([b"FOR"]),
    b"ENDWHILE": frozenset([b"WHILE"]),
    b"ENDLOOP": frozenset([b"LOOP"]),
    b"UNTIL": frozenset([b"REPEAT"]),
    b"ENDSPLINE": SPLINES,
}
BRANCHES = {b"ELSE": b"IF", b"CASE": b"SWITCH", b"DEFAULT": b"SWITCH"}
POINT_TYPES = frozenset([b"FRAME", b"POS", b"E3POS", b"E6POS", b"AXIS", b"E3AXIS", b"E6AXIS"])
FRAME_TABLES = (b"BASE_DATA", b"TOOL_DATA")
"""What they hold is the cell's to say."""
RECORD_TYPES = frozenset([b"FDAT", b"LDAT", b"PDAT", b"ODAT"])
SCALARS = frozenset([b"INT", b"REAL", b"BOOL", b"CHAR"])
TYPES = POINT_TYPES | RECORD_TYPES | SCALARS
SYSTEM_WORDS = frozenset(
    b"HALT WAIT CONTINUE INTERRUPT TRIGGER BRAKE RESUME EXT EXTFCT "
    b"IMPORT SIGNAL ENUM STRUC ANOUT ANIN DIGIN INI".split()
)

_GERMAN = re.compile(rb"[\xc4\xd6\xdc\xe4\xf6\xfc\xdf]|\xc3[\x84\x96\x9c\xa4\xb6\xbc\x9f]")
"""Umlauts and sharp s of Latin-1 or UTF-8: no letter of a motion word looks like one."""

_FIRST = re.compile(rb"[ \t]*(" + NAME + rb")")
_LABEL = re.compile(rb"(" + NAME + rb")[ \t]*:[ \t]*\Z")
_DEF = re.compile(
    rb"(?:GLOBAL[ \t]+)?(?:DEFFCT[ \t]+"
    + NAME
    + rb"(?:\[[^\]]*\])?|DEF)[ \t]+("
    + NAME
    + rb")[ \t]*(?:\(([^)]*)|\Z)",
    re.I,
)
_GOTO = re.compile(rb"GOTO[ \t]+(" + NAME + rb")", re.I)
_ASSIGNMENT = re.compile(
    rb"(" + NAME + rb")[ \t]*+(?:\[((?:[^\[\]]|\[[^\[\]]*+\])*+)\][ \t]*+)?"
    rb"((?:\.[ \t]*+" + NAME + rb"(?:\[[^\]]*+\])?[ \t]*+)*+)=(?!=)[ \t]*+"
)
_CALL = re.compile(rb"(" + NAME + rb")[ \t]*\((.*)\)\Z", re.S)
DECLARED = re.compile(
    rb"(?:GLOBAL[ \t]+)?(?:DECL[ \t]+)?(GLOBAL[ \t]+)?(CONST[ \t]+)?(" + NAME + rb")[ \t]+(?=[A-Za-z_$])",
    re.I,
)
_ITEM = re.compile(rb"(" + NAME + rb")[ \t]*(?:\[([^\]]*)\])?[ \t]*(=[ \t]*)?")
_STRING = re.compile(rb'"[^"\r\n]*"?')
_BRACKET = re.compile(rb'"[^"\r\n]*"?|[{}()\[\],]')
_FLAT = re.compile(rb'(?:[^"{}()\[\],]|"[^"\r\n]*+"|\{(?:[^"{}()\[\]]|"[^"\r\n]*+"|\[\])*+\})*+(?=,|\Z)')
"""A value without brackets but those of a plain aggregate."""
_BLANKS = re.compile(rb"[ \t]*")
_IDENTIFIER = re.compile(rb"(?<![A-Za-z0-9_$#'])" + NAME)
_NUMBER = re.compile(rb"[-+]?[ \t]*+(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d{1,4})?\Z")
_RADIX = re.compile(rb"'[ \t]*(?:[Bb][ \t]*([01]+)|[Hh][ \t]*([0-9A-Fa-f]+))[ \t]*'\Z")


class StatementKind(StrEnum):
    """What a line is."""

    HEADER = auto()  # &ACCESS and the like, before the first DEF
    COMMENT = auto()  # nothing else
    DEF = auto()
    END = auto()
    DECLARATION = auto()
    ASSIGNMENT = auto()
    CALL = auto()
    MOTION = auto()
    OPEN = auto()  # a block: IF, SWITCH, loops, splines
    BRANCH = auto()  # ELSE, CASE, DEFAULT
    CLOSE = auto()  # a block
    LABEL = auto()
    GOTO = auto()
    EXIT = auto()
    RETURN = auto()
    SYSTEM = auto()  # WAIT, INTERRUPT, TRIGGER, SIGNAL, ...: no value changes at it
    UMLAUT_NAME = (
        auto()
    )  # an assignment, call or declaration of a name with umlauts, each byte of them ``_`` in it
    UNREADABLE = auto()  # letters that KRL does not have hide what it does
    OTHER = auto()


BEFORE_CASES = (
    StatementKind.COMMENT,
    StatementKind.BRANCH,
    StatementKind.CLOSE,
    StatementKind.END,
    StatementKind.DEF,
)
"""What may follow on SWITCH."""


class Assignment(NamedTuple):
    name: bytes  # upper case
    element: bytes | None  # what is in the brackets of an array's element
    path: bytes  # upper case, without the first dot: b"Z" of P.Z
    value: bytes
    at: int  # offset of the value in the document

    @property
    def key(self) -> bytes | None:
        return keyed(self.name, self.element)


class Call(NamedTuple):
    name: bytes
    arguments: bytes


class Head(NamedTuple):
    """The head of a DEF or DEFFCT: its name, its parameters and whether each comes back changed (OUT)."""

    name: bytes
    parameters: tuple[tuple[bytes, bool], ...]


class Declared(NamedTuple):
    type: bytes
    is_global: bool
    items: tuple[tuple[bytes | None, bytes, int], ...]  # key, value or b"", offset of the value
    is_constant: bool = False


Said = Assignment | Call | Declared | Head | bytes | None


class Statement(NamedTuple):
    """One line: its kind, its first word (upper case), its code without comment, and what it says."""

    kind: StatementKind
    word: bytes
    code: bytes
    line: int
    at: int  # offset of the first byte of the code
    strings: Said = None
    comment: bytes = b""


def cached(function: Callable[[bytes], T]) -> Callable[[bytes], T]:
    """A function of code that keeps what it gave for short texts: some lines come again and again."""
    remembered = lru_cache(maxsize=1024)(function)

    @wraps(function)
    def short_or_long(code: bytes) -> T:
        return remembered(code) if len(code) <= 100 else function(code)

    return short_or_long


def keyed(name: bytes, index: bytes | None) -> bytes | None:
    """The name of a variable or of an array's element with a constant index; None for any other index."""
    if index is None:
        return name
    digits = index.replace(b" ", b"").replace(b"\t", b"")
    return name + b"[" + digits + b"]" if digits.replace(b",", b"").isdigit() else None


def split_comment(line: bytes) -> tuple[bytes, bytes]:
    """The code of a line, and its comment from the ``;`` on (a ``;`` inside of a string is none)."""
    at = line.find(b";")
    if at >= 0 and b'"' in line[:at]:
        masked = _STRING.sub(lambda found: b"_" * len(found[0]), line)
        at = masked.find(b";")
    return (line, b"") if at < 0 else (line[:at], line[at:])


@cached
def identifiers(code: bytes) -> frozenset[bytes]:
    """Every name that a piece of code mentions, upper case; enumeration words (#X) and strings are none."""
    return frozenset([name.upper() for name in _IDENTIFIER.findall(without_strings(code))])


def without_strings(code: bytes) -> bytes:
    return _STRING.sub(b"", code) if b'"' in code else code


def number(literal: bytes) -> float | None:
    """The value of a numeric literal: 12, 12., - 0.5, 1.2E-05, 'B0110', 'HFF'; None if it is none."""
    if _NUMBER.match(literal):
        value = float(literal.replace(b" ", b"").replace(b"\t", b""))
        return value if math.isfinite(value) else None
    radix = _RADIX.match(literal)
    if radix is None or len(literal) > 40:
        return None
    return float(int(radix[1], 2) if radix[1] else int(radix[2], 16))


def is_number(value: object) -> TypeGuard[int | float]:
    """Whether a value of KRL is an INT or REAL; a BOOL is none."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_integer(value: object) -> TypeGuard[int]:
    """Whether a value of KRL is an INT."""
    return isinstance(value, int) and not isinstance(value, bool)


def lines(document: Document) -> Iterator[tuple[int, int, int]]:
    """Number (from 1), start and stop (line ending included) of every line; a BOM belongs to none."""
    raw, line = document.raw, 0
    start, last = len(BOM_UTF8) if raw.startswith(BOM_UTF8) else 0, len(raw)
    while start < last or not line:
        stop = raw.find(b"\n", start) + 1 or last
        line += 1
        yield line, start, stop
        start = stop


def statement(raw: bytes, line: int, start: int, stop: int) -> Statement | None:
    """The statement of a line; None for an empty one."""
    found = _parts_of(raw[start:stop])
    if found is None:
        return None
    kind, word, code, at, said, comment = found
    if said is not None and start:
        said = _further_on(said, start)
    return Statement(kind, word, code, line, start + at, said, comment)


@cached
def _parts_of(line: bytes) -> tuple[StatementKind, bytes, bytes, int, Said, bytes] | None:
    """Kind, first word, code, its offset, what it says and the comment of a line that starts at byte 0."""
    code, comment = split_comment(line.rstrip(b"\r\n"))
    stripped = code.lstrip(b" \t\x0c\x0b\x00\r")
    at = len(code) - len(stripped)
    code = stripped.rstrip(b" \t\x0c\x0b\x00\r")
    if not code:
        return (StatementKind.COMMENT, b"", b"", at, None, comment) if comment else None
    if code.startswith(b"&"):
        return StatementKind.HEADER, b"&", code, at, None, comment
    first = _FIRST.match(code)
    word = first[1].upper() if first else b""
    kind, said = _kind(word, code, at)
    if not code.isascii() and kind in (StatementKind.OTHER, StatementKind.GOTO) and has_foreign_letters(code):
        kind, said = _nonstandard(word, code, at)
    return kind, word, code, at, said, comment


def _further_on(operand: Said, by: int) -> Said:
    """What a statement says that starts so many bytes further on."""
    if isinstance(operand, Assignment):
        return operand._replace(at=operand.at + by)
    if isinstance(operand, Declared):
        return operand._replace(items=tuple([(key, value, at + by) for key, value, at in operand.items]))
    return operand


def has_foreign_letters(code: bytes) -> bool:
    """Whether code holds letters that KRL does not have, other than in strings."""
    return not without_strings(code).isascii()


def _nonstandard(word: bytes, code: bytes, at: int) -> tuple[StatementKind, Said]:
    plain = _GERMAN.sub(lambda found: b"_" * len(found[0]), code)
    if word != b"GOTO" and len(code) <= LONGEST and not has_foreign_letters(plain):
        first = _FIRST.match(plain)
        kind, said = _kind(first[1].upper() if first else b"", plain, at)
        if kind in (StatementKind.ASSIGNMENT, StatementKind.CALL, StatementKind.DECLARATION):
            return StatementKind.UMLAUT_NAME, said
    return StatementKind.UNREADABLE, None


def _parameters(text: bytes) -> tuple[tuple[bytes, bool], ...]:
    found = []
    for part in text.split(b",")[:50]:
        name = _FIRST.match(part)
        if name:
            found.append((name[1].upper(), not part.rstrip().upper().endswith(b"IN")))
    return tuple(found)


def _kind(word: bytes, code: bytes, at: int) -> tuple[StatementKind, Said]:
    found: re.Match[bytes] | None
    if word in MOTIONS:
        # A variable may bear such a name only where no motion can stand.
        return StatementKind.MOTION, None
    if len(code) > LONGEST:
        return StatementKind.OTHER, None
    if word in OPENS:
        return StatementKind.OPEN, None
    if word in CLOSES:
        return StatementKind.CLOSE, None
    if word in BRANCHES:
        return StatementKind.BRANCH, None
    if word in (b"DEF", b"DEFFCT", b"GLOBAL") and (found := _DEF.match(code)):
        return StatementKind.DEF, Head(found[1].upper(), _parameters(found[2] or b""))
    if word in (b"END", b"ENDFCT"):
        return StatementKind.END, None
    if word == b"GOTO" and (found := _GOTO.match(code)):
        return StatementKind.GOTO, found[1].upper()
    if word in (b"EXIT", b"RETURN"):
        return StatementKind(word.decode().lower()), None
    if word in SYSTEM_WORDS:
        return StatementKind.SYSTEM, None
    if word in (b"DECL", b"GLOBAL", b"CONST") or word in TYPES:
        declared = declaration(code, at)
        if declared is not None:
            return StatementKind.DECLARATION, declared
    if (said := assignment(code, at)) is not None:
        return StatementKind.ASSIGNMENT, said
    if found := _CALL.match(code):
        return StatementKind.CALL, Call(found[1].upper(), found[2])
    if found := _LABEL.match(code):
        return StatementKind.LABEL, found[1].upper()
    return StatementKind.OTHER, None


def assignment(code: bytes, at: int) -> Assignment | None:
    """``NAME[index].path = value``; None if the code, which is at byte ``at``, is none."""
    found = _ASSIGNMENT.match(code)
    if found is None:
        return None
    path = found[3].replace(b" ", b"").replace(b"\t", b"").upper()[1:]
    return Assignment(found[1].upper(), found[2], path, code[found.end() :], at + found.end())


def declaration(code: bytes, at: int) -> Declared | None:
    """``[DECL] [GLOBAL] TYPE NAME[[n]] [= value] {, ...}``; None if the code is none."""
    head = DECLARED.match(code)
    if head is None or head[3].upper() in (b"INTERRUPT", b"DECL"):
        return None
    is_global = head[1] is not None or code[:6].upper() == b"GLOBAL"
    items: list[tuple[bytes | None, bytes, int]] = []
    place = head.end()
    while found := _ITEM.match(code, place):
        place = found.end()
        value = b""
        if found[3]:
            stop = value_end(code, place)
            value = code[place:stop].rstrip()
            items.append((keyed(found[1].upper(), found[2]), value, at + place))
            place = stop
        else:
            # The size of an array is no element of it.
            items.append((found[1].upper(), b"", at + place))
        place = _skip(code, place)
        if code[place : place + 1] != b",":
            break
        place = _skip(code, place + 1)
    return Declared(head[3].upper(), is_global, tuple(items), head[2] is not None) if items else None


def _skip(code: bytes, place: int) -> int:
    found = _BLANKS.match(code, place)
    return found.end() if found else place


def value_end(code: bytes, start: int) -> int:
    """Where a value that starts at ``start`` ends: at the comma outside of all braces, or at the end."""
    if plain := _FLAT.match(code, start):
        return plain.end()
    depth = 0
    for found in _BRACKET.finditer(code, start):
        letter = found[0]
        if letter in b"{([":
            depth += 1
        elif letter in b"})]":
            depth -= 1
        elif letter == b"," and depth <= 0:
            return found.start()
    return len(code)


def split_values(text: bytes) -> Iterator[bytes]:
    """The values between the commas outside of all braces."""
    place = 0
    while place < len(text):
        end = value_end(text, place)
        yield text[place:end]
        place = end + 1


def module_name(raw: bytes, word: bytes) -> tuple[int, int] | None:
    """Byte range of the module's name in the first ``DEF`` (or ``DEFDAT``) line."""
    pattern = rb"^(?:\xef\xbb\xbf)?[ \t]*(?:GLOBAL[ \t]+)?" + word + rb"[ \t]+(" + NAME + rb")"
    if word == b"DEF":
        pattern += rb"[ \t]*(?:\(|;|\r?$)"
    found = re.search(pattern, raw, re.I | re.M)
    return found.span(1) if found else None
