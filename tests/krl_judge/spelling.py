"""The many spellings of one line: cases of letters, blanks, tabs, comments."""

from __future__ import annotations

import random
import re

_PART = re.compile(
    r"""("[^"]*"|'[^']*'|[A-Za-z_$#][\w$]*|\d+\.?\d*(?:E[-+]?\d+)?|[ ]+|==|<>|<=|>=|.)""", re.I
)


class Spelling:
    """Of one program: how often letters are small, blanks are more, fewer or tabs, comments follow."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.plain = rng.random() < 0.4
        self.small = rng.choice([0.0, 0.1, 0.5, 1.0])
        self.blank = rng.choice([0.0, 0.1, 0.3])

    def line(self, text: str) -> str:
        if self.plain or text.startswith((";", "&")):
            return text
        rng = self.rng
        parts = _PART.findall(text)
        out = [rng.choice(["", "", " ", "  ", "\t"]) if rng.random() < 0.3 else ""]
        name_before = False
        for part in parts:
            if part.isspace():
                out.append(rng.choice(["  ", "\t", "   "]) if rng.random() < self.blank else part)
            elif part[0].isalpha() or part[0] in "$_#":
                out.append(self.word(part))
            elif part in (",", "=", "{", "}", "(", ")", "==", "<", ">") and rng.random() < self.blank:
                # a name and its bracket stay together, as in a call
                before = " " if not (part == "(" and name_before) else ""
                out.append(rng.choice([before, ""]) + part + rng.choice([" ", ""]))
            else:
                out.append(part)
            name_before = part[0].isalpha() or part[0] in "$_"
        tail = rng.choice([" ; note", ";LIN {X 99}", " ;", "  "]) if rng.random() < 0.1 else ""
        return "".join(out) + tail

    def word(self, word: str) -> str:
        if self.rng.random() >= self.small:
            return word
        return self.rng.choice([word.lower(), word.capitalize(), word.swapcase()])
