"""Laws of the unified diff: applied to the source it gives the output, taken back it gives the source."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import examples

from postproc.base.document import Document, Edit, Span, apply
from postproc.report import diff as diff_module
from postproc.report.diff import CONTEXT, unified_diff


def diff_of(raw: bytes, edits: list[Edit], names: tuple[str, str] = ("a", "b")) -> bytes:
    document = Document(Path(names[0]), raw)
    return b"".join(unified_diff(document, names[1], edits, apply(document, edits)))


HEAD = re.compile(rb"@@ -(\d+),(\d+) \+(\d+),(\d+) @@\n")
OPEN_END = b"\\ No newline at end of file\n"


def hunks(diff: bytes) -> list[tuple[tuple[int, int, int, int], list[bytes]]]:
    lines = re.findall(rb"[^\n]*\n", diff)
    assert lines[0].startswith(b"--- ")
    assert lines[1].startswith(b"+++ ")
    found: list[tuple[tuple[int, int, int, int], list[bytes]]] = []
    for line in lines[2:]:
        head = HEAD.fullmatch(line)
        if head:
            a, b, c, d = map(int, head.groups())
            found.append(((a, b, c, d), []))
        elif line == OPEN_END:
            found[-1][1][-1] = found[-1][1][-1][:-1]
        else:
            found[-1][1].append(line)
    return found


def patched(raw: bytes, diff: bytes, back: bool = False) -> bytes:
    """What ``patch`` makes of it: every line that a hunk names must be there, in its place."""
    old = re.findall(rb"[^\n]*\n|[^\n]+", raw)
    out: list[bytes] = []
    at = 0
    removed, added = (b"+", b"-") if back else (b"-", b"+")
    for (old_line, old_count, new_line, new_count), body in hunks(diff):
        line, count, other, others = (
            (new_line, new_count, old_line, old_count) if back else (old_line, old_count, new_line, new_count)
        )
        assert line - 1 >= at
        out += old[at : line - 1]
        assert len(out) == other - 1
        there = [text[1:] for text in body if text[:1] in (b" ", removed)]
        assert old[line - 1 : line - 1 + len(there)] == there
        assert len(there) == count
        fresh = [text[1:] for text in body if text[:1] in (b" ", added)]
        assert len(fresh) == others
        out += fresh
        at = line - 1 + len(there)
    return b"".join([*out, *old[at:]])


@st.composite
def edited(draw: st.DrawFn) -> tuple[bytes, list[Edit]]:
    raw = b"".join(draw(st.lists(st.sampled_from([b"a", b"b", b"\n", b"x\n", b"y\r\n"]), max_size=60)))
    cuts = sorted(draw(st.lists(st.integers(0, len(raw)), max_size=16)))
    pairs = list(zip(cuts[::2], cuts[1::2], strict=False))
    text = st.sampled_from([b"", b"1", b"new\n", b"\r\nnew", b"two\nlines\n", b"2\n3"])
    return raw, [Edit(Span(0, a, draw(st.sampled_from((a, b)))), draw(text)) for a, b in pairs]


@settings(max_examples=examples(400), deadline=None)
@given(edited(), st.sampled_from([(1, 1), (2, 3), (diff_module.EDITS, diff_module.BLOCKS)]))
def test_a_diff_applied_is_the_output_and_taken_back_the_source(
    case: tuple[bytes, list[Edit]], sizes: tuple[int, int]
) -> None:
    raw, edits = case
    with pytest.MonkeyPatch.context() as patch:  # in many parts, and in one
        patch.setattr(diff_module, "EDITS", sizes[0])
        patch.setattr(diff_module, "BLOCKS", sizes[1])
        _applied(raw, edits)


def _applied(raw: bytes, edits: list[Edit]) -> None:
    written = apply(Document(Path("a.src"), raw), edits)
    diff = diff_of(raw, edits)
    if not edits:
        assert diff == b""
        return
    assert patched(raw, diff) == written
    assert patched(written, diff, back=True) == raw


def test_a_changed_line_stands_before_its_new_form_with_three_lines_around() -> None:
    raw = b"".join(b"line %d\r\n" % i for i in range(1, 30))
    at = raw.index(b"line 10")
    edits = [Edit(Span(0, at, at + 4), b"LINE"), Edit(Span(0, at + 9, at + 9), b"new\r\n"),
             Edit(Span(0, at + 9, at + 13), b"LINE")]  # fmt: skip
    diff = diff_of(raw, edits, ("a.src", "b.src"))
    assert diff.replace(b"\r", b"").splitlines()[:6] == [
        b"--- a.src",
        b"+++ b.src",
        b"@@ -7,8 +7,9 @@",
        b" line 7",
        b" line 8",
        b" line 9",
    ]
    assert diff.split(b" line 9\r\n")[1] == (
        b"-line 10\r\n+LINE 10\r\n+new\r\n-line 11\r\n+LINE 11\r\n line 12\r\n line 13\r\n line 14\r\n"
    )


def test_changes_far_apart_are_hunks_of_their_own() -> None:
    raw = b"x\n" * 40
    for gap, count in ((2 * CONTEXT, 1), (2 * CONTEXT + 1, 2)):
        edits = [Edit(Span(0, 20, 21), b"y"), Edit(Span(0, 20 + 2 * (gap + 1), 21 + 2 * (gap + 1)), b"y")]
        assert len(hunks(diff_of(raw, edits))) == count


def test_a_missing_newline_at_the_end_is_told() -> None:
    diff = diff_of(b"x\ny", [Edit(Span(0, 2, 3), b"z")])
    assert diff.endswith(b"-y\n" + OPEN_END + b"+z\n" + OPEN_END)
