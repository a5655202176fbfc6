"""What is known while a program is followed: its statements, the values of its variables, what it has run so far."""

from __future__ import annotations

import math
import re
from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np

from postproc.languages.gcode.control import Control
from postproc.languages.gcode.execution_flow import (
    INVALIDATES,
    LOCAL,
    NEVER,
    RESTORES,
    RETURNS,
    SAVES,
    SAVES_FOR_A_CALL,
    macro_modes,
    tape_blocks,
)
from postproc.languages.gcode.integer_words import IntegerWords
from postproc.languages.gcode.lexing import FARTHEST
from postproc.languages.gcode.run_labels import RunLabels
from postproc.languages.gcode.source import MACRO, Source
from postproc.languages.gcode.statements import (
    NotFollowed,
    Structure,
    VariableAssignment,
    Verb,
    assignments,
    background_names,
    by_block,
)
from postproc.languages.gcode.variable_values import VariableValues
from postproc.languages.gcode.words import key

SUBPROGRAM = 98
STEPS, BLOCKS = 50_000, 200_000
"""How many statements, and blocks, are followed beyond four times those of the program."""

MODE_VERBS = {
    SAVES: "save", INVALIDATES: "invalidate", RESTORES: "restore", SAVES_FOR_A_CALL: "save for the call",
}  # fmt: skip
"""M of a LinuxCNC -> what they do with the modes in force."""
SAVING = re.compile(r"PROC\b.*\bSAVE\b", re.I)
"""The head of a subprogram of a Sinumerik whose end restores the modal G functions and the frame of its caller."""

_NO_CALLS = frozenset(["end", "return", *MODE_VERBS.values()])


@dataclass
class CallFrame:
    """Where a call goes back to, what is repeated and until where; locals: the variables of the caller; jumps: it
    starts at a label, past what is before that; through: its end is a label, which is reached from before; saves: the
    step at which the modes were in force that the end of a subprogram restores; kept: the step of its last M70 or
    M73; both may be NEVER or UNCLEAR."""

    back: int
    start: int
    stop: int
    count: int
    call: int
    locals: dict[str, float] | None
    jumps: bool = False
    through: bool = False
    saves: int = NEVER
    kept: int = NEVER


