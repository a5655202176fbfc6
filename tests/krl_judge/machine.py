"""A slow and plain interpreter of KRL: executes a program statement by statement and notes its motions.

Written from the description of the language.  Where that leaves something open (the counter of a FOR after its end,
what a partial point keeps under another base), values become undetermined; where they decide what comes next, it stops.
What a TRIGGER or an INTERRUPT does comes at a time of its own: see ``events``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from .evaluate import evaluate
from .events import Events, Resumed
from .motions import NAN, End, Executed, Six
from .robot import ZERO, Motion, Robot
from .syntax import CLOSES, LOOPS, Line, Reader, Routine, tokens
from .values import (
    FRAME,
    STRUCTURES,
    UNDETERMINED,
    Cell,
    Stop,
    assign,
    content,
    copied,
    is_set,
    new_cell,
    restore,
)

Inputs = Mapping[int, tuple[bool, ...]]
"""$IN[n]: what it shows each time that it is read, from the first again after the last."""

MOST_STEPS = 800
SIMPLE = ("INT", "REAL", "BOOL", "CHAR")


class _Return(Exception):
    def __init__(self, value: object = None) -> None:
        self.value = value


@dataclass
class Memory:
    """What outlives a run: the variables of the .dat and of $config.dat, BASE_DATA and TOOL_DATA; ``words``: the types
    that ENUM declares."""

    cells: dict[str, Cell]
    structures: dict[str, dict[str, str]]
    words: set[str] = field(default_factory=set)

    def copy(self) -> Memory:
        return Memory({name: copied(cell) for name, cell in self.cells.items()}, self.structures, self.words)


@dataclass
class Scope:
    routine: Routine
    cells: dict[str, Cell] = field(default_factory=dict)
    loops: dict[int, tuple[int, int]] = field(default_factory=dict)


def load(tables: Mapping[str, Mapping[int, Six]], dat: str = "", config: str = "") -> Memory:
    """``tables``: BASE_DATA and TOOL_DATA."""
    memory = Memory({}, dict(STRUCTURES))
    for name, frames in tables.items():
        memory.cells[name] = table = new_cell("FRAME", STRUCTURES, (16,))
        for number, values in frames.items():
            assign(table.parts[number,], dict(zip(FRAME, values, strict=True)))
    machine = Machine([], memory, {})
    for text in (config, dat):
        for line in text.splitlines():
            found = tokens(line)
            if found and found[0][1] not in ("DEFDAT", "ENDDAT"):
                machine.declare(Reader(found), memory.cells)
    return memory


@dataclass(frozen=True)
class Run:
    """The motions of one run, in order; why it stopped before its end, "" where it did not; whether it read inputs."""

    motions: tuple[Executed, ...]
    stopped: str
    reads_inputs: bool


def run(code: list[Routine], memory: Memory, inputs: Inputs) -> Run:
    """Executes a program as far as it goes.  ``memory`` is what the run leaves."""
    machine = Machine(code, memory, inputs)
    stopped = ""
    try:
        machine.run_routine(machine.routines[0], {})
    except Stop as stop:
        stopped = str(stop)
    except Resumed:
        stopped = "RESUME after the end of the routine that declares the interrupt"
    motions = machine.robot.executed
    if (
        stopped and motions and motions[-1].approximation
    ):  # whether the next statement would have let it round is open
        motions[-1] = replace(motions[-1], approximation=None)
    return Run(tuple(motions), stopped, bool(machine.reads))


class Machine(Events):
    def __init__(self, of: list[Routine], memory: Memory, inputs: Inputs) -> None:
        super().__init__(sum(sum(shown) for shown in inputs.values()) % 4)
        self.routines, self.memory, self.inputs = of, memory, inputs
        self.reads: dict[int, int] = {}
        self.scopes: list[Scope] = []
        self.steps = 0
        self.continued = False
        self.robot = Robot(memory.cells)
        self.system = self.robot.system

    # places and values

    def cell(self, tree: tuple) -> Cell:
        if tree[0] == "name":
            for cells in (self.scopes[-1].cells if self.scopes else {}, self.memory.cells, self.system):
                if tree[1] in cells:
                    return cells[tree[1]]
            raise Stop(f"{tree[1]} is not declared")
        if tree[0] not in ("element", "member"):
            raise Stop("no variable")
        of = self.cell(tree[1])
        key: object = tree[2]
        if tree[0] == "element":
            key = tuple(self.value(index) for index in tree[2])
            if UNDETERMINED in key:
                raise Stop("an index is not determined")
        if of.is_array != (tree[0] == "element") or key not in of.parts:
            raise Stop(f"nothing is at {key}")
        return of.parts[key]

    def resolve(self, tree: tuple) -> object:
        if tree[0] == "element" and tree[1] == ("name", "$IN"):
            return self.input(self.value(tree[2][0]))
        name = tree
        while name[0] != "name":
            name = name[1]
        if name[1] in ("$POS_ACT", "$POS_FOR"):
            self.stop_advance_run()
            return UNDETERMINED if tree[0] == "member" else dict.fromkeys(FRAME, UNDETERMINED)
        if tree in (("name", "$NULLFRAME"), ("name", "$WORLD")):
            return dict(ZERO)
        cell = self.cell(tree)
        return content(cell) if is_set(cell) else None

    def input(self, number: object) -> bool:
        self.stop_advance_run()
        shown = self.inputs.get(number, (False,))
        count = self.reads[number] = self.reads.get(number, -1) + 1
        return shown[count % len(shown)]

    def stop_advance_run(self) -> None:
        """Nothing is planned ahead: the last motion ends exactly.  What an event does is in its own time."""
        if not self.continued and not self.running:
            self.robot.end_exactly()

    def value(self, tree: tuple) -> object:
        return evaluate(tree, self.resolve, self.call)

    def condition(self, tree: tuple) -> bool:
        found = self.value(tree)
        if not isinstance(found, bool):
            raise Stop("a condition that is not determined, or no BOOL")
        return found

    def whole(self, tree: tuple) -> int:
        found = self.value(tree)
        if isinstance(found, bool) or not isinstance(found, int):
            raise Stop("no INT")
        return found

    # routines

    def call(self, name: str, arguments: list) -> object:
        if name == "BAS":
            values = [0 if tree is None else self.value(tree) for tree in (*arguments, None)]
            self.robot.bas(*values[:2])
            return None
        routine = next((r for r in self.routines if r.name == name), None)
        if routine is None:
            raise Stop(f"{name} is not there")
        given: dict[str, object] = {}
        for (parameter, by_value), tree in zip(routine.parameters, arguments, strict=False):
            if tree is not None:
                given[parameter] = self.value(tree) if by_value else self.cell(tree)
        if len(arguments) > len(routine.parameters) or len(self.scopes) > 20:
            raise Stop("too many arguments or calls")
        return self.run_routine(routine, given)

    def run_routine(self, routine: Routine, given: dict[str, object]) -> object:
        """``given``: a value, or the cell of the caller."""
        scope = Scope(routine)
        for name, _ in routine.parameters:
            value = given.get(name)
            if isinstance(value, Cell):
                scope.cells[name] = value
            elif value is not None:
                scope.cells[name] = Cell("given", value)
        self.scopes.append(scope)
        try:
            at = 0
            while at < len(routine.lines):
                self.steps += 1
                if self.steps > MOST_STEPS:
                    raise Stop("it does not come to an end")
                at = self.step(scope, routine.lines[at], at)
        except _Return as back:
            if routine.result:
                result = new_cell(routine.result, self.memory.structures)
                assign(result, back.value)
                return content(result)
            return None
        finally:
            self.scopes.pop()
            self.forget_events(scope)
        if routine.result:
            raise Stop("a function without RETURN")
        return None

    def declare(self, reader: Reader, cells: dict[str, Cell]) -> None:
        while reader.accept("DECL", "GLOBAL", "CONST"):
            pass
        of = reader.name()
        structures = self.memory.structures
        if of == "ENUM":
            self.memory.words.add(reader.name())
            return
        if of == "STRUC":
            name = reader.name()
            structures[name] = components = {}
            while reader.kind != "end":
                type_ = reader.name()
                components[reader.name()] = type_
                while reader.accept(","):
                    if reader.at + 1 < len(reader.tokens) and reader.tokens[reader.at + 1][0] == "name":
                        break
                    components[reader.name()] = type_
            return
        if of not in SIMPLE and of not in structures and of not in self.memory.words:
            reader.at -= 1  # values of elements behind the declaration of an array
            cell = self.cell(reader.place(reader.name()))
            reader.expect("=")
            assign(cell, self.value(reader.expression()))
            return
        while True:
            self._declare_one(reader, of, cells)
            if not reader.accept(","):
                break
        reader.end()

    def _declare_one(self, reader: Reader, of: str, cells: dict[str, Cell]) -> None:
        name, sizes = reader.name(), []
        if reader.accept("["):
            sizes = [self.whole(reader.expression())]
            while reader.accept(","):
                sizes.append(self.whole(reader.expression()))
            reader.expect("]")
        scope = self.scopes[-1] if self.scopes else None
        if scope is not None and any(name == parameter for parameter, _ in scope.routine.parameters):
            passed = cells.get(name)
            if passed is not None and passed.type == "given":
                cells[name] = new_cell(of, self.memory.structures)
                assign(cells[name], passed.value)
            elif passed is None:
                cells[name] = new_cell(of, self.memory.structures)
            elif passed.type != of:
                raise Stop("an argument of another type")
            return
        if name in cells:
            raise Stop(f"{name} is declared twice")
        cells[name] = new_cell(of, self.memory.structures, tuple(sizes))
        if reader.accept("="):
            assign(cells[name], self.value(reader.expression()))

    # statements

    def step(self, scope: Scope, line: Line, at: int) -> int:
        """Executes the statement ``at``, or what an event does before it; the place of the next one."""
        try:
            self.come_due()
        except Resumed as ended:
            if ended.scope is scope:
                raise Stop("RESUME where no subprogram runs") from None
            raise
        try:
            return self.execute(scope, line, at)
        except Resumed as ended:
            if ended.scope is not scope:
                raise
            if line.block or line.tokens[1:2] != [("op", "(")]:
                raise Stop("RESUME in a function") from None
            self.robot.end = End()
            return at + 1

    def execute(self, scope: Scope, line: Line, at: int) -> int:
        """Executes the statement ``at``; the place of the next one."""
        reader = line.reader()
        word = line.word
        before = next((one.word for one in scope.routine.lines[:at][::-1] if one.word != ";force"), "")
        self.continued = before == "CONTINUE"
        following = line.tokens[1][1] if len(line.tokens) > 1 else ""
        if word == ";label":
            return at + 1
        if word == ";force":
            self.robot.force = "" if following.upper() == "OFF" else following
            return at + 1
        if following in ("=", ".", "[") and word not in ("DECL",):
            place = reader.place(reader.name())
            reader.expect("=")
            value = self.value(reader.expression())
            reader.end()
            cell = self.assigned(place)
            if cell is not None:
                # what becomes of the components that an aggregate leaves out is not documented
                assign(cell, value, UNDETERMINED)
            return at + 1
        if line.block:
            return self.block(scope, line, at, reader)
        if word in ("DECL", *SIMPLE) or word in self.memory.structures:
            self.declare(reader, scope.cells)
        elif word == "GOTO":
            reader.take()
            if following not in scope.routine.labels:
                raise Stop(f"no label {following}")
            return scope.routine.labels[following]
        elif word == "EXIT":
            loops = [start for start in line.inside if scope.routine.lines[start].word in LOOPS]
            if not loops:
                raise Stop("EXIT outside of loops")
            return scope.routine.lines[loops[-1]].block[-1] + 1
        elif word == "RETURN":
            reader.take()
            raise _Return(self.value(reader.expression()) if reader.kind != "end" else None)
        elif word in ("CONTINUE", "SPLINE", "ENDSPLINE", "BRAKE"):
            pass
        elif word == "HALT":
            self.stop_advance_run()
        elif word == "RESUME":
            self.resume()
        elif word == "TRIGGER":
            self.trigger(reader, scope)
        elif word == "INTERRUPT" or (word == "GLOBAL" and following == "INTERRUPT"):
            self.interrupt(reader, scope)
        elif word == "WAIT":
            reader.take()
            self.stop_advance_run()
            if reader.accept("FOR"):
                self.value(reader.expression())
        elif word in _MOTIONS:
            self.move(line, reader)
        elif following == "(":
            reader.take()
            reader.take()
            arguments = reader.arguments()
            reader.end()
            self.call(word, arguments)
        else:
            raise Stop(f"what is {word}?")
        return at + 1

    def assigned(self, tree: tuple) -> Cell | None:
        """The place that an assignment writes; None for what does not matter."""
        name = tree
        while name[0] != "name":
            name = name[1]
        if (name[1].startswith("$") and name[1] not in self.system) or name[1] == "$ADVANCE":
            if name[1] == "$OUT":
                self.stop_advance_run()
            return None
        if name[1] == "$VEL" and tree[0] == "member" and tree[2] != "CP":
            return None
        return self.cell(tree)

    def block(self, scope: Scope, line: Line, at: int, reader: Reader) -> int:
        """A line of a block: its begin, ELSE, CASE, DEFAULT or its end."""
        word, lines = reader.take(), scope.routine.lines
        first, last = line.block[0], line.block[-1]
        if word == "IF":
            tree = reader.expression()
            reader.expect("THEN")
            return at + 1 if self.condition(tree) else line.block[1] + (len(line.block) > 2)
        if word == "SWITCH":
            value = self.value(reader.expression())
            if value is UNDETERMINED:
                raise Stop("a SWITCH that is not determined")
            for branch in line.block[1:-1]:
                if self.fits(lines[branch].reader(), value):
                    return branch + 1
            return last
        if word in ("ELSE", "CASE", "DEFAULT"):
            return last
        if word == "WHILE":
            return at + 1 if self.condition(reader.expression()) else last + 1
        if word == "ENDWHILE" or word == "ENDLOOP":
            return first
        if word == "UNTIL":
            return at + 1 if self.condition(reader.expression()) else first
        if word == "FOR":
            counter = self.cell(reader.place(reader.name()))
            reader.expect("=")
            start = self.whole(reader.expression())
            reader.expect("TO")
            end = self.whole(reader.expression())
            step = self.whole(reader.expression()) if reader.accept("STEP") else 1
            if counter.type != "INT" or step == 0:
                raise Stop("a FOR that KRL does not know")
            scope.loops[first] = end, step
            return self.count(counter, start, end, step, first, last)
        if word == "ENDFOR":
            if first not in scope.loops:
                raise Stop("a jump into a FOR")
            begin = lines[first].reader()
            begin.take()
            counter = self.cell(begin.place(begin.name()))
            if not isinstance(counter.value, int):
                raise Stop("the counter is not determined")
            end, step = scope.loops[first]
            return self.count(counter, counter.value + step, end, step, first, last)
        return at + 1

    def count(self, counter: Cell, value: int, end: int, step: int, first: int, last: int) -> int:
        if value > end if step > 0 else value < end:
            counter.value = UNDETERMINED
            return last + 1
        counter.value = value
        return first + 1

    def fits(self, case: Reader, value: object) -> bool:
        if case.take() == "DEFAULT":
            return True
        while True:
            one = self.value(case.expression())
            if type(one) is not type(value):
                raise Stop("CASE of another kind")
            if one == value:
                return True
            if not case.accept(","):
                return False

    # motions

    def point(self, reader: Reader) -> dict:
        value = self.value(reader.expression())
        if not isinstance(value, dict):
            raise Stop("no point")
        return value

    def move(self, line: Line, reader: Reader) -> None:
        """A motion, with what it states for itself behind WITH."""
        motion = self.motion(reader)
        before = []
        while reader.accept("WITH" if not before else ","):
            cell = self.cell(reader.place(reader.name()))
            before.append((cell, copied(cell)))
            reader.expect("=")
            assign(cell, self.value(reader.expression()), UNDETERMINED)
        reader.end()
        self.robot.move(line.number, motion)
        for cell, earlier in reversed(before):
            restore(cell, earlier)

    def motion(self, reader: Reader) -> Motion:
        word = reader.take()
        relative = word.endswith("_REL")
        kind = word.removesuffix("_REL")
        kind = kind if kind == "SPL" else kind.removeprefix("S")
        aux = None
        if kind == "CIRC":
            aux = self.point(reader)
            reader.expect(",")
        value = self.point(reader)
        angle = None
        if kind == "CIRC" and reader.accept(","):
            if reader.name() != "CA":
                raise Stop("CA")
            found = self.value(reader.expression())
            angle = NAN if found is UNDETERMINED else float(found)
        rounds, in_tool = [], False
        while reader.kind != "end" and reader.next != "WITH":
            if reader.next in ("#BASE", "#TOOL") and relative:
                in_tool = reader.take() == "#TOOL"
            elif reader.next in ("C_DIS", "C_VEL", "C_ORI", "C_PTP"):
                rounds.append(reader.take())
            else:
                reader.end()
        return Motion(kind, relative, value, aux, angle, tuple(rounds), in_tool)


_MOTIONS = {
    s + word + relative for word in ("PTP", "LIN", "CIRC") for relative in ("", "_REL") for s in ("", "S")
} | {"SPL"}
assert not _MOTIONS & set(CLOSES)
