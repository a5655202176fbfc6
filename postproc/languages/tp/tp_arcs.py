"""The circles of C motions, and of runs of A motions whose points are on one circle."""

from __future__ import annotations

import numpy as np

from postproc.base.arrays import Floats, Ints
from postproc.base.geometry import arc_through, rotation_from_abc, rotation_from_vector, turn_between
from postproc.base.units import DEG, MM
from postproc.languages.core.row_facts import circles
from postproc.languages.tp.tp_rows import TpRows
from postproc.toolpath import Arcs, Kind

SHORTEST = 0.05 * MM
"""[m] Points of an arc are not nearer to each other."""
ROUND = 0.02 * MM
"""[m] Points of a run of A motions are on one circle within this."""
EVEN = 0.1 * DEG
"""[rad] The orientation at an auxiliary point may be off the even turn from start to end by this; what the controller
makes of another one is not known."""
WIDEST = 170 * DEG
"""[rad] Turn of the tool on an arc: near half a turn, its sense is not known."""


def arc_runs(rows: TpRows) -> list[list[int]]:
    """Rows of A motions that follow each other without a stop between them."""
    runs: list[list[int]] = []
    for row, move in enumerate(rows.moves):
        if move is None or move.form != b"A":
            continue
        last = runs[-1][-1] if runs else -9
        if last == row - 1 and rows.before(row) == (last,):
            runs[-1].append(row)
        else:
            runs.append([row])
    return runs


def arcs_of(
    rows: TpRows, position: Floats, rotation: Floats, kinds: Ints
) -> tuple[Arcs, dict[int, tuple[int, ...]]]:
    """The arcs of N motions (position (N, 3) [m], rotation (N, 3, 3)), and row of an A motion -> rows of its run.

    The first motion of a run of A is a straight line to the start of the arc (FANUC, operator's manual of R-30iB,
    circle arc motion; recalled); its ``kinds`` (N,) becomes LIN.  Refuses rows whose arc is not known.
    """
    n = len(rows)
    centre, normal, sweep = np.full((n, 3), np.nan), np.full((n, 3), np.nan), np.full(n, np.nan)
    of_run: dict[int, tuple[int, ...]] = {}
    for run in arc_runs(rows):
        kinds[run[0]] = Kind.LIN
        of_run.update(dict.fromkeys(run, tuple(run)))
    at = [row for row in range(n) if kinds[row] == Kind.CIRC]
    if not at:
        return Arcs().for_motions(n), of_run
    starts, vias = np.full((len(at), 3), np.nan), np.full((len(at), 3), np.nan)
    for k, row in enumerate(at):
        if row in of_run:
            continue
        start = _start(rows, row, kinds)
        if start >= 0:
            starts[k], vias[k] = position[start], rows.vias[row, :3] * MM
            _check_turn(rows, row, start, rotation)
    ends = position[at]
    found = circles(starts, vias, ends, SHORTEST)
    for k, row in enumerate(at):
        if row in of_run:
            continue
        if np.isnan(found[2][k]):
            rows.refuse(row, "FTP012", "its points define no circle that is known")
        elif row not in rows.problems:
            centre[row], normal[row], sweep[row] = found[0][k], found[1][k], found[2][k]
    for run in arc_runs(rows):
        _run(rows, run, position, (centre, normal, sweep))
    return Arcs(centre=centre, normal=normal, sweep=sweep), of_run


def _start(rows: TpRows, row: int, kinds: Ints) -> int:
    """The row where an arc starts; -1 where that is not known, which refuses it."""
    before = rows.before(row)
    if before != (row - 1,) or row == 0 or kinds[row - 1] == Kind.AXIS:
        rows.refuse(row, "FTP012", "the position at its start is not known in numbers")
        return -1
    start = before[0]
    if start in rows.problems or np.isnan(rows.numbers[start]).any():
        rows.refuse(row, "FTP012", "the motion before it, where it starts, is not known")
        return -1
    if rows.base[start] != rows.base[row] or rows.tool[start] != rows.tool[row]:
        rows.refuse(row, "FTP012", "it starts in another frame, or with another tool")
        return -1
    return start


def _check_turn(rows: TpRows, row: int, start: int, rotation: Floats) -> None:
    """Refuses an arc at whose auxiliary point the tool is not turned evenly."""
    if np.isnan(rows.vias[row]).any() or np.isnan(rows.numbers[row]).any():
        return
    via = rotation_from_abc(rows.vias[row, 5:2:-1] * DEG)
    turn = turn_between(rotation[[start]], rotation[[row]])[0]
    total = float(turn @ turn)
    if total > WIDEST**2:
        rows.refuse(
            row, "FTP012", "the tool turns by about half a turn on it, and in which sense is not known"
        )
        return
    share = 0.0 if total < 1e-18 else float(turn_between(rotation[[start]], via[None])[0] @ turn) / total
    even = rotation_from_vector(min(max(share, 0.0), 1.0) * turn) @ rotation[start]
    off = float(np.linalg.norm(turn_between(even[None], via[None])))
    if off > EVEN:
        message = f"the orientation at its auxiliary point is {off / DEG:.2f} deg off the even turn from start to end"
        rows.refuse(row, "FTP012", message)


def _run(rows: TpRows, run: list[int], position: Floats, arcs: tuple[Floats, Floats, Floats]) -> None:
    """Puts the arcs of a run of A motions in; refuses it where its points are not on one circle."""
    arc_rows = run[1:]
    why = ""
    if len(run) < 3:
        why = "a run of fewer than three A motions defines no circle"
    elif any(row in rows.problems for row in run) or np.isnan(position[run]).any():
        why = "a point of its run of A motions is not known"
    elif len({(rows.base[row], rows.tool[row]) for row in run}) > 1:
        why = "the frame or the tool is another one within its run of A motions"
    if not why:
        points = position[run]
        first, middle, last = (points[[k]] for k in (0, len(run) // 2, -1))
        centre, normal, sweep = arc_through(first, middle, last)
        why = _put_run(arc_rows, points, (centre[0], normal[0], float(sweep[0])), arcs)
    if why:
        for row in run[1:] if len(run) > 1 else run:
            rows.refuse(row, "FTP012", why)


def _put_run(
    rows: list[int], points: Floats, circle: tuple[Floats, Floats, float], arcs: tuple[Floats, Floats, Floats]
) -> str:
    """Puts the arcs between points (K + 1, 3) [m] of a circle in; why it does not."""
    centre, normal, whole = circle
    if not np.isfinite(whole):
        return "the points of its run of A motions define no circle"
    from_centre = points - centre
    radius = np.linalg.norm(from_centre[0])
    off = np.maximum(np.abs(np.linalg.norm(from_centre, axis=1) - radius), np.abs(from_centre @ normal))
    if off.max() > ROUND:
        return "the points of its run of A motions are not on one circle"
    sine = np.einsum("ij,j->i", np.cross(from_centre[:-1], from_centre[1:]), normal)
    sweeps = np.arctan2(sine, np.sum(from_centre[:-1] * from_centre[1:], axis=1)) % (2 * np.pi)
    if abs(sweeps.sum() - whole) > 1e-6:
        return "the points of its run of A motions go to and fro on their circle"
    if (np.linalg.norm(np.diff(points, axis=0), axis=1) <= SHORTEST).any():
        return "two points of its run of A motions are the same"
    for row, sweep in zip(rows, sweeps.tolist(), strict=True):
        arcs[0][row], arcs[1][row], arcs[2][row] = centre, normal, sweep
    return ""
