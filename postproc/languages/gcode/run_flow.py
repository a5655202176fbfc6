"""A program is followed, block by block of those that say more than words: loops, branches and jumps."""

from __future__ import annotations

import math
from bisect import bisect_left
from itertools import pairwise

from postproc.languages.gcode.execution_flow import ONE_ARM_RUNS, STRAIGHT, UNCLEAR
from postproc.languages.gcode.run_calls import RunCalls
from postproc.languages.gcode.run_state import MODE_VERBS
from postproc.languages.gcode.statements import Construct, FlowStatement, NotFollowed, Verb


class RunFlow(RunCalls):
    """Goes where the flow leads; what may run or not is emitted as that, in its place."""

    def follow(self) -> int:
        """Runs the program; the block after the last one that is certain to run.  Raises NotFollowed."""
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
                if self.frames[-1].through:
                    self.reached.append((self.count, limit))
                if limit >= self.n:  # a subprogram without an end
                    raise NotFollowed
                at = self.leave()
                continue
            self.emit(at, block)
            following = self.step(block)
            if following is None:
                return min(self.stop, block + 1)
            at = following

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
                self.reached.append((self.count, block))
                return block + 1
            if not math.isnan(holds):
                self.held.append(self.count)
                return self.certain(block, statement)
        if block in self.deleted:
            return self.perhaps(block, statement)
        return self.certain(block, statement)

    def certain(self, block: int, statement: FlowStatement | None) -> int | None:
        """A block that surely runs.  Raises NotFollowed."""
        step = self.count
        if statement is None or statement.verb != Verb.SUB:
            self.fold(block, step)
        if statement is not None and statement.verb == Verb.SUB:
            return self.flow(statement)
        self.assign(block)
        if statement is not None:
            return self.flow(statement)
        self.emit(block, block + 1)
        verb = self.codes.get(block)
        if verb == "end":
            return self.leave() if self.frames and self.control.calls else None
        if verb == "return" and self.frames:
            if self.last_word(block, "P") >= 0:
                raise NotFollowed
            return self.leave()
        if verb == "return":
            return self.main_return(block)
        if verb and verb in MODE_VERBS.values():
            self.keep_modes(verb, step)
            return block + 1
        if verb is not None:
            return self.call(block, verb, step)
        return block + 1

    def perhaps(self, block: int, statement: FlowStatement | None) -> int:
        """A block that runs only sometimes.  Raises NotFollowed."""
        verb = self.codes.get(block)
        if statement is not None:
            if statement.verb == Verb.GOTO:
                return self.branch_away(statement)
            if statement.verb != Verb.CALL:
                raise NotFollowed
        if verb == "return" and self.frames:
            self.hide(self.frames[-1].call)
        if verb == "return" and (target := self.returned_to(block)) > block:
            return self.branch_away(FlowStatement(block, Verb.GOTO), target)
        self.fold(block, self.count)
        self.emit(block, block + 1)
        self.assign(block, certain=False)
        if verb and verb in MODE_VERBS.values():
            self.keep_modes(verb, UNCLEAR)
        if verb == "return":
            return self.may_start_again([block], block + 1)
        if statement is not None or verb in ("call", "local", "macro", "named"):
            self.perhaps_call(block, verb or "", statement)
            self.variables.forget()
        return block + 1

    def flow(self, statement: FlowStatement) -> int | None:
        """Follows a statement about flow; where the run goes on, None where it ends.  Raises NotFollowed."""
        block, verb = statement.block, statement.verb
        around = self.shape.construct.get(block)
        if around is not None and block == around.start and block in self.opaque and verb != Verb.SUB:
            return self.maybe(around)
        if verb == Verb.SUB:
            assert around is not None
            self.emit(block, block + 1)
            return around.stop + 1
        if verb == Verb.CALL:
            return self.call(block, "call", self.count)
        if verb == Verb.GOTO:
            return self.jump(statement)
        if verb == Verb.REPEAT_PART:
            return self.repeat_part(statement)
        assert around is not None
        if verb in (Verb.BREAK, Verb.CONTINUE) and self.leaves_oddly(around, verb):
            self.hide(around.start)
        if verb == Verb.RETURN:
            if not self.frames:
                raise NotFollowed
            self.emit(block, block + 1)
            self.returned(statement)
            return self.leave()
        if verb == Verb.BREAK:
            self.emit(block, block + 1)
            self.repeats.pop(around.start, None)
            return around.stop + 1
        if verb == Verb.CONTINUE:
            if around.verb != Verb.WHILE:
                self.jumped.append(self.count)
                return around.stop
            self.emit(block, block + 1)
            return self.loop(around, self.shape.statements[around.stop])
        if around.verb == Verb.SUB:
            if not self.frames:
                raise NotFollowed
            self.emit(block, block + 1)
            self.returned(statement)
            return self.leave()
        self.emit(block, block + 1)
        return self.loop(around, statement) if around.verb != Verb.IF else self.branch(around, block)

    def branch(self, around: Construct, block: int) -> int:
        if block != around.start:  # from the end of the arm that ran
            return around.stop + 1
        for at, text in around.arms:
            holds = self.value(text, at) if text or at == around.start else 1.0
            if math.isnan(holds):
                return self.maybe(around)
            if holds:
                return at + 1
        return around.stop + 1

    def loop(self, around: Construct, statement: FlowStatement) -> int:
        """At the start or the end of a loop."""
        ahead = statement.block == around.start
        inside, behind = around.start + 1, around.stop + 1
        if around.verb == Verb.WHILE:
            holds = self.value(around.text, around.start)
        elif around.verb == Verb.DO:
            # With the BREAK of a WHILE, even one that is passed over, LinuxCNC ends the next DO.
            holds = 1.0 if ahead else math.nan if self.breaks_loop else self.value(around.until, around.stop)
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
                if math.isnan(count) or count != math.floor(count) or self.counts_on(around):
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

    def leaves_oddly(self, around: Construct, verb: Verb) -> bool:
        """Whether LinuxCNC may not do what a BREAK or CONTINUE says: it has none of a REPEAT, and after a CONTINUE of
        a DO it goes on with a WHILE that a BREAK should end."""
        return around.verb == Verb.REPEAT or (
            around.verb == Verb.WHILE and verb == Verb.BREAK and self.continues_do
        )

    def counts_on(self, around: Construct) -> bool:
        """Whether LinuxCNC may run a REPEAT another number of times than it states: after a CONTINUE of a DO it counts
        it again at its end, and one that was left from within goes on with what was left of its count."""
        return self.continues_do or self.repeats.get(around.start, -1) >= 0

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
        arms = [block for block, _ in around.arms] if around.verb == Verb.IF else [around.start]
        one_runs = around.verb == Verb.IF and len(arms) > 1 and not around.arms[-1][1]
        self.passed_or_not([*arms, around.stop], one_runs)
        self.perhaps_range(around.start, around.stop + 1)
        return self.may_start_again(self.main_returns(around.start, around.stop + 1), around.stop + 1)

    def passed_or_not(self, bounds: list[int], one_runs: bool) -> None:
        """Notes what is between blocks, the first of which is the next to run, as parts of which one runs or none."""
        first, group = self.count - bounds[0], self.count
        for start, stop in pairwise(bounds):
            low, high = bisect_left(self.special, start + 1), bisect_left(self.special, stop)
            straight = not any(block in self.shape.statements for block in self.special[low:high])
            kind = STRAIGHT * straight + ONE_ARM_RUNS * one_runs
            self.conditional.append((first + start + 1, first + stop, group, kind))

    def perhaps_range(self, start: int, stop: int) -> None:
        low, high = bisect_left(self.special, start), bisect_left(self.special, stop)
        for block in self.special[low:high]:
            self.fold(block, self.count + block - start)
            statement, verb = self.shape.statements.get(block), self.codes.get(block, "")
            if verb and verb in MODE_VERBS.values():
                self.keep_modes(verb, UNCLEAR)
            elif statement is None or statement.verb == Verb.CALL:
                self.perhaps_call(block, verb, statement)
        self.emit(start, stop, uncertain=True)

    def escape(self, start: int, stop: int) -> None:
        """Makes what is left from within the blocks uncertain as well.  Raises RunAgain, NotFollowed."""
        low, high = bisect_left(self.special, start), bisect_left(self.special, stop)
        for block in self.special[low:high]:
            statement = self.shape.statements.get(block)
            if self.codes.get(block) == "return" and self.frames:
                self.hide(self.frames[-1].call)
            if self.codes.get(block) == "return" and self.returned_to(block) > stop:
                raise NotFollowed
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
                if self.labels.is_missing(statement, block):
                    continue
                if target is None or not start <= target <= stop:
                    raise NotFollowed
            if statement.verb == Verb.REPEAT_PART:
                raise NotFollowed

    def jump(self, statement: FlowStatement) -> int | None:
        """A jump whose condition is known.  Raises NotFollowed."""
        holds = self.value(statement.text, statement.block) if statement.text else 1.0
        if math.isnan(holds):
            return self.branch_away(statement)
        self.emit(statement.block, statement.block + 1)
        if not holds:
            return statement.block + 1
        jump = self.computed(statement)
        if self.labels.is_missing(jump, jump.block):
            return statement.block + 1 if jump.direction == "C" else None  # an alarm
        target = self.labels.find(jump, jump.block)
        if target is None:
            raise NotFollowed
        self.entered.append(self.count)
        self.jumped.append(self.count)
        return target

    def computed(self, statement: FlowStatement) -> FlowStatement:
        """A jump with the number of its label where that is computed.  Raises NotFollowed."""
        if not statement.label.startswith(("#", "[")):
            return statement
        number = self.value(statement.label, statement.block)
        if math.isnan(number):
            raise NotFollowed
        return FlowStatement(
            statement.block, statement.verb, f"{number:.0f}", statement.text, statement.direction
        )

    def branch_away(self, statement: FlowStatement, target: int | None = None) -> int:
        """A jump that happens only sometimes, to its label or to ``target``: what it passes may run or not.  Raises
        NotFollowed."""
        start = statement.block
        if target is None and self.labels.is_missing(statement, start):
            self.emit(start, start + 1)
            return start + 1
        stop = self.labels.find(statement, start) if target is None else target
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
                if not self.labels.is_missing(inner, block):
                    if target is None or target <= start:
                        raise NotFollowed
                    stop = max(stop, target)
            if inner is not None and inner.verb == Verb.REPEAT_PART:
                raise NotFollowed
            if self.codes.get(block) == "return":
                stop = max(stop, self.returned_to(block))
            at = block + 1
        if self.labels.between(start, stop):
            raise NotFollowed
        self.kill(start, stop)
        self.passed_or_not([start, stop], False)
        self.emit(start, start + 1)
        self.perhaps_range(start + 1, stop)
        self.entered.append(self.count)
        return self.may_start_again(self.main_returns(start + 1, stop), stop)

    def main_return(self, block: int) -> int | None:
        """M99 of the main program: a jump to the block of its P, or back to the start.  Raises NotFollowed."""
        target = self.returned_to(block)
        if target <= block:
            return target if self.starts_again(block, target) else None
        self.entered.append(self.count)
        self.jumped.append(self.count)
        return target

    def returned_to(self, block: int) -> int:
        """Where M99 of the main program leads to.  Raises NotFollowed."""
        if self.last_word(block, "P") < 0:
            return self.labels.part_of(block)[0]
        number = self.word(block, "P")
        if math.isnan(number) or number != math.floor(number):
            raise NotFollowed
        target = self.labels.number(int(number), block)
        if target is None:
            raise NotFollowed
        return target

    def main_returns(self, start: int, stop: int) -> list[int]:
        """The blocks ``start`` .. ``stop`` - 1 with a M99 of the main program."""
        low, high = bisect_left(self.special, start), bisect_left(self.special, stop)
        codes = ((block, self.codes.get(block)) for block in self.special[low:high])
        return [block for block, code in codes if code == "return" and not self.frames]

    def may_start_again(self, blocks: list[int], following: int) -> int:
        """Where the run goes on after ``blocks`` that may lead back: to ``following``, or to where it starts again."""
        for block in blocks:
            target = self.returned_to(block)
            if target <= block and self.starts_again(block, target):
                return target
        return following

    def starts_again(self, block: int, target: int) -> bool:
        """Whether the run goes through the blocks from ``target`` to this one once more; it does so for one M99."""
        self.restarts.append(block)
        if self.again != block or self.second_pass >= 0:
            return False
        self.kill(target, self.n)  # from pass to pass
        self.second_pass = self.count
        self.entered.append(self.count)
        self.jumped.append(self.count)
        return True
