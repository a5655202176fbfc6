"""Comparisons of numbers that a controller keeps in single precision: decided only as it decides them."""

from __future__ import annotations

import operator
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from postproc.base.document import Document
from postproc.languages import DIALECTS
from postproc.languages.core.rounded_numbers import are_comparable, computed
from postproc.languages.gcode.expression_values import FANUC, LINUXCNC
from postproc.languages.gcode.expression_values import evaluate as evaluate_macro
from postproc.languages.krl.expressions import evaluate
from postproc.toolpath import Toolpath

STEPS = [number / 100 for number in range(5, 200, 5)]
COMPARISONS: dict[str, Callable[[object, object], bool]] = {
    "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge, "==": operator.eq, "<>": operator.ne,
}  # fmt: skip


def test_sums_of_steps_are_compared_as_single_precision_compares_them() -> None:
    undecided = exact = 0
    for step in STEPS:
        total, single = 0.0, np.float32(0.0)
        for count in range(1, 21):
            total, single = computed(total + step, total, step), np.float32(single + np.float32(step))
            limit = round(step * count, 2)
            exact += step % 0.25 == 0
            if are_comparable(total, limit):
                assert (total < limit, total == limit) == (
                    single < np.float32(limit),
                    single == np.float32(limit),
                )
            else:
                assert step % 0.25 != 0
                undecided += 1
    assert undecided == 20 * len(STEPS) - exact


@pytest.mark.parametrize("seed", range(4))
def test_expressions_of_krl_are_decided_as_single_precision_decides_them(seed: int) -> None:
    random = np.random.default_rng(seed)
    decided = 0
    for _ in range(500):
        numbers = random.choice(
            ["0.1", "0.2", "0.25", "0.3", "0.5", "0.7", "1.5", "2.0", "3.0", "10.0"], 5
        ).tolist()
        signs = random.choice(["+", "-", "*", "/"], 3).tolist()
        # from the left, in single precision
        text, value = numbers[0], np.float32(numbers[0])
        for sign, number in zip(signs, numbers[1:4], strict=True):
            text = f"({text}{sign}{number})"
            value = {
                "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide
            }[sign](value, np.float32(number))  # fmt: skip
        # what is exact in theory is near by chance in double precision
        limit = f"{float(value):.2f}"
        sign = str(random.choice(list(COMPARISONS)))
        found = evaluate(f"{text}{sign}{limit}".encode(), lambda name, path: None)
        if isinstance(found, bool):
            decided += 1
            assert found is bool(COMPARISONS[sign](value, np.float32(limit))), (text, sign, limit)
    assert decided > 50


def rapid(condition: str) -> Toolpath:
    """Two motions, the first under ``condition``; it is not known what is before the second where it is not decided."""
    point = "[[1,2,3],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]"
    lines = f"x:=0;\nFOR i FROM 1 TO 20 DO\nx:=x+0.45;\nENDFOR\nIF {condition} THEN\nMoveL {point},v10,fine,t;\nENDIF"
    raw = f"MODULE m\nVAR num x;\nPROC main()\n{lines}\nMoveL {point},v10,fine,t;\nENDPROC\nENDMODULE\n"
    return DIALECTS["rapid"].read((Document(Path("m.mod"), raw.encode()),)).toolpath


def test_a_number_that_is_whole_by_chance_decides_nothing_in_rapid() -> None:
    before_last = {one: rapid(one).predecessors.get(1) for one in ("x>8.9", "x>=9", "x=9", "x>9.1")}
    assert before_last == {"x>8.9": None, "x>=9": (-1, 0), "x=9": (-1, 0), "x>9.1": None}


@pytest.mark.parametrize(
    ("text", "decided"),
    [("0.15*8 GE 1.2", None), ("0.45*20 EQ 9", None), ("FIX[0.1*10]", None), ("0.15*8 GT 1", 1.0),
     ("0.25*4 EQ 1", 1.0)],
)  # fmt: skip
def test_macros_of_fanuc_decide_nothing_by_their_last_digits(text: str, decided: float | None) -> None:
    """LinuxCNC computes in double precision, as it is computed here."""
    found = evaluate_macro(text, FANUC, lambda name: float("nan"))
    assert np.isnan(found) if decided is None else found == decided
    assert evaluate_macro(text, LINUXCNC, lambda name: float("nan")) == 1.0
