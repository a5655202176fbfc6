"""Whatever the blocks in which rows are worked on: the same correction, to the last byte that is told."""

from __future__ import annotations

import json

import numpy as np
import pytest
from path_cases import circle, corner, line

import postproc.base.batches
import postproc.compensation.divisible_motions
from postproc.compensation.axis_limits import check_limits
from postproc.compensation.correct import correct
from postproc.compensation.subdivide import subdivide
from postproc.compensation.subdivision import Limits
from postproc.output.write import path_errors_as_written

SIZES = [1, 2, 3, 7]


def in_blocks_of(monkeypatch, rows):
    monkeypatch.setattr(postproc.base.batches, "ROWS", rows)
    monkeypatch.setattr(postproc.base.batches, "SPAN", rows)
    monkeypatch.setattr(postproc.compensation.divisible_motions, "ROWS", rows)


def found(task, allowed):
    """All that a correction finds, as plain arrays and words."""
    result = correct(task)
    division = subdivide(task, result, allowed)
    told, held = check_limits(task, division)
    command, every = result.command[:], division.command[:]
    return {
        "state": result.state,
        "command": command.position,
        "turned": command.rotation,
        "deflection": result.deflection,
        "before": result.before,
        "after": result.after,
        "iterations": result.iterations,
        "history": result.history,
        "source": division.source,
        "role": division.role,
        "ends": every.position,
        "centre": division.centre,
        "sweep": division.sweep,
        "between": path_errors_as_written(task, result, division)[0],
        "words": [str(one) for one in (*result.findings, *division.findings, *told, *held.values())],
    }


@pytest.mark.sample(4)
@pytest.mark.parametrize("rows", SIZES)
@pytest.mark.parametrize(
    ("task", "allowed"),
    [
        (lambda: line(), Limits(max_growth=100.0)),
        (lambda: line(), Limits(max_growth=1.5)),
        (lambda: corner(), Limits(max_growth=100.0)),
        (lambda: circle(), Limits(max_growth=100.0)),
        (lambda: circle(sweep=1.0), Limits(no_insert=True)),
        (lambda: line(gain=0.5), Limits(max_growth=100.0)),
    ],
    ids=["line", "rationed", "corner", "circle", "kept", "half"],
)
def test_a_correction_does_not_depend_on_the_blocks(monkeypatch, rows, task, allowed):
    whole = found(task(), allowed)
    in_blocks_of(monkeypatch, rows)
    parts = found(task(), allowed)
    for name, values in whole.items():
        if name == "words":
            assert parts[name] == values
        else:
            np.testing.assert_allclose(parts[name], values, rtol=0, atol=1e-9, err_msg=name)


@pytest.mark.sample(1)
@pytest.mark.parametrize("rows", SIZES)
def test_an_output_does_not_depend_on_the_blocks(compensate, job, monkeypatch, rows):
    """Program, difference, corrections and report, byte for byte."""
    names = ["part.src", "part.diff", "part.corrections.csv", "part.report.html"]
    told = []
    for size in (postproc.base.batches.ROWS, rows):
        in_blocks_of(monkeypatch, size)
        assert compensate(job.program, "--force").code == 0
        folder = job.program.parent / "compensated"
        report = json.loads((folder / "part.report.json").read_text())
        told.append((report, *((folder / name).read_bytes() for name in names)))
    assert told[0] == told[1]
