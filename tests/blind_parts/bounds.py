"""The most that anybody could remove from the parts of the benchmark: how little the points determine at best.

    python -m tests.blind_parts.bounds [--draws 6]

Causes x ~ N(0, D^2) as the benchmark draws them, errors linear in x, a probe and a scatter of the forces from part to
part that are known exactly, nothing hidden, nothing lost between the points of the next program: of deviations r the
mean of x leaves errors with the covariance P = (D^-2 + S^T N^-1 S)^-1, and no method leaves a smaller one (Gauss and
Markov).  What a method really removes lies below: it knows none of these numbers.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).parent.parent))

import numpy as np

COUNTS = (20, 50, 100, 300)
TRUTHS = 200
"""Of each set of points."""


def _removed(errors: np.ndarray, scatter: np.ndarray, place: np.ndarray, known: np.ndarray, rest: np.ndarray):
    """(T,) share of the RMS that the next parts no longer have: columns ``errors`` (K, P) and ``scatter`` (K, G) of the
    causes and of the force of each operation, alignment ``place`` (K, 6); what is known (T, P) and remains (T, P)."""
    rng = np.random.default_rng(0)
    basis = np.linalg.qr(place)[0]
    errors, scatter = (one - basis @ (basis.T @ one) for one in (errors, scatter))
    parts = scatter @ rng.normal(size=(scatter.shape[1], len(rest)))
    after = errors @ rest.T + parts
    return 1 - np.linalg.norm(after, axis=0) / np.linalg.norm(after + errors @ known.T, axis=0)


def main() -> None:
    from blind_parts.cutting import surface_of
    from blind_parts.rows import NOISE, predicted, prepare_shops
    from blind_parts.shop import surface_points
    from blind_parts.truth import SCATTER, TURN_OFF
    from postproc.learning.causes import CauseKind
    from postproc.learning.covariance import FREE_SHIFT, FREE_TURN

    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--draws", type=int, default=6, help="sets of points a row")
    chosen = parser.parse_args()
    print(
        "| points | same place, removed %: median | 5th percentile | another place: median | 5th percentile |"
    )
    print("| --- " * 5 + "|")
    with tempfile.TemporaryDirectory() as folder:
        shops = prepare_shops(Path(folder))
        for count in COUNTS:
            shares = []
            for seed in range(chosen.draws):
                rng = np.random.default_rng([seed, count])
                points = surface_points(max(COUNTS), rng)
                models = []
                for shop in shops:
                    surface = surface_of(shop, *points)
                    prediction = predicted(surface)
                    deviations = np.array([
                        TURN_OFF / 3**0.5 if one.kind in (CauseKind.TURN_1, CauseKind.TURN_2) else one.deviation
                        for one in prediction.causes
                    ])  # fmt: skip
                    columns = prediction.columns(np.zeros(len(deviations)))
                    force = columns[:, [one.name for one in prediction.causes].index("force")]
                    which = surface.program.operations.which[surface.row]
                    scatter = SCATTER * force[:, None] * (which[:, None] == np.unique(which))
                    place = 1e-3 * (surface.point - surface.point.mean(axis=0))
                    rigid = np.concatenate([surface.normal, np.cross(place, surface.normal)], axis=1)
                    models.append((columns * deviations, scatter, rigid))
                columns, scatter, rigid = (one[:count] for one in models[0])
                free = rigid * ([FREE_SHIFT] * 3 + [FREE_TURN] * 3)
                noise = scatter @ scatter.T + free @ free.T + NOISE**2 * np.eye(count)
                size = columns.shape[1]
                left = np.linalg.inv(np.eye(size) + columns.T @ np.linalg.solve(noise, columns))
                values, vectors = np.linalg.eigh(left)
                draws = rng.normal(size=(2, TRUTHS, size))
                known = draws[0] * np.sqrt(np.maximum(1 - values, 0)) @ vectors.T
                rest = draws[1] * np.sqrt(np.maximum(values, 0)) @ vectors.T
                shares.append([_removed(*model, known, rest) for model in models])
            here, there = (np.concatenate([one[i] for one in shares]) for i in (0, 1))
            figures = [
                100 * f(one) for one in (here, there) for f in (np.median, lambda x: np.quantile(x, 0.05))
            ]
            print(f"| {count} | " + " | ".join(f"{one:.0f}" for one in figures) + " |")


if __name__ == "__main__":
    main()
