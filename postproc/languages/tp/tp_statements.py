"""The statements of a TP program, as the flow and the motions need them."""

from __future__ import annotations

from dataclasses import dataclass

INSERTED_CNT = 100
"""Number of CNT of what is inserted where the robot does not stop, into a motion that does."""


@dataclass(frozen=True, slots=True)
class RegisterOperand:
    """R[n]."""

    number: int


Operand = float | RegisterOperand | None
"""A number, a register, or what is not known before it runs."""


@dataclass(frozen=True, slots=True)
class RegisterExpression:
    """``first`` alone (operation b""), or with ``operation`` (+, -, *, /, DIV, MOD) and ``second``."""

    first: Operand
    operation: bytes = b""
    second: Operand = None


@dataclass(frozen=True, slots=True)
class PointReference:
    """A point in a motion.  ``span``: start and stop of the number of P[n] in the text of the statement, -1 for another
    form, which ``reason`` names then."""

    span: tuple[int, int]
    reason: str = ""


@dataclass(frozen=True, slots=True)
class TpMove:
    """A motion; those that are alike but for the number of their point share one.

    ``form``: J, L, C or A; ``points``: its target, before it the auxiliary point of C; ``speed``: text and value with
    its unit; ``termination``: its text; ``corner``: FINE, CNT or CR with its number, None where a register has it;
    ``carried``: options that inserted motions have too; ``own``: it has options that count from its own start;
    ``wrist``: Wjnt; ``problem``: code and reason for which it is not corrected; ``skip``: label to which it may lead.
    ``head``: start and stop of the letter of its form in the text of the statement; ``alters``: what it does beside
    its path (TB, TA, DB) may set registers; ``relative``: its target counts from where the robot is (INC);
    ``called``: the program that it calls beside its path; ``paced``: an option changes its speed (PSPD);
    ``linear``: RT where it leaves its start in a line (RT_LD), AP where it comes to its target in one (AP_LD).
    """

    form: bytes
    points: tuple[PointReference, ...]
    speed: bytes
    value: Operand
    unit: bytes
    termination: bytes
    corner: tuple[bytes, float | None]
    carried: bytes
    own: bool
    wrist: bool
    problem: tuple[str, str] | None
    skip: int | None
    head: tuple[int, int]
    alters: bool = False
    relative: bool = False
    called: str = ""
    paced: bool = False
    linear: frozenset[bytes] = frozenset()


@dataclass(frozen=True, slots=True)
class TpRemark:
    """A comment (! or //) and its text without blanks around it; ``start``, ``stop``: of it and its sign."""

    text: str
    start: int
    stop: int


@dataclass(frozen=True, slots=True)
class LabelStatement:
    number: int


@dataclass(frozen=True, slots=True)
class JumpStatement:
    """JMP LBL[n]; None: the label is computed."""

    label: int | None


@dataclass(frozen=True, slots=True)
class ConditionalStatement:
    """``action`` where a condition holds; ``condition``: left, sign, right where registers and numbers decide it."""

    condition: tuple[Operand, bytes, Operand] | None
    action: TpStatement


@dataclass(frozen=True, slots=True)
class TimeoutStatement:
    """A WAIT that may go on at a label."""

    label: int | None


@dataclass(frozen=True, slots=True)
class WaitStatement:
    """A WAIT or PAUSE; ``surely``: it is not over when the next motion would have to be planned."""

    surely: bool


@dataclass(frozen=True, slots=True)
class BlockStart:
    """IF ... THEN."""


@dataclass(frozen=True, slots=True)
class BlockElse:
    pass


@dataclass(frozen=True, slots=True)
class BlockEnd:
    """ENDIF."""


@dataclass(frozen=True, slots=True)
class LoopStart:
    """FOR R[n]=first TO last."""

    register: int


@dataclass(frozen=True, slots=True)
class LoopEnd:
    pass


@dataclass(frozen=True, slots=True)
class ProgramCall:
    name: str


@dataclass(frozen=True, slots=True)
class ProgramEnd:
    """END, ABORT."""


@dataclass(frozen=True, slots=True)
class FrameSelection:
    """UFRAME_NUM or UTOOL_NUM (``is_tool``) = value."""

    is_tool: bool
    value: RegisterExpression


@dataclass(frozen=True, slots=True)
class RegisterAssignment:
    register: int
    value: RegisterExpression


@dataclass(frozen=True, slots=True)
class PositionUse:
    """Statements that assign points (``assigned``; None: which one is computed) or frames, or read points or where the
    robot is.  ``frame``: number of a base or tool that is assigned, None without, -1 where it is computed;
    ``register``: likewise of a register that gets a value that is not known."""

    assigned: tuple[int | None, ...] = ()
    read: tuple[int | None, ...] = ()
    reads_place: bool = False
    is_tool: bool = False
    frame: int | None = None
    register: int | None = None


@dataclass(frozen=True, slots=True)
class OverrideStatement:
    """OVERRIDE=n%, None where the number is not known."""

    percent: float | None


@dataclass(frozen=True, slots=True)
class SpeedChange:
    """What changes speeds beside OVERRIDE, which does not end it: a limit, or another factor."""


@dataclass(frozen=True, slots=True)
class DisplacementSwitch:
    """Targets are displaced from here on (``starts``), or no longer."""

    name: bytes
    starts: bool


@dataclass(frozen=True, slots=True)
class OtherStatement:
    """A statement that moves nothing."""


@dataclass(frozen=True, slots=True)
class StatementNotRead:
    """A statement that is not understood.  ``displaces``: it may displace the targets after it; ``moves``: it starts as
    a motion does; ``slows``: it may change speeds in a manner that OVERRIDE does not end."""

    displaces: bool = False
    moves: bool = False
    slows: bool = False


TpStatement = (
    TpMove
    | TpRemark
    | LabelStatement
    | JumpStatement
    | ConditionalStatement
    | TimeoutStatement
    | WaitStatement
    | BlockStart
    | BlockElse
    | BlockEnd
    | LoopStart
    | LoopEnd
    | ProgramCall
    | ProgramEnd
    | FrameSelection
    | RegisterAssignment
    | PositionUse
    | OverrideStatement
    | SpeedChange
    | DisplacementSwitch
    | OtherStatement
    | StatementNotRead
)
