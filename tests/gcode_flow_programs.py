"""Programs with variables, branches, loops and calls: drawn as a tree, run here, and written for three controls.

``run`` is the truth: it walks the tree and knows nothing of any control.  A ``Doubt`` runs or not, as an answer says;
in the text its condition is a variable without a value, or a slash.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

Expr = Any
"""A number; ("v", n) a variable, ("a", n) an argument, or (operator, left, right)."""
ARITHMETIC: dict[str, Callable[[Any, Any], Any]] = {
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b,
    "<": lambda a, b: a < b, "<=": lambda a, b: a <= b, "==": lambda a, b: a == b,
    ">": lambda a, b: a > b, ">=": lambda a, b: a >= b, "!=": lambda a, b: a != b,
    "and": lambda a, b: a and b, "or": lambda a, b: a or b,
}  # fmt: skip
OPPOSITE = {"<": ">=", ">=": "<", "<=": ">", ">": "<=", "==": "!=", "!=": "==", "and": "or", "or": "and"}


def opposite(condition: Expr) -> Expr:
    operator, left, right = condition
    both = operator in ("and", "or")
    return (OPPOSITE[operator], opposite(left) if both else left, opposite(right) if both else right)


@dataclass(eq=False)
class Node:
    """A statement; ``body``, ``other``: what is in it."""

    verb: str
    name: Any = None
    value: Expr = None
    last: Expr = None
    body: list[Node] = field(default_factory=list)
    other: list[Node] = field(default_factory=list)


class Ran(NamedTuple):
    """A motion that ran: its statement, where it ended, whether nothing of that hangs on a doubt, and the number of the
    comment that was passed last."""

    node: Node
    end: tuple[float, float, float]
    sure: bool
    said: int


def all_of(nodes: Sequence[Node]) -> list[Node]:
    """The statements and those in them."""
    return [*nodes, *(inner for node in nodes for inner in all_of([*node.body, *node.other]))]


def verbs_of(nodes: Sequence[Node]) -> set[str]:
    return {node.verb for node in all_of(nodes)}


class _Left(Exception):
    """``break``, ``continue`` or ``return``."""


class Run:
    """One run of a tree; ``answers``: of one doubt after the other, how often it runs."""

    def __init__(self, subs: Sequence[Sequence[Node]], answers: Iterator[int]) -> None:
        self.subs, self.answers = subs, answers
        self.values: dict[int, float] = {}
        self.arguments: list[float] = []
        self.here = {"X": 0.0, "Y": 0.0, "Z": 0.0}
        self.motions: list[Ran] = []
        self.unsure: set[Any] = set()
        """Variables and axes whose values hang on a doubt, and "said", where the last comment does."""
        self.doubts = 0
        self.said = 0
        self.called = False
        """Whether a subprogram was called in a doubt: what it leaves, and how often it runs, is not followed."""
        self.left = False
        """Whether a loop or a subprogram is left in a doubt: all of it runs or not."""

    def value(self, text: Expr) -> Any:
        if not isinstance(text, tuple):
            return text
        if text[0] == "v":
            return self.values[text[1]]
        if text[0] == "a":
            return self.arguments[text[1]]
        return ARITHMETIC[text[0]](self.value(text[1]), self.value(text[2]))

    def all(self, nodes: Sequence[Node]) -> None:
        for node in nodes:
            getattr(self, node.verb)(node)

    def once(self, nodes: Sequence[Node]) -> bool:
        """A pass of a loop; whether it goes on."""
        try:
            self.all(nodes)
        except _Left as left:
            if str(left) == "return":
                raise
            return str(left) == "continue"
        return True

    def move(self, node: Node) -> None:
        for axis, value in node.value.items():
            self.here[axis] = self.value(value)
            self.note(axis, value)
        sure = not self.doubts and not self.called and not self.unsure & {"X", "Y", "Z", "said"}
        self.motions.append(Ran(node, (self.here["X"], self.here["Y"], self.here["Z"]), sure, self.said))

    def say(self, node: Node) -> None:
        self.said = node.name
        self.note("said", 0)

    def set(self, node: Node) -> None:
        self.values[node.name] = self.value(node.value)
        self.note(node.name, node.value)

    def note(self, name: Any, value: Expr) -> None:
        """Whether what is set now hangs on a doubt."""
        (self.unsure.add if self.doubts or self.hangs(value) else self.unsure.discard)(name)

    def hangs(self, text: Expr) -> bool:
        if not isinstance(text, tuple):
            return False
        return text[1] in self.unsure if text[0] == "v" else any(map(self.hangs, text[1:]))

    def may_set(self, nodes: Sequence[Node]) -> set[Any]:
        """Variables, axes and what was said last, as far as the statements set them, if they run."""
        found: set[Any] = set()
        for node in all_of(nodes):
            found |= {"said"} if node.verb == "say" else set()
            found |= set(node.value) if node.verb == "move" else set()
            found |= {node.name} if node.verb in ("set", "count") else set()
            found |= self.may_set(self.subs[node.name]) if node.verb == "call" else set()
        return found

    def perhaps(self, nodes: Sequence[Node], run: Callable[[], None], hangs: bool = True) -> None:
        """``run``, which runs some of the statements; whether it does hangs on a doubt."""
        self.doubts += hangs
        run()
        self.doubts -= hangs
        if hangs:
            self.unsure |= self.may_set(nodes)
            self.called |= "call" in verbs_of(nodes)
            self.left |= "leave" in verbs_of(nodes)

    def branch(self, node: Node) -> None:
        taken = node.body if self.value(node.value) else node.other
        self.perhaps([*node.body, *node.other], lambda: self.all(taken), self.hangs(node.value))

    def loop(self, node: Node) -> None:
        def passes() -> None:
            while self.value(node.value) and self.once(node.body):
                pass

        self.perhaps(node.body, passes, self.hangs(node.value))

    def again(self, node: Node) -> None:
        def passes() -> None:
            while self.once(node.body) and self.value(node.value):
                pass

        self.perhaps(node.body, passes, self.hangs(node.value))

    def times(self, node: Node) -> None:
        for _ in range(node.value):
            self.all(node.body)

    def count(self, node: Node) -> None:
        self.values[node.name] = self.value(node.value)
        while self.values[node.name] <= self.value(node.last):
            self.all(node.body)
            self.values[node.name] += 1

    def leave(self, node: Node) -> None:
        raise _Left(node.name)

    def call(self, node: Node) -> None:
        for _ in range(node.last):
            outer, self.arguments = self.arguments, [self.value(one) for one in node.value]
            with suppress(_Left):
                self.all(self.subs[node.name])
            self.arguments = outer

    def doubt(self, node: Node) -> None:
        count = min(next(self.answers), 1 if node.name != "while" else 2)
        self.left |= bool(node.last)
        self.perhaps(node.body, lambda: self.all(node.body * count))


@dataclass(frozen=True)
class Tree:
    main: list[Node]
    subs: list[list[Node]]

    def run(self, answers: Sequence[int] = ()) -> list[Ran]:
        """The motions.  None is sure where a loop or a subprogram is left in a doubt; where a subprogram is called in
        one, those of the main program alone that state their whole place before that call."""
        run = Run(self.subs, itertools.cycle(answers or (0,)))
        run.all(self.main)
        inside = {id(node) for sub in self.subs for node in all_of(sub)}
        if run.left or (run.called and "doubt" in set().union(*map(verbs_of, self.subs))):
            sure = set()
        else:
            sure = {id(ran.node) for ran in run.motions if not run.called or ran.node.name == "place"}
            sure -= inside if run.called else set()
        return [ran._replace(sure=ran.sure and id(ran.node) in sure) for ran in run.motions]


class Drawing:
    """Draws a tree of what ``control`` has."""

    def __init__(self, seed: int, control: str, doubts: bool = False) -> None:
        self.chance, self.control, self.doubts = random.Random(seed), control, doubts
        self.counters, self.comments = 10, 0
        self.breaks = self.chance.random() < 0.5
        """With the BREAK of a WHILE, LinuxCNC ends the next DO."""

    def number(self) -> float:
        return self.chance.randint(-12, 12) * 0.5

    def value(self, arguments: int, depth: int = 0) -> Expr:
        kind = self.chance.random()
        if depth > 1 or kind < 0.35:
            return self.number()
        if kind < 0.6:
            return ("v", self.chance.randrange(4))
        if kind < 0.7 and arguments:
            return ("a", self.chance.randrange(arguments))
        return (
            self.chance.choice("+-"),
            self.value(arguments, depth + 1),
            self.value(arguments, depth + 1),
        )

    def condition(self, arguments: int) -> Expr:
        def one() -> Expr:
            operator = self.chance.choice(("<", "<=", "==", ">", ">=", "!="))
            return (operator, ("v", self.chance.randrange(4)), self.value(arguments, 1))

        return one() if self.chance.random() < 0.7 else (self.chance.choice(("and", "or")), one(), one())

    def move(self, arguments: int) -> Node:
        axes = self.chance.sample("XYZ", self.chance.choice((1, 1, 2)))
        return Node("move", value={axis: self.value(arguments) for axis in sorted(axes)})

    def place(self) -> Node:
        """A motion that states where it ends by numbers alone."""
        return Node("move", "place", {axis: self.number() for axis in "XYZ"})

    def comment(self) -> list[Node]:
        """Before or behind a statement, at times, a comment of its own number."""
        if self.chance.random() > 0.15:
            return []
        self.comments += 1
        return [Node("say", self.comments)]

    def counted(self) -> int:
        """A variable of a loop's own."""
        self.counters += 1
        return self.counters

    def block(self, arguments: int, depth: int, size: int, subs: int, inside: str = "") -> list[Node]:
        nodes: list[Node] = []
        for _ in range(size):
            nodes += self.statement(arguments, depth, subs, inside)
        return nodes

    def statement(self, arguments: int, depth: int, subs: int, inside: str) -> list[Node]:
        kind = self.chance.random()
        if depth > 2 or kind < 0.4:
            return [*self.comment(), self.move(arguments), *self.comment()]
        if kind < 0.55:
            return [Node("set", self.chance.randrange(4), self.value(arguments))]

        def inner(loop: str = inside) -> list[Node]:
            return self.block(arguments, depth + 1, self.chance.randint(1, 2), subs, loop)

        if kind < 0.7:
            leaves = ("while" in inside and self.breaks) and self.chance.random() < 0.5
            body = inner()
            if leaves:
                name = self.chance.choice(("break", "continue") if self.control == "linuxcnc" else ("break",))
                body = [*body, Node("leave", name)]
            elif inside.startswith("sub") and self.chance.random() < 0.4:
                body = [*body, Node("leave", "return")]
            other = inner() if self.chance.random() < 0.5 and not leaves else []
            return [Node("branch", value=self.condition(arguments), body=body, other=other)]
        if kind < 0.85:
            return self.repeated(arguments, inner)
        if kind < 0.95 and subs:
            return [self.called(arguments, subs)]
        if self.doubts and depth < 2:
            name = self.chance.choice(("if", "slash", "while"))
            body = [self.move(arguments)] if name == "slash" else inner("doubt")
            if name == "if" and self.chance.random() < 0.3:
                if inside.startswith("sub"):
                    body = [*body, Node("leave", "return")]
                elif "while" in inside and self.breaks:
                    body = [*body, Node("leave", "break")]
            # a jump that may happen in a subprogram leaves the whole program in its order
            jumps = self.control == "fanuc" and name == "if" and inside.startswith("sub")
            return [Node("doubt", name, last=jumps, body=body)]
        return [self.move(arguments)]

    def called(self, arguments: int, subs: int) -> Node:
        which = self.chance.randrange(subs)
        given = [
            self.value(arguments, 1)
            for _ in range(2 if which % 2 == 0 and self.control != "sinumerik" else 0)
        ]
        many = self.chance.choice((1, 1, 2)) if not given else 1
        return Node("call", which, given, many)

    def repeated(self, arguments: int, inner: Callable[..., list[Node]]) -> list[Node]:
        kind, counter, last = self.chance.randrange(4), self.counted(), self.chance.randint(1, 3)
        step = Node("set", counter, ("+", ("v", counter), 1))
        start = Node("set", counter, self.chance.choice((0, 0, 1)))
        if kind == 0:
            body = [step, *inner("while")]
            return [start, Node("loop", value=("<", ("v", counter), last), body=body)]
        if kind == 1 and not (self.breaks and self.control == "linuxcnc"):
            return [start, Node("again", value=("<", ("v", counter), last), body=[*inner("again"), step])]
        if kind == 2:
            return [Node("times", counter, self.chance.randint(0, 3), body=inner("times"))]
        first = self.chance.randint(0, 2)
        return [Node("count", counter, first, last, inner("count"))]

    def tree(self) -> Tree:
        count = self.chance.choice((0, 1, 2))
        subs = [
            self.block(2 if n % 2 == 0 and self.control != "sinumerik" else 0, 1, 3, n, "sub")
            for n in range(count)
        ]
        main = [Node("set", n, self.number()) for n in range(4)]
        for _ in range(self.chance.randint(2, 4)):
            main += [*self.block(0, 0, 2, count), self.place()]
        return Tree(main, subs)