class RunState:
    """One attempt at following a program; ``opaque``: blocks of constructs and calls that may run or not; again:
    block of a M99 of the main program that leads back, from which it runs a second time."""

    def __init__(
        self,
        source: Source,
        control: Control,
        variables: VariableValues,
        shape: Structure,
        opaque: set[int],
        integer_words: IntegerWords,
        again: int | None = None,
    ) -> None:
        self.again, self.second_pass, self.restarts = again, -1, list[int]()
        self.source, self.control, self.variables = source, control, variables
        self.shape, self.opaque, self.integer_words = shape, opaque, integer_words
        self.n = len(source.blocks)
        self.values = by_block(source.notes, "value")
        self.assigned = by_block(source.notes, "assign")
        self.conditions = by_block(source.notes, "if")
        self.letters = by_block(source.notes, "arguments")
        self.strange = {
            note.block
            for note in source.notes
            if note.kind == "unknown" and ("=" in note.text or "#" in note.text)
        }
        self.strange |= set(np.flatnonzero(macro_modes(source) > 0).tolist())
        for texts in self.assigned.values():
            for text in texts:
                variables.volatile |= background_names(text)
        self.flow_codes = {*control.endings, *RETURNS, SUBPROGRAM, LOCAL}
        self.perhaps_called: list[tuple[int, int]] = []
        self.sizes: dict[int, int] = {}  # first block of a subprogram -> its last one
        self.labels = RunLabels(source)
        self.programs = frozenset(self.labels.starts[1:])
        self.stop = self.n
        self.deleted = set(np.flatnonzero(source.blocks.deleted).tolist())
        self.codes = self._codes()
        self.calling = {note.block for note in source.notes if note.kind == "call"}
        self.calling |= {block for block, verb in self.codes.items() if verb not in _NO_CALLS}
        self.tape = tape_blocks(source)
        special = {
            *self.values, *self.assigned, *self.conditions, *self.strange, *shape.statements, *self.codes,
            *self.programs, *self.calling,
        }  # fmt: skip
        self.special = sorted(block for block in special if self.tape[block])
        self.ranges: list[tuple[int, int, bool]] = []
        self.count = 0
        self.rows: list[tuple[int, int, int, float, int]] = []
        self.held: list[int] = []  # steps of blocks after a condition that holds
        self.called: list[int] = []
        self.entered: list[int] = []
        self.jumped: list[int] = []  # steps that are reached by a jump, past what is written before them
        self.conditional: list[tuple[int, int, int, int]] = []  # as of ``Execution.perhaps``
        # steps before which the run comes to a block that is none of it
        self.reached: list[tuple[int, int]] = []
        self.unknown: dict[str, int] = {}
        self.lacks_count = (
            False  # the program cannot be followed as it is not known how often a part is repeated
        )
        self.integers: set[str] = set()  # names that hold whole numbers only
        self.frames: list[CallFrame] = []
        self.repeats: dict[int, int] = {}
        self.kept = NEVER  # of the main program: as of ``CallFrame``
        self.saved: list[tuple[int, int]] = []  # as of ``Execution.saved``
        self.saving = sorted(block for block, texts in self.assigned.items() if any(map(SAVING.match, texts)))
        self.only_labels: dict[int, bool] = {}  # blocks at which a part that is repeated ends
        self.steps = 0
        self.missing: set[str] = set()  # names of what is called and not here
        left = {
            (statement.verb, shape.construct[block].verb)
            for block, statement in shape.statements.items()
            if block in shape.construct
        }
        self.breaks_loop = bool(left & {(Verb.BREAK, Verb.WHILE), (Verb.BREAK, Verb.REPEAT)})
        self.continues_do = (Verb.CONTINUE, Verb.DO) in left

    def _codes(self) -> dict[int, str]:
        """Block -> what its M, G65 or L words do to the flow."""
        found: dict[int, str] = {}
        m, g = self.source.column(key("M")), self.source.column(key("G"))
        for code, verb in MODE_VERBS.items() if self.control.saves_modes else ():
            found.update(dict.fromkeys(m.block[m.value == code].tolist(), verb))
        for code, verb in (
            *((code, "end") for code in self.control.endings), *((code, "return") for code in RETURNS),
            (SUBPROGRAM, "call"), (LOCAL, "local"),
        ):  # fmt: skip
            found.update(dict.fromkeys(m.block[m.value == code].tolist(), verb))
        found.update(dict.fromkeys(g.block[g.value == MACRO].tolist(), "macro"))
        if self.control.calls:
            calls = self.source.mask(*self.control.calls)
            found.update(dict.fromkeys(np.flatnonzero(calls).tolist(), "named"))
        return found

    def budget(self) -> None:
        """Counts a statement that is followed.  Raises NotFollowed."""
        self.steps += 1
        if self.steps > STEPS + 4 * len(self.special) or self.count > BLOCKS + 4 * self.n:
            raise NotFollowed

    def emit(self, start: int, stop: int, uncertain: bool = False) -> None:
        if stop > start:
            self.ranges.append((start, stop, uncertain))
            self.count += stop - start

    def fold(self, block: int, step: int) -> None:
        """Puts the values of expressions into the words of a block that runs at ``step``.  Raises NotFollowed."""
        texts = self.values.get(block)
        if texts is None:
            return
        own = set() if self.variables.parallel else self.targets(block)
        for text in texts:
            address, nth, how, expression = text.split(" ", 3)
            value = self.value(expression, block, own)
            if int(address) == key("M") and value in self.flow_codes and self.shape.followed:
                raise NotFollowed
            if abs(value) <= FARTHEST:
                self.rows.append((step, int(address), int(nth), value, int(how)))

    def value(self, text: str, block: int, without: set[str] | None = None) -> float:
        value, missing = self.variables.evaluate(text, without or set())
        for name in missing:
            if self.variables.can_be_bound(name):
                self.unknown.setdefault(name, block)
        return value

    def targets(self, block: int) -> set[str]:
        found: set[str] = set()
        for text in self.assigned.get(block, ()):
            found.update(self.variables.name(one.target) for one in assignments(text))
        return found

    def assign(self, block: int, certain: bool = True) -> None:
        """The assignments of a block."""
        texts = self.assigned.get(block)
        if texts is None:
            return
        every = [one for text in texts for one in assignments(text)]
        alone = self.variables.parallel or self.variables.in_turn or len(every) < 2
        own = set() if alone else self.targets(block)
        if self.variables.in_turn:
            for one in every:
                self.put(one, self.value(one.text, block, own) if certain else math.nan)
            return
        values = [self.value(one.text, block, own) if certain else math.nan for one in every]
        for one, value in zip(every, values, strict=True):
            self.put(one, value)

    def put(self, one: VariableAssignment, value: float) -> None:
        """An assignment of a value."""
        name = self.variables.name(one.target)
        if one.integer:
            self.integers.add(name)
        fine = name not in self.integers or math.isnan(value) or value == math.floor(value)
        self.variables.set(name, value if fine else math.nan)

    def kill(self, start: int, stop: int) -> None:
        """What the blocks ``start`` .. ``stop`` - 1 may assign is unknown."""
        low, high = bisect_left(self.special, start), bisect_left(self.special, stop)
        for block in self.special[low:high]:
            statement = self.shape.statements.get(block)
            if block in self.calling or block in self.strange:
                self.variables.forget()
                return
            if statement is not None and statement.verb == Verb.FOR:
                self.variables.set(statement.text.partition("=")[0], math.nan)
            for name in self.targets(block):
                self.variables.set(name, math.nan)

    def word(self, block: int, letter: str) -> float:
        """The value of a word of a block that runs now, NaN without."""
        address = key(letter)
        for step, one, _, value, _ in reversed(self.rows):  # in the order of their steps
            if step != self.count - 1:
                break
            if one == address:
                return value
        column = self.source.column(address)
        at = self.last_word(block, letter)
        return float(column.value[at]) if at >= 0 else math.nan

    def last_word(self, block: int, letter: str) -> int:
        """The place of the last word of a block in the column of its letter, -1 without one."""
        column = self.source.column(key(letter)).block
        at = bisect_right(column, block) - 1
        return at if at >= 0 and column[at] == block else -1
