"""Files of measured parts with a mistake in them: how many of them are learnt from.

    python -m tests.blind_parts.bad_files [--draws 20] [--seed 0] [--minutes M]

Each draw cuts a part of its own; its file gets one mistake at a time, and one copy gets none.  The sign is stated once
in files without a further word, is that of a place that was looked at again in files ``(checked)``, and is shown by
measured places in others.  Files with another mistake than the sign state it twice, by the command, so that no second
look helps to find them.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))

import numpy as np

COUNT, NOISE = 100, 1e-5

Lines = list[str]
Cells = np.ndarray


def _numbers(
    change: Callable[[Cells, np.random.Generator], None], columns: slice = slice(0, 7)
) -> Callable[[Lines, np.random.Generator], Lines]:
    """A mistake in the columns X, Y, Z, NX, NY, NZ, DEV (K, 7), or in others."""

    def spoil(lines: Lines, rng: np.random.Generator) -> Lines:
        head = _head(lines)
        rows = [line.split(",") for line in lines[head:]]
        cells = np.array([row[columns] for row in rows], float)
        change(cells, rng)
        for own, row in zip(cells, rows, strict=True):
            row[columns] = [f"{x:.6f}" for x in own]
        return [*lines[:head], *(",".join(row) for row in rows)]

    return spoil


def _head(lines: Lines) -> int:
    """Lines above the rows."""
    return next(i for i, line in enumerate(lines) if line.startswith("X,")) + 1


MEASURED = slice(8, 11)
"""The columns MX, MY, MZ."""


def _columns(
    one: int, other: int, columns: slice = slice(0, 7)
) -> Callable[[Lines, np.random.Generator], Lines]:
    def change(cells: Cells, rng: np.random.Generator) -> None:
        cells[:, [one, other]] = cells[:, [other, one]]

    return _numbers(change, columns)


def _scaled(columns: list[int], factor: float) -> Callable[[Lines, np.random.Generator], Lines]:
    def change(cells: Cells, rng: np.random.Generator) -> None:
        cells[:, columns] *= factor

    return _numbers(change)


def _sign(cells: Cells, rng: np.random.Generator) -> None:
    cells[:, 6] *= -1


def _shuffled(cells: Cells, rng: np.random.Generator) -> None:
    cells[:, 6] = rng.permutation(cells[:, 6])


def _places_shuffled(cells: Cells, rng: np.random.Generator) -> None:
    cells[:] = rng.permutation(cells)


def _places_shifted(cells: Cells, rng: np.random.Generator) -> None:
    cells[:] = np.roll(cells, 1, axis=0)


def _shifted(cells: Cells, rng: np.random.Generator) -> None:
    cells[:, 6] = np.roll(cells[:, 6], 1)


def _radius(cells: Cells, rng: np.random.Generator) -> None:
    cells[:, 6] += rng.choice([0.5, 1.0, 2.0])


def _actual(cells: Cells, rng: np.random.Generator) -> None:
    cells[:, :3] += cells[:, 6:] * cells[:, 3:6]


def _features(lines: Lines, rng: np.random.Generator) -> Lines:
    """The deviations of two features are exchanged as far as there are points."""
    head = _head(lines)
    rows = [line.split(",") for line in lines[head:]]
    names = sorted({row[7] for row in rows if row[7].startswith("WALL")})
    first, second = rng.choice(names, 2, replace=False)
    one, other = ([i for i, row in enumerate(rows) if row[7] == name] for name in (first, second))
    for i, j in zip(one, other, strict=False):
        rows[i][6], rows[j][6] = rows[j][6], rows[i][6]
    return [*lines[:head], *(",".join(row) for row in rows)]


def _digest(lines: Lines, rng: np.random.Generator) -> Lines:
    return [*lines[:3], "# sha256: " + hashlib.sha256(rng.bytes(8)).hexdigest(), *lines[4:]]


def _origin(cells: Cells, rng: np.random.Generator) -> None:
    cells[:, rng.integers(2)] += rng.choice([-1.0, -0.3, 0.3, 1.0])


PLACES, CHECKED = " (with measured places)", " (checked)"
ORIGINAL = ("none (by the original)", "sign (by the original)")
GOOD = ("none", *ORIGINAL[:1], "none" + CHECKED, "none" + PLACES)
ONCE = (*GOOD[:2], ORIGINAL[1], "sign")
"""Files that state the sign once: a good one is asked for a second statement where its points do not show it."""

MISTAKES: dict[str, Callable[[Lines, np.random.Generator], Lines]] = {
    **dict.fromkeys(GOOD, lambda lines, rng: lines),
    ORIGINAL[1]: _numbers(_sign),
    "sign": _numbers(_sign),
    "sign" + CHECKED: _numbers(_sign),
    "sign" + PLACES: _numbers(_sign),
    "origin": _numbers(_origin),
    "columns X and Y": _columns(0, 1),
    "columns NX and NY": _columns(3, 4),
    "features exchanged": _features,
    "rows shuffled": _numbers(_shuffled),
    "rows shifted by one": _numbers(_shifted),
    "another program": _digest,
    "the original named": lambda lines, rng: lines,
    "deviations in m": _scaled([6], 1e-3),
    "all in m": _scaled([0, 1, 2, 6], 1e-3),
    "deviations in inches": _scaled([6], 1 / 25.4),
    "all in inches": _scaled([0, 1, 2, 6], 1 / 25.4),
    "radius of the probe": _numbers(_radius),
    "actual for nominal": _numbers(_actual),
    "columns MX and MY" + PLACES: _columns(0, 1, MEASURED),
    "columns MX and MZ" + PLACES: _columns(0, 2, MEASURED),
    "columns MY and MZ" + PLACES: _columns(1, 2, MEASURED),
    "places shuffled" + PLACES: _numbers(_places_shuffled, MEASURED),
    "places shifted by one" + PLACES: _numbers(_places_shifted, MEASURED),
}
"""By the compensated program where the original is not named."""


def main() -> None:
    from blind_parts.cutting import cut, probe, surface_of, write_csv
    from blind_parts.shop import surface_points, write_shop
    from blind_parts.table import share_interval
    from blind_parts.truth import draw_truth
    from postproc.base.findings import Refusal
    from postproc.learning.deviation_signs import SIGNS
    from postproc.workflows.learn import LearnRequest, learn
    from postproc.workflows.preparation import Request
    from postproc.workflows.program import compensate

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--draws", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=float("inf"), help="no draw starts after so many")
    parser.add_argument("--only", default=",".join(MISTAKES))
    parser.add_argument("--details", action="store_true")
    chosen = parser.parse_args()
    codes: dict[str, list[str]] = {name: [] for name in chosen.only.split(",")}
    with tempfile.TemporaryDirectory() as name:
        original = write_shop(Path(name) / "shop")
        shop, compensated = original.parent, original.parent / "compensated" / "part.src"
        compensate(Request(original, force=""))
        end = time.monotonic() + 60 * chosen.minutes
        for number in range(chosen.draws):
            if time.monotonic() > end:
                break
            rng = np.random.default_rng([chosen.seed + number, 31])
            surface = surface_of(shop, *surface_points(COUNT, rng))
            operations = [one for one in surface.program.operations.names if one != "tool 1"]
            truth = draw_truth(rng, operations)
            plant, every = truth.plant(), np.arange(COUNT)
            read = {
                program: probe(surface, cut(surface, truth, plant, None if program == original else program, rng),
                               every, NOISE, rng)
                for program in (compensated, original)
            }  # fmt: skip
            for mistake in codes:
                cut_by = original if mistake in ORIGINAL else compensated
                stated = original if mistake == "the original named" else cut_by
                path = shop / "m.csv"
                second = mistake.endswith(PLACES), mistake.endswith(CHECKED)
                write_csv(path, surface, every, read[cut_by], stated, NOISE, *second)
                path.write_text("\n".join([*MISTAKES[mistake](path.read_text().splitlines(), rng), ""]))
                repeated = "" if mistake in ONCE or any(second) else SIGNS[0]
                try:
                    request = LearnRequest(
                        Request(original, force=""), (path,), positive=repeated, dry_run=True
                    )
                    answer = "learnt" if learn(request).promise.better else "nothing written"
                except Refusal as refusal:
                    answer = refusal.findings[0].code
                    if chosen.details:
                        print(mistake, refusal.findings[0].message[:150])
                codes[mistake].append(answer)
    print(
        "| mistake | files | learnt from % | asked for a second statement % | nothing written | refused by |"
    )
    print("| --- " * 6 + "|")
    for mistake, answers in codes.items():
        refused = sorted({one for one in answers if one.startswith("LRN")})
        learnt, asked = (share_interval(answers.count(word), len(answers)) for word in ("learnt", "LRN020"))
        print(
            f"| {mistake} | {len(answers)} | {learnt} | {asked} | {answers.count('nothing written')}"
            f" | {', '.join(refused)} |"
        )
    wrong = [one for mistake, answers in codes.items() if mistake not in GOOD for one in answers]
    print(f"\n{wrong.count('learnt')} of {len(wrong)} files with a mistake are learnt from")


if __name__ == "__main__":
    main()