class Writer:
    """Writes a tree; ``lines``; ``nodes``: line, from 1 -> the motion in it."""

    head = ""
    comment = "({})"
    words: ClassVar[dict[str, str]] = {"and": " AND ", "or": " OR "}

    def __init__(self, tree: Tree, seed: int, first: str = "") -> None:
        """``first``: lines before the others."""
        self.chance, self.tree = random.Random(seed), tree
        self.lines = (first + self.head).splitlines()
        self.nodes: dict[int, Node] = {}
        self.labels = 100
        self.loops: list[Any] = []
        self.program()

    @property
    def text(self) -> str:
        return "\n".join(self.lines) + "\n"

    def put(self, line: str) -> None:
        self.lines.append(line)

    def label(self) -> int:
        self.labels += 1
        return self.labels

    def all(self, nodes: Sequence[Node]) -> None:
        for node in nodes:
            getattr(self, node.verb)(node)

    def number(self, value: float) -> str:
        return f"{value:g}"

    def variable(self, kind: str, number: int) -> str:
        return f"#{100 + number}" if kind == "v" else f"#{1 + number}"

    def expression(self, text: Expr, whole: bool = False) -> str:
        if not isinstance(text, tuple):
            return self.number(text)
        if text[0] in "va" and len(text) == 2:
            return self.variable(*text)
        operator = self.words.get(text[0], text[0])
        left, right = (self.expression(one) for one in text[1:])
        right = f"[{right}]" if right.startswith("-") else right
        return f"[{left}{operator}{right}]"

    def motion(self, node: Node, before: str = "") -> None:
        words = [axis + self.word(value) for axis, value in node.value.items()]
        self.chance.shuffle(words)
        self.put(f"{before}G1 " + " ".join(words))
        self.nodes[len(self.lines)] = node

    def word(self, value: Expr) -> str:
        return self.expression(value)

    def move(self, node: Node) -> None:
        self.motion(node)

    def say(self, node: Node) -> None:
        self.put(self.comment.format(f"FORCE 0 0 {node.name}"))

    def doubt(self, node: Node) -> None:
        if node.name == "slash":
            self.motion(node.body[0], "/")
        else:
            self.unknown(node)

    def unknown(self, node: Node) -> None:
        raise NotImplementedError

    def program(self) -> None:
        raise NotImplementedError


