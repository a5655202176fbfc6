"""What a program may change where: its routines, its blocks and labels, before it is interpreted.

An effect is a word ("point", "base", "tool", "feed", "mode", "data", "record") or the name (bytes) of a
variable that is assigned.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from postproc.dialects.krl.lexing import (
    BRANCHES,
    CLOSES,
    NAME,
    SPLINES,
    Assignment,
    Call,
    Declared,
    Statement,
    identifiers,
    without_strings,
)
from postproc.dialects.krl.target import EXTERNAL

Effect = str | bytes
Effects = set[Effect]

HERE = frozenset([b"$AXIS_ACT", b"$POS_ACT"])
"""Motions to where the robot stands already."""

READS_POSITION = re.compile(rb"\$(?:POS|AXIS)_(?:ACT|FOR|BACK|INT|RET)", re.I)

HARMLESS = frozenset(
    b"USERSPOT USER_GRP H50 H70 A10 A20 A10_INI DELMENS IR_STOPM P00 PULSE CWRITE CREAD SREAD SWRITE COPEN CCLOSE "
    b"CAST_TO CAST_FROM VARSTATE MBX_REC MSGNOTIFY MSGQUIT MSGDIALOG MSGLOOP ON_ERROR_PROCEED ERR_RAISE ERR_CLEAR "
    b"STRCLEAR STRCOPY STRADD CONFIRM "
    b"ABS SIN COS TAN ACOS ATAN ATAN2 SQRT FRAND FORWARD INVERSE INV_POS EK EB EO LK TOOL_ADJ VARTYPE GETVARSIZE "
    b"STRCOMP STRFIND STRLEN STRDECLLEN STRTOBOOL STRTOINT STRTOREAL STRTOSTRING STRTOFRAME STRTOPOS STRTOE3POS "
    b"STRTOE6POS STRTOAXIS STRTOE3AXIS STRTOE6AXIS GET_SIG_INF GETSYSSTATE GETCYCDEF GET_DECL_PLACE GET_MSGBUFFER "
    b"IS_KEY_PRESSED TIMER_LIMIT ISMESSAGESET SET_KRLMSG EXISTS_KRLMSG CLEAR_KRLMSG SET_KRLDLG EXISTS_KRLDLG".split()
)
HARMLESS_BEGIN = (b"SR_", b"EKI_")
PATH_FROM_FILE = (b"CR_PROCESS",)

HIDDEN = re.compile(rb"(?<![#$\w])(?:PTP|LIN|CIRC)\b", re.I)
"""A motion word inside of a statement of a technology package."""

_FUNCTION = re.compile(rb"(?<![A-Za-z0-9_$#.'])(" + NAME + rb")[ \t]*\(")
_WORDS = frozenset(
    b"AND OR NOT EXOR B_AND B_OR B_NOT B_EXOR IF THEN WHILE UNTIL FOR TO STEP SWITCH CASE WAIT SEC RETURN".split()
)
_CALLING = frozenset(["assignment", "call", "open", "close"])
"""Kinds of statement whose expressions may call functions, besides WAIT and RETURN."""

_BAS = re.compile(rb"[ \t]*#[ \t]*([A-Za-z_][A-Za-z0-9_]*)[ \t]*(?:,[ \t]*(.*?)[ \t]*)?\Z", re.S)
_BAS_EFFECTS: dict[bytes, Effects] = {
    b"INITMOV": {"base", "tool", "feed"},
    b"BASE": {"base"},
    b"EX_BASE": {"base"},
    b"TOOL": {"tool"},
    b"FRAMES": {"base", "tool"},
    b"PTP_PARAMS": {"base", "tool"},
    b"CP_PARAMS": {"base", "tool", "feed"},
    b"VEL_CP": {"feed"},
}
_SYSTEM: dict[bytes, str] = {
    b"$BASE": "base",
    b"$TOOL": "tool",
    b"$VEL": "feed",
    b"$IPO_MODE": "mode",
    b"BASE_DATA": "data",
    b"TOOL_DATA": "data",
    b"FDAT_ACT": "record",
    b"LDAT_ACT": "record",
}


@dataclass(eq=False)
class Block:
    """An IF, SWITCH, loop or spline block: what it may change, and the routines it calls."""

    word: bytes
    line: int
    effects: Effects = field(default_factory=set)
    calls: set[bytes] = field(default_factory=set)


@dataclass(eq=False)
class Routine(Block):
    """A DEF or DEFFCT of the file."""

    is_main: bool = False


@dataclass
class Survey:
    """``events``: index of a statement -> what it opens, branches or closes, in this order of closing.

    ``unclosed``: (line, what) of blocks without an end and ends without a begin; ``jumps``: labels that a GOTO
    names; ``assigned``: names that the program assigns anywhere; ``effects``: all that it changes anywhere.
    """

    events: dict[int, list[tuple[str, Block]]] = field(default_factory=dict)
    routines: dict[bytes, Routine] = field(default_factory=dict)
    jumps: set[bytes] = field(default_factory=set)
    assigned: set[bytes] = field(default_factory=set)
    effects: Effects = field(default_factory=set)
    unclosed: list[tuple[int, str]] = field(default_factory=list)
    has_routine: bool = False


def bas(arguments: bytes) -> tuple[bytes, bytes] | None:
    """Command (upper case) and argument of a call of BAS."""
    found = _BAS.match(arguments)
    return (found[1].upper(), found[2] or b"") if found else None


def is_harmless(name: bytes) -> bool:
    """Whether a routine of KUKA's packages is known not to move the robot."""
    return name in HARMLESS or name.startswith(HARMLESS_BEGIN)


