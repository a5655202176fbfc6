"""Work on blocks of rows: all of it, in order, on any number of threads."""

import threading

import numpy as np
import pytest

from postproc.base import batches
from postproc.base.batches import THREADS, blocks, in_blocks, in_spans, select_rows, spans, threads


@pytest.mark.parametrize("count", [0, 1, 9, 10, 11, 95])
@pytest.mark.parametrize("many", ["1", "2", "5"])
def test_every_row_is_worked_on_once_and_in_order(monkeypatch, count, many):
    monkeypatch.setenv(THREADS, many)
    parts = list(in_blocks(lambda rows: np.arange(count)[rows], count, 10))
    assert [len(part) for part in parts[:-1]] == [10] * (len(parts) - 1)
    assert np.array_equal(np.concatenate([np.empty(0, int), *parts]), np.arange(count))


def test_blocks_are_the_same_on_any_number_of_threads(monkeypatch):
    for many in ("1", "2", "7"):
        monkeypatch.setenv(THREADS, many)
        assert list(in_blocks(lambda rows: (rows.start, rows.stop), 25, 10)) == [(0, 10), (10, 20), (20, 25)]


def test_several_threads_work_at_the_same_time(monkeypatch):
    monkeypatch.setenv(THREADS, "2")
    met = threading.Barrier(2, timeout=30)
    assert sorted(in_blocks(lambda _: met.wait(), 2, 1)) == [0, 1]
    assert not met.broken


def test_an_error_of_one_block_is_raised_and_the_rest_given_up(monkeypatch):
    monkeypatch.setenv(THREADS, "2")
    begun = []

    def work(rows):
        begun.append(rows.start)
        if rows.start == 3:
            raise KeyError("three")

    with pytest.raises(KeyError, match="three"):
        list(in_blocks(work, 1000, 1))
    assert len(begun) < 20


def test_blocks_inside_of_a_block_need_no_more_threads(monkeypatch):
    monkeypatch.setenv(THREADS, "2")

    def outer(rows):
        own = threading.get_ident()
        return all(there == own for there in in_blocks(lambda _: threading.get_ident(), 4, 1))

    assert all(in_blocks(outer, 6, 1))


@pytest.mark.parametrize(
    ("word", "least", "most"), [("3", 3, 3), ("99", 8, 8), ("0", 1, 8), ("many", 1, 8), ("", 1, 8)]
)
def test_the_number_of_threads_can_be_said(monkeypatch, word, least, most):
    monkeypatch.setenv(THREADS, word)
    assert least <= threads() <= most


def test_blocks_leave_no_row_out():
    assert blocks(0) == []
    assert blocks(7, 3) == [slice(0, 3), slice(3, 6), slice(6, 7)]


@pytest.mark.parametrize("span", [1, 5, 64, 10_000])
@pytest.mark.parametrize(
    "chosen", [[], [0], [63, 64], [0, 1, 2, 3, 4, 5, 90], list(range(0, 1000, 7)), [999]]
)
def test_blocks_of_rows_here_and_there_lie_close_together(monkeypatch, span, chosen):
    monkeypatch.setattr(batches, "SPAN", span)
    rows = np.array(chosen, int)
    parts = spans(rows, 4)
    assert [row for part in parts for row in rows[part]] == chosen
    for part in parts:
        assert min(2, len(rows)) <= len(rows[part]) <= 4 + 2
        inner = rows[part][1:-1]  # beside them there may be one each that would be alone
        assert len(inner) < 2 or np.ptp(inner) < span
    assert list(in_spans(lambda part: rows[part].tolist(), rows, 4)) == [
        rows[part].tolist() for part in parts
    ]
    values = np.random.default_rng(1).random((1000, 2))
    assert np.array_equal(select_rows(values, rows), values[rows])


def test_rows_of_a_small_program_are_one_block():
    assert spans(np.arange(0, batches.SPAN, 100)) == blocks(-(-batches.SPAN // 100))