class LinuxCNC(Writer):
    head = "G21 G90 G17 G54 G94\nT1 M6\nG0 X0 Y0 Z0\nF60"
    words: ClassVar[dict[str, str]] = {
        "and": " AND ", "or": " OR ", "<": " LT ", "<=": " LE ", "==": " EQ ", ">": " GT ", ">=": " GE ",
        "!=": " NE ",
    }  # fmt: skip

    def program(self) -> None:
        for number, sub in enumerate(self.tree.subs):
            self.loops = [f"O{number + 1}"]
            self.put(f"O{number + 1} SUB")
            self.all(sub)
            self.put(f"O{number + 1} ENDSUB")
        self.all(self.tree.main)
        self.put("M2")

    def set(self, node: Node) -> None:
        self.put(f"{self.variable('v', node.name)}={self.expression(node.value)}")

    def branch(self, node: Node) -> None:
        label = f"O{self.label()}"
        self.put(f"{label} IF {self.expression(node.value)}")
        self.all(node.body)
        if len(node.other) == 1 and node.other[0].verb == "branch":
            inner = node.other[0]
            self.put(f"{label} ELSEIF {self.expression(inner.value)}")
            self.all(inner.body)
            node = inner
        if node.other:
            self.put(f"{label} ELSE")
            self.all(node.other)
        self.put(f"{label} ENDIF")

    def _loop(self, first: str, body: Sequence[Node], last: str) -> None:
        label = f"O{self.label()}"
        self.loops.append(label)
        self.put(f"{label} {first}")
        self.all(body)
        self.put(f"{label} {last}")
        self.loops.pop()

    def loop(self, node: Node) -> None:
        self._loop(f"WHILE {self.expression(node.value)}", node.body, "ENDWHILE")

    def again(self, node: Node) -> None:
        self._loop("DO", node.body, f"WHILE {self.expression(node.value)}")

    def times(self, node: Node) -> None:
        self._loop(f"REPEAT [{node.value}]", node.body, "ENDREPEAT")

    def count(self, node: Node) -> None:
        name = ("v", node.name)
        self.set(Node("set", node.name, node.value))
        step = Node("set", node.name, ("+", name, 1))
        self._loop(f"WHILE {self.expression(('<=', name, node.last))}", [*node.body, step], "ENDWHILE")

    def leave(self, node: Node) -> None:
        label = self.loops[0] if node.name == "return" else self.loops[-1]
        self.put(f"{label} {node.name.upper()}")

    def call(self, node: Node) -> None:
        given = " ".join(f"[{self.expression(one)}]" for one in node.value)
        for _ in range(node.last):
            self.put(f"O{node.name + 1} CALL {given}".strip())

    def unknown(self, node: Node) -> None:
        label = f"O{self.label()}"
        end = "ENDIF" if node.name == "if" else "ENDWHILE"
        self.put(f"{label} {node.name.upper()} [#50 GT 3]")
        self.all(node.body)
        self.put(f"{label} {end}")


