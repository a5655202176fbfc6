"""Where the advance run stops: before such a statement the controller comes to rest, whatever approximation is
written.

Statements that wait, and those that read or set inputs, outputs or where the robot is, stop it (KUKA System Software 8,
operating and programming instructions for system integrators, "advance run"); CONTINUE before a statement prevents it.
"""

from __future__ import annotations

from collections.abc import Callable

from postproc.base.arrays import Bools
from postproc.languages.core.motion_sources import Source
from postproc.languages.core.waits import Waits
from postproc.languages.krl.lexing import Assignment, Call, Statement, StatementKind, cached, identifiers
from postproc.languages.krl.modal_state import NAN
from postproc.languages.krl.motion_rows import MotionRows
from postproc.languages.krl.predecessors import expanded
from postproc.languages.krl.statement_effects import READS_POSITION, bas
from postproc.languages.krl.system_variables import SYSTEM

_STOPPING = frozenset(b"$IN $OUT $ANIN $ANOUT $DIGIN1 $DIGIN2 $DIGIN3 $DIGIN4 $DIGIN5 $DIGIN6".split())
_FLOWING = frozenset(
    b"$VEL $VEL_AXIS $ACC $ACC_AXIS $JERK $GEAR_JERK $LOAD $ADVANCE $NULLFRAME $OUT_C $FLAG $CYCFLAG $BWDSTART $H_POS "
    b"$SPL_VEL_MODE $SPL_VEL_RESTR BASE_DATA TOOL_DATA LOAD_DATA".split()
) | {name for name, decides in SYSTEM.items() if decides not in ("root", "apart")}
_WORDS = frozenset(
    b"AND OR NOT EXOR B_AND B_OR B_NOT B_EXOR IF THEN WHILE UNTIL FOR TO STEP SWITCH CASE RETURN TRUE FALSE "
    b"ABS SIN COS TAN ACOS ATAN ATAN2 SQRT FORWARD INVERSE INV_POS "
    b"X Y Z A B C S T E1 E2 E3 E4 E5 E6 A1 A2 A3 A4 A5 A6".split()
)
_SILENT_WORDS = frozenset(
    b"TRIGGER INTERRUPT GLOBAL CONTINUE EXT EXTFCT EXTP IMPORT SIGNAL ENUM STRUC INI BRAKE".split()
)
_SILENT_KINDS = (
    StatementKind.COMMENT,
    StatementKind.DEF,
    StatementKind.END,
    StatementKind.LABEL,
    StatementKind.GOTO,
    StatementKind.EXIT,
    StatementKind.DECLARATION,
)
_DECIDING = frozenset(b"IF WHILE UNTIL FOR SWITCH CASE RETURN".split())
_TALKING = frozenset(
    b"IR_STOPM CWRITE CREAD SREAD SWRITE COPEN CCLOSE MBX_REC MSGNOTIFY MSGQUIT MSGDIALOG MSGLOOP CONFIRM DELMENS "
    b"IS_KEY_PRESSED GETSYSSTATE GET_SIG_INF TIMER_LIMIT".split()
)


def stop_of(statement: Statement, continued: bool, type_of: Callable[[bytes], bytes]) -> Waits:
    """Whether the advance run stops at a statement other than a motion; continued: CONTINUE is before it; type_of: the
    type with which a variable is declared.  What is not declared may be a signal, and stop it."""
    found = _stop(statement, type_of)
    if found is Waits.YES and continued:
        return Waits.MAYBE if statement.word == b"WAIT" else Waits.NO
    return found


def _stop(statement: Statement, type_of: Callable[[bytes], bytes]) -> Waits:
    kind, word, said = statement.kind, statement.word, statement.strings
    if word in (b"WAIT", b"HALT"):
        return Waits.YES
    if word in _SILENT_WORDS or kind in _SILENT_KINDS:
        return Waits.NO
    if word in (b"ANOUT", b"ANIN", b"DIGIN") or kind in (StatementKind.UNREADABLE, StatementKind.UMLAUT_NAME):
        return Waits.MAYBE
    if isinstance(said, Call):
        if said.name == b"PULSE":
            return Waits.YES
        return max(Waits.MAYBE if said.name in _TALKING else Waits.NO, _read_of_system(said.arguments))
    if isinstance(said, Assignment) and said.name in _FLOWING:
        return _read_of_system(said.value)
    if isinstance(said, Assignment):
        return max(_name(said.name, type_of), _read(said.element or b"", type_of), _read(said.value, type_of))
    return _read(statement.code, type_of) if word in _DECIDING else Waits.NO


def _read(code: bytes, type_of: Callable[[bytes], bytes]) -> Waits:
    if not code or code.isdigit():
        return Waits.NO
    return max((_name(name, type_of) for name in _names(code)), default=Waits.NO)


def _read_of_system(code: bytes) -> Waits:
    """The same where no signal is read: in records, and in what is handed over."""
    if b"$" not in code:
        return Waits.NO
    names = (name for name in _names(code) if name.startswith(b"$"))
    return max((_name(name, lambda _: b"") for name in names), default=Waits.NO)


@cached
def _names(code: bytes) -> frozenset[bytes]:
    return identifiers(code) - _WORDS


def _name(name: bytes, type_of: Callable[[bytes], bytes]) -> Waits:
    if name in _STOPPING or READS_POSITION.match(name):
        return Waits.YES
    if name in _FLOWING or (not name.startswith(b"$") and type_of(name)):
        return Waits.NO
    return Waits.MAYBE


def advance_of(statement: Statement) -> Waits | None:
    """What a statement makes of $ADVANCE: YES where no motion is planned ahead of another; None: nothing."""
    said = statement.strings
    if isinstance(said, Assignment) and said.name == b"$ADVANCE":
        digits = said.value.strip()
        if not digits.isdigit():
            return Waits.MAYBE
        return Waits.NO if int(digits) else Waits.YES
    if isinstance(said, Call) and said.name == b"BAS" and (bas(said.arguments) or (b"",))[0] == b"INITMOV":
        return Waits.NO
    return None


def stopped_motions(rows: MotionRows, continues: Bools) -> dict[int, float]:
    """Rows that are not approximated, because the advance run stops after them -> 0; NaN where only maybe it does.

    continues (N,): rows that surely start where the row before ends, at which no other motion starts.
    """
    found: dict[int, float] = {}
    perhaps_before: set[Source] = set()
    for row, stop in rows.stopped.items():
        if row and continues[row]:
            found[row - 1] = 0.0 if stop == Waits.YES else NAN
        else:
            perhaps_before.update(rows.sources_of.get(row, {row - 1}))
    found |= {before: NAN for before in expanded(rows, perhaps_before) if before >= 0}
    if rows.stopped_at_end:
        surely, perhaps = (
            expanded(rows, {source for _, of, stop in rows.stopped_at_end if stop == wanted for source in of})
            for wanted in (Waits.YES, Waits.MAYBE)
        )
        goes_on = expanded(rows, {source for sources in rows.sources_of.values() for source in sources})
        only = surely - perhaps - goes_on
        found |= {
            row: 0.0 if row in only and row == len(rows) - 1 else NAN for row in surely | perhaps if row >= 0
        }
    # what runs before the first motion of another module, or after a routine that is read apart, is not worked out
    called = expanded(rows, {source for _, sources in rows.calls for source in sources})
    left = expanded(rows, rows.unfollowed_ends) - found.keys()
    return found | {before: NAN for before in called | left if before >= 0}
