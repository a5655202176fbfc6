"""What a program may change where: its routines, its blocks and labels, before it is interpreted."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

from postproc.languages.core.comments_in_force import place_of
from postproc.languages.krl.aliases import Handed, Parameters, parameters_of, spread
from postproc.languages.krl.later_changes import EVENTS, later_actions, later_functions
from postproc.languages.krl.lexing import (
    BEFORE_CASES,
    BRANCHES,
    CLOSES,
    FRAME_TABLES,
    LOOPS,
    Assignment,
    Call,
    Declared,
    Head,
    Statement,
    StatementKind,
    identifiers,
)
from postproc.languages.krl.program_blocks import Block, Routine
from postproc.languages.krl.routine_calls import closure
from postproc.languages.krl.statement_effects import (
    ANNOTATION,
    HERE,
    MODAL,
    Directions,
    Effect,
    Effects,
    as_effects,
    declared_external,
    effects_of,
    effects_of_bas,
    effects_of_unknown,
    entries_given,
    entries_in,
    functions_of,
    is_harmless,
    read_by,
    returned_by,
)
from postproc.languages.krl.statement_forms import is_well_formed
from postproc.languages.krl.system_variables import SYSTEM

NO_EFFECTS: Mapping[bytes, Effects] = MappingProxyType({})
NO_DIRECTIONS: Directions = MappingProxyType({})

MOST_EFFECTS = 200
"""Variables of one block; where it assigns more, all that the program assigns count as changed."""

MOST_NOTED = 1000
"""Statements of a block that are known again."""

DEEPEST = 100
"""Nested blocks; what lies deeper is passed over as one."""

INLINE = re.compile(rb";[ \t]*FOLD[ \t]+(?:S?(?:PTP|LIN|CIRC)|SPL)(?![A-Za-z0-9_])", re.I)
_FOLD = re.compile(rb";[ \t]*(END)?FOLD(?![A-Za-z0-9_])", re.I)


@dataclass
class ProgramStructure:
    """``events``: index of a statement -> what it opens, branches or closes, in this order of closing.

    ``routine_at``: index of the DEF -> routine; ``unclosed``: (line, what) of blocks without an end and ends
    without a start; ``assigned``: names that the program assigns as a whole, or with ``.X`` after them a
    component of; ``read``: names that code reads, other than as the target of a motion; ``table_entries``:
    entries of BASE_DATA and TOOL_DATA that it assigns, None for one whose number is computed; ``later``:
    names that run or change at a time of their own (interrupts, triggers); ``later_effects``: what these
    change of base, tool and modes; ``inline``: lines of motions in the fold of an inline form; ``jumps``:
    start of the routine and name of every label that a GOTO names -> first and last index of these;
    ``effects``: all that the program changes anywhere; ``blocks``: all of them; ``ill_formed``: the code of statements
    with words that have no meaning there; ``directions``: name of a routine ->
    of each parameter whether it comes back changed; ``handed``: what calls hand over;
    ``aliases``: effect -> what else may be the same variable in a routine of whose callers nothing is known.
    """

    events: dict[int, list[tuple[str, Block]]] = field(default_factory=dict)
    routines: dict[bytes, Routine] = field(default_factory=dict)
    routine_at: dict[int, Routine] = field(default_factory=dict)
    assigned: set[bytes] = field(default_factory=set)
    read: set[bytes] = field(default_factory=set)
    table_entries: set[bytes | None] = field(default_factory=set)
    later: set[bytes] = field(default_factory=set)
    later_effects: Effects = field(default_factory=set)
    jumps: dict[tuple[int, bytes], tuple[int, int]] = field(default_factory=dict)
    blocks: list[Block] = field(default_factory=list)
    ill_formed: set[bytes] = field(default_factory=set)
    effects: Effects = field(default_factory=set)
    inline: set[int] = field(default_factory=set)
    unclosed: list[tuple[int, str]] = field(default_factory=list)
    directions: dict[bytes, tuple[bool, ...]] = field(default_factory=dict)
    handed: set[Handed] = field(default_factory=set)
    aliases: dict[Effect, frozenset[Effect]] = field(default_factory=dict)

    @property
    def has_routine(self) -> bool:
        return bool(self.routine_at)


class _Surveyor:
    def __init__(self, directions: Directions) -> None:
        self.found = ProgramStructure(directions=dict(directions))
        self.blocks: list[Block] = []
        self.stack: list[Block] = []
        self.buried = 0  # blocks deeper than DEEPEST that are open
        self.routine: Routine | None = None
        self.folds: list[bool] = []  # those that are open, and whether it is that of an inline form
        self.inline = 0
        self.noted_in: Block | None = None
        self.noted: set[bytes] = set()  # statements of that block, which say no more a second time

    def take(self, index: int, statement: Statement) -> None:
        kind, stack = statement.kind, self.stack
        if kind not in (StatementKind.OPEN, StatementKind.DEF):
            self._note_comment(statement)
        if kind not in (StatementKind.MOTION, StatementKind.COMMENT) and not is_well_formed(statement):
            self._ill_formed(statement)
        if stack and stack[-1].word == b"SWITCH" and not stack[-1].branches:
            self._before_first_case(statement)
        if kind == StatementKind.MOTION:
            if stack and not _stays(statement.code):
                stack[-1].effects.add("point")
            if functions_of(statement):
                self.note(statement)
            if self.inline:
                self.found.inline.add(statement.line)
        elif kind == StatementKind.COMMENT:
            self._fold(statement.comment)
        elif kind == StatementKind.DEF:
            self._routine(index, statement)
            self._note_comment(statement)  # it is in what is opened
        elif kind == StatementKind.END:
            if not stack or not isinstance(stack[0], Routine):
                self._close_all(index)
                self.found.unclosed.append((statement.line, f"{_shown(statement.word)} has no DEF"))
            else:
                self._close_all(index)
        elif kind == StatementKind.OPEN:
            self._open(index, statement)
            self._note_comment(statement)
        elif kind == StatementKind.BRANCH:
            self.note(statement)
            if not self.buried and stack and stack[-1].word == BRANCHES[statement.word]:
                if statement.code in self.found.ill_formed or functions_of(statement):
                    stack[-1].broken = True  # `ELSE IF` opens no block, and a CASE calls nothing
                stack[-1].branches.append(index)
                self.found.events[index] = [(StatementKind.BRANCH, stack[-1])]
        elif kind == StatementKind.CLOSE:
            self._close(index, statement)
        elif kind == StatementKind.GOTO:
            if self.routine is not None and isinstance(statement.strings, bytes):
                key = (self.routine.start, statement.strings)
                self.found.jumps[key] = (self.found.jumps.get(key, (index, index))[0], index)
        elif kind == StatementKind.EXIT:
            loop = next((block for block in reversed(stack) if block.word in LOOPS), None)
            if loop is not None:
                loop.leaves = True
        elif kind == StatementKind.LABEL and isinstance(statement.strings, bytes):
            if self.routine is not None:
                self.routine.labels.setdefault(statement.strings, (index, tuple(stack[1:])))
        else:
            if statement.word == b"ELSEIF" and stack:
                stack[-1].broken = True  # no KRL, and no end of what is before it
            self.note(statement)

    def _note_comment(self, statement: Statement) -> None:
        if statement.comment and ANNOTATION.match(statement.comment):
            changed = place_of(statement.comment[1:].decode("latin-1").strip())
            self.found.effects.add(changed)
            if self.stack:
                self.stack[-1].effects.add(changed)

    def _ill_formed(self, statement: Statement) -> None:
        found, code = self.found, statement.code
        if code in found.ill_formed:
            effects = effects_of_unknown(code) if self.stack else set()
        else:
            found.ill_formed.add(code)
            effects = effects_of_unknown(code)
            found.assigned.update(effect for effect in effects if isinstance(effect, bytes))
            _join(found.effects, effects)
        if self.stack:
            _join(self.stack[-1].effects, effects)

    def _before_first_case(self, statement: Statement) -> None:
        block = self.stack[-1]
        if not block.broken and statement.kind not in BEFORE_CASES:
            block.broken = True
            self.found.unclosed.append((statement.line, "a statement is between SWITCH and its first CASE"))

    def _fold(self, comment: bytes) -> None:
        found = _FOLD.match(comment)
        if found is None:
            return
        if not found[1]:
            self.folds.append(INLINE.match(comment) is not None)
            self.inline += self.folds[-1]
        elif self.folds:
            self.inline -= self.folds.pop()

    def _routine(self, index: int, statement: Statement) -> None:
        if self.stack:
            self._close_all(index - 1)
            self.found.unclosed.append((statement.line, "a DEF starts before the END of the previous one"))
        head = statement.strings if isinstance(statement.strings, Head) else Head(b"", ())
        routine = Routine(
            b"DEF", statement.line, index,
            name=head.name, is_main=not self.found.routine_at, is_global=statement.word == b"GLOBAL",
            parameters=head.parameters,
            is_function=b"DEFFCT" in statement.code[:40].upper(),
            types={name: b"" for name, _ in head.parameters},
        )  # fmt: skip
        self.routine = routine
        self.found.routine_at[index] = routine
        self.found.routines.setdefault(head.name, routine)
        self.blocks.append(routine)
        self.stack.append(routine)

    def _open(self, index: int, statement: Statement) -> None:
        self.note(statement)
        if len(self.stack) > DEEPEST:
            self.buried += 1
            self.stack[-1].broken = True
            self.stack[1].broken = True  # a loop around a loop is passed again for each level
            return
        if not self.stack:  # a program without DEF
            self.stack.append(Block(b"", 0, 0))
            self.blocks.append(self.stack[0])
        block = Block(statement.word, statement.line, index)
        self.blocks.append(block)
        self.stack.append(block)
        self.note(statement)
        self.found.events[index] = [(StatementKind.OPEN, block)]

    def _close(self, index: int, statement: Statement) -> None:
        stack = self.stack
        if self.buried:
            self.buried -= 1
            self.note(statement)
            return
        wanted = CLOSES[statement.word]
        depth = next((i for i in range(len(stack) - 1, 0, -1) if stack[i].word in wanted), 0)
        if not depth:
            self.found.unclosed.append((statement.line, f"{_shown(statement.word)} has no start"))
            return
        self.note(statement)
        self._pop(index, depth)

    def _pop(self, index: int, depth: int, proper: bool = True) -> None:
        """Closes the blocks from ``depth`` on; ``proper``: the outermost of them has its own end here."""
        stack = self.stack
        closed = stack[depth:][::-1]
        del stack[depth:]
        inner = closed[:-1] if proper else closed
        for block in inner:
            block.broken = True
            self.found.unclosed.append((block.line, f"{_shown(block.word)} has no end"))
        for i, block in enumerate(closed):
            block.end = index
            outer = closed[i + 1] if i + 1 < len(closed) else stack[-1]
            _join(outer.effects, block.effects)
            outer.calls |= block.calls
        self.found.events.setdefault(index, []).extend((StatementKind.CLOSE, block) for block in closed)

    def _close_all(self, index: int) -> None:
        self.buried = 0
        if not self.stack:
            return
        if len(self.stack) > 1:
            self._pop(index, 1, proper=False)
        self.stack.pop().end = index
        self.routine = None

    def note(self, statement: Statement) -> None:
        """Takes up what a statement that moves nothing changes and reads."""
        found, stack = self.found, self.stack
        block = stack[-1] if stack else None
        if block is not self.noted_in:
            self.noted_in = block
            self.noted.clear()
        if statement.code in self.noted:
            return
        if len(self.noted) < MOST_NOTED:
            self.noted.add(statement.code)
        effects, called = effects_of(statement, found.directions)
        functions = functions_of(statement)
        if not all(map(is_harmless, functions)):
            # What is handed to a function may come back changed.
            effects = effects | identifiers(statement.code)
            found.table_entries |= entries_in(statement.code)
            found.handed.add(Handed(functions, statement.code, is_call=False))
        _join(found.effects, effects)
        said = statement.strings
        if statement.word in (b"EXT", b"EXTFCT", b"EXTP") and (declared := declared_external(statement)):
            found.directions.setdefault(*declared)
        if isinstance(said, Assignment) and said.name in FRAME_TABLES:
            found.table_entries.add(said.key)
        if isinstance(said, Assignment) and said.path and said.element is None and len(effects) == 1:
            found.assigned.add(said.name + b"." + said.path)
        else:
            found.assigned.update(effect for effect in effects if isinstance(effect, bytes))
        if isinstance(said, Call) and not effects.isdisjoint(FRAME_TABLES):
            found.table_entries |= entries_given(said)
        if isinstance(said, Call) and said.arguments:
            found.handed.add(Handed((said.name,), said.arguments, is_call=True))
        if isinstance(said, Declared) and self.routine is not None:
            for key, _, _ in said.items:
                if key is not None:
                    self.routine.types[key.split(b"[")[0]] = said.type
            if len(stack) > 1:  # in a block it is declared again and again
                effects = effects | {key.split(b"[")[0] for key, _, _ in said.items if key is not None}
        found.read |= read_by(statement)
        if statement.word in EVENTS:
            self._event(statement)
        if stack:
            _join(stack[-1].effects, effects)
            stack[-1].calls.update(functions)
            if called:
                stack[-1].calls.add(called)

    def _event(self, statement: Statement) -> None:
        """Takes up what an interrupt or a trigger does."""
        found = self.found
        named: Effects = set(later_functions(statement.code))
        if named:  # what is handed to a function may come back changed
            found.handed.add(Handed(later_functions(statement.code), statement.code, is_call=False))
            named |= as_effects(identifiers(statement.code))
        for call in later_actions(statement):
            if call.name == b"BAS":
                named |= effects_of_bas(call.arguments)
            else:
                named |= {call.name, *returned_by(call, found.directions)}
            if call.arguments:
                found.handed.add(Handed((call.name,), call.arguments, is_call=True))
        found.later |= {effect for effect in named if isinstance(effect, bytes)}
        found.later_effects |= {effect for effect in named if isinstance(effect, str)}


def program_structure(
    statements: Iterable[tuple[int, Statement]],
    others: Mapping[bytes, Effects] = NO_EFFECTS,
    directions: Directions = NO_DIRECTIONS,
) -> ProgramStructure:
    """Goes over the statements (index, statement) once; others: what routines of other modules change; directions:
    how they take their parameters."""
    surveyor = _Surveyor(directions)
    index = -1
    for index, statement in statements:
        surveyor.take(index, statement)
    stack, found = surveyor.stack, surveyor.found
    if stack and isinstance(stack[0], Routine):
        found.unclosed.append((stack[0].line, "the DEF has no END"))
    surveyor._close_all(index)
    found.blocks = surveyor.blocks
    for (start, name), (first, last) in found.jumps.items():
        if name in (labels := found.routine_at[start].labels):
            for block in labels[name][1]:
                block.has_labels = True
                block.is_entered = block.is_entered or not block.start < first <= last < block.end
    _settle(found, surveyor.blocks, others)
    found.later_effects |= {SYSTEM[name] for name in found.later if name in SYSTEM}
    for name in [*closure(found.routines, found.later), *(found.later & others.keys())]:
        effects = found.routines[name].effects if name in found.routines else others[name]
        found.later_effects |= {effect for effect in effects if isinstance(effect, str)}
        found.later.update(effect for effect in effects if isinstance(effect, bytes))
        if "all" in effects:
            found.later.update(name.partition(b".")[0] for name in found.assigned)
    spread_later(found, {})
    return found


def spread_later(structure: ProgramStructure, others: Mapping[bytes, Parameters]) -> None:
    """Takes up what changes later by the parameters of routines; others: those of other modules."""
    every = spread(structure.later, structure.handed, {**others, **parameters_of(structure.routines)})
    structure.later |= {effect for effect in every if isinstance(effect, bytes)}
    structure.later_effects |= {effect for effect in every if isinstance(effect, str)}


def _join(into: Effects, more: Iterable[Effect]) -> None:
    into.update(more)
    if len(into) > MOST_EFFECTS:
        words = {effect for effect in into if isinstance(effect, str)}
        into.clear()
        into.update(words, ["all"])


def _settle(structure: ProgramStructure, blocks: Sequence[Block], others: Mapping[bytes, Effects]) -> None:
    """Brings what the called routines change into the effects of who calls them."""
    others = {name: of for name, of in others.items() if name not in structure.routines}
    for name in {name for block in blocks for name in block.calls} | structure.later:
        structure.assigned.update(effect for effect in others.get(name, ()) if isinstance(effect, bytes))
    if len(structure.routines) > MOST_EFFECTS:
        for block in blocks:
            if block.calls:
                _join(block.effects, [*structure.effects, "all", "point", *MODAL])
        return
    reached = {name: closure(structure.routines, [name]) for name in structure.routines}
    strange = {
        name
        for name, routine in structure.routines.items()
        if any(
            call not in structure.routines and call not in others and not is_harmless(call)
            for call in routine.calls
        )
    }
    total: dict[bytes, Effects] = {}
    for name, routines in reached.items():
        total[name] = set() if strange.isdisjoint(routines) else {"point"}
        for other in routines:
            _join(total[name], structure.routines[other].effects)
            for call in structure.routines[other].calls & others.keys():
                _join(total[name], others[call])
    for block in blocks:
        for name in block.calls:
            if name in total:
                _join(block.effects, total[name])
            elif name in others:
                _join(block.effects, others[name])
            elif not is_harmless(name):
                block.effects.add("point")


def _stays(code: bytes) -> bool:
    words = code.split(None, 2)
    return len(words) > 1 and words[1].upper() in HERE


def _shown(word: bytes) -> str:
    return word.decode("latin-1")