class Fanuc(Writer):
    head = "O1\nG21 G90 G17 G54 G94\nT1 M6\nG0 X0. Y0. Z0.\nF60."
    words: ClassVar[dict[str, str]] = {
        "and": "AND", "or": "OR", "<": "LT", "<=": "LE", "==": "EQ", ">": "GT", ">=": "GE", "!=": "NE",
    }  # fmt: skip

    def program(self) -> None:
        self.all(self.tree.main)
        self.put("M30")
        for number, sub in enumerate(self.tree.subs):
            self.put(f"O{number + 21}")
            self.all(sub)
            self.put("M99")

    def number(self, value: float) -> str:
        return f"{value:g}" if value % 1 else f"{value:g}."

    def set(self, node: Node) -> None:
        self.put(f"{self.variable('v', node.name)}={self.expression(node.value)}")

    def condition(self, text: Expr) -> str:
        return self.expression(text)

    def branch(self, node: Node) -> None:
        if len(node.body) == 1 and node.body[0].verb == "set" and not node.other:
            inner = node.body[0]
            self.put(
                f"IF{self.condition(node.value)}THEN {self.variable('v', inner.name)}={self.expression(inner.value)}"
            )
            return
        taken, end = self.label(), self.label()
        if self.chance.random() < 0.5:
            self.put(f"IF{self.condition(node.value)}GOTO{taken}")
            self.all(node.other)
            self.put(f"GOTO{end}")
            self.put(f"N{taken}")
            self.all(node.body)
        else:
            self.put(f"IF{self.condition(opposite(node.value))} GOTO {taken}")
            self.all(node.body)
            self.put(f"GOTO {end}")
            self.put(f"N{taken}")
            self.all(node.other)
        self.put(f"N{end}")

    def loop(self, node: Node) -> None:
        number = len(self.loops) + 1
        self.loops.append(self.label())
        self.put(f"WHILE{self.condition(node.value)}DO{number}")
        self.all(node.body)
        self.put(f"END{number}")
        self.put(f"N{self.loops.pop()}")

    def again(self, node: Node) -> None:
        label = self.label()
        self.put(f"N{label}")
        self.all(node.body)
        self.put(f"IF{self.condition(node.value)}GOTO{label}")

    def times(self, node: Node) -> None:
        self.count(Node("count", node.name, 1, node.value, node.body))

    def count(self, node: Node) -> None:
        name = ("v", node.name)
        self.set(Node("set", node.name, node.value))
        step = Node("set", node.name, ("+", name, 1))
        self.loop(Node("loop", value=("<=", name, node.last), body=[*node.body, step]))

    def leave(self, node: Node) -> None:
        self.put("M99" if node.name == "return" else f"GOTO{self.loops[-1]}")

    def call(self, node: Node) -> None:
        number = node.name + 21
        if node.value:
            words = [letter + self.word(one) for letter, one in zip("IJ", node.value, strict=True)]
            self.put(f"G65 P{number} {' '.join(words)}")
        else:
            times = f" L{node.last}" if node.last > 1 else ""
            self.put(f"M98 P{number}{times}")

    def variable(self, kind: str, number: int) -> str:
        return f"#{100 + number}" if kind == "v" else f"#{4 + number}"  # I and J

    def unknown(self, node: Node) -> None:
        label = self.label()
        if node.name == "if":
            self.put(f"IF[#500GT3.]GOTO{label}")
            self.all(node.body)
            self.put(f"N{label}")
        else:
            number = len(self.loops) + 1
            self.loops.append(label)
            self.put(f"WHILE[#500GT3.]DO{number}")
            self.all(node.body)
            self.put(f"END{number}")
            self.loops.pop()


