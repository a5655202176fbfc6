"""Calls of subprograms of the file, and parts that are repeated."""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections import Counter

import numpy as np

from postproc.base.arrays import Bools
from postproc.languages.gcode.execution_flow import NEVER, UNCLEAR
from postproc.languages.gcode.run_labels import called_name
from postproc.languages.gcode.run_state import CallFrame, RunState
from postproc.languages.gcode.statements import FlowStatement, NotFollowed, separated
from postproc.languages.gcode.words import How, key

DEEPEST_CALL = 20
PACKED = 10_000
"""M98 P031234 calls O1234 three times."""
_ARGUMENTS = dict(zip("ABCIJKDEFHMQRSTUVWXYZ", (*range(1, 10), 11, 13, *range(17, 27)), strict=True))
"""Letters of G65 -> the numbers of their variables."""
PROCEDURE = re.compile(r"PROC[ \t]++\w++[ \t]*+\(([^()]*+)\)", re.I)
"""The head of a subprogram with parameters."""
_PARAMETER = re.compile(r"(REAL)[ \t]++(\w++)[ \t]*+(?:=.*)?", re.I)
"""One whose value is handed over; what a whole number or a truth makes of a value is not looked at."""
_REPEATED = "IJK"
"""Letters that may come up to ten times."""
_COUNTS = "DEFHMST"
"""Letters that are no lengths or angles."""


class RunAgain(Exception):
    """A construct or a call is to be taken as one that may run or not."""


