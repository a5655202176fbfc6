"""The blocks of a program in the order in which the control runs them, with the values of variables in their words.

Loops with known counts, known branches, jumps and calls of subprograms of the file are followed; a value that is the
same in every run of a block is put into its words.  What may run or not (an unknown condition, a slash) stays in its
place and is marked: what it assigns is unknown after it.  A flow that cannot be followed leaves the order of the text.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from postproc.base.arrays import Bools, Ints
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.execution_flow import (
    LOCAL,
    RETURNS,
    FlowReason,
    program_starts,
    tape_blocks,
    uncertain_stretches,
)
from postproc.languages.gcode.execution_names import RunLabels
from postproc.languages.gcode.lexing import FARTHEST
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.statements import (
    Construct,
    NotFollowed,
    Statement,
    Structure,
    Verb,
    assignments,
    background_names,
    by_block,
    structure,
)
from postproc.languages.gcode.variables import Variables
from postproc.languages.gcode.words import How, key

DEEPEST_CALL = 20
SUBPROGRAM = 98
RESTARTS = 20
STEPS, BLOCKS = 50_000, 200_000
"""How many statements, and blocks, are followed beyond four times those of the program."""

_ARGUMENTS = dict(zip("ABCIJKDEFHMQRSTUVWXYZ", (*range(1, 10), 11, 13, *range(17, 27)), strict=True))
"""Letters of G65 -> the numbers of their variables."""


@dataclass(frozen=True, eq=False)
class FoldedWords:
    """Words whose values come from variables: step (K,), row of the run; key (K,); nth (K,): how many words of that key
    are before it in the block; value (K,); how (K,) How."""

    step: Ints
    key: Ints
    nth: Ints
    value: np.ndarray
    how: Ints

    def __len__(self) -> int:
        return len(self.step)


@dataclass(frozen=True, eq=False)
class Execution:
    """The run of a program in E steps.

    text: the program as it is written.  source: its blocks, one a step, with the known values in their words; order (E,): the block of the text of each;
    None where that is the order of the text.  followed: loops, branches and calls are; reason (E,) FlowReason where
    they are.  called (E,): the step calls a subprogram that is followed.  repeated (E,): the block runs in other steps
    as well.  folded: the words whose values are put in.  unknown: names whose value was wanted and is not known, and
    the block where it was first.
    """

    text: Source
    source: Source
    order: Ints | None
    followed: bool
    reason: Ints
    tape: Bools
    called: Bools
    entered: Bools
    repeated: Bools
    folded: FoldedWords
    unknown: Mapping[str, int]


class _Restart(Exception):
    """A construct or a call is to be taken as one that may run or not."""


@dataclass
class _Frame:
    """Where a call goes back to, what is repeated and until where; locals: the variables of the caller."""

    back: int
    start: int
    stop: int
    count: int
    call: int
    locals: dict[str, float] | None


def execute(source: Source, control: Control, symbols: Mapping[str, object]) -> Execution:
    """The run of a program; ``symbols``: values of names that only the controller knows."""
    n = len(source.blocks)
    nothing = np.zeros(n, np.bool_)
    tape = tape_blocks(source)
    plain = Execution(source, source, None, False, np.zeros(n, np.int8), tape, nothing, nothing, nothing, _folded([]), {})
    language = control.expressions
    if language is None or not n:
        return plain
    noted = {note.kind for note in source.notes}
    m = source.column(key("M"))
    calls = np.isin(m.value, (SUBPROGRAM, LOCAL)).any() or (control.calls and source.mask(*control.calls).any())
    if not noted & {"value", "assign", "if", "open", "close", "while", "jump", "call"} and not calls:
        return plain
    known = {name: float(value) for name, value in symbols.items() if isinstance(value, int | float)}
    try:
        shape = structure(source.notes)
        opaque: set[int] = set()
        for _ in range(RESTARTS):
            run = _Run(source, control, Variables(language, known, control.name), shape, opaque)
            try:
                return run.done(run.follow(), True)
            except _Restart:
                continue
    except NotFollowed:
        pass
    run = _Run(source, control, Variables(language, known, control.name), Structure({}, {}, {}, followed=False), set())
    return run.in_text_order()


def _folded(rows: list[tuple[int, int, int, float, int]]) -> FoldedWords:
    columns = list(zip(*rows, strict=True)) if rows else [()] * 5
    step, address, nth, how = (np.array(columns[i], np.int64) for i in (0, 1, 2, 4))
    return FoldedWords(step, address, nth, np.array(columns[3], np.float64), how)


class _Run:
    """One attempt at following a program."""

    def __init__(
        self, source: Source, control: Control, variables: Variables, shape: Structure, opaque: set[int]
    ) -> None:
        self.source, self.control, self.variables = source, control, variables
        self.shape, self.opaque = shape, opaque
        self.n = len(source.blocks)
        self.values = by_block(source.notes, "value")
        self.assigned = by_block(source.notes, "assign")
        self.conditions = by_block(source.notes, "if")
        self.strange = {
            note.block for note in source.notes if note.kind == "unknown" and ("=" in note.text or "#" in note.text)
        }
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
        self.calling |= {block for block, verb in self.codes.items() if verb not in ("end", "return")}
        self.tape = tape_blocks(source)
        special = {
            *self.values, *self.assigned, *self.conditions, *self.strange, *shape.statements, *self.codes,
            *self.programs, *self.calling,
        }  # fmt: skip
        self.special = sorted(block for block in special if self.tape[block])
        self.ranges: list[tuple[int, int, bool]] = []
        self.count = 0
        self.rows: list[tuple[int, int, int, float, int]] = []
        self.taken: dict[int, bool] = {}  # step of a block behind a condition -> whether that holds
        self.called: list[int] = []
        self.entered: list[int] = []
        self.unknown: dict[str, int] = {}
        self.frames: list[_Frame] = []
        self.repeats: dict[int, int] = {}
        self.steps = 0

    def _codes(self) -> dict[int, str]:
        """Block -> what its M, G65 or L words do to the flow."""
        found: dict[int, str] = {}
        m, g = self.source.column(key("M")), self.source.column(key("G"))
        for code, verb in (
            *((code, "end") for code in self.control.endings), *((code, "return") for code in RETURNS),
            (SUBPROGRAM, "call"), (LOCAL, "local"),
        ):  # fmt: skip
            found.update(dict.fromkeys(m.block[m.value == code].tolist(), verb))
        found.update(dict.fromkeys(g.block[g.value == 65].tolist(), "macro"))
        if self.control.calls:
            calls = self.source.mask(*self.control.calls)
            found.update(dict.fromkeys(np.flatnonzero(calls).tolist(), "named"))
        return found

    # The order of the text

    def in_text_order(self) -> Execution:
        """Values where the flow is not followed: what a loop or a branch assigns is unknown from its first block on."""
        self.emit(0, self.n)
        stretches = uncertain_stretches(self.source)
        inside = np.zeros(self.n + 1, np.int32)
        for start, stop in stretches:
            inside[start] += 1
            inside[stop] -= 1
        uncertain = np.cumsum(inside)[: self.n] > 0
        starts = np.flatnonzero(uncertain & ~np.append(False, uncertain[:-1])).tolist()
        stops = (np.flatnonzero(uncertain & ~np.append(uncertain[1:], False)) + 1).tolist()
        ahead = list(zip(starts, stops, strict=True))[::-1]
        for block in self.special:
            while ahead and ahead[-1][0] <= block:
                self.kill(*ahead.pop())
            self.fold(block, block)
            if block in self.calling or block in self.strange:
                self.variables.forget()
            self.assign(block, certain=not uncertain[block] and block not in self.deleted)
        return self.done(self.n, False)

    # Following

    def follow(self) -> int:
        """Runs the program; the block after the last one that is certain to run."""
        at = 0
        while True:
            self.budget()
            limit = self.frames[-1].stop if self.frames else self.n
            place = bisect_left(self.special, at)
            block = self.special[place] if place < len(self.special) else self.n
            if block >= limit:
                self.emit(at, min(limit, self.n))
                if not self.frames:
                    return limit
                if limit >= self.n:  # a subprogram without an end
                    raise NotFollowed
                at = self.leave()
                continue
            self.emit(at, block)
            following = self.step(block)
            if following is None:
                return min(self.stop, block + 1)
            at = following

    def budget(self) -> None:
        self.steps += 1
        if self.steps > STEPS + 4 * len(self.special) or self.count > BLOCKS + 4 * self.n:
            raise NotFollowed

    def emit(self, start: int, stop: int, uncertain: bool = False) -> None:
        if stop > start:
            self.ranges.append((start, stop, uncertain))
            self.count += stop - start

    def step(self, block: int) -> int | None:
        """Runs a block that says more than plain words; where the run goes on, None where it ends."""
        if block in self.programs and not self.frames:
            self.stop = block
            return None  # the next program of the file
        if block in self.strange:
            self.variables.forget()
        statement = self.shape.statements.get(block)
        if block in self.conditions:
            holds = self.value(self.conditions[block][0], block)
            if holds == 0:
                return block + 1
            if not math.isnan(holds):
                self.taken[self.count] = True
                return self.certain(block, statement)
        if block in self.deleted:
            return self.perhaps(block, statement)
        return self.certain(block, statement)

    def certain(self, block: int, statement: Statement | None) -> int | None:
        step = self.count
        if statement is None or statement.verb != Verb.SUB:
            self.fold(block, step)
        if statement is not None:
            return self.flow(statement)
        self.emit(block, block + 1)
        self.assign(block)
        verb = self.codes.get(block)
        if verb == "end":
            return self.leave() if self.frames and self.control.calls else None
        if verb == "return":
            if self.source.mask(key("P"))[block] if self.frames else False:
                raise NotFollowed
            return self.leave() if self.frames else None
        if verb is not None:
            return self.call(block, verb, step)
        return block + 1

    def perhaps(self, block: int, statement: Statement | None) -> int:
        """A block that runs only sometimes."""
        verb = self.codes.get(block)
        if statement is not None:
            if statement.verb == Verb.GOTO:
                return self.branch_away(statement)
            if statement.verb != Verb.CALL:
                raise NotFollowed
        if verb == "return" and self.frames:
            self.hide(self.frames[-1].call)
        self.fold(block, self.count)
        self.emit(block, block + 1)
        self.assign(block, certain=False)
        if statement is not None or verb in ("call", "local", "macro", "named"):
            self.perhaps_call(block, verb or "", statement)
            self.variables.forget()
        return block + 1

    def fold(self, block: int, step: int) -> None:
        """Puts the values of expressions into the words of a block that runs at ``step``."""
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
        own = set() if self.variables.parallel or len(every) < 2 else self.targets(block)
        values = [self.value(one.text, block, own) if certain else math.nan for one in every]
        for one, value in zip(every, values, strict=True):
            fine = not one.integer or math.isnan(value) or value == math.floor(value)
            self.variables.set(self.variables.name(one.target), value if fine else math.nan)

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

    def flow(self, statement: Statement) -> int:
        """Follows a statement about flow; where the run goes on."""
        block, verb = statement.block, statement.verb
        around = self.shape.construct.get(block)
        if around is not None and around.start in self.opaque and verb != Verb.SUB:
            if block == around.start:
                return self.maybe(around)
        if verb == Verb.SUB:
            assert around is not None
            return around.stop + 1
        if verb == Verb.CALL:
            return self.call(block, "call", self.count)
        if verb == Verb.GOTO:
            return self.jump(statement)
        if verb == Verb.REPEAT_PART:
            return self.repeat_part(statement)
        assert around is not None
        if verb == Verb.RETURN:
            if not self.frames:
                raise NotFollowed
            self.returned(statement)
            return self.leave()
        if verb == Verb.BREAK:
            self.emit(block, block + 1)
            self.repeats.pop(around.start, None)
            return around.stop + 1
        if verb == Verb.CONTINUE:
            return around.start if around.verb == Verb.WHILE else around.stop
        if around.verb == Verb.SUB:
            if not self.frames:
                raise NotFollowed
            self.returned(statement)
            return self.leave()
        self.emit(block, block + 1)
        return self.loop(around, statement) if around.verb != Verb.IF else self.branch(around, block)

    def branch(self, around: Construct, block: int) -> int:
        if block != around.start:  # from the end of the arm that ran
            return around.stop + 1
        arms = [*around.arms, (around.stop, "")]
        for (at, text), (_, _) in zip(arms, arms[1:], strict=False):
            holds = self.value(text, at) if text or at == around.start else 1.0
            if math.isnan(holds):
                return self.maybe(around)
            if holds:
                return at + 1
        return around.stop + 1

    def loop(self, around: Construct, statement: Statement) -> int:
        """At the start or the end of a loop."""
        ahead = statement.block == around.start
        inside, behind = around.start + 1, around.stop + 1
        if around.verb == Verb.WHILE:
            holds = self.value(around.text, around.start)
        elif around.verb == Verb.DO:
            holds = 1.0 if ahead else self.value(around.until, around.stop)
        elif around.verb == Verb.LOOP:
            holds = 1.0
            if not ahead and around.until:
                until = self.value(around.until, around.stop)
                holds = math.nan if math.isnan(until) else float(until == 0)
        elif around.verb == Verb.FOR:
            holds = self.counted(around, ahead)
        else:
            if ahead:
                count = self.value(around.text, around.start)
                if math.isnan(count) or count != math.floor(count):
                    return self.maybe(around)
                self.repeats[around.start] = int(count)
            left = self.repeats.get(around.start, 0)
            self.repeats[around.start] = left - 1
            holds = float(left > 0)
        if math.isnan(holds):
            if not ahead:
                self.hide(around.start)  # how often it runs is not known
            return self.maybe(around)
        return inside if holds else behind

    def counted(self, around: Construct, ahead: bool) -> float:
        """Whether a FOR runs its body again; its variable is set."""
        head, _, last = around.text.partition("\n")
        name, _, first = head.partition("=")
        value = self.value(first, around.start) if ahead else self.value(name, around.stop) + 1
        end = self.value(last, around.start)
        runs = math.nan if math.isnan(value) or math.isnan(end) else float(value <= end)
        self.variables.set(name, value if runs else math.nan)
        return runs

    def maybe(self, around: Construct) -> int:
        """A construct that may run or not, once or often."""
        self.escape(around.start, around.stop + 1)
        self.kill(around.start, around.stop + 1)
        self.perhaps_range(around.start, around.stop + 1)
        return around.stop + 1

    def perhaps_range(self, start: int, stop: int) -> None:
        low, high = bisect_left(self.special, start), bisect_left(self.special, stop)
        for block in self.special[low:high]:
            self.fold(block, self.count + block - start)
            statement = self.shape.statements.get(block)
            if statement is None or statement.verb == Verb.CALL:
                self.perhaps_call(block, self.codes.get(block, ""), statement)
        self.emit(start, stop, uncertain=True)

    def escape(self, start: int, stop: int) -> None:
        """Makes what is left from within the blocks uncertain as well.  Raises _Restart."""
        low, high = bisect_left(self.special, start), bisect_left(self.special, stop)
        for block in self.special[low:high]:
            statement = self.shape.statements.get(block)
            if self.codes.get(block) == "return" and self.frames:
                self.hide(self.frames[-1].call)
            if self.codes.get(block) == "end" and self.frames and self.control.calls:
                self.hide(self.frames[-1].call)
            if statement is None:
                continue
            around = self.shape.construct.get(block)
            if statement.verb in (Verb.BREAK, Verb.CONTINUE) and around is not None and around.start < start:
                self.hide(around.start)
            if statement.verb == Verb.RETURN and self.frames:
                self.hide(self.frames[-1].call)
            if statement.verb == Verb.GOTO:
                target = self.labels.find(statement, block)
                if target is None or not start <= target <= stop:
                    raise NotFollowed
            if statement.verb == Verb.REPEAT_PART:
                raise NotFollowed

    def hide(self, block: int) -> None:
        self.opaque.add(block)
        raise _Restart

    def jump(self, statement: Statement) -> int:
        holds = self.value(statement.text, statement.block) if statement.text else 1.0
        if math.isnan(holds):
            return self.branch_away(statement)
        self.emit(statement.block, statement.block + 1)
        if not holds:
            return statement.block + 1
        target = self.labels.find(self.computed(statement), statement.block)
        if target is None:
            raise NotFollowed
        self.entered.append(self.count)
        return target

    def computed(self, statement: Statement) -> Statement:
        """A jump with the number of its label where that is computed."""
        if not statement.label.startswith(("#", "[")):
            return statement
        number = self.value(statement.label, statement.block)
        if math.isnan(number):
            raise NotFollowed
        return Statement(statement.block, statement.verb, f"{number:.0f}", statement.text, statement.way)

    def branch_away(self, statement: Statement) -> int:
        """A jump that happens only sometimes: what it passes may run or not."""
        start = statement.block
        stop = self.labels.find(statement, start)
        if stop is None or stop <= start or self.frames:
            raise NotFollowed
        at = start + 1
        while at < stop:  # what jumps from there farther is part of it
            place = bisect_left(self.special, at)
            block = self.special[place] if place < len(self.special) else self.n
            if block >= stop:
                break
            inner = self.shape.statements.get(block)
            around = self.shape.construct.get(block)
            if around is not None and around.start < start:
                raise NotFollowed
            if around is not None:
                stop = max(stop, around.stop + 1)
            if inner is not None and inner.verb == Verb.GOTO:
                target = self.labels.find(inner, block)
                if target is None or target <= start:
                    raise NotFollowed
                stop = max(stop, target)
            if inner is not None and inner.verb == Verb.REPEAT_PART:
                raise NotFollowed
            at = block + 1
        if self.labels.between(start, stop):
            raise NotFollowed
        self.kill(start, stop)
        self.emit(start, start + 1)
        self.perhaps_range(start + 1, stop)
        self.entered.append(self.count)
        return stop

    # Calls

    def call(self, block: int, verb: str, step: int) -> int:
        """A call; ``step``: at which its block runs."""
        statement = self.shape.statements.get(block)
        if statement is not None:
            self.emit(block, block + 1)
        found = self.called_part(block, verb, statement)
        if block in self.opaque:
            self.perhaps_call(block, verb, statement)
            found = None
        if found is None or len(self.frames) >= DEEPEST_CALL:
            self.variables.forget()
            return block + 1
        start, stop, count, arguments = found
        outer = None
        if arguments is not None:
            outer = self.variables.enter(arguments)
        self.called.append(step)
        if count < 1:
            return block + 1
        self.frames.append(_Frame(block + 1, start, stop, count, block, outer))
        return start

    def perhaps_call(self, block: int, verb: str, statement: Statement | None) -> None:
        """A call that may run or not: the blocks of what it calls may run more often than they are followed."""
        if statement is None and verb not in ("call", "local", "macro", "named"):
            return
        found = self.called_part(block, verb, statement)
        if found is not None:
            start, stop = found[:2]
            self.perhaps_called.append((start, self.sizes.get(start, stop)))

    def called_part(
        self, block: int, verb: str, statement: Statement | None
    ) -> tuple[int, int, int, dict[str, float] | None] | None:
        """First block, the one after the last, runs and own variables of what is called; None where it is not here."""
        if statement is not None and statement.label.startswith("O") and statement.label in self.shape.subprograms:
            around = self.shape.subprograms[statement.label]
            self.sizes[around.start + 1] = around.stop
            values = [self.value(text, block) for text in _bracketed(statement.text)]
            numbered = {f"#{number}": 0.0 for number in range(1, 31)}
            numbered |= {f"#{number}": value for number, value in enumerate(values, 1)}
            return around.start + 1, self.n, 1, numbered
        if statement is not None:
            part = self.labels.program(statement.label)
            return None if part is None else (*part, 1, self.variables.own())
        if verb == "named":
            number = self.word(block, "L")
            part = self.labels.program(f"L{number:.0f}") if not math.isnan(number) else None
            count = self.word(block, "P")
            return None if part is None else (*part, 1 if math.isnan(count) else int(count), self.variables.own())
        number, count = self.word(block, "P"), self.word(block, "L")
        if math.isnan(number) or number != math.floor(number):
            return None
        runs = 1 if math.isnan(count) else int(count)
        if verb == "local":
            start = self.labels.number(int(number), block)
            return None if start is None else (start, self.n, runs, None)
        part = self.labels.program(f"{number:.0f}")
        if part is None and number >= 10_000 and math.isnan(count):
            runs, part = int(number) // 10_000, self.labels.program(f"{int(number) % 10_000}")
        if part is None:
            return None
        if verb == "macro":
            values = {letter: self.word(block, letter) for letter in _ARGUMENTS}
            given = {f"#{_ARGUMENTS[one]}": value for one, value in values.items() if not math.isnan(value)}
            return (*part, runs, given)
        return (*part, runs, None)

    def word(self, block: int, letter: str) -> float:
        """The value of a word of a block that runs now, NaN without."""
        address = key(letter)
        for step, one, _, value, _ in reversed(self.rows[-20:]):
            if step == self.count - 1 and one == address:
                return value
        return float(self.source.column(address).last(np.array([block]))[0])

    def returned(self, statement: Statement) -> None:
        """The value that a subprogram returns."""
        value = self.value(statement.text, statement.block) if statement.text else math.nan
        self.variables.result = value

    def leave(self) -> int:
        """From the end of what is repeated or called."""
        frame = self.frames[-1]
        frame.count -= 1
        if frame.count > 0:
            return frame.start
        self.frames.pop()
        if frame.locals is not None:
            self.variables.leave(frame.locals)
        return frame.back

    def repeat_part(self, statement: Statement) -> int:
        """REPEAT from a label up to here, or up to another label."""
        block = statement.block
        start = self.labels.find(statement, block)
        count = self.value(statement.text, block)
        if start is None or math.isnan(count) or count != math.floor(count):
            raise NotFollowed
        self.emit(block, block + 1)
        if statement.way == "B":
            stop = start + 1
        elif statement.way:
            end = self.labels.find(Statement(block, statement.verb, statement.way), start)
            if end is None or end < start:
                raise NotFollowed
            stop = end
        else:
            stop = self.labels.end_label(start, block)
        if start <= block < stop or count < 1:
            if count < 1:
                return block + 1
            raise NotFollowed
        self.frames.append(_Frame(block + 1, start, stop, int(count), block, None))
        return start

    def perhaps_run(self) -> Bools:
        """(B,) blocks of subprograms that calls of which it is not known whether they run lead to."""
        edge = np.zeros(self.n + 1, np.int32)
        done: set[tuple[int, int]] = set()
        while self.perhaps_called:
            start, stop = part = self.perhaps_called.pop()
            if part in done:
                continue
            done.add(part)
            edge[start] += 1
            edge[stop] -= 1
            for block in self.special[bisect_left(self.special, start) : bisect_left(self.special, stop)]:
                if block in self.calling:
                    self.perhaps_call(block, self.codes.get(block, ""), self.shape.statements.get(block))
        return np.asarray(np.cumsum(edge)[: self.n] > 0)

    # The result

    def done(self, stop: int, followed: bool) -> Execution:
        """The run as arrays; blocks that do not run come last."""
        n, blocks = self.n, self.source.blocks
        pieces = [np.arange(start, end) for start, end, _ in self.ranges]
        flags = [np.full(end - start, FlowReason.FLOW * uncertain, np.int8) for start, end, uncertain in self.ranges]
        order = np.concatenate(pieces) if pieces else np.empty(0, np.int64)
        many = np.bincount(order, minlength=n)
        rest = np.flatnonzero(many == 0)
        programs = program_starts(self.source)
        later = programs[1] if len(programs) > 1 else n
        why = np.where(rest >= stop, FlowReason.ENDED, FlowReason.SKIPPED).astype(np.int8)
        why[rest >= later] = FlowReason.PROGRAM
        if (self.source.column(key("M")).value == LOCAL).any():
            why[rest >= stop] = FlowReason.PROGRAM
        for one in self.shape.subprograms.values():
            why[(rest >= one.start) & (rest <= one.stop)] = FlowReason.PROGRAM
        reason = np.concatenate([*flags, why]) if flags else why
        order = np.concatenate([order, rest])
        reason[self.perhaps_run()[order] & (reason == FlowReason.NONE)] = FlowReason.FLOW
        same = len(order) == n and bool((order == np.arange(n)).all())
        folded = _folded(self.rows)
        called, entered = np.zeros(len(order), np.bool_), np.zeros(len(order) + 1, np.bool_)
        called[self.called], entered[self.entered] = True, True
        if not same:
            entered[:-1] |= np.diff(order, prepend=-1) != 1
        held = np.array(sorted(step for step, holds in self.taken.items() if holds), np.int64)
        source = self.source if same and not len(held) else self.source.in_order(order, held)
        source = source.with_values(folded.step, folded.key, folded.nth, folded.value, folded.how)
        return Execution(
            self.source,
            source,
            None if same else order,
            followed,
            reason,
            self.tape[order],
            called,
            entered[:-1],
            many[order] > 1,
            folded,
            self.unknown,
        )


def _bracketed(text: str) -> list[str]:
    """The expressions in brackets that follow each other."""
    found, depth, start = [], 0, 0
    for at, letter in enumerate(text):
        depth += (letter == "[") - (letter == "]")
        if letter == "[" and depth == 1:
            start = at
        if letter == "]" and depth == 0:
            found.append(text[start : at + 1])
    return found
