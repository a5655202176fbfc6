"""What is rewritten in a motion line: points of its own, absolute targets; each line once, for all its runs."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Sequence
from functools import cached_property
from itertools import count

import numpy as np

from postproc.base.document import Edit, Span
from postproc.base.findings import Finding
from postproc.languages.krl.source_map import PointVariable
from postproc.languages.krl.write_plan import KEYS, LETTER, KrlWritePlan

LONGEST_NAME = 24
SHARED = "KRL007"
HELP = "Give each motion its own point, or write the line once for each run."

_NAME = re.compile(rb"[A-Za-z_$][A-Za-z0-9_$]*")
_WORDS = re.compile(
    rb"[{,:][ \t]*+([ST]|E[1-6])(?![A-Za-z0-9_$])((?:\[[^\[\]{}]*+\]|[^,:{}\[\]])*+)(?=[,}])", re.I
)
_FOLD = re.compile(
    rb"^[ \t]*;[ \t]*(?:(ENDFOLD)|FOLD([ \t]+S?(?:PTP|LIN|CIRC|SPL)(?![A-Za-z0-9_]))?)", re.I | re.M
)


def aggregate(texts: Sequence[bytes], words: bytes) -> bytes:
    """``{X ..,Y ..}`` of as many components as there are texts, then ``words``."""
    parts = [key.encode() + b" " + text for key, text in zip(KEYS, texts, strict=False)]
    return b"{" + b",".join([*parts, words] if words else parts) + b"}"


def carried(operand: bytes) -> bytes:
    """S, T and external axes of an aggregate in the line."""
    return b",".join(key + b" " + value.strip(b" \t") for key, value in _WORDS.findall(operand))


class RewrittenLines:
    """Edits of motion lines beyond their literals.

    A line that runs several times is edited only where all of its runs ask for the same; else these rows are ``held``.
    """

    def __init__(self, task: KrlWritePlan) -> None:
        self.task = task
        self.refused: dict[int, Finding] = {}
        self._wishes: dict[tuple[int, int], dict[int, tuple[Edit, ...]]] = {}
        self._points: dict[tuple[Span, tuple[bytes, ...]], tuple[bytes, Edit]] = {}

    def ask(self, row: int, *edits: Edit) -> None:
        """Edits of the line of ``row`` that go together."""
        self._wishes.setdefault((edits[0].span.start, edits[0].span.stop), {})[row] = edits

    def point(
        self,
        row: int,
        operand: Span,
        variable: PointVariable | None,
        texts: Sequence[bytes],
        why: str,
        via: bool,
    ) -> None:
        """Gives a row a point of its own in the place of ``operand``, with six components; of an auxiliary point
        (``via``) three count.  ``why``: what the old one serves besides."""
        if self.task.writing.shared_points == "keep":
            self.refuse(row, why)
            return
        raw = self.task.documents[0].raw
        words = carried(raw[operand.start : operand.stop]) if variable is None else variable.words
        wanted = self.task.writing.shared_points == "copy-dat" or self._in_form(operand.start)
        if wanted and variable is not None and variable.declared is not None:
            old = raw[operand.start : operand.stop] if variable.name else b"P"
            name, declaration = self._declared(old, variable, variable.declared, texts)
            self.ask(row, self.replaced(operand, name), declaration)
        else:
            own = aggregate(texts[:3], b"") if via else aggregate(texts, words)
            self.ask(row, self.replaced(operand, own))

    def absolute(self, row: int, texts: Sequence[bytes], via: Sequence[bytes]) -> None:
        """Writes a relative motion with its absolute target (six components) and, of an arc, auxiliary point."""
        task, relative = self.task, self.task.places.relative[row]
        _, start, stop, _ = task.places.motion[row].tolist()
        raw, word, variable = task.documents[0].raw, relative.word, task.places.variables.get(row)
        arc = task.places.arcs.get(row)
        words = carried(raw[start:stop]) if variable is None else variable.words
        if words or (arc is not None and arc.has_angle):
            why = "it is a relative motion after a corrected one, with CA, S, T or external axes"
            self.refuse(row, why, "KRL008")
            return
        edits = [
            Edit(word, raw[word.start : word.stop - len(b"_REL")]),
            self.replaced(Span(0, start, stop), aggregate(texts, b"")),
        ]
        if arc is not None and via:
            edits.append(self.replaced(arc.operand, aggregate(via, b"")))
        if relative.reference is not None:
            edits.append(Edit(Span(0, stop, relative.reference.stop), b""))
        self.ask(row, *edits)

    def replaced(self, span: Span, text: bytes) -> Edit:
        """The edit that writes ``text`` for ``span``, apart from a name before it."""
        raw = self.task.documents[span.file].raw
        joins = span.start > 0 and LETTER[raw[span.start - 1]] and LETTER[text[0]]
        return Edit(span, b" " + text if joins else text)

    def refuse(self, row: int, why: str, code: str = SHARED) -> None:
        document, at = self.task.documents[0], int(self.task.places.motion[row, 0])
        self.refused[row] = Finding(code, why, str(document.path), *document.place(at), HELP)

    def edits(self) -> list[Edit]:
        """What can be written; the other rows are in ``held`` then."""
        result: dict[Edit, None] = {}
        for rows in self._wishes.values():
            runs = set(self._rows_of_statement(next(iter(rows))))
            if len(set(rows.values())) > 1 or runs - rows.keys():
                for row in rows:
                    self.refuse(
                        row, f"the line runs {len(runs)} times, and the runs need different corrections"
                    )
                continue
            result.update(dict.fromkeys(next(iter(rows.values()))))
        return list(result)

    def _rows_of_statement(self, row: int) -> list[int]:
        """All rows of the statement of ``row``."""
        words = self.task.places.motion[:, 0]
        return np.flatnonzero(words == words[row]).tolist() if self._repeated else [row]

    @cached_property
    def _repeated(self) -> bool:
        """Whether any line runs several times."""
        return len(np.unique(self.task.places.motion[:, 0])) < len(self.task.path)

    @cached_property
    def _forms(self) -> tuple[list[int], list[int]]:
        """Where the folds of inline forms start and end."""
        starts, stops = [], []
        depth = inside = 0
        for found in _FOLD.finditer(self.task.documents[0].raw):
            if found[1] is None:
                depth += 1
                if found[2] is not None and not inside:
                    starts.append(found.start())
                    inside = depth
            elif depth:
                if depth == inside:
                    stops.append(found.start())
                    inside = 0
                depth -= 1
        return starts[: len(stops)], stops

    def _in_form(self, at: int) -> bool:
        """Whether a byte of the program is in the fold of an inline form."""
        starts, stops = self._forms
        index = bisect_right(starts, at) - 1
        return index >= 0 and at < stops[index]

    @cached_property
    def _names(self) -> set[bytes]:
        return {name.upper() for document in self.task.documents for name in _NAME.findall(document.raw)}

    def _declared(
        self, old: bytes, variable: PointVariable, after: Span, texts: Sequence[bytes]
    ) -> tuple[bytes, Edit]:
        """A new point in the .dat after the declaration of the old one; equal ones are one."""
        key = (after, (variable.name.upper(), *texts))
        if key not in self._points:
            name = self._new_name(old)
            document = self.task.documents[after.file]
            text = b"DECL " + variable.type + b" " + name + b"=" + aggregate(texts, variable.words)
            below = document.raw.find(b"\n", after.stop) + 1
            at, line = (
                (below, text + document.newline) if below else (len(document.raw), document.newline + text)
            )
            self._points[key] = (name, Edit(Span(after.file, at, at), line))
        return self._points[key]

    def _new_name(self, name: bytes) -> bytes:
        """The old name with the first number that gives a name which the program does not have yet."""
        stem = re.sub(rb"[^A-Za-z0-9_$]+", b"_", name).strip(b"_") or b"P"
        tails = (b"_%d" % number for number in count(1))
        names = (stem[: LONGEST_NAME - len(tail)] + tail for tail in tails)
        new = next(name for name in names if name.upper() not in self._names)
        self._names.add(new.upper())
        return new
