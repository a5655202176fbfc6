"""What a cell states of the controller's own data."""

from __future__ import annotations

from pathlib import Path

import pytest

from postproc.base.findings import Refusal
from postproc.cell import load_cell


def cell(folder: Path, text: str) -> Path:
    path = folder / "cell.yaml"
    path.write_text("robot: kuka_kr270\n" + text)
    return path


def test_names_and_start_are_read(tmp_path: Path) -> None:
    read = load_cell(
        cell(
            tmp_path,
            "symbols:\n  XHome: {a1: 0, A2: -90}\n  UFRAME[2]: {X: 1.5}\n  '#501': 12.5\n"
            "program_start: {tool: 3, base: 1, x: 0, z: 100, c: 180}\n",
        )
    )
    assert read.symbols == {"XHOME": {"A1": 0.0, "A2": -90.0}, "UFRAME[2]": {"X": 1.5}, "#501": 12.5}
    assert (read.program_start.tool, read.program_start.base) == (3, 1)
    assert read.program_start.words == {"X": 0.0, "Z": 100.0, "C": 180.0}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("symbols: {'1X': 3}", "is no name"),
        ("symbols: {a: 1, A: 2}", "stated twice"),
        ("symbols: {a: {}}", "states no component"),
        ("symbols: {a: {X: red}}", "red"),
        ("program_start: {tool: 1.5}", "whole number"),
        ("program_start: {speed: 1}", "speed"),
    ],
)
def test_what_is_wrong_there_is_refused_in_words(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(Refusal) as caught:
        load_cell(cell(tmp_path, text))
    assert said in caught.value.findings[0].message
    assert caught.value.findings[0].line
