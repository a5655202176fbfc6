"""Where the labels, block numbers and programs of a file are."""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections import defaultdict

import numpy as np

from postproc.languages.gcode.execution_flow import label_name, program_starts
from postproc.languages.gcode.source import Source
from postproc.languages.gcode.statements import FlowStatement
from postproc.languages.gcode.words import key

_ARCHIVE = re.compile(r"_N_(\w+?)_(?:MPF|SPF)", re.I)


_BLOCK_NUMBER = re.compile(r"N?\d{1,9}")
_NUMBERED = re.compile(r"O?0*(\d{1,9})")


def called_name(text: str) -> str:
    """The name of a called program as it is compared: in capitals, of a number its digits."""
    name = text.strip().upper()
    if name.startswith("O<"):
        name = name[2:].rstrip(">")
    number = _NUMBERED.fullmatch(name)
    return number[1] if number else name


class RunLabels:
    """starts: blocks at which the programs of the file start, in their order; the first may start before."""

    def __init__(self, source: Source) -> None:
        self.starts = program_starts(source)
        self._count = len(source.blocks)
        self._blocks: defaultdict[str, list[int]] = defaultdict(list)
        numbers = source.column(key("N"))
        fine = np.isfinite(numbers.value)
        self._all_numbered = bool(fine.all())
        for value, block in zip(numbers.value[fine].tolist(), numbers.block[fine].tolist(), strict=True):
            self._blocks[f"{value:.0f}"].append(block)
        for note in source.notes:
            if note.kind == "label":
                self._blocks[label_name(note.text)].append(note.block)
        self._programs: defaultdict[str, list[int]] = defaultdict(list)
        plain = source.column(key("O"))
        for value, block in zip(plain.value.tolist(), plain.block.tolist(), strict=True):
            self._programs[f"{value:.0f}"].append(block)
        for note in source.notes:
            if note.kind == "program":
                archive = _ARCHIVE.fullmatch(note.text)
                name = archive[1] if archive else note.text.lstrip(": \t").strip()
                self._programs[label_name(name)].append(note.block)

    def part_of(self, block: int) -> tuple[int, int]:
        """First block of the program that a block is in, and the one after its last."""
        at = bisect_right(self.starts, block)
        start = self.starts[at - 1] if at > 1 else 0
        return start, self.starts[max(at, 1)] if max(at, 1) < len(self.starts) else self._count

    def find(self, statement: FlowStatement, block: int) -> int | None:
        """The block that a jump from ``block`` leads to; None where that is not certain."""
        start, stop = self.part_of(block)
        places = self._blocks.get(label_name(statement.label), [])
        inside = places[bisect_left(places, start) : bisect_left(places, stop)]
        if len(inside) != 1:
            return None
        wrong = {"F": inside[0] <= statement.block, "B": inside[0] > statement.block}
        return None if wrong.get(statement.direction, False) and statement.verb.name == "GOTO" else inside[0]

    def is_missing(self, statement: FlowStatement, block: int) -> bool:
        """Whether a jump from ``block`` is to a block number that no block of the program has: GOTOC goes on then, and
        any other one is an alarm.  A name may be that of a variable with the label, which another file sets."""
        start, stop = self.part_of(block)
        if not (self._all_numbered and _BLOCK_NUMBER.fullmatch(statement.label)):
            return False
        return not any(start <= at < stop for at in self._blocks.get(label_name(statement.label), ()))

    def number(self, number: int, block: int) -> int | None:
        """The block with a number in the program that ``block`` is in."""
        start, stop = self.part_of(block)
        inside = [place for place in self._blocks.get(str(number), []) if start <= place < stop]
        return inside[0] if len(inside) == 1 else None

    def program(self, name: str) -> tuple[int, int] | None:
        """First block and the one after the last of a program of the file."""
        places = self._programs.get(label_name(name), [])
        if len(places) != 1:
            return None
        start, stop = places[0], self.part_of(places[0])[1]
        return (start + 1, stop) if start != self.starts[0] else None

    def between(self, start: int, stop: int) -> bool:
        """Whether a program of the file starts in the blocks after ``start`` and before ``stop``."""
        return bisect_left(self.starts, stop) > bisect_right(self.starts, start)

    def end_label(self, start: int, stop: int) -> int:
        """Where what is repeated from ``start`` up to ``stop`` ends: at an ENDLABEL, if there is one."""
        ends = [block for block in self._blocks.get("ENDLABEL", []) if start < block < stop]
        return ends[0] if ends else stop
