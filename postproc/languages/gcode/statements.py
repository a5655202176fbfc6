"""Loops, branches, jumps, calls and assignments of a program, taken from the notes of its blocks."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum, auto

from postproc.languages.gcode.words import Note


class Verb(Enum):
    """What a statement does to the flow; the first seven open a construct."""

    SUB = auto()
    WHILE = auto()
    DO = auto()
    REPEAT = auto()
    IF = auto()
    FOR = auto()
    LOOP = auto()
    ELSE = auto()
    END = auto()
    UNTIL = auto()
    BREAK = auto()
    CONTINUE = auto()
    RETURN = auto()
    CALL = auto()
    GOTO = auto()
    REPEAT_PART = auto()


OPENING = frozenset((Verb.SUB, Verb.WHILE, Verb.DO, Verb.REPEAT, Verb.IF, Verb.FOR, Verb.LOOP))


@dataclass(frozen=True)
class FlowStatement:
    """label: of the construct that it opens, closes or leaves, where it leads to, or what it calls; text: its
    condition, count, arguments or bounds; direction: of a jump, "F" forward, "B" backward, "" both."""

    block: int
    verb: Verb
    label: str = ""
    text: str = ""
    direction: str = ""


@dataclass
class Construct:
    """start, stop: the blocks that open and close it; arms: blocks of a branch with their conditions, "" for ELSE."""

    verb: Verb
    start: int
    label: str
    text: str
    stop: int = -1
    until: str = ""
    arms: list[tuple[int, str]] = field(default_factory=list)


class NotFollowed(Exception):
    """The flow of the program is not one that is followed."""


_OWORDS = {
    "SUB": Verb.SUB,
    "WHILE": Verb.WHILE,
    "DO": Verb.DO,
    "REPEAT": Verb.REPEAT,
    "IF": Verb.IF,
    "ELSEIF": Verb.ELSE,
    "ELSE": Verb.ELSE,
    "ENDSUB": Verb.END,
    "ENDWHILE": Verb.END,
    "ENDREPEAT": Verb.END,
    "ENDIF": Verb.END,
    "BREAK": Verb.BREAK,
    "CONTINUE": Verb.CONTINUE,
    "RETURN": Verb.RETURN,
    "CALL": Verb.CALL,
}
_OWORD = re.compile(r"(O\S+) ([A-Z]+) ?(.*)")
_BLANKS = re.compile(r"\s+")
# Of texts with single blanks.
_DO = re.compile(r"(?:WHILE ?(.*?))?DO ?(\d+)")
_END = re.compile(r"END ?(\d+)")
_GOTO = re.compile(r"(?:IF\b ?(.+?) ?(?:THEN ?)?)?GOTO([BFCS]?) ?(\S.*)")
_PART = re.compile(r"REPEAT(B?) ([A-Z_]\w*)(?: (?!P ?=)([A-Z_]\w*))?(?: P ?= ?(\S+))?")
_FOR = re.compile(r"FOR (\w+) ?=(.+?) TO (.+)")
_NAMED = re.compile(r"(IF|WHILE|LOOP|UNTIL|REPEAT|ELSE|ENDIF|ENDWHILE|ENDLOOP|ENDFOR)\b ?(.*)")
_DEEPEST = 50


def statement(note: Note) -> FlowStatement | None:
    """The statement of a note about flow; None for other notes.  Raises NotFollowed."""
    if note.kind not in ("open", "close", "between", "while", "jump", "call"):
        return None
    text, block = _BLANKS.sub(" ", note.text).strip().upper(), note.block
    oword = _OWORD.fullmatch(text)
    if oword is not None and oword[2] in _OWORDS:
        return FlowStatement(block, _OWORDS[oword[2]], oword[1], oword[3])
    if note.kind == "call":
        return FlowStatement(block, Verb.CALL, text)
    if (found := _GOTO.fullmatch(text)) is not None:
        if found[2] == "S":
            raise NotFollowed
        return FlowStatement(block, Verb.GOTO, found[3], found[1] or "", found[2])
    if (found := _PART.fullmatch(text)) is not None:
        return FlowStatement(block, Verb.REPEAT_PART, found[2], found[4] or "1", found[3] or found[1])
    if (found := _DO.fullmatch(text)) is not None:
        return FlowStatement(
            block, Verb.WHILE if found[1] else Verb.LOOP, f"DO{int(found[2])}", found[1] or ""
        )
    if (found := _END.fullmatch(text)) is not None:
        return FlowStatement(block, Verb.END, f"DO{int(found[1])}")
    if (found := _FOR.fullmatch(text)) is not None:
        return FlowStatement(block, Verb.FOR, "FOR", f"{found[1]}={found[2]}\n{found[3]}")
    if (found := _NAMED.fullmatch(text)) is not None:
        name = found[1]
        if name.startswith("END"):
            return FlowStatement(block, Verb.END, name[3:])
        if name == "UNTIL":
            return FlowStatement(block, Verb.UNTIL, "REPEAT", found[2])
        if name == "REPEAT":
            return FlowStatement(block, Verb.LOOP, "REPEAT", "")
        return FlowStatement(block, Verb[name], "IF" if name == "ELSE" else name, found[2])
    raise NotFollowed


@dataclass(frozen=True)
class Structure:
    """The statements about flow of a program, by block; construct: of every block that opens, closes, divides or leaves
    one; followed: the run goes by them."""

    statements: dict[int, FlowStatement]
    construct: dict[int, Construct]
    subprograms: dict[str, Construct]
    followed: bool = True


def structure(notes: Iterable[Note]) -> Structure:
    """Raises NotFollowed where constructs do not close, or cross each other."""
    statements: dict[int, FlowStatement] = {}
    construct: dict[int, Construct] = {}
    subprograms: dict[str, Construct] = {}
    stack: list[Construct] = []
    for note in notes:
        one = statement(note)
        if one is None:
            continue
        if one.block in statements:
            raise NotFollowed
        statements[one.block] = one
        # a WHILE of a Sinumerik has no label of its own: inside of another one it is a loop of its own
        named = one.verb == Verb.WHILE and one.label != Verb.WHILE.name
        closes_do = named and stack and stack[-1].label == one.label
        if closes_do and stack[-1].verb != Verb.DO:
            raise NotFollowed
        if one.verb in (Verb.BREAK, Verb.CONTINUE, Verb.RETURN):
            left = next((outer for outer in reversed(stack) if outer.label == one.label), None)
            if left is None:
                raise NotFollowed
            construct[one.block] = left
        elif one.verb in OPENING and not closes_do:
            if len(stack) >= _DEEPEST:
                raise NotFollowed
            stack.append(Construct(one.verb, one.block, one.label, one.text, arms=[(one.block, one.text)]))
            construct[one.block] = stack[-1]
        elif one.verb == Verb.ELSE:
            if not stack or stack[-1].label != one.label or stack[-1].verb != Verb.IF:
                raise NotFollowed
            stack[-1].arms.append((one.block, one.text))
            construct[one.block] = stack[-1]
        elif one.verb in (Verb.END, Verb.UNTIL) or closes_do:
            if not stack or stack[-1].label != one.label:
                raise NotFollowed
            last = stack.pop()
            last.stop, last.until = one.block, one.text
            construct[one.block] = last
            if last.verb == Verb.SUB:
                if stack or last.label in subprograms:
                    raise NotFollowed
                subprograms[last.label] = last
    if stack:
        raise NotFollowed
    return Structure(statements, construct, subprograms)


_DEFINITION = re.compile(r"DEF (?:(?:NCK|CHAN) )?(REAL|INT|BOOL) (.*)")
_BACKGROUND = re.compile(r"(?:IDS?|WHEN|WHENEVER|FROM|EVERY)\b", re.I)
_NAMES = re.compile(r"[A-Z_$]\w*", re.I)
_DECLARED = re.compile(r" ?([A-Z_]\w*) ?(?:=(.*))?")


@dataclass(frozen=True)
class VariableAssignment:
    """target: text of the variable, "" where it is not known which; integer: it holds whole numbers only."""

    target: str
    text: str
    integer: bool = False


def assignments(note: str) -> list[VariableAssignment]:
    """The assignments of a note of that kind."""
    text = _BLANKS.sub(" ", note).strip().upper()
    defined = _DEFINITION.fullmatch(text)
    if defined is not None:
        found = [_DECLARED.fullmatch(part) for part in separated(defined[2])]
        whole = defined[1] != "REAL"
        return [VariableAssignment(one[1], one[2] or "0", whole) for one in found if one is not None]
    sign = text.find("=", text.find(">") if text.startswith(("#<", "# <")) else 0)
    if sign <= 0 or text[sign + 1 : sign + 2] == "=":
        return []
    return [VariableAssignment(text[:sign].strip(), text[sign + 1 :])]


def separated(text: str) -> list[str]:
    """The parts of a text between commas outside of brackets."""
    parts, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            parts.append(text[start:at])
            start = at + 1
    return [*parts, text[start:]]


def background_names(text: str) -> set[str]:
    """Names that a synchronous action, which runs beside the program, may set."""
    return {name.upper() for name in _NAMES.findall(text)} if _BACKGROUND.match(text) else set()


def by_block(notes: Iterable[Note], kind: str) -> dict[int, list[str]]:
    """Block -> the texts of its notes of a kind."""
    found: defaultdict[int, list[str]] = defaultdict(list)
    for note in notes:
        if note.kind == kind:
            found[note.block].append(note.text)
    return found