def functions_of(statement: Statement) -> list[bytes]:
    """The functions that the expressions of a statement call, those of KRL itself left out; upper case."""
    if statement.kind not in _CALLING and statement.word not in (b"WAIT", b"RETURN"):
        return []
    code = without_strings(statement.code)
    if isinstance(statement.said, Call):
        code = without_strings(statement.said.arguments)
    names = dict.fromkeys(name.upper() for name in _FUNCTION.findall(code))
    return [name for name in names if name not in _WORDS]


def survey(statements: Iterable[tuple[int, Statement]]) -> Survey:
    """Goes over the statements (index, statement) once; a motion line in the common form may be left out of
    the parsing, only its kind counts."""
    result = Survey()
    blocks: list[Block] = []
    stack: list[Block] = []
    routine: Routine | None = None

    def close_all() -> None:
        result.unclosed.extend((b.line, f"{_shown(b.word)} has no end") for b in stack[1:])
        stack.clear()

    for index, statement in statements:
        kind = statement.kind
        if kind == "motion":
            if stack and not _stays(statement.code):
                stack[-1].effects.add("point")
        elif kind == "def":
            if stack:
                close_all()
                result.unclosed.append((statement.line, "DEF before the END of the one above"))
            name = statement.said if isinstance(statement.said, bytes) else b""
            routine = Routine(b"DEF", statement.line, is_main=not result.has_routine)
            result.has_routine = True
            result.routines.setdefault(name, routine)
            blocks.append(routine)
            stack = [routine]
            result.events[index] = [("open", routine)]
        elif kind == "end":
            if not stack or not stack[0].line:
                result.events[index] = [("close", block) for block in stack[:0:-1]]
                close_all()
                result.unclosed.append((statement.line, f"{_shown(statement.word)} without a DEF"))
            else:
                result.events[index] = [("close", block) for block in reversed(stack)]
                close_all()
        elif kind == "open":
            if not stack:  # a program without DEF
                stack = [Routine(b"DEF", 0, is_main=True)]
                blocks.append(stack[0])
            block = Block(statement.word, statement.line)
            blocks.append(block)
            stack.append(block)
            _note(result, stack, statement)
            result.events[index] = [("open", block)]
        elif kind == "branch":
            if len(stack) > 1 and stack[-1].word == BRANCHES[statement.word]:
                result.events[index] = [("branch", stack[-1])]
        elif kind == "close":
            _close(result, stack, statement, index)
        elif kind == "goto":
            if isinstance(statement.said, bytes):
                result.jumps.add(statement.said)
        else:
            _note(result, stack, statement)
    if stack and stack[0].line and result.has_routine:
        result.unclosed.append((stack[0].line, "DEF has no END"))
    close_all()
    _settle(result, blocks)
    return result


def _close(result: Survey, stack: list[Block], statement: Statement, index: int) -> None:
    wanted = CLOSES[statement.word]
    depth = next((i for i in range(len(stack) - 1, 0, -1) if stack[i].word in wanted), 0)
    if not depth:
        result.unclosed.append((statement.line, f"{_shown(statement.word)} without its begin"))
        return
    _note(result, stack, statement)
    closed = stack[depth:][::-1]
    result.unclosed.extend((block.line, f"{_shown(block.word)} has no end") for block in closed[:-1])
    result.events[index] = [("close", block) for block in closed]
    del stack[depth:]
    for block in closed:
        stack[-1].effects |= block.effects
        stack[-1].calls |= block.calls


def _note(result: Survey, stack: list[Block], statement: Statement) -> None:
    effects, called = effects_of(statement)
    functions = functions_of(statement)
    if not all(map(is_harmless, functions)):
        # What is handed to a function may come back changed.
        effects = effects | identifiers(statement.code)
    result.effects |= effects
    result.assigned.update(effect for effect in effects if isinstance(effect, bytes))
    if stack:
        stack[-1].effects |= effects
        stack[-1].calls.update(functions)
        if called:
            stack[-1].calls.add(called)


def effects_of(statement: Statement) -> tuple[Effects, bytes]:
    """What a statement (no motion, no block) may change, and the routine it calls."""
    said = statement.said
    if isinstance(said, Assignment):
        if said.name == b"$VEL" and said.path not in (b"", b"CP"):
            return set(), b""
        if said.name in _SYSTEM:
            return {_SYSTEM[said.name]}, b""
        if said.name.startswith(b"$") or said.path in EXTERNAL:
            return set(), b""
        return {said.name}, b""
    if isinstance(said, Declared):
        return {key.split(b"[")[0] for key, value, _ in said.items if key and value}, b""
    if isinstance(said, Call):
        if said.name == b"BAS":
            command = bas(said.arguments)
            return set(_BAS_EFFECTS.get(command[0], set())) if command else {"base", "tool", "feed"}, b""
        words: Effects = set() if is_harmless(said.name) else set(identifiers(said.arguments))
        return words, said.name
    return ({"point"} if statement.kind == "other" and HIDDEN.search(statement.code) else set()), b""


def _settle(result: Survey, blocks: list[Block]) -> None:
    """Brings what the called routines change into the effects of who calls them."""
    changed = True
    while changed:
        changed = False
        for block in blocks:
            before = len(block.effects)
            for name in block.calls:
                routine = result.routines.get(name)
                if routine is not None:
                    block.effects |= routine.effects
                elif not is_harmless(name):
                    block.effects.add("point")
            changed = changed or len(block.effects) != before


def _stays(code: bytes) -> bool:
    words = code.split()
    return len(words) > 1 and words[1].upper() in HERE


def in_spline(stack: Iterable[Block]) -> bool:
    return any(block.word in SPLINES for block in stack)


def _shown(word: bytes) -> str:
    return word.decode("latin-1")
