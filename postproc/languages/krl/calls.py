"""Jumps, and calls of the routines of a program."""

from __future__ import annotations

import re

from postproc.languages.krl.assignments import command, keep
from postproc.languages.krl.block_follower import BlockFollower
from postproc.languages.krl.execution_context import BlockFrame, Item
from postproc.languages.krl.lexing import LOOPS, NAME, Call, Statement, identifiers, split_values
from postproc.languages.krl.program_structure import Routine, closure
from postproc.languages.krl.statement_effects import PATH_FROM_FILE, is_harmless
from postproc.languages.krl.target import shown
from postproc.languages.krl.variables import Entry

MOST_CALLS = 30
"""Calls inside of one another that are followed."""

_PLAIN_NAME = re.compile(rb"[ \t]*+(" + NAME + rb")[ \t]*+(\[[ \t]*+\d++[ \t]*+\])?[ \t]*+\Z")


class Restart(Exception):
    """What was taken for certain was not; ``UncertainBlocks`` knows it now."""


class Calls(BlockFollower):
    """Follows jumps and calls."""

    def _label(self, item: Statement, name: bytes) -> None:
        run, routine = self.run, self.run.routine
        if routine is None or (routine.start, name) not in self.uncertain_blocks.labels:
            return
        effects = {"point", *run.survey.passed_through[routine.start, name]}
        run.forget(effects, f"after the label {shown(name)} in line {item.line}")
        mark = b"label %d " % routine.start + name
        run.rows.sources[mark] |= run.state.sources
        run.state.sources = frozenset([mark])
        run.add_finding(
            "KRL020",
            f"a GOTO leads to {shown(name)}: the position is not known from here on, nor is what changes in between",
            item,
        )

    def _goto(self, pc: int, name: bytes) -> int:
        run, routine = self.run, self.run.routine
        if routine is None:
            return pc + 1
        if name in routine.labels:
            at, blocks = routine.labels[name]
            open_blocks = self._open_in_routine()
            inside = [opened for opened in open_blocks if opened.block in blocks]
            certain = (
                not run.uncertain
                and not self.uncertain_blocks.plain
                and [o.block for o in inside] == list(blocks)
            )
            if certain:
                while run.stack and run.stack[-1] in open_blocks and run.stack[-1] not in inside:
                    self._pop()
                self.jumped = self.jumped or at <= pc
                return at
            if (routine.start, name) not in self.uncertain_blocks.labels:
                self.uncertain_blocks.labels.add((routine.start, name))
                self.uncertain_blocks.passed.update(
                    o.block.start for o in open_blocks if o.block.word in LOOPS
                )
                raise Restart
        run.rows.sources[b"label %d " % routine.start + name] |= run.state.sources
        return pc + 1

    def _open_in_routine(self) -> list[BlockFrame]:
        found: list[BlockFrame] = []
        for opened in reversed(self.run.stack):
            if opened.back >= 0:
                break
            found.append(opened)
        return found[::-1]

    def _exit(self, pc: int) -> int:
        run = self.run
        loop = next((o for o in reversed(self._open_in_routine()) if o.block.word in LOOPS), None)
        if loop is None or not loop.followed:
            return pc + 1
        if run.uncertain:
            return self._abort(loop)
        while run.stack[-1] is not loop:
            self._pop()
        self._pop()
        return loop.block.end + 1

    def _leave(self, pc: int, kind: str) -> int | None:
        run = self.run
        call = next((opened for opened in reversed(run.stack) if opened.back >= 0), None)
        if kind == "return" and run.uncertain:
            return pc + 1 if call is None else self._abort(call)
        if call is None:
            return None if run.routine is not None else pc + 1
        while run.stack[-1] is not call:
            self._pop()
        self._pop()
        back = [(run.variables.get(inner), name, path) for inner, name, path in call.returned]
        for name, entry in call.saved:
            run.variables.replace(name, entry)
        run.routine = call.routine
        for value, name, path in back:
            if value is not None:
                keep(run, name, path, value)
        return call.back

    def _call(self, pc: int, item: Statement, said: Call) -> int:
        run = self.run
        if said.name == b"BAS":
            command(run, item, said.arguments)
            return pc + 1
        routine = run.survey.routines.get(said.name)
        if routine is not None and self._follows(said.name, routine) and not self._aliased(said, routine):
            return self._enter_call(pc, said, routine)
        run.mentioned |= identifiers(said.arguments)
        self._called(item, said.name, said.arguments)
        return pc + 1

    def _follows(self, name: bytes, routine: Routine) -> bool:
        """Whether a call is followed, as it surely runs now and is no call of a call of a call ..."""
        run, uncertain_blocks = self.run, self.uncertain_blocks
        if run.uncertain or uncertain_blocks.plain or routine.is_main or routine.is_function:
            return False
        if routine.start in uncertain_blocks.passed or name in run.survey.later:
            return False
        return sum(opened.back >= 0 for opened in run.stack) < MOST_CALLS

    def _aliased(self, said: Call, routine: Routine) -> bool:
        """Whether a parameter that comes back is a variable that the subprogram knows by its own name too."""
        run = self.run
        given = [text.strip() for text in split_values(said.arguments)]
        names = [
            found[1].upper()
            for (_, comes_back), text in zip(routine.parameters, given, strict=False)
            if comes_back and (found := _PLAIN_NAME.match(text))
        ]
        if not names:
            return False
        if len(set(names)) < len(names):
            return True
        for name in closure(run.survey, [routine.name]):
            inner = run.survey.routines[name]
            first, last = run.code[inner.start], run.code[min(inner.end, len(run.code) - 1)]
            mentioned = self._mentioned(first, last)
            if any(one in mentioned and one not in inner.types for one in names):
                return True
        return False

    def _mentioned(self, first: Item, last: Item) -> frozenset[bytes]:
        """The names between two statements."""
        start, stop = (
            item.at if isinstance(item, Statement) else int(item.motion[0, 0]) for item in (first, last)
        )
        if start not in self.mentioned_from:
            self.mentioned_from[start] = identifiers(self.run.document.raw[start:stop])
        return self.mentioned_from[start]

    def _enter_call(self, pc: int, said: Call, routine: Routine) -> int:
        run, variables = self.run, self.run.variables
        texts = [text.strip() for text in split_values(said.arguments)]
        given: dict[bytes, Entry] = {}
        returned = []
        for (name, comes_back), text in zip(routine.parameters, texts, strict=False):
            value = run.value(text) if text else None
            given[name] = {} if value is None else {b"": value}
            found = _PLAIN_NAME.match(text)
            if comes_back and found:
                path = (found[2] or b"").replace(b" ", b"").replace(b"\t", b"")
                returned.append((name, found[1].upper(), path))
        opened = self._push(routine, True)
        opened.back, opened.returned = pc + 1, tuple(returned)
        own = run.routine.types if run.routine is not None else {}
        names = dict.fromkeys([*own, *routine.types])
        self.spent += len(names)
        run.routine = routine
        for name, entry in given.items():
            for key, value in entry.items():
                entry[key] = run.converted(name, value)
        opened.saved = tuple((name, variables.replace(name, given.get(name))) for name in names)
        run.followed[routine.name] = None
        return routine.start + 1

    def _called(self, item: Statement, name: bytes, given: bytes) -> None:
        """Takes up that a routine or function ran; the names in ``given`` may come back from it changed."""
        run = self.run
        words = identifiers(given)
        called = shown(name)
        why = f"after the call of {called} in line {item.line}"
        routine = run.survey.routines.get(name)
        if routine is not None:
            run.rows.sources[b"routine %d" % routine.line] |= run.state.sources
            self.text_called.add(name)
            run.forget(routine.effects | words, why)
            return
        if is_harmless(name):
            return
        run.forget({"point", *words}, why)
        if name.startswith(PATH_FROM_FILE):
            run.add_finding(
                "KRL021", f"{called} reads its path from a file; that path is not corrected", item
            )
        else:
            message = f"{called} is not read: after it the position is not known; base and tool are assumed unchanged"
            run.add_finding("KRL010", message, item)

    def _unread(self, item: Statement, name: bytes) -> None:
        """Reports a routine that an interrupt or a trigger runs, and that is not in this file."""
        if not is_harmless(name):
            message = f"{shown(name)} is not read: it runs at a time of its own; base and tool are assumed unchanged"
            self.run.add_finding("KRL010", message, item)
