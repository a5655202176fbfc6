"""Laws of a document and its edits."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.base.document import BLOCK, Document, Edit, Edits, Span, apply, undone


def in_order(edits: list[Edit]) -> list[Edit]:
    """By place; stable."""
    return sorted(edits, key=lambda edit: (edit.span.start, edit.span.stop))


def document(raw: bytes) -> Document:
    return Document(Path("x.src"), raw)


@st.composite
def edited(draw: st.DrawFn) -> tuple[bytes, list[Edit]]:
    """Bytes and edits on them that do not overlap, in any order."""
    raw = draw(st.binary(max_size=200))
    cuts = sorted(draw(st.lists(st.integers(0, len(raw)), max_size=12, unique=True)))
    if len(cuts) % 2:
        cuts.pop()
    pairs = list(zip(cuts[::2], cuts[1::2], strict=True))
    edits = [Edit(Span(0, a, draw(st.sampled_from((a, b)))), draw(st.binary(max_size=8))) for a, b in pairs]
    return raw, draw(st.permutations(edits))


@given(edited())
def test_every_byte_that_no_edit_covers_is_copied(case: tuple[bytes, list[Edit]]) -> None:
    raw, edits = case
    written = apply(document(raw), edits)
    assert len(written) == len(raw) + sum(len(e.text) - (e.span.stop - e.span.start) for e in edits)
    assert undone(written, raw, edits)


@given(edited(), st.integers(0, 400), st.integers(0, 255))
def test_a_byte_changed_elsewhere_is_seen(case: tuple[bytes, list[Edit]], at: int, byte: int) -> None:
    raw, edits = case
    written = bytearray(apply(document(raw), edits))
    if not written or written[at % len(written)] == byte:
        return
    written[at % len(written)] = byte
    assert not undone(bytes(written), raw, edits)


@given(st.binary(max_size=100))
def test_no_edit_and_edits_by_the_same_text_change_nothing(raw: bytes) -> None:
    assert apply(document(raw), []) == raw
    half = len(raw) // 2
    same = [Edit(Span(0, 0, half), raw[:half]), Edit(Span(0, half, len(raw)), raw[half:])]
    assert apply(document(raw), same) == raw


def test_a_shortened_or_lengthened_copy_is_seen() -> None:
    edits = [Edit(Span(0, 1, 2), b"xy")]
    assert undone(b"axyc", b"abc", edits)
    assert not undone(b"axy", b"abc", edits)
    assert not undone(b"axycc", b"abc", edits)


@pytest.mark.parametrize("span", [(2, 1), (0, 4), (-1, 1)])
def test_a_span_outside_is_an_error(span: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match="overlap or leave"):
        apply(document(b"abc"), [Edit(Span(0, *span), b"")])


def test_overlap_is_an_error() -> None:
    with pytest.raises(ValueError, match="overlap"):
        apply(document(b"abcdef"), [Edit(Span(0, 0, 3), b"x"), Edit(Span(0, 2, 4), b"y")])


def test_insertions_at_one_place_keep_their_order_and_stand_before_a_replacement_there() -> None:
    edits = [Edit(Span(0, 1, 2), b"B"), Edit(Span(0, 1, 1), b"1"), Edit(Span(0, 1, 1), b"2")]
    assert apply(document(b"abc"), edits) == b"a12Bc"
    assert [edit.text for edit in Edits.joined(edits)] == [b"1", b"2", b"B"]


def test_an_insertion_may_touch_the_end_of_a_replacement() -> None:
    edits = [Edit(Span(0, 1, 1), b","), Edit(Span(0, 0, 1), b"X")]
    assert apply(document(b"ab"), edits) == b"X,b"


@given(edited(), edited())
def test_edits_as_arrays_are_the_same_sequence(
    one: tuple[bytes, list[Edit]], two: tuple[bytes, list[Edit]]
) -> None:
    raw, first = one
    second = [Edit(Span(1, e.span.start, e.span.stop), e.text) for e in two[1]]
    both = Edits.joined(second, first)
    assert list(both) == [*in_order(first), *in_order(second)]
    assert [both[k] for k in range(len(both))] == both[:] == list(both)
    assert len(both) == len(first) + len(second)
    assert both.of(0) == Edits.joined(first) == in_order(first)
    assert apply(document(raw), both.of(0)) == apply(document(raw), first)
    assert apply(document(two[0]), both.of(1)) == apply(document(two[0]), two[1])
    assert not Edits.joined()


def test_edits_of_several_documents_are_not_spliced_into_one() -> None:
    with pytest.raises(ValueError, match="several documents"):
        apply(document(b"abc"), [Edit(Span(0, 0, 1), b""), Edit(Span(1, 2, 3), b"")])


@pytest.mark.slow
def test_a_million_edits_in_many_blocks() -> None:
    """Against joining slices one by one; with long stretches that no edit touches, and long texts."""
    random = np.random.default_rng(5)
    raw = random.integers(0, 256, 12 * BLOCK, dtype=np.uint8).tobytes()
    cuts = np.sort(random.choice(8 * BLOCK, 2 * 10**6, replace=False))
    spans = [*zip(cuts[::2].tolist(), cuts[1::2].tolist(), strict=True), (12 * BLOCK - 1, 12 * BLOCK)]
    texts = [b"", b"x", b"1234.5", b"-0.001"]
    edits = [Edit(Span(0, a, b), texts[a % 4]) for a, b in spans]
    edits.append(Edit(Span(0, spans[5][1], spans[5][1]), bytes(BLOCK + 7)))
    pieces, at = [], 0
    for edit in in_order(edits):
        pieces += [raw[at : edit.span.start], edit.text]
        at = edit.span.stop
    expected = b"".join(pieces) + raw[at:]
    written = apply(document(raw), edits)
    assert written == expected
    arrays = Edits.joined(edits)
    assert undone(written, raw, arrays)
    mixed = random.permutation(len(edits) - 2).tolist()
    parts = [[edits[k] for k in mixed[::2]], edits[-2:], [edits[k] for k in mixed[1::2]]]
    same = Edits.collected(part for part in parts)
    for one, other in zip(_arrays(arrays), _arrays(same), strict=True):
        np.testing.assert_array_equal(one, other)
    kept = int(arrays.stop[7])
    for at in (0, kept, len(written) - 1, BLOCK, 2 * BLOCK, 8 * BLOCK):
        wrong = bytearray(written)
        wrong[at] ^= 1
        assert not undone(bytes(wrong), raw, arrays)


def _arrays(edits: Edits) -> tuple[object, ...]:
    return edits.file, edits.start, edits.stop, edits.ends, np.frombuffer(edits.texts, np.uint8)


def test_offsets_beyond_32_bits_are_kept() -> None:
    far = 2**31 + 5
    edits = Edits.joined([Edit(Span(0, far, far + 2), b"xy")], [Edit(Span(0, 7, 9), b"")])
    assert [edit.span for edit in edits] == [Span(0, 7, 9), Span(0, far, far + 2)]
    assert Edits.joined(edits.of(0), [Edit(Span(0, 1, 1), b"a")])[:][-1] == Edit(Span(0, far, far + 2), b"xy")


def test_lines_begin_behind_breaks_at_the_seams_of_blocks() -> None:
    raw = bytearray(b"x" * (2 * BLOCK + 3))
    for at in (0, BLOCK - 1, BLOCK, 2 * BLOCK - 1, 2 * BLOCK, len(raw) - 1):
        raw[at] = 10
    assert document(bytes(raw)).line_starts.tolist() == [
        0, 1, BLOCK, BLOCK + 1, 2 * BLOCK, 2 * BLOCK + 1, len(raw)
    ]  # fmt: skip


@given(st.lists(st.sampled_from([b"LIN", b"\r\n", b"\n", b"\r", b"\xff", b" "]), max_size=30))
def test_places_count_lines_and_columns_from_one(words: list[bytes]) -> None:
    raw = b"".join(words)
    doc = document(raw)
    for offset in range(len(raw)):
        line, column = doc.place(offset)
        assert line == raw[:offset].count(b"\n") + 1
        assert column == offset - (raw[:offset].rfind(b"\n") + 1) + 1
    lines = [doc.line(i + 1) for i in range(len(doc.line_starts))]
    assert lines == [part.rstrip(b"\r") for part in raw.split(b"\n")]


@pytest.mark.parametrize(
    ("raw", "newline"),
    [(b"a\r\nb", b"\r\n"), (b"a\nb\r\n", b"\n"), (b"a", b"\n"), (b"", b"\n"), (b"\n", b"\n")],
)
def test_the_line_ending_is_that_of_the_first_line(raw: bytes, newline: bytes) -> None:
    assert document(raw).newline == newline


def test_the_digest_is_that_of_the_bytes() -> None:
    assert document(b"").digest == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
