"""The instructions of RAPID that move the robot, that say how, and that do neither.

Source: ABB, Technical reference manual, RAPID Instructions, Functions and Data types.
"""

from __future__ import annotations

from dataclasses import dataclass

from postproc.languages.rapid.syntax_tree import Argument, Expression
from postproc.toolpath import Kind


@dataclass(frozen=True, slots=True)
class MotionForm:
    """Which required arguments a motion has: points first (the last one is the target), then the speed, ``extra`` of
    a process, zone and tool, ``after`` of a signal.

    ``starts_process``: nothing can be inserted before it; ``feed``: the speed is that of its speeddata; ``calls``: its
    last argument names a routine that is run while the robot moves.
    """

    kind: Kind
    points: int = 1
    extra: tuple[int, ...] = (0,)
    after: int = 0
    options: frozenset[bytes] = frozenset()
    starts_process: bool = False
    feed: bool = True
    calls: bool = False


@dataclass(frozen=True, slots=True)
class MotionArguments:
    """The arguments of a motion by their role; ``options``: optional ones by their names."""

    points: tuple[Argument, ...]
    speed: Argument
    zone: Argument
    tool: Argument
    options: dict[bytes, Argument]


_COMMON = frozenset([b"CONC", b"ID", b"V", b"T", b"Z", b"INPOS", b"WOBJ", b"CORR", b"TLOAD"])
_AXES = _COMMON | {b"NOEOFFS"}
_TRIGGERS = _COMMON | {b"T%d" % number for number in range(2, 9)}
_WELDING = _COMMON | {b"ON", b"OFF", b"WEAVE", b"SEAMNAME", b"TRACK", b"TIME"}


def _forms() -> dict[bytes, MotionForm]:
    forms = {b"MOVEABSJ": MotionForm(Kind.AXIS, options=_AXES)}
    for letter, kind, points in ((b"L", Kind.LIN, 1), (b"J", Kind.PTP, 1), (b"C", Kind.CIRC, 2)):
        forms[b"MOVE" + letter] = MotionForm(kind, points, options=_COMMON)
        for signal in (b"DO", b"AO", b"GO"):
            forms[b"MOVE" + letter + signal] = MotionForm(kind, points, after=2, options=_COMMON)
        forms[b"MOVE" + letter + b"SYNC"] = MotionForm(kind, points, after=1, options=_COMMON, calls=True)
        forms[b"TRIGG" + letter] = MotionForm(kind, points, (1,), options=_TRIGGERS, starts_process=True)
        for part in (b"", b"START", b"END") if kind != Kind.PTP else ():
            forms[b"ARC" + letter + part] = MotionForm(
                kind, points, (2, 3), options=_WELDING, starts_process=True, feed=False
            )
    return forms


MOTIONS = _forms()
"""Instruction -> its form."""

OTHER_MOTIONS = frozenset(
    b"MOVEEXTJ SEARCHL SEARCHC SEARCHEXTJ TRIGGLIOS TRIGGJIOS TRIGGABSJ CAPL CAPC SPOTL SPOTJ SPOTML SPOTMJ"
    b" DISPL DISPC PAINTL PAINTC ARCADAPTL ARCCALCL ARCREFRESH ARCMOVEL ARCMOVEJ ARCMOVEC ARCMOVEABSJ"
    b" STEPBWDPATH MOVEPNP".split()
)
"""Instructions that move the robot and are not read."""

DISPLACING = frozenset(b"PDISPON PDISPSET EOFFSON EOFFSSET CORRCON CORRWRITE SOFTACT CSSACT".split())
"""Instructions after which targets are not where the text says, or the arm is soft."""
RESTORING = {
    b"PDISPOFF": (b"PDISPON", b"PDISPSET"),
    b"EOFFSOFF": (b"EOFFSON", b"EOFFSSET"),
    b"CORRCLEAR": (b"CORRCON", b"CORRWRITE"),
    b"CORRDISCON": (),
    b"SOFTDEACT": (b"SOFTACT",),
    b"CSSDEACT": (b"CSSACT",),
}
"""Instruction -> those whose effect it ends."""

WRITERS = frozenset(
    b"INCR DECR ADD CLEAR TPREADFK TPREADNUM TPREADDNUM GETSYSDATA BITSET BITCLEAR READRAWBYTES UNPACKRAWBYTES"
    b" COPYRAWBYTES GETDATAVAL TRYINT UIMSGBOX STORE RECVMSG SOCKETRECEIVE".split()
)
"""Instructions that change variables named in their arguments."""

SCALING = frozenset(b"SPEEDREFRESH TRIGGSPEED SPEEDLIMAXIS SPEEDLIMCHECKPOINT".split())
"""Instructions after which speeds are not those of the text, whatever VelSet states: it acts beside them."""
AT_ONCE = frozenset([b"SPEEDREFRESH"])
"""Of these what changes the speed of the motion that runs."""

