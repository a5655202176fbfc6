"""Loops, branches, jumps and calls of drawn programs, read as a walk through their tree runs them."""

from __future__ import annotations

import itertools
from collections import Counter
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from gcode_flow_programs import WRITERS, Drawing, Tree, Writer
from gcode_judge.misreadings import written as made_of
from gcode_judge.oracle import MISSING, RS274, execute
from test_gcode_followed import read

from postproc.toolpath import Toolpath

Place = tuple[float, ...]
AT_A_TIME = 4
"""Programs of a test."""
BATCHES = pytest.mark.parametrize("batch", range(10))
CONTROLS = pytest.mark.parametrize("control", WRITERS)


@cache
def drawn(control: str, seed: int, doubts: bool) -> tuple[Tree, Writer]:
    tree = Drawing(seed, control, doubts).tree()
    return tree, WRITERS[control](tree, seed)


def batch_of(control: str, batch: int, doubts: bool) -> list[tuple[Tree, Writer]]:
    seeds = range(batch * AT_A_TIME, (batch + 1) * AT_A_TIME)
    return [drawn(control, seed, doubts) for seed in seeds]


def rounded(place: np.ndarray | Place) -> Place:
    return tuple((np.round(place, 6) + 0.0).tolist())


def lines_of(tree: Tree, writer: Writer, answers: tuple[int, ...] = ()) -> list[tuple[int, Place]]:
    """The motions of a run: their lines, and where they end [mm]."""
    lines = {id(node): line for line, node in writer.nodes.items()}
    return [(lines[id(ran.node)], rounded(ran.end)) for ran in tree.run(answers)]


def located(path: Toolpath, first: int = 1) -> list[tuple[int, Place]]:
    """The motions after the head whose end is known: their lines and ends [mm]."""
    known = np.isfinite(path.position).all(axis=1)
    rows = [row for row in range(first, len(path)) if known[row]]
    return [(int(path.line[row]), rounded(path.position[row] * 1e3)) for row in rows]


def refused_lines(path: Toolpath) -> set[int]:
    return {int(path.line[row]) for row in path.constraints.refused}


@CONTROLS
@BATCHES
def test_what_is_decided_runs_as_the_tree_says(control: str, batch: int) -> None:
    """Pass by pass; what runs once can be corrected, what runs several times or never can not."""
    for tree, writer in batch_of(control, batch, False):
        path = read(control, writer.text, "").toolpath
        ran = lines_of(tree, writer)
        assert located(path) == ran, writer.text
        often = Counter(line for line, _ in ran)
        assert refused_lines(path) == {line for line in writer.nodes if often[line] != 1}, writer.text


ANSWERS = [answers * 4 for answers in itertools.product((0, 1, 2), repeat=3)]
"""How often what may run or not runs: none, all, and mixed."""


def check_claims(tree: Tree, writer: Writer, path: Toolpath) -> None:
    """What is claimed of a motion is so in every run."""
    runs = [lines_of(tree, writer, answers) for answers in ANSWERS]
    refused = refused_lines(path)
    claimed = {line: place for line, place in located(path) if line not in refused}
    for run in runs:
        places = dict(run)
        often = Counter(line for line, _ in run)
        for line, place in claimed.items():
            assert (often[line], places.get(line)) == (1, place), f"line {line} of\n{writer.text}"


def sure_lines(tree: Tree, writer: Writer) -> set[int]:
    """Motions that run once, of which nothing hangs on what may run or not."""
    lines = {id(node): line for line, node in writer.nodes.items()}
    found = set(writer.nodes)
    for answers in ANSWERS:
        ran = tree.run(answers)
        often = Counter(lines[id(one.node)] for one in ran)
        found &= {lines[id(one.node)] for one in ran if one.sure and often[lines[id(one.node)]] == 1}
    return found


@CONTROLS
@BATCHES
def test_what_is_claimed_beside_what_may_run_or_not_is_so_in_every_run(control: str, batch: int) -> None:
    for tree, writer in batch_of(control, batch, True):
        check_claims(tree, writer, read(control, writer.text, "").toolpath)


@CONTROLS
@BATCHES
def test_what_hangs_on_nothing_uncertain_is_known(control: str, batch: int) -> None:
    """But behind a call that may happen or not: what it leaves is not followed."""
    for tree, writer in batch_of(control, batch, True):
        path = read(control, writer.text, "").toolpath
        known = {line for line, _ in located(path)} - refused_lines(path)
        missing = sure_lines(tree, writer) - known
        assert not missing, f"{missing} of\n{writer.text}"


@BATCHES
def test_what_is_claimed_in_the_order_of_the_text_is_so_in_every_run(batch: int) -> None:
    """M73 has the end of its subprogram bring back modes, which is not followed; nor is then the flow."""
    for seed in range(batch * AT_A_TIME, (batch + 1) * AT_A_TIME):
        tree, _ = drawn("linuxcnc", seed, True)
        writer = WRITERS["linuxcnc"](tree, seed, "M73\n")
        path = read("linuxcnc", writer.text, "").toolpath
        check_claims(tree, writer, path)
        top = {id(node) for node in tree.main if node.name == "place"}
        places = {line for line, node in writer.nodes.items() if id(node) in top}
        assert tree.subs or places <= {line for line, _ in located(path)}


def otherwise(text: str, control: str, kind: str) -> str:
    """The same program written in another way, line by line."""
    lines = text.splitlines()
    if kind == "comments":
        mark = ";" if control == "sinumerik" else "("
        return "\n".join(f"{line} {mark}X9{')' if mark == '(' else ''}" for line in lines) + "\n"
    if kind == "lower case":
        return text.lower()
    if kind == "windows":
        return text.replace("\n", "\r\n")
    blank = "\t" if control == "linuxcnc" else "  "
    return text.replace(" ", blank)


@CONTROLS
@pytest.mark.parametrize("kind", ["comments", "lower case", "windows", "blanks"])
@pytest.mark.parametrize("seed", range(100, 104))
def test_other_writings_of_a_program_run_alike(control: str, kind: str, seed: int) -> None:
    for doubts in (False, True):
        _, writer = drawn(control, seed, doubts)
        paths = [read(control, text, "").toolpath for text in (writer.text, otherwise(writer.text, control, kind))]
        assert located(paths[0]) == located(paths[1])
        assert refused_lines(paths[0]) == refused_lines(paths[1])


@pytest.mark.skipif(RS274 is None, reason=MISSING)
@pytest.mark.parametrize("batch", [0, pytest.param(1, marks=pytest.mark.slow), pytest.param(2, marks=pytest.mark.slow)])
def test_linuxcnc_runs_the_trees_alike(batch: int, tmp_path: Path) -> None:
    """So that what is compared above is no error in common."""
    for seed in range(batch * 12, (batch + 1) * 12):
        tree, writer = drawn("linuxcnc", seed, False)
        motions = execute(made_of(writer.text), tmp_path)
        assert motions is not None, writer.text
        ran = lines_of(tree, writer)
        assert [motion.line for motion in motions[1:]] == [line for line, _ in ran]
        ends = np.array([end for _, end in ran])
        np.testing.assert_allclose([motion.end for motion in motions[1:]], ends, atol=1e-3)
