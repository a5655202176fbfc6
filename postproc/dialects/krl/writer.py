"""Moved targets as edits: only the literals that changed, and the components that a partial point needs."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from postproc.arrays import Bools, Floats, Ints
from postproc.dialects.dialect import Program
from postproc.dialects.krl.lexing import number
from postproc.document import Edit, Span
from postproc.geometry import abc_from_rotation
from postproc.units import DEG, MM

KEYS = "XYZABC"
SAME = 1e-12
"""Positions [m] and rotations that differ by less are the same."""

MOST_DECIMALS = 12
_LETTER = re.compile(rb"[A-Za-z0-9_$]")


def moved(program: Program, position: Floats, rotation: Floats, decimals: Mapping[str, int]) -> list[Edit]:
    """The edits that bring the targets to ``position`` (N, 3) [m] and ``rotation`` (N, 3, 3).

    ``decimals``: the least number of decimals of what is written, "mm" and "deg".  Raises ValueError if a row
    is asked to move that can not: a defect of the caller.
    """
    path, places = program.toolpath, program.text
    shifted: Bools = np.any(_differs(position, path.position), axis=1)
    turned: Bools = np.any(_differs(rotation, path.rotation), axis=(1, 2))
    fixed = [row for row in (*path.refused, *path.pinned) if shifted[row] or turned[row]]
    if fixed or (shifted | turned)[places.file < 0].any():
        raise ValueError(f"motions that can not be corrected were moved: rows {sorted(set(fixed))[:5]}")
    return _Writer(program, position, rotation, decimals, shifted, turned).edits()


def _differs(new: Floats, old: Floats) -> Bools:
    with np.errstate(invalid="ignore"):
        return ~((np.abs(new - old) <= SAME) | (np.isnan(new) & np.isnan(old)))


class _Writer:
    def __init__(
        self,
        program: Program,
        position: Floats,
        rotation: Floats,
        decimals: Mapping[str, int],
        shifted: Bools,
        turned: Bools,
    ) -> None:
        self.program = program
        self.position, self.rotation = position, rotation
        self.least = [decimals["mm"]] * 3 + [decimals["deg"]] * 3
        self.shifted, self.turned = shifted, turned
        self.given = _given_by(program)
        self.edited: list[Edit] = []

    def edits(self) -> list[Edit]:
        path, places = self.program.toolpath, self.program.text
        partial = (places.file >= 0) & (places.start < 0).any(axis=1)
        refused = np.zeros(len(path), dtype=bool)
        refused[list(path.refused)] = True
        touched = self.shifted | self.turned
        every = self._new_texts(np.flatnonzero(touched))
        # The components in which the row before differs from its own value in the output.
        before: set[int] = set()
        last = -2
        for row in np.flatnonzero(touched | (partial & ~refused)).tolist():
            if last != row - 1:
                before = set()
            last = row
            texts = every.get(row, {})
            missing = [i for i in range(6) if places.start[row, i] < 0]
            if texts or any(i in before for i in missing):
                self._write(row, texts, missing if texts else [i for i in missing if i in before])
                before = set(texts)
            else:
                before = set()
        return self.edited

    def _own(self, row: int, i: int) -> tuple[float, str, int]:
        """Value [mm, deg], text and decimals of a component of the row as the program has it.

        The text is the row's own, or that of the row before which gives the component.
        """
        places, path, source = self.program.text, self.program.toolpath, int(self.given[row, i])
        start = int(places.start[source, i])
        if start >= 0:
            literal = self.program.documents[int(places.file[source])].raw[
                start : int(places.stop[source, i])
            ]
            value = number(literal)
            if value is not None:
                return value, literal.decode("latin-1"), max(_decimals(literal), self.least[i])
        if i < 3:
            value = float(path.position[row, i]) / MM
        else:
            value = float(abc_from_rotation(path.rotation[row])[i - 3]) / DEG
        text = _fixed(value, 9)
        return float(text), text, max(9, self.least[i])

    def _new_texts(self, rows: Ints) -> dict[int, dict[int, str]]:
        """Row -> the components whose value moved by more than half of its written step, as to be written."""
        own = np.empty((len(rows), 6))
        places = np.empty((len(rows), 6), dtype=np.int64)
        for k, row in enumerate(rows.tolist()):
            for i in range(6):
                own[k, i], _, places[k, i] = self._own(row, i)
        new = own.copy()
        shifted, turned = self.shifted[rows], self.turned[rows]
        new[shifted, :3] = self.position[rows[shifted]] / MM
        new[turned, 3:] = abc_from_rotation(self.rotation[rows[turned]], own[turned, 3:] * DEG) / DEG
        change = new - own
        change[:, 3:] = (change[:, 3:] + 180.0) % 360.0 - 180.0
        counts = np.abs(change) > 0.5 * 10.0**-places
        texts: dict[int, dict[int, str]] = {}
        for k, i in zip(*(axis.tolist() for axis in np.nonzero(counts)), strict=True):
            texts.setdefault(int(rows[k]), {})[i] = _fixed(float(new[k, i]), int(places[k, i]))
        return texts

    def _write(self, row: int, texts: dict[int, str], missing: list[int]) -> None:
        places = self.program.text
        file = int(places.file[row])
        raw = self.program.documents[file].raw
        present = [i for i in range(6) if places.start[row, i] >= 0]
        for i in present:
            if i in texts:
                start, stop = int(places.start[row, i]), int(places.stop[row, i])
                # "Z- 30" is Z and a number, "Z30.1" would be a name.
                touches = _LETTER.match(raw[start - 1 : start]) and not texts[i].startswith("-")
                text = " " + texts[i] if touches else texts[i]
                self.edited.append(Edit(Span(file, start, stop), text.encode()))
        if not missing:
            return
        at = int(places.insert[row])
        first = int(places.start[row, present[0]]) if present else at + 1
        lower = raw[:first].rstrip(b" \t")[-1:].islower()
        words = []
        for i in missing:
            value = texts[i] if i in texts else self._own(row, i)[1]
            words.append(f"{KEYS[i].lower() if lower else KEYS[i]} {value.lstrip('+')}")
        inserted = "," + ",".join(words) if present else ",".join(words) + ","
        self.edited.append(Edit(Span(file, at, at), inserted.encode("latin-1")))


def _given_by(program: Program) -> Ints:
    """(N, 6) the row whose text gives a component: the row itself, or the last one before that writes it."""
    places = program.text
    rows = np.arange(len(places.file))[:, None]
    writes = (places.start >= 0) | (places.file < 0)[:, None]
    return np.maximum.accumulate(np.where(writes, rows, 0), axis=0)


def _decimals(literal: bytes) -> int:
    """The decimals that a literal is written with, its exponent considered."""
    if literal.startswith(b"'"):
        return 0
    mantissa, _, exponent = literal.upper().partition(b"E")
    written = len(mantissa.partition(b".")[2].strip())
    return min(max(written - int(exponent or b"0"), 0), MOST_DECIMALS)


def _fixed(value: float, decimals: int) -> str:
    text = f"{value:.{decimals}f}"
    return text[1:] if text.startswith("-") and not text.strip("-0.") else text
