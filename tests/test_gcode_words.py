"""Lines of G-code beside the words and notes that they are taken apart into, with their places.

In the tables a line is followed by its reading: where its first word begins and its code ends; address and number of
every word (i: without a point, a: absolute, r: relative, ?: not read), where the address stands and the number's bytes;
what else it says; a slash where it may not run.
"""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from postproc.languages.gcode import kuka_cnc, sinumerik
from postproc.languages.gcode.code_tables import LINUXCNC
from postproc.languages.gcode.control import Control
from postproc.languages.gcode.lexing import lex
from postproc.languages.gcode.words import NAMES, Text

TABLES = Path(__file__).parent / "programs" / "words"
CONTROLS = {
    "linuxcnc": LINUXCNC,
    "kuka_cnc": kuka_cnc.CONTROL,
    "sinumerik": sinumerik.with_tools(b'N1 T="A" t = "B" XT="C" T="A"'),
}
HOWS = ("", "i", "a", "r", "?")
OPEN = re.compile(rb"#<[^>]*$|\[[^]]*$|'[^']*$|[-#=+]$")


def address(number: int) -> str:
    if number >= NAMES:
        return ("TURN", "RPL", "RETRACT")[number - NAMES]
    return chr(number & 0xFF) + (f"{number // 256 - 1}=" if number > 255 else "")


def readings(text: Text, shift: int = 0) -> list[str]:
    """One line a block; places are counted from its begin."""
    words, blocks, found = text.words, text.blocks, []
    for block in range(len(blocks)):
        start = int(blocks.start[block]) + shift
        said = [f"{blocks.first[block] + shift - start}-{blocks.code[block] + shift - start}"]
        for k in np.flatnonzero(words.block == block).tolist():
            begin = str(words.start[k] + shift - start) if words.start[k] >= 0 else ""
            place = f"{words.at[k] + shift - start},{begin}:{words.stop[k] + shift - start}"
            said.append(f"{address(int(words.key[k]))}{words.value[k]:g}{HOWS[words.how[k]]}@{place}")
        said += [f"<{note.kind} {note.text}>" for note in text.notes if note.block == block]
        found.append(" ".join(said + ["/"] * bool(blocks.deleted[block])))
    return found


def table(name: str) -> list[tuple[bytes, str]]:
    """Lines, escapes in them resolved, and their readings; a line that says nothing has none."""
    lines = (TABLES / f"{name}.txt").read_text(encoding="latin-1").splitlines()
    found: list[tuple[bytes, str]] = []
    for line in lines:
        if line.startswith("    "):
            found[-1] = (found[-1][0], line.strip())
        else:
            found.append((line.encode("latin-1").decode("unicode_escape").encode("latin-1"), ""))
    return found


@pytest.mark.parametrize("name", CONTROLS)
def test_a_line_is_taken_apart_as_listed(name: str) -> None:
    for line, expected in table(name):
        assert readings(lex(line, CONTROLS[name])) == [expected] * bool(expected), line


@pytest.mark.parametrize("newline", [b"\n", b"\r\n", b"\n\n \n", b" ;(\n"])
@pytest.mark.parametrize("name", CONTROLS)
def test_a_line_reads_the_same_among_others(name: str, newline: bytes) -> None:
    """In a file of all lines; and where only some of them are taken apart."""
    control, rows = CONTROLS[name], [row for row in table(name) if not row[0].startswith(b"\xef")]
    if newline.startswith(b" "):  # what does not close would take the blank in
        rows = [row for row in rows if not (set(b'"(%') & set(row[0]) or OPEN.search(row[0]))]
    raw = newline.join(line for line, _ in rows)
    text = lex(raw, control)
    expected = [said for _, said in rows if said]
    assert readings(text) == expected
    numbers = 1 + newline.count(b"\n") * np.arange(len(rows))
    assert text.blocks.line.tolist() == [n for n, (_, said) in zip(numbers, rows, strict=True) if said]
    starts = np.cumsum([0] + [len(line) + len(newline) for line, _ in rows])
    for first, behind in pairwise([0, 1, 7, len(rows) // 2, len(rows)]):
        part = lex(raw, control, int(starts[first]), min(int(starts[behind]), len(raw)), int(numbers[first]))
        assert readings(part) == [said for _, said in rows[first:behind] if said]
        here = (text.blocks.start >= starts[first]) & (text.blocks.start < starts[behind])
        assert part.blocks.line.tolist() == text.blocks.line[here].tolist()
        for column in ("start", "stop", "first", "code", "deleted"):
            assert getattr(part.blocks, column).tolist() == getattr(text.blocks, column)[here].tolist()
        rest = (text.comments[:, 0] >= starts[first]) & (text.comments[:, 0] < starts[behind])
        assert part.comments.tolist() == text.comments[rest].tolist()


COMMENTS: list[tuple[Control, bytes, list[tuple[bytes, int]]]] = [
    (LINUXCNC, b"G1 (a (b) c) X1 ;d (e)\r\n(f\n;g", [(b"(a (b) c)", 1), (b";d (e)", 1), (b"(f", 2), (b";g", 3)]),
    (sinumerik.CONTROL, b'MSG("a;b") ;c "d"\n;"', [(b';c "d"', 1), (b';"', 2)]),
    (kuka_cnc.CONTROL, b"%head (x)\n X1 %no ;a\n(b)(c\n", [(b"%head (x)", 1), (b";a", 2), (b"(b)", 3), (b"(c", 3)]),
]  # fmt: skip


@pytest.mark.parametrize(("control", "raw", "expected"), COMMENTS)
def test_comments_are_told_with_their_delimiters(
    control: Control, raw: bytes, expected: list[tuple[bytes, int]]
) -> None:
    """And with the number of their line."""
    for before in (b"", b"X1\n\nX2\n"):
        text = lex(before + raw, control, len(before), None, 1 + before.count(b"\n"))
        found = [((before + raw)[start:stop], line) for start, stop, line in text.comments.tolist()]
        assert found == [(said, line + before.count(b"\n")) for said, line in expected]


def test_the_letters_in_force_are_told_from_one_another() -> None:
    """Every byte outside of words is either a blank or said to be not understood."""
    blanks = {0, 2, 3, 4, 9, 11, 12, 17, 18, 19, 20, 26, 32}
    for byte in (
        set(range(256)) - {10, 13, *b"0123456789+-.;(%/:#<*,="} - set(range(65, 91)) - set(range(97, 123))
    ):
        text = lex(b"X1" + bytes([byte]) + b"Y2", LINUXCNC)
        assert [note.kind for note in text.notes] == ([] if byte in blanks else ["unknown"]), byte
        assert (text.words.value.tolist() == [1, 2]) == (byte in blanks)