HARMLESS = (
    WRITERS
    | DISPLACING
    | SCALING
    | RESTORING.keys()
    | frozenset(
        b"SET RESET SETDO SETAO SETGO PULSEDO INVERTDO WAITTIME WAITDI WAITDO WAITAI WAITAO WAITGI WAITGO WAITUNTIL"
        b" WAITROB TPWRITE TPERASE TPSHOW ERRWRITE ERRLOG ACCSET PATHACCLIM WORLDACCLIM CONFL CONFJ SINGAREA"
        b" CIRPATHMODE VELSET MOTIONSUP STOP BREAK CLKRESET CLKSTART CLKSTOP IDELETE ISIGNALDI ISIGNALDO"
        b" ISIGNALAI ISIGNALAO ISIGNALGI ISIGNALGO ITIMER IENABLE IDISABLE ISLEEP IWATCH IERROR IPERS OPEN CLOSE WRITE"
        b" WRITEBIN WRITESTRBIN WRITEANYBIN REWIND GRIPLOAD PATHRESOL SPYSTART SPYSTOP TRIGGIO TRIGGEQUIP TRIGGINT"
        b" TRIGGCHECKIO TRIGGRAMPAO LOAD STARTLOAD WAITLOAD UNLOAD ERASEMODULE SAVE LOGEVENT SETSYSDATA"
        b" SOCKETCREATE SOCKETCLOSE SOCKETCONNECT SOCKETSEND SOCKETBIND SOCKETLISTEN SOCKETACCEPT TUNESERVO"
        b" TUNERESET UISHOW WZFREE WZENABLE WZDISABLE WZDOSET WZLIMSUP WZBOXDEF WZCYLDEF WZSPHDEF"
        b" SETALLDATAVAL SETDATASEARCH SETDATAVAL SYNCMOVESUSPEND WAITSYNCTASK CONNECT"
        b" RESETRETRYCOUNT SKIPWARN".split()
    )
    - {b"SETDATAVAL", b"SETALLDATAVAL", b"SYNCMOVESUSPEND", b"STORE"}
)
"""Instructions that move nothing and change no data but that of ``WRITERS``."""


PURE = frozenset(
    b"OFFS RELTOOL ABS SQRT SIN COS TAN ASIN ACOS ATAN ATAN2 POW EXP ROUND TRUNC DIM PRESENT CROBT CJOINTT CPOS CTOOL"
    b" CWOBJ CALCROBT CALCJOINTT ORIENTZYX EULERZYX POSEMULT POSEINV POSEVECT NORIENT DISTANCE DOTPROD VECTMAGN"
    b" DOUTPUT AOUTPUT GOUTPUT TESTDI VALTOSTR NUMTOSTR STRLEN STRPART STRFIND CLKREAD CTIME CDATE GETTIME OPMODE"
    b" RUNMODE ROBOS ISPERS ISVAR VALIDIO MAXROBSPEED DEFFRAME DEFDFRAME MIRPOS ORI".split()
)
"""Functions of the controller that change nothing."""

MODES = DISPLACING | SCALING | {b"CONFL", b"CONFJ", b"SINGAREA", b"CIRPATHMODE", b"VELSET"}
"""Instructions after which motions are meant otherwise."""

ANY_PROCEDURE = (b"%", b"CALLBYVAR")
"""What a call starts with whose procedure is named by a string."""

SETS_BY_NAME = frozenset([b"SETDATAVAL", b"SETALLDATAVAL"])
"""Instructions that change data whose name is a string."""

READERS = frozenset([b"CROBT", b"CJOINTT", b"CPOS", b"PDISPON", b"EOFFSON"])
"""What reads where the robot is."""


HALTING = frozenset(b"STOP BREAK WAITROB TPREADFK TPREADNUM UIMSGBOX".split())
"""Instructions at which the program waits until the robot stands, or for an operator."""
WAITING = frozenset(
    b"WAITDI WAITDO WAITAI WAITAO WAITGI WAITGO WAITUNTIL WAITSYNCTASK WAITLOAD RECVMSG SOCKETRECEIVE SOCKETCONNECT"
    b" SOCKETACCEPT LOAD UNLOAD".split()
)
"""Instructions at which it waits for what maybe is so already."""
SHORTEST_WAIT_S = 0.2
"""WaitTime of as much is not over when the robot, which the program is ahead of, is in the zone."""


def is_motion(word: bytes) -> bool:
    """Whether an instruction moves the robot."""
    return word in MOTIONS or word in OTHER_MOTIONS


def sort_arguments(form: MotionForm, arguments: tuple[Argument, ...]) -> MotionArguments | None:
    """The arguments of a motion by their role; None where one has none, is missing or occurs twice."""
    required = [argument for argument in arguments if not argument.name]
    options = {argument.name: argument for argument in arguments if argument.name}
    count = len(required) - form.points - form.after - 3
    if count not in form.extra or len(options) + len(required) < len(arguments):
        return None
    if not options.keys() <= form.options:
        return None
    zone = form.points + 1 + count
    return MotionArguments(
        tuple(required[: form.points]), required[form.points], required[zone], required[zone + 1], options
    )


def switch_value(argument: Argument | None) -> Expression | None:
    """The value of an optional argument; None where it is not there."""
    return None if argument is None else argument.value
