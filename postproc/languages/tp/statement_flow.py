"""Where the flow of a TP program goes on after each statement."""

from __future__ import annotations

from postproc.languages.tp.tp_statements import (
    BlockElse,
    BlockEnd,
    BlockStart,
    ConditionalStatement,
    JumpStatement,
    LabelStatement,
    LoopEnd,
    LoopStart,
    ProgramEnd,
    TimeoutStatement,
    TpMove,
    TpStatement,
)

END = -1
"""In the place of a statement: the end of the program."""


MOST_JUMPS = 50_000
"""Places to which computed jumps may lead, all together."""


class StatementFlow:
    """The blocks of a program, each of statements that run from its first to its last.

    ``problem``: index of a statement whose structure is not understood, and why; None where all is.
    ``blocks``: first and last + 1 statement of each; ``block_at``: first statement -> block.
    """

    def __init__(self, statements: list[TpStatement]) -> None:
        self.statements = statements
        self.problem: tuple[int, str] | None = None
        self.labels: dict[int, int] = {}
        self._partners: dict[int, int] = {}
        self._find_labels()
        self._match_blocks()
        if self.problem is None:
            self._check_jumps()
        self.blocks: list[tuple[int, int]] = []
        self.block_at: dict[int, int] = {}
        if self.problem is None and statements:
            self._cut()

    def _find_labels(self) -> None:
        for at, one in enumerate(self.statements):
            if isinstance(one, LabelStatement):
                if one.number in self.labels:
                    self._refuse(at, f"LBL[{one.number}] is in the program twice")
                self.labels.setdefault(one.number, at)

    def _refuse(self, at: int, why: str) -> None:
        if self.problem is None:
            self.problem = (at, why)

    def _match_blocks(self) -> None:
        """Partners: IF -> where it goes on without its condition, ELSE -> ENDIF, FOR <-> ENDFOR."""
        opened: list[int] = []
        for at, one in enumerate(self.statements):
            match one:
                case BlockStart() | LoopStart():
                    opened.append(at)
                case BlockElse():
                    if not opened or not isinstance(self.statements[opened[-1]], BlockStart):
                        self._refuse(at, "ELSE has no IF")
                        continue
                    self._partners[opened.pop()] = at + 1
                    opened.append(at)
                case BlockEnd():
                    if not opened or isinstance(self.statements[opened[-1]], LoopStart):
                        self._refuse(at, "ENDIF has no IF")
                        continue
                    self._partners[opened.pop()] = at
                case LoopEnd():
                    if not opened or not isinstance(self.statements[opened[-1]], LoopStart):
                        self._refuse(at, "ENDFOR has no FOR")
                        continue
                    start = opened.pop()
                    self._partners[start], self._partners[at] = at + 1, start
        if opened:
            self._refuse(opened[-1], "a block that starts here has no end")

    def targets(self, one: TpStatement) -> list[int | None]:
        """Labels to which a statement may lead; None for one that is computed."""
        match one:
            case JumpStatement() | TimeoutStatement():
                return [one.label]
            case ConditionalStatement():
                return self.targets(one.action)
            case TpMove():
                return [] if one.skip is None else [one.skip]
            case _:
                return []

    def _check_jumps(self) -> None:
        computed = sum(None in self.targets(one) for one in self.statements)
        if computed * len(self.labels) > MOST_JUMPS:
            self._refuse(0, "too many computed jumps may lead to too many labels")
        for at, one in enumerate(self.statements):
            for label in self.targets(one):
                if label is not None and label not in self.labels:
                    self._refuse(at, f"LBL[{label}] is not in the program")

    def _cut(self) -> None:
        starts = {0, *self.labels.values()}
        for at, one in enumerate(self.statements):
            if self.targets(one) or isinstance(
                one, ProgramEnd | BlockStart | BlockElse | LoopEnd | ConditionalStatement
            ):
                starts.add(at + 1)
            if isinstance(one, LoopStart | BlockEnd):
                starts |= {at, at + 1}
        ordered = sorted(at for at in starts if at < len(self.statements))
        for at, following in zip(ordered, [*ordered[1:], len(self.statements)], strict=True):
            self.block_at[at] = len(self.blocks)
            self.blocks.append((at, following))

    def after(self, at: int) -> list[int]:
        """Statements that may follow the statement ``at``, END among them; a condition is not decided here."""
        one = self.statements[at]
        follow = self._next(at + 1)
        match one:
            case ProgramEnd():
                return [END]
            case JumpStatement():
                return self._leads(one)
            case ConditionalStatement(action=ProgramEnd()):
                return [follow, END]
            case BlockStart() | LoopStart():
                return [follow, self._next(self._partners[at])]
            case BlockElse():
                return [self._next(self._partners[at])]
            case LoopEnd():
                return [self._partners[at]]
            case _:
                return [follow, *self._leads(one)]

    def _next(self, at: int) -> int:
        return at if at < len(self.statements) else END

    def _leads(self, one: TpStatement) -> list[int]:
        found: list[int] = []
        for label in self.targets(one):
            found += self.labels.values() if label is None else [self.labels[label]]
        return found or ([END] if isinstance(one, JumpStatement) else [])
