"""What a statement changes, reads and calls.

An effect is a word ("point", "base", "tool", "feed", "apo", "mode", "turning", "root", "record", "override", "advance"
of $ADVANCE, "apart" of external axes that do not take part in motions, "force", "switch" of the FORCE and COMPENSATE
comments, "resume" for the end of calls that are under way, "all" for every variable that the program assigns) or the
name (bytes) of a variable that is assigned.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Set
from types import MappingProxyType

from postproc.languages.krl.lexing import (
    NAME,
    Assignment,
    Call,
    Declared,
    Statement,
    StatementKind,
    cached,
    identifiers,
    keyed,
    split_values,
    without_strings,
)
from postproc.languages.krl.system_variables import SYSTEM, has_unknown_effect
from postproc.languages.krl.target import AXES, COMPONENTS, EXTERNAL

Effect = str | bytes
Effects = set[Effect]

HERE = frozenset([b"$AXIS_ACT", b"$POS_ACT"])
"""Motions to where the robot is already."""

READS_POSITION = re.compile(rb"\$(?:POS|AXIS)_(?:ACT|FOR|BACK|INT|RET)", re.I)

ANNOTATION = re.compile(rb";[ \t]*(?:FORCE|COMPENSATE)(?![A-Za-z0-9_])", re.I)
"""A comment that states a force or what is compensated."""

HARMLESS = frozenset(
    b"USERSPOT USER_GRP H50 H70 A10 A20 A10_INI DELMENS IR_STOPM P00 PULSE CWRITE CREAD SREAD SWRITE COPEN CCLOSE "
    b"CAST_TO CAST_FROM VARSTATE MBX_REC MSGNOTIFY MSGQUIT MSGDIALOG MSGLOOP ON_ERROR_PROCEED ERR_RAISE ERR_CLEAR "
    b"STRCLEAR STRCOPY STRADD CONFIRM SET_CD_PARAMS USE_CM_PRO_VALUES K_ROOT K_TYPE K_OFFS "
    b"ABS SIN COS TAN ACOS ATAN ATAN2 SQRT FRAND FORWARD INVERSE INV_POS EK EB EO LK TOOL_ADJ VARTYPE GETVARSIZE "
    b"STRCOMP STRFIND STRLEN STRDECLLEN STRTOBOOL STRTOINT STRTOREAL STRTOSTRING STRTOFRAME STRTOPOS STRTOE3POS "
    b"STRTOE6POS STRTOAXIS STRTOE3AXIS STRTOE6AXIS GET_SIG_INF GETSYSSTATE GETCYCDEF GET_DECL_PLACE GET_MSGBUFFER "
    b"SVEL_CP SVEL_JOINT STOOL STOOL2 SBASE SIPO_MODE SLOAD SACC_CP SACC_JOINT SORI_TYP SAPO SAPO_PTP SJERK SGEAR_JERK "
    b"SCIRC_TYP IS_KEY_PRESSED TIMER_LIMIT ISMESSAGESET SET_KRLMSG EXISTS_KRLMSG CLEAR_KRLMSG SET_KRLDLG "
    b"EXISTS_KRLDLG".split()
)
HARMLESS_BEGIN = (b"SR_", b"EKI_")
PATH_FROM_FILE = (b"CR_PROCESS",)

HIDDEN = re.compile(rb"(?<![#$\w])(?:PTP|LIN|CIRC)\b", re.I)
"""A motion word inside of a statement of a technology package."""

_MORE = re.compile(rb"[=(:]|\AGOTO\b", re.I)
"""An assignment, a call, a label or a GOTO: what no motion holds without a brace."""

MODAL: Effects = {"base", "tool", "feed", "apo", "mode", "turning"}
"""What BAS may set."""

EVERYTHING: Effects = {"point", "record", "override", "advance", "apart", "all", *MODAL}

_NAMED: Effects = {"advance", "apart"}
"""What only a statement changes that names a variable for it."""

COMMENTS: frozenset[Effect] = frozenset(["force", "switch"])
"""What comments change that speak to this tool."""

EVERYTHING_AND_COMMENTS: Effects = EVERYTHING | COMMENTS

_FUNCTION = re.compile(rb"(?<![A-Za-z0-9_$#.'])(" + NAME + rb")[ \t]*\(")
_WORDS = frozenset(
    b"AND OR NOT EXOR B_AND B_OR B_NOT B_EXOR IF THEN WHILE UNTIL FOR TO STEP SWITCH CASE WAIT SEC RETURN".split()
)
_IN_MOTIONS = frozenset([b"CA", b"WITH", b"BAS"])
_CALLING = (
    StatementKind.ASSIGNMENT,
    StatementKind.BRANCH,
    StatementKind.CALL,
    StatementKind.DECLARATION,
    StatementKind.UMLAUT_NAME,
    StatementKind.OPEN,
    StatementKind.CLOSE,
    StatementKind.RETURN,
    StatementKind.MOTION,
)
"""Kinds of statement whose expressions may call functions, besides the words below."""
_EVALUATING = frozenset(b"WAIT TRIGGER ANOUT ANIN DIGIN ASYPTP ASYCONT TIME_BLOCK".split())
_DO = re.compile(rb"(?<![A-Za-z0-9_$])DO(?![A-Za-z0-9_$])", re.I)

_COUNTER = re.compile(rb"FOR[ \t]+(" + NAME + rb")[ \t]*=", re.I)
_KEYS = frozenset([*COMPONENTS, *AXES, *EXTERNAL, b"S", b"T"])

_INDEX = rb"(?:\[(?:[^\[\]]|\[[^\[\]]*+\])*+\][ \t]*+)?"
_RETURNED = re.compile(
    rb"[ \t]*+(" + NAME + rb")[ \t]*+" + _INDEX + rb"(?:\.[ \t]*+" + NAME + rb"[ \t]*+" + _INDEX + rb")*+\Z"
)
_ENTRY = re.compile(rb"\b((?:BASE|TOOL)_DATA)[ \t]*+(?:\[([^\[\]]*+)\])?+", re.I)
_DIMENSIONS = re.compile(rb"\[[^\]\[]*+\]")
_APART = re.compile(rb"\$[ \t]++")
_ASSIGNED = re.compile(rb"(?<![A-Za-z0-9_$.])(" + NAME + rb")[ \t]*+(?:[\[.][^=]{0,200}+)?+=(?!=)")
_EXTERNAL = re.compile(
    rb"EXT(?:FCT[ \t]++" + NAME + rb"(?:\[[^\]]*+\])?|P)?+[ \t]++(" + NAME + rb")[ \t]*+\(([^)]*+)\)", re.I
)

_BAS = re.compile(rb"[ \t]*+#[ \t]*+([A-Za-z_][A-Za-z0-9_]*+)[ \t]*+(?:,(.*))?\Z", re.S)
_BAS_EFFECTS: dict[bytes, Effects] = {
    b"INITMOV": MODAL,
    b"BASE": {"base"},
    b"EX_BASE": {"base"},
    b"TOOL": {"tool"},
    b"FRAMES": {"base", "tool", "mode"},
    b"PTP_PARAMS": {"base", "tool", "mode", "apo"},
    b"CP_PARAMS": MODAL,
    b"PTP_DAT": {"apo"},
    b"CP_DAT": {"feed", "apo", "turning"},
    b"VEL_CP": {"feed"},
    **{key: set() for key in b"ACC_CP ACC_PTP VEL_PTP ACC_GLUE OUT_SYNC OUT_ASYNC GROUP".split()},
}
"""The commands of KUKA's bas.src, and what they set; another one may set all of it."""
BAS_COMMANDS = frozenset(_BAS_EFFECTS)


