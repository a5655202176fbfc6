"""Laws of decimal numbers in bulk: as Python writes and reads them one by one."""

from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from postproc.base.decimals import MOST_DECIMALS, fixed, literals

VALUES = st.lists(
    st.tuples(st.floats(-1e7, 1e7) | st.floats(-2, 2), st.integers(0, MOST_DECIMALS), st.booleans()),
    max_size=12,
)


def texts(values: list[float], decimals: list[int], apart: list[bool] | None = None) -> list[bytes]:
    blob, ends = fixed(
        np.array(values, float),
        np.array(decimals, np.int64),
        None if apart is None else np.array(apart, bool),
    )
    return [blob[ends[k] : ends[k + 1]] for k in range(len(values))]


@given(VALUES)
def test_numbers_are_written_within_half_a_step_with_their_decimals(
    cases: list[tuple[float, int, bool]],
) -> None:
    for (value, decimals, apart), text in zip(
        cases, texts(*map(list, zip(*cases, strict=True))) if cases else [], strict=True
    ):
        said = text.decode()
        assert said.startswith(" ") == (apart and not said.strip().startswith("-"))
        said = said.strip()
        assert len(said.partition(".")[2]) == decimals
        assert ("." in said) == (decimals > 0)
        assert not said.lstrip("-").startswith(".")
        assert (
            said.lstrip("-") == "0"
            or not said.lstrip("-").startswith("0")
            or said.lstrip("-").startswith("0.")
        )
        if said.startswith("-"):
            assert said.strip("-0.")
        step = Decimal(1).scaleb(-decimals)
        exact = Decimal(value)
        assert abs(Decimal(said) - exact) <= step / 2 + abs(exact) * Decimal("3e-16")


@pytest.mark.parametrize(
    ("value", "decimals", "text"),
    [(0.0004, 3, b"0.000"), (-0.0004, 3, b"0.000"), (-0.0006, 3, b"-0.001"), (12.0, 0, b"12"),
     (999.9996, 3, b"1000.000"),
     (-0.4, 0, b"0"), (3e15, 3, b"3000000000000000.000"), (-1e18, 1, b"-1000000000000000000.0")],
)  # fmt: skip
def test_numbers_at_the_rim(value: float, decimals: int, text: bytes) -> None:
    assert texts([value, 1.5], [decimals, 4]) == [text, b"1.5000"]


@given(
    st.lists(st.decimals(-(10**6), 10**6, places=4) | st.integers(-(10**9), 10**9), min_size=1, max_size=8)
)
def test_plain_literals_are_read_as_float_reads_them(numbers: list[Decimal | int]) -> None:
    said = [str(number).encode() for number in numbers]
    said = [text for text in said if b"E" not in text] or [b"+5."]
    raw = np.frombuffer(b"{" + b",".join(said) + b"}", np.uint8)
    stop = np.cumsum([len(text) + 1 for text in said])
    start = stop - [len(text) for text in said]
    value, decimals = literals(raw, start, stop, lambda text: pytest.fail(f"{text!r} is plain"))
    assert value.tolist() == [float(text) for text in said]
    assert decimals.tolist() == [len(text.partition(b".")[2]) for text in said]


@pytest.mark.parametrize(
    "text", [b"1e5", b"- 5", b"'B01'", b"", b"-", b".", b"1.2.3", b"12345678901234567", b"5-"]
)
def test_other_literals_are_left_to_the_caller(text: bytes) -> None:
    raw = np.frombuffer(b" 7.5" + text + b" ", np.uint8)
    seen: list[bytes] = []

    def other(literal: bytes) -> tuple[float, int]:
        seen.append(literal)
        return 42.0, 7

    value, decimals = literals(raw, np.array([1, 4]), np.array([4, 4 + len(text)]), other)
    assert seen == [text]
    assert (value.tolist(), decimals.tolist()) == ([7.5, 42.0], [1, 7])


def test_half_a_step_goes_where_python_takes_it_but_for_the_last_bit() -> None:
    random = np.random.default_rng(1)
    values = random.normal(0, 1000, 20000)
    for decimals in (0, 3, 5):
        expected = [
            Decimal(v).quantize(Decimal(1).scaleb(-decimals), ROUND_HALF_EVEN) + 0 for v in values.tolist()
        ]
        found = [Decimal(text.decode()) for text in texts(values.tolist(), [decimals] * len(values))]
        assert found == expected
