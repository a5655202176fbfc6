"""Forces of programs of many blocks: a path that is repeated has the forces of the path, wherever a block ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_forces import DOWN, cell_of, path_of, run
from tiers import examples

from postproc.base.batches import ROWS
from postproc.base.findings import Refusal
from postproc.base.geometry import Poses, rotation_from_abc, rotation_from_vector
from postproc.base.units import DEG, MM
from postproc.cell import Tool, frames_of
from postproc.process.milling_forces import mean_force
from postproc.process.operations import process_forces
from postproc.process.path_length import PathLength
from postproc.process.process_file import read_process
from postproc.toolpath import (
    Annotation,
    Arcs,
    Configuration,
    EditConstraints,
    FrameRef,
    Kind,
    OrientationControl,
    PartialTargets,
    Reflections,
    Toolpath,
)

TIMES = 2 * ROWS // 10
"""Repetitions: a path of 11 to 14 motions then ends in all places of a block."""

FRAMES = (FrameRef(1, None, 3), FrameRef(1, None, 4), FrameRef(2, None, 5))
CELL = cell_of(
    tools={
        1: Tool(Poses.from_abc([0, 0, 0.2], [0, 0, 0]), np.array([0.0, 0, 1])),
        2: Tool(Poses.from_abc([0.05, 0, 0.3], [0, 0.3, 0]), np.array([0.0, 0, 1])),
    },
    bases={1: Poses.from_abc([1.0, 0.5, 0.2], [0.4, 0, 0])},
)
KINDS = ("line", "line", "line", "arc", "turn", "down", "air", "tool", "lost")


def some_path(draw: np.random.Generator, count: int) -> Toolpath:
    """PTP to the origin, then motions of all kinds, each of which leads on from the one before."""
    points, turns, kinds, tools = [np.zeros(3)], [DOWN], [Kind.PTP], [1]
    centre, normal, sweep = (np.full((count, 3), np.nan), np.full((count, 3), np.nan), np.full(count, np.nan))
    last, heading = np.zeros(3), 0.0
    for row in range(1, count):
        what = "line" if row == 1 else KINDS[draw.integers(len(KINDS))]
        heading += draw.normal() * 20 * DEG
        along = np.array([np.cos(heading), np.sin(heading), 0.0])
        turn, kind, tool, to = turns[-1], Kind.LIN, tools[-1], last + 0.02 * along
        if what == "arc":
            kind, angle = Kind.CIRC, draw.uniform(0.3, 3)
            normal[row] = [0, 0, 1 if draw.integers(2) else -1]
            centre[row] = last + 0.01 * np.cross(normal[row], along)
            sweep[row] = angle
            to = centre[row] + rotation_from_vector(angle * normal[row]) @ (last - centre[row])
            turn = rotation_from_abc([draw.normal() * 0.2, draw.normal() * 0.1, 0]) @ DOWN
        elif what == "turn":
            to, turn = last, rotation_from_abc([draw.normal() * 0.2, 0, 0]) @ DOWN
        elif what == "down":
            to = last - [0, 0, 0.01]
        elif what == "air":
            kind = Kind.PTP
        elif what == "tool":
            kind, tool = Kind.PTP, 3 - tool
        points.append(np.full(3, np.nan) if what == "lost" else to)
        turns.append(turn)
        kinds.append(kind)
        tools.append(tool)
        last = last if what == "lost" else to
    path = path_of(points, kinds, turns, frames=FRAMES, tool=tools)
    return replace(path, arcs=Arcs(centre, normal, sweep))


def repeated(path: Toolpath, times: int) -> Toolpath:
    n = len(path)
    columns = ("kind", "position", "rotation", "axes", "feed", "base", "tool")
    tiled = {name: np.concatenate([getattr(path, name)] * times) for name in columns}
    arcs = Arcs(
        *(
            np.concatenate([values] * times)
            for values in (path.arcs.centre, path.arcs.normal, path.arcs.sweep)
        )
    )
    notes = [
        Annotation(note.row + n * k, note.text, note.line) for k in range(times) for note in path.annotations
    ]
    left_out = {
        name: np.empty(0)
        for name in (
            "approximation",
            "approximation_number",
            "continues",
            "drills",
            "external",
            "inverse_time_feed",
            "spindle",
            "stops",
            "waits",
        )
    }
    return path.with_columns(
        **tiled,
        **left_out,
        line=np.arange(n * times) + 10,
        annotations=tuple(notes),
        arcs=arcs,
        constraints=EditConstraints(),
        partial_targets=PartialTargets(),
        configuration=Configuration(),
        orientation_control=OrientationControl(),
        reflections=Reflections(),
    )


def same(long, short, times: int, seed: int) -> None:
    n = len(short)
    for name in ("values", "carries", "steps"):
        few, many = getattr(short, name), getattr(long, name)
        np.testing.assert_allclose(many, np.concatenate([few] * times), atol=1e-9)
    np.testing.assert_allclose(long.start[:], np.concatenate([short.start[:]] * times), atol=1e-9)
    assert long.max_force == pytest.approx(short.max_force)
    rng = np.random.default_rng(seed)
    rows, share = rng.integers(0, n * times, 3000), rng.uniform(size=3000)
    np.testing.assert_allclose(long.along(rows, share), short.along(rows % n, share), atol=1e-9)


@pytest.mark.slow
@settings(max_examples=examples(40), deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.integers(11, 14),
    st.sampled_from(["10,20,30,1,2,3@base", "10,20,30,1,2,3@tool", "0,0,30@feed", "10,20,30,1,2,3@feed", ""]),
)
def test_a_repeated_path_has_the_forces_of_the_path(seed, count, spec):
    path = some_path(np.random.default_rng(seed), count)
    if not spec:
        notes = (
            (0, "FORCE OFF"),  # also where the path begins again
            (1, "FORCE 100 20 30 @feed"),
            (4, "FORCE 0 60 10 @tool"),
            (7, "FORCE OFF"),
            (8, "FORCE 90 0 5"),
        )
        path = path.with_columns(annotations=tuple(Annotation(row, text, 9) for row, text in notes))
    try:
        short = run(path, spec, CELL)
    except Refusal as refusal:  # a cut along the spindle has no feed frame
        with pytest.raises(Refusal) as again:
            run(repeated(path, TIMES), spec, CELL)
        (one,), (other,) = refusal.findings, again.value.findings
        assert (one.code, one.line) == (other.code, other.line)
        return
    long = run(repeated(path, TIMES), spec, CELL)
    same(long, short, TIMES, seed)
    assert {finding.code for finding in long.findings} == {finding.code for finding in short.findings}


def test_a_table_of_a_repeated_path(tmp_path):
    rng = np.random.default_rng(4)
    path = some_path(rng, 13)
    long = repeated(path, TIMES)
    force = np.round(rng.normal(size=(13, 3)) * 100, 3)
    frame = ["base", "tool", "@world"]

    def table(of: Toolpath, name: str) -> str:
        rows = [
            f"{line},{','.join(map(str, force[row % 13]))},{frame[row % 3] if row % 13 < 9 else ''}"
            for row, line in [(k % 13, line) for k, line in enumerate(of.line.tolist())]
            if row != 5
        ]
        (tmp_path / name).write_text("line,fx,fy,fz,frame\n" + "\n".join(rng.permutation(rows)))
        return str(tmp_path / name)

    same(run(long, table(long, "long.csv"), CELL), run(path, table(path, "short.csv"), CELL), TIMES, 1)


@pytest.mark.slow
@pytest.mark.parametrize("each", [0.8, 9.0])
def test_a_log_over_a_repeated_path(tmp_path, each):
    """Readings that repeat with the path: every repetition but the first and the last ones gets the same of them."""
    path = path_of([[0.004 * k, 0.001 * (k % 2), 0] for k in range(13)], [Kind.PTP] + [Kind.LIN] * 12)
    long = repeated(path, TIMES)
    way = PathLength(long, frames_of(CELL, long, "part.src"))
    period = way.length[13:26].sum()
    count = int(period / (each * MM)) + 1
    place = period * (np.arange(count * TIMES) + 0.37) / count / MM
    turn = 2 * np.pi * place * MM / period
    force = np.stack(
        [300 * np.sin(turn), 40 * np.cos(3 * turn), 50 * np.sign(np.sin(2 * turn + 0.1))], axis=1
    )
    inside = place * MM <= way.length.sum()
    rows = (",".join(map(repr, row)) for row in np.column_stack([place, force])[inside].tolist())
    log = tmp_path / "log.csv"
    log.write_text("s_mm,fx,fy,fz\n" + "\n".join(rows))
    result = run(long, str(log), CELL)
    for made in (result.values, result.start[:], result.peak[:, None], result.steps[:, None]):
        parts = made.reshape(TIMES, 13, -1).astype(float)[2:-2]
        np.testing.assert_allclose(parts, np.broadcast_to(parts[0], parts.shape), atol=1e-4)
    assert result.values[:, 0].max() > 200


def test_a_process_over_a_repeated_path(tmp_path):
    """Two operations by their tools, feeds that differ, and a plunge."""
    points = [[0.02 * k, 0.005 * (k % 2), -0.001 * (k % 3)] for k in range(13)]
    points[4] = [*points[3][:2], -0.02]
    kinds = [Kind.PTP] + [Kind.LIN] * 6 + [Kind.PTP] + [Kind.LIN] * 5
    path = path_of(points, kinds, frames=FRAMES, tool=[1] * 7 + [2] * 6)
    path = path.with_columns(feed=np.linspace(0.01, 0.02, 13)[[0, 1, 2, 2, 4, 5, 6, 7, 3, 9, 1, 11, 12]])
    process = tmp_path / "process.yaml"
    process.write_text(
        "defaults: {teeth: 3, helix: 30, axial_depth: 5, radial_width: 8, direction: down, spindle: 12000,\n"
        "           material: EN AW-7075-T6}\n"
        "operations: [{tool: 1, diameter: 16}, {tool: 2, diameter: 20, teeth: 4}]\n"
    )
    short, long = (run(one, str(process), CELL) for one in (path, repeated(path, TIMES)))
    assert np.flatnonzero(~short.carries).tolist() == [0, 4, 7]
    stated, _ = process_forces(process, path, frames_of(CELL, path, "part.src"), "part.src")
    for row in np.flatnonzero(short.carries):
        operation = read_process(process)[path.tool[row] - 1]
        expected = mean_force(operation.cut, operation.feed_per_tooth(path.feed[[row]]))[0]
        np.testing.assert_allclose(stated.values[stated.row[row]], [*expected, 0, 0, 0])
    same(long, short, TIMES, 2)
    np.testing.assert_allclose(long.ci95, np.tile(short.ci95, TIMES))
    np.testing.assert_allclose(long.peak, np.tile(short.peak, TIMES), rtol=1e-3)