class Sinumerik(Writer):
    head = "G71 G90 G17 G54 G94\nT1 D1\nG0 X0 Y0 Z0\nF60"
    comment = ";{}"
    words: ClassVar[dict[str, str]] = {"and": " AND ", "or": " OR ", "!=": "<>"}

    def program(self) -> None:
        self.all(self.tree.main)
        self.put("M30")
        for number, sub in enumerate(self.tree.subs):
            self.put(f"%_N_L{number + 21}_SPF")
            self.all(sub)
            self.put("M17")

    def variable(self, kind: str, number: int) -> str:
        return f"R{number}"

    def expression(self, text: Expr, whole: bool = False) -> str:
        return super().expression(text).replace("[", "(").replace("]", ")")

    def word(self, value: Expr) -> str:
        return f"={self.expression(value)}" if isinstance(value, tuple) else self.number(value)

    def set(self, node: Node) -> None:
        self.put(f"R{node.name}={self.expression(node.value)}")

    def branch(self, node: Node) -> None:
        if self.chance.random() < 0.5:
            label = f"L_{self.label()}"
            self.put(f"IF {self.expression(opposite(node.value))} GOTOF {label}")
            self.all(node.body)
            if node.other:
                end = f"L_{self.label()}"
                self.put(f"GOTOF {end}")
                self.put(f"{label}:")
                self.all(node.other)
                label = end
            self.put(f"{label}:")
            return
        self.put(f"IF {self.expression(node.value)}")
        self.all(node.body)
        if node.other:
            self.put("ELSE")
            self.all(node.other)
        self.put("ENDIF")

    def loop(self, node: Node) -> None:
        self.loops.append(f"L_{self.label()}")
        if self.chance.random() < 0.5:
            self.put(f"WHILE {self.expression(node.value)}")
            self.all(node.body)
            self.put("ENDWHILE")
        else:
            self.put("LOOP")
            self.put(f"IF {self.expression(opposite(node.value))} GOTOF {self.loops[-1]}")
            self.all(node.body)
            self.put("ENDLOOP")
        self.put(f"{self.loops.pop()}:")

    def again(self, node: Node) -> None:
        if self.chance.random() < 0.5:
            self.put("REPEAT")
            self.all(node.body)
            self.put(f"UNTIL {self.expression(opposite(node.value))}")
        else:
            label = f"L_{self.label()}"
            self.put(f"{label}:")
            self.all(node.body)
            self.put(f"IF {self.expression(node.value)} GOTOB {label}")

    def times(self, node: Node) -> None:
        # what is repeated from a label is followed where all is decided alone
        if "doubt" in verbs_of(self.tree.main) or node.value < 2 or self.chance.random() < 0.5:
            self.count(Node("count", node.name, 1, node.value, node.body))
            return
        first, last = f"L_{self.label()}", f"L_{self.label()}"
        self.put(f"{first}:")
        self.all(node.body)
        self.put(f"{last}:")
        self.put(f"REPEAT {first} {last} P={node.value - 1}")

    def count(self, node: Node) -> None:
        self.put(f"FOR R{node.name}={self.expression(node.value)} TO {self.expression(node.last)}")
        self.all(node.body)
        self.put("ENDFOR")

    def leave(self, node: Node) -> None:
        self.put("M17" if node.name == "return" else f"GOTOF {self.loops[-1]}")

    def call(self, node: Node) -> None:
        self.put(f"L{node.name + 21}" + (f" P{node.last}" if node.last > 1 else ""))

    def unknown(self, node: Node) -> None:
        self.put(f"{node.name.upper()} R90>3")
        self.all(node.body)
        self.put("ENDIF" if node.name == "if" else "ENDWHILE")


WRITERS: dict[str, type[Writer]] = {"linuxcnc": LinuxCNC, "fanuc": Fanuc, "sinumerik": Sinumerik}