def bas(arguments: bytes) -> tuple[bytes, bytes] | None:
    """Command (upper case) and argument of a call of BAS."""
    found = _BAS.match(arguments)
    return (found[1].upper(), (found[2] or b"").strip(b" \t")) if found else None


def effects_of_bas(arguments: bytes) -> Effects:
    command = bas(arguments)
    return set(_BAS_EFFECTS.get(command[0], MODAL) if command else MODAL)


def is_harmless(name: bytes) -> bool:
    """Whether a routine of KUKA's packages is known not to move the robot."""
    return name in HARMLESS or name.startswith(HARMLESS_BEGIN)


def functions_of(statement: Statement) -> tuple[bytes, ...]:
    """The functions that the expressions of a statement call, those of KRL itself left out; upper case."""
    if statement.kind not in _CALLING and statement.word not in _EVALUATING:
        return ()
    if b"(" not in statement.code:
        return ()
    said = statement.strings
    code = said.arguments if isinstance(said, Call) else statement.code
    if statement.word == b"TRIGGER":
        code = _DO.split(code, 1)[0]  # what it does later is looked at elsewhere
    if b"(" not in code:
        return ()
    if statement.kind == StatementKind.MOTION:
        return tuple(name for name in called_in(code[len(statement.word) :]) if name not in _IN_MOTIONS)
    return called_in(code)


@cached
def called_in(code: bytes) -> tuple[bytes, ...]:
    """The names in an expression after which a bracket opens, upper case."""
    names = dict.fromkeys(name.upper() for name in _FUNCTION.findall(without_strings(code)))
    return tuple(name for name in names if name not in _WORDS)


def read_by(statement: Statement) -> Set[bytes]:
    """Names that a statement reads."""
    said = statement.strings
    if isinstance(said, Assignment):
        names = identifiers(said.element) if said.element is not None else set()
        if said.name in (b"$H_POS", b"FDAT_ACT", b"LDAT_ACT", b"PDAT_ACT"):
            return names  # they belong to the inline form of the motion to that point
        read = identifiers(said.value)
        return names | (read - _KEYS if said.value.startswith(b"{") else read)
    if isinstance(said, Declared):
        return {name for _, value, _ in said.items for name in identifiers(value)} - _KEYS
    if isinstance(said, Call):
        return set() if said.name == b"BAS" and bas(said.arguments) else identifiers(said.arguments)
    return identifiers(statement.code)


