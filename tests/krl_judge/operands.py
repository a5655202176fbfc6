"""Random operands: numbers, expressions, conditions, points."""

from __future__ import annotations

import random
from dataclasses import dataclass, field

INPUTS = (1, 2, 3)


@dataclass
class Names:
    """What a routine can use.  ``counters``: variables of loops, which nothing else but their loop sets."""

    ints: list[str] = field(default_factory=list)
    reals: list[str] = field(default_factory=list)
    frames: list[str] = field(default_factory=list)
    bools: list[str] = field(default_factory=list)
    counters: list[str] = field(default_factory=list)
    free: list[str] = field(default_factory=list)
    elements: bool = False
    """Whether there are lists k[3] of INT and s[3] of REAL."""


class Operands:
    """``inputs``: the program reads inputs; ``straight``: points are mostly full, as posts write them."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.names = Names()
        self.inputs = self.rng.random() < 0.75
        self.straight = self.rng.random() < 0.35
        self.has_function = False
        self.routine = 0

    def number(self, low: float = -300.0, high: float = 300.0) -> str:
        value = self.rng.uniform(low, high)
        return self.rng.choice(
            [f"{value:.0f}", f"{value:.1f}", f"{value:.3f}", f"{value:.3f}", f"{value:.2E}"]
        )

    def angle(self) -> str:
        return self.number(-85.0, 85.0)

    def whole(self, depth: int = 0) -> str:
        """An INT expression."""
        rng, names = self.rng, self.names
        kind = rng.random()
        if depth > 1 or kind < 0.35:
            return str(rng.randint(0, 9))
        if kind < 0.65 and names.ints + names.counters:
            return rng.choice(names.ints + names.counters)
        if kind < 0.69 and names.elements:
            return f"k[({self.whole(depth + 1)} B_AND 1)+1]"
        if kind < 0.72 and self.has_function and self.routine == 0:
            return f"twice({rng.randint(1, 5)})"
        one, other = self.whole(depth + 1), self.whole(depth + 1)
        return rng.choice(
            [f"{one}+{other}", f"({one}-{other})", f"{one}*{rng.randint(1, 4)}", f"{one}/{rng.randint(1, 4)}",
             f"ABS({one}-{other})", f"({one} B_AND {other})", f"-{one}", f"({one}+{other})/{rng.randint(2, 3)}"]
        )  # fmt: skip

    def real(self, depth: int = 0) -> str:
        rng, names = self.rng, self.names
        kind = rng.random()
        if depth > 1 or kind < 0.4:
            return self.number(0, 90)
        if kind < 0.6 and names.reals:
            return rng.choice(names.reals)
        if kind < 0.75:
            return self.whole(depth + 1)
        if kind < 0.82 and names.frames:
            return f"{rng.choice(names.frames)}.{rng.choice('XYZABC')}"
        one, other = self.real(depth + 1), self.real(depth + 1)
        return rng.choice(
            [f"{one}+{other}", f"({one}-{other})", f"{one}*{rng.choice(['2', '0.5', '1.25'])}", f"{one}/4.", f"{one}/3",
             f"SIN({one})", f"COS({one})*10", f"SQRT(ABS({one}))", f"ATAN2({one},1.5)", f"-{one}", f"({one})"]
        )  # fmt: skip

    def condition(self, inputs: bool | None = None) -> str:
        rng, names = self.rng, self.names
        wants = self.inputs and rng.random() < 0.7 if inputs is None else inputs
        if wants and self.inputs:
            n = rng.choice(INPUTS)
            return rng.choice([f"$IN[{n}]", f"NOT $IN[{n}]", f"$IN[{n}]==TRUE", f"($IN[{n}]) OR (1>2)"])
        whole = self.whole()
        choices = [
            f"{whole}{rng.choice(['==', '<>', '<', '>', '<=', '>='])}{rng.randint(0, 9)}",
            "TRUE",
            "FALSE",
        ]
        if names.bools:
            choices += [rng.choice(names.bools), f"NOT {rng.choice(names.bools)}"]
        choices.append(f"({choices[0]}) {rng.choice(['AND', 'OR', 'EXOR'])} ({self.whole(1)}<5)")
        return rng.choice([choices[0], *choices])

    # points

    def aggregate(self, keys: str = "XYZABC", plain: bool = False) -> str:
        rng = self.rng
        computed = not plain and rng.random() < 0.25
        parts = []
        for key in keys:
            value = self.angle() if key in "ABC" else self.number()
            if computed and rng.random() < 0.4:
                value = self.real()
            parts.append(f"{key} {value}")
        if len(keys) == 6 and rng.random() < 0.1:
            parts += ["S 2", "T 35"]
        if rng.random() < 0.1:
            rng.shuffle(parts)
        tag = rng.choice(["FRAME: ", "POS: "]) if rng.random() < 0.04 and len(parts) == 6 else ""
        return "{" + tag + ",".join(parts) + "}"

    def frame_value(self) -> str:
        rng, names = self.rng, self.names
        kind = rng.random()
        if kind < 0.55 or not names.frames:
            return self.aggregate()
        one = rng.choice(names.frames)
        if kind < 0.75:
            return one
        small = self.aggregate(plain=True)
        return rng.choice(
            [f"{one}:{small}", f"{small}:{one}", f"{one}:{rng.choice(names.frames)}", f"INV_POS({one})"]
        )

    def keys(self) -> str:
        share = self.rng.choice([0.2, 0.5, 0.8])
        found = "".join(key for key in "XYZ" if self.rng.random() < share)
        found += self.rng.choice(["", "", "", "A", "ABC", "BC"])
        return found or "X"

    def target(self) -> str:
        rng, names = self.rng, self.names
        kind = rng.random()
        if kind < (0.6 if self.straight else 0.35):
            return self.aggregate()
        if kind < 0.7:
            return self.aggregate(self.keys())
        if kind < 0.8 and names.frames:
            return rng.choice(names.frames)
        if kind < 0.88:
            return rng.choice(["XP1", "XP2", "XC1", "job.P", "list[1]", "list[2]"])
        if kind < 0.92 and names.counters:
            return f"list[{rng.choice(names.counters)}]"
        return self.frame_value()
