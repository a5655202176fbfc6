"""Programs for LinuxCNC, made up from a seed by this grammar (words of a block in any order; ``real``: expressions.py):

    program    = ["%"] {sub} preamble {step} [end {step}] ["M2" | "M30"] {sub} ["%"]
    step       = motion | arc | mode | unit | offset | setting | shift | machine | home | length | tool | cycles
               | spindle | assignment | flow | call | saved modes | noise
    block      = ["/"] ["N" number] {word | assignment | comment}; assignments and modes stand alone or join a motion
    word       = letter real, blanks and case free, "G 1", "g01", "G[0+1]", "G1.", also within numbers
    motion     = [G0 | G1] {X Y Z A B C}, modal or stated, absolute or incremental (G90, G91)
    arc        = (G2 | G3) ends (centre by I J K of the plane | R, also negative) [third axis] [P turns], centres from the
                 start or absolute (G91.1, G90.1), full circles without ends
    mode       = G17 | G18 | G19 | G90 | G91 | G90.1 | G91.1 | G61 | G61.1 | G64 [P [Q]] | G93 | G94 | G95 | G40 | G80
    unit       = G20 | G21
    offset     = G54 ... G59.3
    setting    = G10 L2 P0..9 {X Y Z} [R] | G10 L20 P0..9 {X Y Z}
    shift      = G92 {X Y Z} | G52 {X Y Z} | G92.1 | G92.2 | G92.3
    machine    = G53 (G0 | G1) {X Y Z};  home = (G28 | G30) [{X Y Z}]
    length     = G43 [H] | G43.1 Z | G43.2 H | G49;  tool = T M6 | T, then M6
    cycles     = (G73 | G81 | G82 | G83 | G85 | G86 | G87 | G88 | G89) {X Y Z} R [L] [Q] [P] [G98 | G99] {more holes}
                 (G80 | a motion), in any plane, absolute or incremental
    assignment = "#" name "=" real, of values that later words use
    flow       = o if/elseif/else/endif | o while/endwhile | o do/while | o repeat/endrepeat, break and continue in them
    sub        = o sub ... [o return [real]] o endsub [real];  call = o call {[real]}
    saved      = M70 | M72 | M73 | M71;  noise = F | S | M codes | comments of both kinds | G4

Each program has some of the features only, so that one reading that is wrong does not hide all others.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from .blocks import Block, Made
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
}
"""Feature -> the share of programs that have it."""
PLAIN = 0.35
"""The share of programs without any of these."""
COMPUTED = {"parameters", "rich", "flow", "subs", "slash"}
PLANES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}
OFFSETS = ("54", "55", "56", "57", "58", "59", "59.1", "59.2", "59.3")
GROUPS = (
    ("17", "18", "19"), ("90", "91"), ("90.1", "91.1"), ("61", "61.1", "64"), ("93", "94", "95"), ("20", "21"), OFFSETS,
)  # fmt: skip
"""Modal groups, of which a block has one code."""
NAMES = ("1", "2", "5", "30", "31", "100", "<a>", "<depth>", "<x_1>", "<_g>", "<_Top>")
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


class Generator:
    """One program; ``blocks`` grows."""

    def __init__(self, seed: int) -> None:
        self.chance = random.Random(seed)
        self.features = {name for name, share in FEATURES.items() if self.chance.random() < share}
        if self.chance.random() < PLAIN:
            self.features -= COMPUTED
        self.reals = Expressions(self.chance, "rich" in self.features, "loose" in self.features)
        self.blocks: list[Block] = []
        self.modes = Modes()
        self.scope = Scope()
        self.pending: list[str] = []
        self.groups: list[tuple[str, ...] | str] = []
        self.label = self.chance.randint(1, 900)
        self.subs: list[tuple[str, int, Modes | None]] = []
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
            pieces.insert(self.chance.randint(0, len(pieces)), self.chance.choice(("(G1 X99)", "(a #1=7)", "()")))
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

    # Motions

    @property
    def size(self) -> float:
        return 4.0 if self.modes.inch else 100.0

    def feed(self) -> list[str]:
        modes = self.modes
        if modes.timed or not modes.fed or self.maybe(0.06):
            modes.fed = True
            real = self.reals.number(self.chance.uniform(50, 900), 1)
            return [self.word("F", real)]
        return []

    def targets(self, end: list[float], which: list[int]) -> list[str]:
        """Words that lead to ``end``; where the axes are afterwards."""
        words, modes = [], self.modes
        for axis in which:
            here = modes.here[axis]
            base = (here or 0.0) if modes.incremental else 0.0
            value = end[axis] - base
            if modes.incremental and here is None:
                value = self.chance.uniform(-0.1, 0.1) * self.size
            decimals = self.chance.choice((3, 4)) if modes.inch else None
            word, value_there = self.length("XYZ"[axis], value, decimals)
            words.append(word)
            if value_there is None or (modes.incremental and here is None):
                modes.here[axis] = None
            else:
                modes.here[axis] = base + value_there
        return words

    def place(self) -> list[float]:
        return [self.chance.uniform(-self.size, self.size) for _ in range(3)]

    def line(self) -> None:
        modes = self.modes
        which = [0, 1, 2]
        if self.has("sparse") and self.maybe(0.7):
            which = sorted(self.chance.sample(which, self.chance.randint(1, 2)))
        code = self.chance.choice("0111")
        words = self.feed() if code == "1" else []
        if not (modes.motion == code and self.maybe(0.5)):
            words.insert(0, self.code(code))
        modes.motion = code
        words += self.targets(self.place(), which)
        if self.has("rotary") and self.maybe(0.25):
            words.append(self.length(self.chance.choice("AABC"), self.chance.uniform(-90, 90))[0])
        self.put(*words)

    def anchor(self, *codes: str) -> None:
        """All axes at known places."""
        self.flush()
        self.modes.incremental, self.modes.motion = False, "0"
        words = [self.code("90"), *(self.code(code) for code in codes), self.code("0")]
        self.put(*words, *self.targets(self.place(), [0, 1, 2]), plain=True)

    def arc(self) -> None:
        modes, chance = self.modes, self.chance
        u, v, w = PLANES[modes.plane]
        if not modes.incremental and (modes.here[u] is None or modes.here[v] is None):
            self.anchor()
            if modes.here[u] is None or modes.here[v] is None:
                return
        if modes.absolute_centres and modes.incremental and (modes.here[u] is None or modes.here[v] is None):
            return self.line()
        start = [value or 0.0 for value in modes.here]
        radius = chance.uniform(0.05, 0.5) * self.size
        angle, sweep = chance.uniform(0, 2 * math.pi), chance.uniform(0.3, 5.5)
        code = chance.choice("23")
        words = self.feed()
        if not (modes.motion == code and self.maybe(0.4)):
            words.insert(0, self.code(code))
        modes.motion = code
        end = list(start)
        helix = [w] if self.has("helix") and self.maybe(0.4) else []
        if helix:
            end[w] += chance.uniform(-0.1, 0.1) * self.size
        rich, self.reals.rich = self.reals.rich, self.reals.rich and self.maybe(0.5)
        if self.has("radius") and self.maybe(0.4):
            chord = chance.uniform(0.4, 1.8) * radius
            end[u], end[v] = start[u] + chord * math.cos(angle), start[v] + chord * math.sin(angle)
            words += self._ends(end, [u, v, *helix])
            words.append(self.length("R", chance.choice((1, 1, -1)) * radius)[0])
        else:
            centre = list(start)
            for axis, by in ((u, radius * math.cos(angle)), (v, radius * math.sin(angle))):
                base = 0.0 if modes.absolute_centres else start[axis]
                real = self.reals.number(start[axis] + by - base, 4)
                words.append(self.word("IJK"[axis], real))
                centre[axis] = base + (real.value or 0.0)
            ends = list(helix)
            if self.maybe(0.85):
                turn = sweep if code == "3" else -sweep
                du, dv = start[u] - centre[u], start[v] - centre[v]
                end[u] = centre[u] + du * math.cos(turn) - dv * math.sin(turn)
                end[v] = centre[v] + du * math.sin(turn) + dv * math.cos(turn)
                ends = [u, v, *helix]
            words += self._ends(end, ends)
            if self.maybe(0.12):
                words.append(self.word("P", self.reals.number(chance.randint(1, 3), 0)))
        self.reals.rich = rich
        self.put(*words)

    def _ends(self, end: list[float], which: list[int]) -> list[str]:
        """Ends of an arc, exact to four decimals; incremental ones need no start."""
        words, modes = [], self.modes
        for axis in which:
            here = modes.here[axis]
            base = (here or 0.0) if modes.incremental else 0.0
            rich, self.reals.rich = self.reals.rich, self.reals.rich and self.maybe(0.3)
            word, value = self.length("XYZ"[axis], end[axis] - base, 4)
            self.reals.rich = rich
            words.append(word)
            modes.here[axis] = (
                None if value is None or (modes.incremental and here is None) else base + value
            )
        return words

    # Modes

    def mode(self) -> None:
        modes, options = self.modes, ["40", "80"]
        if self.has("planes"):
            options += ["17", "18", "19"]
        if self.has("incremental"):
            options += ["90", "91", "91"]
        if self.has("centres"):
            options += ["90.1", "91.1"]
        if self.has("paths"):
            options += ["61", "61.1", "64", "64 P"]
        if self.has("feeds"):
            options += ["93", "94", "95"]
        code = self.chance.choice(options)
        if code in ("17", "18", "19"):
            modes.plane = int(code)
        elif code in ("90", "91"):
            modes.incremental = code == "91"
        elif code in ("90.1", "91.1"):
            modes.absolute_centres = code == "90.1"
        elif code in ("93", "94", "95"):
            modes.timed, modes.fed = code == "93", False
            if code == "95" and not modes.spindle:
                self.start_spindle()
        elif code == "80":
            modes.motion = ""
            self.put(self.code(code))
            return
        elif code == "64 P":
            self.flush()
            self.put(self.code("64"), self.word("P", self.reals.number(0.05, 2)))
            return
        self.join(code)

    def start_spindle(self) -> None:
        self.flush()
        self.put(self.code("3", "M"), self.word("S", Real("1000", None)))
        self.modes.spindle = True

    def unit(self) -> None:
        modes = self.modes
        inch = self.maybe(0.5)
        if inch != modes.inch:
            factor = 1 / 25.4 if inch else 25.4
            modes.here = [None if value is None else value * factor for value in modes.here]
        modes.inch = inch
        self.join("20" if inch else "21")

    def offset(self) -> None:
        self.flush()
        self.modes.lost()
        self.join(self.chance.choice(OFFSETS))

    def some(self, share: float = 0.3) -> list[str]:
        axes = self.chance.sample("XYZ", self.chance.randint(1, 3))
        return [self.length(axis, self.chance.uniform(-share, share) * self.size)[0] for axis in axes]

    def setting(self) -> None:
        self.flush()
        level = self.chance.choice(("2", "2", "20"))
        words = [self.code("10"), self.word("L", Real(level, None))]
        words += [self.word("P", Real(str(self.chance.randint(0, 9)), None)), *self.some()]
        if level == "2" and self.has("rotation") and self.maybe(0.5):
            words.append(self.word("R", self.reals.number(self.chance.uniform(-90, 90))))
        self.put(*words)
        self.modes.lost()

    def shift(self) -> None:
        self.flush()
        code = self.chance.choice(("92", "92", "52", "92.1", "92.2", "92.3"))
        self.put(self.code(code), *(self.some() if code in ("92", "52") else []))
        self.modes.lost()

    def machine(self) -> None:
        self.flush()
        if self.modes.incremental:
            return self.line()
        code = self.chance.choice("01")
        self.modes.motion = code
        self.put(self.code("53"), self.code(code), *self.some(), *(self.feed() if code == "1" else []))
        self.modes.lost()

    def home(self) -> None:
        self.flush()
        self.put(self.code(self.chance.choice(("28", "30"))), *(self.some() if self.maybe(0.7) else []))
        self.modes.lost()

    def tool(self) -> None:
        self.flush()
        number = self.word("T", Real(str(self.chance.randint(0 if self.maybe(0.1) else 1, TOOLS)), None))
        if self.maybe(0.3):
            self.put(number)
            self.put(self.code("6", "M"))
        elif self.maybe(0.3):
            self.pending += [number, self.code("6", "M")]
        else:
            self.put(number, self.code("6", "M"))
        self.modes.spindle = False
        self.modes.selected = True
        self.modes.lost()

    def tool_length(self) -> None:
        self.flush()
        code = self.chance.choice(("43", "43", "43", "49", "43.1", "43.2"))
        words = [self.code(code)]
        if code == "43.2" or (code == "43" and (self.maybe(0.5) or not self.modes.selected)):
            words.append(self.word("H", Real(str(self.chance.randint(1, TOOLS)), None)))
        if code == "43.1":
            words.append(self.length("Z", self.chance.uniform(0, 0.3) * self.size)[0])
        self.modes.lost()
        if code in ("43", "49") and self.maybe(0.5):
            self.pending += words
        else:
            self.put(*words)

    def cycles(self) -> None:
        """A canned cycle, further holes, its end."""
        modes, chance = self.modes, self.chance
        if modes.timed or self.depth > 2:
            return self.line()
        self.flush()
        u, v, w = PLANES[modes.plane]
        code = chance.choice(("73", "81", "81", "82", "83", "85", "86", "87", "88", "89", "81"))
        if not modes.spindle:
            self.start_spindle()
        modes.motion = code
        for hole in range(chance.randint(1, 4)):
            words = self.feed()
            if hole == 0 or self.maybe(0.3):
                words.append(self.code(code))
            if self.maybe(0.3):
                words.append(self.code(chance.choice(("98", "99"))))
            which = chance.sample([u, v], chance.choice((0, 1, 2, 2)) if hole == 0 else chance.choice((1, 2)))
            words += self.targets(self.place(), which)
            if hole == 0 or self.maybe(0.15):
                words += self._depths("XYZ"[w])
            elif code in ("73", "83", "82", "86", "88", "89", "87"):
                pass
            if code in ("73", "83") and (hole == 0 or self.maybe(0.2)):
                words.append(self.word("Q", self.reals.number(chance.uniform(0.03, 0.2) * self.size, 3)))
            if code in ("82", "86", "88", "89") and (hole == 0 or self.maybe(0.2)):
                words.append(self.word("P", self.reals.number(0.25, 2)))
            if code == "87" and hole == 0:
                words += [self.word(letter, self.reals.number(0.02 * self.size, 2)) for letter in ("I", "J")]
                words.append(self.word("K", self.reals.number(-0.6 * self.size, 2)))
            if self.maybe(0.2):
                words.append(self.word("L", Real(str(chance.randint(1, 3)), None)))
                modes.lost()
            self.put(*words)
            modes.here[w] = None
        if self.maybe(0.6):
            modes.motion = ""
            self.put(self.code("80"))
        else:
            modes.motion = "cycle"
            self.line()

    def _depths(self, axis: str) -> list[str]:
        size, chance = self.size, self.chance
        if self.modes.incremental:
            retract, depth = chance.uniform(-0.2, 0.2) * size, -chance.uniform(0.02, 0.3) * size
        else:
            depth = chance.uniform(-0.5, 0.0) * size
            retract = depth + chance.uniform(0.05, 1.0) * size
        return [
            self.length("R", retract, 3)[0],
            self.length(axis, depth, 3)[0],
        ]

    # Flow

    def next_label(self) -> str:
        self.label += 1
        if self.maybe(0.1):
            return f"o<part_{self.label}>"
        return f"{self.chance.choice('oO')}{' ' if self.maybe(0.1) else ''}{self.label}"

    def key(self, text: str) -> str:
        return text.upper() if self.maybe(0.2) else text

    def body(self, count: int, fixed: bool) -> None:
        """Blocks of a loop or a subprogram; ``fixed``: they set what their arcs need, in each pass."""
        self.depth += 1
        self.modes.lost()
        features = self.features
        if fixed:
            self.modes.plane, self.modes.absolute_centres = 17, False
            self.anchor("17", "91.1")
            self.features = features - {"inch"}
        else:
            self.features = features & {
                "parameters", "rich", "comments", "numbers", "loose", "inline", "sparse", "unordered", "flow",
                "incremental", "inch", "offsets", "shifts", "tools", "rotary", "arcs" if fixed else "",
            }  # fmt: skip
        self.steps(count)
        self.flush()
        self.features = features
        self.depth -= 1

    def flow(self) -> None:
        self.flush()
        if self.depth >= 2:
            return self.line()
        self.chance.choice((self.branch, self.branch, self.repeat, self.loop, self.loop))()

    def branch(self) -> None:
        label = self.next_label()
        text, taken = self.reals.truth(self.scope)
        self.flow_line(f"{label} {self.key('if')} {text}")
        self.depth += 1
        done = False
        arms = self.chance.choice((1, 1, 2, 3))
        for arm in range(arms):
            before = self.modes.copy()
            scope, self.scope = self.scope, self.copied()
            known = taken and not done
            self.steps(self.chance.randint(1, 3))
            self.flush()
            if not known:
                self.modes, self.scope = before, scope
            done |= taken
            if arm + 1 < arms:
                if arm + 2 < arms:
                    text, taken = self.reals.truth(self.scope)
                    self.flow_line(f"{label} {self.key('elseif')} {text}")
                else:
                    taken = True
                    self.flow_line(f"{label} {self.key('else')}")
        self.depth -= 1
        self.flow_line(f"{label} {self.key('endif')}")

    def copied(self) -> Scope:
        scope = Scope(dict(self.scope.shared))
        scope.own = dict(self.scope.own)
        return scope

    def repeat(self) -> None:
        label = self.next_label()
        self.flow_line(f"{label} {self.key('repeat')} [{self.reals.number(self.chance.randint(0, 4), 0).text}]")
        self.scope.forget()
        before = self.modes.copy()
        self.body(self.chance.randint(1, 4), self.maybe(0.6))
        self.flow_line(f"{label} {self.key('endrepeat')}")
        self.after(before)

    def leave(self, label: str) -> None:
        inner = self.next_label()
        text, _ = self.reals.truth(Scope())
        self.flow_line(f"{inner} if {text}")
        self.flow_line(f"{label} {self.key(self.chance.choice(('break', 'continue')))}")
        self.flow_line(f"{inner} endif")

    def after(self, before: Modes) -> None:
        """Behind a loop that may not have run: state again what arcs need."""
        self.scope.forget()
        self.modes = before
        self.modes.lost()
        self.modes.plane, self.modes.absolute_centres, self.modes.incremental = 17, False, False
        self.modes.inch = before.inch
        self.modes.motion, self.modes.spindle, self.modes.fed = "", False, False
        self.put(*(self.code(code) for code in ("17", "90", "91.1", "20" if before.inch else "21")), plain=True)

    def loop(self) -> None:
        label = self.next_label()
        counter = self.chance.choice(("20", "<n>", "40"))
        self.put(f"#{counter}={self.chance.choice(('0', '1', '.5'))}", plain=True)
        self.scope.forget()
        limit = self.chance.choice(("2", "3", "3.5", "[2+1]"))
        test = f"[#{counter} {self.chance.choice(('LT', 'lt', 'LE'))} {limit}]"
        do = self.maybe(0.4)
        self.flow_line(f"{label} {self.key('do')}" if do else f"{label} {self.key('while')} {test}")
        before = self.modes.copy()
        self.put(f"#{counter}=[#{counter}+1]", plain=True)
        self.scope.set(counter, None)
        self.body(self.chance.randint(1, 4), self.maybe(0.6))
        if self.maybe(0.15):
            self.leave(label)
        self.flow_line(f"{label} {self.key('while')} {test}" if do else f"{label} {self.key('endwhile')}")
        self.after(before)

    def sub(self) -> None:
        """A subprogram; what is in force at its end is what a call leaves, None if it states nothing."""
        self.flush()
        label = self.next_label()
        arguments = self.chance.randint(0, 3)
        modes, self.modes = self.modes, self.modes.copy()
        scope, self.scope = self.scope, Scope(self.scope.shared)
        for number in range(arguments):
            self.scope.set(str(number + 1), None)
        self.flow_line(f"{label} {self.key('sub')}")
        fixed = self.maybe(0.7)
        self.modes.fed = False
        self.body(self.chance.randint(1, 5), fixed)
        if self.maybe(0.15):
            inner = self.next_label()
            text, _ = self.reals.truth(Scope())
            self.flow_line(f"{inner} if {text}")
            self.flow_line(f"{label} {self.key('return')}{self.chance.choice(('', ' [2]'))}")
            self.flow_line(f"{inner} endif")
        self.flow_line(f"{label} {self.key('endsub')}{self.chance.choice(('', '', ' [1+2]'))}")
        self.subs.append((label, arguments, self.modes.copy()))
        self.modes, self.scope = modes, scope
        self.scope.forget()

    def call(self) -> None:
        if not self.subs:
            return self.line()
        self.flush()
        label, count, _ = self.chance.choice(self.subs)
        arguments = [f"[{self.reals.real(self.chance.uniform(-20, 20), self.scope).text}]" for _ in range(count)]
        blank = self.chance.choice((" ", "  ", ""))
        self.flow_line(f"{label} {self.key('call')} {blank.join(arguments)}".rstrip())
        before = self.modes.copy()
        if self.maybe(0.7):
            self.after(before)
        else:
            self.modes.lost()
            self.scope.forget()
            self.modes.motion, self.modes.fed = "", False
            self.features -= {"arcs", "cycles"}

    # The rest

    def saved(self) -> None:
        self.flush()
        code = self.chance.choice(("70", "72", "71", "73") if self.depth else ("70", "70", "72", "71"))
        if code in ("72", "73") and not self.has("restored"):
            code = "70"
        self.features.add("restored")
        self.put(self.code(code, "M"))
        if code == "72":
            self.after(self.modes)

    def noise(self) -> None:
        options = ["F200.5", "S900", "M8", "M9", "G4 P0.1", "M3 S1000", "M1", "M48", "", "G40"]
        if self.has("comments"):
            options += ["(X5)", "; G91", "(MSG, G1 X5)", "(DEBUG, #1)", "(PRINT, x)", "  (a) (b)"]
        choice = self.chance.choice(options)
        if choice == "M3 S1000":
            self.modes.spindle = True
        if self.modes.timed and choice.startswith("F"):
            choice = "M9"
        self.flush()
        self.put(*choice.split(" ", 1) if choice[:1] in "GMF" else [choice], plain=choice[:1] not in "GMFS")

    def assign(self) -> None:
        self.put(*(self.assignment() for _ in range(self.chance.choice((1, 1, 2)))), plain=True)

    def steps(self, count: int) -> None:
        table: list[tuple[Callable[[], None], float]] = [
            (self.line, 10),
            (self.arc, 8 * self.has("arcs")),
            (self.mode, 5),
            (self.unit, 2 * self.has("inch")),
            (self.offset, 1.5 * self.has("offsets")),
            (self.setting, 1.5 * self.has("settings")),
            (self.shift, 2 * self.has("shifts")),
            (self.machine, 1.5 * self.has("machine")),
            (self.home, 1.5 * self.has("home")),
            (self.tool, 1.5 * self.has("tools")),
            (self.tool_length, 2 * self.has("lengths")),
            (self.cycles, 3 * self.has("cycles")),
            (self.assign, 3 * self.has("parameters")),
            (self.flow, 2 * self.has("flow")),
            (self.call, 3 * bool(self.subs and self.depth < 2)),
            (self.saved, 1 * self.has("saved")),
            (self.noise, 2),
        ]
        for _ in range(count):
            if len(self.blocks) >= self.bound:
                return
            steps, weights = zip(*table, strict=True)
            self.chance.choices(steps, weights)[0]()

    def preamble(self) -> None:
        codes = [code for code in ("21", "90", "17", "54", "94", "91.1", "40") if self.maybe(0.8)]
        if self.maybe(0.15):
            codes = []
        self.modes.fed = False
        self.pending = [self.code(code) for code in codes]
        if self.maybe(0.6) or not self.has("sparse"):
            self.flush()
        if self.maybe(0.8):
            self.anchor()
        self.flush()

    def made(self) -> Made:
        tape = self.maybe(0.3)
        if tape:
            self.blocks.append(Block(("%",)))
        late = self.maybe(0.15)
        if self.has("subs") and not late:
            for _ in range(self.chance.randint(1, 2)):
                self.sub()
        self.preamble()
        while len(self.blocks) < self.bound:
            if self.has("end") and self.maybe(0.1):
                self.flush()
                self.put(self.code(self.chance.choice(("2", "30")), "M"), plain=True)
            self.steps(1)
        self.flush()
        if not tape or self.maybe(0.5):
            self.put(self.code(self.chance.choice(("2", "30")), "M"), plain=True)
        if tape:
            self.blocks.append(Block(("%",)))
        return Made(tuple(self.blocks), self.has("slash") and self.maybe(0.5), self.chance.randrange(1000))


def make(seed: int) -> Made:
    """The program of a seed."""
    return Generator(seed).made()