Directions = Mapping[bytes, tuple[bool, ...]]
"""Name of a routine -> of each parameter whether it comes back changed (OUT)."""


def declared_external(statement: Statement) -> tuple[bytes, tuple[bool, ...]] | None:
    """The routine that an EXT or EXTFCT declares, and of each parameter whether it comes back changed."""
    found = _EXTERNAL.match(statement.code)
    return (found[1].upper(), directions(found[2])) if found else None


def directions(parameters: bytes) -> tuple[bool, ...]:
    """Of each parameter in the head of a routine whether it comes back changed."""
    parts = _DIMENSIONS.sub(b"", parameters).split(b",")[:50]
    return tuple(not part.rstrip().upper().endswith(b"IN") for part in parts)


def as_effects(names: Iterable[bytes]) -> Effects:
    """What it changes where these variables change; of those of the controller what they decide."""
    return {SYSTEM.get(name, name) for name in names}


def effects_of_unknown(code: bytes) -> Effects:
    """What a statement with words that have no meaning there may change, as far as its names say."""
    text = _APART.sub(b"$", without_strings(code))
    names = identifiers(text)
    effects = as_effects(name.upper() for name in _ASSIGNED.findall(text))
    effects |= {SYSTEM[name] for name in names if name in SYSTEM}
    functions = [name for name in called_in(text) if not is_harmless(name)]
    if functions:
        effects |= as_effects(names)
    if functions or HIDDEN.search(text):
        effects.add("point")
    return effects | MODAL if b"BAS" in names else effects


def returned_by(call: Call, known: Directions) -> frozenset[Effect]:
    """What a call may change: of what is handed over other than as IN, and is no expression."""
    if not call.arguments:
        return frozenset()
    comes_back = known.get(call.name, ())
    names = set()
    for i, text in enumerate(split_values(call.arguments)):
        name = returned_to(text) if i >= len(comes_back) or comes_back[i] else None
        if name is not None:
            names.add(name)
    return frozenset(as_effects(names))


def returned_to(text: bytes) -> bytes | None:
    """The variable that a parameter changes for which ``text`` is handed over; None where that is an expression."""
    found = _RETURNED.match(text)
    return found[1].upper() if found else None


def entries_given(call: Call) -> set[bytes | None]:
    """The entries of BASE_DATA and TOOL_DATA that are handed over; None for one whose number is computed."""
    places = (_ENTRY.match(text.strip(b" \t")) for text in split_values(call.arguments))
    return set(map(_entry, filter(None, places)))


def entries_in(code: bytes) -> set[bytes | None]:
    """The entries of BASE_DATA and TOOL_DATA that an expression names; None for one whose number is computed."""
    return set(map(_entry, _ENTRY.finditer(without_strings(code))))


def _entry(found: re.Match[bytes]) -> bytes | None:
    return None if found[2] is None else keyed(found[1].upper(), found[2])


def effects_of(statement: Statement, known: Directions = MappingProxyType({})) -> tuple[Effects, bytes]:
    """What a statement (no motion, no block) may change, and the routine it calls."""
    said = statement.strings
    if statement.kind == StatementKind.UMLAUT_NAME and not isinstance(said, Call):
        return effects_of_unknown(statement.code), b""
    if isinstance(said, Assignment):
        if said.name == b"$VEL" and said.path not in (b"", b"CP"):
            return set(), b""
        if said.name in SYSTEM:
            return {SYSTEM[said.name]}, b""
        if has_unknown_effect(said.name):
            return {said.name}, b""
        if said.name.startswith(b"$") or said.path in EXTERNAL:
            return set(), b""
        return {said.name}, b""
    if isinstance(said, Declared):
        return {key.split(b"[")[0] for key, value, _ in said.items if key and value}, b""
    if isinstance(said, Call):
        if said.name == b"BAS":
            return effects_of_bas(said.arguments), b""
        words: Effects = set() if is_harmless(said.name) else set(returned_by(said, known))
        return words, said.name
    if statement.kind == StatementKind.OPEN and statement.word == b"FOR":
        counter = _COUNTER.match(statement.code)
        return ({counter[1].upper()} if counter else set()), b""
    if statement.kind == StatementKind.UNREADABLE:
        return (EVERYTHING - _NAMED if _MORE.search(statement.code) else {"point"}), b""
    if statement.word == b"RESUME":
        return {"resume"}, b""
    return (
        {"point"} if statement.kind == StatementKind.OTHER and HIDDEN.search(statement.code) else set()
    ), b""