class RunCalls(RunState):
    """Goes into what is called, and back."""

    def call(self, block: int, verb: str, step: int) -> int:
        """A call; ``step``: at which its block runs."""
        statement = self.shape.statements.get(block)
        if statement is not None:
            self.emit(block, block + 1)
        found = self.called_part(block, verb, statement)
        if found is None:
            self.miss(block, verb, statement)
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
        jumps, saves = verb == "local", step if self.restores(start, stop) else NEVER
        self.frames.append(CallFrame(block + 1, start, stop, count, block, outer, jumps, saves=saves))
        return self.enter_part()

    def restores(self, start: int, stop: int) -> bool:
        """Whether a subprogram in the blocks ``start`` .. ``stop`` - 1 restores modes at its end."""
        return bisect_left(self.saving, start) < bisect_left(self.saving, stop)

    def keep_modes(self, verb: str, step: int) -> None:
        """M70 to M73 at ``step``, UNCLEAR where it may run or not."""
        around = self.frames[-1] if self.frames else self
        if verb == "restore":
            if step != UNCLEAR:
                self.saved.append((UNCLEAR if around.kept == NEVER else around.kept, self.count))
            return
        around.kept = UNCLEAR if verb == "invalidate" else step
        if verb == "save for the call" and self.frames:
            self.frames[-1].saves = step

    def enter_part(self) -> int:
        """The start of what is called or repeated."""
        frame = self.frames[-1]
        if frame.jumps:
            self.jumped.append(self.count)
        return frame.start

    def perhaps_call(self, block: int, verb: str, statement: FlowStatement | None) -> None:
        """A call that may run or not: the blocks of what it calls may run more often than they are followed."""
        if statement is None and verb not in ("call", "local", "macro", "named"):
            return
        found = self.called_part(block, verb, statement)
        if found is None:
            self.miss(block, verb, statement)
        else:
            start, stop = found[:2]
            self.perhaps_called.append((start, self.sizes.get(start, stop)))

    def miss(self, block: int, verb: str, statement: FlowStatement | None) -> None:
        """Notes the name of a program that is called and not in the file."""
        if statement is not None:
            self.missing.add(called_name(statement.label))
            return
        number = self.word(block, "L" if verb == "named" else "P")
        if verb == "local" or math.isnan(number) or not 0 < number == math.floor(number):
            return
        self.missing.add(f"{'L' if verb == 'named' else ''}{number:.0f}")
        if verb != "named" and number >= PACKED:
            self.missing.add(f"{number % PACKED:.0f}")

    def called_part(
        self, block: int, verb: str, statement: FlowStatement | None
    ) -> tuple[int, int, int, dict[str, float] | None] | None:
        """First block, the one after the last, runs and own variables of what is called; None where it is not here."""
        label = "" if statement is None else self.called_label(statement)
        if statement is not None and label.startswith("O") and label in self.shape.subprograms:
            around = self.shape.subprograms[label]
            self.sizes[around.start + 1] = around.stop
            values = [self.value(text, block) for text in _bracketed(statement.text)]
            numbered = {f"#{number}": 0.0 for number in range(1, 31)}
            numbered |= {f"#{number}": value for number, value in enumerate(values, 1)}
            return around.start + 1, self.n, 1, numbered
        if statement is not None:
            name, bracket, handed = statement.label.partition("(")
            part = self.labels.program(name)
            if part is None or not bracket:
                return None if part is None else (*part, 1, self.variables.own())
            parameters = self.parameters(part, handed.rstrip().removesuffix(")"), block)
            return None if parameters is None else (*part, 1, parameters)
        if verb == "named":
            number, runs = self.word(block, "L"), self.runs(block, "P")
            part = self.labels.program(f"L{number:.0f}") if not math.isnan(number) else None
            return None if part is None or runs is None else (*part, runs, self.variables.own())
        number, runs = self.word(block, "P"), self.runs(block, "L")
        if verb == "call" and any(self.last_word(block, letter) >= 0 for letter in "DHIJKQR"):
            return None  # it starts at a block of the subprogram (H, Q), or what the word does is not known
        if math.isnan(number) or number != math.floor(number) or runs is None:
            return None
        if verb == "local":
            start = self.labels.number(int(number), block)
            return None if start is None else (start, self.n, runs, None)
        part = self.labels.program(f"{number:.0f}")
        if part is None and number >= PACKED and self.last_word(block, "L") < 0:
            runs, part = int(number) // PACKED, self.labels.program(f"{int(number) % PACKED}")
        if part is None:
            return None
        if verb == "macro":
            return (*part, runs, self.arguments(block))
        return (*part, runs, None)

    def parameters(self, part: tuple[int, int], handed: str, block: int) -> dict[str, float] | None:
        """What a subprogram of a Sinumerik has of its own at its start, by its PROC; None where that does not state
        parameters whose values are handed over, or states fewer than are ``handed`` over."""
        heads = [text for text in self.assigned.get(part[0], ()) if PROCEDURE.match(text)]
        found = PROCEDURE.match(heads[0]) if len(heads) == 1 else None
        names = (
            [_PARAMETER.fullmatch(one.strip()) for one in found[1].split(",")] if found is not None else []
        )
        texts = separated(handed)
        if not names or None in names or len(texts) > len(names):
            return None
        values = [self.value(text, block) for text in texts]
        return {one[2].upper(): value for one, value in zip(names, values, strict=False) if one is not None}

    def arguments(self, block: int) -> dict[str, float]:
        """The variables that the words of G65 set.  I, J and K in this order are #4, #5 and #6; each that comes again
        starts three further ones; of two words for one variable the later one holds (Fanuc, "argument specification I
        and II").  What other orders are, the manuals do not state."""
        given: dict[str, float] = {}
        counts: Counter[str] = Counter()
        further, group = 0, ""
        for letter in "".join(self.letters.get(block, ())):
            nth = counts[letter]
            counts[letter] += 1
            if letter not in _ARGUMENTS:
                continue
            if letter in _REPEATED:
                again = letter in group
                if not again and group and letter < group[-1]:
                    return {name: value for name, value in given.items() if int(name[1:]) < _ARGUMENTS["I"]}
                further, group = (further + 1, letter) if again else (further, group + letter)
            number = _ARGUMENTS[letter] + (len(_REPEATED) * further if letter in _REPEATED else 0)
            twice = nth > 0 and letter not in _REPEATED
            given[f"#{number}"] = math.nan if twice else self.argument(block, letter, nth)
        return {name: value for name, value in given.items() if not math.isnan(value)} if further < 10 else {}

    def argument(self, block: int, letter: str, nth: int) -> float:
        """What the ``nth`` word of a letter of G65 states; NaN of a length in increments that is not known."""
        column = self.source.column(key(letter))
        at = int(bisect_left(column.block, block)) + nth
        counts = self.integer_words.increments or self.integer_words.ambiguous
        if counts and letter not in _COUNTS and column.how[at] == How.INTEGER:
            return math.nan
        for step, address, place, value, _ in reversed(self.rows):
            if step != self.count - 1:
                break
            if (address, place) == (key(letter), nth):
                return value
        return float(column.value[at])

    def runs(self, block: int, letter: str) -> int | None:
        """How often a call runs, by the word of this letter; None where that is not known."""
        if self.last_word(block, letter) < 0:
            return 1
        count = self.word(block, letter)
        return int(count) if count >= 0 and count == math.floor(count) else None

    def called_label(self, statement: FlowStatement) -> str:
        """What a call names; O#1 and O[#1+1] with the number that they give."""
        label = statement.label
        if not label.startswith(("O#", "O[")):
            return label
        number = self.value(label[1:], statement.block)
        return label if math.isnan(number) or number != math.floor(number) else f"O{number:.0f}"

    def returned(self, statement: FlowStatement) -> None:
        """The value that a subprogram returns."""
        value = self.value(statement.text, statement.block) if statement.text else math.nan
        self.variables.result = value

    def leave(self) -> int:
        """From the end of what is repeated or called."""
        frame = self.frames[-1]
        if frame.saves != NEVER:
            self.saved.append((frame.saves, self.count))
        frame.count -= 1
        if frame.count > 0:
            return self.enter_part()
        self.frames.pop()
        if frame.locals is not None:
            self.variables.leave(frame.locals)
        return frame.back

    def repeat_part(self, statement: FlowStatement) -> int:
        """REPEAT from a label up to here, or up to another label.  Raises NotFollowed."""
        block = statement.block
        start = self.labels.find(statement, block)
        count = self.value(statement.text, block)
        if start is None or math.isnan(count) or count != math.floor(count):
            self.lacks_count = math.isnan(count)
            raise NotFollowed
        self.emit(block, block + 1)
        if statement.direction == "B":
            stop = start + 1
        elif statement.direction:
            end = self.labels.find(FlowStatement(block, statement.verb, statement.direction), start)
            if end is None or end < start:
                raise NotFollowed
            stop = end
        else:
            stop = self.labels.end_label(start, block)
        if start <= block < stop or count < 1:
            if count < 1:
                return block + 1
            raise NotFollowed
        if stop != block and statement.direction != "B" and self.says_more_than_a_label(stop):
            raise NotFollowed  # whether the block of the last label is repeated too is not certain
        through = statement.direction != "B"
        self.frames.append(CallFrame(block + 1, start, stop, int(count), block, None, True, through))
        return self.enter_part()

    def says_more_than_a_label(self, block: int) -> bool:
        """Whether a block has words, but its number, or says anything besides its label."""
        if block not in self.only_labels:
            noted = any(note.block == block and note.kind != "label" for note in self.source.notes)
            columns = (column for address, column in self.source.columns.items() if address != key("N"))
            self.only_labels[block] = not noted and not any(
                (column.block == block).any() for column in columns
            )
        return not self.only_labels[block]

    def hide(self, block: int) -> None:
        """Has the program followed again, with what a block opens or calls as what may run or not.  Raises RunAgain."""
        self.opaque.add(block)
        raise RunAgain

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
