"""What is in force while a program is made up, and its blocks in many spellings."""

from __future__ import annotations

import random
from dataclasses import dataclass, field, replace

from .blocks import Block
from .expressions import Expressions, Real, Scope

FEATURES = {
    "arcs": 0.6,
    "radius": 0.4,
    "helix": 0.4,
    "planes": 0.4,
    "incremental": 0.5,
    "centres": 0.3,
    "inch": 0.35,
    "offsets": 0.35,
    "settings": 0.2,
    "rotation": 0.1,
    "shifts": 0.35,
    "machine": 0.15,
    "home": 0.12,
    "tools": 0.35,
    "lengths": 0.3,
    "cycles": 0.35,
    "feeds": 0.25,
    "paths": 0.3,
    "parameters": 0.5,
    "rich": 0.5,
    "inline": 0.5,
    "flow": 0.35,
    "subs": 0.3,
    "slash": 0.2,
    "comments": 0.5,
    "numbers": 0.4,
    "codes": 0.4,
    "end": 0.08,
    "rotary": 0.15,
    "loose": 0.35,
    "saved": 0.1,
    "unordered": 0.6,
    "sparse": 0.7,
    "tables": 0.1,
    "system": 0.1,
    "threads": 0.1,
    "polar": 0.06,
    "dwells": 0.1,
    "called": 0.5,
    "compensated": 0.08,
    "diameters": 0.04,
    "splines": 0.06,
    "signals": 0.15,
    "surface": 0.05,
    "computed calls": 0.06,
}
"""Feature -> the share of programs that have it."""
PLAIN = 0.35
"""The share of programs without any of these."""
COMPUTED = {"parameters", "rich", "flow", "subs", "slash", "system"}
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
OFFSETS = ("54", "55", "56", "57", "58", "59", "59.1", "59.2", "59.3")
GROUPS = (
    ("17", "18", "19"), ("90", "91"), ("90.1", "91.1"), ("61", "61.1", "64"), ("93", "94", "95"), ("20", "21"), OFFSETS,
)  # fmt: skip
"""Modal groups, of which a block has one code."""
NAMES = ("1", "2", "5", "30", "31", "100", "<a>", "<depth>", "<x_1>", "<_g>", "<_Top>")
SYSTEM = (
    "5420",
    "5421",
    "5422",
    "5220",
    "5221",
    "5241",
    "5211",
    "5403",
    "<_x>",
    "<_z>",
    "<_metric>",
    "<_coord_system>",
)
"""Parameters that the control sets itself; the generator follows none of them."""
TOOLS = 4


@dataclass
class Modes:
    """What is in force, as far as the next block's validity needs it; ``here`` in the program's unit, None where the
    generator does not follow."""

    here: list[float | None] = field(default_factory=lambda: [None, None, None])
    inch: bool = False
    plane: int = 17
    incremental: bool = False
    absolute_centres: bool = False
    motion: str = ""
    timed: bool = False
    fed: bool = False
    spindle: bool = False
    selected: bool = False

    def copy(self) -> Modes:
        return replace(self, here=list(self.here))

    def lost(self) -> None:
        self.here = [None, None, None]


class Spelling:
    """Blocks of one program; ``blocks`` grows."""

    def __init__(self, seed: int, without: tuple[str, ...] = ()) -> None:
        self.chance = random.Random(seed)
        self.features = {name for name, share in FEATURES.items() if self.chance.random() < share}
        if self.chance.random() < PLAIN:
            self.features -= COMPUTED
        self.features -= set(without)
        self.reals = Expressions(self.chance, "rich" in self.features, "loose" in self.features)
        self.blocks: list[Block] = []
        self.modes = Modes()
        self.scope = Scope(dict.fromkeys(SYSTEM if "system" in self.features else ()))
        self.pending: list[str] = []
        self.groups: list[tuple[str, ...] | str] = []
        self.label = self.chance.randint(1, 900)
        self.subs: list[tuple[str, int, Modes | None]] = []
        self.late = False
        self.loops: list[str] = []
        self.depth = 0
        self.bound = self.chance.choice((8, 15, 25, 40, 58))

    def has(self, *names: str) -> bool:
        return all(name in self.features for name in names)

    def maybe(self, share: float) -> bool:
        return self.chance.random() < share

    # Spelling

    def word(self, letter: str, real: Real) -> str:
        letter = letter.lower() if self.maybe(0.25) else letter
        return letter + (" " if self.maybe(0.08) else "") + real.text

    def length(self, letter: str, value: float, decimals: int | None = None) -> tuple[str, float | None]:
        real = self.reals.real(value, self.scope, decimals)
        return self.word(letter, real), real.value

    def code(self, number: str, letter: str = "G") -> str:
        shape = self.chance.random()
        text = number
        if "." not in number:
            if shape < 0.12 and len(number) == 1:
                text = "0" + number
            elif shape < 0.15:
                text = number + "."
            elif shape < 0.18 and self.has("rich"):
                text = f"[{int(number) - 1}+1]" if int(number) else "[0]"
        return self.word(letter, Real(text, None))

    def put(self, *words: str, plain: bool = False) -> None:
        """A block of these words and of what waits for one."""
        pieces = [word for word in (*self.pending, *words) if word]
        self.pending, self.groups = [], []
        if self.has("inline", "parameters") and not plain and self.maybe(0.25):
            pieces.append(self.assignment())
        if self.has("unordered") and self.maybe(0.6):
            self.chance.shuffle(pieces)
        if self.has("comments") and self.maybe(0.12):
            pieces.insert(
                self.chance.randint(0, len(pieces)), self.chance.choice(("(G1 X99)", "(a #1=7)", "()"))
            )
        if self.has("comments") and self.maybe(0.08):
            pieces.append(self.chance.choice((" ; Y7", ";(", "; o100 call")))
        glue = self.chance.choice(("", " ", " ", "  ", "\t"))
        pieces = [pieces[0], *(glue + piece for piece in pieces[1:])] if pieces else []
        if self.has("numbers") and self.maybe(0.3):
            pieces.insert(0, f"{self.chance.choice('Nn')}{self.chance.randint(1, 99999)} ")
        if self.maybe(0.05) and pieces:
            pieces[0] = self.chance.choice(("  ", "\t", " ")) + pieces[0]
        slash = self.has("slash") and self.maybe(0.12)
        if slash:
            self.modes.lost()
            self.scope.forget()
        self.blocks.append(Block(tuple(pieces), slash))

    def flow_line(self, text: str) -> None:
        self.flush()
        if self.has("numbers") and self.maybe(0.1):
            self.blocks.append(Block((f"N{self.chance.randint(1, 999)} ", text)))
        else:
            self.blocks.append(Block((text,)))

    def flush(self) -> None:
        if self.pending:
            self.put()

    def join(self, code: str) -> None:
        """A modal code: a block of its own, or it joins the next one; one of a group in a block."""
        group = next((group for group in GROUPS if code in group), code)
        if group in self.groups:
            self.flush()
        self.groups.append(group)
        self.pending.append(self.code(code))
        if self.maybe(0.5) or len(self.pending) > 3:
            self.flush()

    def assignment(self) -> str:
        name = self.chance.choice(NAMES)
        real = self.reals.real(self.chance.uniform(-30, 30), self.scope)
        self.scope.set(name, real.value)
        blank = " " if self.maybe(0.15) else ""
        return f"{self.reals.name(name)}{blank}={blank}{real.text}"
